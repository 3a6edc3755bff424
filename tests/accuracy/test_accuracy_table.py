"""The accuracy table: true errors, the Pareto front, refused rows, and the ways out of it."""

import csv
import importlib.util
import json

import matplotlib
import mpmath
import numpy as np
import pytest
from matplotlib.text import Text

import pycraft as pc
from pycraft.accuracy.rungs import LADDER, OTHER_METHODS
from pycraft.accuracy.tables.plotting import _between, place_labels
from pycraft.accuracy.tables.table import AccuracyTable, accuracy, ladder, largest_component, mark_pareto
from pycraft.accuracy.tables.timing import time_forward_dynamics, workspace_bytes
from support import multiprecision
from support.hard_chains import hard

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
    narrow, wide, others = 2 * 4 * len(forms), (2 + 1) * len(forms), 2 * len(OTHER_METHODS)
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
    assert sum(len(labels) for labels in table.refusals.values()) == len(table) and "fast, quad" in sum(table.refusals.values(), [])
    ax = table.plot()
    assert not ax.axison and "every row is refused" in ax.texts[0].get_text() and "hinge2" in ax.texts[0].get_text()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (dict(forms=["joseph"]), "form 'joseph' is not there; there are 'fast', 'ud'"),
        (dict(methods="lu"), "method 'lu' is not there; there are 'articulated', 'cholesky'"),
        (dict(precisions=["half"]), "precision 'half' is not there"),
        (dict(precisions=[None]), "precision None is not there"),
        (dict(refinements=-1), "refine=-1: a number of corrections"),
        (dict(refinements=["x"]), "refine='x': a number of corrections"),
        (dict(refinements=True), "refine=True: a number of corrections"),
        (dict(refinements=(1, "narrower")), "residual 'narrower' of .* is not there; there are 'same', 'gather' and 'wider'"),
        (dict(refinements=[(1, "wider", 2)]), "neither a number of corrections nor a pair"),
        (dict(forms=[]), "forms is empty"),
        (dict(methods=[]), "methods is empty"),
        (dict(refinements=[]), "refinements is empty"),
        (dict(precisions=[]), "precisions is empty"),
        (dict(seconds=-1), "seconds=-1: give a finite number"),
        (dict(seconds=np.nan), "seconds=nan"),
        (dict(seed=-1), "seed=-1: give a whole number"),
        (dict(q=np.zeros(5)), "q of 'panda' takes 7 numbers"),
        (dict(q=np.zeros((2, 7)), tau=np.zeros((3, 7))), "batches of 2 and 3 states"),
        (dict(q=np.zeros((0, 7))), "no state given"),
        (dict(q=np.full(7, np.nan)), "entry 0 is nan"),
        (dict(tau=[0, 0, np.inf, 0, 0, 0, 0]), "tau of hinge 'panda_joint3': entry 0 is inf"),
    ],
)
def test_wrong_arguments(options, words):
    """Before anything is measured."""
    with pytest.raises(pc.Error, match=words):
        accuracy(pc.robots.panda(), progress=lambda _: pytest.fail("measured"), **options)


def test_what_is_no_model():
    with pytest.raises(TypeError, match=r"accuracy takes a model: pc.load\(path\).*got 'panda'"):
        accuracy("panda")
    welded = pc.Multibody("welded", welds="keep")
    welded.add_body("a", hinge="weld", mass=1.0)
    for model in (pc.Multibody("nothing"), welded):
        with pytest.raises(pc.ModelError, match="has no coordinates: nothing to measure"):
            accuracy(model)
    with pytest.raises(pc.ModelError, match="no state given"):
        time_forward_dynamics(pc.chain(2), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2)))


def test_one_name_stands_for_a_list():
    table = accuracy(pc.chain(2), forms="fast", precisions="double", refinements=(1, "wider"), methods="articulated", seconds=0)
    assert [r["way"] for r in table] == ["fast + 1 refinement, wider residual"]
    table = accuracy(pc.chain(2), precisions=50, refinements=1, methods=["articulated", "cholesky", "cholesky"], forms="ud", seconds=0)
    assert {r["way"] for r in table} == {"ud + 1 refinement", "cholesky"} and len(table) == 2


def test_rows_that_show_their_rounding_say_so(measured):
    """Rounded to double, a refined value in quad shows 1e-17 and looks worse than quad unrefined: the row says why."""
    _, _, table = measured
    rounded = {(r["way"], r["precision"]) for r in table if r["rounded"]}
    assert rounded == {(f"{form} + 1 refinement", "extended") for form in pc._core.forms()}
    assert all(2e-18 < r["error"] < 1.2e-16 for r in table if r["rounded"])
    shown = " ".join(repr(table).split())  # headings are further apart in a narrow terminal
    assert "rounded to double" in shown and "time / fast" in shown and "workspace" in shown
    found = table.fastest(1e-15)
    assert found["precision"] != "quad"


