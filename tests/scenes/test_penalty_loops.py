"""Loops held by springs: a swing in closed form, forces by rows for every kind of loop, exact tangents, limits of stiff springs, refusals.

Tolerances: 1e-12 of the largest entry where both sides are the same sums in another order; of differences what is said there.
"""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pycraft as pc
from pycraft.models import linkages
from support.closed_models import MOVING, closed_four_bar, rover
from support.mechanisms import every_kind

E, M = pc.effects, pc.mechanisms


def close(found, expected, relative=1e-12):
    scale = max(1.0, np.abs(expected).max(initial=0))
    assert np.abs(found - expected).max(initial=0) <= relative * scale, np.abs(found - expected).max()


def springs(model, frequency, ratio):
    return model.loops._core.springs([], frequency, ratio)


def two_wheels(ratio=-1.0):
    """Two wheels about one axis, of 1 and 2 kg m², coupled."""
    model = pc.Multibody("wheels")
    for name, inertia in (("one", 1.0), ("two", 2.0)):
        model.add_body(name, None, "pin", axis=(0, 0, 1), mass=1.0, inertia=inertia * np.eye(3))
    model.add_coupling({"one": 1.0, "two": ratio}, name="gear")
    return model


# ------------------------------------------------------------------ what a frequency is


@pytest.mark.parametrize(("ζ", "omega"), [(0.0, 50.0), (0.2, 50.0), (1.0, 20.0)])
def test_a_row_swings_at_its_frequency(ζ, omega):
    """r̈ + 2ζω ṙ + ω² r = 0 exactly, whatever the inertias; the work of the damper is in the balance."""
    model = two_wheels(-3.0)
    scene = pc.Scene(model).add(E.Loop(method="penalty", frequency=omega, damping_ratio=ζ))
    t = np.linspace(0, 0.4, 9)
    run = scene.simulate(0.4, [0.1, 0.0], [0.0, 0.0], t_eval=t, rtol=1e-11, atol=1e-13, progress=False)
    r = model.loops.residual(run.q)[:, 0]
    if ζ < 1:
        d = omega * np.sqrt(1 - ζ**2)
        expected = 0.1 * np.exp(-ζ * omega * t) * (np.cos(d * t) + ζ * omega / d * np.sin(d * t))
    else:
        expected = 0.1 * np.exp(-omega * t) * (1 + omega * t)
    close(r, expected, 1e-9)
    C = 1 / 1.0 + 9 / 2.0
    close(run.balance, np.full(9, 0.5 * omega**2 / C * 0.01), 1e-9 * omega**2)
    assert (run.energy["work"].size == 0) == (ζ == 0) and (ζ == 0 or run.energy["work"][-1].sum() < -0.01)


def test_rotors_and_what_is_prescribed_are_in_it():
    """Compliance is of what moves: less with a rotor on one wheel, and only the other wheel's with one wheel driven."""
    model = two_wheels()
    loop = E.Loop(method="penalty", frequency=30.0, damping_ratio=0.0)

    def pull(*others):
        scene = pc.Scene(model).add(*others, loop)
        return -scene.evaluate([0.1, 0.0]).forces["loop"][0] / 0.1

    assert pull() == pytest.approx(900 / (1 + 1 / 2), rel=1e-13)
    assert pull(E.RotorInertia([3.0, 0.0])) == pytest.approx(900 / (1 / 4 + 1 / 2), rel=1e-13)
    driven = pc.Scene(model).add(E.Prescribed("one", 0.0), loop)
    assert -driven.evaluate([0.0, 0.1]).forces["loop"][1] / 0.1 == pytest.approx(900 * 2.0, rel=1e-13)


def test_what_is_prescribed_is_held_where_masses_couple_it():
    """A chain whose first hinge is driven: the row is felt by the second alone, M₁₁, and not by what the first would give way."""
    model = pc.chain(2)
    model.q = [0.3, 0.8]
    model.add_coupling({"hinge0": 1.0, "hinge1": 1.0}, constant=-1.1, name="gear")
    scene = pc.Scene(model).add(E.Prescribed("hinge0", 0.3), E.Loop(method="penalty", frequency=30.0, damping_ratio=0.0))
    pull = -scene.evaluate([0.3, 0.9]).forces["loop"][1] / 0.1
    assert pull == pytest.approx(900 * model.mass_matrix(model.q)[1, 1], rel=1e-12)


