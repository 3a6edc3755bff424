"""Locked hinges against Pinocchio's reduced models: these joints locked where they are, the others as they were.

Both models have the same bodies; ours once more with those on welds coalesced. Tolerance: that of test_parts_peers.
"""

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

import pycraft as pc  # noqa: E402 - after the check that the extra is there
from pycraft.interop import pinocchio as convention  # noqa: E402 - as above
from pycraft.peers import peers  # noqa: E402 - as above

pytestmark = [pytest.mark.peers, pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")]
EPS = float(np.finfo(float).eps)


def agree(mine, theirs, model, condition=1.0):
    assert mine.shape == theirs.shape
    assert np.abs(mine - theirs).max() <= 100 * model.nv * EPS * condition * max(np.abs(mine).max(), np.abs(theirs).max())


@pytest.mark.parametrize("robot", ["panda", "anymal", "simple_humanoid", "talos_reduced", "baxter"])
@pytest.mark.parametrize("coalesced", [False, True])
def test_locked_hinges_are_those_of_a_reduced_model(robot, coalesced):
    path = next(f for f in peers.robot_files() if f.stem == robot)
    model, whole = pc.load(path, root="fixed", mimic="free"), convention.build(str(path), "fixed")
    rng = np.random.default_rng(5)
    state = model.random_state(rng)
    names = [name for name, hinge in model.hinges.items() if hinge.kind in ("pin", "slider")]
    chosen = [str(name) for name in rng.choice(names, len(names) // 2, replace=False)]
    v = np.array(state.v)
    for name in chosen:
        v[model.hinges[name].v_slice] = 0
    model.q, model.v = state.q, v
    joints = [whole.getJointId(name) for name in chosen]
    reduced = pin.buildReducedModel(whole, joints, convention.coordinates(model, whole).q(state.q))
    model.lock(chosen)
    if coalesced:
        assert len(model.coalesce()) >= len(chosen)
    assert model.nv == reduced.nv > 0
    model.gravity = tuple(reduced.gravity.linear)
    twin = convention.coordinates(model, reduced)
    q, S = twin.q(model.q), twin.velocities(model.q)
    tau, vdot = rng.uniform(-1, 1, (2, model.nv))
    data = reduced.createData()
    mass = pin.crba(reduced, data, q)
    mass = S.T @ (np.triu(mass) + np.triu(mass, 1).T) @ S
    agree(model.mass_matrix(), mass, model)
    agree(model.inverse_dynamics(vdot=vdot), S.T @ pin.rnea(reduced, data, q, S @ model.v, S @ vdot), model)
    agree(model.forward_dynamics(tau=tau), S.T @ pin.aba(reduced, data, q, S @ model.v, S @ tau), model, np.linalg.cond(mass))
