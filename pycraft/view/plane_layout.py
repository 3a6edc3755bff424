"""Places of the bodies of a tree in a picture: on the model at its state, or as a diagram of the tree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..models.tree_places import tree_places
from .skeleton import Skeleton, placed

MOST = 300
"""Largest number of hinges for which coinciding hinges are drawn side by side; the search visits all pairs."""
_AZIMUTH, _ELEVATION = -60.0, 20.0  # degrees, as for figures in space


@dataclass(frozen=True)
class PlaneLayout:
    """Bodies and lines in a plane, x to the right and y down, in the units of the picture.

    Attributes
    ----------
    bodies : (n, 2)
    base : (2,)
    bones : (m, 2, 2) lines of the figure in addition to the lines from body to body; empty for a diagram
    owners : (m,) numbers of the bodies at the first end of the bones, -1 the base
    axes : (n, 2, 3) projection of each body's frame: rows are the picture's x and y, columns the frame's axes; None for a diagram
    """

    bodies: np.ndarray
    base: np.ndarray
    bones: np.ndarray
    owners: np.ndarray
    axes: np.ndarray | None


def layout_of(expression: Any, source: Any, on: str, width: float, height: float, radius: float) -> PlaneLayout:
    """Return the layout of the bodies of a source: its model at the state (the first of a batch) to which the expression is bound, else at
    its present state. With
    on="tree", or if the bodies belong to no model, a diagram of the tree."""
    model = getattr(source, "model", None)
    if on == "robot" and isinstance(model, _core.Multibody) and list(getattr(model, "bodies", ())) == list(source.body_names):
        state = getattr(expression, "_state", None)
        q = np.asarray(model.q if state is None else state[0], float)
        return model_layout(model, q.reshape(-1, q.shape[-1])[0], width, height, 4 * radius, radius)
    return tree_layout(list(source.parents), width, height, 4 * radius)


def tree_layout(parents: Sequence[int], width: float, height: float, margin: float) -> PlaneLayout:
    """Return a diagram: leaves side by side, each body above the middle of its children, the base at the foot. O(N)."""
    x, level = tree_places(parents).T
    places = np.column_stack([margin + x * (width - 2 * margin), height - margin - level * (height - 2 * margin)])
    return PlaneLayout(places[:-1], places[-1], np.zeros((0, 2, 2)), np.zeros(0, int), None)


def model_layout(model: Any, q: Any, width: float, height: float, margin: float, radius: float) -> PlaneLayout:
    """Return the model's sticks at q in the view of `StickFigure`; coinciding hinge points are drawn side by side. O(N · depth)."""
    return model_layouts(model, np.asarray(q, float)[None], width, height, margin, radius)[0]


def model_layouts(model: Any, q: np.ndarray, width: float, height: float, margin: float, radius: float) -> list[PlaneLayout]:
    """Return the layouts at several states (n, nq), all in one box, so that fixed points stay fixed in the picture."""
    skeleton = Skeleton(model)
    poses = skeleton.poses(q)
    seen = _seen(skeleton, model)
    hinges = placed(poses, *skeleton.points["joint"]) @ seen.T
    kinds = ("bone", "slide", "ground", "tie")
    lines = [placed(poses, *skeleton.lines[kind]) @ seen.T for kind in kinds if len(skeleton.lines[kind][0])]
    bones = np.concatenate(lines, axis=1) if lines else np.zeros((len(q), 0, 2, 2))
    owners = np.concatenate([skeleton.lines[kind][0][:, 0] for kind in kinds])
    everything = np.concatenate([hinges.reshape(-1, 2), bones.reshape(-1, 2), np.zeros((1, 2))])
    low, high = everything.min(axis=0), everything.max(axis=0)
    scale = min((width - 2 * margin) / max(high[0] - low[0], 1e-12), (height - 2 * margin) / max(high[1] - low[1], 1e-12))
    scale = scale if np.isfinite(scale) and (high > low).any() else 1.0
    middle = (low + high) / 2

    def picture(points: np.ndarray) -> np.ndarray:
        moved = (points - middle) * scale
        return np.stack([width / 2 + moved[..., 0], height / 2 - moved[..., 1]], axis=-1)

    flip, base = np.array([[1.0], [-1.0]]), picture(np.zeros(2))
    return [
        PlaneLayout(
            _side_by_side(picture(hinges[i]), 2.2 * radius), base, picture(bones[i]), owners,
            np.array([flip * (seen @ poses[i, k, :3, :3]) for k in range(hinges.shape[1])]),
        )
        for i in range(len(q))
    ]  # fmt: skip


def _seen(skeleton: Skeleton, model: Any) -> np.ndarray:
    """Return the picture's axes, right and up, in the world, (2, 3)."""
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
    """Shift points nearer than `apart` to an earlier point to its right, if there are at most `MOST` points. O(n²)."""
    if len(places) > MOST:
        return places
    out = np.array(places)
    for k in range(len(out)):
        while k and (near := np.linalg.norm(out[:k] - out[k], axis=1) < 0.95 * apart).any():
            out[k, 0] = out[:k][near][:, 0].max() + apart
    return out
