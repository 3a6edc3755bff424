"""Statements as text: every spelling of one statement is read alike, what is ambiguous shows both readings, what is false is
refuted by the smallest model and saved by the right hypothesis."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.directions import coordinates_meant
from pycraft.identities.parse import ParseError, Statements


@pytest.fixture(scope="module")
def model():
    return pc.tree([-1, 0, 0, 1], ["pin", "ball", "slider", "universal"], seed=1)


ALIKE = {
    "innovations covariance": [
        "HψMψ*H* == D",
        "HψMψ*H* = D",
        "H ψ M ψ* H* = D",
        "H psi M psi* H* = D",
        "H@psi@M@psi.T@H.T == D",
        "H*psi*M*psi.T*H.T == D",
        "HψMψᵀHᵀ = D",
        "Hψ M ψ^* H^* = D",
        r"H \psi M \psi^* H^* = \mathcal{D}",
        r"$H\psi M\psi^{*} H^{*} = \mathcal{D}$",
        r"H \psi M \psi^\top H^\top = \mathcal{D}",
        "D == H@psi@M@psi.T@H.T",
        "H·ψ·M·ψ*·H* = D",
    ],
    "resolvents": [
        "inv(psi) == inv(phi) + K*H",
        "ψ⁻¹ = φ⁻¹ + KH",
        "psi.inv() == phi.inv() + K@H",
        "psi^-1 = phi^-1 + K H",
        "psi**-1 == phi**-1 + K@H",
        r"\psi^{-1} = \phi^{-1} + \mathcal{K}H",
        r"\psi^{-1}=\phi^{-1}+\mathcal{K} H",
    ],
    "innovations factor": [
        "[I+HφK]⁻¹ = I − HψK",
        "(I+HφK)^-1 == I-HψK",
        "(I + H@phi@K).inv() == I - H@psi@K",
        "inv(I+HφK) = I-HψK",
    ],
    "left inverse": ["HG == I", "H G = I", "H@G == I", "H*G == I", r"H \mathcal{G} = I"],
    "mass matrix": ["ℳ = HφMφ*H*", "MM == H@phi@M@phi.T@H.T", r"\mathcal{M} = H\phi M\phi^*H^*"],
    "annihilation": ["Hτ̄ == 0", "H τ̄ = 0", "H@tau_bar == 0", r"H\bar\tau = 0"],
    "diagonal blocks": ["blockdiag(φMφ*) = R", "blockdiag(phi@M@phi.T) == R"],
    "numbers": ["2φ = φ + φ", "2*phi == phi + phi", "φ/2 = 0.5φ", "-φ = φ - 2φ", "2 phi = phi + phi"],
    "numbers before products": ["2*D@D == D@D + D@D", "2 D D = D D + D D", "D@D*2 == 2*D@D", "-2 D D/4 = -0.5 D D", "(1/2) φ ψ = 0.5φψ"],
    "coordinates": ["Delta(hinge0) == Delta(0)", "Δ(hinge1[0]) = Δ(1)"],
    "nodes": [
        "𝒥(body1) = B(body1)*φ*H*",
        "Jacobian(body1) == B(body1).T@phi.T@H.T",
        "Jacobian('body1') == B('body1').T@phi.T@H.T",
    ],
    "nodes in products": [
        "B(body1)*φ*H*θ̇ = B(body1)* V",
        r"\mathcal{J}_{\mathrm{body1}}\,\dot\theta = {\mathcal{B}_{\mathrm{body1}}}^{*}\mathcal{V}",
    ],
    "velocities": ["velocity == phi.T@H.T@theta_dot", "velocity = phi* H* theta_dot", "b = V_bar M velocity", "V̄ = -Ṽ*"],
    "scalars": ["logdet(MM) == logdet(D)", "ln det(ℳ) = ln det(D)", "trace(Upsilon@M) == N", "tr(ΥM) = N"],
}


@pytest.mark.parametrize("name", ALIKE)
def test_spellings_of_true_statements(name, model):
    for text in ALIKE[name]:
        assert pc.check(text, model, states=2), text


def test_equal_spellings_give_equal_expressions(model):
    read = Statements(model.soa).read
    for name in ("innovations covariance", "resolvents", "innovations factor", "mass matrix"):
        sides = [{s.lhs, s.rhs} for s in map(read, ALIKE[name])]
        dense = [sorted(tuple(np.round(x.dense(), 9).ravel()) for x in pair) for pair in sides]
        assert all(x == dense[0] for x in dense)
    first = read("HψMψ*H* == D")
    H, psi, M, D = model.soa("H psi M D")
    assert first.lhs == H @ psi @ M @ psi.T @ H.T and first.rhs == D and first.reading == "the book"
    assert read("H@psi@M@psi.T@H.T == D").reading == "Python" and read("H@psi").rhs is None


@pytest.mark.parametrize(
    "text",
    [
        "HG == GH",
        "φ = ψ",
        "M == P",
        "τ = τ̄",
        "HψMψ*H* = MM",
        "logdet(MM) == logdet(M)",
        "E@E == E",
        "phi == 0",
        "inv(psi) == inv(phi) - K*H",
    ],
)
def test_false_statements(text, model):
    try:
        assert not pc.check(text, model, states=2, search=False)
    except ParseError as error:
        assert text == "HG == GH" and "Θ" in str(error)  # it does not even fit


def test_ambiguous_text_shows_both_readings(model):
    for text, python, book in (("D*D == D@D", "D D", "D* D"), ("MM*D = MM@D", "H φ M φ* H* D", "(H φ M φ* H*)* D")):
        with pytest.raises(ParseError) as caught:
            pc.check(text, model)
        shown = str(caught.value)
        assert "is ambiguous; both readings match" in shown and f"Python: {python} =" in shown and f"the book: {book} =" in shown
        assert "write .T for a transpose" in shown
    assert pc.check("phi*psi == phi@psi", model)  # φ*ψ fits only as Python's product: φ* ends in V


def test_whole_powers_are_powers(model):
    """`**` is Python's power and nothing else: no name is transposed twice and multiplied by a number after it."""
    assert pc.check("tau**2 == tau", model, states=2)
    assert pc.check("E@E@E@E == E**4", model, states=2) and pc.check("τ² = τ", model, states=2) and pc.check("tau^2 = tau", model, states=2)


