"""Spellings of statements: what people type reads as what they mean, and what cannot be read shows the place where it stumbles."""

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from pycraft.identities.parse import ParseError, Statements
from support.typed_spellings import SPELLINGS


@pytest.fixture(scope="module")
def read():
    model = pc.tree([-1, 0, 0, 1], ["pin", "ball", "slider", "universal"], seed=1)
    state = model.random_state(seed=2)
    model.q, model.v, model.gravity = state.q, state.v, (0.3, -0.2, -9.8)
    return Statements(model.soa).read


def value(side):
    return side.dense() if hasattr(side, "dense") else np.array(float(side))


@pytest.mark.parametrize("meant", SPELLINGS)
def test_every_spelling_reads_as_what_is_meant(meant, read):
    wanted = read(meant).lhs
    for typed in SPELLINGS[meant]:
        got = read(typed).lhs
        assert type(got) is type(wanted), typed
        if got != wanted:  # spelled by its definition, or with other brackets
            np.testing.assert_allclose(value(got), value(wanted), rtol=1e-12, atol=1e-12 * np.abs(value(wanted)).max(), err_msg=typed)


@pytest.mark.parametrize("sign", [r"\cdot", r"\times"])
def test_powers_of_ten(sign, read):
    for power, number in (("^{2}", "300"), ("^2", "300"), ("^{-2}", "0.03"), (" ^ { +2 }", "300")):
        assert read(rf"3 {sign} 10{power} \phi").lhs == read(f"{number} φ").lhs


def test_every_letter_reads_by_its_name_its_sign_and_its_latex(read):
    with_arguments = {"B": "body1", "Jacobian": "body1", "Lambda": "body1", "Delta": "0"}
    for name, shown, latex in ((s.name, s.text, s.latex) for s in _core.symbols):
        if name in with_arguments:
            argument = with_arguments[name]
            assert read(f"{name}({argument})").lhs == read(f"{shown}({argument})").lhs == read(f"{latex}_{{\\mathrm{{{argument}}}}}").lhs
            continue
        assert read(name).lhs == read(shown).lhs == read(latex).lhs == read(rf"\left({latex}\right)").lhs, name


def test_what_is_shown_reads_back(read):
    """Text and LaTeX of expressions read as the expressions themselves."""
    for text in (
        "[I-HψK]*D⁻¹[I-HψK]",
        "φ̃M - 2ψ̃*ᵀM",
        "E_φ P⁺ E_φ*",
        "½(ψ + ψ)",
        "blockdiag(E_φ R E_φ*)",
        "(I - E_ψ)⁻¹",
        "D^½",
        "D^-½",
        "ψ⁻*",
    ):
        meant = read(text)
        for again in (meant.understood, meant.lhs.latex(), f"${meant.lhs.latex()}$"):
            np.testing.assert_allclose(value(read(again).lhs), value(meant.lhs), rtol=1e-12, atol=1e-12, err_msg=again)


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("Epsi M", "E_psi M"),
        ("Ephi", "E_φ"),
        ("E psi M", "E_φ ψ M"),
        ("-2 D D/4", "-(1/2) D D"),
        ("tr ΥM - 3 N", "trace(ΥM) - 3 N"),
        ("2 tr ΥM", "2 trace(ΥM)"),
        ("ln det ℳ - ln det D", "logdet(MM) - logdet(D)"),
        ("√D √D", "sqrt(D) sqrt(D)"),
        ("√(4D)", "sqrt(4 D)"),
    ],
)
def test_what_binds_to_what(typed, meant, read):
    np.testing.assert_allclose(value(read(typed).lhs), value(read(meant).lhs), rtol=1e-13, atol=1e-13)


MISREAD = [
    # typed, what is said, the column of the caret
    ("D \\ D", "a left division is not read: A \\\\ B is inv\\(A\\) B", 2),
    ("HψMψ*H* = Q", "Q is a letter of models with loops", 10),
    ("H ph M", "no operator is called 'ph'; the nearest names are φ", 2),
    (r"\phi \foo D", r"the command \\foo is not known here", 5),
    ("φ = det(D)", "a determinant is read by its logarithm, ln det A", 4),
    ("HφMφ*H* = ℳ)", r"not understood at '\)'", 11),
    ("φ M =", "not understood at its end", 5),
    ("φ + [I", "not understood at its end", 6),
    ("τ̄ M⁺", "⁺ belongs to P alone", 3),  # τ̄ is one column
    ("φ D^x", "'x' is no exponent", 4),
    ("D^(1/3)", "'\\(1/3\\)' is no exponent", 2),
    ("D^2^3", "a power of a power needs parentheses", 2),
    ("inv phi", r"inv needs its operand in parentheses: inv\(A\)", 0),
    ("φ† M", "not understood at '†", 1),
    (r"\int_0^1 D", r"the command \\int is not known", 0),
    ("M_1", "no operator is called 'M_1'", 0),
]


@pytest.mark.parametrize(("typed", "said", "column"), MISREAD)
def test_what_is_not_read_shows_the_place(typed, said, column, read):
    with pytest.raises(ParseError, match=said) as caught:
        read(typed)
    lines = str(caught.value).split("\n")
    assert lines[-2].strip() == typed.strip() and lines[-1].index("^") - 4 in (column, column - 1), str(caught.value)


@pytest.mark.parametrize("text", ["1/0", "φ/0", "φ = 1/0 φ", r"\frac{1}{0} D = D"])
def test_a_division_by_zero_is_called_so(text, read):
    with pytest.raises(ParseError, match="divides by zero"):
        read(text)


def test_the_place_is_in_the_line_that_was_typed(read):
    with pytest.raises(ParseError) as caught:
        read("\\begin{equation}\n  \\mathcal{M} =\n  H \\phi Q \\phi^* H^*\n\\end{equation}")
    assert str(caught.value).endswith("      H \\phi Q \\phi^* H^*\n             ^")


def test_a_statement_says_how_it_was_read(read):
    assert read(r"\mathcal{E}_\psi = \mathcal{E}_\phi\bar\tau").understood == "E_ψ = E_φ τ̄"
    assert read("Epsi").understood == "E_ψ" and read("E psi").understood == "E_φ ψ"
