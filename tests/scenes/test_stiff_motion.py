"""Motion that stability holds the steps of: said early, by whom it is so, and left to a method for it by "auto"."""

import pickle
import warnings

import numpy as np
import pytest

import pycraft as pc

E = pc.effects
QUIET = dict(progress=False)


def finger():
    """0.01 kg pushed by 0.2 N m under friction of 0.5 N m: a decay of 5·10⁶ /s."""
    model = pc.Multibody("finger")
    model.add_body("f", axis=(0, 0, 1), mass=0.01, com=(0.02, 0, 0), inertia=1e-6 * np.eye(3))
    return pc.Scene(model).add(E.TorqueSource(0.2), E.CoulombFriction(0.5))


def held_arm():
    """A UR5 under its weight, held by motors that push a fiftieth more, with dry friction."""
    arm = pc.robots.ur5()
    arm.gravity = (0, 0, -9.81)
    q = np.array([0.3, -1.0, 0.8, 0.4, 0.5, 0.1])
    hold = arm.inverse_dynamics(q, np.zeros(6), np.zeros(6))
    return pc.Scene(arm).add(E.Gravity(), E.TorqueSource(1.02 * hold), E.CoulombFriction(3.0, smoothing=1e-2)), q


def block(smoothing=1e-5, friction=1.0):
    """1 kg on a spring, shaken, on a dry floor: it sticks and slips in turn."""
    model = pc.Multibody("block")
    model.add_body("b", None, "slider", axis=(1, 0, 0), mass=1.0)
    return pc.Scene(model).add(E.Spring(20.0), E.TorqueSource(E.Harmonic(4.0, 0.4)), E.CoulombFriction(friction, smoothing=smoothing))


def stopped_by_its_warning(scene, *args, **options):
    """The run up to its warning, and what that says."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", pc.ModelWarning)
        with pytest.raises(pc.ModelWarning) as caught:
            scene.simulate(*args, **QUIET, **options)
    return scene.last_run, str(caught.value)


# ---------------------------------------------------------------------- what is said


@pytest.mark.parametrize("integrator", ["dopri5", "dop853"])
def test_said_early_and_of_whom(integrator):
    """Of 2.5 million steps the first thousands are enough; the rate is F/(smoothing ℳ) = 0.5/(0.01 · 5·10⁻⁶), less where it creeps."""
    scene = finger().add(E.Damping(1e-9))
    run, text = stopped_by_its_warning(scene, 1.0, [0.0], [0.0], integrator=integrator)
    assert run.statistics["steps"] < 3000 and run.t[-1] < 2e-3
    for words in ("the scene of 'finger' is stiff", f"integrator '{integrator}'", "stability", "'coulomb_friction' damps coordinate 'f'"):
        assert words in text
    assert "Take integrator='rosenbrock4', or 'auto'" in text
    found = run.statistics["stiffness"]
    mass, creep = 1e-6 + 0.01 * 0.02**2, np.arctanh(0.4) * 0.01
    assert found["rate"] == pytest.approx(-0.5 / 0.01 / np.cosh(creep / 0.01) ** 2 / mass, rel=0.02)
    assert found["left"] > 1e5 and found["effect"] == "coulomb_friction"


def test_an_arm_that_friction_holds():
    scene, q = held_arm()
    run, text = stopped_by_its_warning(scene, 10.0, q, np.zeros(6), integrator="dopri5")
    assert run.statistics["steps"] < 5000 and run.t[-1] < 0.1
    assert "'coulomb_friction' damps coordinate 'wrist_" in text  # the lightest


def stuck():
    """1 kg that is pushed with four tenths of its friction: it creeps, and dopri5 takes 2,000 steps a second."""
    return pc.Scene(block().model).add(E.TorqueSource(0.4), E.CoulombFriction(1.0, smoothing=1e-4))


def test_said_once_for_each_scene_and_in_sweeps():
    scene = stuck()
    with pytest.warns(pc.ModelWarning, match="is stiff") as caught:
        for _ in range(2):
            scene.simulate(10.0, [0.0], [0.0], integrator="dopri5", **QUIET)
    assert sum("is stiff" in str(w.message) for w in caught) == 1
    scene = stuck()
    with pytest.warns(pc.ModelWarning, match="is stiff") as caught:
        pc.sweep(scene, pc.samples.states(scene.model, 3, seed=1), 10.0, integrator="dopri5", workers=1, progress=False)
    assert sum("is stiff" in str(w.message) for w in caught) == 1


def test_stiffness_that_passes_is_no_matter():
    """A block that sticks for a tenth of a second and slips then: 660 steps in all, and no word."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", pc.ModelWarning)
        assert block(1e-4).simulate(5.0, [0.0], [0.0], integrator="dopri5", rtol=1e-8, atol=1e-10, **QUIET).statistics["steps"] < 2000


