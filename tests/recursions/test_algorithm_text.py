"""algorithm() as text and LaTeX: it reads as the textbook recursion, and what the document shows is what is written."""

import re
from pathlib import Path

import pytest

import pycraft as pc
from support.mechanisms import every_kind
from support.spellings import EVERYTHING, letters_and_constants

# ---------------------------------------------------------------------- text and LaTeX


def equations(text):
    """The lines of a text that are equations or announce a pass, stripped."""
    return [line.strip() for line in text.splitlines() if " = " in line or line.startswith("for ")][1:]


def test_the_text_of_forward_dynamics_is_the_textbooks():
    soa = pc.robots.panda().soa
    H, phi, M = soa("H phi M")
    written = ((H @ phi @ M @ phi.T @ H.T).inv() @ pc.vector("T", soa.Theta)).algorithm()
    lines = [line for line in equations(str(written)) if not line.startswith("by ")]
    assert lines == [
        "for k from tip to base:",
        "P(k) = M(k) + Σ_c E(k,c) P⁺(c) E*(k,c)",
        "D(k) = H(k) P(k) H*(k)",
        "G(k) = P(k) H*(k) D⁻¹(k)",
        "P⁺(k) = P(k) - G(k) D(k) G*(k)",
        "z(k) = Σ_c E(k,c) z⁺(c)",
        "ε(k) = T(k) - H(k) z(k)",
        "ν(k) = D⁻¹(k) ε(k)",
        "z⁺(k) = z(k) + G(k) ε(k)",
        "for k from base to tip:",
        "α⁺(k) = E*(p,k) α(p)",
        "y(k) = ν(k) - G*(k) α⁺(k)",
        "α(k) = α⁺(k) + H*(k) y(k)",
    ]
    assert "cost: O(N)" in str(written) and "7 bodies" in str(written)
    assert "by inverse by the innovations factors" in str(written)


def test_the_text_of_the_mass_matrix_and_of_velocities():
    model = every_kind(True)
    soa = model.soa
    MM = soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T
    assert equations((MM + soa.J).algorithm().text) == [
        "for k from base to tip:",
        "α(k) = E*(p,k) α(p) + H*(k) x(k)",
        "for k from tip to base:",
        "f(k) = M(k) α(k) + Σ_c E(k,c) f(c)",
        "y(k) = H(k) f(k) + J(k) x(k)",
    ]
    assert equations(soa.b.algorithm().text)[1:4] == [
        "β(k) = H*(k) θ̇(k)",
        "V(k) = E*(p,k) V(p) + β(k)",
        "b(k) = crf(V(k)) M(k) V(k)",
    ]
    assert "R(k) = M(k) + Σ_c E(k,c) R(c) E*(k,c)" in soa.R.algorithm().text
    assert "Υ(k) = H*(k) D⁻¹(k) H(k) + τ̄*(k) E*(p,k) Υ(p) E(p,k) τ̄(k)" in soa.Upsilon.algorithm().text
    assert "for c = k and then its ancestors" in MM.algorithm(request="dense").text
    assert "cost: O(N · depth)" in MM.algorithm(request="dense").text


def test_the_text_of_a_realization_shows_its_equations_and_their_elimination():
    o, c = letters_and_constants(False)
    text = (o.MM + 0.1 * o.I).inv().op.algorithm().text
    for line in (
        "s(k) - E*(p,k) s(p) - H*(k) s₃(k) = b₁(k)",
        "A(k) = T(k,k) - Σ_c T(k,c) U(c)",
        "U(k) = A⁻¹(k) T(k,p)",
        "r(k) = b(k) - Σ_c T(k,c) A⁻¹(c) r(c)",
        "σ(k) = A⁻¹(k) r(k) - U(k) σ(p)",
    ):
        assert line in text
    bordered = (o.MM + o.J + c.border @ c.border.T + 0.1 * o.I).inv().op.algorithm().text
    assert "S₂ = T₂(b,b) - Σ_k Y₂(k) X₂(k)" in bordered and "s₃ - Σ_k U*(·,k) s₅(k) = b₃" in bordered  # U is the user's


def test_passes_that_go_one_way_are_one_pass():
    o, _ = letters_and_constants(False)
    for formula in (o.MM.inv(), o.phi @ o.phi @ o.M @ o.P.inv() @ o.psi):
        heads = [line for line in str(formula.op.algorithm()).splitlines() if line.startswith("for ")]
        assert len(heads) <= 2 and all(a != b for a, b in zip(heads, heads[1:], strict=False))


@pytest.mark.parametrize("name", EVERYTHING)
def test_latex_is_balanced(name):
    op = EVERYTHING[name](*letters_and_constants(True)).op
    latex = op.algorithm("latex")
    text = str(latex)
    assert text.startswith("\\begin{aligned}") and text.endswith("\\end{aligned}") and latex._repr_latex_().startswith("$")
    assert text.count("{") == text.count("}") and text.count("\\left") == text.count("\\right")
    assert not re.search(r"[^\x00-\x7f]", text.replace("ℳ", "")), "letters are written as LaTeX"
    assert not re.search(r"\^\{[^{}]*\}\^", text), "no double superscript"
    assert op.algorithm("python")._repr_latex_() is None


def test_what_is_refused():
    soa = pc.chain(2).soa
    with pytest.raises(pc.EvaluationError, match="'fortran'.*text, latex, python, cpp"):
        soa.phi.algorithm("fortran")
    with pytest.raises(pc.EvaluationError, match="no plan is made for 'eigenvalues'"):
        soa.phi.algorithm(request="eigenvalues")
    with pytest.raises(pc.SpaceError):
        soa.I.algorithm()
    with pytest.raises(pc.EvaluationError, match="'forward dynamics'"):
        soa.phi.algorithm().python(name="forward dynamics")


# ---------------------------------------------------------------------- the document


def test_the_document_shows_what_is_written():
    """The outputs in docs/algorithm.md match the package."""
    text = (Path(__file__).parents[2] / "docs" / "algorithm.md").read_text(encoding="utf-8")
    code, *shown = (block.removeprefix("python\n") for block in re.findall(r"```(.*?)```", text, re.S)[:3])
    names = {}
    exec(code, names)
    for name, block in zip(("MM", "inverse"), shown, strict=True):
        assert names[name].algorithm().text.strip() == block.strip()
