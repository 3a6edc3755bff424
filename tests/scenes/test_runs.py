"""Contents of a run: energies, momenta, frames, forces, statistics, progress, and the rest of a run that ended early."""

import os
import pickle
import signal
import threading
import time

import numpy as np
import pytest

import pycraft as pc
from support.runs import CASES, spinning

E = pc.effects


@pytest.fixture(scope="module")
def run():
    return CASES["damped"]().simulate(1.0)


def test_shapes_and_names(run):
    K, model = len(run.t), run.model
    assert run.q.shape == (K, model.nq) and run.v.shape == run.vdot.shape == (K, model.nv) and run.states.shape == (K, 0)
    assert list(run.forces) == run.effects == ["gravity", "spring", "damping", "torque_source"]
    assert all(force.shape == (K, model.nv) for force in run.forces.values())
    assert run.workers == ["damping", "torque_source"] and run.energy["work"].shape == (K, 2)
    assert set(run.statistics) == {
        "evaluations",
        "steps",
        "rejected",
        "seconds",
        "linearizations",
        "solutions",
        "in_packs",
        "passes",
        "switches",
    }
    assert run.statistics["steps"] == K - 1 and run.statistics["passes"]["accelerations"] == run.statistics["evaluations"]
    assert repr(run) == f"<run of 'spinning': {K} states from 0 to 1 s, {K - 1} steps>" and len(run) == K


