"""Motions by independent coordinates against tree augmentation, published values and energy; choices that degrade; what is refused.

Tolerances: a hundred times the steps' tolerance, because errors add up over the motion, unless stated otherwise.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pycraft as pc
from pycraft.dynamics.embedded_motion import embedded_motion

TOL = 1e-9


def rod(length=1.0):
    return {"mass": length, "com": (length / 2, 0, 0), "inertia": length**3 / 12 * np.diag([0.0, 1, 1])}


def crank_rocker(length=1.0):
    """Its crank goes round and round, its rocker turns back at two dead points. The lengths all different."""
    model = pc.Multibody("crank and rocker")
    parent, at = None, 0.0
    for name, part in (("crank", 0.4), ("coupler", 1.1), ("rocker", 0.9)):
        model.add_body(name, parent, "pin", position=(at, 0, 0), hinge_name=name, **rod(part * length))
        parent, at = name, part * length
    model.add_loop("rocker", hinge="pin", point=(at, 0, 0), position=(length - at, 0, 0), name="closure")
    model.gravity = (0, -9.81 * length, 0)
    state = model.assemble([1.2, -0.8, -1.6], [9.0, 0, 0], fix="crank")
    model.q, model.v = state.q, state.v
    return model


def n_four_bar(count):
    """IFToMM A02: cranks of 1 m and 1 kg in a row, upright, their tips joined by like rods."""
    model = pc.Multibody("four-bars")
    for i in range(count + 1):
        model.add_body(f"crank{i}", None, position=(i, 0, 0), **rod())
        if i:
            model.add_loop(f"rod{i}", f"crank{i}", hinge="pin", point=(1, 0, 0), name=f"loop{i}")
        if i < count:
            model.add_body(f"rod{i + 1}", f"crank{i}", position=(1, 0, 0), **rod())
    model.q, model.v = [np.pi / 2, -np.pi / 2] * count + [np.pi / 2], [-1.0, 1.0] * count + [-1.0]
    model.gravity = (0, -9.81, 0)
    return model


def spatial():
    """A floating body, two arms with balls and universals closed by a ball."""
    model = pc.tree([-1, 0, 1, 2, 0, 4], ["free", "universal", "ball", "pin", "gimbal", "pin"], seed=5)
    model.q = model.random_state(1).q
    model.add_loop("body3", "body5", hinge="ball", placement=model.frame("body3").pose(wrt="body5"), name="closed")
    model.gravity = (0.3, -9.0, 1.0)
    state = model.assemble(model.q, np.random.default_rng(2).normal(size=model.nv), starts=1)
    model.q, model.v = state.q, state.v
    return model


def rover():
    """A blade: its row is of velocities alone, so that all of q moves and one velocity depends on the others."""
    model = pc.Multibody("rover")
    model.add_body("skate", None, "planar", mass=2.0, inertia=np.diag([0.1, 0.2, 0.3]), com=(0.1, 0.2, 0))
    model.add_body("arm", "skate", "pin", axis=(0, 0, 1), mass=1.0, com=(0.5, 0, 0), inertia=np.eye(3))
    model.add_node("edge", "skate", rotation=np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    model.add_rolling("edge", kind="blade", name="edge")
    state = model.assemble([0.4, 0.1, -0.2, 0.3], [1.0, 0.5, 2.0, -1.0])
    model.q, model.v = state.q, state.v
    return model


def by_augmentation(model, times, tau=None):
    """The same motion by multipliers: other equations, no independent coordinates, drifting by as much as its steps err."""

    def rates(t, y):
        q, v = y[: model.nq], y[model.nq :]
        return np.concatenate([model.configuration_rate(q, v), model.constrained_dynamics(q, v, tau).vdot])

    y = solve_ivp(rates, times[[0, -1]], np.concatenate([model.q, model.v]), t_eval=times, method="DOP853", rtol=1e-11, atol=1e-12).y.T
    return y[:, : model.nq], y[:, model.nq :]


def check_loops(model, motion):
    for q, v in zip(motion.q, motion.v, strict=True):
        assert np.abs(model.loops.residual(q)).max(initial=0) < 1e-14
        assert np.abs(model.loops.jacobian(q) @ v).max() < 1e-13 * max(1, np.abs(v).max())


@pytest.mark.parametrize("make", [crank_rocker, spatial, rover])
def test_as_by_multipliers(make):
    model = make()
    times, tau = np.linspace(0, 0.5, 6), np.random.default_rng(3).normal(size=model.nv)
    motion = embedded_motion(model, times, tau=tau, rtol=TOL, atol=TOL)
    q, v = by_augmentation(model, times, tau)
    assert np.abs(motion.q - q).max() < 100 * TOL and np.abs(motion.v - v).max() < 1e3 * TOL
    check_loops(model, motion)
    assert np.abs(motion.v[-1] - motion.v[0]).max() > 0.1
    by_function = embedded_motion(model, times, tau=lambda t, q, v: tau, rtol=TOL, atol=TOL)
    assert np.array_equal(by_function.q, motion.q)


@pytest.mark.parametrize("length", [1.0, 1e-3])
@pytest.mark.parametrize("integrator", ["DOP853", "scipy:RK45", "Radau", "BDF"])
def test_choices_that_degrade_are_left(integrator, length):
    """By the rocker's angle no crank goes round: at its dead points the crank takes over, and the state goes on."""
    model = crank_rocker(length)
    times = np.linspace(0, 1.5, 7)
    tol = 1e-6 if integrator in ("Radau", "BDF") else TOL
    motion = embedded_motion(model, times, independent=["rocker"], integrator=integrator, rtol=tol, atol=tol)
    expected = embedded_motion(model, times, independent=["crank"], rtol=TOL, atol=TOL)
    assert motion.choices[0] == (0.0, ["rocker"]) and len(motion.choices) > 1 and motion.choices[-1][1] != ["rocker"]
    assert expected.choices == [(0.0, ["crank"])]  # which is good all the way
    assert motion.q[-1, 0] - motion.q[0, 0] > 2 * np.pi
    assert np.abs(motion.q - expected.q).max() < 1e3 * tol
    check_loops(model, motion)


