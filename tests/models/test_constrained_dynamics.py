"""Forward dynamics on loops by tree augmentation, against dense equations with the mass matrix, Lagrange's equations and conservation."""

import pickle

import numpy as np
import pytest

import pycraft as pc
from pycraft.cli.bench_loops import ladder
from support.linkages import bricard, close, dense, four_bar, spatial
from support.mechanisms import random_tree

EPS = float(np.finfo(float).eps)


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_accelerations_and_multipliers_are_those_of_the_dense_equations(floating, form):
    # Also open loops: the equations require r̈ = 0 wherever r is. Tolerance: κ of Q ℳ⁻¹ Q* is below 1e4 here.
    mb, q, v, tau = spatial(floating)
    got = mb.constrained_dynamics(q, v, tau, form=form)
    vdot, lam = dense(mb, q, v, tau)
    close(got.vdot, vdot), close(got.multipliers, lam)
    assert got.rank == len(mb.loops.rows)
    got = mb.constrained_dynamics(q, v, tau, form=form, alpha=3.0, beta=5.0)
    vdot, lam = dense(mb, q, v, tau, (3.0, 5.0))
    close(got.vdot, vdot), close(got.multipliers, lam)


def test_redundant_rows_have_the_least_multipliers():
    bars, state = four_bar()
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="twice")
    got = bars.constrained_dynamics(state, tau=[0.5, 0, 0])
    vdot, lam = dense(bars, state.q, state.v, [0.5, 0, 0])
    close(got.vdot, vdot), close(got.multipliers, lam)
    assert got.rank == 2
    close(got.by_loop["closure"], got.by_loop["twice"])  # the load is shared
    assert np.abs(got.by_loop["closure"]).max() > 1


def test_a_four_bar_moves_by_its_closed_form():
    # A rhombus of rods of 1 kg and 1 m: cranks at the angle t, the coupler level. ½(2/3 + 1) ṫ², potential 2 g sin t: ẗ = -1.2 g cos t
    bars, _ = four_bar()
    bars.gravity = (0, -9.81, 0)
    for t, rate in ((1.0, 0.0), (0.4, 3.0), (1e-3, 1.0)):
        got = bars.constrained_dynamics([t, -t, t - np.pi], [rate, -rate, rate])
        expected = -1.2 * 9.81 * np.cos(t)
        assert np.abs(got.vdot - expected * np.array([1, -1, 1])).max() < 1e-13 / t**2


def test_at_a_flat_state_velocities_choose_the_branch_or_are_refused():
    bars, _ = four_bar()
    bars.gravity = (0, -9.81, 0)
    flat = bars.constrained_dynamics([0.0, 0.0, np.pi], [1.0, -1.0, 1.0])  # the rhombus goes through
    assert flat.rank == 1
    assert abs(bars.loops.jacobian([0, 0, np.pi])[2:4] @ flat.vdot + bars.loops.bias([0, 0, np.pi], [1.0, -1, 1])[2:4]).max() < 1e-9
    assert np.isfinite(flat.multipliers).all() and np.abs(flat.multipliers).max() < 100
    with pytest.raises(pc.EvaluationError, match="different accelerations.*'closure: along x'"):
        bars.constrained_dynamics([0.0, 0.0, np.pi], [1.0, 1.0, -3.0])


def test_through_a_flat_state_the_motion_is_the_closed_form_s():
    # Where the rank drops, at t about √ε, what is left out of θ̈ and what rounding makes of it are both of size √ε: 1e-7 is seven of it.
    bars, _ = four_bar()
    bars.gravity = (0, -9.81, 0)
    ranks = set()
    for t in 10.0 ** np.arange(-16, 0):
        q, v = [t, -t, t - np.pi], [1.0, -1.0, 1.0]
        got = bars.constrained_dynamics(q, v)
        assert np.abs(got.vdot + 1.2 * 9.81 * np.cos(t) * np.array([1, -1, 1])).max() < 1e-7
        assert np.abs(got.multipliers).max() < 10
        ranks.add(int(got.rank))
    assert ranks == {1, 2}


