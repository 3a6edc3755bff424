"""Formulas in lines: the same formula, in lines that fit, each with whole brackets, as MathJax and KaTeX take them."""

import re

import pytest

import pycraft as pc
from pycraft.operators.formula_html import formula_html
from pycraft.operators.latex_lines import LONGEST, WIDTH, aligned, formula_width, in_lines, lines_of
from pycraft.operators.latex_text import escaped
from pycraft.operators.shown_expression import expression_latex, flops_text, formula_latex, structure

ARM = pc.tree([-1, 0, 0, 1], ["pin", "ball", "free", "slider"], seed=3)
SOA = ARM.soa
H, PHI, M, PSI, K, D, P, I = SOA("H phi M psi K D P I")
LONG = H @ (PSI @ K @ D @ K.T @ PSI.T + P + PHI @ M @ PHI.T - PSI @ M @ PSI.T + PHI @ P @ PHI.T + 3 * PSI @ P @ PHI.T) @ H.T
FORMULAS = [
    *(t.latex for t in SOA.theorems()),
    (SOA.MM + LONG.inv()).inv().latex(),
    (LONG + SOA.MM.diff(1).diff(2)).latex(),
    SOA.MM.logdet().latex(),
    "-A - B + C = -D",
    r"\left\Vert x \right\Vert \le \left( a + b \right)' + \text{of a, b and c}, \quad c = \frac{a + b}{c}",
    "",
]


def flattened(latex):
    """Return the input of `in_lines`: without environments and line ends, and without spaces of all sorts."""
    bare = re.sub(r"\\begin\{aligned\}& |\\end\{aligned\}|\\\\\n& (?:\\quad )*(?:\{\})?", "", latex)
    return re.sub(r"\s|\\quad", "", bare)


def cells(latex):
    """The innermost lines, from inside out."""
    while found := re.search(r"\\begin\{aligned\}((?:(?!\\begin\{aligned\}|\\end\{aligned\}).)*)\\end\{aligned\}", latex, re.S):
        for line in found[1].split("\\\\\n"):
            yield line.removeprefix("& ")
        latex = latex[: found.start()] + "0" + latex[found.end() :]
    yield latex


@pytest.mark.parametrize("width", [WIDTH, 30, 8, 1])
def test_the_formula_is_the_same_and_its_brackets_are_whole(width):
    """\\left and \\right, braces, in one cell each: TeX knows no others."""
    broken = 0
    for latex in FORMULAS:
        shown = in_lines(latex, width)
        assert flattened(shown) == flattened(latex), latex
        broken += shown != latex
        for cell in cells(shown):
            assert cell.count("\\left") - cell.count("\\leq") == cell.count("\\right"), (latex, cell)
            assert cell.count("{") == cell.count("}"), (latex, cell)
    assert broken >= {WIDTH: 1, 30: 10, 8: len(FORMULAS) // 4, 1: len(FORMULAS) // 2}[width]


def test_lines_fit_and_begin_where_a_book_begins_them():
    for latex in FORMULAS:
        for line in lines_of(latex, 30):
            whole = not re.search(r"begin|[\]\)}].*[\[\({]", line)  # one factor can be wider than a line
            assert not whole or formula_width(line) <= 30 + 4 or "\\text" in line, line  # and what is set in, two \quad
    assert lines_of("AAAA + BBBB - CC = DDDD", 6) == ["AAAA ", "\\quad {}+ BBBB ", "\\quad {}- CC ", "{}= DDDD"]
    assert lines_of("A + B - CCCC", 9) == ["A + B ", "\\quad {}- CCCC"]  # as many terms as there is room for
    assert lines_of("-A = -B", 1) == ["-A ", "{}= -B"]  # a sign before a term is none between two
    assert in_lines("A = B + C") == "A = B + C" and in_lines("A = B", 2) == aligned(["A", "{}= B"])


def test_what_is_no_plain_formula_is_left_alone():
    for latex in ("\\begin{pmatrix}a + b\\end{pmatrix} = c", "x" * (LONGEST + 1)):
        assert in_lines(latex, 1) == latex


def test_widths():
    assert formula_width("H \\phi M") == 3 and formula_width("A^{2}") == pytest.approx(1 + 2 / 3)
    assert formula_width("A_{\\mathrm{ab}}") == pytest.approx(1 + 4 / 3) and formula_width("A + B") == 4


# ---------------------------------------------------------------------- expressions
def test_an_expression_shows_spaces_structure_and_cost():
    shown = SOA.MM._repr_latex_()
    assert shown.startswith("$\\displaystyle \\begin{aligned}& " + SOA.MM.latex()) and shown.endswith("\\end{aligned}$")
    for part in ("\\text{$\\Theta$}\\,(11)\\to \\text{$\\Theta$}\\,(11)", "\\text{symmetric, positive semidefinite}", "O(N)"):
        assert part in shown, part
    assert flops_text(SOA.MM.plan().flops) in shown
    assert "\\in \\text{V}\\,(24)" in SOA.velocity._repr_latex_() and "\\to" not in SOA.velocity._repr_latex_()
    assert I._repr_latex_() == "$\\displaystyle I$"  # of no space yet
    assert "O(N^3)" in pc.constant([[2.0, 1], [1, 3]], pc._core.euclidean(2), pc._core.euclidean(2), "C").inv()._repr_latex_()
    assert SOA.MM.logdet()._repr_latex_().startswith("$\\displaystyle \\ln\\det")
    assert formula_latex("A = B") == "$\\displaystyle A = B$" and "aligned" in LONG._repr_latex_()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("phi", ["upper triangular"]),
        ("D", ["block diagonal", "symmetric", "positive semidefinite"]),
        ("Omega", ["symmetric", "positive semidefinite"]),
        ("H", ["block diagonal"]),
        ("Delta_theta_dot", ["block diagonal"]),
        ("V_tilde", ["block diagonal"]),
    ],
)
def test_structure_of_letters(name, words):
    assert structure(getattr(SOA, name)) == words


