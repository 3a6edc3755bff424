"""Effects left out: errors of accelerations and trajectories that closed forms say, times that are saved, which effects matter."""

import re

import matplotlib as mpl
import numpy as np
import pytest

import pycraft as pc
from pycraft.scenes.comparison import ComparisonTable

mpl.use("Agg")
E = pc.effects


@pytest.fixture(autouse=True)
def terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")


@pytest.fixture
def slider():
    """A mass of 2 kg on a vertical slider: constant forces, and every error in closed form."""
    model = pc.Multibody("slider")
    model.add_body("block", hinge="slider", axis=(0, 0, 1), mass=2.0, inertia=np.eye(3))
    return model


@pytest.fixture
def scene(slider):
    """Accelerations -10, -4 (a force of -8 N), 0.05 (0.1 N) m/s²."""
    made = pc.Scene(slider).add(E.Gravity(g=(0, 0, -10)), E.TorqueSource(0.1))
    return made.add(E.Wrench("block", (0, 0, 0, 0, 0, -8)), name="push")


@pytest.fixture(scope="module")
def stop():
    """A block that a spring keeps from falling for ever, and an effect with states of its own."""
    model = pc.Multibody("stop")
    model.add_body("block", hinge="slider", axis=(0, 0, 1), mass=2.0, inertia=np.eye(3))
    return model


def test_errors_in_closed_form(scene):
    """δv̇ = F/m against 13.95 m/s²; δq = ½ (F/m) T²."""
    table = scene.compare(T=0.5, seconds=0)
    assert [row["left out"] for row in table] == [[], ["gravity"], ["torque_source"], ["push"], ["torque_source", "push"]]
    found = {tuple(row["left out"]): (row["acceleration"], row["trajectory"]) for row in table}
    for names, rate in ((("gravity",), 10), (("torque_source",), 0.05), (("push",), 4), (("torque_source", "push"), 3.95)):
        assert found[names] == pytest.approx((rate / 13.95, 0.5 * rate * 0.25), rel=1e-9)  # runs at rtol 1e-9 on a parabola
    assert found[()] == (0.0, 0.0) and table.own_error < 1e-12
    assert [row["together"] for row in table] == [False, False, False, False, True]


def test_sets_that_are_named(scene):
    table = scene.compare(["push", ("push", scene.effects["gravity"])], T=0.5, seconds=0)
    assert [table.label(row) for row in table] == ["nothing", "push", "push + gravity"]
    assert [table.label(row) for row in scene.compare("push", T=0.5, seconds=0)] == ["nothing", "push"]
    assert list(scene.effects) == ["gravity", "torque_source", "push"] and all(map(scene.is_on, scene.effects))


def test_a_push_that_reads_poses_costs_time_and_leaving_it_out_saves_it():
    model = pc.chain(20, seed=1)
    scene = pc.Scene(model).add(E.Damping(1e-9), E.Wrench(list(model.bodies)[-1], (0, 0, 0, 0, 0, 1e-3)))
    state = model.random_state(1)
    table = scene.compare(q=state.q, v=state.v, T=0.01, seconds=0.02)
    saved = {tuple(row["left out"]): (row["saved"], row["saved of run"]) for row in table}
    assert saved["wrench",][0] > 0.1 > abs(saved["damping",][0]) and saved["wrench",][1] > 0.1  # 20 poses of some 3 µs
    assert saved[()] == (0.0, 0.0)


def test_states_of_effects_go_with_them(stop):
    """Accelerations without one effect are asked for with the states of the others."""

    class Charge:
        states = (1.0,)

        def __call__(self, t, state):
            return [-4.0 * state.states[0]]

        def rates(self, t, state):
            return [-1.0 * state.states[0]]

    class Twice(Charge):
        states = (5.0, 3.0)

        def __call__(self, t, state):
            return [state.states[1]]

        def rates(self, t, state):
            return [0.0, -state.states[1]]

    scene = pc.Scene(stop).add(E.Gravity(g=(0, 0, -1)), Charge(), Twice())
    table = scene.compare(["charge", "twice", "gravity"], T=1.0, seconds=0)
    errors = {tuple(row["left out"]): row["acceleration"] for row in table}
    t = np.linspace(0, 1, 9)
    whole = np.abs(-1 + (-4 * np.exp(-t) + 3 * np.exp(-t)) / 2).max()
    assert errors["charge",] == pytest.approx(2 / whole, rel=1e-8) and errors["twice",] == pytest.approx(1.5 / whole, rel=1e-8)
    assert errors["gravity",] == pytest.approx(1 / whole, rel=1e-8)


