"""Loops that open and close in a motion, by both methods: against equations of two angles by hand, energies of impacts, what is refused."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy.hard_cases import cases_closures
from pycraft.models import linkages
from support.closed_models import closed_four_bar

E = pc.effects
by_each_method = pytest.mark.parametrize("method", ["augment", "embed"])


@by_each_method
@pytest.mark.parametrize("ratio", [1e-3, 1.0, 1e3])
def test_a_chain_is_caught_on_a_floor_and_let_go(ratio, method):
    """Events close the loop and edits of the scene open it: the state at the end is that by hand, within 1e4 tolerances of steps."""
    angles, rates = cases_closures.drawn(np.random.default_rng(3))
    exact = cases_closures.by_hand(ratio, angles, rates)
    model = cases_closures.chain(ratio)
    cases_closures.close_on_floor(model)
    floor = pc.Event(lambda t, s: model.loops["floor"].residual(s.q)[0], terminal=True)
    scene = pc.Scene(model).add(E.Gravity((0, -cases_closures.G, 0)), E.Loop("floor", method=method)).disable("loop")
    how = {"integrator": "dop853", "rtol": 1e-12, "atol": 1e-12, "progress": False}
    falls = scene.simulate(5.0, [angles[0], angles[1] - angles[0]], [rates[0], rates[1] - rates[0]], events=[floor], **how)
    assert falls.t[-1] < 5.0
    state = scene.close_loops("loop", q=falls.q[-1], v=falls.v[-1])
    lost = model.kinetic_energy(falls.q[-1], falls.v[-1]) - model.kinetic_energy(state.q, state.v)
    gone = falls.v[-1] - state.v
    assert lost == pytest.approx(gone @ model.mass_matrix(state.q) @ gone / 2, rel=1e-9) and lost > 0  # Carnot: of a plastic impact
    slides = scene.simulate(cases_closures.SLIDES, state.q, state.v, **how)
    assert slides.drift["floor"].max() < 1e-14 and np.ptp(slides.balance) < 1e-9 * max(1.0, ratio)
    scene.disable("loop")
    last = scene.simulate(cases_closures.FALLS, slides.q[-1], slides.v[-1], **how)
    found = np.concatenate([np.cumsum(last.q[-1]), np.cumsum(last.v[-1])])
    assert np.abs(found - exact).max() < 1e4 * 1e-12 * max(1.0, np.abs(exact).max())
    assert last.drift["floor"].max() > 1e-3  # it left


@by_each_method
def test_a_loop_closes_beside_another_that_is_kept_and_rotors_are_felt(method):
    model = linkages.n_four_bar(2, 1.0)
    scene = pc.Scene(model).add(E.RotorInertia(2.0, hinges="crank0"), E.Loop("loop1", method=method), E.Loop("loop2", method=method))
    scene.disable("loop_2")
    v = model.constrained_velocities(model.q, [1.0, 0.3, -0.2, 0.5, 0.7])  # of all loops, as a check of what one alone is
    rows = slice(0, 5)
    Q, M = model.loops.jacobian(model.q), model.mass_matrix(model.q) + np.diag([2.0, 0, 0, 0, 0])
    free = np.array([1.0, 0.3, -0.2, 0.5, 0.7])

    def nearest(Q):
        basis = np.linalg.svd(Q)[2][np.linalg.matrix_rank(Q) :].T
        return basis @ np.linalg.solve(basis.T @ M @ basis, basis.T @ M @ free)

    first = scene.close_loops(q=model.q, v=free)  # those that are on
    assert np.allclose(first.v, nearest(Q[rows]), atol=1e-12) and not scene.is_on("loop_2")
    both = scene.close_loops("loop_2", q=model.q, v=free)
    assert np.allclose(both.v, nearest(Q), atol=1e-12) and scene.is_on("loop_2") and np.abs(both.v - v.v).max() > 1e-3
    scene.simulate(0.05, both.q, both.v, progress=False)


def test_prescribed_coordinates_go_on():
    model = closed_four_bar()
    speed = 2.0
    crank = E.Prescribed("crank", lambda t: (model.q[0] + speed * t, speed, 0.0))
    scene = pc.Scene(model).add(crank, E.Loop())
    state = scene.close_loops(q=model.q, v=np.zeros(3))
    assert state.v[0] == pytest.approx(speed, rel=1e-14) and np.abs(model.loops.jacobian(state.q) @ state.v).max() < 1e-14


def test_refusals_leave_the_scene_as_it_was():
    model = closed_four_bar()
    scene = pc.Scene(model).add(E.Gravity(), E.Loop()).disable("loop")
    with pytest.raises(pc.EvaluationError, match="a state has left its loops, off are rows .*'closure: along"):
        scene.close_loops("loop", q=[0.3, 0.2, 0.1], v=[1.0, 0, 0])
    assert not scene.is_on("loop")
    with pytest.raises(pc.ModelError, match="'gravity' keeps no loops"):
        scene.close_loops("gravity")
    with pytest.raises(pc.ModelError, match="has no effect 'lop'; did you mean 'loop'"):
        scene.close_loops("lop")
    with pytest.raises(pc.ModelError, match="keeps no loops: add"):
        scene.close_loops()
    with pytest.raises(pc.ModelError, match="v"):
        scene.close_loops("loop", q=model.q, v=[1.0])
    assert not scene.is_on("loop")
    near = scene.close_loops("loop", q=model.integrate(model.q, [1e-6, 0, 0]), v=[1.0, 0, 0])  # an event's time is off by so little
    assert np.abs(model.loops.residual(near.q)).max() < 1e-15 and scene.is_on("loop")