def test_one_spring_a_loop_and_unit():
    """No direction is stiffer than another; the one that is felt least swings at ω; a row that never asks has none."""
    model = closed_four_bar()
    k, c = springs(model, 100.0, 0.5)
    names = [row.split(": ")[1] for row in model.loops.rows]
    assert names == ["about x", "about y", "along x", "along y", "along z"]
    assert not k[:2].any() and not c[:2].any() and k[2] == k[3] == k[4] > 0
    Q = model.loops.jacobian(model.q)
    C = np.diag(Q @ np.linalg.solve(model.mass_matrix(model.q), Q.T))
    close(k[2], 1e4 / C.max())
    close(c[2:], k[2:] * 2 * 0.5 / 100)
    k, c = springs(rover(), 10.0, 1.0)
    assert not k.any() and c.all()  # of velocities: a damper
    flat = linkages.n_four_bar(1)
    flat.q = np.zeros(3)  # in line: the row along it asks nothing there, and has the spring of the other
    k, _ = springs(flat, 10.0, 1.0)
    assert k[2] == k[3] > 0


def test_rows_that_ask_nothing_at_the_state_have_springs_where_they_ask_beside_it():
    """Two sliders in line with a coupling q0² = q1²: at q = 0 its gradient is zero, and the spring is of a state beside it."""
    model = pc.Multibody("squares")
    for name in ("a", "b"):
        model.add_body(name, None, "slider", axis=(1, 0, 0), mass=2.0)
    model.add_coupling({"a": [0, 0, 1.0], "b": [0, 0, -1.0]}, name="squares")
    k, c = springs(model, 10.0, 1.0)
    assert k[0] > 0 and c[0] > 0 and np.isfinite([k, c]).all()


# ------------------------------------------------------------------ forces


def held(model, **how):
    return pc.Scene(model).add(E.Loop(method="penalty", **({"frequency": 40.0, "damping_ratio": 0.3} | how)))


@pytest.mark.parametrize("name", MOVING)
def test_forces_and_energies_are_those_of_the_rows(name):
    """-Q*(k r + c Qv), ½ Σ k r², off the loops and moving; in every precision that the model has."""
    model = MOVING[name]()
    k, c = springs(model, 40.0, 0.3)
    assert np.allclose(c * 40.0, k * 0.6) or name == "rover"
    rng = np.random.default_rng(3)
    q, v = model.integrate(model.q, 0.05 * rng.normal(size=model.nv)), rng.normal(size=model.nv)
    r, Q = model.loops.residual(q), model.loops.jacobian(q)
    scene = held(model)
    said = scene.evaluate(q, v)
    close(said.forces["loop"], -Q.T @ (k * r + c * (Q @ v)))
    model_gravity, model.gravity = model.gravity, (0, 0, 0)
    close(said.vdot, model.forward_dynamics(q, v, said.forces["loop"]), 1e-10)
    model.gravity = model_gravity
    if name != "function":
        for precision in ("extended", "quad"):
            wide = pc.Scene(model, precision=precision).add(*scene.effects.values()).evaluate(q, v)
            close(wide.forces["loop"], said.forces["loop"], 1e-11)
    run = scene.simulate(1e-6, q, v, progress=False)
    assert run.energy["potential"][0] == pytest.approx(0.5 * np.sum(k * r**2), rel=1e-12, abs=1e-14)
    # the first step is so short that the dampers' power is constant over it
    assert run.energy["work"][-1].sum() == pytest.approx(-np.sum(c * (Q @ v) ** 2) * 1e-6, rel=1e-3)


HINGES = ("weld", "pin", "slider", "screw", "universal", "cylindrical", "planar", "ball", "gimbal")


def opened(kind):
    """A loop of this kind between a body and a node of a tree of every hinge, off by a little, moving."""
    model, rng = every_kind(seed=1), np.random.default_rng(5)
    bodies = list(model.bodies)
    model.add_node("eye", bodies[-1], position=rng.normal(size=3), rotation=Rotation.random(random_state=1).as_matrix())
    state = model.random_state(4)
    model.q, model.v = state.q, state.v
    X = model.frame(bodies[2]).pose(wrt="eye")
    X[:3, :3] = X[:3, :3] @ Rotation.from_rotvec(0.1 * rng.normal(size=3)).as_matrix()
    X[:3, 3] += 0.1 * rng.normal(size=3)
    given = {"axis": rng.normal(size=3)} if kind in ("pin", "slider", "screw", "cylindrical", "planar") else {}
    given |= {"axes": [rng.normal(size=3), rng.normal(size=3)]} if kind == "universal" else {}
    given |= {"pitch": 0.3} if kind == "screw" else {}
    model.add_loop(bodies[2], "eye", kind, **given, placement=X, name="loop")
    return model


def rolling(kind):
    model = pc.Multibody(kind)
    model.add_body("disc", hinge="free", mass=2.0, inertia=np.diag([0.1, 0.15, 0.2]))
    model.add_rolling("disc", None, kind, radius=0.5, name="ground") if kind != "blade" else model.add_rolling("disc", kind="blade")
    model.q = [*Rotation.from_euler("xz", [1.1, 0.3]).as_quat()[[3, 0, 1, 2]], 0.1, 0.2, 0.47]
    model.v = [0.3, 0.2, 2.0, 1.0, 0.1, -0.2]
    return model