def test_conflicting_functions_are_named():
    arm = pc.chain(2)
    for name, bend in (("one", 0.0), ("other", 3.0)):
        arm.add_coupling(["hinge0", "hinge1"], function=lambda q, b=bend: (q[0] - q[1], [1, -1], [[b, 0], [0, 0]]), name=name)
    assert arm.constrained_dynamics([0.1, 0.1], [0.0, 0.0]).rank == 1
    with pytest.raises(pc.EvaluationError, match="'one', 'other'"):
        arm.constrained_dynamics([0.1, 0.1], [1.0, 1.0])


@pytest.mark.parametrize("precision", ["single", "double", "extended", "quad"])
def test_precisions_and_batches(precision):
    bars, state = four_bar()
    vdot, lam = dense(bars, state.q, state.v, np.zeros(3))
    digits = 1e-4 if precision == "single" else 1e-12
    one = bars.constrained_dynamics(state, precision=precision)
    close(one.vdot, vdot, digits), close(one.multipliers, lam, digits)
    many = bars.constrained_dynamics(np.tile(state.q, (3, 1)), state.v, precision=precision)
    assert many.vdot.shape == (3, 3) and many.multipliers.shape == (3, 5) and many.rank.tolist() == [2, 2, 2]
    assert (many.vdot == one.vdot).all() and (many.forces["closure"].a == one.forces["closure"].a).all()
    none = bars.constrained_dynamics(np.zeros((0, 3)), np.zeros((0, 3)), precision=precision)
    assert none.vdot.shape == (0, 3) and none.multipliers.shape == (0, 5) and none.forces["closure"].b.shape == (0, 6)


def test_refinement_takes_rounding_of_heavy_and_light_out():
    # 1e10 kg beside 1 kg: refined results are those of quad to rounding, plain ones are not.
    mb, q, v, tau = spatial(False)
    mb.add_body("heavy", "b3", hinge="pin", mass=1e10, inertia=1e10 * np.eye(3))
    q, v, tau = np.r_[q, 0.1], np.r_[v, 0.2], np.r_[tau, 0.3]
    exact = mb.constrained_dynamics(q, v, tau, precision="quad")
    refined = mb.constrained_dynamics(q, v, tau, refine="auto", residual="wider")
    close(refined.vdot, exact.vdot, 20 * EPS)


def test_many_loops_apart_are_solved_apart():
    mb = pc.Multibody("many")
    for i in range(50):
        parent = None
        for j in range(3):
            mb.add_body(
                f"r{i}.{j}", parent, hinge="pin", mass=1.0, com=(0.5, 0, 0), inertia=np.eye(3) / 12, position=(j > 0, 0, 3.0 * i * (j == 0))
            )
            parent = f"r{i}.{j}"
        end = mb.add_node(f"end{i}", parent, position=(1, 0, 0))
        mb.add_loop(end, hinge="pin", position=(0, 0, 3.0 * i), name=f"loop{i}")
    mb.gravity = (0, -9.81, 0)
    angles = np.linspace(0.3, 2.5, 50)
    q = np.concatenate([[t, -t, t - np.pi] for t in angles])
    got = mb.constrained_dynamics(q, np.zeros(150))
    close(got.vdot[::3], -1.2 * 9.81 * np.cos(angles), 1e-11)
    assert got.rank == 100


def test_forces_of_loops_act_on_both_bodies_and_do_what_the_loop_does():
    mb, q, v, tau = spatial(True)
    got = mb.constrained_dynamics(q, v, tau)
    coupled = mb.loops["gear"].jacobian(q).T @ got.by_loop["gear"]
    push = {}
    for name, pair in got.forces.items():
        for frame, wrench in zip(mb.loops.ends_of(name), pair, strict=True):
            if frame:
                push[frame] = push.get(frame, 0) + wrench
    f = mb.interbody_forces(q, v, vdot=got.vdot, wrenches=push, wrench_axes="body")
    H, J = mb.soa("H J")
    mb.q, mb.v = q, v
    close(H @ f.ravel() + J @ got.vdot, tau + coupled, 1e-10)
    for axes in ("world", "body"):
        with_loops = mb.interbody_forces(q, v, tau, loops=True, wrench_axes=axes)
        close(with_loops, f, 1e-10)


