"""Runs as animated glTF 2.0: one node per body with its triangles, moved by keyframes. [The Khronos Group, glTF 2.0 Specification]"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..file_targets import writable_target
from .animated_bodies import AnimatedBodies, Solid, linear_colour

ENDINGS = (".glb", ".gltf")
_TO_Y_UP = {0: (0.0, 0.0, 0.5**0.5, 0.5**0.5), 1: (0.0, 0.0, 0.0, 1.0), 2: (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)}
"""Rotation x, y, z, w from the world's upright axis to y, which is upright in glTF."""


def checked_gltf(path: Any) -> Path:
    """Check, before a run, that glTF can be written to a path, with the errors of `to_gltf`."""
    target = writable_target(path, ENDINGS, "glTF")
    _pygltflib()
    return target


def to_gltf(run: Any, output: Any, fps: Any, speed: Any) -> Path:
    """`Run.to_gltf`."""
    target, seen = writable_target(output, ENDINGS, "glTF"), AnimatedBodies(run, fps, speed)
    pygltflib = _pygltflib()
    document = _Document(pygltflib, seen).made
    if target.suffix == ".gltf":
        document.convert_buffers(pygltflib.BufferFormat.DATAURI)
        target.write_text(document.to_json(), encoding="utf-8")
    else:
        target.write_bytes(b"".join(document.save_to_bytes()))
    return target


class _Document:
    """A glTF document with one binary buffer."""

    def __init__(self, pygltflib: Any, seen: AnimatedBodies):
        self._g, self._bytes = pygltflib, bytearray()
        self.made = pygltflib.GLTF2()
        self.made.asset = pygltflib.Asset(version="2.0", generator="PyCraft")
        self._materials: dict[str, int] = {}
        nodes = self.made.nodes
        nodes.append(pygltflib.Node(name=seen.model.name, rotation=list(_TO_Y_UP[seen.up]), children=[]))
        q, p = seen.quaternions(), seen.positions
        for k, name in enumerate(seen.names):
            mesh = self._mesh(name, [solid for solid in seen.solids if solid.of == k])
            nodes.append(pygltflib.Node(name=name, mesh=mesh, rotation=_plain(q[0, k]), translation=_plain(p[0, k])))
        base = self._mesh("base", [solid for solid in seen.solids if solid.of < 0])
        if base is not None:
            nodes.append(pygltflib.Node(name="base", mesh=base))
        nodes[0].children = list(range(1, len(nodes)))
        self.made.scenes.append(pygltflib.Scene(name=seen.model.name, nodes=[0]))
        self.made.scene = 0
        if len(seen.times) > 1 and seen.names:
            self.made.animations.append(self._animation(seen, q, p))
        self.made.buffers.append(pygltflib.Buffer(byteLength=len(self._bytes)))
        self.made.set_binary_blob(bytes(self._bytes))

    def _mesh(self, name: str, solids: list[Solid]) -> int | None:
        """Add one mesh of a body, with a primitive per solid."""
        if not solids:
            return None
        g, primitives = self._g, []
        for solid in solids:
            corners = solid.vertices[solid.faces].reshape(-1, 3)  # triangles do not share vertices: flat shading, with exact normals
            normals = np.repeat(_normals(solid), 3, axis=0)
            position = self._accessor(corners, g.VEC3, g.ARRAY_BUFFER, ends=True)
            attributes = g.Attributes(POSITION=position, NORMAL=self._accessor(normals, g.VEC3, g.ARRAY_BUFFER))
            primitives.append(g.Primitive(attributes=attributes, material=self._material(solid.colour)))
        self.made.meshes.append(g.Mesh(name=name, primitives=primitives))
        return len(self.made.meshes) - 1

    def _material(self, colour: str) -> int:
        if colour not in self._materials:
            shading = self._g.PbrMetallicRoughness(baseColorFactor=[*linear_colour(colour), 1.0], metallicFactor=0.1, roughnessFactor=0.6)
            self.made.materials.append(self._g.Material(name=colour, pbrMetallicRoughness=shading, doubleSided=True))
            self._materials[colour] = len(self.made.materials) - 1
        return self._materials[colour]

    def _animation(self, seen: AnimatedBodies, q: np.ndarray, p: np.ndarray) -> Any:
        g = self._g
        animation = g.Animation(name="run", samplers=[], channels=[])
        times = self._accessor(seen.times, g.SCALAR, None, ends=True)
        for k in range(len(seen.names)):
            for path, values, kind in (("rotation", q[:, k], g.VEC4), ("translation", p[:, k], g.VEC3)):
                animation.samplers.append(
                    g.AnimationSampler(input=times, output=self._accessor(values, kind, None), interpolation="LINEAR")
                )
                channel = g.AnimationChannelTarget(node=k + 1, path=path)
                animation.channels.append(g.AnimationChannel(sampler=len(animation.samplers) - 1, target=channel))
        return animation

    def _accessor(self, values: np.ndarray, kind: str, target: int | None, ends: bool = False) -> int:
        """Add values in single precision, with the least and the largest if the specification requires them."""
        x = np.ascontiguousarray(values, "<f4")
        data = x.tobytes()
        self.made.bufferViews.append(self._g.BufferView(buffer=0, byteOffset=len(self._bytes), byteLength=len(data), target=target))
        self._bytes += data  # in single precision all offsets are multiples of four
        rows = x.reshape(len(x), -1)
        least = {"min": _plain(rows.min(axis=0)), "max": _plain(rows.max(axis=0))} if ends else {}
        self.made.accessors.append(
            self._g.Accessor(bufferView=len(self.made.bufferViews) - 1, componentType=self._g.FLOAT, count=len(x), type=kind, **least)
        )
        return len(self.made.accessors) - 1


def _normals(solid: Solid) -> np.ndarray:
    """Return unit normals (m, 3) of the faces; z for triangles without area."""
    a, b, c = (solid.vertices[solid.faces[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(sizes > 0, normals / np.where(sizes > 0, sizes, 1.0), [0.0, 0.0, 1.0])


def _plain(x: np.ndarray) -> list[float]:
    return [float(value) for value in x]


def _pygltflib() -> Any:
    try:
        import pygltflib
    except ImportError:
        raise _core.EvaluationError(
            "glTF output needs the package pygltflib, which is not installed: pip install 'pycraft-soa[gltf]'"
        ) from None
    return pygltflib
