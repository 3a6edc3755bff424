"""Skeleton of a model: points and lines fixed on bodies, found once and placed for any state.

hinge points   where a hinge's axes meet the bodies: on the parent, and on the moved body
bones          from a body's hinge point to its children's; for a body without children, to its nodes or to the end of its mass
ties           from the hinge point of a body with children to its nodes
slides         between the two points of a hinge that moves along its axes, or whose axes do not meet
axes           axes of the first and the last subhinge with an axis

The end of a body's mass lies beyond its centre of mass c along e, away from the hinge point, by √(3 e·Se/m), half of the uniform rod with
the same mass and second moment along e; S = ½ tr(𝓘) 1 - 𝓘. A body with c at its hinge point has three such bones through c, along the
principal axes of S.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from .solids import solids

BASE = -1
"""Body number of the base."""
_FAR = 10.0
"""A base farther from its children than this many times their extent is not shown at its origin."""
_LEVEL = 1e-9
"""Tolerance on a plane's normal for axes and points."""


class Skeleton:
    """Points and lines of a model.

    Parameters
    ----------
    model : Multibody

    Attributes
    ----------
    names, kinds : of the hinges, in the bodies' order
    points : dict
        By kind ("joint", "node", "mass"): owners (n,), numbers of bodies, -1 the base, and places (n, 3) in their frames, m.
    lines : dict
        By kind ("bone", "tie", "slide", "ground"): owners and places of both ends, (n, 2) and (n, 2, 3).
    axes : hinge (n,), owner (n,), point (n, 3), direction (n, 3)
    masses : (n,), kg, of the points "mass"
    """

    def __init__(self, model: Any):
        described = model.description()
        self.model = model
        self.bodies = [body["name"] for body in described["bodies"]]
        self.names = [body["hinge"]["name"] for body in described["bodies"]]
        self.kinds = [body["hinge"]["kind"] for body in described["bodies"]]
        self._points: dict[str, list[tuple[int, np.ndarray]]] = {"joint": [], "node": [], "mass": []}
        self._lines: dict[str, list[tuple[tuple[int, np.ndarray], tuple[int, np.ndarray]]]]
        self._lines = {"bone": [], "tie": [], "slide": [], "ground": []}
        self._axes: list[tuple[int, int, np.ndarray, np.ndarray]] = []
        self.masses = np.array([body["mass"] for body in described["bodies"] if body["mass"]])
        hinge_points = [self._hinge(k, body) for k, body in enumerate(described["bodies"])]
        self._bones(described["bodies"], described["nodes"], hinge_points)
        self.points = {kind: (_owners(points), _places(points)) for kind, points in self._points.items()}
        ends = {kind: [point for line in lines for point in line] for kind, lines in self._lines.items()}
        self.lines = {kind: (_owners(of).reshape(-1, 2), _places(of).reshape(-1, 2, 3)) for kind, of in ends.items()}
        hinge, owner = (np.array([axis[i] for axis in self._axes], int) for i in (0, 1))
        point, direction = (np.array([axis[i] for axis in self._axes]).reshape(-1, 3) for i in (2, 3))
        self.axes = hinge, owner, point, direction

    # ------------------------------------------------------------------ points and lines on bodies
    def _hinge(self, k: int, body: dict[str, Any]) -> tuple[int, np.ndarray]:
        """Record a hinge; return its point on the moved body."""
        hinge, parent = body["hinge"], body["parent"]
        R, p = hinge["placement"]["rotation"], hinge["placement"]["position"]
        subhinges = hinge["subhinges"]
        turning = [s["point"] for s in subhinges if s["kind"] not in ("slider", "free")]
        inner, outer = (turning[0], turning[-1]) if turning else (np.zeros(3), np.zeros(3))
        inboard, outboard = (parent, p + R @ inner), (k, outer)
        self._points["joint"].append(outboard)
        loose = any(s["kind"] == "free" for s in subhinges)
        if not loose and (any(s["kind"] in ("slider", "screw") for s in subhinges) or not np.array_equal(inner, outer)):
            self._lines["slide"].append((inboard, outboard))
        if not loose:
            self._lines["ground" if parent < 0 else "bone"].append(((BASE, np.zeros(3)) if parent < 0 else (parent, np.zeros(3)), inboard))
        along = [s["axis"] for s in subhinges if _core.subhinge_kinds[s["kind"]].axis]
        if along:
            self._axes.append((k, k, outer, along[-1]))
        if along and hinge["kind"] != "planar" and not np.array_equal(along[0], along[-1]):
            self._axes.append((k, parent, inboard[1], R @ along[0]))
        if body["mass"]:
            self._points["mass"].append((k, body["com"]))
        return outboard

    def _bones(self, bodies: list[dict[str, Any]], nodes: list[dict[str, Any]], hinge_points: list[tuple[int, np.ndarray]]) -> None:
        """Add the bones, which begin at hinge points; for bodies without children they end at nodes or at the end of the mass."""
        self._lines["bone"] = [(hinge_points[end[0]], end) for _, end in self._lines["bone"]]
        extents = {k: _extent(body, hinge_points[k][1]) for k, body in enumerate(bodies)}
        for (carrier, _), _ in self._lines["bone"]:  # a free hinge has no bone
            extents.pop(carrier, None)
        with_nodes = set()
        for node in nodes:
            k, at = node["body"], (node["body"], node["position"])
            self._points["node"].append(at)
            start = hinge_points[k] if k >= 0 else (BASE, np.zeros(3))
            reach = max((np.ptp(line, axis=0).max() for line in extents.get(k, ())), default=0.0)
            ends_there = k in extents and bool(np.linalg.norm(at[1] - start[1]) > 0.1 * reach)
            with_nodes |= {k} if ends_there else set()
            self._lines["bone" if ends_there else "tie"].append((start, at))
        for k in extents.keys() - with_nodes:
            self._lines["bone"] += [((k, start), (k, end)) for start, end in extents[k]]

    # ------------------------------------------------------------------ places at a state
    def poses(self, q: np.ndarray) -> np.ndarray:
        """Return poses (..., n + 1, 4, 4) of the bodies in the world at q (..., nq); the last, index -1, is the base's."""
        q = np.asarray(q, float)
        poses = np.empty((*q.shape[:-1], len(self.bodies) + 1, 4, 4))
        poses[..., BASE, :, :] = np.eye(4)
        for k, body in enumerate(self.bodies):
            poses[..., k, :, :] = self.model.pose(body, q)
        return poses

    @cached_property
    def solids(self) -> tuple[list[dict[str, Any]], list[str]]:
        """Return triangles of the model's shapes, and why others are not shown: see `solids`."""
        return solids(self.model)

    def is_loose(self) -> bool:
        """Return True if the model is free: every body on the base has a free hinge."""
        roots = [kind for kind, body in zip(self.kinds, self.model.description()["bodies"], strict=True) if body["parent"] < 0]
        return bool(roots) and all(kind == "free" for kind in roots)

    def is_grounded(self) -> bool:
        """Return True if the base is shown at its origin: unless the origin is far from the bodies."""
        poses = self.poses(self.model.zero_q())
        hinges = placed(poses, *self.lines["ground"])[:, 1]
        carried = np.concatenate([hinges, *(placed(poses, *self.points[kind]) for kind in ("joint", "mass"))])
        reach = np.ptp(carried, axis=0).max() if len(carried) else 0.0
        return bool(reach == 0 or not len(hinges) or np.linalg.norm(hinges, axis=1).min() <= _FAR * reach)

    def normals(self) -> tuple[int, ...]:
        """Return normals (0, 1, 2 for x, y, z) of the coordinate planes that the model can never leave; none for most models."""
        poses = self.poses(self.model.zero_q())
        described = self.model.description()["bodies"]
        fixed = (*self.points.values(), self.lines["slide"], self.lines["ground"])
        everything = np.concatenate([placed(poses, *points).reshape(-1, 3) for points in fixed])
        if not any(body["hinge"]["subhinges"] for body in described):
            return ()
        widths = np.ptp(everything, axis=0)
        normals = [n for n in range(3) if widths[n] <= _LEVEL * widths.max()]
        for body in described:
            R = poses[body["parent"], :3, :3] @ body["hinge"]["placement"]["rotation"]
            normals = [n for n in normals if all(_stays(subhinge, R, n) for subhinge in body["hinge"]["subhinges"])]
        return tuple(normals)