def test_wrenches_from_outside_move_the_loop():
    bars, state = four_bar()
    push = {"body1": np.array([0, 0, 0.3, 1.0, 2.0, 0])}
    got = bars.constrained_dynamics(state, wrenches={"body2": push["body1"]})
    body2 = bars.constrained_dynamics(state, wrenches={"body2": push["body1"]}, wrench_axes="body")
    load = bars.jacobian("body1", state.q).T @ push["body1"]
    held = bars.constrained_dynamics(state, tau=load)
    body = bars.constrained_dynamics(state, wrenches=push, wrench_axes="body")
    close(body.vdot, held.vdot), close(body.multipliers, held.multipliers)
    assert np.abs(got.vdot - body2.vdot).max() > 1e-3  # the coupler is level, body2 is not


def test_rolling_without_slip():
    # A disc upright, rolling straight on the ground and pushed along: 3/2 m a = F
    mb = pc.Multibody("disc")
    mb.add_body("disc", hinge="free", mass=2.0, inertia=np.diag([0.25, 0.25, 0.5]) * 2 * 0.5**2)
    mb.add_rolling("disc", kind="wheel", radius=0.5, name="roll")
    mb.gravity = (0, 0, -9.81)
    q = np.zeros(7)
    half = np.sqrt(0.5)
    q[:4] = [half, half, 0, 0]  # z across: about x by a quarter
    q[6] = 0.5
    got = mb.constrained_dynamics(q, np.zeros(6), wrenches={"disc": (0, 0, 0, 3.0, 0, 0)})
    a = mb.frame("disc").pose(q)[:3, :3] @ got.vdot[3:]
    assert np.abs(a - [1.0, 0, 0]).max() < 1e-13
    assert abs(got.by_loop["roll"][0] - 2 * 9.81) < 1e-12
    state = mb.constrained_velocities(q, [0, 0, 0, 3.0, 0, 0])
    assert np.abs(mb.loops.jacobian(q) @ state.v).max() < 1e-14
    assert abs(state.v[3] - 2.0) < 1e-13  # 3 m/s and no spin: two thirds are left


def test_projected_velocities_are_the_nearest_in_kinetic_energy():
    mb, q, v, _ = spatial(True)
    M, Q = mb.mass_matrix(q), mb.loops.jacobian(q)
    for form in ("fast", "ud"):
        got = mb.constrained_velocities(q, v, form=form)
        W = np.linalg.solve(np.linalg.cholesky(M), Q.T)
        expected = v - np.linalg.solve(M, Q.T @ np.linalg.solve(W.T @ W, Q @ v))
        close(got.v, expected), close(M @ (got.v - v), Q.T @ got.multipliers, 1e-11)
        assert np.abs(Q @ got.v).max() < 1e-12
        assert got.v @ M @ got.v <= v @ M @ v
    impulse = np.arange(mb.nv) / 7
    pushed = mb.constrained_velocities(q, v, impulse)
    close(M @ (pushed.v - v), impulse + Q.T @ pushed.multipliers, 1e-11)


def test_models_without_loops_and_edited_since():
    arm = pc.chain(3)
    q, v, tau = [0.3, 0.2, 0.1], [1.0, 2, 3], [0.1, 0.2, 0.3]
    got = arm.constrained_dynamics(q, v, tau)
    close(got.vdot, arm.forward_dynamics(q, v, tau), 1e-13)
    assert got.multipliers.shape == (0,) and got.forces == {} and got.rank == 0
    gear = arm.add_coupling({"hinge0": 1.0, "hinge1": -1.0}, name="gear")
    assert np.ptp(arm.constrained_dynamics(q, v, tau).vdot[:2]) < 1e-13
    arm.bodies["body2"].mass = 5.0
    close(arm.constrained_dynamics(q, v, tau).vdot, dense(arm, q, v, tau)[0])
    gear.remove()
    close(arm.constrained_dynamics(q, v, tau).vdot, arm.forward_dynamics(q, v, tau), 1e-13)