@pytest.mark.parametrize(("rtol", "error"), [(1e-6, 3e-3), (1e-8, 1e-5)])
def test_two_four_bars_pass_the_line_on_their_branch(rtol, error):
    """IFToMM A02 in 10 s: the tip's published place, through ten singular states."""
    model = n_four_bar(2)
    motion = embedded_motion(model, np.linspace(0, 10, 21), rtol=rtol, atol=rtol)
    first = motion.q[-1, 0]
    assert np.abs([np.cos(first) - 0.3284581115, np.sin(first) - 0.9445185382]).max() < error
    assert np.abs(motion.q[:, 0] + motion.q[:, 1]).max() < 1e-6  # the rod stays level
    energy = [v @ model.mass_matrix(q) @ v / 2 + 9.81 * 3.5 * np.sin(q[0]) for q, v in zip(motion.q, motion.v, strict=True)]
    assert abs(energy[0] - 35.835) < 1e-12 and np.ptp(energy) < 10 * error


def test_without_loops_and_without_freedom():
    arm = pc.chain(2)
    arm.gravity = (0, 0, -9.81)
    times = np.array([0.0, 0.3])
    free = arm.integrate_ode(arm.q, arm.v, times).q
    assert np.abs(embedded_motion(arm, times).q - free).max() < 1e-8
    held = pc.chain(2)
    held.add_coupling({"hinge0": 1.0}, name="first")
    held.add_coupling({"hinge1": 1.0}, name="second")
    weld = pc.Multibody("weld")
    weld.add_body("a", None, "weld", mass=1.0)
    for still in (held, weld):
        motion = embedded_motion(still, times)
        assert motion.q.shape == (2, still.nq) and not motion.v.any()
    alone = embedded_motion(arm, [1.0])
    assert np.array_equal(alone.q, [arm.q]) and alone.choices == [(1.0, arm.coordinate_names)]


def test_refusals():
    model = crank_rocker()
    two = [0.0, 1.0]
    with pytest.raises(pc.ModelError, match="of a model, not of None"):
        embedded_motion(None, two)
    for wrong in ([1.0, 0.0], [], [0.0, np.nan], 3.0, [[0.0, 1.0]]):
        with pytest.raises(pc.EvaluationError, match="times must be finite and increasing"):
            embedded_motion(model, wrong)
    for name, wrong in (("rtol", -1.0), ("atol", np.nan), ("rtol", "x"), ("atol", None), ("rtol", 1e-30)):
        with pytest.raises(pc.Error, match=name):
            embedded_motion(model, two, **{name: wrong})
    for wrong in ("verlet", None, "dopri5"):
        with pytest.raises(pc.EvaluationError, match="there are DOP853, RK45"):
            embedded_motion(model, two, integrator=wrong)
    for wrong in ([np.nan, 0, 0], [1.0], lambda t, q, v: [np.inf, 0, 0]):
        with pytest.raises(pc.ModelError, match="takes 3 finite numbers"):
            embedded_motion(model, two, tau=wrong)
    with pytest.raises(pc.ModelError, match="begins at one state"):
        embedded_motion(model, two, np.tile(model.q, (2, 1)), np.tile(model.v, (2, 1)))
    with pytest.raises((pc.EvaluationError, pc.ModelError), match="closure"):
        embedded_motion(model, two, [0.0, 1.0, 0.0])
    with pytest.raises(pc.EvaluationError, match="velocities of .* break row"):
        embedded_motion(model, two, v=[1.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="of the user"):
        embedded_motion(model, two, tau=_fails_later)
    with pytest.raises(pc.ModelError, match="at .* s it has shape"):
        embedded_motion(model, two, tau=lambda t, q, v: np.zeros(3 if t < 0.5 else 2))


def _fails_later(t, q, v):
    if t > 0.1:
        raise ValueError("of the user")
    return np.zeros(3)
