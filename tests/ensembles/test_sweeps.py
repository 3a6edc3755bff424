"""Sweeps: the runs that they are, on threads, processes and Dask; failures; deaths; stops."""

import threading

import numpy as np
import pytest

import pycraft as pc
from support import sweeps


@pytest.fixture
def scene():
    return pc.Scene(pc.chain(2)).add(pc.effects.Gravity(g=(0, -9.81, 0)), pc.effects.Damping(0.1))


def names_of(scene):
    first, second = scene.model.coordinate_names
    return first, second, list(scene.model.bodies)[1]


def test_a_sweep_is_its_runs(scene):
    """Each row bit for bit what a scene that was set by hand does."""
    first, second, body = names_of(scene)
    samples = pc.samples.sobol(
        8, {f"q.{first}": (-1, 1), f"v.{second}": (-2, 2), f"bodies.{body}.mass": (1, 2), "effects.damping.coefficient": (0, 1),
            "effects.gravity.g[1]": (-10, -9)}, seed=1,
    )  # fmt: skip
    found = pc.sweep(scene, samples, 0.7, rtol=1e-8, progress=False)
    for i in range(samples.count):
        row = samples.row(i)
        by_hand = pc.Scene(pc.chain(2))
        by_hand.model.bodies[body].mass = row[f"bodies.{body}.mass"]
        by_hand.add(pc.effects.Gravity(g=(0, row["effects.gravity.g[1]"], 0)), pc.effects.Damping(row["effects.damping.coefficient"]))
        run = by_hand.simulate(0.7, [row[f"q.{first}"], 0], [0, row[f"v.{second}"]], rtol=1e-8, progress=False)
        assert np.array_equal(found["end.q"][i], run.q[-1]) and np.array_equal(found["end.v"][i], run.v[-1])
        assert found["steps"][i] == run.statistics["steps"] and abs(found["balance"][i] - (run.balance[-1] - run.balance[0])) < 1e-12
    assert scene.effects["damping"].coefficient == 0.1 and scene.model.bodies[body].mass == pc.chain(2).bodies[body].mass  # untouched


def test_states_at_times_and_measures(scene):
    samples = pc.samples.states(scene.model, 3)
    times = np.linspace(0, 0.5, 6)
    found = pc.sweep(scene, samples, 0.5, t_eval=times, progress=False)
    assert found["run.q"].shape == (3, 6, 2) and np.array_equal(found["run.t"][2], times)
    assert np.array_equal(found["run.q"][:, 0], samples["q"]) and np.array_equal(found["run.v"][:, 0], samples["v"])
    measured = pc.sweep(scene, samples, 0.5, t_eval=times, measure=sweeps.ends, progress=False)
    assert set(measured) == {"last", "count"} and np.array_equal(measured["last"], found["run.q"][:, -1]) and (measured["count"] == 6).all()


@pytest.mark.parametrize("on", ["threads", "processes"])
@pytest.mark.parametrize("workers", [1, 3])
def test_where_it_runs_changes_no_bit(scene, on, workers):
    samples = pc.samples.states(scene.model, 17, seed=5)
    alone = [scene.simulate(0.3, *row, t_eval=[0, 0.3], progress=False).q[-1] for row in zip(samples["q"], samples["v"], strict=True)]
    found = pc.sweep(scene, samples, 0.3, on=on, workers=workers, progress=False)
    assert np.array_equal(found["end.q"], alone)


def test_a_function(scene):
    found = pc.sweep(sweeps.square, {"x": [1.0, 2.0, 3.0]}, progress=False)
    assert found["square"].tolist() == [1, 4, 9] and found["powers"][2].tolist() == [3, 9, 27] and found["x"].tolist() == [1, 2, 3]
    assert pc.sweep(lambda x: x + 1, {"x": [1, 2]}, progress=False)["value"].tolist() == [2, 3]


def test_statements_over_many_models():
    """Statements that hold on every model and statements that do not, on processes."""
    models = [pc.chain(2), pc.robots.panda(), pc.tree([-1, 0, 0, 1], seed=3)]
    for statement, holds in (("inv(psi) == inv(phi) + K*H", True), ("psi == phi", False)):
        found = pc.sweep(sweeps.check_statement, {"model": models, "statement": [statement] * 3}, on="processes", workers=1, progress=False)
        assert found["true"].tolist() == [holds] * 3 and found["bodies"].tolist() == [len(model.bodies) for model in models]


def test_a_run_that_fails_is_told_of_and_ends_no_other(scene):
    body = names_of(scene)[2]
    found = pc.sweep(scene, {f"bodies.{body}.mass": [1.0, -1.0, 2.0], "v": [[0, 0], [0, 0], [0, np.nan]]}, 0.1, progress=False)
    assert found.finished.all() and [failure.sample for failure in found.failures] == [1, 2]
    assert found.failures[0].inputs[f"bodies.{body}.mass"] == -1.0 and "mass is not negative" in found.failures[0].reason
    assert "entry 0 is nan" in found.failures[1].reason
    assert np.isfinite(found["end.q"][0]).all() and np.isnan(found["end.q"][1:]).all()
    assert repr(found) == "<sweep of 3 samples: all finished, 2 of them failed>"


