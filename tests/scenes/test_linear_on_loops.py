"""Linear models on loops: closed forms, differences of constrained dynamics along states on the loops, errors and refusals.

Tolerances: of fourth-order differences at h = 2⁻⁸ the truncation is h⁴/30 of a fifth derivative, 1e-11 where that is of the function's own
size; states are doubles taken onto the loops to rounding, which the difference divides by h.
"""

import matplotlib as mpl
import numpy as np
import pytest

import pycraft as pc
from pycraft.models import linkages, vehicles
from support import linkages as samples
from support.linkages import close

mpl.use("Agg")
E, M = pc.effects, pc.mechanisms
STEP, NEAR = 2.0**-8, 1e-7


def rolling():
    disc = pc.Multibody("disc")
    disc.add_body("disc", hinge="free", mass=2.0, inertia=np.diag([0.1, 0.1, 0.2]), position=(0, 0, 0.5))
    disc.add_rolling("disc", None, "wheel", radius=0.5, name="ground")
    disc.gravity = (0, 0, -9.81)
    return disc, disc.assemble([0.78, 0.62, 0.1, 0, 0.2, 0, -0.02], [0.3, 0.4, 2.0, 1.0, 0, 0.1])


def of_linkage(model, seed, gravity=(0.4, -9.81, 0.3)):
    model.gravity = gravity
    return model, model.assemble(model.q, np.random.default_rng(seed).normal(size=model.nv))


def spatial():
    model, q, v, _ = samples.spatial(True)
    model.gravity = (0.4, -9.81, 0.3)
    return model, model.assemble(q, v)


def gears():
    model = pc.chain(3)
    model.add_coupling({"hinge0": [0.1, 1.0, 0.3], "hinge1": -2.0, "hinge2": [0, 0.5, 0, 0.2]}, name="gear")
    return of_linkage(model, 4)


def bicycle():
    model = vehicles.bicycle()
    model.gravity = (0, 0, -9.81)
    leaning = model.integrate(model.q, [0.1, 0, 0.2, 0, 0, 0, 0.3, 0.2, 0.1])
    return model, model.assemble(leaning, [0.1, 0.2, 0.3, 4.0, 0, 0, 10.0, 0.5, 9.0])


CASES = {
    "four-bars": lambda: of_linkage(linkages.n_four_bar(2, 1.0), 0),
    "slider-crank": lambda: of_linkage(linkages.slider_crank(), 1),
    "bricard, redundant": lambda: of_linkage(linkages.bricard(), 2),
    "stewart": lambda: of_linkage(linkages.stewart(), 3),
    "every kind": spatial,
    "polynomials": gears,
    "rolling": rolling,
    "bicycle": bicycle,
}


def moved(model, state, along):
    """A state on the loops that is the one moved along, to second order."""
    nv = model.nv
    return model.assemble(model.integrate(state.q, along[:nv]), state.v + along[nv:])


def _coordinates(model, at, of):
    """Displacements from the state of the linear model, and velocities, of its independent coordinates."""
    every = np.concatenate([model.difference(of.q, at.q), at.v])
    names = [*(f"q.{n}" for n in model.coordinate_names), *(f"v.{n}" for n in model.coordinate_names)]
    return every[[names.index(n) for n in of.states]]


def slopes_on_loops(model, state, of, f):
    """∂f by the independent coordinates. An assembled state is beside the one that was moved by its square: coordinates are measured."""
    weights, base = np.array([1, -8, 8, -1]) / (12 * STEP), _coordinates(model, state, of)
    dx, dy = [], []
    for column in of.tangent[: 2 * model.nv].T:
        at = [moved(model, state, s * STEP * column) for s in (-2, -1, 1, 2)]
        dx.append(weights @ [_coordinates(model, one, of) - base for one in at])
        dy.append(weights @ [f(one) for one in at])
    return np.linalg.solve(dx, dy).T


@pytest.mark.parametrize("name", CASES)
def test_models_against_differences_of_constrained_dynamics(name):
    model, state = CASES[name]()
    tau = np.random.default_rng(9).normal(size=model.nv)
    found = model.linearize(state.q, state.v, tau, loops=True)
    positions = np.asarray(model.loops.of_positions)
    displacements = model.nv - np.linalg.matrix_rank(model.loops.jacobian(state.q)[positions], tol=1e-8)
    assert found.displacements == displacements
    assert len(found.states) == displacements + model.mobility(state.q).degrees_of_freedom
    free = [model.coordinate_names.index(n[2:]) for n in found.states[displacements:]]

    def accelerations(at, force=tau):
        return model.constrained_dynamics(at.q, at.v, force, precision="quad").vdot[free]

    slopes = slopes_on_loops(model, state, found, lambda at: np.concatenate([accelerations(at), at.v]))
    close(found.A[displacements:], slopes[: len(free)], NEAR)
    close(found.tangent[model.nv :], slopes[len(free) :], NEAR)
    for j, e in enumerate(np.eye(model.nv)):
        close(found.B[displacements:, j], accelerations(state, tau + e) - accelerations(state), 1e-9)
    assert not found.B[:displacements].any()
    close(found.rate[displacements:], accelerations(state))


