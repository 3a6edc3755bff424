"""Statements on random trees: where they are true, under which hypotheses, and the case that tells most."""

import itertools
import math
import re
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.budget import Budget
from pycraft.identities.family import CELLS, CHAIN, DEPTH, DOF, HYPOTHESES, NO_J, WITH_J, Spec, family, respelled, specs
from pycraft.identities.judge import HOLDS, UNDECIDED
from pycraft.identities.truth import FALSE, TRUE, UNREAD, CellTruth, TruthMap, explained, saving, truth_within

MODULE = sys.modules[TruthMap.__module__]  # by its name: the function is called as the module is

NOT_CERTIFIED = [
    "φ = I + E + E² + EEE",
    "φ = I + E + E**2 + E**3 + E**4 + E**5 + E**6 + E**7 + E**8",
    "gravity_field == phi.T@gravity_base",
    "gravity_field == 7*gravity_field",
    "Delta_theta_dot == 2*Delta_theta_dot",
    "a == V_tilde H* theta_dot",
    "J == 0",
    "J == 2*J",
    "H_dot == 0*H",
    "b == 2*b",
    "E**13 == 0*E",
]


@pytest.mark.parametrize("text", NOT_CERTIFIED)
def test_what_vanishes_on_small_still_models_is_refuted(text):
    """Each is false, and was true on shallow trees, without gravity, at rest, or without rotor inertia."""
    assert not pc.check(text, search=False), text


def test_the_family_has_every_kind_everywhere():
    models = family(10**6)
    assert len(models) == 4 * len(CELLS) and len(family(1)) == len(CELLS)
    for some in (models, family(1)):
        assert {spec.rotor_inertia for spec in some} == {True, False}
        assert max(len(spec.parents) for spec in some) >= DEPTH and min(len(spec.parents) for spec in some) <= 4
        depths = []
        for spec in some:
            depth = []
            for p in spec.parents:
                depth.append(depth[p] + 1 if p >= 0 else 1)
            depths.append(max(depth))
        assert max(depths) >= DEPTH and max(np.bincount([p + 1 for spec in some for p in spec.parents if p >= 0])) >= 8
    assert {kind for spec in models for kind in spec.kinds} == set(DOF)
    inner = {kind for spec in models for kind, p in zip(spec.kinds, spec.parents, strict=True) if p >= 0}
    assert inner >= set(DOF) - {"weld"}
    for cell in CELLS:
        for spec in specs(cell):
            assert cell.least <= spec.met and cell.holds(spec)
            model = spec.model()
            traits = {name for name, is_met in model.soa._source.traits.items() if is_met}
            assert spec.met - {"free root"} <= traits and np.abs(np.asarray(model.gravity)).min() > 0.5
            assert spec.met & set(traits) == {h for h in HYPOTHESES if h in traits and h in spec.met}
            for node in model.nodes.values():  # beside the body's own frame in place and direction
                assert np.abs(node.pose[:3, 3]).max() > 1e-3 and np.abs(node.pose[:3, :3] - np.eye(3)).max() > 1e-3


def test_one_coordinate_has_the_hinges_name():
    spec = Spec((-1, 0, 1), ("pin", "ball", "screw"), False)
    assert respelled("Δ(hinge0[0]) Δ(hinge1) Δ(hinge2)", spec) == "Δ(hinge0) Δ(hinge1[0]) Δ(hinge2)"


WHERE = [
    ("HG == I", [{"J = 0"}]),
    ("Ω = Υ + ψ̃*Υ + Υψ̃", [{"serial chain"}]),
    ("HΔ(hinge1) = 0", [{"single-DOF hinges"}]),
    ("H_dot == 0*H", [{"constant H"}]),
    ("ψMψ* = P + ψ̃P + Pψ̃*", [{"J = 0"}]),
    ("trace(Upsilon@M) == N", [{"J = 0"}]),
    ("ΩMΩ - Ω = Ω - Υ - ψ̃*Υ - Υψ̃", [{"J = 0", "serial chain"}]),
    ("ψ⁻¹ = φ⁻¹ + KH", [set()]),
    ("ψ⁻¹ = φ⁻¹ - KH", []),
]


@pytest.mark.parametrize(("text", "where"), [pytest.param(*case, marks=[pytest.mark.slow] * (i % 3 > 0)) for i, case in enumerate(WHERE)])
def test_the_fewest_hypotheses(text, where):
    found = pc.truth(text, smallest_case=False)
    assert [set(chosen) for chosen in found.where] == where
    assert bool(found) == (where == [set()])
    for cell in found:
        met = any(chosen <= cell.cell.least for chosen in found.where)
        assert cell.verdict == TRUE or not met
        assert (cell.example is None) == (cell.verdict == TRUE)


