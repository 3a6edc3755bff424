"""Parts of models, and the same bodies as models of their own, built from the description without the parts' code."""

import numpy as np

import pycraft as pc


def names_of(parents, rng, size):
    """Numbers of a random connected set of so many bodies of a tree, or fewer where there are no more."""
    chosen = {int(rng.integers(len(parents)))}
    while len(chosen) < size:
        beside = {k for k, p in enumerate(parents) if k not in chosen and p in chosen} | {parents[k] for k in chosen} - chosen - {-1}
        if not beside:
            break
        chosen.add(int(rng.choice(sorted(beside))))
    return sorted(chosen)


def alone(model, bodies, moving=False):
    """The named bodies of a model as a model of its own on a base; where that moves, on a massless body with a free hinge."""
    data = model.description()
    kept = [body for body in data["bodies"] if body["name"] in bodies]
    old = [k for k, body in enumerate(data["bodies"]) if body["name"] in bodies]
    number = {k: i + moving for i, k in enumerate(old)}
    base = 0 if moving else -1
    own = [{**body, "parent": number.get(body["parent"], base)} for body in kept]
    if moving:
        free = {"kind": "free", "axis": (0, 0, 1), "point": (0, 0, 0), "pitch": 0.0}
        hinge = {"name": "base", "kind": "free", "placement": {"rotation": np.eye(3), "position": np.zeros(3)}, "subhinges": [free]}
        hinge |= {"rotor_inertia": np.zeros(6), "lower": [], "upper": []}
        own.insert(0, {"name": "base", "parent": -1, "mass": 0.0, "com": np.zeros(3), "inertia": np.zeros((3, 3)), "hinge": hinge})
    nodes = [{**node, "body": number[node["body"]]} for node in data["nodes"] if node["body"] in number]
    return pc.Multibody.from_description(
        {"name": "alone", "gravity": data["gravity"], "bodies": own, "nodes": nodes, "welds": data["welds"]}
    )


def index_of(model, bodies, which):
    """Where the coordinates of the named bodies stand."""
    slices = [getattr(model.bodies[name].hinge, f"{which}_slice") for name in model.bodies if name in bodies]
    return np.concatenate([np.arange(s.start, s.stop) for s in slices] or [np.arange(0)])