def surface():
    model = every_kind(seed=2)
    state = model.random_state(2)
    model.q, model.v = state.q, state.v
    model.add_node("tip", list(model.bodies)[-1], position=(0.1, 0.2, 0.3))
    model.add_surface("tip", list(model.bodies)[1], A=np.diag([1.0, 2.0, 0.5]), b=(0.1, 0.0, -1.0), c=-0.5, name="across")
    return model


KINDS = {kind: partial(opened, kind) for kind in HINGES}
KINDS |= {f"{kind} on the ground": partial(rolling, kind) for kind in ("wheel", "ball", "blade")}
KINDS |= {"surface": surface} | {name: make for name, make in MOVING.items() if name != "function"}


@pytest.mark.parametrize("kind", KINDS)
def test_tangents_are_exact(kind):
    """Linear models of the scene against central differences of its accelerations over 1e-6: 1e-9 of third derivatives and rounding, both
    times the springs, which are in the scale."""
    model = KINDS[kind]()
    model.gravity = (0, 0, 0)
    scene, q, v, n = held(model), np.array(model.q), np.array(model.v), model.nv
    close(scene.evaluate(q, v).forces["loop"], -model.loops.jacobian(q).T @ np.add(*(x * y for x, y in zip(
        springs(model, 40.0, 0.3), (model.loops.residual(q), model.loops.jacobian(q) @ v), strict=True))), 1e-11)  # fmt: skip
    A = scene.linearize(q, v).A
    h = 1e-6
    for j in range(n):
        step = h * np.eye(n)[j]
        by_q = (scene.evaluate(model.integrate(q, step), v).vdot - scene.evaluate(model.integrate(q, -step), v).vdot) / (2 * h)
        by_v = (scene.evaluate(q, v + step).vdot - scene.evaluate(q, v - step).vdot) / (2 * h)
        close(A[n:, j], by_q, 2e-6)
        close(A[n:, n + j], by_v, 2e-6)


def test_functions_of_users_are_differenced_and_run():
    model = MOVING["function"]()
    scene = held(model, frequency=200.0)
    explicit = scene.simulate(0.2, rtol=1e-8, progress=False)
    stiff = scene.simulate(0.2, integrator="rosenbrock4", rtol=1e-8, progress=False)
    close(stiff.q[-1], explicit.q[-1], 1e-6)


# ------------------------------------------------------------------ stiff springs


def test_stiff_springs_keep_what_loops_keep():
    """A slider-crank: off by λ/k, as 1/ω² and no other power; what opens is what pulls."""
    kept = M.slider_crank(10.0).simulate(0.3, rtol=1e-11, progress=False).q[-1]
    model = M.slider_crank(10.0).model
    errors, drifts = [], []
    for omega in (1e3, 4e3, 1.6e4):
        scene = pc.Scene(model).add(E.Loop(method="penalty", frequency=omega))
        q, v = M.slider_crank(10.0).simulate(1e-9, progress=False).q[0], model.v
        run = scene.simulate(0.3, q, v, rtol=1e-10, integrator="rosenbrock4", progress=False)
        errors.append(np.abs(run.q[-1] - kept).max())
        drifts.append(run.drift["wrist"].max())
    for found in (errors, drifts):
        ratios = np.divide(found[:-1], found[1:])
        assert (np.abs(ratios / 16 - 1) < 0.25).all(), ratios
    assert errors[-1] < 1e-4


def test_stiff_integrators_pass_over_springs():
    """A hundred times stiffer: explicit steps are ten times as many, implicit ones by derivatives are not."""
    model = linkages.n_four_bar(2, 1.0)
    start = model.assemble(model.q, [1.0, -1, 1, -1, 1])

    def evaluations(integrator, frequency):
        scene = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Loop(method="penalty", frequency=frequency))
        run = scene.simulate(0.5, start.q, start.v, integrator=integrator, rtol=1e-5, atol=1e-7, progress=False, energy=False)
        return run.statistics["evaluations"]

    assert evaluations("dopri5", 1e4) > 5 * evaluations("dopri5", 1e3)
    assert evaluations("rosenbrock4", 1e5) < 2 * evaluations("rosenbrock4", 1e3) < evaluations("dopri5", 1e4)


