"""Cassie as it is published: four ball loops, two of them nearly planar, by augmentation, by embedding and by Pinocchio."""

import numpy as np
import pytest

pytest.importorskip("pinocchio")

import pycraft as pc  # noqa: E402 - after the check that the extra is there
from pycraft.dynamics.embedding import embedded_accelerations  # noqa: E402 - after the check that the extra is there
from pycraft.peers.cassie import cassie  # noqa: E402 - after the check that the extra is there

pytestmark = pytest.mark.peers


@pytest.fixture(scope="module")
def robot():
    model = cassie()
    model.gravity = (0, 0, -9.81)
    return model


def states(model, count=5):
    rng = np.random.default_rng(0)
    for k in range(count):
        moved = model.integrate(model.q, 0.05 * k * rng.normal(size=model.nv))
        yield model.assemble(moved, rng.normal(size=model.nv)), rng.normal(size=model.nv)


def test_it_is_closed_as_published_and_its_rods_to_the_feet_ask_one_row_too_many(robot):
    assert robot.nv == 28 and len(robot.loops.rows) == 12
    assert np.abs(robot.loops.residual(robot.q)).max() < 1e-15
    mobility = robot.mobility()
    assert mobility.degrees_of_freedom == 18 and not mobility.singular
    assert sorted(name.split(":")[0] for name in mobility.redundant) == ["left-plantar-foot-joint", "right-plantar-foot-joint"]


def test_both_ways_and_pinocchio_give_the_same_accelerations(robot):
    """Eps times the condition of Q ℳ⁻¹ Q*: rods of 0.5 m beside cranks of 5 cm, singular values down to 1e-3, squared.

    Pinocchio's proximal steps also factor dependent rows: an error of rounding over μ remains, 1e-3 at 1e-10 and 1e-5 at 1e-5.
    """
    from support.pinocchio_linkages import Twin

    twin = Twin(robot)
    for state, tau in states(robot):
        augmented = robot.constrained_dynamics(state.q, state.v, tau)
        assert augmented.rank == 10
        size = np.abs(augmented.vdot).max()
        assert np.abs(augmented.vdot - embedded_accelerations(robot, state.q, state.v, tau)).max() < 1e-9 * size
        direct = robot.constrained_dynamics(state.q, state.v, tau, method="embed")
        assert direct.rank == 10 and np.abs(augmented.vdot - direct.vdot).max() < 1e-9 * size
        assert np.abs(augmented.vdot - twin.constrained_accelerations(state, tau, 1e-5)).max() < 3e-5 * size
        Q, c = robot.loops.jacobian(state.q), robot.loops.bias(state.q, state.v)
        kept = [i for i, name in enumerate(robot.loops.rows) if name not in robot.mobility(state.q).redundant]
        assert len(kept) == 10 and np.abs(Q @ augmented.vdot + c)[kept].max() < 1e-9 * size


def test_it_falls_on_its_loops(robot):
    state, _ = next(states(robot))
    scene = pc.Scene(robot).add(pc.effects.Gravity(), pc.effects.Loop())
    run = scene.simulate(0.1, state.q, 0.2 * state.v, rtol=1e-9, progress=False)
    assert np.ptp(run.balance) < 1e-6 * np.abs(run.energy["potential"]).max()
    embedded = pc.Scene(robot).add(pc.effects.Gravity(), pc.effects.Loop(method="embed"))
    other = embedded.simulate(0.1, state.q, 0.2 * state.v, rtol=1e-9, progress=False)
    assert np.abs(robot.difference(run.q[-1], other.q[-1])).max() < 1e-6  # as free as by augmentation: rows of 1e-9 hold nothing
    drift = max(drift.max() for drift in run.drift.values())
    assert drift < 1e-10  # of what redundant rows are off the others by, 2e-7 of the way, nothing is taken back
    centre = np.array([robot.centre_of_mass(q) for q in (run.q[0], run.q[-1])])
    speed = robot.centre_of_mass_velocity(run.q[0], run.v[0])
    assert np.abs(centre[1] - centre[0] - 0.1 * speed - [0, 0, -9.81 * 0.005]).max() < 1e-8
    assert robot.linearize(state.q, loops=True).A.shape == (36, 36)
