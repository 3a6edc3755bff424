"""Sweeps in packs of states: bit for bit the runs one by one, whatever acts and however they are integrated; what declines, and why."""

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.runs import spinning

E = pc.effects
WIDTH = _core.pack_width()
TIMES = np.linspace(0, 0.4, 4)
STIFF = np.diag([3.0, 2.0, 4.0, 5.0, 3.0, 6.0])


def everything(run):
    """A measure: what of a run must not depend on others."""
    told = run.statistics
    kept = {"times": run.t, "positions": run.q, "velocities": run.v, "own": run.states, "work": run.energy["work"]}
    return kept | {name: told[name] for name in ("steps", "evaluations", "rejected", "in_packs")}


def end(run):
    """A measure."""
    return {"end": run.q[-1], "in_packs": run.statistics["in_packs"]}


def machine():
    """A free hub with a ball, a slider and, on that, pins with a fork; nodes on two of them."""
    model = spinning().model
    inertia = np.diag([0.05, 0.1, 0.08])
    model.add_body("arm", "boom", "pin", axis=(0, 1, 0), position=(0.2, 0, 0.1), mass=0.6, com=(0.2, 0, 0.1), inertia=inertia)
    model.add_body("left", "arm", "pin", axis=(1, 0, 0), position=(0.4, 0, 0), mass=0.3, com=(0, 0.1, 0.1))
    model.add_body("right", "arm", "screw", axis=(0, 0, 1), pitch=0.1, position=(0.4, 0.1, 0), mass=0.3, com=(0.1, 0.1, 0), inertia=inertia)
    model.add_node("tip", "left", position=(0, 0.2, 0))
    model.add_node("eye", "hub", position=(0.1, 0.5, 0))
    return model


PINS = ["arm", "left"]
EFFECTS = {
    "nothing": lambda: [],
    "gravity and damping": lambda: [E.Gravity(), E.Damping(0.4)],
    "frictions": lambda: [E.QuadraticDamping(0.3), E.CoulombFriction(0.2, smoothing=0.1)],
    "springs": lambda: [E.Gravity(), E.Spring(3.0, hinges=["ball", "boom", *PINS])],
    "fields": lambda: [E.PointMassGravity(30.0, position=(5, 4, 3)), E.GravityGradient(3.0, position=(5, 4, 3))],
    "fluids": lambda: [E.Gravity(), E.GravityCompensation(0.6), E.FluidDrag(3.0, 0.5, (0.3, 0.2, 0.1))],
    "between nodes": lambda: [
        E.NodeSpring("tip", "eye", 40.0, length=0.3),
        E.NodeDamper("tip", "eye", 2.0),
        E.Bushing("eye", None, STIFF, STIFF),
    ],
    "drives": lambda: [
        E.TorqueSource(E.Harmonic(0.4, 0.9), hinges="boom"),
        E.Servo(8.0, 0.3, 0.5, hinges=PINS),
        E.RotorInertia(0.2, hinges=PINS),
    ],
    "motor": lambda: [E.Motor(0.4, 1.0, 20.0, 3.0, 0.01, hinges=PINS, effort_limit=2.0)],
    "limits": lambda: [E.Gravity(), E.Limits(20.0, 0.2, lower=-0.1, upper=0.1, hinges=PINS)],
    "wrench": lambda: [E.Gravity(), E.Wrench("tip", [1, 2, 3, 4, 5, 6], axes="eye"), E.Wrench("eye", [0, 0, 1, 3, 0, 0])],
    "thermostats": lambda: [E.Langevin(0.7, 0.4, 0.07, seed=5), E.NoseHoover(0.7, 0.3, hinges=PINS), E.Fixman(0.5)],
    "prescribed": lambda: [
        E.Gravity(),
        E.Prescribed("boom", E.Harmonic(0.3, 1.0)),
        E.Prescribed("left", E.Harmonic(0.5, 0.7)),
        E.Damping(0.1),
    ],
}


def scene_of(name):
    return pc.Scene(machine()).add(*EFFECTS[name]())


