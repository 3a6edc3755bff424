"""The SymPy bridge: expressions there and back, what SymPy makes of them, LaTeX, and expressions from text."""

import pickle

import numpy as np
import pytest
import sympy

import pycraft as pc
from pycraft import _core
from pycraft.identities.parse import ParseError
from pycraft.sympy_bridge.sympy_bridge import from_sympy, parse, to_sympy
from support import spellings
from support.formulas import letters_of
from support.mechanisms import every_kind, random_tree
from support.random_formulas import draw, seeded

SEEDS = range(60)


@pytest.fixture(scope="module")
def arm():
    model = every_kind(rotor_inertia=True)
    return model


def there_and_back(e, operators):
    """The expression again, through SymPy."""
    made = from_sympy(to_sympy(e), operators)
    assert made == e, f"{e.text()} became {made.text()}"
    assert (made.domain, made.codomain) == (e.domain, e.codomain)
    return made


# ---------------------------------------------------------------------- round trips


@pytest.mark.parametrize("name", spellings.EVERYTHING)
def test_spellings_come_back(arm, name):
    letters = letters_of(arm)
    e = spellings.EVERYTHING[name](letters, spellings.Constants(letters)).op
    there_and_back(e, arm.soa)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_expressions_come_back(seed):
    rng = np.random.default_rng(seed)
    model = random_tree(rng, 4)
    letters = letters_of(model)
    domain, codomain = (str(x) for x in rng.choice(list("TVF"), 2))
    formula = draw(seeded(rng), letters, domain, codomain, 3)
    there_and_back(formula.op, model.soa)


@pytest.mark.parametrize("seed", SEEDS[:25])
@pytest.mark.parametrize("change", ["expand", "doit", "simplify"])
def test_what_sympy_makes_of_them_has_the_same_value(seed, change):
    rng = np.random.default_rng(1000 + seed)
    model = random_tree(rng, 3, kinds=["pin", "slider", "ball", "universal"])
    letters = letters_of(model)
    domain, codomain = (str(x) for x in rng.choice(list("TVF"), 2))
    formula = draw(seeded(rng), letters, domain, codomain, 2)
    changed = {"expand": sympy.expand, "doit": lambda e: e.doit(), "simplify": sympy.simplify}[change](to_sympy(formula.op))
    made = from_sympy(changed, model.soa, like=formula.op)
    assert (made.domain, made.codomain) == (formula.op.domain, formula.op.codomain)
    # Distributing may cancel: the rounding of the terms, each as large as the bound of the formula says, and their number
    size = 1 + np.abs(formula.value).max(initial=0)
    assert np.abs(made.dense() - formula.value).max(initial=0) <= 1e3 * formula.bound + 1e-9 * size


def test_expanding_distributes_and_keeps_the_order_of_factors(arm):
    H, phi, K, D, psi, I, E = arm.soa("H phi K D psi I E")
    A = I + H @ phi @ K
    expanded = from_sympy(sympy.expand(to_sympy(A @ D @ A.T)), arm.soa)
    terms = {t.text() for t in expanded.children}
    assert terms == {"D", "H φ K D", "D K* φ* H*", "H φ K D K* φ* H*"}
    assert from_sympy(sympy.expand(to_sympy(H @ (phi - psi) @ K)), arm.soa).kind == "sum"
    square = from_sympy((to_sympy(E) ** 2).doit(), arm.soa)
    assert square == E @ E
    assert from_sympy(to_sympy(phi).T.T, arm.soa) == phi
    assert from_sympy((to_sympy(phi) * to_sympy(psi)).T, arm.soa) == psi.T @ phi.T
    assert from_sympy((to_sympy(phi) * to_sympy(psi)).inverse().doit(), arm.soa) == psi.inv() @ phi.inv()


def test_zeros_and_identities_of_spaces_that_sympy_does_not_know(arm):
    phi, M = arm.soa("phi M")
    difference = to_sympy(phi) - to_sympy(phi)
    with pytest.raises(pc.EvaluationError, match="zero, and SymPy does not know its spaces"):
        from_sympy(difference, arm.soa)
    assert from_sympy(difference, arm.soa, like=M) == pc.zero(arm.soa.V, arm.soa.F)
    one = (to_sympy(phi) * to_sympy(phi).inverse()).doit()
    assert from_sympy(one, arm.soa).domain is None
    assert from_sympy(one, arm.soa, like=phi).domain == arm.soa.F
    assert from_sympy(to_sympy(phi) + difference, arm.soa) == phi
    assert from_sympy(to_sympy(phi) * difference, arm.soa, like=phi) == pc.zero(arm.soa.F, arm.soa.F)