def test_what_cannot_be_read_says_why(model):
    for text, shown in [
        ("foo == phi", "no operator is called 'foo'"),
        ("phi == ", "does not read as a statement"),
        ("phi == H", "φ maps F .* they cannot be added"),
        ("phi", "has one side; a statement is lhs == rhs"),
        ("H == 1", "one is an operator, the other a number"),
        ("1 == 1", "not only numbers"),
        ("phi != psi", "a statement is lhs == rhs"),
        ("phi == psi == E", "a statement is lhs == rhs"),
        ("HH = H", "H maps F .*cannot follow H"),
        ("Delta(hinge9) == 0", "no coordinate of .* is called 'hinge9'"),
        ("B(nose) == 0", "no node or body"),
        ("phi**psi == phi", "power|whole"),
        ("phi + 1 == phi", "number \\+ operator"),
        ("__import__('os') == phi", "not|no"),
        ("", "not understood|does not read|one side"),
    ]:
        with pytest.raises(pc.Error, match=shown):
            pc.check(text, model)


def test_an_identity_of_no_space_is_no_crash():
    """I == I has no space to be checked in: an error, or true; it ran off the end of memory once."""
    import subprocess
    import sys

    code = "import pycraft as pc\ntry:\n    pc.check({}, pc.chain(2))\nexcept pc.Error:\n    pass\n"
    for statement in ("'I == I'", "'2*I == I + I'", "(pc.identity(), pc.identity())"):
        run = subprocess.run([sys.executable, "-c", code.format(statement)], capture_output=True, text=True)
        assert run.returncode == 0, (statement, run.returncode, run.stderr[-500:])


def test_expressions_and_numbers_as_statements(model):
    D, M, phi = model.soa("D M phi")
    assert pc.check((D.trace(), D.trace()), model) and not pc.check((M, 2 * M), model, search=False)
    assert pc.check((phi.inv() @ phi, pc.identity()), model) and pc.check((phi, phi @ pc.identity()), model)
    with pytest.raises(pc.SpaceError, match="they cannot be added"):
        pc.check((D, M), model)
    T, u = (pc.vector(name, model.soa.Theta) for name in "Tu")
    assert pc.check((D @ T @ u.T, D @ (T @ u.T)), model) and not pc.check((T @ u.T, u @ T.T), model, search=False)
    with pytest.raises(pc.EvaluationError, match="give text to check a statement on random trees"):
        pc.check((D, D))
    assert pc.check("phi@psi == phi*psi", model.soa)  # an operator set serves for a model


# ---------------------------------------------------------------------- counterexamples (ruling 28)


SMALLEST = [
    # text, bodies, degrees of freedom, rotor inertia, the hypothesis that saves it
    ("HG == I", 1, 1, True, "J = 0"),
    ("HψMψ*H* = D", 1, 1, True, "J = 0"),
    ("ℳ = [I+HφK] D [I+HφK]*", 1, 1, True, "J = 0"),
    ("Ω = Υ + ψ̃*Υ + Υψ̃", 3, 1, False, "the tree is a serial chain"),  # a pin that carries two bodies on welds
    ("M == 1.0000000000001*M", 1, 1, False, None),
    ("HΔ(hinge1[0]) = 0", 2, 2, False, "every hinge has one degree of freedom"),
]


