"""Steps of scenes on loops: past singular states at any tolerance, in every order, with implicit terms and prescribed coordinates."""

import copy

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pycraft as pc
from support.linkages import close, four_bar

E, M = pc.effects, pc.mechanisms


def scene_of(model, *effects, **how):
    return pc.Scene(model, **how).add(E.Gravity(model.gravity), E.Loop(), *effects)


def largest(run):
    return max(drift.max() for drift in run.drift.values())


@pytest.mark.parametrize("windows", [2, 5])
@pytest.mark.parametrize(
    "how", [dict(integrator="dop853", rtol=1e-11), dict(integrator="rk4", step=1e-3)], ids=lambda how: how["integrator"]
)
def test_flat_states_are_passed_with_all_digits(windows, how):
    # Accelerations off the loops are off by what is off over the square of the way to the flat state: steps evaluate on them.
    run = M.n_four_bar(windows).simulate(10.0, **how, progress=False)
    weight = ((windows + 1) / 2 + windows) / ((windows + 1) / 3 + windows) * 9.81
    one = solve_ivp(lambda t, x: [x[1], -weight * np.cos(x[0])], (0, 10), [np.pi / 2, -1.0], method="DOP853", rtol=1e-13, atol=1e-13)
    assert abs(run.q[-1, 0] - one.y[0, -1]) < 1e-7
    assert np.ptp(run.balance) < 1e-7 and largest(run) < 1e-13
    assert how["integrator"] == "rk4" or run.statistics["steps"] < 400


@pytest.mark.parametrize(("integrator", "order"), [("rk4", 4), ("rkmk4", 4), ("semi-implicit-euler", 1)])
def test_one_size_steps_keep_their_order(integrator, order):
    bars, state = four_bar()
    scene = scene_of(bars)
    exact = scene.simulate(0.5, state.q, state.v, integrator="dop853", rtol=1e-13).q[-1]
    errors = []
    for step in (0.02, 0.01):
        run = scene.simulate(0.5, state.q, state.v, integrator=integrator, step=step)
        assert largest(run) < 1e-14
        errors.append(np.abs(run.q[-1] - exact).max())
    assert abs(np.log2(errors[0] / errors[1]) - order) < 0.5


@pytest.mark.parametrize("integrator", ["dopri5", "dop853", "rk4", "semi-implicit-euler"])
def test_runs_go_on_bit_for_bit(integrator):
    bars, state = four_bar()
    scene, how = scene_of(bars), {"integrator": integrator, "step": 0.01}
    half, whole = (scene.simulate(T, state.q, state.v, **how) for T in (0.7, 1.5))
    rest = scene.resume(half, 1.5)
    assert (whole.q[-1] == rest.q[-1]).all() and (whole.v[-1] == rest.v[-1]).all()


@pytest.mark.parametrize("step", [0.0, 0.01])
def test_rotors_and_implicit_terms_are_in_D(step):
    bars, state = four_bar()
    scene = scene_of(bars, E.RotorInertia(0.7, hinges="hinge1"), E.ImplicitDamping(3.0, hinges="hinge2"))
    M = bars.mass_matrix(state.q) + np.diag([0, 0.7, step * 3.0])
    h = bars.inverse_dynamics(state.q, state.v, np.zeros(3)) + np.array([0, 0, 3.0 * state.v[2]])
    Q, c = bars.loops.jacobian(state.q)[2:4], bars.loops.bias(state.q, state.v)[2:4]
    K = np.block([[M, Q.T], [Q, np.zeros((2, 2))]])
    close(scene.evaluate(state.q, state.v, step=step).vdot, np.linalg.solve(K, np.concatenate([-h, -c]))[:3], 1e-12)


@pytest.mark.parametrize("integrator", ["dopri5", "rkmk4", "semi-implicit-euler"])
def test_a_prescribed_crank_is_a_row_and_what_it_takes_is_work(integrator):
    bars, _ = four_bar()
    state = bars.assemble([1.0, -1.0, 1.0 - np.pi], [0.5, 0, 0], fix="hinge0")
    scene = scene_of(bars, E.Prescribed("hinge0", lambda t: (1.0 + 0.5 * t, 0.5, 0.0)))
    found = scene.evaluate(state.q, state.v)
    Q, c = bars.loops.jacobian(state.q)[2:4], bars.loops.bias(state.q, state.v)[2:4]
    close(found.vdot, np.linalg.solve(np.vstack([[1, 0, 0], Q]), np.concatenate([[0], -c])))
    weightless = copy.deepcopy(bars)
    weightless.gravity = (0, 0, 0)
    close(sum(found.forces.values()), weightless.inverse_dynamics(state.q, state.v, found.vdot))
    run = scene.simulate(1.0, state.q, state.v, integrator=integrator, step=1e-3)
    assert np.abs(run.q[:, 0] - 1 - 0.5 * run.t).max() < 1e-14 and largest(run) < 1e-14
    assert np.abs(run.v[:, 1] + 0.5).max() < 1e-12  # a parallelogram
    error = 1e-2 if integrator == "semi-implicit-euler" else 1e-8
    assert np.ptp(run.balance) < error < np.ptp(run.energy["work"])