def one_by_one(scene, samples, T, **options):
    """The same sweep as runs of their own, or what they raise."""
    found = []
    for i in range(samples.count):
        row = samples.row(i)
        try:
            found.append(everything(scene.simulate(T, row.get("q"), row.get("v"), progress=False, **options)))
        except Exception as error:
            found.append(f"{type(error).__name__}: {error}")
    return found


def assert_same(found, alone):
    failed = {failure.sample: failure.reason for failure in found.failures}
    assert failed == {i: each for i, each in enumerate(alone) if isinstance(each, str)}
    for i, each in enumerate(alone):
        for name in set(found) - {"in_packs"} if i not in failed else ():
            assert np.array_equal(found[name][i], each[name]), (i, name)


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("integrator", ["dopri5", "auto", "rk4"])
def test_each_run_has_the_bits_it_has_alone(name, integrator):
    scene = scene_of(name)
    samples = pc.samples.states(scene.model, 2 * WIDTH + 3, seed=3)
    options = {"integrator": integrator, "rtol": 1e-6, "atol": 1e-8, "step": 0.01, "t_eval": TIMES}
    found = pc.sweep(scene, samples, 0.4, measure=everything, workers=1, progress=False, **options)
    assert found.explain() == f"{samples.count} runs, side by side in packs of {WIDTH} states"
    assert_same(found, one_by_one(scene, samples, 0.4, **options))
    assert not found.failures
    assert found["in_packs"].sum() > 0.7 * found["evaluations"].sum()  # lanes that are left at the end are alone


@pytest.mark.parametrize(
    "integrator", ["cash-karp54", "dop853", "bulirsch-stoer", "rosenbrock4", "rkmk4", "semi-implicit-euler", "dopri5", "auto"]
)
@pytest.mark.parametrize("count", [1, 2, WIDTH - 1, WIDTH + 1])
def test_every_integrator_and_odd_counts(integrator, count):
    scene = scene_of("springs").add(E.Damping(0.2))
    samples = pc.samples.states(scene.model, count, seed=count)
    options = {"integrator": integrator, "rtol": 1e-5, "atol": 1e-7, "step": 0.02}
    found = pc.sweep(scene, samples, 0.3, measure=end, workers=1, progress=False, **options)
    alone = [scene.simulate(0.3, q, v, progress=False, **options).q[-1] for q, v in zip(samples["q"], samples["v"], strict=True)]
    assert np.array_equal(found["end"], alone)
    assert (found["in_packs"].sum() > 0) == (count > 1)


@pytest.mark.parametrize("coefficients", [[5.0], [5.0, 9.0]])
def test_implicit_steps_share_packs(coefficients):
    """h C + h² K in D: lanes that have the same share a pack."""
    scene = pc.Scene(machine()).add(E.Gravity(), E.ImplicitDamping(5.0, hinges=PINS), E.ImplicitSpring(200.0, hinges=PINS))
    n = WIDTH + 2
    samples = pc.samples.states(scene.model, n, seed=1) | pc.samples.Samples(
        {"effects.implicit_damping.coefficient": np.resize(coefficients, n)}
    )
    options = {"integrator": "semi-implicit-euler", "step": 0.0103, "t_eval": TIMES}
    found = pc.sweep(scene, samples, 0.4, measure=everything, workers=1, progress=False, **options)
    for i in range(n):
        scene.effects["implicit_damping"].coefficient = float(samples["effects.implicit_damping.coefficient"][i])
        alone = everything(scene.simulate(0.4, samples["q"][i], samples["v"][i], progress=False, **options))
        assert all(np.array_equal(found[name][i], alone[name]) for name in set(found) - {"in_packs"}), i
    assert found["in_packs"].sum() > 0.5 * found["evaluations"].sum()