def test_interbody_forces_are_those_of_the_loop():
    """The square of docs/loops.md at rest: each crank carries itself and half of the rod on top, whether rows or springs hold it."""
    bars = pc.chain(3)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), position=(0, 0, 0), name="closure")
    square = [np.pi / 2, -np.pi / 2, -np.pi / 2]
    bars.q = square
    scene = pc.Scene(bars).add(E.Gravity((0, -10, 0)), E.Loop(method="penalty", frequency=1e5))
    rest = scene.equilibrium(q0=square)
    close(np.ravel(scene.interbody_forces("hinge0", rest.q, axes="aligned"))[3:], [0.0, 15.0, 0.0], 1e-6)


# ------------------------------------------------------------------ scenes


def test_a_held_scene_is_a_tree_with_forces():
    model = closed_four_bar()
    scene = held(model)
    assert "loop" in scene.evaluate(model.q, model.v).passes and "loops" not in scene.explain()
    scene.linearize(model.q, model.v)  # all coordinates: nothing is dependent
    assert scene.linearize(model.q, model.v).A.shape == (6, 6)
    run = scene.simulate(0.01, integrator="rosenbrock4", progress=False)
    assert run.drift["closure"].max() > 0


def test_springs_are_of_the_present_state():
    """Another q of the model is another compliance; also in a scene that was run before."""
    model = closed_four_bar()
    scene, off = held(model), model.integrate(model.q, [0.01, 0.0, 0.0])
    before = scene.evaluate(off, np.zeros(3)).forces["loop"]
    model.q = model.assemble([0.5, -0.3, -1.5]).q
    after = scene.evaluate(off, np.zeros(3)).forces["loop"]
    assert np.abs(after - before).max() > 1e-3 * np.abs(before).max()
    close(after, held(model).evaluate(off, np.zeros(3)).forces["loop"])


def test_a_scene_keeps_some_loops_and_holds_others(tmp_path):
    model = linkages.n_four_bar(2, 1.0)
    scene = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Loop("loop1"), E.Loop("loop2", method="penalty", frequency=300.0))
    run = scene.simulate(0.3, progress=False)
    assert run.drift["loop1"].max() < 1e-14 < 1e-6 < run.drift["loop2"].max() < 1e-2
    scene.save(tmp_path / "bars.toml")
    assert np.array_equal(pc.load_scene(tmp_path / "bars.toml").simulate(0.3, progress=False).q, run.q)
    assert repr(scene.effects["loop_2"]) == "Loop(loops='loop2', method='penalty', frequency=300.0)"


def test_degenerate_models():
    weld = pc.Multibody("weld")
    weld.add_body("a", None, "weld", mass=1.0)
    weld.add_body("b", None, "pin", mass=1.0, inertia=np.eye(3))
    weld.add_loop("b", hinge="free", name="nothing")
    said = pc.Scene(weld).add(E.Loop(method="penalty", frequency=1.0)).evaluate([0.3], [1.0])
    assert not said.vdot.any()


@pytest.mark.parametrize(
    ("how", "says"),
    [
        ({"method": "penalty"}, "needs frequency="),
        ({"method": "penalty", "frequency": 0.0}, "positive and finite"),
        ({"method": "penalty", "frequency": -1.0}, "positive and finite"),
        ({"method": "penalty", "frequency": np.inf}, "positive and finite"),
        ({"method": "penalty", "frequency": 1e200}, "no finite number"),
        ({"method": "penalty", "frequency": 1.0, "damping_ratio": -0.1}, "damping_ratio is a finite number"),
        ({"method": "penalty", "frequency": 1.0, "alpha": 1.0}, "alpha and beta apply only to method 'augment'"),
        ({"frequency": 1.0}, "frequency and damping_ratio apply only to method 'penalty'"),
        ({"method": "embed", "damping_ratio": 0.5}, "frequency and damping_ratio apply only to method 'penalty'"),
        ({"method": "penalty", "frequency": "fast"}, "frequency"),
        ({"method": "penalty", "frequency": 1.0, "loops": "no"}, "no"),
        ({"method": "penalty", "frequency": 1.0, "loops": ["closure", "closure"]}, "named twice"),
        ({"method": "springs"}, "there are 'augment', 'embed', 'penalty'"),
    ],
)
def test_refusals(how, says):
    model = closed_four_bar()
    with pytest.raises(pc.Error, match=says):
        pc.Scene(model).add(E.Loop(**how)).evaluate(model.q, model.v)


def test_a_tree_without_inertia_has_no_frequency():
    model = pc.Multibody("light")
    model.add_body("a", None, "pin", mass=1.0, inertia=np.eye(3))
    model.add_body("b", "a", "pin", position=(1, 0, 0))
    model.add_coupling({"a": 1.0, "b": 1.0}, name="gear")
    with pytest.raises(pc.SingularHingeError, match="b"):
        pc.Scene(model).add(E.Loop(method="penalty", frequency=1.0)).evaluate([0, 0], [0, 0])