def test_a_scene_that_does_not_run_without_an_effect_is_a_refused_row(stop):
    def fall(t, state):
        return [np.nan if state.q[0] < -1 else -8.0]

    scene = pc.Scene(stop).add(fall, E.Prescribed("block", 0.0))
    table = scene.compare(T=2.0, seconds=0)
    row = table[2]
    assert row["left out"] == ["prescribed"] and row["pareto"] is False and row["run"] is None
    assert re.match(r"effect 'fall': its force on coordinate 'block' is nan at t = 0\.[78]", row["refused"])  # ½ 4 t² = 1
    assert "refused: effect 'fall'" in repr(table) and len(table.plot()[0].lines) > 0
    needed = scene.needed(1e-3, T=2.0)
    assert needed.names == ["prescribed"] and "nan at t" in needed[0]["refused"]


def test_the_front_and_what_noise_hides():
    """Errors below the run's own are alike: of them the fastest is on the front."""
    from pycraft.scenes.measuring import mark_front

    rows = [
        {"refused": "", "run": run, "trajectory": error} for run, error in ((5.0, 0.0), (4.0, 1e-9), (4.5, 1e-3), (3.0, 1e-2), (3.5, 1e-4))
    ]
    rows.append({"refused": "no", "run": None, "trajectory": None})
    mark_front(rows, "run", "trajectory", 1e-8)
    assert [row["pareto"] for row in rows] == [False, True, False, True, True, False]


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda s: s.compare("gravty"), "the scene of 'slider' has no effect 'gravty'; did you mean 'gravity'?"),
        (lambda s: s.disable("push").compare(["push"]), "effect 'push' is off already; enable it to see what leaving it out does"),
        (lambda s: s.compare([]), "without is empty: name effects, or leave it out to compare every effect that is on"),
        (lambda s: s.compare([()]), "without contains an empty set of effects; the whole scene always has its own row"),
        (lambda s: s.compare(T=-1.0), "T=-1: a run lasts a positive number of seconds"),
        (lambda s: s.needed(0.0), "tolerance: 0.0 is not a positive, finite tolerance"),
        (lambda s: s.needed("small"), "tolerance: 'small' is not a positive, finite tolerance"),
        (lambda s: s.accuracy(T=0), "T=0: a run lasts a positive number of seconds"),
    ],
)
def test_refusals(scene, call, text):
    with pytest.raises(pc.Error, match=re.escape(text)):
        call(scene)


# Which effects matter -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tolerance", "names"),
    [(1e-3, ["gravity", "push", "torque_source"]), (0.01, ["gravity", "push"]), (0.3, ["gravity"]), (2.0, [])],
)
def test_at_states(scene, tolerance, names):
    """10, 4 and 0.05 of 13.95 m/s²."""
    table = scene.needed(tolerance)
    assert table.names == names and sorted(table.names + table.others) == sorted(scene.effects)
    assert [row["error"] for row in table] == pytest.approx([10 / 13.95, 4 / 13.95, 0.05 / 13.95])


def test_along_a_run(scene):
    """½ (F/m) T²: 1.25, 0.5 and 0.00625 m; source and push together 0.49375."""
    assert scene.needed(0.5 + 1e-6, T=0.5).names == ["gravity"]
    table = scene.needed(0.495, T=0.5)
    assert table.names == ["gravity", "push"] and table.others == ["torque_source"]
    assert [row["together"] for row in table] == [None, None, pytest.approx(0.00625, rel=1e-9)]


def test_what_is_dropped_is_dropped_together(slider):
    """Two forces of 0.3 m/s² each may be left out alone at 0.2 of 2 m/s², not both."""
    scene = pc.Scene(slider).add(E.Gravity(g=(0, 0, -2)), E.TorqueSource(0.6), E.Wrench("block", (0, 0, 0, 0, 0, 0.62)))
    table = scene.needed(0.25)
    assert table.others == ["torque_source"] and table.names == ["gravity", "wrench"]
    assert table[1]["error"] == pytest.approx(0.31 / 1.39) and table[1]["together"] == pytest.approx(0.61 / 1.39)
    assert repr(table).splitlines()[3].split()[-1] == "needed"


