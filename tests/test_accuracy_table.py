"""The accuracy table: true errors, the Pareto front, refused rows, and the ways out of it."""

import csv
import importlib.util
import json

import matplotlib
import multiprecision
import numpy as np
import pytest
from matplotlib.text import Text
from test_certify import hard

import pycraft as pc
from pycraft.accuracy.plotting import place_labels
from pycraft.accuracy.rungs import LADDER, OTHER_METHODS
from pycraft.accuracy.table import AccuracyTable, accuracy, ladder, mark_pareto

matplotlib.use("Agg")


def row(way, seconds, error, refused=""):
    made = dict.fromkeys(AccuracyTable.columns)
    made |= {"way": way, "form": "fast", "refine": 0, "residual": "", "precision": "double", "method": "articulated", "seconds": seconds}
    made |= {"error": error, "median_error": error, "reference": "quad", "cost": 1.0, "bytes": 8, "states": 1, "pareto": False}
    return made | {"refused": refused}


@pytest.fixture(scope="module")
def measured():
    """Everything there is, on a chain that costs digits."""
    model, q, v, tau = hard("tip 1e9")
    return model, (q, v, tau), accuracy(model, q, v, tau, seconds=0.002)


# ---------------------------------------------------------------------- errors
def test_errors_are_true(measured):
    model, state, table = measured
    truth = multiprecision.forward_dynamics(model, *state)
    answered = [r for r in table if not r["refused"] and r["precision"] in ("single", "double")]
    assert len(answered) > 10
    for r in answered:
        options = {"form": r["form"] or "fast", "refine": r["refine"], "residual": r["residual"] or "same"}
        value = model.forward_dynamics(*state, precision=r["precision"], method=r["method"], **options)
        assert r["error"] == pytest.approx(multiprecision.relative_error(value, truth), rel=1e-3), r["way"]
    wide = {(r["form"], r["precision"]): r for r in table if r["precision"] in ("extended", "quad")}
    assert wide["fast", "quad"]["reference"] == "50 digits" and 0 < wide["fast", "quad"]["error"] < 1e-20
    assert wide["fast", "extended"]["reference"] == "quad" and wide["fast", "extended"]["error"] < 1e-8


def test_the_table_has_every_combination(measured):
    _, _, table = measured
    forms = pc._core.forms()
    narrow, wide, others = 2 * 3 * len(forms), 2 * len(forms), 2 * len(OTHER_METHODS)
    assert len(table) == narrow + wide + others
    assert [r["way"] for r in ladder(table)] == [step.way for step in LADDER]
    times = [r["seconds"] for r in table if not r["refused"]]
    assert times == sorted(times) and all(t > 0 for t in times)
    assert all(r["bytes"] > 0 and r["states"] == 1 for r in table if not r["refused"])
    base = next(r for r in table if (r["way"], r["precision"]) == ("fast", "double"))
    assert base["cost"] == pytest.approx(1, rel=0.5)


def test_random_states_where_none_is_given():
    arm = pc.robots.panda()
    options = dict(forms=["fast"], methods=["articulated"], precisions=["double"], refinements=[0, "auto"], seconds=0)
    table, again = accuracy(arm, **options), accuracy(arm, **options)
    assert [r["states"] for r in table] == [5, 5] and {r["refine"] for r in table} == {0, "auto"}
    assert {r["way"]: r["error"] for r in table} == {r["way"]: r["error"] for r in again}
    assert all(r["median_error"] <= r["error"] for r in table)
    batch = accuracy(arm, np.zeros((3, 7)), tau=np.ones(7), **options)
    assert batch[0]["states"] == 3


@pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")
def test_refused_rows_say_why():
    model, q, v, tau = hard("massless tip")
    table = accuracy(model, q, v, tau, seconds=0)
    refused = [r for r in table if r["refused"]]
    assert len(refused) == len(table) and all(r["error"] is None and r["seconds"] is None and not r["pareto"] for r in refused)
    articulated = [r for r in refused if r["method"] == "articulated"]
    assert articulated and all("hinge2" in r["refused"] for r in articulated)
    assert "refused" in repr(table) and "refused" in table._repr_html_()
    with pytest.raises(ValueError, match="every way is refused"):
        table.fastest(1)
    table.plot()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (dict(forms=["joseph"]), "form 'joseph' is not there"),
        (dict(q=np.zeros(5)), "q of 'panda' takes 7 numbers"),
        (dict(q=np.zeros((2, 7)), tau=np.zeros((3, 7))), "takes 7 numbers, or \\(3, 7\\)"),
        (dict(precisions=["half"]), "precision 'half' is not there"),
    ],
)
def test_wrong_arguments(options, words):
    with pytest.raises(pc.Error, match=words):
        accuracy(pc.robots.panda(), **options)


