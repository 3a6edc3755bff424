"""Mechanisms on their loops beside MuJoCo's equality constraints and Pinocchio's constraintDynamics, in accelerations.

Loops are balls in all three (of planar linkages these ask one row too many, which is redundant everywhere). MuJoCo's constraints give:
of a force it takes R = (1 - d)/d of the rows' own inertia, d = 0.9999 the hardest, so that rows are missed by 1e-4 of what they ask and
accelerations by that times the condition of the rows; it leaves Q̇v out, so that states are at rest. Pinocchio's are solved to 1e-12 by
proximal steps, at speed.
"""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")

from pycraft.interop import mujoco as conventions  # noqa: E402 - after the check that the extra is there
from pycraft.models import linkages  # noqa: E402 - after the check that the extra is there

pytestmark = pytest.mark.peers
MECHANISMS = {
    "four-bars": lambda: linkages.n_four_bar(2, 1.0),
    "ladder": lambda: linkages.n_four_bar(10, 0.8),
    "slider-crank": linkages.slider_crank,
    "five-bar": linkages.five_bar,
    "peaucellier": linkages.peaucellier,
    "andrews": linkages.andrews,
    "stewart": linkages.stewart,
    "delta": linkages.delta,
}


def by_balls(name):
    """The mechanism with balls for loops, bodies that are not thin, and gravity; a state on the loops and forces."""
    model = MECHANISMS[name]()
    for loop in list(model.loops):
        b, a = model.loops.ends_of(loop)
        model.loops.remove(loop)
        model.add_loop(b, a, hinge="ball", name=loop)
    for body in model.bodies.values():
        body.inertia = body.inertia + 1e-2 * np.eye(3)
    model.gravity = (0.4, -9.81, 0.2)
    rng = np.random.default_rng(7)
    return model, model.assemble(model.q, rng.normal(size=model.nv)), rng.normal(size=model.nv)


@pytest.mark.parametrize("name", MECHANISMS)
def test_mujoco_s_equality_constraints_at_their_hardest(name, tmp_path):
    model, state, tau = by_balls(name)
    model.save(tmp_path / "linkage.xml")
    m = mujoco.MjModel.from_xml_path(str(tmp_path / "linkage.xml"))
    m.opt.gravity[:] = model.gravity
    m.opt.solver, m.opt.iterations, m.opt.tolerance = mujoco.mjtSolver.mjSOL_NEWTON, 200, 0.0
    m.eq_solimp[:] = [0.9999, 0.9999, 0.001, 0.5, 2]
    assert m.neq == len(model.loops) and m.nv == model.nv
    d = mujoco.MjData(m)
    still = np.zeros(model.nv)
    places_q, places_v, _ = conventions.order(model, m)
    qpos, _ = conventions.to_mujoco(model, state.q, still)
    d.qpos[places_q] = qpos
    d.qfrc_applied[places_v] = conventions.velocity_map(model, state.q) @ tau
    mujoco.mj_forward(m, d)
    ours = model.constrained_dynamics(state.q, still, tau)
    expected = conventions.acceleration_to_mujoco(model, state.q, still, ours.vdot)
    free = conventions.acceleration_to_mujoco(model, state.q, still, model.forward_dynamics(state.q, still, tau))
    assert np.abs(d.qacc_smooth[places_v] - free).max() < 1e-9 * np.abs(free).max()
    assert np.abs(free - expected).max() > 0.1 * np.abs(free).max()  # loops do something
    assert np.abs(d.qacc[places_v] - expected).max() < 1e-2 * np.abs(free - expected).max()


@pytest.mark.parametrize("name", MECHANISMS)
def test_pinocchio_s_constraint_dynamics(name):
    from support.pinocchio_linkages import Twin

    model, state, tau = by_balls(name)
    theirs = Twin(model).constrained_accelerations(state, tau)
    for method in ("augment", "embed"):
        ours = model.constrained_dynamics(state.q, state.v, tau, method=method).vdot
        assert np.abs(theirs - ours).max() < 1e-7 * np.abs(ours).max()