@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        ({"q": [np.nan, 0, 0]}, pc.ModelError, "q"),
        ({"v": [np.inf, 0, 0]}, pc.ModelError, "v"),
        ({"tau": [0, 0]}, pc.ModelError, "tau"),
        ({"tau": "x"}, pc.ModelError, "tau"),
        ({"wrenches": {"nobody": np.zeros(6)}}, pc.ModelError, "nobody"),
        ({"wrenches": {"body1": [np.nan] * 6}}, pc.ModelError, "body1"),
        ({"wrenches": {"body1": np.zeros(5)}}, pc.ModelError, "body1"),
        ({"method": "penalty"}, pc.EvaluationError, "augment"),
        ({"method": None}, pc.ModelError, "method"),
        ({"alpha": -1.0}, pc.ModelError, "alpha"),
        ({"beta": np.nan}, pc.ModelError, "beta"),
        ({"beta": "x"}, pc.ModelError, "beta"),
        ({"form": "slow"}, pc.EvaluationError, "slow"),
        ({"precision": 50}, pc.EvaluationError, "quad"),
        ({"residual": "wider", "refine": 1, "precision": "quad"}, pc.EvaluationError, "same"),
        ({"q": np.zeros((2, 3)), "v": np.zeros((3, 3))}, pc.ModelError, "batch|states"),
    ],
)
def test_what_is_wrong_is_said(given, error, says):
    bars, state = four_bar()
    with pytest.raises(error, match=says):
        bars.constrained_dynamics(**{"q": state.q, "v": state.v} | given)


def test_interbody_forces_on_loops_follow_from_forces():
    bars, state = four_bar()
    with pytest.raises(pc.ModelError, match="tau"):
        bars.interbody_forces(state.q, state.v, vdot=np.zeros(3), loops=True)


@pytest.mark.parametrize("precision", ["double", "extended", "quad"])
def test_bricard_s_redundant_row_is_no_particular_one(precision):
    mb = bricard()
    assert np.abs(mb.loops.residual(np.zeros(5))).max() < 1e-15
    mobility = mb.mobility(np.zeros(5))
    assert mobility.degrees_of_freedom == 1 and mobility.rank == 4
    state = mb.assemble(mb.integrate(np.zeros(5), 0.2 * mobility.freedoms[:, 0]))
    for q in (np.zeros(5), state.q):
        v = 2.0 * mb.mobility(q).freedoms[:, 0]
        got = mb.constrained_dynamics(q, v, precision=precision)
        vdot, lam = dense(mb, q, v, np.zeros(5))
        assert got.rank == 4
        close(got.vdot, vdot), close(got.multipliers, lam)
        power = v @ mb.inverse_dynamics(q, v, got.vdot)
        assert abs(power) < 1e-11  # the loop's forces do no work


@pytest.mark.parametrize("seed", range(40))
def test_random_trees_with_random_loops(seed):
    # Open loops of all sorts, some redundant, some that conflict: refused is what has no solution, everything else is the dense one.
    rng = np.random.default_rng(seed)
    mb = random_tree(rng, int(rng.integers(2, 12)))
    names = list(mb.bodies)
    for i in range(int(rng.integers(1, 4))):
        kind = str(rng.choice(["weld", "pin", "slider", "screw", "universal", "cylindrical", "planar", "ball"]))
        axes = {"axis": rng.normal(size=3)} if kind in ("pin", "slider", "screw", "cylindrical", "planar") else {}
        axes |= {"axes": rng.normal(size=(2, 3))} if kind == "universal" else {}
        try:
            mb.add_loop(str(rng.choice(names)), None if rng.random() < 0.4 else str(rng.choice(names)), hinge=kind, name=f"l{i}",
                        position=rng.normal(size=3), **axes)  # fmt: skip
        except pc.ModelError:
            continue  # of one body with itself
    q, v, tau = np.array(mb.q), np.array(mb.v), rng.normal(size=mb.nv)
    form = str(rng.choice(["fast", "ud", "square-root"]))
    try:
        vdot, lam = dense(mb, q, v, tau)
        left = np.abs(mb.loops.jacobian(q) @ vdot + mb.loops.bias(q, v)).max(initial=0)
    except np.linalg.LinAlgError:
        return  # nothing moves
    if left > 1e-6 * (1 + np.abs(vdot).max(initial=0)):
        with pytest.raises(pc.EvaluationError, match="different accelerations"):
            mb.constrained_dynamics(q, v, tau, form=form)
        return
    got = mb.constrained_dynamics(q, v, tau, form=form)
    close(got.vdot, vdot, 1e-9), close(got.multipliers, lam, 1e-9)


