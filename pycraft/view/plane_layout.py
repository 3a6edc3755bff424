"""Where the bodies of a tree are drawn in a picture: on the model as it stands, or as a diagram of the tree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .skeleton import Skeleton, placed

_AZIMUTH, _ELEVATION = -60.0, 20.0  # degrees, as figures in space are seen


@dataclass(frozen=True)
class PlaneLayout:
    """Bodies and lines in a plane, x to the right and y down, in the units of the picture.

    Attributes
    ----------
    bodies : (n, 2)
    base : (2,)
    bones : (m, 2, 2) lines of the figure beside those from body to body; none of a diagram
    owners : (m,) numbers of the bodies that the bones are fixed on at their first end, -1 the base
    axes : (n, 2, 3) what is seen of each body's frame: rows are the picture's x and y, columns the frame's axes; None of a diagram
    """

    bodies: np.ndarray
    base: np.ndarray
    bones: np.ndarray
    owners: np.ndarray
    axes: np.ndarray | None


def tree_layout(parents: Sequence[int], width: float, height: float, margin: float) -> PlaneLayout:
    """Leaves side by side, a body above the middle of what it carries, the base at the foot. O(N)."""
    n = len(parents)
    children: list[list[int]] = [[] for _ in range(n + 1)]
    for k, p in enumerate(parents):
        children[p].append(k)  # -1: the base, last
    depth = np.zeros(n + 1)
    for k, p in enumerate(parents):
        depth[k] = depth[p] + 1 if p >= 0 else 1
    x, leaves, stack = np.zeros(n + 1), 0, [-1]
    order: list[int] = []
    while stack:
        k = stack.pop()
        order.append(k)
        if not children[k]:
            x[k], leaves = leaves, leaves + 1
        stack += reversed(children[k])
    for k in reversed(order):
        if children[k]:
            x[k] = np.mean(x[children[k]])
    spread = (x + 0.5) / max(leaves, 1)
    level = depth / max(depth.max(), 1)
    places = np.column_stack([margin + spread * (width - 2 * margin), height - margin - level * (height - 2 * margin)])
    return PlaneLayout(places[:-1], places[-1], np.zeros((0, 2, 2)), np.zeros(0, int), None)


def model_layout(model: Any, q: Any, width: float, height: float, margin: float, radius: float) -> PlaneLayout:
    """The model's sticks at q, seen as `StickFigure` shows them; hinge points at one place are drawn side by side. O(N · depth)."""
    skeleton = Skeleton(model)
    poses = skeleton.poses(np.asarray(q, float))
    seen = _seen(skeleton, model)
    hinges = placed(poses, *skeleton.points["joint"]) @ seen.T
    kinds = ("bone", "slide", "ground", "tie")
    lines = [placed(poses, *skeleton.lines[kind]) @ seen.T for kind in kinds if len(skeleton.lines[kind][0])]
    bones = np.concatenate(lines) if lines else np.zeros((0, 2, 2))
    owners = np.concatenate([skeleton.lines[kind][0][:, 0] for kind in kinds])
    everything = np.concatenate([hinges, bones.reshape(-1, 2), np.zeros((1, 2))])
    low, high = everything.min(axis=0), everything.max(axis=0)
    scale = min((width - 2 * margin) / max(high[0] - low[0], 1e-12), (height - 2 * margin) / max(high[1] - low[1], 1e-12))
    scale = scale if np.isfinite(scale) and (high > low).any() else 1.0
    middle = (low + high) / 2

    def picture(points: np.ndarray) -> np.ndarray:
        moved = (points - middle) * scale
        return np.stack([width / 2 + moved[..., 0], height / 2 - moved[..., 1]], axis=-1)

    bodies = _side_by_side(picture(hinges), 2.2 * radius)
    flip = np.array([[1.0], [-1.0]])
    axes = np.array([flip * (seen @ poses[k, :3, :3]) for k in range(len(bodies))])
    return PlaneLayout(bodies, picture(np.zeros(2)), picture(bones), owners, axes)


def _seen(skeleton: Skeleton, model: Any) -> np.ndarray:
    """(2, 3): the picture's axes, right and up, in the world."""
    flat = skeleton.normals()
    if flat:
        right, up = {1: (0, 2), 2: (0, 1), 0: (1, 2)}[next(n for n in (1, 2, 0) if n in flat)]
        return np.eye(3)[[right, up]]
    gravity = np.abs(model.gravity)
    vertical = int(np.argmax(gravity)) if gravity.any() else 2
    a, e = np.deg2rad(_AZIMUTH), np.deg2rad(_ELEVATION)
    seen = np.array([[-np.sin(a), np.cos(a), 0.0], [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]])
    return np.roll(seen, vertical - 2, axis=1)


def _side_by_side(places: np.ndarray, apart: float) -> np.ndarray:
    """Points nearer than `apart` to one before them go to its right."""
    out = np.array(places)
    for k in range(len(out)):
        while k and (near := np.linalg.norm(out[:k] - out[k], axis=1) < 0.95 * apart).any():
            out[k, 0] = out[:k][near][:, 0].max() + apart
    return out