def test_every_kind_of_expression(arm):
    soa = arm.soa
    H, phi, M, D, P, I = soa("H phi M D P I")
    C = pc.constant(np.eye(arm.nv), soa.Theta, soa.Theta, "C")
    T = pc.vector("T", soa.Theta)
    for e in (
        soa.B("node9"), soa.B(["node9", "node10"]).T @ soa.Omega, soa.Lambda("node9"), soa.Jacobian(["node10"]), soa.Delta(3),
        C, (C + D).inv() @ T, T, 0.1 * C - D / 3, pc.identity(soa.F), I, 3 * I, -(I + I), phi @ I @ phi, pc.zero(soa.F, soa.V),
        pc.blockdiag(phi @ M @ phi.T), M.sqrt() @ M.sqrt().T, phi.at(arm.q), P.diff(2), P.sqrt().diff(1), soa.b.diff(0),
        soa.H_dot.diff(1), M.diff(arm.bodies["body1"].symbol("mass")), (2 * phi) @ phi, 2 * (phi @ phi), phi**3, D.inv().T, D.T.inv(),
        soa.theta_dot, soa.velocity, soa.X_world,
    ):  # fmt: skip
        there_and_back(e, soa)
    scalars = (D.trace(), D.logdet(), M.norm(), D.trace() + 2 * D.logdet() - M.norm() + 3, 0.1 * D.trace(), -D.logdet())
    for s in scalars:
        assert from_sympy(to_sympy(s), soa) == s
        assert float(from_sympy(sympy.expand(3 * to_sympy(s)), soa)) == pytest.approx(3 * float(s))


def test_numbers_are_the_same_doubles(arm):
    rng = np.random.default_rng(0)
    for x in [*rng.normal(size=50), *rng.integers(1, 99, 20) / rng.integers(1, 99, 20), 0.1, 1e-300, 1e300, -1 / 3, 2.0**53 + 2]:
        made = there_and_back(float(x) * arm.soa.phi, arm.soa)
        assert made.coefficient == x
    assert to_sympy(0.5 * arm.soa.phi).args[0] == sympy.Rational(1, 2)


def test_letters_are_found_by_name_in_another_model():
    chain, tree = pc.chain(3), pc.tree([-1, 0, 0], "pin")
    H, phi, M = chain.soa("H phi M")
    made = from_sympy(to_sympy(H @ phi @ M @ phi.T @ H.T), tree)
    assert made == tree.soa.H @ tree.soa.phi @ tree.soa.M @ tree.soa.phi.T @ tree.soa.H.T
    assert from_sympy(to_sympy(chain.soa.Delta(1)), tree) == tree.soa.Delta(1)


def test_letters_are_ordinary_sympy_objects(arm):
    soa = arm.soa
    phi, psi, C = to_sympy(soa.phi), to_sympy(soa.psi), to_sympy(pc.constant(2 * np.eye(arm.nv), soa.Theta, soa.Theta, "C"))
    assert isinstance(phi, sympy.MatrixSymbol) and phi == to_sympy(soa.phi) and hash(phi) == hash(to_sympy(soa.phi))
    assert phi * psi != psi * phi and phi.func(*phi.args) == phi
    assert from_sympy((phi * psi).subs(psi, phi), soa) == soa.phi @ soa.phi
    assert from_sympy(C.func(*C.args), soa).dense().trace() == 2 * arm.nv
    assert pickle.loads(pickle.dumps(phi)) == phi
    t = sympy.Symbol("t")
    assert from_sympy(t * phi + psi, soa, values={t: 2.5}) == 2.5 * soa.phi + soa.psi
    with pytest.raises(pc.EvaluationError, match="t is not a real number: give values="):
        from_sympy(t * phi, soa)


def test_spaces_are_checked_on_the_way_back(arm):
    M, phi = to_sympy(arm.soa.M), to_sympy(arm.soa.phi)
    with pytest.raises(pc.SpaceError):
        from_sympy(phi * phi.T, arm.soa)  # one dimension, two spaces
    with pytest.raises(pc.SpaceError):
        from_sympy(to_sympy(arm.soa.H) * M * to_sympy(arm.soa.H), arm.soa)
    with pytest.raises(pc.EvaluationError, match="is not an operator expression"):
        from_sympy(sympy.MatrixSymbol("A", 2, 2), arm.soa)
    with pytest.raises(pc.EvaluationError, match="not a SymPy expression"):
        from_sympy("phi", arm.soa)
    with pytest.raises(TypeError, match="not float"):
        to_sympy(1.0)
    with pytest.raises(pc.ModelError, match="a model or an operator set"):
        from_sympy(phi, 3)


# ---------------------------------------------------------------------- printing