def test_accelerations_and_forces_are_those_of_the_scene(run):
    scene = CASES["damped"]()
    for i in (0, len(run) // 2, -1):
        one = scene.evaluate(run.q[i], run.v[i], run.t[i])
        assert np.array_equal(run.vdot[i], one.vdot)
        assert all(np.array_equal(run.forces[name][i], one.forces[name]) for name in run.effects)


def test_energies_are_those_of_the_model(run):
    scene = CASES["damped"]()
    assert np.allclose(run.energy["kinetic"], run.model.kinetic_energy(run.q, run.v), rtol=1e-13)
    model = spinning().model
    model.gravity = (0, 0, -9.81)
    springs = 1.5 * run.q[:, -1] ** 2 + 1.5 * np.array([2 * np.arccos(min(1.0, abs(w))) for w in run.q[:, 7]]) ** 2
    potential = model.potential_energy(run.q) + springs
    assert np.ptp(run.energy["potential"] - potential) < 1e-7
    damping = -0.2 * (run.v**2).sum(axis=1)
    done = np.concatenate([[0], np.cumsum(np.diff(run.t) * (damping[:-1] + damping[1:]) / 2)])
    assert np.abs(run.energy["work"][:, 0] - done).max() < 1e-3
    assert np.ptp(run.balance) < 1e-6 and scene.model.nv == 10


def test_momenta(run):
    """About the origin it changes by the moment of gravity and what acts from outside; about the centre of mass by definition."""
    for i in (0, -1):
        total, moment, linear = 0.0, np.zeros(3), np.zeros(3)
        centre = np.zeros(3)
        for name, body in run.model.bodies.items():
            pose, twist = run.model.pose(name, run.q[i]), run.model.jacobian(name, run.q[i]) @ run.v[i]
            R, w = pose[:3, :3], twist[:3]
            velocity = R @ (twist[3:] + np.cross(w, body.com))
            place = R @ body.com + pose[:3, 3]
            spin = R @ body.inertia @ w
            total, centre = total + body.mass, centre + body.mass * place
            linear, moment = linear + body.mass * velocity, moment + spin + np.cross(place, body.mass * velocity)
        centre /= total
        assert np.allclose(run.centre_of_mass[i], centre, rtol=1e-13)
        assert np.allclose(run.momentum["origin"][i], [*moment, *linear], rtol=1e-12, atol=1e-12)
        assert np.allclose(run.momentum["com"][i], [*(moment - np.cross(centre, linear)), *linear], rtol=1e-11, atol=1e-12)


def test_frames(run):
    hand = run.frame("boom")
    assert hand.pose.shape == (len(run), 4, 4) and hand.twist.shape == (len(run), 6) and hand.position.shape == (len(run), 3)
    i = len(run) // 2
    assert np.array_equal(hand.pose[i], run.model.pose("boom", run.q[i]))
    h = 1e-5
    ends = [run.model.pose("boom", run.model.integrate(run.q[i], k * h * run.v[i])) for k in (-1, 1)]
    assert np.abs(run.frame("boom", axes="aligned").twist[i, 3:] - (ends[1] - ends[0])[:3, 3] / (2 * h)).max() < 1e-8
    with pytest.raises(pc.ModelError, match="hand"):
        run.frame("hand")


def test_a_run_without_works():
    plain = CASES["damped"]().simulate(0.2, energy=False)
    for what in ("energy", "balance"):
        with pytest.raises(pc.EvaluationError, match="did not record works; simulate with energy=True"):
            getattr(plain, what)


def test_a_scene_that_changes_does_not_change_its_runs():
    scene = CASES["damped"]()
    run = scene.simulate(0.2)
    scene.disable("gravity")
    scene.effects["damping"].coefficient = 5.0
    assert "gravity" in run.forces and np.allclose(run.forces["damping"], -0.2 * run.v, rtol=1e-13)


# Runs that end early --------------------------------------------------------------------------------------------------


def test_a_failed_step_says_where_and_hands_over_what_was_computed():
    """Negative damping: the velocity grows tenfold every 2.3 ms until its square is no number."""
    model = pc.mechanisms.pendulum().model
    with pytest.warns(pc.ModelWarning, match="negative"):
        scene = pc.Scene(model).add(E.Damping(-1000.0))
    for options in ({"rtol": 1e-6}, {"integrator": "rk4", "step": 1e-4}, {"integrator": "rosenbrock4", "rtol": 1e-6}):
        name = options.get("integrator", "(auto|dopri5)")
        with pytest.raises(pc.EvaluationError, match=rf"integrator '{name}': .* t = 0\.\d+ s.*(coordinate|velocity of) 'bob'") as caught:
            scene.simulate(2.0, [0.0], [1.0], **options)
        run = caught.value.run
        assert run is scene.last_run and 0.2 < run.t[-1] < 0.8 and np.isfinite(run.v).all()
        early = run.t < 0.01
        assert np.allclose(run.v[early, 0], np.exp(1000 * run.t[early]), rtol=1e-3)


def test_a_singular_hinge_hands_over_too():
    model = pc.Multibody("tip")
    model.add_body("a", mass=1.0, com=(1, 0, 0))
    model.add_body("b", "a", mass=0.0, position=(1, 0, 0))
    model.take_warnings()
    with pytest.raises(pc.SingularHingeError, match="hinge 'b' of body 'b' .*integrating, at t = 0 s") as caught:
        pc.Scene(model).simulate(1.0)
    assert caught.value.run.t.tolist() == [0.0]


@pytest.mark.skipif(not hasattr(signal, "SIGINT") or threading.current_thread() is not threading.main_thread(), reason="needs signals")
@pytest.mark.parametrize("integrator", ["rkmk4", "variational2", "dopri5", "scipy:RK45"])
def test_ctrl_c_keeps_what_was_computed(integrator):
    scene = pc.mechanisms.double_pendulum()
    timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt) as caught:
        scene.simulate(1e7, integrator=integrator, step=1e-3, t_eval=np.arange(1, 10**4) * 0.01, dense=False)
    timer.join()
    assert time.monotonic() - began < 20
    run = caught.value.run
    assert run is scene.last_run and run.t[-1] > 0.01 and np.isfinite(run.q).all()
    longer = scene.resume(run, run.checkpoint().t + 0.1)
    assert longer.t[-1] == run.checkpoint().t + 0.1


def test_progress_is_shown_in_a_terminal(monkeypatch, capsys):
    """A bar with the time, the rate and the time left, after a second; nothing where there is no terminal."""
    from pycraft import progress_bar

    scene = pc.mechanisms.double_pendulum()
    monkeypatch.setattr(progress_bar, "SECONDS", 0.0)
    scene.simulate(1.0, integrator="rk4", step=1e-5)
    assert capsys.readouterr().err == ""
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr("rich.console.Console.is_terminal", True)
    scene.simulate(3.0, integrator="rk4", step=1e-5)
    shown = capsys.readouterr().err
    assert "of 3 s" in shown and "s/s" in shown
    scene.simulate(1.0, integrator="rk4", step=1e-5, progress=False)
    assert capsys.readouterr().err == ""