def test_what_loops_and_prescribed_motion_ask_differently_is_refused_by_both_names():
    bars, _ = four_bar()
    state = bars.assemble([1.0, -1.0, 1.0 - np.pi], [0.5, 0, 0], fix="hinge0")
    scene = scene_of(bars, E.Prescribed("hinge0", lambda t: (1.0 + 0.5 * t, 0.5, 0.0)))
    scene.add(E.Prescribed("hinge1", lambda t: (-1.0 - 0.5 * t, -0.5, 3.0)))
    with pytest.raises(pc.EvaluationError, match="different accelerations.*'closure: along.*, at t = 0 s"):
        scene.evaluate(state.q, state.v)


@pytest.mark.parametrize("method", ["augment", "embed"])
def test_a_start_that_prescribed_motion_takes_off_the_loops_names_it(method):
    """The crank is put where its motion has it, and the loop is open there: not by the state that was given."""
    bars, _ = four_bar()
    state = bars.assemble([1.0, -1.0, 1.0 - np.pi], [0.5, 0, 0], fix="hinge0")
    scene = pc.Scene(bars).add(E.Prescribed("hinge0", lambda t: (1.2, 0.5, 0.0)), E.Loop(method=method))
    said = r"the state given, with 'hinge0' as prescribed, is off row 'closure: along [xy]' by 0.0\d+: .*fix="
    with pytest.raises(pc.ModelError, match=said):
        scene.simulate(0.1, state.q, state.v)
    with pytest.raises(pc.ModelError, match="the state given is off row"):
        pc.Scene(bars).add(E.Loop(method=method)).simulate(0.1, state.q + [0.2, 0, 0], state.v)


def test_states_that_gains_draw_are_not_taken_back():
    bars, state = four_bar()
    drawn = pc.Scene(bars).add(E.Gravity(bars.gravity), E.Loop(alpha=20.0, beta=20.0))
    assert 1e-13 < largest(drawn.simulate(2.0, state.q, state.v, rtol=1e-7, atol=1e-9)) < 1e-6


@pytest.mark.parametrize("effect", [E.NoseHoover(1.0, 1.0), E.Fixman(1.0)], ids=lambda effect: effect.kind())
def test_what_counts_the_tree_s_coordinates_is_refused(effect):
    bars, _ = four_bar()
    with pytest.raises(pc.ModelError, match=f"'{effect.kind()}' counts the coordinates of the tree, and effect 'loop'"):
        scene_of(bars, effect)


def test_a_first_step_that_is_far_too_long_is_taken_again():
    bars, state = four_bar()
    run = scene_of(bars).simulate(1.0, state.q, state.v, step=50.0)
    assert largest(run) < 1e-14 and np.ptp(run.balance) < 1e-6


def test_steps_that_leave_the_loops_are_refused():
    with pytest.raises(pc.EvaluationError, match="has left its loops.*'wrist: along x', at t = .* s"):
        M.slider_crank().simulate(4.0, integrator="rk4", step=0.2, progress=False)


@pytest.mark.parametrize("integrator", ["dopri5", "dop853"])
@pytest.mark.parametrize("torque", [1e100, 1e300])
def test_a_torque_beyond_all_measure_ends_the_run_with_its_time(torque, integrator):
    """Of 1e300 N m the first step that errors allow is nothing at all, and each was taken: the run went on until it was interrupted."""
    model = pc.mechanisms.n_four_bar(1).model
    scene = pc.Scene(model)
    scene.add(pc.effects.Loop())
    scene.add(pc.effects.TorqueSource(torque, "crank0"))
    with pytest.raises(pc.EvaluationError, match=r"at t = .* s, without the error estimate reaching .*'crank[01]' changes fastest"):
        scene.simulate(0.01, integrator=integrator, progress=False)