def test_values_of_another_shape_are_a_failure():
    found = pc.sweep(lambda x: {"y": [0.0] * int(x)}, {"x": [2, 2, 3]}, progress=False, workers=1)
    assert found["y"].shape == (3, 2)
    assert [(f.sample, f.reason) for f in found.failures] == [
        (2, "values of another kind than in the first run: y is of shape (3,), not of shape (2,)")
    ]


def test_ctrl_c_keeps_what_is_finished():
    def stop(x):
        if x == 5:
            raise KeyboardInterrupt
        return x

    with pytest.raises(KeyboardInterrupt) as stopped:
        pc.sweep(stop, {"x": list(range(10))}, workers=1, progress=False)
    result = stopped.value.result
    assert result.finished[0] and not result.finished[5] and result["value"][0] == 0


@pytest.mark.parametrize("kill, failed", [(sweeps.die_once, []), (sweeps.die_always, [3])])
def test_a_process_that_dies(tmp_path, kill, failed):
    """Its runs are repeated; the sample that kills its process each time is a failure, and the only one."""
    samples = {"x": list(range(12))} | ({"folder": [str(tmp_path)] * 12} if kill is sweeps.die_once else {})
    found = pc.sweep(kill, samples, on="processes", workers=2, progress=False)
    assert found.finished.all() and [failure.sample for failure in found.failures] == failed
    assert all(failure.reason == "the worker process died" for failure in found.failures)
    assert [value for i, value in enumerate(found["value"]) if i not in failed] == [i * i for i in range(12) if i not in failed]


def test_threads_have_scenes_of_their_own(scene):
    """A measure that waits for another run at the same time: neither sees the other's parameters."""
    body = names_of(scene)[2]
    together = threading.Barrier(2, timeout=30)

    def measure(run):
        together.wait()
        return {"mass": run.model.bodies[body].mass}

    masses = [1.0, 2.0, 3.0, 4.0]
    found = pc.sweep(scene, {f"bodies.{body}.mass": masses}, 0.01, measure=measure, workers=2, progress=False)
    assert found["mass"].tolist() == masses


@pytest.mark.parametrize(
    "samples, text",
    [
        ({"q.elbw": [1]}, "'q.elbw': .* has no hinge or coordinate 'elbw'"),
        ({"bodies.BODY.mas": [1]}, "has no 'mas'; did you mean 'mass'"),
        ({"bodies.none.mass": [1]}, "the scene's bodies include no 'none'"),
        ({"effects.dampin.coefficient": [1]}, "the scene's effects include no 'dampin'; did you mean 'damping'"),
        ({"effects.gravity.g[3]": [1]}, r"g of 'gravity' has the shape \(3,\)"),
        ({"mass": [1]}, "a scene has no 'mass'; write q.HINGE"),
        ({"q": [[0, 0]], "q.FIRST": [1]}, "q and q.* both set a coordinate; leave one out"),
    ],
)
def test_names_that_nothing_has_are_refused_before_the_first_run(scene, samples, text):
    first, _, body = names_of(scene)
    named = {name.replace("BODY", body).replace("FIRST", first): values for name, values in samples.items()}
    with pytest.raises(pc.ModelError, match=text):
        pc.sweep(scene, named, 1.0, progress=False)


@pytest.mark.parametrize(
    "options, error, text",
    [
        ({}, pc.EvaluationError, "needs T, the duration of each run"),
        ({"T": 1.0, "integrater": "rkmk4"}, pc.EvaluationError, "no option 'integrater'; its options are integrator"),
        ({"T": 1.0, "integrator": "rkmk5"}, pc.EvaluationError, "rkmk4"),
        ({"T": -1.0}, pc.EvaluationError, "positive number of seconds"),
        ({"T": 1.0, "on": "thread"}, pc.EvaluationError, "on='thread': choose \"threads\""),
        ({"T": 1.0, "workers": 0}, pc.EvaluationError, "workers=0"),
    ],
)
def test_options_that_make_no_sense_are_refused(scene, options, error, text):
    with pytest.raises(error, match=text):
        pc.sweep(scene, {"v": [[0, 0]]}, progress=False, **options)


def test_neither_scene_nor_function():
    with pytest.raises(pc.ModelError, match="a scene or a function, not 3"):
        pc.sweep(3, {"x": [1]})
    with pytest.raises(pc.EvaluationError, match="a function takes only its samples"):
        pc.sweep(sweeps.square, {"x": [1]}, 1.0)