def placed(poses: np.ndarray, owners: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return points in the world, (..., *owners.shape, 3), from places in the frames of their owners."""
    X = poses[..., owners, :, :]
    return np.einsum("...ij,...j->...i", X[..., :3, :3], places) + X[..., :3, 3]


def turned(poses: np.ndarray, owners: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return directions in the world, from directions in the frames of their owners."""
    return np.einsum("...ij,...j->...i", poses[..., owners, :3, :3], directions)


def _stays(subhinge: dict[str, Any], R: np.ndarray, n: int) -> bool:
    """Return True if a subhinge stays in a plane: it turns about the plane's normal, or slides along the plane."""
    along = abs((R @ subhinge["axis"])[n])
    return subhinge["kind"] == "pin" and along >= 1 - _LEVEL or subhinge["kind"] == "slider" and along <= _LEVEL


def _extent(body: dict[str, Any], hinge_point: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return lines in the body's frame to the end of its mass; none for a body without mass."""
    if not body["mass"]:
        return []
    second = (np.trace(body["inertia"]) / 2 * np.eye(3) - body["inertia"]) / body["mass"]
    com, away = body["com"], body["com"] - hinge_point
    moments, directions = np.linalg.eigh(second)
    halves = np.sqrt(3 * np.clip(moments, 0, None))
    distance = np.linalg.norm(away)
    if distance > 0.1 * halves.max():
        e = away / distance
        return [(hinge_point, com + e * np.sqrt(3 * max(e @ second @ e, 0.0)))]
    return [(com - half * e, com + half * e) for half, e in zip(halves, directions.T, strict=True) if half > 1e-3 * halves.max()]


def _owners(points: list[tuple[int, np.ndarray]]) -> np.ndarray:
    return np.array([owner for owner, _ in points], int)


def _places(points: list[tuple[int, np.ndarray]]) -> np.ndarray:
    return np.array([place for _, place in points], float).reshape(-1, 3)
