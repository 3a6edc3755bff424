"""Cost of a scene: the parts of a step, enabled and disabled effects, and refusals."""

import re

import matplotlib as mpl
import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from pycraft.scenes.cost import CostTable

mpl.use("Agg")
E = pc.effects
SECONDS = 0.004
"""Seconds for each figure: assertions about times are far above the noise that this leaves."""


@pytest.fixture(autouse=True)
def terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")


@pytest.fixture(scope="module")
def arm():
    return pc.robots.panda()


@pytest.fixture(scope="module")
def scene(arm):
    made = pc.Scene(arm).add(
        E.Gravity(), E.Damping(0.5), E.Wrench("panda_link7", (0, 0, 0, 0, 0, 1)), E.NodeSpring(None, "panda_link7", 2.0)
    )
    return made.add(E.CoulombFriction(0.2, 0.05)).disable("coulomb_friction", "node_spring")


@pytest.fixture(scope="module")
def table(scene):
    return scene.cost(seconds=SECONDS)


def test_the_parts_are_those_of_the_plan_and_sum_up(scene, table):
    """Passes by themselves, what is between them and the integrator make a step; rows of passes say what `explain` says."""
    passes = table.of("pass")
    assert [(row["what"], row["because"]) for row in passes] == [(name, ", ".join(why)) for name, _, why in scene._calls().plan("motion")]
    assert [row["what"] for row in passes] == ["poses", "damping", "wrench", "accelerations"]
    step = table.of("step")[0]
    parts = sum(row["seconds"] for row in table.of("pass", "between", "integrator"))
    assert step["share"] == 1.0 and parts >= 0.999 * step["seconds"]  # more where passes alone were slower than together
    assert parts < 1.5 * step["seconds"]
    assert all(row["share"] == row["seconds"] / step["seconds"] for row in table if row["seconds"] is not None)


def test_passes_that_compute_more_take_longer(table):
    times = {row["what"]: row["seconds"] for row in table.of("pass")}
    assert times["accelerations"] > 5 * times["damping"] and times["poses"] > 5 * times["damping"] > 0


def test_effects_on_and_off(scene, table, arm):
    """An effect costs its passes and those that are there for it alone: 7 poses, which a spring beside the wrench then finds placed."""
    assert [(row["what"], row["kind"]) for row in table.of("on", "off")] == [
        ("gravity", "on"), ("damping", "on"), ("wrench", "on"), ("node_spring", "off"), ("coulomb_friction", "off"),
    ]  # fmt: skip
    passes = {row["what"]: row["seconds"] for row in table.of("pass")}
    assert table["wrench"]["seconds"] > 0.6 * (passes["poses"] + passes["wrench"])
    assert table["node_spring"]["seconds"] < 0.6 * passes["poses"]  # shares them
    assert table["coulomb_friction"]["seconds"] > 0
    alone = pc.Scene(arm).add(E.NodeSpring(None, "panda_link7", 2.0)).disable("node_spring").cost(seconds=SECONDS)
    assert alone["node_spring"]["seconds"] > 0.6 * passes["poses"]
    assert [name for name in scene.effects if scene.is_on(name)] == ["gravity", "damping", "wrench"]  # as it was


def test_an_account_of_works_costs(table, arm):
    (works,) = table.of("works")
    assert works["seconds"] > 0
    assert pc.Scene(arm).add(E.Gravity()).cost(seconds=0).of("works") == []


def test_passes_are_not_counted_by_measuring(arm):
    scene = pc.Scene(arm).add(E.Gravity(), E.Damping(0.1))
    calls, state = scene._calls(), arm.random_state(1)
    before = scene.simulate(0.1, state.q, state.v).statistics
    _core.time_passes(calls, state.q[None], state.v[None], 0.001)
    after = scene.simulate(0.1, state.q, state.v).statistics
    assert after["passes"] == before["passes"] and after["evaluations"] == before["evaluations"]


@pytest.mark.parametrize("precision", ["double", "extended", "quad"])
def test_every_precision(arm, precision):
    scene = pc.Scene(arm, precision=precision).add(E.Gravity(), E.Prescribed("panda_joint2", 0.3), E.Damping(1.0))
    table = scene.cost(seconds=0, integrator="rk4", step=0.01)
    assert all(row["seconds"] >= 0 for row in table.of("pass")) and f", {precision}, over 5 states" in table.title
    assert table.of("integrator")[0]["because"] == "4 evaluations per step"


def test_wider_numbers_cost_more(arm):
    times = [pc.Scene(arm, precision=p).cost(seconds=SECONDS).of("step")[0]["seconds"] for p in ("double", "extended", "quad")]
    assert 2 * times[0] < times[1] < times[2] / 2


