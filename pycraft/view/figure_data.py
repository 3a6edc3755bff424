"""A model's skeleton as plain data for a self-contained page: points and lines fixed on bodies, and the bodies' poses."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from .colour_scale import ramp
from .skeleton import Skeleton, placed
from .stick_figure import HINGES

_FLAT_AXES = {1: (0, 2), 2: (0, 1), 0: (1, 2)}
"""Axes to the right and upwards in a plane, by its normal."""
_THIN = 0.18
"""Least width of the box in view, as a fraction of its largest width."""
_BELOW = 0.05
"""Largest reach below the base of a standing model, as a fraction of its width."""


def figure_data(skeleton: Skeleton, q: np.ndarray) -> dict[str, Any]:
    """Return the data that `web/figure.js` draws.

    Parameters
    ----------
    skeleton : Skeleton
    q : (..., nq)
        States whose bodies the first view includes.

    Returns
    -------
    dict
        Plain data: names of bodies, the number of each parent (-1 the base), their hinges; points and lines by kind, with
        the numbers of bodies ("of") and places in their frames ("at", m); axes of hinges and half of their drawn length,
        m; the camera's axes "right" and "up" in the world, the box in view ("centre" and "half", m; "near", half of the first state's),
        the height of the floor (the base, unless the model hangs below it at the first state); "ramp", the colours of values;
        "solids", triangles of shapes by their bodies, and "unshown", why other shapes are missing.
    """
    described = skeleton.model.description()["bodies"]
    hinge, owner, point, direction = skeleton.axes
    flat = skeleton.normals()
    right, up = _FLAT_AXES[next(n for n in _FLAT_AXES if n in flat)] if flat else upright(skeleton.model)
    colours = [None if kind == "custom" else HINGES[kind][1] for kind in skeleton.kinds]
    shapes, missing = skeleton.solids
    data: dict[str, Any] = {
        "name": skeleton.model.name, "bodies": skeleton.bodies, "parents": [body["parent"] for body in described],
        "hinges": skeleton.names, "kinds": skeleton.kinds, "colours": colours, "flat": bool(flat), "grounded": skeleton.is_grounded(),
        "points": {kind: {"of": of.tolist(), "at": _rounded(at)} for kind, (of, at) in skeleton.points.items()},
        "lines": {kind: {"of": of.tolist(), "at": _rounded(at)} for kind, (of, at) in skeleton.lines.items()},
        "axes": {"hinge": hinge.tolist(), "of": owner.tolist(), "at": _rounded(point), "along": _rounded(direction)},
        "right": np.eye(3)[right].tolist(), "up": np.eye(3)[up].tolist(), "ramp": ramp(), "unshown": missing,
        "solids": [solid | {name: number_text(solid[name]) for name in ("vertices", "faces")} for solid in shapes],
    }  # fmt: skip
    return data | _box(skeleton, np.asarray(q, float), data["grounded"], up, [(solid["of"], solid["vertices"]) for solid in shapes])


def pose_rows(skeleton: Skeleton, q: np.ndarray) -> np.ndarray:
    """Return the poses of all bodies at q (..., nq) as rows (..., 12 n) of [R p], body after body, in single precision."""
    poses = skeleton.poses(q)[..., :-1, :3, :]
    return poses.reshape(*poses.shape[:-3], -1).astype("<f4")


def number_text(x: Any) -> str:
    """Return numbers in single precision as text, for `numbers` of `web/figure.js`."""
    return base64.b64encode(np.ascontiguousarray(x, "<f4").tobytes()).decode("ascii")


def upright(model: Any) -> tuple[int, int]:
    """Return the axes (0, 1, 2 for x, y, z) to the right and upwards in a picture: upwards the axis nearest to gravity, else z."""
    gravity = np.abs(model.gravity)
    up = int(np.argmax(gravity)) if gravity.any() else 2
    return (up + 1) % 3, up


def _rounded(x: np.ndarray) -> Any:
    """Return the values with the digits of single precision."""
    return [float(f"{number:.7g}") for number in x] if x.ndim == 1 else [_rounded(row) for row in x]


def _corners(vertices: np.ndarray) -> np.ndarray:
    """Return the corners (8, 3) of the box around the points."""
    ends = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def _box(skeleton: Skeleton, q: np.ndarray, grounded: bool, up: int, solid: list[tuple[int, np.ndarray]]) -> dict[str, Any]:
    poses = skeleton.poses(q)
    shown = _shown_points(skeleton, poses, grounded, solid)
    loose = skeleton.is_loose()  # then the box of the first state excludes the base
    first = _shown_points(skeleton, poses.reshape(-1, *poses.shape[-3:])[0], grounded and not loose, solid)
    low, high, half = _extent_of(shown)
    reach = float((high - low).max()) or 1.0
    bones = np.linalg.norm(np.diff(placed(poses, *skeleton.lines["bone"]), axis=-2), axis=-1)
    typical = float(np.median(bones[bones > 1e-9 * reach])) if np.any(bones > 1e-9 * reach) else reach
    return {
        "centre": _rounded((low + high) / 2), "half": _rounded(half), "near": _rounded(_extent_of(first)[2]),
        "floor": float(f"{_floor(first, low, loose, up, solid):.7g}"), "tick": float(f"{min(0.045 * reach, 0.4 * typical):.7g}"),
    }  # fmt: skip


def _shown_points(skeleton: Skeleton, poses: np.ndarray, grounded: bool, solid: list[tuple[int, np.ndarray]]) -> np.ndarray:
    """Return all drawn points, (n, 3): points, ends of lines, corners of shapes, and the base's origin if it is shown."""
    kinds = [kind for kind in skeleton.lines if kind != "ground" or grounded]
    shown = (*skeleton.points.values(), *(skeleton.lines[kind] for kind in kinds))
    corners = [(np.full(8, of), _corners(vertices)) for of, vertices in solid]
    found = np.concatenate([*(placed(poses, *at).reshape(-1, 3) for at in (*shown, *corners)), np.zeros((int(grounded), 3))])
    return np.asarray(found[np.isfinite(found).all(axis=1)])


def _extent_of(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the ends of a box around points, and half of its edges with a margin, enlarged where the box is thin."""
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.zeros(3))
    reach = float((high - low).max()) or 1.0
    return low, high, np.maximum((high - low) / 2, _THIN * reach) + 0.06 * reach


def _floor(first: np.ndarray, low: np.ndarray, loose: bool, up: int, solid: list[tuple[int, np.ndarray]]) -> float:
    """Return the height of the floor: under the base of a standing model, under a loose model's first state, or under all points."""
    lowest = float(first[:, up].min(initial=np.inf))
    if loose:
        return lowest if np.isfinite(lowest) else float(low[up])
    base = min([0.0, *(float(vertices[:, up].min()) for of, vertices in solid if of < 0)])
    reach = float(np.ptp(first, axis=0).max()) if len(first) else 0.0
    return base if lowest >= base - _BELOW * reach else float(low[up])
