"""Statements by block: what reads, that every choice of bodies is looked at, verdicts, and that prove says that it does not prove them."""

import itertools

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities import block_check
from pycraft.identities.block_reading import is_by_block, read_by_block
from pycraft.identities.block_relations import ancestors, choices, standard
from pycraft.identities.family import Spec
from pycraft.proofs import prove
from support.mechanisms import every_kind

CLOSEST = "c the closest common ancestor of i and j"


@pytest.fixture(scope="module")
def arm():
    return pc.tree([-1, 0, 0, 1], ["universal", "ball", "slider", "pin"], seed=1)


# (statement, for how many choices of bodies of the tree above it is checked)
TRUE = [
    (f"Ω(i,j) = ψ*(c,i)Υ(c)ψ(c,j), {CLOSEST}", 16),
    (r"\Omega(i,j) = \psi^*(c,i)\Upsilon(c)\psi(c,j) where c = lca(i,j)", 16),
    ("Omega(i,j) == psi(c,i).T @ Upsilon(c) @ psi(c,j), c is the nearest common ancestor of i, j and i, j not on one path", 4),
    ("Ω(i,j) = Υ(i)ψ(i,j), i above j", 4),
    ("Ω(i,j) = ψ*(j,i)Υ(j) for i below or equal to j", 8),
    ("P(k) = M(k) + Σ_{j∈C(k)} φ(k,j) P⁺(j) φ*(k,j)", 4),
    (r"R(k) = M(k) + \sum_{j\in\mathcal{C}(k)} \phi(k,j) R(j) \phi^*(k,j)", 4),
    ("V(k) = φ*(𝒫(k),k)V(𝒫(k)) + H*(k)θ̇(k)", 3),
    ("velocity(k) = phi(p,k).T @ velocity(p) + H(k).T @ theta_dot(k), p parent of k", 3),
    ("D(k) = H(k)P(k)H*(k) + J(k)", 4),
    ("G(k) = P(k)H*(k)D⁻¹(k)", 4),
    ("φ(i,j) = φ(i,k)φ(k,j), i above k, k above j", 1),
    ("ψ(p,k) = φ(p,k)τ̄(k), k ∈ children(p)", 3),
    ("φ(i,j) = 0, i and j on different branches", 4),
    ("φ(i,i) = I", 4),
    ("ℳ(i,j) = H(i)φ(i,j)R(j)H*(j), i above or the same as j", 8),
    ("Σ_k tr(Υ(k)M(k)) = N", 1),
    ("ln det ℳ = Σ_k ln det D(k)", 1),
]
FALSE = [
    ("Ω(i,j) = ψ*(c,i)Υ(c)ψ(c,j)", CLOSEST.replace("the", "is the", 1)),
    ("Ω(i,j) = Υ(i)ψ(i,j)", "i is above j or the same"),
    ("ψ(i,j) = φ(i,j)", None),
    ("P(k) = M(k) + Σ_{j∈C(k)} φ(k,j) P(j) φ*(k,j)", None),
    ("V(k) = φ*(𝒫(k),k)V(𝒫(k)) - H*(k)θ̇(k)", None),
    ("D(k) = H(k)R(k)H*(k)", None),
    ("ln det ℳ = Σ_k ln det (H(k)R(k)H*(k))", None),
]


@pytest.mark.parametrize(("text", "count"), TRUE)
def test_true_ones(arm, text, count):
    report = pc.check(text, arm, states=1)
    assert report and f"for {count} choices of bodies" in repr(report), report
    assert report.residual <= report.residual_bound <= 1e-12 and report.precision == "extended"


@pytest.mark.parametrize(("text", "where"), FALSE)
def test_false_ones(arm, text, where):
    report = pc.check(text, arm, states=1)
    assert not report and report.verdict == "fails" and "FALSE" in repr(report)
    assert any(f"true on it where {where}" in note for note in report.notes) == (where is not None), report
    assert all(name in repr(report) for name in report.counterexample.bodies.values())


def test_blocks_are_those_of_the_matrices(arm):
    """Against dense arrays: off by what the arrays say, for the bodies that they say."""
    state = arm.random_state(seed=3)
    arm.q, arm.v = state.q, state.v
    names = {name: slice(6 * i, 6 * i + 6) for i, (name, *_) in enumerate(arm.soa.F.blocks)}
    Y, psi, phi = (getattr(arm.soa, x).dense() for x in ("Upsilon", "psi", "phi"))
    report = block_check._on_model(read_by_block("Υ(i)ψ(i,j) = Υ(i)φ(i,j)"), arm.soa, [None], "extended")
    off = {(i, j): np.abs(Y[a, a] @ (psi[a, b] - phi[a, b])).max() for (i, a), (j, b) in itertools.product(names.items(), repeat=2)}
    listed = [name for name, *_ in arm.soa.F.blocks]
    assert {(listed[b["i"]], listed[b["j"]]) for b in report.bad} == {pair for pair, far in off.items() if far > 1e-9}
    worst = report.refutation[1]
    assert off[listed[worst["i"]], listed[worst["j"]]] == max(off.values())