def test_an_effect_that_is_off_is_no_question(scene):
    assert scene.disable("push").needed(1e-9).names == ["gravity", "torque_source"]


# Display --------------------------------------------------------------------------------------------------------------


def written():
    rows = []
    for names, acceleration, trajectory, evaluation, run, pareto in (
        ([], 0.0, 0.0, 1e-6, 1e-3, True),
        (["wrench"], 1e-2, 1e-3, 0.6e-6, 0.5e-3, True),
        (["drag"], 1e-5, 1e-12, 0.99e-6, 1.1e-3, False),
        (["drag", "wrench"], 1e-2, 2e-3, 0.55e-6, 0.4e-3, True),
    ):
        rows.append(
            dict.fromkeys(ComparisonTable.columns)
            | {"left out": names, "together": len(names) > 1, "acceleration": acceleration, "trajectory": trajectory, "refused": ""}
            | {"evaluation": evaluation, "saved": 1 - evaluation / 1e-6, "run": run, "saved of run": 1 - run / 1e-3, "pareto": pareto}
            | {"resolved": trajectory > 1e-9, "evaluations": 100}
        )
    return ComparisonTable("Effects left out", rows, {"own_error": 1e-9, "noise": 0.02})


def test_as_text(monkeypatch):
    lines = repr(written()).splitlines()
    assert lines[2].split() == ["nothing", "0", "<", "1.0e-09", "1", "µs", "1", "ms", "Pareto", "front"]
    assert lines[3].split() == ["wrench", "1.0e-02", "1.0e-03", "600", "ns", "40", "%", "500", "µs", "50", "%", "Pareto", "front"]
    assert lines[4].split() == ["drag", "1.0e-05", "<", "1.0e-09", "990", "ns", "none", "1.1", "ms", "-10", "%"]
    assert lines[5].startswith("the 2 least: drag, wrench")
    assert [row["run"] for row in written().front] == [0.4e-3, 0.5e-3, 1e-3]
    table = written()
    table.rows[1]["refused"] = "it does not run"
    monkeypatch.setenv("COLUMNS", "70")
    assert "refused" in repr(table) and "* Pareto front" in repr(table)


def test_picture():
    """Points at their times and errors, those below the run's own error at it; labels say what is left out, and the front is ringed."""
    left, right = written().plot()
    assert sorted(text.get_text() for text in left.texts) == ["drag", "everything on", "the 2 least", "wrench"]
    points = {(line.get_xdata()[0], line.get_ydata()[0]) for line in left.lines if len(line.get_xdata()) == 1}
    assert points == {(1e-3, 1e-9), (0.5e-3, 1e-3), (1.1e-3, 1e-9), (0.4e-3, 2e-3)}
    assert {len(line.get_xdata()) for line in left.lines} == {1, 3}  # the front
    assert right.get_ylabel() == "error of the accelerations, relative" and left.get_yscale() == "log"
    empty = ComparisonTable("Nothing", [], {"own_error": 0.0, "noise": 0.0}).plot()
    assert "there are no rows" in empty[0].texts[0].get_text()


def test_own_error_of_steps_of_one_size():
    """At least the error of the run, and not much more: what leaving out a smaller thing makes is not resolved."""
    scene = pc.Scene(pc.chain(3)).add(E.Gravity((0, -9.81, 0)), E.Damping(1e-7))
    for integrator, step in (("rk4", 0.02), ("rkmk4", 0.02), ("semi-implicit-euler", 0.001), ("variational2", 0.005)):
        table = scene.compare(T=0.3, integrator=integrator, step=step, seconds=0)
        run = scene.simulate(0.3, integrator=integrator, step=step, t_eval=[0.0, 0.3])
        true = np.sqrt(np.mean((run.q[-1] - scene.simulate(0.3, rtol=1e-12, t_eval=[0.0, 0.3]).q[-1]) ** 2))
        assert true <= table.own_error < 50 * true
        row = next(row for row in table if row["left out"] == ["damping"])
        assert not row["resolved"] and table.cell("trajectory", row).startswith("<")


def test_own_error_where_tolerances_may_not_be_looser():
    scene = pc.Scene(pc.chain(2)).add(E.Gravity((0, -9.81, 0)))
    assert 0 < scene.compare(T=0.3, rtol=1e-3, atol=1e-3, seconds=0).own_error < np.inf