def test_latex_of_every_letter_is_that_of_the_notation(arm):
    for name, shown, latex in ((s.name, s.text, s.latex) for s in _core.symbols):
        letter = getattr(arm.soa, name)
        if name in ("B", "Jacobian", "Lambda"):
            letter, tail = letter("node9"), r"_{\mathrm{node9}}"
        elif name == "Delta":
            letter, tail = letter(1), rf"_{{\mathrm{{{arm.coordinate_names[1]}}}}}"
        else:
            tail = ""
        made = to_sympy(letter)
        assert sympy.latex(made).replace(r"\_", "_") == latex + tail
        assert sympy.pretty(made).startswith(shown) and str(made).startswith(name)


def test_latex_of_formulas(arm):
    H, phi, M, psi, K, D, I, P_plus = arm.soa("H phi M psi K D I P_plus")
    S = I - H @ psi @ K
    for e, latex in (
        (H @ phi @ M @ phi.T @ H.T, r"H \phi M {\phi}^{*} {H}^{*}"),
        (S.T @ D.inv() @ S, r"{\left(I - H \psi \mathcal{K}\right)}^{*} \mathcal{D}^{-1} \left(I - H \psi \mathcal{K}\right)"),
        (2 * phi - psi, r"2\,\phi - \psi"),
        (-(phi - psi), r"-\left(\phi - \psi\right)"),
        (P_plus.T, r"\left(P^{+}\right)^{*}"),
        (pc.blockdiag(phi @ M), r"\operatorname{blockdiag}\left(\phi M\right)"),
        (M.sqrt(), r"{M}^{1/2}"),
    ):
        assert sympy.latex(to_sympy(e)) == latex
    assert sympy.latex(to_sympy(D.logdet())) == r"\ln\det\left(\mathcal{D}\right)"
    assert sympy.latex(to_sympy(D.trace())) == r"\operatorname{tr}\left(\mathcal{D}\right)"
    assert str(to_sympy(S.T @ D.inv())) == "(I - (H*psi*K)).T*D**(-1)"


# ---------------------------------------------------------------------- from text


READ = [
    ("H @ phi @ M @ phi.T @ H.T", "H φ M φ* H*"),
    ("HφMφ*H*", "H φ M φ* H*"),
    (r"H\phi M\phi^*H^*", "H φ M φ* H*"),
    (r"[I - H\psi\mathcal{K}]^*\mathcal{D}^{-1}[I - H\psi\mathcal{K}]", "(I − H ψ K)* D⁻¹ (I − H ψ K)"),
    ("inv(MM + J)", "(H φ M φ* H* + J)⁻¹"),
    ("blockdiag(φMφ*)", "blockdiag(φ M φ*)"),
    ("Lambda(node9)", "Λ(node9)"),
]


@pytest.mark.parametrize("text, shown", READ)
def test_text_reads_as_an_expression(arm, text, shown):
    made = parse(text, arm)
    assert made.text() == shown and parse(text, arm.soa) == made


def test_text_with_names_scalars_and_refusals(arm):
    C = pc.constant(np.eye(arm.nv), arm.soa.Theta, arm.soa.Theta, "C")
    assert parse("inv(MM + C)", arm, C=C).children[0].children[-1] == C
    assert float(parse("logdet(D)", arm)) == float(arm.soa.D.logdet())
    with pytest.raises(ParseError, match="is an equation; parse takes one expression"):
        parse("phi == psi", arm)
    with pytest.raises(ParseError, match="Q is a letter of models with loops"):
        parse("Q @ phi", arm)
    with pytest.raises(pc.ModelError):
        parse("phi", None)


@pytest.mark.parametrize("seed", SEEDS[:30])
def test_sympys_latex_reads_back(seed):
    """LaTeX that SymPy prints is read by pycraft: the same value."""
    rng = np.random.default_rng(3000 + seed)
    model = random_tree(rng, 3, kinds=["pin", "slider", "ball"])
    letters = letters_of(model)
    domain, codomain = (str(x) for x in rng.choice(list("TVF"), 2))
    formula = draw(seeded(rng), letters, domain, codomain, 2)
    latex = sympy.latex(to_sympy(formula.op))
    if r"\frac" in latex:  # a number that the reader takes as a decimal only
        latex = (
            sympy.latex(to_sympy(formula.op))
            .replace(r"\frac{1}{2}", "0.5")
            .replace(r"\frac{3}{10}", "0.3")
            .replace(r"\frac{1}{100}", "0.01")
        )
    made = parse(latex, model)
    assert made.text() == formula.op.text() or np.abs(made.dense() - formula.value).max(initial=0) <= formula.bound
