"""Planar loops in any plane: rows that ask nothing are there by rounding alone, and are no rows to solve for, by either method."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pycraft as pc

E = pc.effects


def four_bar(turn):
    """Rods of 1 m about axes z of a plane that is turned, with body frames that are not the plane's own."""
    R = Rotation.from_rotvec(turn).as_matrix()
    model = pc.Multibody("turned")
    parent, at = None, np.zeros(3)
    for name, length in (("crank", 1.0), ("coupler", 2.0), ("rocker", 1.5)):
        tensor = R @ np.diag([1e-3, length**3 / 12, length**3 / 12]) @ R.T
        model.add_body(name, parent, "pin", axis=R[:, 2], position=R @ at, mass=length, com=R @ [length / 2, 0, 0], inertia=tensor)
        parent, at = name, np.array([length, 0, 0])
    model.add_loop("rocker", hinge="pin", axis=R[:, 2], point=R @ [1.5, 0, 0], position=R @ [0.7, 0, 0], name="closure")
    state = model.assemble([1.2, -0.8, -1.6], [1.0, 0, 0], fix="crank")
    return model, state, R


@pytest.mark.parametrize("turn", [(0.3, 0.7, -0.4), (2.0, 0.1, 1.0), (0.0, 1.0, 0.0)])
def test_motions_are_those_of_the_plane_itself(turn):
    plane, state, _ = four_bar((0, 0, 0))
    expected = (
        pc.Scene(plane).add(E.Gravity((0.5, -9.0, 0)), E.Loop()).simulate(0.5, q=state.q, v=state.v, rtol=1e-10, atol=1e-10, progress=False)
    )
    model, there, R = four_bar(turn)
    assert np.abs(there.q - state.q).max() < 1e-12
    for method in ("augment", "embed"):
        scene = pc.Scene(model).add(E.Gravity(R @ [0.5, -9.0, 0]), E.Loop(method=method))
        run = scene.simulate(0.5, q=there.q, v=there.v, rtol=1e-10, atol=1e-10, progress=False)
        assert np.abs(run.q[-1] - expected.q[-1]).max() < 1e-8, method
    assert model.mobility(there.q).degrees_of_freedom == 1
