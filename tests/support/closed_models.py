"""Closed models of every kind of loop, at a state on their loops, moving, in gravity."""

import numpy as np

import pycraft as pc


def at_rest(model, seed):
    """At a state on the loops near the present one, moving."""
    model.gravity = (0.3, -9.0, 1.0)
    state = model.assemble(model.q, np.random.default_rng(seed).normal(size=model.nv), starts=1)
    model.q, model.v = state.q, state.v
    return model


def closed_four_bar():
    """A planar one on pins, its lengths all different: a closing pin's rows have rank 2 of 5."""
    model = pc.Multibody("four-bar")
    parent, at = None, 0.0
    for name, length in (("crank", 1.0), ("coupler", 2.0), ("rocker", 1.5)):
        rod = {"mass": length, "com": (length / 2, 0, 0), "inertia": np.diag([1e-3, length**3 / 12, length**3 / 12])}
        model.add_body(name, parent, "pin", position=(at, 0, 0), **rod)
        parent, at = name, length
    model.add_loop("rocker", hinge="pin", point=(1.5, 0, 0), position=(0.7, 0, 0), name="closure")
    model.q = [1.2, -0.8, -1.6]
    return at_rest(model, 1)


def spatial():
    """On a floating body, two arms of many kinds of hinges closed by a ball; rotors, and a body outboard of the loop."""
    kinds = ["free", "universal", "ball", "pin", "slider", "gimbal", "pin"]
    model = pc.tree([-1, 0, 1, 2, 2, 0, 5], kinds, seed=5, rotor_inertia=True)
    model.q = model.random_state(1).q
    model.add_loop("body3", "body6", hinge="ball", placement=model.frame("body3").pose(wrt="body6"), name="closed")
    return at_rest(model, 2)


def two_loops():
    """One inside the other by a body in common, and a third on two roots that nothing carries."""
    model = pc.tree([-1, 0, 1, 2, 3, 4, -1, 6, -1], ["universal", "ball", "pin", "ball", "pin", "universal", "pin", "pin", "pin"], seed=3)
    model.q = model.random_state(2).q
    model.add_loop("body5", hinge="pin", placement=model.frame("body5").pose(), name="outer")
    model.add_loop("body4", "body2", hinge="planar", placement=model.frame("body4").pose(wrt="body2"), name="inner")
    x, y = model.q[-2:]
    model.add_coupling({"hinge7": 1.0, "hinge8": [0.0, -2.0, 0.3]}, constant=2 * y - 0.3 * y**2 - x, name="gear")
    return at_rest(model, 3)


def gears():
    model = pc.chain(6, seed=4)
    model.q = model.random_state(4).q
    q = np.array(model.q)
    model.add_coupling({"hinge0": 1.0, "hinge2": -3.0}, constant=3 * q[2] - q[0], name="gear")
    model.add_coupling({"hinge3": [0.0, 1.0, 0.5], "hinge5": 2.0}, constant=-(q[3] + 0.5 * q[3] ** 2 + 2 * q[5]), name="bent")
    return at_rest(model, 4)


def function():
    """In double precision, as functions are."""
    model = pc.chain(6, seed=4)
    model.q = model.random_state(4).q
    q = np.array(model.q)
    model.add_coupling(["hinge3", "hinge5"], function=lambda x: (x[0] * x[1] - q[3] * q[5], x[::-1], np.eye(2)[::-1]), name="product")
    return at_rest(model, 4)


def rover():
    model = pc.Multibody("rover")
    model.add_body("skate", None, "planar", mass=2.0, inertia=np.diag([0.1, 0.2, 0.3]), com=(0.1, 0.2, 0))
    model.add_body("arm", "skate", "pin", axis=(0, 0, 1), mass=1.0, com=(0.5, 0, 0), inertia=np.eye(3))
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    model.add_node("edge", "skate", rotation=turn)
    model.add_rolling("edge", kind="blade", name="edge")
    model.q = [0.4, 0.1, -0.2, 0.3]
    return at_rest(model, 5)


MODELS = {"four-bar": closed_four_bar, "spatial": spatial, "two loops": two_loops, "gears": gears, "rover": rover}
MOVING = MODELS | {"function": function}