def test_a_truth_map_shows_itself():
    found = pc.truth("HG == I", budget=2.0)
    text = repr(found)
    assert "TRUE where J = 0" in text and max(map(len, text.splitlines())) <= 80 and "FALSE: " in text
    assert found["tree", "J = 0", "every kind", "fixed base"].verdict == TRUE
    false = found["chain", "J > 0", "single-DOF", "fixed base"]
    assert false.verdict == FALSE and false.example.bodies == 1 and false.word == "FALSE: pin, J"
    assert "<table" in found._repr_html_() and len(found.plot().patches) == len(CELLS)
    with pytest.raises(pc.Error, match="has one side"):
        pc.truth("phi")
    with pytest.raises(pc.Error, match="nose"):
        pc.truth("B(nose) == 0")


BLAMED = [
    "ℳ⁻¹ = [I-HψK]* D⁻¹ [I+HψK]",
    "ℳ⁻¹ = [I-HψK] D⁻¹ [I-HψK]",
    "ℳ⁻¹ = [I-HφK]* D⁻¹ [I-HφK]",
    "HψMφ*H* = D",
]


@pytest.mark.parametrize("text", [BLAMED[0], *(pytest.param(text, marks=pytest.mark.slow) for text in BLAMED[1:])])
def test_a_wrong_formula_is_refuted_where_the_true_one_holds(text):
    """Each fails with rotor inertia, as the true one does: that says nothing of its own error."""
    report = pc.check(text)
    assert not report and not report.true_where and not report.counterexample.saved_by
    example = report.counterexample
    assert {"J = 0", "serial chain", "single-DOF hinges", "constant H"} <= example.spec.met
    assert "rotor inertia" not in repr(report).split("smallest counterexample")[1] and "also where J = 0" in " ".join(repr(report).split())
    assert not pc.check(text, example.model(), states=1, search=False)


def test_a_formula_of_the_book_is_true_where_the_book_says():
    report = pc.check("ℳ⁻¹ = [I-HψK]* D⁻¹ [I-HψK]")
    assert not report and report.true_where == [{"J = 0"}] and "TRUE where J = 0; FALSE elsewhere" in repr(report)
    assert report.counterexample.rotor_inertia and (report.counterexample.bodies, report.counterexample.model().nv) == (1, 1)


@pytest.mark.slow
def test_a_hypothesis_that_the_refuting_model_meets_saves_nothing():
    """The statement is false on a model without rotor inertia: that J = 0 were enough would contradict it."""
    arm = pc.tree([-1, 0, 0], "pin", seed=3)
    assert not pc.check("ℳ = 2ℳ", arm, budget=0.5).true_where
    assert pc.check("Ω = Υ + ψ̃*Υ + Υψ̃", arm).true_where == [{"serial chain"}]


def of_cells(verdict):
    """A truth map by rule: what is found in each cell."""
    return TruthMap("φ = ψ", [CellTruth(cell, verdict(cell), 4) for cell in CELLS])


def test_what_the_refuting_model_meets_is_taken_out():
    found = of_cells(lambda cell: TRUE if cell.J == NO_J or cell.shape == CHAIN else FALSE)
    assert found.where == saving(found) == [{"J = 0"}, {"serial chain"}]
    assert saving(found, lambda: {"J = 0": True, "serial chain": False}) == [{"serial chain"}]
    assert saving(found, lambda: {"J = 0": True, "serial chain": True}) == []


def test_a_map_that_says_nothing_is_not_true():
    assert not of_cells(lambda cell: UNREAD) and of_cells(lambda cell: TRUE)
    assert of_cells(lambda cell: TRUE if cell.J == WITH_J else UNREAD)
    for verdict in (FALSE, UNDECIDED):
        assert not of_cells(lambda cell, verdict=verdict: verdict if cell == CELLS[-1] else TRUE)