def test_a_refined_extended_row_spares_quad_on_a_stretched_chain():
    n = 64
    tau = np.random.default_rng(0).normal(size=n)
    table = accuracy(pc.chain(n), np.zeros(n), tau=tau, forms="fast", methods="articulated", precisions=["extended", "quad"], seconds=0)
    assert any(r["refine"] == 1 and r["precision"] == "extended" and r["error"] < 1.2e-16 for r in table)
    assert table.fastest(1e-15)["precision"] == "extended"


def test_the_largest_component_is_not_hidden_by_the_norm():
    """Twice the right value, and something where there is nothing: 1e-20 and 1e-30 of the norm."""
    exact = [mpmath.mpf(1), mpmath.mpf("1e-20"), mpmath.mpf(0)]
    assert largest_component(np.array([1.0, 2e-20, 0.0]), exact) == pytest.approx(1.0)
    assert largest_component(np.array([1.0, 1e-20, 1e-30]), exact) == np.inf
    model = pc.Multibody("two")
    model.add_body("heavy", hinge="slider", axis=(1, 0, 0), mass=1.0)
    model.add_body("light", hinge="slider", axis=(1, 0, 0), mass=1e-3)
    table = accuracy(model, [0.0, 0.0], tau=[1.0, 1e-3], forms="fast", methods="articulated", precisions="double", refinements=0, seconds=0)
    assert table[0]["component"] == largest_component(model.forward_dynamics([0, 0], [0, 0], [1.0, 1e-3]), [1.0, mpmath.mpf(1e-3) / 1e-3])


def test_memory_of_the_realization_grows_with_the_scalar():
    model = pc.chain(4)
    sizes = {p: workspace_bytes(model, precision=p, method="realization") for p in ("double", 50)}
    calls = model._calls()
    assert sizes[50] / sizes["double"] == pytest.approx(calls.memory("fast", 50) / calls.memory("fast", "double"), rel=0.01)


def test_json_has_no_infinities(tmp_path):
    table = AccuracyTable("t", [row("quick", 1.0, 1e-8) | {"component": float("inf")}])
    text = table.to_json(tmp_path / "a.json")
    assert json.loads(text, parse_constant=lambda word: pytest.fail(word))["rows"][0]["component"] is None


def test_brackets_in_names_are_shown():
    model = pc.Multibody("arm [left]")
    model.add_body("a", mass=1.0, com=(1, 0, 0))
    assert "arm [left]" in repr(accuracy(model, forms="fast", methods="articulated", precisions="double", refinements=0, seconds=0))


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


@pytest.mark.slow
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
    rings = next(line for line in ax.lines if line.get_markersize() > 8)
    assert sorted(rings.get_ydata()) == pytest.approx(sorted(r["error"] for r in table.front))
    filled = {line.get_fillstyle() for line in ax.lines if line.get_ydata()[0] in {r["error"] for r in table if r["residual"] == "wider"}}
    assert "bottom" in filled
    plt.close(ax.figure)

    ax = plt.subplots()[1]
    ax.set(xlim=(0, 1), ylim=(0, 1))
    place_labels(ax, [(0.5 + 0.001 * i, 0.5, f"label {i}") for i in range(8)])
    ax.figure.canvas.draw()
    boxes = [Text.get_window_extent(t, ax.figure.canvas.get_renderer()) for t in ax.texts]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    plt.close(ax.figure)


def test_the_line_of_a_label_passes_no_other_marker():
    import matplotlib.pyplot as plt

    ax = plt.subplots()[1]
    ax.set(xlim=(0, 1), ylim=(0, 1))
    around = [(0.5 + 0.06 * x, 0.5 + 0.06 * y) for x, y in ((1, 1), (-1, 1), (1, -1), (-1, -1))]
    place_labels(ax, [(0.5, 0.5, "a label of some length")], around, around)
    ax.figure.canvas.draw()
    renderer = ax.figure.canvas.get_renderer()
    box = Text.get_window_extent(ax.texts[0], renderer)
    at = ax.transData.transform((0.5, 0.5))
    start = np.clip(at, [box.x0, box.y0], [box.x1, box.y1])
    assert all(_between(start, at, ax.transData.transform(p)) > 5 for p in around)
    plt.close(ax.figure)
