"""Runs for tests: references that are better than what is tested, distances of states on the group, orders of convergence."""

import functools

import numpy as np

import pycraft as pc

E = pc.effects
CONTROLLED = ["dopri5", "cash-karp54", "dop853", "bulirsch-stoer", "rosenbrock4"]
FIXED = {"rk4": 4, "rkmk4": 4, "semi-implicit-euler": 1, "variational2": 2, "variational4": 4}
"""Of steps of one size, with their orders."""
SCIPY = ["scipy:RK45", "scipy:DOP853", "scipy:Radau", "scipy:BDF", "scipy:LSODA"]
SUNDIALS = ["sundials:BDF", "sundials:Adams"]


def spinning():
    """A free body that tumbles about no principal axis, with a ball and a slider on it, under gravity and springs."""
    model = pc.Multibody("spinning")
    model.add_body("hub", hinge="free", mass=2.0, com=(0.1, -0.2, 0.3), inertia=np.diag([1.0, 2.0, 2.5]))
    model.add_body("ball", "hub", "ball", position=(0.5, 0, 0), mass=0.7, com=(0, 0.3, 0.1), inertia=np.diag([0.1, 0.2, 0.15]))
    model.add_body("boom", "hub", "slider", axis=(0, 0, 1), position=(0, 0.4, 0), mass=0.4, com=(0.1, 0, 0))
    model.v = [0.7, 1.9, 0.4, 0.5, -0.2, 0.4, 0.3, -0.8, 0.5, 0.2]
    return pc.Scene(model).add(E.Gravity(), E.Spring(3.0, hinges=["ball", "boom"]))


CASES = {
    "double pendulum": lambda: pc.mechanisms.double_pendulum(),
    "spinning": spinning,
    "damped": lambda: spinning().add(E.Damping(0.2), E.TorqueSource(E.Harmonic(0.4, 0.9), hinges="boom")),
}


@functools.cache
def exact(case, T):
    """The last state of a case after T seconds, sixteen digits."""
    scene = CASES[case]()
    wide = pc.Scene(scene.model, precision="extended").add(*scene.effects.values())
    run = wide.simulate(T, integrator="dop853", rtol=1e-16, atol=1e-17, t_eval=[T], progress=False)
    return run.q[-1], run.v[-1]


def apart(model, q, v, end):
    """The largest difference of a state from (q, v) of `end`, along quasi-velocities."""
    return max(np.abs(model.difference(end[0], q)).max(), np.abs(v - end[1]).max())


def orders(errors):
    """Of errors at halved steps."""
    errors = np.array(errors)
    return np.log2(errors[:-1] / errors[1:])