def test_trajectories_of_a_model_say_it_too():
    model = finger().model
    with pytest.warns(
        pc.ModelWarning, match="the motion of 'finger' is stiff: integrator 'dopri5' .* damps coordinate 'f' at a rate of 1e.08"
    ):
        model.integrate_ode([0.0], [1.0], [0.0, 1e-3], damping=[500.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error", pc.ModelWarning)
        model.integrate_ode([0.0], [1.0], [0.0, 1e-3], damping=[500.0], integrator="auto")


def test_what_to_take_where_rosenbrock4_is_not_for_it():
    wide = pc.Scene(finger().model, precision="extended").add(E.TorqueSource(0.2), E.CoulombFriction(0.5))
    assert "rosenbrock4' in precision='double'" in stopped_by_its_warning(wide, 1.0, [0.0], [0.0])[1]
    model = pc.chain(3)
    model.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    state = model.assemble([1, -1, -1], fix="hinge0")
    scene = pc.Scene(model).add(E.Loop(), E.CoulombFriction(5.0, smoothing=1e-7), E.TorqueSource(1.0, hinges="hinge0"))
    text = stopped_by_its_warning(scene, 100.0, state.q, np.zeros(3), rtol=1e-6)[1]
    assert "held by springs" in text and "decays faster than that" in text


def random_scene(seed):
    """Trees of all hinges with forces as large as the motion: nothing decays faster than it moves."""
    rng = np.random.default_rng(seed)
    kinds = rng.choice(["pin", "slider", "screw", "universal", "cylindrical", "planar", "ball", "free"], int(rng.integers(1, 5)))
    model = pc.tree([-1, *(int(rng.integers(0, k)) for k in range(1, len(kinds)))], list(kinds), seed=seed)
    scene = pc.Scene(model).add(E.Gravity((0, 0, -9.81)))
    for effect, share in ((E.Damping(0.3), 0.6), (E.TorqueSource(E.Harmonic(0.5, 0.7)), 0.4), (E.QuadraticDamping(0.2), 0.3)):
        if rng.random() < share:
            scene.add(effect)
    state = model.random_state(seed)
    return scene, state.q, 0.3 * state.v


@pytest.mark.parametrize("seed", range(39))
def test_what_is_not_stiff_is_left_alone(seed):
    scene, q, v = random_scene(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("error", pc.ModelWarning)
        for integrator in ("dopri5", "dop853"):
            assert "stiffness" not in scene.simulate(1.0, q, v, integrator=integrator, rtol=1e-7, **QUIET).statistics
        auto = scene.simulate(1.0, q, v, integrator="auto", rtol=1e-7, **QUIET)
    plain = scene.simulate(1.0, q, v, rtol=1e-7, **QUIET)
    assert auto.statistics["switches"] == [] and np.array_equal(auto.q, plain.q) and np.array_equal(auto.v, plain.v)


def test_fast_oscillations_are_no_stiffness():
    """10⁵ rad/s without damping, below the tolerances: a method that damps it would be no better."""
    model = pc.Multibody("b")
    model.add_body("slow", None, "slider", axis=(1, 0, 0), mass=1.0)
    model.add_body("fast", "slow", "slider", axis=(0, 1, 0), mass=1e-3)
    scene = pc.Scene(model).add(E.Spring(1.0, hinges="slow"), E.Spring(1e7, hinges="fast"))
    with warnings.catch_warnings():
        warnings.simplefilter("error", pc.ModelWarning)
        scene.simulate(0.5, [1.0, 1e-14], [0.0, 0.0], rtol=1e-4, atol=1e-6, **QUIET)


# ---------------------------------------------------------------------- "auto"


def test_the_default_is_dopri5_until_the_motion_is_stiff():
    """Bit for bit, in runs and sweeps; and where it is, the motion that looked hung takes a few hundred steps, without a word."""
    scene = pc.mechanisms.double_pendulum()
    default, plain = (scene.simulate(1.0, **how, **QUIET) for how in ({}, {"integrator": "dopri5"}))
    assert default.statistics["switches"] == [] and default.statistics["evaluations"] == plain.statistics["evaluations"]
    assert np.array_equal(default.t, plain.t) and np.array_equal(default.q, plain.q) and np.array_equal(default.v, plain.v)
    with warnings.catch_warnings():
        warnings.simplefilter("error", pc.ModelWarning)
        run = finger().simulate(1.0, [0.0], [0.0], **QUIET)
    assert run.statistics["steps"] < 1000 and run.q[-1, 0] == pytest.approx(0.00423649, abs=1e-7)


def test_auto_takes_what_is_for_stiff_motion():
    """Both against rosenbrock4 at a hundredth of the tolerance."""
    scene = finger()
    run = scene.simulate(1.0, [0.0], [0.0], integrator="auto", **QUIET)
    assert run.statistics["steps"] < 1000 and [name for _, name in run.statistics["switches"]] == ["rosenbrock4"]
    best = scene.simulate(1.0, [0.0], [0.0], integrator="rosenbrock4", rtol=1e-11, atol=1e-14, **QUIET)
    assert run.q[-1, 0] == pytest.approx(best.q[-1, 0], abs=1e-9) and run.v[-1, 0] == pytest.approx(best.v[-1, 0], rel=1e-7)
    arm, q = held_arm()
    run, best = (arm.simulate(10.0, q, np.zeros(6), integrator=name, **QUIET) for name in ("auto", "rosenbrock4"))
    assert run.statistics["steps"] < 5000 and np.abs(run.q[-1] - best.q[-1]).max() < 1e-7
    assert np.ptp(run.balance) < 1e-5


@pytest.fixture(scope="module")
def shaken():
    """A run that switches there and back, and the same motion ten thousand times as exact."""
    run = block().simulate(5.0, [0.1], [0.2], integrator="auto", rtol=1e-8, atol=1e-10, **QUIET)
    best = block().simulate(5.0, [0.1], [0.2], integrator="rosenbrock4", rtol=1e-11, atol=1e-13, **QUIET)
    return run, best


def test_there_and_back(shaken):
    run, best = shaken
    names = [name for _, name in run.statistics["switches"]]
    assert names[:3] == ["rosenbrock4", "dopri5", "rosenbrock4"] and len(names) < 40
    assert all(a != b for a, b in zip(names, names[1:], strict=False))
    assert abs(run.q[-1, 0] - best.q[-1, 0]) < 1e-6 and np.ptp(run.balance) < 1e-5
    assert run.statistics["steps"] < 20_000


def test_between_steps_each_by_its_own_method(shaken):
    run, best = shaken
    times = np.linspace(0.01, 4.99, 400)
    assert np.abs(run.at(times).q - best.at(times).q).max() < 1e-6
    asked = block().simulate(5.0, [0.1], [0.2], integrator="auto", rtol=1e-8, atol=1e-10, t_eval=times, **QUIET)
    assert np.abs(asked.q - run.at(times).q).max() < 1e-14 and np.abs(asked.v - run.at(times).v).max() < 1e-13
    assert asked.statistics["switches"] == run.statistics["switches"]
    shuffled = np.random.default_rng(1).permutation(times)
    assert np.array_equal(run.at(shuffled).q, run.at(times).q[np.searchsorted(times, shuffled)])


def test_events_are_those_of_the_motion(shaken):
    _, best = shaken
    turn = pc.Event(lambda t, s: s.q[0] - 0.05, name="there")
    run = block().simulate(5.0, [0.1], [0.2], integrator="auto", rtol=1e-8, atol=1e-10, events=turn, **QUIET)
    found = run.events["there"]
    assert len(found) > 1 and np.abs(best.at(found.t).q[:, 0] - 0.05).max() < 1e-6


@pytest.mark.parametrize("parts", [(0.2, 0.633), (0.97, 2.9)])
def test_going_on_bit_for_bit(shaken, parts):
    """The counts that lead to a switch are part of the checkpoint."""
    run, _ = shaken
    scene, options = block(), dict(integrator="auto", rtol=1e-8, atol=1e-10)
    first = scene.simulate(parts[0], [0.1], [0.2], **options, **QUIET)
    second = scene.resume(first.checkpoint(), parts[1], **QUIET)
    third = scene.resume(pickle.loads(pickle.dumps(second)), 5.0, **QUIET)
    for name in ("t", "q", "v"):
        own = getattr(third, name)
        assert np.array_equal(own, getattr(run, name)[-len(own) :])
    assert np.abs(third.at(4.321).q - run.at(4.321).q).max() < 1e-14


def test_auto_where_one_of_both_does_not_fit():
    """Implicit effects are rosenbrock4's alone, wide precisions and loops dopri5's."""
    implicit = pc.Scene(finger().model).add(E.TorqueSource(0.2), E.ImplicitDamping(0.1))
    runs = [implicit.simulate(0.1, [0.0], [0.0], integrator=name, **QUIET) for name in ("auto", "rosenbrock4")]
    assert np.array_equal(runs[0].q, runs[1].q) and np.array_equal(runs[0].at(0.03).q, runs[1].at(0.03).q)
    wide = pc.Scene(pc.mechanisms.pendulum().model, precision="extended").add(E.Gravity())
    runs = [wide.simulate(0.3, [0.1], [0.0], integrator=name, **QUIET) for name in ("auto", "dopri5")]
    assert np.array_equal(runs[0].q, runs[1].q)
    crank = pc.mechanisms.slider_crank()
    runs = [crank.simulate(0.1, integrator=name, **QUIET) for name in ("auto", "dopri5")]
    assert np.array_equal(runs[0].q, runs[1].q)


def test_states_and_controllers_go_on():
    """Sampled control, quaternions and effects' own states through a switch."""
    model = pc.tree([-1, 0], ["ball", "pin"], seed=3)
    scene = pc.Scene(model).add(E.Gravity((0, 0, -9.81)), E.Damping(1e5, hinges="hinge1"), E.Sampled(lambda t, s: -0.2 * s.v, 0.05))
    state = model.random_state(2)
    run, best = (
        scene.simulate(1.0, state.q, 0.1 * state.v, integrator=name, rtol=1e-8, atol=1e-10, **QUIET) for name in ("auto", "rosenbrock4")
    )
    assert run.statistics["switches"] and np.abs(model.difference(best.q[-1], run.q[-1])).max() < 1e-5
    assert np.linalg.norm(run.q[-1, :4]) == pytest.approx(1, abs=1e-6)


# ---------------------------------------------------------------------- steps that are too long, tolerances that are too wide


def slider():
    model = pc.Multibody("b")
    model.add_body("b", None, "slider", axis=(1, 0, 0), mass=1.0)
    return model


UNSTABLE = "are unstable for the scene of 'b' at t = .*, of coordinate 'b' under effect '(limits|spring|damping)'. There steps shorter than"


@pytest.mark.parametrize(
    "effect, longest",
    [(E.Limits(1e4, 0.0, -0.5, 0.5), 0.02), (E.Limits(1e8, 0.4, -0.5, 0.5), None), (E.Spring(1e4), 0.02), (E.Damping(1e3), 2e-3)],
    ids=["stops", "hard", "spring", "damping"],
)
def test_an_explicit_step_beyond_its_stability(effect, longest):
    """Said while the run goes, once, with the step that is stable: 2/ω and 2 m/c."""
    scene = pc.Scene(slider()).add(effect)
    with pytest.warns(pc.ModelWarning, match=UNSTABLE) as said:
        run = scene.simulate(0.6, [0.1], [1.0], integrator="semi-implicit-euler", step=0.05, **QUIET)
    assert len(said) == 1 and "ImplicitSpring" in str(said[0].message) and run.statistics["stiffness"]["t"] < 0.6
    if longest:
        assert run.statistics["stiffness"]["longest"] == pytest.approx(longest, rel=1e-6)
    with warnings.catch_warnings():
        warnings.simplefilter("error", pc.ModelWarning)
        scene.simulate(0.5, [0.1], [1.0], integrator="semi-implicit-euler", step=1e-6, t_eval=[0.5], **QUIET)


def test_a_contact_that_is_shorter_than_a_step():
    """Its steps end at the stop, so that energy is kept, and last √6/ω of Runge and Kutta's polynomial, not π/ω: said in its middle."""
    scene = pc.Scene(slider()).add(E.Limits(1e4, 0.0, -0.5, 0.5))
    with pytest.warns(pc.ModelWarning, match=UNSTABLE) as said:
        run = scene.simulate(2.0, [0.0], [1.0], integrator="rk4", step=0.05, **QUIET)
    assert len(said) == 1 and run.statistics["stiffness"]["longest"] == pytest.approx(np.sqrt(8) / 100, rel=1e-6)
    assert np.diff(run.events["limits"].t[:2])[0] == pytest.approx(np.sqrt(6) / 100, rel=1e-6)


@pytest.mark.parametrize("share", [0.98, 1.02])
@pytest.mark.parametrize("integrator", ["semi-implicit-euler", "rk4", "rkmk4"])
@pytest.mark.parametrize(
    "effects",
    [(E.Spring(300.0),), (E.Damping(30.0),), (E.Spring(200.0), E.Damping(3.0)), (E.Spring(400.0), E.ImplicitSpring(300.0)),
     (E.Spring(300.0), E.ImplicitDamping(30.0)), (E.Damping(30.0), E.ImplicitSpring(50.0))],
    ids=["spring", "damper", "both", "spring beside implicit", "spring beside implicit damper", "damper beside implicit"],
)  # fmt: skip
def test_the_bound_of_stability(effects, integrator, share):
    """Of several bodies: eigenvalues of the linearized step, as a matrix; two hundredths on either side of the step where one reaches 1."""
    model = pc.tree([-1, 0, 1, 1], ["pin", "slider", "pin", "pin"], seed=4)
    rest = model.random_state(3).q
    implicit = {type(e): e for e in effects if isinstance(e, (E.ImplicitSpring, E.ImplicitDamping))}
    if implicit and integrator != "semi-implicit-euler":
        pytest.skip("acts in implicit steps")
    given = [type(e)(e.stiffness, rest=rest) if isinstance(e, (E.Spring, E.ImplicitSpring)) else e for e in effects]
    M, n = model.mass_matrix(rest), model.nv

    def of(kinds, what):
        return sum(np.asarray(getattr(e, what), float).max() for e in effects if isinstance(e, kinds)) * np.eye(n)

    k, c = of(E.Spring, "stiffness"), of(E.Damping, "coefficient")
    ki, ci = of(E.ImplicitSpring, "stiffness"), of(E.ImplicitDamping, "coefficient")

    def growth(h):
        if integrator == "semi-implicit-euler":
            rates = np.linalg.solve(M + h * ci + h * h * ki, np.hstack([-(k + ki), -(c + ci) - h * ki]))
            faster = np.hstack([np.zeros((n, n)), np.eye(n)]) + h * rates
            step = np.vstack([np.hstack([np.eye(n), np.zeros((n, n))]) + h * faster, faster])
        else:
            J = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, k), -np.linalg.solve(M, c)]])
            step = sum(np.linalg.matrix_power(h * J, i) / f for i, f in enumerate((1, 1, 2, 6, 24)))
        return np.abs(np.linalg.eigvals(step)).max()

    low, high = 1e-6, 10.0
    if growth(high) <= 1 + 1e-6:
        pytest.skip("stable for any step")
    for _ in range(60):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if growth(middle) > 1 + 1e-6 else (middle, high)
    scene = pc.Scene(model).add(*given)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        run = scene.simulate(5 * share * low, rest, 1e-6 * np.ones(n), integrator=integrator, step=share * low, **QUIET)
    told = [str(w.message) for w in said if "are unstable for" in str(w.message)]  # near the bound the balance is lost on both sides of it
    assert len(told) == (share > 1)
    if share > 1:
        assert len(said) == 1 and "under effect" in told[0]
        assert run.statistics["stiffness"]["longest"] == pytest.approx(low, rel=0.01)