# ---------------------------------------------------------------------- Pareto front and choice
def test_pareto_front():
    rows = [
        row("slow and good", 9.0, 1e-15), row("quick", 1.0, 1e-8), row("as slow, worse", 9.0, 1e-14), row("dominated", 2.0, 1e-7),
        row("middle", 3.0, 1e-12), row("tie", 3.0, 1e-12), row("no gain", 5.0, 1e-12), row("refused", None, None, "singular"),
    ]  # fmt: skip
    mark_pareto(rows)
    assert {r["way"] for r in rows if r["pareto"]} == {"quick", "middle", "slow and good"}
    at = {r["way"]: (r["seconds"], r["error"]) for r in rows if not r["refused"]}
    for r in rows:
        if not r["refused"]:
            s, e = at[r["way"]]
            beaten = any(x <= s and y <= e and (x, y) != (s, e) for x, y in at.values())
            assert not (r["pareto"] and beaten) and (r["pareto"] or beaten or r["way"] == "tie")


def test_the_front_of_a_measured_table(measured):
    _, _, table = measured
    front = table.front
    errors = [r["error"] for r in front]
    assert errors == sorted(errors, reverse=True) and len(set(errors)) == len(errors) >= 3
    for r in table:
        assert r["refused"] or any(f["seconds"] <= r["seconds"] and f["error"] <= r["error"] for f in front)


def test_fastest(measured):
    rows = [row("quick", 1.0, 1e-8), row("middle", 3.0, 1e-12), row("odd", 2.0, 1e-12), row("no", None, None, "singular")]
    table = AccuracyTable("t", rows)
    assert [table.fastest(e)["way"] for e in (1e-3, 1e-8, 1e-9, 1e-12)] == ["quick", "quick", "odd", "odd"]
    with pytest.raises(ValueError, match="the best is middle|the best is odd"):
        table.fastest(1e-13)
    _, _, found = measured
    assert found.fastest(1e-14)["error"] <= 1e-14
    assert found.fastest(1.0)["seconds"] == min(r["seconds"] for r in found if not r["refused"])


# ---------------------------------------------------------------------- ways out
def test_csv_and_json_round_trip(measured, tmp_path):
    _, _, table = measured
    table.to_csv(tmp_path / "a.csv")
    with open(tmp_path / "a.csv", newline="", encoding="utf-8") as file:
        read = list(csv.DictReader(file))
    assert len(read) == len(table)
    for given, found in zip(table, read, strict=True):
        assert list(found) == list(AccuracyTable.columns)
        assert {k: "" if x is None else str(x) for k, x in given.items()} == found
        assert given["error"] is None or float(found["error"]) == given["error"]
    text = table.to_json(tmp_path / "a.json")
    data = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert data == json.loads(text) and data["rows"] == table.rows and data["model"] == "chain of 8 links" and data["nv"] == 8


def test_pandas(measured):
    _, _, table = measured
    if importlib.util.find_spec("pandas") is None:
        with pytest.raises(ImportError, match="pip install pandas"):
            table.to_pandas()
    else:
        frame = table.to_pandas()
        assert list(frame.columns) == list(AccuracyTable.columns) and len(frame) == len(table)


def test_display(measured):
    _, _, table = measured
    text, html = repr(table), table._repr_html_()
    for word in (
        "Forward dynamics of chain of 8 links, 8 degrees of freedom, one state",
        "fast + 1 refinement",
        "Pareto front",
        "cholesky",
        "quad",
    ):
        assert word in text and word in html
    assert html.count("<tr") == len(table) + 1 and table.table().row_count == len(table)


def test_the_plot_names_its_front_and_labels_keep_clear(measured):
    import matplotlib.pyplot as plt

    _, _, table = measured
    ax = table.plot()
    ax.figure.canvas.draw()
    assert ax.get_xscale() == ax.get_yscale() == "log" and ax.get_xlabel() and ax.get_ylabel() and ax.get_title()
    renderer = ax.figure.canvas.get_renderer()
    boxes = [Text.get_window_extent(t, renderer) for t in ax.texts]
    label = {r["way"] + ("" if r["precision"] == "double" else f", {r['precision']}"): r["error"] for r in table.front}
    errors = {t.get_text(): label[t.get_text()] for t in ax.texts}
    assert 3 <= len(boxes) == len(errors) <= len(table.front)
    assert all(a >= 3 * b for a, b in zip(errors.values(), list(errors.values())[1:], strict=False))
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    plt.close(ax.figure)

    ax = plt.subplots()[1]
    ax.set(xlim=(0, 1), ylim=(0, 1))
    place_labels(ax, [(0.5 + 0.001 * i, 0.5, f"label {i}") for i in range(8)])
    boxes = [Text.get_window_extent(t, ax.figure.canvas.get_renderer()) for t in ax.texts]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    plt.close(ax.figure)