def test_structure_is_true_and_goes_no_farther_than_that():
    """Every word against the dense form, and forms that look much alike."""
    import numpy as np

    semidefinite = [
        SOA.MM,
        SOA.MM.inv(),
        PSI @ M @ PSI.T,
        2 * P,
        H @ P @ H.T + D,
        pc.blockdiag(PHI @ M @ PHI.T),
        H @ P.sqrt() @ P.sqrt().T @ H.T,
    ]
    others = [SOA.MM - D, -1 * P, PHI @ M @ PSI.T, PHI @ M @ PHI.T - P, SOA.MM.diff(1), P.sqrt(), D.sqrt() + D.sqrt().T, PHI, H]
    for e in (*semidefinite, *others):
        words, A = structure(e), e.dense()
        assert ("positive semidefinite" in words) == any(e is x for x in semidefinite), e
        if "positive semidefinite" in words:  # to rounding of the largest
            assert np.linalg.eigvalsh((A + A.T) / 2).min() > -1e-12 * np.abs(A).max(), e
        if "symmetric" in words:
            assert np.abs(A - A.T).max() <= 1e-12 * np.abs(A).max(), e


def test_what_has_no_plan_shows_itself_without_a_cost():
    arm = pc.chain(2)
    e = arm.soa.MM
    arm.add_body("more", list(arm.bodies)[-1], "pin")
    assert "flop" not in e._repr_latex_() and e.latex() in e._repr_latex_()
    nothing = pc.Multibody("nothing").soa.MM
    assert nothing.latex() in expression_latex(nothing, nothing.latex())


def test_no_letter_is_left_in_text_that_latex_has_not():
    assert escaped("Θ φ ℳ⁻¹*") == "$\\Theta$ $\\phi$ $\\mathcal{M}$$^{-1}$$^*$".replace("$$", "")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("E_φ* R", "E<sub>φ</sub><sup>*</sup> R"),
        ("H_fψ_fP_f)H_p*", "H<sub>f</sub>ψ<sub>f</sub>P<sub>f</sub>)H<sub>p</sub><sup>*</sup>"),
        ("ℳ_ff⁻¹ D^-½*", "ℳ<sub>ff</sub>⁻¹ D<sup>-½</sup><sup>*</sup>"),
        ("phi_tilde + 0*D < f_ext", "phi_tilde + 0*D &lt; f_ext"),
        ("ψ̃*Υ", "ψ̃<sup>*</sup>Υ"),
    ],
)
def test_formulas_in_html(text, shown):
    assert formula_html(text).endswith(f">{shown}</span>")


def test_brackets_without_end_stay_as_they_are():
    deep = "\\left(" * 600 + "a + b" + "\\right)" * 600
    assert in_lines(deep) == deep
    S = pc.chain(2).soa
    x = S.MM
    for _ in range(250):
        x = (x + S.D).inv()
    assert "\\left" in x._repr_latex_()
