"""Drawings that a user's code adds to the viewer: frames, labels, lines and shapes, in the world or on a body."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from .. import _core
from ..arguments import text
from ..models.shapes import SIZES, Shape
from ..view.figure_data import number_text
from ..view.skeleton import BASE, Skeleton
from ..view.solids import triangles
from .live_scene import LiveScene

PART = 0.1
"""Length of a frame's axes, as a fraction of the model's reach."""
_COUNTS = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "ellipsoid": 3, "mesh": 3}


class Extras:
    """Added drawings by name.

    Attributes
    ----------
    given : dict, the checked arguments of `View.frame` and its siblings
    """

    def __init__(self) -> None:
        self.given: dict[str, dict[str, Any]] = {}

    def set(self, live: LiveScene, extra: dict[str, Any] | None, name: str) -> None:
        """Add or replace the drawing of a name; None removes it, or all if the name is empty. Invalid drawings raise ModelError."""
        if extra is not None:
            self.given[name] = _checked(live, extra, name)
        elif not name:
            self.given.clear()
        elif self.given.pop(name, None) is None:
            raise _core.ModelError(f"no drawing is called {name!r}; shown: {', '.join(map(repr, self.given)) or 'nothing'}")

    def shown(self, skeleton: Skeleton) -> list[dict[str, Any]]:
        """Return plain data for `drawExtra` of `web/figure.js`."""
        reach = float(np.ptp(skeleton.poses(skeleton.model.zero_q())[:, :3, 3], axis=0).max()) or 1.0
        return [{**extra, "size": extra.get("size") or PART * reach} for extra in self.given.values()]


def _checked(live: LiveScene, extra: dict[str, Any], name: str) -> dict[str, Any]:
    """Return plain data, with places in the frame of a body."""
    of, X = _carrier(live, extra["on"], name)
    colour = extra["colour"]
    if colour is not None and not (isinstance(colour, str) and re.fullmatch("#[0-9a-fA-F]{6}", colour)):
        raise _core.ModelError(f"{name}: colour must be '#rrggbb', not {colour!r:.40}")
    made: dict[str, Any] = {"kind": extra["kind"], "name": name, "of": of, "colour": colour}
    if extra["kind"] == "label":
        return made | {"text": text(extra["text"], "text"), "at": _moved(X, _points(extra["at"], f"{name}: at", 1))[0].tolist()}
    if extra["kind"] == "line":
        return made | {"points": _moved(X, _points(extra["points"], f"{name}: points", 2)).tolist()}
    pose = X @ _pose(extra["pose"], name)
    if extra["kind"] == "frame":
        size = extra["size"]
        if size is not None and not (isinstance(size, (int, float)) and 0 < size < np.inf):
            raise _core.ModelError(f"{name}: size must be a positive length in m, not {size!r:.40}")
        return made | {"at": pose[:3, 3].tolist(), "axes": pose[:3, :3].T.tolist(), "size": size}
    return made | {"solids": [_solid(extra, pose, of, name)]}


def _solid(extra: dict[str, Any], pose: np.ndarray, of: int, name: str) -> dict[str, Any]:
    kind = extra["shape"]
    if kind not in SIZES:
        raise _core.ModelError(f"{name}: unknown shape {kind!r:.40}; choose from {', '.join(SIZES)}")
    size = np.atleast_1d(_core.real_array(extra["size"], f"{name}: size"))
    if size.shape != (_COUNTS[kind],) or not np.all(np.isfinite(size) & (size > 0)):
        raise _core.ModelError(f"{name}: the size of a {kind} is {SIZES[kind]}: {_COUNTS[kind]} positive values, not {extra['size']!r:.60}")
    shape = Shape("", kind, tuple(float(x) for x in size), np.eye(4), extra["colour"], str(extra["file"]))
    vertices, faces = triangles(shape)
    return {
        "of": of, "colour": extra["colour"], "vertices": number_text(_moved(pose, vertices)), "faces": number_text(faces),
    }  # fmt: skip


def _carrier(live: LiveScene, on: Any, name: str) -> tuple[int, np.ndarray]:
    """Return the number of the carrying body (-1: the world), and the pose in its frame of the body or node named in `on`."""
    X = np.eye(4)
    called = getattr(on, "name", on)
    if called is None:
        return BASE, X
    if called in live.skeleton.bodies:
        return live.skeleton.bodies.index(called), X
    node = next((node for node in live.model.description()["nodes"] if node["name"] == called), None)
    if node is None:
        raise _core.ModelError(f"{name}: {live.model.name!r} has no body or node {called!r:.60}")
    X[:3, :3], X[:3, 3] = node["rotation"], node["position"]
    return node["body"], X


def _pose(given: Any, name: str) -> np.ndarray:
    """Return a pose or a position as (4, 4); the identity for None."""
    X = np.eye(4)
    if given is None:
        return X
    x = np.asarray(_core.real_array(given, f"{name}: pose"), float)
    if x.shape == (3,):
        X[:3, 3] = x
    elif x.shape == (4, 4):
        X = x
    if x.shape not in ((3,), (4, 4)) or not np.isfinite(X).all() or not np.allclose(X[:3, :3] @ X[:3, :3].T, np.eye(3), atol=1e-6):
        raise _core.ModelError(f"{name}: a pose must be a finite array (4, 4) with a rotation, or a position (3,)")
    return X


def _points(given: Any, what: str, dimensions: int) -> np.ndarray:
    x = np.asarray(_core.real_array(given, what), float)
    if x.ndim != dimensions or x.shape[-1] != 3 or not np.isfinite(x).all():
        raise _core.ModelError(f"{what} takes finite values in m of shape {'(3,)' if dimensions == 1 else '(n, 3)'}, not {x.shape}")
    return np.atleast_2d(x)


def _moved(X: np.ndarray, points: np.ndarray) -> np.ndarray:
    return np.asarray(points @ X[:3, :3].T + X[:3, 3])