def test_frequencies_of_four_bars_are_those_of_one_pendulum():
    """(N + 1)/3 + N of inertia, (N + 1)/2 + N of weight, hanging from cranks of 1 m."""
    for N in (1, 2, 7):
        scene = M.n_four_bar(N)
        hanging = scene.equilibrium(stable=True)
        close(np.mod(hanging.q[0], 2 * np.pi), 1.5 * np.pi)
        square = 9.81 * ((N + 1) / 2 + N) / ((N + 1) / 3 + N)
        close(np.array(hanging.modes[0].eigenvalue), square)
        near = scene.linearize(hanging.q, independent=["crank0"])
        assert near.states == ("q.crank0", "v.crank0")
        close(near.A, [[0, 1], [-square, 0]])
        close(np.array(near.modes()[0]["natural"]), np.sqrt(square) / (2 * np.pi))
        damped = scene.add(E.Damping(0.3)).linearize(hanging.q, independent=["crank0"])
        close(damped.A[1, 1], -0.3 * (2 * N + 1) / ((N + 1) / 3 + N))  # all hinges turn with the crank's rate


@pytest.mark.parametrize("told", [False, True])
def test_scenes_have_their_effects_in_them(told):
    """Springs, dampers, rotors, and a prescribed coordinate: against differences of the scene's own evaluation."""
    model = linkages.five_bar()
    scene = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Spring(3.0), E.Damping(0.2), E.RotorInertia(0.1, hinges="inner1"), E.Loop())
    state = model.assemble(model.q, [0.3, 0.1, -0.2, 0.4], fix=["inner0"])
    if told:
        scene.add(E.Prescribed("inner0", lambda t: ([state.q[0] + 0.3 * t + t**2], [0.3 + 2 * t], [2.0])))
    found = scene.linearize(state.q, state.v)
    assert len(found.states) == (2 if told else 4) and "q.inner0" not in found.states[: 1 + told]
    free = [model.coordinate_names.index(n[2:]) for n in found.states[found.displacements :]]
    close(found.A[found.displacements :], slopes_on_loops(model, state, found, lambda at: scene.evaluate(at.q, at.v).vdot[free]), NEAR)
    close(found.rate[found.displacements :], scene.evaluate(state.q, state.v).vdot[free])
    if told:
        assert not found.B[:, 0].any()


def test_scenes_and_models_agree():
    model, state = CASES["stewart"]()
    of_model = model.linearize(state.q, state.v, loops=True)
    plain = pc.Scene(model).add(E.Gravity(model.gravity), E.Loop()).linearize(state.q, state.v)
    for name in ("A", "B", "tangent", "rate"):
        close(getattr(plain, name), getattr(of_model, name), 1e-10)


def test_scenes_keep_the_loops_that_they_are_told_to():
    """The second of two four-bars closed: the first crank with its rod swings as a double pendulum of the tree."""
    model = linkages.n_four_bar(2)
    found = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Loop("loop2")).linearize(independent=["crank0", "rod1", "crank1"])
    model.gravity = (0, -9.81, 0)
    tree = model.linearize().A
    first = [0, 1, 5, 6]
    close(found.A[np.ix_([0, 1, 3, 4], [0, 1, 3, 4])], tree[np.ix_(first, first)])
    assert not found.A[:2, [2, 5]].any() and found.displacements == 3


def test_outputs_batches_and_steps_of_time():
    model = linkages.five_bar()
    model.gravity = (0, -9.81, 0)
    states = [model.assemble(model.q + 0.1 * k, np.ones(4)) for k in range(3)]
    q, v = np.array([s.q for s in states]), np.array([s.v for s in states])
    outputs = ["q.outer0", "vdot.inner1", "position.tip"]
    many = model.linearize(q, v, loops=True, outputs=outputs)
    assert many.outputs == ("q.outer0", "vdot.inner1", "position.tip.x", "position.tip.y", "position.tip.z")
    for k, state in enumerate(states):
        one = model.linearize(state.q, state.v, loops=True, outputs=outputs, independent=[n[2:] for n in many.states[:2]])
        for name in ("A", "B", "C", "D", "tangent", "rate"):
            close(getattr(many[k], name), getattr(one, name))
        close(one.C[0], one.tangent[1])  # "q.outer0" by the independent coordinates
        close(one.C[1:], slopes_on_loops(model, state, one, lambda at: shown(model, at)), NEAR)
    close(many.discrete(0.01)[1].A, many[1].discrete(0.01).A)
    along = M.five_bar().linearize(q, v, np.zeros(3))
    close(along.A, np.array([M.five_bar().linearize(s.q, s.v, independent=chosen(along)).A for s in states]))


def chosen(model):
    return [name[2:] for name in model.states[: model.displacements]]


def shown(model, at):
    return [model.constrained_dynamics(at.q, at.v).vdot[2], *model.frame("tip").pose(at.q)[:3, 3]]