def test_rows_that_only_a_light_body_joins_are_settled_in_a_wider_precision():
    # Two of 1e20 kg, each held to one of 1 kg: the columns are parallel to 1e-10, which quad tells apart. Functions are in double alone.
    def train(**rows):
        mb = pc.Multibody("train")
        for name, mass in (("a", 1e20), ("b", 1e20), ("link", 1.0)):
            mb.add_body(name, hinge="slider", axis=(1, 0, 0), mass=mass, inertia=np.eye(3))
        for name in "ab":
            mb.add_coupling([name, "link"] if rows else {name: 1.0, "link": -1.0}, name=f"to {name}", **rows)
        return mb

    force = [1e20, 0.0, 0.0]
    for precision in ("double", "extended", "quad"):
        found = train().constrained_dynamics([0, 0, 0], [0, 0, 0], force, precision=precision)
        close(found.vdot, np.full(3, 0.5), 1e-15)
        assert found.rank == 2
    with pytest.raises(pc.EvaluationError, match=r"by rounding \(take a wider precision\), of 'train': 'to a', 'to b'"):
        train(function=lambda q: (q[0] - q[1], [1, -1], np.zeros((2, 2)))).constrained_dynamics([0, 0, 0], [0, 0, 0], force)


def test_what_stands_still_by_a_loop_stands_still():
    # Nothing is left of the tree's own accelerations but rounding, which is not measured by itself.
    mb = pc.Multibody("held")
    mb.add_body("box", hinge="free", mass=2.0, inertia=np.eye(3))
    mb.add_loop("box", hinge="weld", name="held")
    mb.gravity = (0, 0, -10)
    got = mb.constrained_dynamics()
    assert np.abs(got.vdot).max() < 100 * EPS
    assert np.abs(got.by_loop["held"] - [0, 0, 0, 0, 0, 20]).max() < 1e-13
    assert np.abs(mb.interbody_forces(loops=True)).max() < 1e-13  # the hinge carries nothing
    assert np.abs(mb.base_reaction(loops=True) - [0, 0, 0, 0, 0, 20]).max() < 1e-13


def test_the_base_carries_what_hinges_and_loops_put_on_it():
    # The rate of momentum: a four-bar's own, whether its loop ends on the base or on a node of it.
    for on_node in (False, True):
        bars = pc.chain(3)
        bars.gravity = (0, -9.81, 0)
        anchor = bars.add_node("anchor", None, position=(1, 0, 0), rotation=[[0, -1, 0], [1, 0, 0], [0, 0, 1]]) if on_node else None
        end = bars.add_node("end", "body2", position=(1, 0, 0))
        place = {} if on_node else {"position": (1, 0, 0)}
        bars.add_loop(end, anchor, hinge="pin", **place)
        state = bars.assemble([1.0, -1.4, -1.5], [2.0, 0, 0], fix="hinge0")
        a = bars.constrained_dynamics(state).vdot
        for about in (None, (1.0, 2.0, 0)):
            carried = bars.base_reaction(state, loops=True, about=about)
            wanted = bars.base_reaction(state, vdot=a, about=about)  # the tree's hinge would have to carry all of it
            close(carried, wanted, 1e-12)
        batch = bars.base_reaction(np.tile(state.q, (2, 1)), state.v, loops=True)
        close(batch[1], bars.base_reaction(state, loops=True), 1e-14)


