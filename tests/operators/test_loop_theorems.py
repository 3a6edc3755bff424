"""Theorems of loops: checked on closed models of every kind, false where a term is left out, and which of them are derived.

What is left out of a true statement is of the size of its terms on these models, far above 1e-3; what is true is off by rounding times the
condition of Q(ℳ+J)⁻¹Q*, 1e4 at most here: below 1e-9 in double.
"""

import functools

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from pycraft.proofs import prove
from support.closed_models import MODELS
from support.random_identities import ROUNDING

OF_ENDS = {"rows of loops by their ends", "compliance of the rows", "rate of the rows"}
BESIDE = {
    "tree augmentation: the rows are kept",
    "tree augmentation: the equations of motion",
    "what loops leave free",
    "loops' impulses do no work on what is left free",
}
EMBEDDED = {
    "compound hinge map",
    "compound hinge-diagonal term",
    "compound mass matrix, by groups",
    "compound mass matrix",
    "velocities of embedded loops",
    "Coriolis acceleration of embedded loops",
    "rows are kept by independent velocities",
    "rate of the map",
    "rows are kept by accelerations",
    "accelerations of embedded loops",
    "equations of motion of embedded loops",
    "both ways lead to the same accelerations",
    "derivative of the compound hinge map",
    "derivative of the compound mass matrix",
    "derivative of the compound articulated inertia",
}
NOT_DERIVED = {
    "rate of the rows",  # derivatives of letters of two sources
    "compound mass matrix",  # of the groups and of the robot body by body
    "both ways lead to the same accelerations",
    "derivative of the compound hinge map",
    "derivative of the compound mass matrix",
    "derivative of the compound articulated inertia",
}


def of_loops(operators):
    return {t.name: t for t in operators.theorems() if t.group.startswith("Loops")}


@functools.cache
def closed(name):
    """A closed model, its operators and its embedded ones."""
    model = MODELS[name]()
    return model, model.soa, model.soa.embedded()


def off(theorem, seed=0):
    """How far the sides are apart, relative to the larger."""
    rng = np.random.default_rng(seed)
    vectors, todo = {}, [theorem.lhs, theorem.rhs]
    while todo:
        e = todo.pop()
        todo += e.children
        if e.kind == "vector":
            vectors.setdefault(e.name, rng.normal(size=e.codomain.dimension))
    difference, left, right = _core.residual(theorem.lhs, theorem.rhs, vectors)
    return difference / max(left, right)


@pytest.mark.parametrize("name", MODELS)
def test_they_hold_off_the_loops_and_on_them(name):
    """Those of rows at random states of the tree, those of compound bodies at states on the loops."""
    _, soa, embedded = closed(name)
    for operators in (soa, embedded):
        report = operators.check(states=2)
        assert report
        findings = [f for f in report.findings if f.group.startswith("Loops")]
        assert findings and all(f.verdict == "holds" and not f.hypotheses for f in findings)


def test_each_was_stated_somewhere_and_says_something():
    stated, largest = set(), {}
    for name in MODELS:
        for operators in closed(name)[1:]:
            for theorem in of_loops(operators).values():
                stated.add(theorem.name)
                largest.setdefault(theorem.name, 0.0)
                if not isinstance(theorem.lhs, pc.Scalar):
                    vectors = {v: np.ones(n) for e in (theorem.lhs, theorem.rhs) for v, n in _vectors(e)}
                    largest[theorem.name] = max(largest[theorem.name], *_core.residual(theorem.lhs, theorem.rhs, vectors)[1:])
    assert stated == OF_ENDS | BESIDE | EMBEDDED
    assert min(largest.values()) > 1e-3


def _vectors(e):
    found = [(e.name, e.codomain.dimension)] if e.kind == "vector" else []
    return found + [one for child in e.children for one in _vectors(child)]