@pytest.mark.parametrize(("text", "bodies", "dof", "rotor", "saved"), SMALLEST)
def test_the_smallest_counterexample(text, bodies, dof, rotor, saved):
    model = pc.tree([-1, 0, 0, 1], ["ball", "universal", "free", "pin"], seed=3, rotor_inertia=True)
    report = pc.check(text, model, states=2)
    assert not report and report.worst > 0
    example = report.counterexample
    assert (example.bodies, example.model().nv, example.rotor_inertia) == (bodies, dof, rotor)
    assert example.saved_by == ([saved] if saved else []) and example.states >= 3
    again = pc.check(text, example.model(), states=1, search=False)
    assert not again  # the counterexample refutes by itself
    shown = repr(report)
    assert "FALSE" in shown and f"pc.tree({example.parents}" in shown and (f"{example.states} states each" in shown) == (example.tried > 0)
    if saved:
        assert f"TRUE where {saved}; FALSE elsewhere" in shown
    at_state = example.model()
    assert np.array_equal(at_state.q, example.q)


def test_smaller_models_were_tried_in_order():
    """The candidates: every forest shape of each size, every choice of kinds by degrees of freedom, rotors after none."""
    from pycraft.identities.search import candidates, shapes

    assert [len(list(shapes(n))) for n in (1, 2, 3, 4, 5)] == [1, 2, 4, 9, 20]  # rooted forests of n nodes: 1, 2, 4, 9, 20
    sizes = []
    for spec in candidates(2):
        model = pc.tree(spec.parents, spec.kinds, welds="keep")
        sizes.append(spec.size)
        assert spec.size == (len(model.bodies), model.nv)
    assert sizes == sorted(sizes) and len(set(sizes)) > 10


def test_welds_are_among_the_kinds_that_are_tried():
    """φ == ψ: a pin outboard of a weld refutes it with one degree of freedom; two pins are not the smallest."""
    report = pc.check("φ == ψ", pc.chain(3))
    assert not report and (report.counterexample.bodies, report.counterexample.model().nv) == (2, 1)


def test_statements_on_random_trees():
    assert pc.check("ψ⁻¹ = φ⁻¹ + KH", states=10) and pc.check("[I+HφK]⁻¹ = I − HψK", states=10)
    false = pc.check("HG == I", states=10)
    assert not false and false.counterexample.saved_by == ["J = 0"] and len(false.models) == 24
    with pytest.raises(pc.EvaluationError, match="has one side"):
        pc.check("phi")


def test_without_a_search_there_is_no_counterexample(model):
    report = pc.check("φ == ψ", model, search=False)
    assert not report and report.counterexample is None and report.bound < 1e-9 < report.worst


def test_the_coordinates_that_are_meant():
    """i is the last of its hinge, so that those before it turn with it; j is outboard of it."""
    assert coordinates_meant(pc.tree([-1, 0, 1], ["pin", "ball", "pin"]).soa) == (3, 4)
    assert coordinates_meant(pc.tree([-1, 0, 1, 0], ["pin", "universal", "pin", "free"]).soa) == (2, 3)
    assert coordinates_meant(pc.chain(1).soa) == (0, 0)
    with pytest.raises(pc.ModelError, match="no coordinate"):
        coordinates_meant(pc.tree([-1], "weld").soa)


@pytest.mark.parametrize("given", [3, None, b"phi", np.eye(3), ("φ", "ψ"), ["φ = φ", "φ = φ", "φ = φ"]], ids=repr)
@pytest.mark.parametrize("ask", ["check", "truth", "repair", "parse"])
def test_what_is_no_text_is_said(ask, given):
    model = [pc.chain(1)] if ask == "parse" else []
    with pytest.raises(pc.EvaluationError, match="statement (is|as) text"):
        getattr(pc, ask)(given, *model)


def test_options_of_a_check_are_checked():
    arm = pc.chain(1)
    for options in ({"states": "x"}, {"states": 2.5}, {"states": 0}, {"seed": "x"}, {"seed": -1}):
        with pytest.raises(pc.Error, match=f"{next(iter(options))}.*(whole number|at least one state)"):
            pc.check("φ = φ", arm, **options)
        if options != {"states": 0}:
            with pytest.raises(pc.Error, match=f"{next(iter(options))}.*whole number"):
                arm.soa.check(**options)
    with pytest.raises(pc.EvaluationError, match="0 or more"):
        arm.soa.check(states=-2)
    with pytest.raises(pc.EvaluationError, match="check takes a model or its operators"):
        pc.check("φ = φ", 3)
