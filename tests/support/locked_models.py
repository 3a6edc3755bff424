"""Models of which some hinges are locked: which coordinates those are, and all that a model is, to the last bit."""

import pickle

import numpy as np

from support.mechanisms import random_tree

EPS = float(np.finfo(float).eps)
KINDS = ("weld", "pin", "slider", "screw", "universal", "gimbal", "ball", "free", "custom")


def moving(model):
    """Names of the hinges that have coordinates."""
    return [name for name, hinge in model.hinges.items() if hinge.v_slice.stop > hinge.v_slice.start]


def coordinates(model, hinges):
    """Numbers of their coordinates, and of all others."""
    own = np.concatenate([np.arange(model.nv)[model.hinges[name].v_slice] for name in hinges] or [np.arange(0)]).astype(int)
    return own, np.setdiff1d(np.arange(model.nv), own)


def stopped(model, hinges):
    """The model with these hinges at rest."""
    v = np.array(model.v)
    v[coordinates(model, hinges)[0]] = 0
    model.v = v
    return model


def bits(model):
    """All that a model is, as bytes."""
    described = model.description()
    return pickle.dumps([described["bodies"], described["nodes"], described["q"], described["v"]])


def size(matrix):
    return max(1.0, float(np.abs(matrix).max(initial=0)))


def some_of(seed, **options):
    """A random tree with some of its hinges, at rest."""
    rng = np.random.default_rng(seed)
    while not moving(model := random_tree(rng, int(rng.integers(1, 12)), kinds=KINDS, **options)):
        pass
    hinges = moving(model)
    chosen = [str(name) for name in rng.choice(hinges, int(rng.integers(1, len(hinges) + 1)), replace=False)]
    return stopped(model, chosen), chosen