def test_models_without_loops_have_none_and_couplings_no_ends():
    assert not of_loops(pc.chain(3).soa)
    assert not OF_ENDS & of_loops(closed("gears")[1]).keys()
    assert of_loops(closed("four-bar")[1]).keys() >= OF_ENDS
    alone = pc.chain(2)
    alone.add_loop("body1", "body0", "free", name="nothing")
    assert not of_loops(alone.soa)  # no rows
    assert not any(t.waiting.startswith("loops") for t in alone.soa.theorems())


@pytest.mark.parametrize("name", ["four-bar", "spatial", "two loops"])
def test_a_term_less_is_seen(name):
    """Without Q̇θ̇, without Ẋθ̇_r, with H of the bodies in place of X*H, with a sign turned."""
    _, _, embedded = closed(name)
    groups, X, rate = embedded.unconstrained, embedded.X_r, embedded.X_r_dot
    theorems = of_loops(embedded)
    a = theorems["Coriolis acceleration of embedded loops"]
    kept = theorems["rows are kept by accelerations"]
    for true, false in [
        ((a.lhs, a.rhs), (a.lhs, groups.a)),
        ((a.lhs, a.rhs), (a.lhs, groups.a - groups.H.T @ rate @ embedded.theta_dot)),
        ((kept.lhs, kept.rhs), (kept.lhs, 0.5 * kept.rhs)),
        ((embedded.MM, X.T @ groups.MM @ X), (embedded.MM, X.T @ (groups.MM + groups.J + 0.1 * pc.identity(groups.Theta)) @ X)),
    ]:
        assert pc.check(true, embedded, states=1)
        assert not pc.check(false, embedded, states=1, search=False)


def test_multipliers_without_the_rate_of_the_rows_are_wrong_at_speed():
    """soa.md #63: θ̈ = θ̈_f - (ℳ+J)⁻¹Q*Λ Qθ̈_f does not keep the rows, and does where nothing moves."""
    model, soa, _ = closed("two loops")
    theorem = of_loops(soa)["tree augmentation: the rows are kept"]
    assert off(theorem) < 1e-9
    still = theorem.lhs.at(model.q, np.zeros(model.nv)), theorem.rhs.at(model.q, np.zeros(model.nv))
    T = {"T": np.ones(model.nv)}
    assert max(_core.residual(*still, T)[1:]) < 1e-9 < 1e-3 < max(_core.residual(theorem.lhs, theorem.rhs, T)[1:])


@pytest.mark.parametrize("name", MODELS)
def test_what_follows_from_the_axioms_is_derived(name):
    _, soa, embedded = closed(name)
    for theorem in [*of_loops(soa).values(), *of_loops(embedded).values()]:
        proof = prove(theorem.lhs, theorem.rhs)
        if theorem.name in NOT_DERIVED:
            continue
        assert proof and not proof.hypotheses and proof.recheck(), theorem.name
        assert proof.worst is None or proof.worst < ROUNDING * 1e2, theorem.name


def test_the_page_on_proofs_counts_them():
    assert len(OF_ENDS | BESIDE | EMBEDDED) == 22 and len(OF_ENDS | BESIDE | EMBEDDED - NOT_DERIVED) - len(NOT_DERIVED & OF_ENDS) == 16


def test_proofs_of_loops_refuse_what_is_false():
    _, soa, embedded = closed("spatial")
    groups, X = embedded.unconstrained, embedded.X_r
    Q, reach = soa.Q, _core._rows_by_ends(soa.Q.children[1].letter.source)
    assert prove(Q, reach) and not prove(Q, -reach) and not prove(Q, 2 * reach)
    assert prove(Q @ X, 0 * (Q @ X)) and not prove(Q, 0 * Q)
    assert prove(embedded.H, X.T @ groups.H) and not prove(embedded.H @ embedded.M @ embedded.H.T, embedded.MM)
    assert prove(embedded.phi, groups.phi) and prove(embedded.M, groups.M) and not prove(embedded.P, groups.P)
    assert prove(embedded.J, X.T @ groups.J @ X) and "J = 0" in prove(embedded.J, 0 * embedded.J).hypotheses
    assert "X_r" in str(prove(embedded.MM, X.T @ groups.MM @ X))