def test_out_of_range_is_said():
    bars, state = four_bar()
    with pytest.raises(pc.EvaluationError, match="beyond the range"):
        bars.constrained_dynamics(state, tau=[1e308, 1e308, 1e308])


@pytest.mark.parametrize("rungs", [3, 40])
def test_a_ladder_moves_by_its_closed_form(rungs):
    # Its loops share cranks: one group, of more rows than are pivoted at once. Rods parallel to the ground: one angle.
    model, n, angle = ladder(rungs), rungs, 1.0
    q, v = np.array([angle, -angle] * n + [angle]), np.array([2.0, -2.0] * n + [2.0])
    got = model.constrained_dynamics(q, v)
    close(got.vdot[::2], np.full(n + 1, -9.81 * np.cos(angle) * ((n + 1) / 2 + n) / ((n + 1) / 3 + n)), 1e-12)
    vdot, lam = dense(model, q, v, np.zeros(model.nv))
    close(got.vdot, vdot), close(got.multipliers, lam)
    assert got.rank == 2 * n
    model.add_loop("end1", "tip1", hinge="ball", name="again")  # redundant: all are factored by pivoting
    got = model.constrained_dynamics(q, v)
    vdot, lam = dense(model, q, v, np.zeros(model.nv))
    close(got.vdot, vdot), close(got.multipliers, lam)
    assert got.rank == 2 * n


def test_what_is_each_loop_s_own_goes_by_name():
    """Of results, when it is asked for; it stays what it was where loops are added since."""
    model = pc.chain(3)
    model.add_coupling({"hinge0": 1.0, "hinge1": -3.0}, name="gear")
    model.add_loop("body2", hinge="pin", point=(1, 0, 0), position=(0, 0, 0), name="closure")
    model.gravity = (0, -10, 0)
    q = [[1.0, -1.0, -2.141592653589793]] * 2
    got = model.constrained_dynamics(q, np.zeros((2, 3)))
    model.add_loop("body1", hinge="pin", name="more")
    assert list(got.by_loop) == list(got.forces) == ["gear", "closure"] and len(got.by_loop) == 2
    assert np.array_equal(got.by_loop["gear"], got.multipliers[:, :1]) and np.array_equal(got.by_loop["closure"], got.multipliers[:, 1:6])
    assert got.forces["closure"].b.shape == (2, 6) and not got.forces["gear"].a.any() and got.forces["closure"].b.any()
    again = pickle.loads(pickle.dumps(got))
    assert np.array_equal(again.by_loop["closure"], got.by_loop["closure"]) and "closure" in repr(again.forces)
    with pytest.raises(KeyError, match="more"):
        got.by_loop["more"]
    assert list(model.constrained_dynamics(q[0], np.zeros(3)).by_loop) == ["gear", "closure", "more"]


def test_a_row_that_is_zero_asks_nothing_at_rest_and_is_refused_where_it_moves():
    model = pc.chain(2)
    model.add_coupling(["hinge0", "hinge1"], function=lambda q: (q[0] ** 2 / 2, [q[0], 0.0], [[1.0, 0.0], [0.0, 0.0]]), name="bent")
    tau = np.array([0.3, -0.2])
    rest = model.constrained_dynamics([0, 0.4], [0, 0], tau)
    free = model.forward_dynamics([0, 0.4], [0, 0], tau)  # by the kernel: some tens of operations in another order
    assert np.abs(rest.vdot - free).max() <= 64 * np.finfo(float).eps * np.abs(free).max()
    assert rest.multipliers.tolist() == [0] and rest.rank == 0
    with pytest.raises(pc.EvaluationError, match="ask for different accelerations of one motion.*'bent'"):
        model.constrained_dynamics([0, 0.4], [1, 0], tau)
