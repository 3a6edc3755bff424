"""Prescribed velocities that jump: impulses, against ℳ as a matrix, smooth ramps, and equations of all rows at once on loops."""

import numpy as np
import pytest
from scipy.interpolate import PPoly

import pycraft as pc

E, P = pc.effects, dict(progress=False)


def cart(motion):
    m = pc.Multibody("m")
    m.add_body("cart", None, "slider", axis=(1, 0, 0), mass=1.0)
    m.add_body("bob", "cart", axis=(0, 1, 0), mass=1.0, com=(0, 0, -1.0))
    return pc.Scene(m).add(E.Prescribed("cart", motion))


def test_the_example():
    """A point mass on a string of 1 m stays where it is when its cart leaves at 1 m/s."""
    run = cart(E.Table([0, 1, 2], [0, 0, 1.0])).simulate(2.0, [0, 0.0], [0, 0], **P)
    assert abs(run.q[-1, 1] - 1) < 1e-9 and abs(run.v[-1, 1] - 1) < 1e-9 and np.ptp(run.balance) < 1e-5  # works choose no step
    assert run.events["prescribed"].t.tolist() == [1.0] and run.events["prescribed"].v[0].tolist() == [1.0, 1.0]
    rows = np.flatnonzero(run.t == 1.0)
    assert run.energy["work"][rows, 0] == pytest.approx([0, 0.5], abs=1e-15)  # ½ m v² of the cart, and nothing for the bob
    assert len(rows) == 2 and run.v[rows].tolist() == [[0, 0], [1, 1]]


@pytest.mark.parametrize("integrator, order", [("dopri5", 5), ("dop853", 8), ("rosenbrock4", 4)])
def test_the_balance_beyond_a_jump_is_the_quadrature_of_works(integrator, order):
    """No term is missing: beyond the jump q and v are straight lines, which every step follows exactly, so that no tolerance shortens one.
    The balance falls with the longest step by the order of the method, to rounding."""
    scene = cart(E.Table([0, 1, 2], [0, 0, 1.0]))
    off = {
        h: np.ptp(scene.simulate(2.0, [0, 0.0], [0, 0], integrator=integrator, max_step=h, **P).balance)
        for h in (None, 0.25, 0.125, 0.0625, 0.004)
    }
    tight = scene.simulate(2.0, [0, 0.0], [0, 0], integrator=integrator, rtol=1e-12, atol=1e-15, **P)
    assert 1e-9 < off[None] < 1e-3 and np.ptp(tight.balance) > 0.01 * off[None] or integrator == "dop853"
    for h in (0.25, 0.125):
        if off[h / 2] > 1e-13:
            assert off[h] / off[h / 2] > 0.8 * 2**order
    assert off[0.004] < (1e-14 if order > 4 else 1e-11)


def test_the_limit_of_ramps():
    """Rates that rise within a shorter and shorter time come to it, by their length."""
    off = []
    for h in (0.1, 0.01, 0.001):
        c = np.array([[0, 1 / (4 * h), 0], [0, 0, 1.0], [0, 0, h]])
        run = cart(PPoly(c, [0, 1 - h, 1 + h, 3])).simulate(2.0, [0, 0.0], [0, 0], **P)
        off.append(abs(run.v[-1, 1] - 1))
        assert "prescribed" not in run.events or len(run.events["prescribed"]) == 0
    assert off[0] > off[1] > off[2] and off[2] < 1e-2


