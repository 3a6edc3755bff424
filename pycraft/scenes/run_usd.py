"""Runs as USD: one transform per body with time samples, and its triangles below. [OpenUSD, UsdGeom]"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..file_targets import writable_target
from .animated_bodies import AnimatedBodies, Solid, linear_colour

ENDINGS = (".usda", ".usdc", ".usd")


def checked_usd(path: Any) -> Path:
    """Check, before a run, that USD can be written to a path, with the errors of `to_usd`."""
    target = writable_target(path, ENDINGS, "USD")
    _usd()
    return target


def to_usd(run: Any, output: Any, fps: Any, speed: Any) -> Path:
    """`Run.to_usd`."""
    target = checked_usd(output)
    Gf, Usd, UsdGeom, Vt = _usd()
    seen = AnimatedBodies(run, fps, speed)
    stage = Usd.Stage.CreateInMemory()
    rate = float(fps)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(0.0)
    stage.SetEndTimeCode(float(seen.times[-1] * rate))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y if seen.up == 1 else UsdGeom.Tokens.z)
    names = _identifiers([seen.model.name or "model", *seen.names, "base"])
    root = UsdGeom.Xform.Define(stage, f"/{names[0]}")
    if seen.up == 0:  # in USD, y or z is upright
        root.AddRotateYOp().Set(-90.0)
    stage.SetDefaultPrim(root.GetPrim())
    for k, name in [*enumerate(seen.names), (-1, "base")]:
        solids = [solid for solid in seen.solids if solid.of == k]
        if k < 0 and not solids:
            continue
        body = UsdGeom.Xform.Define(stage, f"/{names[0]}/{names[k + 1] if k >= 0 else names[-1]}")
        body.GetPrim().SetDisplayName(name)
        if k >= 0:
            _move(body.AddTransformOp(), seen, k, rate, Gf)
        for i, solid in enumerate(solids):
            _mesh(UsdGeom.Mesh.Define(stage, f"{body.GetPath()}/shape{i}"), solid, Gf, Vt)
    if not stage.GetRootLayer().Export(str(target)):
        raise OSError(f"output {str(output)!r}: usd-core failed to write it")
    return target


def _move(operation: Any, seen: AnimatedBodies, k: int, rate: float, Gf: Any) -> None:
    """Set the pose of a body over time; USD multiplies row vectors, so its matrix is the transpose."""
    X = np.broadcast_to(np.eye(4), (len(seen.times), 4, 4)).copy()
    X[:, :3, :3], X[:, :3, 3] = seen.rotations[:, k], seen.positions[:, k]
    for t, pose in zip(seen.times, X, strict=True):
        operation.Set(Gf.Matrix4d(pose.T.tolist()), float(t * rate))


def _mesh(mesh: Any, solid: Solid, Gf: Any, Vt: Any) -> None:
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(solid.vertices, np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(solid.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(solid.faces, np.int32).ravel()))
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateDoubleSidedAttr(True)
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray([low, high], np.float32)))
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*linear_colour(solid.colour))])


def _identifiers(names: list[str]) -> list[str]:
    """Return unique names for USD, of letters, digits and underscores."""
    found: list[str] = []
    for name in names:
        made = re.sub(r"\W", "_", name, flags=re.ASCII) or "_"
        made = f"_{made}" if made[0].isdigit() else made
        while made in found:
            made += "_"
        found.append(made)
    return found


def _usd() -> tuple[Any, ...]:
    try:
        from pxr import Gf, Usd, UsdGeom, Vt
    except ImportError:
        raise _core.EvaluationError(
            "USD output needs the package usd-core, which is not installed: pip install 'pycraft-soa[usd]'"
        ) from None
    return Gf, Usd, UsdGeom, Vt
