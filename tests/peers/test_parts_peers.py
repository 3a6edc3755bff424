"""Parts against Pinocchio's reduced models: all outboard of a body, every other joint locked, at rest inboard and without gravity there.

What is inboard then stands still, so that it is the part on a fixed base. Tolerance: that of test_peers_sensitivities.
"""

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

import pycraft as pc  # noqa: E402 - after the check that the extra is there
from pycraft.interop import pinocchio as convention  # noqa: E402 - as above
from pycraft.peers import peers  # noqa: E402 - as above

pytestmark = [pytest.mark.peers, pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")]
EPS = float(np.finfo(float).eps)
ROBOTS = ("panda", "anymal", "simple_humanoid", "talos_reduced", "baxter")


def agree(mine, theirs, model, condition=1.0):
    assert mine.shape == theirs.shape
    assert np.abs(mine - theirs).max() <= 100 * model.nv * EPS * condition * max(np.abs(mine).max(), np.abs(theirs).max())


@pytest.mark.parametrize("robot", ROBOTS)
def test_what_is_outboard_of_a_body(robot):
    path = next(f for f in peers.robot_files() if f.stem == robot)
    model, whole = pc.load(path, root="fixed", mimic="free"), convention.build(str(path), "fixed")
    rng, compared = np.random.default_rng(3), 0
    for root in list(model.bodies)[:: max(1, len(model.bodies) // 6)]:
        part = model.subgraph(root=root)
        if any(hinge.kind not in ("pin", "slider") for hinge in part.hinges.values()):
            continue
        state = model.random_state(rng)
        locked = [whole.getJointId(name) for name in whole.names[1:] if name not in part.hinges]
        reduced = pin.buildReducedModel(whole, locked, convention.coordinates(model, whole).q(state.q))
        reduced.gravity.linear = np.zeros(3)
        twin = convention.coordinates(part, reduced)
        own = part.state_of(state)
        q, S = twin.q(own.q), twin.velocities(own.q)
        tau, vdot = rng.uniform(-1, 1, part.nv), rng.uniform(-1, 1, part.nv)
        data = reduced.createData()
        mass = pin.crba(reduced, data, q)
        mass = S.T @ (np.triu(mass) + np.triu(mass, 1).T) @ S
        agree(part.mass_matrix(own.q), mass, model)
        agree(part.inverse_dynamics(own, vdot=vdot), S.T @ pin.rnea(reduced, data, q, S @ own.v, S @ vdot), model)
        agree(part.forward_dynamics(own, tau=tau), S.T @ pin.aba(reduced, data, q, S @ own.v, S @ tau), model, np.linalg.cond(mass))
        compared += 1
    assert compared > 3