@pytest.mark.parametrize("integrator", ["dopri5", "cash-karp54", "rosenbrock4", "rk4", "rkmk4", "semi-implicit-euler", "scipy:DOP853"])
@pytest.mark.parametrize("form", ["fast", "ud"])
def test_trees(integrator, form):
    """Δv_f = -(ℳ + J)_ff⁻¹ (ℳ + J)_fp Δv_p, of random trees with rotors, two effects whose velocities jump at once."""
    if form == "ud" and integrator != "dopri5":
        pytest.skip("one integrator is enough")
    model = pc.tree([-1, 0, 1, 1, 3], ["pin", "slider", "pin", "universal", "pin"], seed=3)
    names = model.coordinate_names
    rotors = 0.3 * np.arange(1, model.nv + 1)
    p, f = [1, 4], [j for j in range(model.nv) if j not in (1, 4)]
    state = model.random_state(5)
    q0, v0 = state.q, state.v
    motion = [E.Table([-1.0, 0.5, 2.0], [q0[j] - 0.3, q0[j], q0[j] + x]) for j, x in zip(p, (0.7, -0.4), strict=True)]
    scene = pc.Scene(model, form=form).add(E.RotorInertia(rotors), E.Damping(0.1))
    scene.add(E.Prescribed(names[p[0]], motion[0]), name="one").add(E.Prescribed(names[p[1]], motion[1]), name="other")
    step = {"step": 0.01} if integrator in ("rk4", "rkmk4", "semi-implicit-euler") else {}
    run = scene.simulate(1.0, q0, v0, integrator=integrator, **step, **P)
    before, after = np.flatnonzero(run.t == 0.5)
    M = model.mass_matrix(run.q[before]) + np.diag(rotors)
    change = np.zeros(model.nv)
    change[p] = [0.7 / 1.5 - 0.2, -0.4 / 1.5 - 0.2]
    change[f] = -np.linalg.solve(M[np.ix_(f, f)], M[np.ix_(f, p)] @ change[p])
    scale = 64 * np.finfo(float).eps * np.linalg.cond(M)
    assert np.abs(run.v[after] - run.v[before] - change).max() < scale
    assert np.array_equal(run.q[after], run.q[before])
    impulse, mean = (M @ change)[p], (run.v[after] + run.v[before])[p] / 2
    gained = np.diff(run.energy["work"][[before, after]], axis=0)[0]
    workers = list(run.workers)
    for name, i in (("one", 0), ("other", 1)):
        assert abs(gained[workers.index(name)] - impulse[i] * mean[i]) < 10 * scale
        assert run.events[name].t.tolist() == [0.5] and np.array_equal(run.events[name].v[0], run.v[after])
    assert abs(np.diff(run.balance[[before, after]])[0]) < 10 * scale


def test_a_ball():
    """The table of a quaternion: straight between its points, and at those the rotation turns."""
    model = pc.tree([-1, 0], ["ball", "pin"], seed=2)
    q = np.array([[1.0, 0, 0, 0], [0.9, 0.1, 0.3, 0.2], [0.8, 0.5, 0.3, -0.2]])
    scene = pc.Scene(model).add(E.Prescribed("hinge0", E.Table([0.0, 0.5, 1.0], q)))
    run = scene.simulate(1.0, model.zero_q(), np.zeros(4), **P)
    before, after = np.flatnonzero(run.t == 0.5)
    M = model.mass_matrix(run.q[before])
    change = run.v[after] - run.v[before]
    assert np.abs(change[:3]).max() > 0.1 and abs(change[3] + M[3, :3] @ change[:3] / M[3, 3]) < 1e-13
    assert np.ptp(run.balance) < 1e-8