def test_one_undecided_model_leaves_its_cell_undecided(monkeypatch):
    doubtful = [specs(cell)[1] for cell in CELLS[::2]]
    monkeypatch.setattr(MODULE, "judged", lambda _, spec, *__: SimpleNamespace(verdict=UNDECIDED if spec in doubtful else HOLDS))
    found = truth_within("φ = ψ", Budget(math.inf))
    assert [cell.verdict for cell in found] == [UNDECIDED, TRUE] * (len(CELLS) // 2) and not found


def test_what_nothing_saves_is_refuted_where_most_hypotheses_are_met(monkeypatch):
    """It is not blamed on what the true formula does not hold for either."""
    asked = []
    monkeypatch.setattr(MODULE, "smallest", lambda *_, **options: asked.append(options["meets"]))
    for undecided, meets in (({}, CELLS[0]), ({CELLS[0]}, CELLS[1])):
        found = of_cells(lambda cell, undecided=undecided: UNDECIDED if cell in undecided else FALSE)
        monkeypatch.setattr(MODULE, "truth_within", lambda *_, found=found: found)
        explained("φ = ψ")
        assert asked.pop() == meets.least and len(meets.least) >= 3


def test_smallest_cases_are_drawn_as_their_trees():
    """Each false cell has its case: as many bodies and links as it has, hinges by name, rotors ringed; none of the names overlap."""
    found = pc.truth("Ω = Υ + ψ̃*Υ + Υψ̃", budget=1.0)
    page = found._repr_html_()
    rows = list(dict.fromkeys((c.cell.shape, c.cell.J, c.cell.base) for c in found))
    false = [c for c in found if c.example is not None]
    false.sort(key=lambda c: rows.index((c.cell.shape, c.cell.J, c.cell.base)))  # as the table goes
    drawn = re.findall(r"<svg .*?</svg>", page)
    assert len(drawn) == len(false) > 0
    for picture, cell in zip(drawn, false, strict=True):
        assert picture.count("<circle") == picture.count("<line") == cell.example.bodies
        assert (
            re.findall(r">([a-z]+)</text>", picture) == cell.example.kinds
            and (' stroke-width="3"' in picture) == cell.example.rotor_inertia
        )
        places = [(float(x), float(y)) for x, y in re.findall(r'<text x="(\d+)" y="(\d+)"', picture)]
        assert all(abs(a - c) > 30 or abs(b - d) > 10 for (a, b), (c, d) in itertools.combinations(places, 2))
    assert page.count("✗ FALSE") == len(false) and page.count("✓ true") == len(CELLS) - len(false)
    ax = found.plot()
    ax.figure.canvas.draw()
    boxes = [t.get_window_extent() for t in ax.texts]
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))


@pytest.mark.slow
def test_a_budget_that_ends_early_has_tried_every_cell():
    """The book's gradient of ln det: large models take 20 s, the small ones of every cell a few. Its headline is never a bare FALSE."""
    statement = "∂_i ln det(MM + J) = 2 tr(PΥΔ_i)"
    report = pc.check(statement)
    assert report.verdict == "fails" and report.true_where == [frozenset({"J = 0"}), frozenset({"single-DOF hinges"})]
    assert "TRUE where J = 0, or where every hinge has one degree of freedom" in repr(report).replace("\n    ", " ")


def test_a_map_tells_that_a_budget_ended(monkeypatch):
    spent = SimpleNamespace(over=False)
    judged = []

    def judge(_, spec, *__):
        judged.append(spec)
        spent.over = len(judged) >= limit
        return SimpleNamespace(verdict=HOLDS)

    monkeypatch.setattr(MODULE, "judged", judge)
    limit = len(CELLS) + 3
    found = truth_within("φ = ψ", spent)
    assert found.partial and [cell.verdict for cell in found] == [TRUE] * len(CELLS) and sum(cell.models for cell in found) == limit
    judged.clear()
    spent.over, limit = False, len(CELLS) - 1
    assert truth_within("φ = ψ", spent) is None


def test_a_search_that_tried_too_little_says_so():
    report = pc.check("∂_i ln det(MM + J) = 2 tr(PΥΔ_i)", budget=0.0)
    text = repr(report).replace("\n    ", " ")
    assert report.untried and not report.true_where
    assert "FALSE in general; hypotheses under which it may be true were not all tried" in text and "not all were tried" in text


def test_a_map_is_saved_as_a_page_or_a_picture(tmp_path):
    found = pc.truth("HG == I", smallest_case=False)
    page = found.save(tmp_path / "map.html").read_text()
    assert page.startswith("<!DOCTYPE html>") and found._repr_html_() in page and "src=" not in page
    for ending, begins in ((".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")):
        assert found.save(tmp_path / f"map{ending}").read_bytes().startswith(begins)
    with pytest.raises(pc.EvaluationError, match="a truth map is written to a file that ends in .html, .png, .svg, .pdf"):
        found.save(tmp_path / "map.gif")
    with pytest.raises(FileNotFoundError):
        found.save(tmp_path / "nowhere" / "map.png")