def test_parameters_of_effects_are_each_lane_s():
    model = machine()
    acting = [
        E.Gravity(),
        E.Damping(0.1),
        E.RotorInertia(0.1, hinges=PINS),
        E.Wrench("tip", [0, 0, 0, 1, 2, 3]),
        E.Spring(1.0, hinges=PINS),
    ]
    scene, n = pc.Scene(model).add(*acting), 2 * WIDTH + 1
    rng = np.random.default_rng(5)
    samples = pc.samples.states(model, n, seed=2) | pc.samples.random(
        n, {"effects.damping.coefficient": (0, 1), "effects.gravity.g[2]": (-12, -5), "effects.wrench.wrench[4]": (-4, 4)}, seed=1
    )  # fmt: skip
    inertia = np.repeat(rng.uniform(0.05, 0.5, n // 3 + 1), 3)[:n]  # packs are of those alike
    stiffness = 10.0 ** rng.uniform(0, 6, n)  # from soft to stiff: lanes that need very different steps
    samples = samples | pc.samples.Samples({"effects.rotor_inertia.inertia": inertia, "effects.spring.stiffness": stiffness})
    options = {"rtol": 1e-6, "atol": 1e-8, "t_eval": TIMES}
    found = pc.sweep(scene, samples, 0.4, measure=everything, workers=1, progress=False, **options)
    assert "packs" in found.explain() and found["in_packs"].sum() > 0 and not found.failures
    assert found["steps"].max() > 10 * found["steps"].min()
    for i in range(n):
        row = samples.row(i)
        by_hand = pc.Scene(model).add(
            E.Gravity(g=(0, 0, row["effects.gravity.g[2]"])), E.Damping(row["effects.damping.coefficient"]),
            E.RotorInertia(inertia[i], hinges=PINS),
            E.Wrench("tip", [0, 0, 0, 1, row["effects.wrench.wrench[4]"], 3]), E.Spring(stiffness[i], hinges=PINS),
        )  # fmt: skip
        alone = everything(by_hand.simulate(0.4, row["q"], row["v"], progress=False, **options))
        assert all(np.array_equal(found[name][i], alone[name]) for name in set(found) - {"in_packs"}), i


@pytest.mark.parametrize("integrator", ["dopri5", "auto", "rk4"])
@pytest.mark.filterwarnings("ignore:quadratic_damping")
def test_a_lane_that_fails_disturbs_no_other(integrator):
    """One that is no state, one that blows up: reasons and times are those of runs by themselves."""
    with pytest.warns(pc.ModelWarning):
        scene = scene_of("gravity and damping").add(E.QuadraticDamping(-0.5))
    samples = pc.samples.states(scene.model, WIDTH + 3, seed=8)
    v = samples["v"].copy()
    v[1, 2], v[3], v[4:] = np.nan, 1e3, 0.1 * v[4:]
    samples = pc.samples.Samples({"q": samples["q"], "v": v})
    options = {"integrator": integrator, "rtol": 1e-6, "step": 0.01, "t_eval": [0.0, 0.1]}
    found = pc.sweep(scene, samples, 0.1, measure=everything, workers=1, progress=False, **options)
    assert_same(found, one_by_one(scene, samples, 0.1, **options))
    reasons = {failure.sample: failure.reason for failure in found.failures}
    assert {1, 3} <= set(reasons) and len(reasons) < samples.count - 3
    assert "entry 2 is nan" in reasons[1] and ("overflows" if integrator == "rk4" else "step size fell") in reasons[3]


def test_a_lane_that_is_singular_is_decided_by_itself():
    """A massless link carries a point mass: upright, the mass is on the link's axis."""
    model = pc.Multibody("on the axis")
    model.add_body("massless", hinge="pin", axis=(0, 0, 1))
    model.add_body("mass", "massless", "pin", axis=(0, 1, 0), mass=1.0, com=(0, 0, 1))
    scene = pc.Scene(model).add(E.Gravity())
    angles = np.linspace(0.3, 1, WIDTH + 1)
    angles[2] = 0
    samples = pc.samples.Samples({"q": np.column_stack([0 * angles, angles])})
    found = pc.sweep(scene, samples, 0.01, measure=everything, workers=1, progress=False, t_eval=[0.0, 0.01], rtol=1e-6)
    assert_same(found, one_by_one(scene, samples, 0.01, t_eval=[0.0, 0.01], rtol=1e-6))
    assert [failure.sample for failure in found.failures] == [2]
    assert "SingularHingeError: " in found.failures[0].reason and "integrating, at t = 0 s" in found.failures[0].reason


@pytest.mark.parametrize("on", ["threads", "processes"])
def test_where_packs_run_changes_no_bit(on):
    scene = scene_of("gravity and damping")
    samples = pc.samples.states(scene.model, 40, seed=5)
    alone = [scene.simulate(0.2, *row, t_eval=[0, 0.2], progress=False).q[-1] for row in zip(samples["q"], samples["v"], strict=True)]
    found = pc.sweep(scene, samples, 0.2, on=on, workers=2, progress=False)
    assert np.array_equal(found["end.q"], alone)


def push(t, state):
    return [0.1] * len(state.v)


def never(t, state):
    return 1.0


@pytest.mark.parametrize(
    "change, options, why",
    [
        (lambda scene: scene.add(push), {}, "effect 'push' is written in Python"),
        (lambda scene: scene.add(E.TorqueSource(lambda t: 0.1 * t, hinges="boom")), {}, "effect 'torque_source' is written in Python"),
        (lambda scene: scene.add(E.Prescribed("boom", lambda t: (0.1 * t, 0.1, 0.0))), {}, "effect 'prescribed' is written in Python"),
        (lambda scene: scene, {"events": never}, "the runs look for events"),
        (lambda scene: scene, {"integrator": "scipy:RK45"}, "integrator 'scipy:RK45' belongs to another package"),
        (lambda scene: scene, {"integrator": "variational2", "step": 0.01}, "integrator 'variational2' solves for momenta"),
        (lambda scene: pc.Scene(scene.model, precision="extended").add(E.Gravity()), {}, "packs are of states in double precision"),
        (lambda scene: pc.Scene(scene.model, form="ud").add(E.Wrench("tip", [1] * 6)), {}, "packs have one wrench for all states"),
    ],
)  # fmt: skip
def test_what_declines_says_why_and_runs_one_by_one(change, options, why):
    scene = change(pc.Scene(machine()).add(E.Gravity()))
    samples = pc.samples.states(scene.model, 3, seed=4)
    options = {"rtol": 1e-4, "atol": 1e-4, "t_eval": [0.0, 0.05]} | options
    found = pc.sweep(scene, samples, 0.05, measure=everything, progress=False, **options)
    assert "one by one: " in found.explain() and why in found.explain()
    assert_same(found, one_by_one(scene, samples, 0.05, **options))
    assert not found["in_packs"].any()


def test_models_that_differ_decline():
    scene = scene_of("gravity and damping")
    found = pc.sweep(scene, {"bodies.arm.mass": [0.5, 0.6]}, 0.05, rtol=1e-4, progress=False)
    assert found.explain() == "2 runs, one by one: samples set 'bodies.arm.mass', and a pack shares one model"
    assert pc.sweep(lambda x: x, {"x": [1.0]}, progress=False).explain() == "1 runs, one by one: they call a function"


@pytest.mark.parametrize("how", [{"form": "ud"}, {"form": "square-root"}, {"refine": 1}])
def test_other_forms_go_in_packs(how):
    scene = pc.Scene(machine(), **how).add(E.Gravity(), E.Damping(0.3))
    samples = pc.samples.states(scene.model, WIDTH + 1, seed=6)
    options = {"rtol": 1e-5, "t_eval": TIMES}
    found = pc.sweep(scene, samples, 0.4, measure=everything, workers=1, progress=False, **options)
    assert_same(found, one_by_one(scene, samples, 0.4, **options))
    assert found["in_packs"].sum() > 0.5 * found["evaluations"].sum()


def test_a_sample_that_makes_it_python_s_runs_by_itself():
    """One torque among those sampled is a function in Python."""
    scene = pc.Scene(machine()).add(E.Gravity(), E.TorqueSource(0.1, hinges="boom"))
    torques = [0.1, lambda t: 0.2, 0.3, 0.2]
    found = pc.sweep(
        scene, {"effects.torque_source.torque": torques}, 0.1, measure=everything, workers=1, progress=False, t_eval=[0.0, 0.1]
    )
    assert (found["in_packs"] > 0).tolist() == [True, False, True, True] and np.array_equal(found["positions"][1], found["positions"][3])