@pytest.mark.parametrize("options", [{}, {"method": "embed"}, {"alpha": 5.0, "beta": 5.0}])
def test_loops(options):
    """(ℳ + J) Δv = Q*λ + p, Q Δv = 0, all rows at once, in a mechanism of two freedoms with one of its cranks prescribed."""
    base = pc.mechanisms.five_bar()
    model, start = base.model, base.simulate(1e-3, **P)
    q0 = start.q[0]
    first = next(iter(model.hinges))
    j = model.hinges[first].v_slice.start
    k = model.hinges[first].q_slice.start
    scene = pc.Scene(model).add(E.Loop(**options), E.Prescribed(first, E.Table([0.0, 0.05, 0.2], [q0[k], q0[k], q0[k] + 0.15])))
    run = scene.simulate(0.1, q0, np.zeros(model.nv), **P)
    before, after = np.flatnonzero(run.t == 0.05)
    M, Q = model.mass_matrix(run.q[before]), model.loops.jacobian(run.q[before])
    rows = np.vstack([Q, np.eye(model.nv)[j]])
    kkt = np.block([[M, -rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    right = np.r_[np.zeros(model.nv), np.zeros(len(Q)), 1.0]
    found = np.linalg.lstsq(kkt, right, rcond=None)[0]
    assert np.abs(run.v[after] - run.v[before] - found[: model.nv]).max() < 1e-7
    assert np.abs(model.loops.jacobian(run.q[after]) @ run.v[after]).max() < 1e-7
    assert abs(np.diff(run.balance[[before, after]])[0]) < 1e-7
    assert len(run.events["prescribed"]) == 1


def test_what_prescribed_motion_and_loops_ask_differently():
    base = pc.mechanisms.n_four_bar(1)
    model = base.model
    q0 = base.simulate(1e-3, **P).q[0]
    names = list(model.hinges)[:2]
    scene = pc.Scene(model).add(E.Loop(), E.Prescribed(names, E.Table([0.0, 0.05, 0.2], [q0[:2], q0[:2], q0[:2] + [0.3, 0.3]])))
    with pytest.raises(pc.EvaluationError, match=r"prescribed"):
        scene.simulate(0.1, q0, np.zeros(model.nv), **P)


@pytest.mark.parametrize("ends", ["natural", "not-a-knot"])
def test_splines_that_end_in_motion(ends):
    """Past its end a spline stays: what moved is stopped. A run until there keeps its velocity, and one that goes on from it is stopped."""
    scene = cart(E.Spline([0, 1], [0, 1], ends=ends))
    run = scene.simulate(2.0, [0, 0.0], [0, 0], **P)
    assert abs(run.v[-1, 1] + 1) < 1e-9 and np.ptp(run.balance) < 1e-5
    half = scene.simulate(1.0, [0, 0.0], [0, 0], **P)
    assert abs(half.v[-1, 0] - 1) < 1e-12 and abs(half.v[-1, 1]) < 1e-12
    again = scene.resume(half.checkpoint(), 2.0, progress=False)
    assert np.array_equal(again.q[-1], run.q[-1]) and np.array_equal(again.v[-1], run.v[-1])
    assert again.events["prescribed"].t.tolist() == run.events["prescribed"].t.tolist() == [1.0]


def test_velocities_that_do_not_jump_are_not_pushed():
    """The second derivatives of splines meet; a table's knots on one straight line are none of its own."""
    times = np.linspace(0, 3, 31)
    run = cart(E.Spline(times, np.sin(times))).simulate(3.0, [0, 0.0], [1.0, 0], **P)
    assert len(run.events.get("prescribed", ())) == 0 and np.ptp(run.balance) < 1e-7
    line = cart(E.Table(times, 0.25 * times)).simulate(2.9, [0, 0.0], [0.25, 0.3], **P)
    assert np.abs(line.v[-1] - [0.25, 0.3]).max() < 1e-9


def test_positions_that_jump_are_refused():
    with pytest.raises(pc.ModelError, match=r"the motion of coordinate 'cart' jumps at t = 1 s, which no body can; velocities may jump"):
        cart(PPoly(np.array([[0.0, 1.0]]), [0.0, 1.0, 2.0]))
    model = pc.tree([-1], ["ball"], seed=1)
    turned = PPoly(np.array([[[1.0, 0, 0, 0], [-1.0, 0, 0, 0]]]), [0.0, 1.0, 2.0])
    with pytest.raises(pc.ModelError, match="and others jumps at t = 1 s"):
        pc.Scene(model).add(E.Prescribed("hinge0", turned))
