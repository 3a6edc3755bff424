"""Poses and Jacobians of frames as straight-line code."""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np

from .kinematics import Kinematics, Pose, composed, force_transform
from .trace import Graph

_STILL: Pose = (np.array(np.eye(3).tolist(), object), np.full(3, 0.0, object))


def frame_graph(model: Any, call: str, frame: str) -> tuple[Graph, np.ndarray]:
    """Return the graph of "pose" or "jacobian" of a frame of the model, and the nodes of its result."""
    graph = Graph()
    at = Kinematics(model, graph)
    description = model.description()
    bodies, nodes = description["bodies"], {n["name"]: n for n in description["nodes"]}
    names = [b["name"] for b in bodies]
    if frame in nodes:
        node = nodes[frame]
        body, own = node["body"], (node["rotation"].astype(object), node["position"].astype(object))
    else:
        body, own = names.index(frame), _STILL
    if call == "pose":
        path: list[Pose] = []
        while body >= 0:
            path.insert(0, at.poses[body])
            body = bodies[body]["parent"]
        R, l = reduce(composed, [*path, own], _STILL)
        return graph, _nodes(graph, np.vstack([np.column_stack([R, l]), [0.0, 0.0, 0.0, 1.0]]))
    starts = np.cumsum([0, *map(len, at.H)])
    J = np.full((6, model.nv), 0.0, object)
    while body >= 0:
        if len(at.H[body]):
            J[:, starts[body] : starts[body + 1]] = force_transform(own).T @ at.H[body].T
        own = composed(at.poses[body], own)
        body = bodies[body]["parent"]
    return graph, _nodes(graph, J)


def _nodes(graph: Graph, entries: np.ndarray) -> np.ndarray:
    return np.array([graph.number(x).index for x in entries.ravel()], int).reshape(entries.shape)