def test_relations_on_a_tree():
    parents = [-1, 0, 1, 0, 3, 3]
    assert ancestors(parents, 4) == [4, 3, 0]

    def pairs(said):
        read = read_by_block(f"Ω(i,j) = Ω(i,j), {said}")
        return {(b["i"], b["j"]) for b in choices(read.indices, parents, read.relations, {})}

    everything = {*itertools.product(range(6), repeat=2)}
    above = {(i, j) for i, j in everything if i != j and i in ancestors(parents, j)}
    same = {(i, i) for i in range(6)}
    assert pairs("i above j") == pairs("i an ancestor of j") == pairs("i inboard of j") == above
    assert pairs("i below j") == pairs("j above i") == {(j, i) for i, j in above}
    assert pairs("i and j on one path to the base") == above | same | {(j, i) for i, j in above}
    assert pairs("i, j not on one path") == everything - pairs("i, j on one path")
    assert (
        pairs("i parent of j") == pairs("i = 𝒫(j)") == pairs("j child of i") == pairs("j ∈ C(i)") == {(parents[j], j) for j in range(1, 6)}
    )
    assert pairs("i ≠ j and i above or equal to j") == above and pairs("i = j") == same
    triples = read_by_block(f"Ω(i,j) = ψ*(c,i)ψ(c,j), {CLOSEST}")
    found = {(b["i"], b["j"]): b["c"] for b in choices(triples.indices, parents, triples.relations, {})}
    assert found[4, 5] == 3 and found[2, 4] == 0 and found[4, 3] == 3 and len(found) == 36
    assert all(r.holds(parents, {"i": 0, "j": 1}) == ((0, 1) in pairs(str(r))) for r in standard(("i", "j")) if "the same" not in str(r))


ERRORS = [
    ("Ω(i,j) = ψ*(c,i?)Υ(c)ψ(c,j)", "not understood at", "c,i?)"),
    ("Ω(i,j) = Υ(i)ψ(i,j) + )", "not understood at '.'", ")"),
    ("Ω(i,j) = Υ(i)ψ(i,j), i beside j", "what may be said is", "i beside"),
    ("Ω(i,j) = Υ(i)ψ(i,j), q above j", "no body of the statement is called q", "q above"),
    ("Ω(i,j) = ψ⁻¹(i,j)", "write inv", None),
    ("D(k) = D(k)*H(k).T", "write @ to multiply", None),
    ("Ω(i,j)", "one side", None),
    ("ψ(c,i)Υ(c) = Ω(c,i)", "acts on F of body i, and Υ.c., applied before it, leads to V of body c", None),
    ("Ω(i,j) = Υ(i) + Ω(i,j)", "lead between different places", None),
    ("Ω(i,j) = Ω(j,i)", "the left side leads from F of body j to V of body i", None),
    ("Ω(k) = Υ(k)", "has blocks between two bodies", None),
    ("V(i,j) = V(i)", "blocks have one body", None),
    ("D(k)² = D(k)", "of blocks there are", None),
    ("φ(i,j) = 0, i above j and j above i", "satisfy its relations", None),
]


@pytest.mark.parametrize(("text", "says", "place"), ERRORS)
def test_errors_show_the_place(arm, text, says, place):
    with pytest.raises((pc.EvaluationError, pc.SpaceError), match=says) as error:
        pc.check(text, arm, states=1)
    if place:
        *_, line, caret = str(error.value).splitlines()
        assert line[caret.index("^") :].startswith(place)


def test_statements_of_operators_are_none():
    for text in ("ℳ⁻¹ = [I-HψK]* D⁻¹ [I-HψK]", "φ(I - E) = I", "B(node1)* φ = 𝒥(node1)", "∂_i φ = φ̃ Δ(i) φ", "V̄(b) = M(a)", "tr(D) = N"):
        assert not is_by_block(text), text
    assert is_by_block("D(x) = D(x)") and not is_by_block("D(x) = D(x)", own=["x"])
    assert is_by_block("Υ(link4) = Υ(link4)", ["link4"])
    assert prove("x ∈ Θ; D(x) = D x")


def test_named_bodies():
    model = every_kind()
    model.take_warnings()
    names = list(model.bodies)
    assert pc.check(f"Υ({names[2]}) = Ω({names[2]}, {names[2]})", model, states=1)
    assert not pc.check(f"Ω({names[2]}, {names[2]}) = 2 Υ({names[2]})", model, states=1)


def test_what_does_not_take_them_says_so():
    for call in (pc.truth, pc.repair):
        with pytest.raises(pc.EvaluationError, match="statements by block are not mapped or repaired"):
            call("Ω(i,j) = Υ(i)ψ(i,j), i above j")
    with pytest.raises(pc.EvaluationError, match="without a form in operators"):
        prove("Ω(i,j) = Υ(i)ψ(i,j), i above j")


def test_on_random_trees_hypotheses_and_relations_come_out(monkeypatch):
    few = [
        Spec((-1, 0), ("pin", "pin"), False, 1),
        Spec((-1, 0), ("slider", "pin"), False, 2),
        Spec((-1, 0, 0), ("pin", "ball", "pin"), True, 3),
        Spec((-1, 0, 0), ("pin", "pin", "pin"), True, 4),
    ]
    monkeypatch.setattr(block_check, "family", lambda count: few)
    assert pc.check(f"Ω(i,j) = ψ*(c,i)Υ(c)ψ(c,j), {CLOSEST}")
    book = pc.check("H(k)G(k) = I")
    assert {"J = 0"} in book.true_where and "TRUE where J = 0" in repr(book)
    assert book.counterexample.spec.parents == (-1, 0, 0)
    relation = pc.check("Ω(i,j) = Υ(i)ψ(i,j)")
    assert "true on all models tried where i is above j or the same" in relation.notes and not relation.true_where


@pytest.mark.slow
def test_the_books_statement_on_the_family():
    assert pc.check(f"Ω(i,j) = ψ*(c,i)Υ(c)ψ(c,j), {CLOSEST}")
    assert pc.check("H(k)G(k) = I").true_where[0] == {"J = 0"}
