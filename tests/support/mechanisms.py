"""Mechanisms for tests: descriptions of every hinge kind and tree shape, built as models and put at a random state."""

import numpy as np

import pycraft as pc
from support.descriptions import KINDS, body, model, random_description, random_inertia, subhinge

SHAPES = {"chain": [-1, 0, 1, 2], "tree": [-1, 0, 0, 1, 1], "forest": [-1, 0, -1, 2, 2]}
SEQUENCES = {
    "ball-slider": ("ball", "slider"),
    "slider-ball": ("slider", "ball"),
    "screw-ball-pin": ("screw", "ball", "pin"),
    "pin-pin-slider-screw": ("pin", "pin", "slider", "screw"),
}
LARGE_TREE = [-1, 0, 0, 1, 1, 2, 4, 4, 3, 7, 5]


def build(description, seed=0):
    """The model of a description, at a random state."""
    model = pc.Multibody.from_description(description)
    state = model.random_state(seed)
    model.q, model.v = state.q, state.v
    return model


def with_hinges(kind, shape, rotor_inertia=False, seed=0):
    """A mechanism of one hinge kind or sequence on every second body, pins between them."""
    parents = SHAPES[shape]
    sequence = SEQUENCES.get(kind, kind)
    kinds = [sequence if k % 2 == 0 else "pin" for k in range(len(parents))]
    number = [*KINDS, *SEQUENCES].index(kind) * 10 + list(SHAPES).index(shape)
    return build(random_description(parents, kinds, 1000 + number + seed, rotor_inertia), seed)


def every_kind(rotor_inertia=False, seed=0):
    """A branched tree with one hinge of every kind, a kept weld among them."""
    return build(random_description(LARGE_TREE, KINDS, 40 + seed, rotor_inertia), seed)


def random_tree(rng, bodies, rotor_inertia=None, kinds=None):
    """A random forest of random kinds (welds kept), with or without rotor inertia by a toss where that is None."""
    parents = [int(rng.integers(-1, k)) if k else -1 for k in range(bodies)]
    kinds = [str(x) for x in rng.choice([k for k in (kinds or KINDS)], bodies)]
    if rotor_inertia is None:
        rotor_inertia = bool(rng.integers(2))
    return build(random_description(parents, kinds, int(rng.integers(2**31)), rotor_inertia), int(rng.integers(2**31)))


def nodes_of(model):
    """Names of the nodes that move."""
    return [name for name, node in model.nodes.items() if node.body is not None]


def uniform_batch(model, size, seed=0):
    """q (size, nq) and v (size, nv) of random states."""
    states = [model.random_state(seed + i) for i in range(size)]
    return np.array([s.q for s in states]).reshape(size, model.nq), np.array([s.v for s in states]).reshape(size, model.nv)


def massless_inner_bodies():
    """A spherical shoulder of three pins on massless bodies, askew with offset points; a massless slider further out, and branches."""
    rng = np.random.default_rng(5)
    solid = lambda m: dict(mass=m, com=0.2 * rng.normal(size=3), inertia=random_inertia(rng, m))
    pin = lambda: [subhinge("pin", rng.normal(size=3), 0.3 * rng.normal(size=3))]
    bodies = [
        body("yaw", -1, pin(), mass=0.0),
        body("pitch", 0, pin(), mass=0.0, position=[0.1, 0, 0.2]),
        body("roll", 1, pin(), position=[0, 0.3, 0], **solid(2.0)),
        body("carriage", 2, [subhinge("slider", rng.normal(size=3))], mass=0.0, position=[0.4, 0, 0]),
        body("tool", 3, [subhinge("ball", point=[0.1, 0.2, 0])], **solid(0.7)),
        body("hand", 2, pin(), position=[0, 0, 0.5], **solid(1.3)),
    ]
    return model(bodies, (0.3, -1.0, -9.8))


def rotors_on_some():
    """J on all coordinates of a hinge, on one of two, on none; and a massless tip that only J makes regular."""
    rng = np.random.default_rng(6)
    solid = lambda m: dict(mass=m, com=0.2 * rng.normal(size=3), inertia=random_inertia(rng, m))
    pin = lambda: subhinge("pin", rng.normal(size=3), 0.3 * rng.normal(size=3))
    bodies = [
        body("base", -1, [subhinge("free")], **solid(3.0)),
        body("upper", 0, [pin(), pin()], position=[0.2, 0, 0], rotor=[0.4, 0.0], **solid(1.0)),
        body("lower", 1, [subhinge("slider", rng.normal(size=3)), pin()], rotor=[0.2, 0.3], **solid(1.0)),
        body("wheel", 2, [pin()], mass=0.0, rotor=[0.1]),
        body("tail", 0, [pin()], position=[-0.3, 0, 0], **solid(0.5)),
    ]
    return model(bodies, (0, 0, -9.8))


def four_atoms():
    """A rigid right angle of three atoms, free in space, and the fourth atom turning about the middle bond; unit masses and bonds."""
    model = pc.Multibody("four atoms")
    atoms = np.array([(0, 1, 0), (0, 0, 0), (1, 0, 0)], float)
    centre = atoms.mean(axis=0)
    inertia = sum((a - centre) @ (a - centre) * np.eye(3) - np.outer(a - centre, a - centre) for a in atoms)
    model.add_body("angle", hinge="free", mass=3.0, com=centre, inertia=inertia)
    model.add_body("end", "angle", "pin", axis=(1, 0, 0), position=(1, 0, 0), mass=1.0, com=(0, 1, 0), inertia=np.zeros((3, 3)))
    return model