def test_what_grows_by_itself_is_not_unstable_steps():
    """A pendulum upright, and one that swings: steps of a sixth of its period lose accuracy, not stability."""
    pendulum = pc.mechanisms.pendulum()
    with warnings.catch_warnings():
        warnings.simplefilter("error", pc.ModelWarning)
        for integrator in ("rk4", "semi-implicit-euler"):
            pendulum.simulate(1.0, [np.pi - 1e-3], [0.0], integrator=integrator, step=0.02, **QUIET)


def test_a_state_that_is_not_finite_has_no_sign():
    scene = pc.Scene(slider()).add(E.Spring(1e12))
    with pytest.raises(pc.EvaluationError, match=r"is (nan|inf|-inf); take smaller steps"):
        scene.simulate(100.0, [1.0], [1.0], integrator="rk4", step=0.05, **QUIET)


@pytest.mark.parametrize("integrator", ["dopri5", "dop853", "rosenbrock4"])
def test_a_motion_below_the_tolerance(integrator):
    """Amplitude 1e-14 m at 1e3 rad/s under atol = 1e-12; as 1e-11 m, or with the atol of the warning, it is right."""
    scene, T = pc.Scene(slider()).add(E.Spring(1e6)), 20 * np.pi / 1e3
    with pytest.warns(pc.ModelWarning, match="this motion is smaller than its tolerance: .* atol = 1e-12 .* Take atol = "):
        scene.simulate(T, [1e-14], [0.0], integrator=integrator, **QUIET)
    with warnings.catch_warnings():
        warnings.simplefilter("error", pc.ModelWarning)
        scene = pc.Scene(slider()).add(E.Spring(1e6))
        for q, atol in ((1e-11, 1e-12), (1e-14, 1e-18), (0.0, 1e-12)):
            scene.simulate(T, [q], [0.0], integrator=integrator, atol=atol, **QUIET)