# What makes no sense --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options, text",
    [
        (dict(integrator="euler"), "no integrator is called 'euler'; there are 'dopri5', .*'variational4', 'scipy:RK45'.*'sundials:Adams'"),
        (dict(integrator=7), "no integrator is called 7"),
        (dict(integrator="rk4"), r"integrator 'rk4' takes steps of one size: give step= in seconds"),
        (dict(integrator="variational2"), r"integrator 'variational2' takes steps of one size"),
        (dict(step=-1.0), "step=-1.0: a step is a positive number of seconds"),
        (dict(step=np.inf), "step=inf: a step is a positive number"),
        (dict(max_step=0.0), "max_step=0.0: a step is a positive number of seconds"),
        (dict(T=0.0), "T=0: a run lasts a positive number of seconds"),
        (dict(T=np.inf), "T=inf: a run lasts"),
        (dict(t_eval=[0.5, 0.2]), r"t_eval: entry 1 is 0.2 s after 0.5 s; times must rise"),
        (dict(t_eval=[0.5, 2.0]), "t_eval goes from 0.5 to 2 s; the run lasts from 0 to T = 1 s"),
        (dict(rtol=1e-20, atol=1e-20), "rtol=1e-20 and atol=1e-20 are below what the precision holds"),
        (dict(atol=0.0), "atol is positive"),
        (dict(rtol=np.nan, integrator="DOP853"), "rtol=nan: a tolerance is a positive number"),
        (dict(normalise="always"), "normalise='always': there are 'never' and 'each step'"),
        (dict(normalise="each step", integrator="DOP853"), "integrator 'scipy:DOP853' does not support normalise='each step'"),
        (dict(output="run.txt"), r"output 'run.txt': a run is written to a file that ends in .nc, .parquet, .csv"),
    ],
)
def test_arguments_that_make_no_sense(options, text):
    with pytest.raises(ValueError, match=text):
        pc.mechanisms.pendulum().simulate(**{"T": 1.0, **options})


# ---------------------------------------------------------------------- models that were edited since

WHAT_FOLLOWS = {
    "vdot": lambda run: run.vdot,
    "forces": lambda run: run.forces,
    "energy": lambda run: run.energy,
    "balance": lambda run: run.balance,
    "momentum": lambda run: run.momentum,
    "centre of mass": lambda run: run.centre_of_mass,
    "frame": lambda run: run.frame("lower"),
    "at": lambda run: run.at(0.1),
    "plot": lambda run: run.plot("energy"),
    "table": lambda run: run.to_dataframe(),
}
EDITS = {
    "mass": lambda model: setattr(next(iter(model.bodies.values())), "mass", 3.0),
    "body": lambda model: model.add_body("more", next(iter(model.bodies)), "pin", mass=1.0),
}


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize("what", WHAT_FOLLOWS)
def test_of_a_model_that_was_edited_since_nothing_new_follows(what, edit):
    scene = pc.mechanisms.double_pendulum()
    run = scene.simulate(0.2)
    q = run.q.copy()
    EDITS[edit](scene.model)
    with pytest.raises(pc.StaleOperatorError, match="'double pendulum' was edited since this motion was computed"):
        WHAT_FOLLOWS[what](run)
    assert np.array_equal(run.q, q) and len(run.t) == len(run.v) and "double pendulum" in repr(run)


def test_what_was_computed_before_an_edit_stays_also_in_pickles():
    scene = pc.mechanisms.double_pendulum()
    run = scene.simulate(0.2)
    energy, late = run.energy["kinetic"].copy(), scene.simulate(0.2)
    scene.model.bodies["lower"].mass = 5.0
    assert np.array_equal(run.energy["kinetic"], energy)
    for copy in (pickle.loads(pickle.dumps(run)), pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(run))))):
        assert np.array_equal(copy.energy["kinetic"], energy)
        with pytest.raises(pc.StaleOperatorError, match="was edited since"):
            copy.momentum  # noqa: B018 - raises
    with pytest.raises(pc.EvaluationError, match="this motion has no scene"):
        pickle.loads(pickle.dumps(late)).energy  # noqa: B018 - raises
    fresh = pickle.loads(pickle.dumps(scene.simulate(0.2)))
    assert np.isfinite(fresh.momentum["com"]).all()


@pytest.mark.parametrize("model", [pc.Multibody("nothing"), pc.tree([-1, 0], ["weld", "weld"]), pc.chain(2)])
def test_without_mass_there_is_no_momentum(model):
    for body in model.bodies.values():
        body.mass, body.inertia = 0.0, np.zeros((3, 3))
    scene = pc.Scene(model).add(*([E.RotorInertia(1.0)] if model.nv else []))
    run = scene.simulate(0.2, None, np.ones(model.nv) if model.nv else None)
    assert set(run.momentum) == {"origin", "com"}
    assert all(p.shape == (len(run.t), 6) and not p.any() for p in run.momentum.values())
    assert run.to_xarray()["momentum"].shape == (2, len(run.t), 6)
    with pytest.raises(pc.ModelError, match="has no mass and so no centre of mass"):
        run.centre_of_mass  # noqa: B018 - raises
