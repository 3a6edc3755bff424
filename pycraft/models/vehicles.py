"""Models on wheels: trees with their wheels' rows declared (docs/loops.md), at a state on them. Lengths in m, masses in kg."""

from __future__ import annotations

import numpy as np

from .multibody import Multibody

AXLE = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
"""Rotation of a wheel's disc in the wheel: z along its y."""


def bicycle() -> Multibody:
    """Return the Whipple bicycle with benchmark parameters, upright: a frame with its rider, a fork with handlebars, two rolling wheels.

    x is forward, y to the left, z upward, and the frame's origin at the contact of the rear wheel. Its first coordinate is the lean,
    "steer" turns the fork about its axis, which points down: both are positive to the right, as in the paper. Of the coordinates less the
    rows seven displacements and three velocities remain.

    Source: J. P. Meijaard, J. M. Papadopoulos, A. Ruina, A. L. Schwab, Linearized dynamics equations for the balance and steer of a
    bicycle: a benchmark and review, Proc. R. Soc. A 463, 2007, table 1, with z downward.
    """
    wheelbase, trail, tilt = 1.02, 0.08, np.pi / 10
    model = Multibody("bicycle")
    frame = np.array([[9.2, 0, -2.4], [0, 11, 0], [-2.4, 0, 2.8]])
    fork = np.array([[0.05892, 0, 0.00756], [0, 0.06, 0], [0.00756, 0, 0.00708]])
    hub = np.array([wheelbase + trail, 0, 0])  # where the steering axis meets the ground
    model.add_body("frame", hinge="free", mass=85.0, com=(0.3, 0, 0.9), inertia=frame)
    model.add_body("rear wheel", "frame", axis=(0, 1, 0), position=(0, 0, 0.3), mass=2.0, inertia=np.diag([0.0603, 0.12, 0.0603]))
    axis = (np.sin(tilt), 0, -np.cos(tilt))
    model.add_body("fork", "frame", axis=axis, position=hub, mass=4.0, com=np.array([0.9, 0, 0.7]) - hub, inertia=fork, hinge_name="steer")
    place = np.array([wheelbase, 0, 0.35]) - hub
    model.add_body("front wheel", "fork", axis=(0, 1, 0), position=place, mass=3.0, inertia=np.diag([0.1405, 0.28, 0.1405]))
    for name, radius in (("rear", 0.3), ("front", 0.35)):
        disc = model.add_node(f"{name} disc", f"{name} wheel", rotation=AXLE)
        model.add_rolling(disc, None, "wheel", radius=radius, name=f"{name} contact")
    return model
