"""Statements on random trees: where they are true, under which hypotheses, and the case that tells most."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.family import CELLS, DEPTH, DOF, HYPOTHESES, Spec, family, respelled, specs
from pycraft.identities.truth import FALSE, TRUE

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


def test_a_hypothesis_that_the_refuting_model_meets_saves_nothing():
    """The statement is false on a model without rotor inertia: that J = 0 were enough would contradict it."""
    arm = pc.tree([-1, 0, 0], "pin", seed=3)
    assert not pc.check("ℳ = 2ℳ", arm, budget=0.5).true_where
    assert pc.check("Ω = Υ + ψ̃*Υ + Υψ̃", arm).true_where == [{"serial chain"}]