def test_modes_are_drawn_on_the_loops():
    scene = M.n_four_bar(1)
    drawn = scene.linearize(scene.equilibrium(stable=True).q).modes().plot(0)
    assert "crank0" in drawn.get_title() or "rod1" in drawn.get_title() or "crank1" in drawn.get_title()
    assert bool(scene.linearize().controllability())


def test_without_freedom_there_is_a_model_of_no_states():
    triangle = pc.chain(2)
    triangle.add_loop("body1", hinge="pin", point=(1, 0, 0), position=(0, 0, 0), name="closure")
    state = triangle.assemble([1.0, -2.0])
    found = triangle.linearize(state.q, loops=True)
    assert found.A.shape == (0, 0) and found.B.shape == (0, 2) and found.tangent.shape == (4, 0)
    empty = pc.Multibody("welded")
    empty.add_body("block", hinge="weld", mass=1.0, inertia=np.eye(3))
    assert empty.linearize(loops=True).A.shape == (0, 0)


def function_of_gears(third=False):
    model = pc.chain(2)

    def follow(q):
        x, s, c = q[0], np.sin(q[1]), np.cos(q[1])
        r = (x - s, [1, -c], [[0, 0], [0, s]])
        return (*r, [[[0, 0], [0, 0]], [[0, 0], [0, c]]]) if third else r

    model.add_coupling(["hinge0", "hinge1"], function=follow)
    model.gravity = (0, -9.81, 0)
    return model


def test_functions_have_derivatives_at_rest():
    model = function_of_gears()
    state = model.assemble([0.3, 0.3])
    found = model.linearize(state.q, loops=True)
    free = [model.coordinate_names.index(found.states[1][2:])]
    fast = model.assemble(state.q, [0.1, 0.1])
    slopes = slopes_on_loops(model, state, found, lambda at: model.constrained_dynamics(at.q, 0 * at.v).vdot[free])
    close(found.A[1:, :1], slopes[:, :1], NEAR)
    with pytest.raises(
        pc.EvaluationError, match="is a function, which has no third derivatives, and they are asked for: .* where its coordinates move"
    ):
        model.linearize(fast.q, fast.v, loops=True)


def test_functions_with_third_derivatives_in_motion():
    model = function_of_gears(third=True)
    state = model.assemble([0.3, 0.3], [0.8, 0.4])
    found = model.linearize(state.q, state.v, loops=True)
    free = [model.coordinate_names.index(found.states[1][2:])]
    slopes = slopes_on_loops(model, state, found, lambda at: model.constrained_dynamics(at.q, at.v).vdot[free])
    close(found.A[1:], slopes, NEAR)
    assert np.abs(found.A[1, 1]) > 0.1  # of velocities, by Q̇v alone


REFUSED = {
    "singular": (lambda: linkages.n_four_bar(1, 0.0).linearize(loops=True), pc.EvaluationError, "singular.*'loop1: along x' are dependent"),
    "off": (lambda: linkages.slider_crank().linearize([0, 0, 0.3], loops=True), pc.ModelError, "is off row 'wrist: along x'"),
    "moves off": (lambda: linkages.slider_crank().linearize(v=[1, 0, 0], loops=True), pc.ModelError, "moves off row 'wrist"),
    "of a tree": (lambda: linkages.five_bar().linearize(independent=["inner0"]), pc.ModelError, "use loops=True"),
    "of a scene of a tree": (lambda: M.pendulum().linearize(independent=["bob"]), pc.ModelError, r"with effects.Loop\(\)"),
    "too few": (lambda: linkages.five_bar().linearize(loops=True, independent=["inner0"]), pc.ModelError, "have 2 coordinate.*do$"),
    "dependent": (
        lambda: linkages.n_four_bar(2).linearize(loops=True, independent=["crank0", "rod1"]), pc.ModelError, "do not determine the others"
    ),
    "twice": (lambda: linkages.five_bar().linearize(loops=True, independent=["inner0"] * 2), pc.ModelError, "has a coordinate twice"),
    "unknown": (lambda: M.five_bar().linearize(independent="iner0"), pc.ModelError, "'iner0'.*did you mean 'inner0'"),
    "no states": (lambda: linkages.five_bar().linearize(np.zeros((0, 4)), loops=True), pc.ModelError, "no states"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_refusals_name_what_it_is(what):
    call, error, text = REFUSED[what]
    with pytest.raises(error, match=text):
        call()


def test_an_empty_list_of_independent_coordinates_names_none():
    """They are chosen then, as by None, in every call that takes them; it was refused by one and taken by the other."""
    bars = pc.chain(3)
    bars.gravity = (0, -9.81, 0)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    q = bars.assemble([-1.2, 1.2, -1.9], fix="hinge0").q
    still = np.zeros(3)
    for none in ([], (), None):
        swings = bars.linearize(q, still, loops=True, independent=none)
        assert swings.states == bars.linearize(q, still, loops=True).states
        assert list(bars.soa.embedded(none, q).independent) == list(bars.soa.embedded(q=q).independent)
        by_choice = bars.constrained_dynamics(q, still, method="embed", independent=none)
        assert np.array_equal(by_choice.vdot, bars.constrained_dynamics(q, still, method="embed").vdot)