def test_an_effect_that_cannot_be_on_is_a_row_with_its_reason(arm):
    scene = pc.Scene(arm).add(E.Prescribed("panda_joint1", 0.0)).add(E.Gravity())
    scene.disable("prescribed").add(E.Prescribed(["panda_joint1", "panda_joint2"], [0.0, 0.0]))
    table = scene.cost(seconds=0)
    row = table["prescribed"]
    assert row["seconds"] is None and "both prescribe coordinate 'panda_joint1'" in row["refused"]
    assert "refused: effects" in repr(table)


def test_states_are_those_given(arm):
    state = arm.random_state(3)
    scene = pc.Scene(arm).add(E.Gravity())
    for q, v, count in ((state, None, 1), (state.q, None, 1), (np.stack([state.q, state.q]), state.v, 2)):
        assert scene.cost(q, v, seconds=0).about["states"] == count


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"v": np.zeros(7)}, "v is given without q; give both, or neither for random states"),
        ({"q": np.zeros((0, 7))}, "no state given: q for 'panda' has no rows"),
        ({"q": np.zeros(6)}, "q"),
        ({"seconds": -1}, "seconds=-1: give a finite number of seconds, zero or more"),
        ({"integrator": "rk5"}, "no integrator is called 'rk5'"),
    ],
)
def test_refusals(arm, given, text):
    with pytest.raises(pc.Error, match=re.escape(text)):
        pc.Scene(arm).add(E.Gravity()).cost(**{"seconds": 0} | given)


def test_a_model_without_coordinates():
    stone = pc.Multibody("stone")
    with pytest.raises(pc.ModelError, match="'stone' has no coordinates: nothing to measure"):
        pc.Scene(stone).cost()
    with pytest.raises(KeyError, match="no effect 'damp' in .* there are none"):
        pc.Scene(pc.chain(2)).cost(seconds=0)["damp"]


# Display --------------------------------------------------------------------------------------------------------------

ROWS = [
    ("poses", "pass", 3e-7, "wrench", ""),
    ("accelerations", "pass", 5e-7, "gravity", ""),
    ("calls, forces cleared", "between", 2e-8, "", ""),
    ("dopri5", "integrator", 1.8e-7, "7 evaluations per step", ""),
    ("a step, for each evaluation", "step", 1e-6, "", ""),
    ("gravity", "on", -1e-9, "", ""),
    ("wrench", "on", 3.2e-7, "", ""),
    ("grip", "off", None, "", "it cannot be"),
]  # fmt: skip


def written(rows=ROWS):
    made = [
        {"what": what, "kind": kind, "seconds": s, "share": None if s is None else s / 1e-6, "because": why, "refused": no}
        for what, kind, s, why, no in rows
    ]
    return CostTable("Cost of a scene", made, {"noise": 4e-9})


def test_as_text_html_and_files(tmp_path, monkeypatch):
    table = written()
    lines = repr(table).splitlines()
    assert lines[2].split() == ["poses", "pass", "300", "ns", "30", "%", "wrench"]
    assert lines[7].split() == ["gravity", "effect", "<", "4", "ns"]  # nothing that noise does not explain
    assert lines[9].split() == ["grip", "effect,", "off", "refused:", "it", "cannot", "be"]
    assert "<b>Cost of a scene</b>" in table._repr_html_() and "500 ns" in table._repr_html_()
    table.to_csv(tmp_path / "cost.csv")
    assert (tmp_path / "cost.csv").read_text().splitlines()[1] == "poses,pass,3e-07,0.3,wrench,"
    monkeypatch.setenv("COLUMNS", "70")
    narrow = repr(table)
    assert (
        max(map(len, narrow.splitlines())) <= 70 and "500 ns" in narrow and "7 evaluations per step" in narrow and "refused: it" in narrow
    )


def test_picture():
    """A bar for each part and each effect that was measured, hollow where it is off."""
    upper, lower = written([*ROWS, ("drag", "off", 1e-7, "", "")]).plot()
    assert [bar.get_width() for bar in upper.patches] == [3e-7, 5e-7, 2e-8, 1.8e-7]
    assert [label.get_text() for label in upper.get_yticklabels()][:2] == ["poses  (wrench)", "accelerations  (gravity)"]
    assert "1 µs of a step per evaluation" in upper.get_title(loc="left")
    assert [bar.get_width() for bar in lower.patches] == [0.0, 3.2e-7, 1e-7]
    assert [bar.get_facecolor() == (1, 1, 1, 1) for bar in lower.patches] == [False, False, True]
    assert [text.get_text() for text in lower.texts] == ["< 4 ns", "320 ns, 32 %", "100 ns, 10 %"]
    _, none = written(ROWS[:5]).plot()
    assert none.texts[0].get_text() == "the scene has no effects"
