"""Nothing falls to dense (ruling 23): every spelling of `spellings` has a plan without a dense step, whose value is that of dense
NumPy, and whose flops and memory grow with the number of bodies.

Values are compared within the running bounds of `formulas`.
"""

import numpy as np
import pytest

import pycraft as pc
from support.formulas import letters_of
from support.spellings import EVERYTHING, INVERSE, MASS_MATRIX, Constants, letters_and_constants, spd

rotors = pytest.mark.parametrize("rotor_inertia", [False, True], ids=["no rotors", "rotors"])


def without_J(name, rotor_inertia):
    """Spellings of ℳ itself where the oracle's ℳ + J is meant only if there are no rotors."""
    return rotor_inertia and name == "inverted twice"


def test_the_list_is_long_enough():
    assert len(EVERYTHING) >= 40


@rotors
@pytest.mark.parametrize("name", EVERYTHING)
def test_no_dense_step_and_the_value_of_the_dense_formula(name, rotor_inertia):
    formula = EVERYTHING[name](*letters_and_constants(rotor_inertia))
    op, rng = formula.op, np.random.default_rng(0)
    square = op.domain == op.codomain or op.domain == op.codomain.dual
    requests = ["apply", "dense"]
    if square:
        requests += ["trace", "diagonal"]
        if np.linalg.cond(formula.value) < 1e12:
            requests.append("logdet")
    for request in requests:
        plan = op.plan(request)
        assert not plan.has_dense_step, f"{request}: {plan}"
        assert all(step["tier"] != "dense" for step in plan.steps)
    formula.assert_applies(rng)
    formula.assert_close(op.dense())
    formula.assert_close(op.dense(rules=False))
    assert op.plan().passes.dense == 0 and op.plan().run_notes == [], op.plan()
    if square:
        formula.assert_close(op.diagonal(), np.diag(formula.value))
        formula.assert_close(float(op.trace()), np.trace(formula.value), len(formula.value))
        if "logdet" in requests:
            formula.assert_logdet()


@pytest.mark.parametrize("name", ["2 X", "X / 4", "-X", "X @ Y", "(2 X)⁻¹", "X @ Y⁻¹", "M X", "2 S X"])
def test_logdet_of_multiples_and_products_without_a_theorem(name):
    o, c = letters_and_constants(True)
    X, Y = o.MM + c.damping, o.MM + 0.1 * o.I
    formula = {
        "2 X": lambda: 2 * X,
        "X / 4": lambda: X / 4,
        "-X": lambda: -X,
        "X @ Y": lambda: X @ Y,
        "(2 X)⁻¹": lambda: (2 * X).inv(),
        "X @ Y⁻¹": lambda: X @ Y.inv(),
        "M X": lambda: (o.phi @ o.M @ o.phi.T + o.M) @ o.P.inv(),
        "2 S X": lambda: c.damping @ (2 * Y),
    }[name]()
    formula.assert_logdet()


# ---------------------------------------------------------------------- recognised forms


@pytest.mark.parametrize("name", MASS_MATRIX)
@rotors
def test_the_mass_matrix_is_recognised_in_every_spelling(name, rotor_inertia):
    o, _ = letters_and_constants(rotor_inertia)
    op = MASS_MATRIX[name](o).op
    op @ np.ones(op.shape[1])
    plan = op.plan()
    tiers = [step["tier"] for step in plan.steps]
    assert "kernel" in tiers and set(tiers) <= {"values", "kernel", "sweep"}, plan
    passes = plan.passes
    assert passes.kernels == 1 and passes.gathers == passes.scatters == passes.eliminations == passes.dense == 0, (plan, passes)
    assert sum(tier == "sweep" for tier in tiers) <= 1  # at most the scaling


@pytest.mark.parametrize("name", [name for name in INVERSE if name != "by hand, distributed"])  # that one is left to the sweeps
@rotors
def test_its_inverse_is_recognised_in_every_spelling(name, rotor_inertia):
    o, _ = letters_and_constants(rotor_inertia)
    op = INVERSE[name](o).op
    op @ np.ones(op.shape[1])
    plan = op.plan()
    passes = plan.passes
    assert passes.kernels == 1 and passes.gathers == passes.scatters == passes.eliminations == passes.dense == 0, (plan, passes)


def test_notes_name_the_theorems():
    o, _ = letters_and_constants(False)
    names = [theorem.name for theorem in o.soa.theorems()]
    for formula in (o.MM.inv(), (o.MM + o.J).inv(), (o.I + o.H @ o.phi @ o.K).inv(), (o.I - o.E_psi).inv()):
        notes = formula.op.plan().notes
        assert any(note.startswith(name + ":") for note in notes for name in names), notes
        assert all(note in " ".join(str(formula.op.explain()).split()) for note in notes)
        assert formula.op.plan(rules=False).notes == []


def test_other_plans_use_what_is_cheap():
    o, _ = letters_and_constants(False)
    MM, D = o.MM.op, o.D.op
    assert [s["tier"] for s in D.logdet().operands()[0].plan("logdet").steps] == ["values", "values", "sweep"]
    for op, request in ((MM, "diagonal"), (MM, "trace"), (o.Omega.op, "diagonal"), ((o.phi @ o.M @ o.phi.T).op, "blockdiag")):
        plan = op.plan(request)
        assert all(s["tier"] in ("values", "sweep") for s in plan.steps), plan  # a Lyapunov sweep, no elimination
    assert any(s["tier"] == "kernel" and "composite-body assembly" in s["text"] for s in MM.plan("dense").steps)


def test_counters_come_from_the_executed_plan():
    o, c = letters_and_constants(False)
    op = (o.H @ o.phi @ c.loads @ o.psi.T @ c.loads.inv() @ o.psi).op
    op @ np.ones(op.shape[1])
    passes = op.plan().passes
    assert (passes.gathers, passes.scatters, passes.kernels, passes.eliminations, passes.dense) == (2, 1, 0, 0, 0)
    shifted = (o.MM + 0.123 * o.I).inv().op
    assert shifted.plan().passes.eliminations == 0  # nothing ran yet
    shifted @ np.ones(shifted.shape[1])
    assert shifted.plan().passes.eliminations >= 1


# ---------------------------------------------------------------------- growth


GROWTH = {name: f for name, f in EVERYTHING.items() if name not in ("(ℳ+𝒥*𝒥)⁻¹",)}


@pytest.fixture(scope="module")
def chains():
    """Uniform chains with rotors and two nodes near the tip, and their letters without values."""
    made = {}
    for n in (50, 500, 5000):
        arm = pc.chain(n)
        for k in range(n):
            arm.hinges[f"hinge{k}"].rotor_inertia = 0.1
        arm.add_node("node9", f"body{n - 1}", position=(1, 0, 0))
        arm.add_node("node10", f"body{n // 2}", position=(0.5, 0, 0))
        made[n] = Bare(arm.soa), arm
    return made


class Bare:
    """Letters as expressions alone: plans need no values."""

    def __init__(self, soa):
        self.soa = soa

    def __getattr__(self, name):
        if name == "I":
            return Expression(self.soa.I)
        if name == "MM":
            return self.H @ self.phi @ self.M @ self.phi.T @ self.H.T
        made = getattr(self.soa, name)
        return (lambda nodes: Expression(made(nodes))) if name in ("B", "Jacobian", "Lambda") else Expression(made)

    def constant(self, array, domain, codomain, name="C"):
        return Expression(pc.constant(array, domain, codomain, name))


class Expression:
    """An operator with the verbs of a `Formula`."""

    def __init__(self, op):
        self.op = op

    def __getattr__(self, name):
        if name == "T":
            return Expression(self.op.T)
        if name == "blockdiag":
            return lambda: Expression(pc.blockdiag(self.op))
        return lambda: Expression(getattr(self.op, name)())

    def _binary(name):
        return lambda self, other: Expression(getattr(self.op, name)(getattr(other, "op", other)))

    for verb in ("__matmul__", "__mul__", "__rmul__", "__add__", "__sub__", "__truediv__", "__pow__"):
        locals()[verb] = _binary(verb)
    __neg__ = lambda self: Expression(-self.op)


def bare_constants(o, n):
    """The constants of `Constants` on a chain, without a full matrix."""
    rng, soa, c = np.random.default_rng(0), o.soa, Constants.__new__(Constants)
    c.damping = o.constant(rng.uniform(0.1, 1, n), soa.Theta, soa.Theta)
    c.border = o.constant(rng.normal(size=(n, 2)), 2, soa.Theta, "U")
    c.small = o.constant(np.eye(2), 2, 2, "S")
    c.loads = o.constant([spd(rng, 6)] * n, soa.V, soa.F, "W")
    return c


@pytest.mark.parametrize("name", GROWTH)
def test_steps_are_constant_and_cost_grows_as_the_bodies(name, chains):
    """Flops and memory are sums over bodies: from one chain to the next they grow by the same amount a body, to a percent."""
    plans = {n: GROWTH[name](o, bare_constants(o, n)).op.plan() for n, (o, _) in chains.items()}
    small, middle, large = (plans[n] for n in sorted(plans))
    for plan in (middle, large):
        assert [s["tier"] for s in plan.steps] == [s["tier"] for s in small.steps]
    for measure in ("flops", "memory"):
        first = (getattr(middle, measure) - getattr(small, measure)) / 450
        second = (getattr(large, measure) - getattr(middle, measure)) / 4500
        assert abs(second / first - 1) <= 0.01, f"{measure} a body: {first:.1f}, then {second:.1f}\n{large}"
        assert getattr(large, measure) / getattr(small, measure) <= 105


@pytest.mark.slow
@pytest.mark.parametrize("name", ["shifted", "rank two"])
def test_a_stretched_chain_of_thousands_is_solved(name, chains):
    """Pivots of the states' own equations: in double precision, body by body, as good as the elimination in quad precision."""
    o, arm = chains[5000]
    arm.q = np.full(5000, 0.01)
    op = GROWTH[name](o, bare_constants(o, 5000)).op
    x = np.ones(op.shape[1])
    y, exact = op @ x, op.at(arm.q, precision="quad") @ x
    assert np.linalg.norm(y - exact) <= 5000 * np.finfo(float).eps * np.linalg.norm(exact)
    assert op.plan().run_notes == [], op.plan()


@pytest.mark.slow
def test_nested_shifts_of_thousands_are_solved_in_quad(chains):
    """(X⁻¹ + Y⁻¹)⁻¹ of two shifted ℳ ties two chains to each other, joint by joint.

    What is carried from body to body is the inertia of each chain alone, N³ for N stretched rods, and a joint feels their difference,
    what is left where both give way: body by body a double keeps no digit of it, quad loses as many and has them. Both runs report it.
    """
    o, arm = chains[5000]
    arm.q = np.full(5000, 0.01)
    op = GROWTH["nested shifts"](o, bare_constants(o, 5000)).op
    x = np.ones(op.shape[1])
    y, wide = op @ x, op.at(arm.q, precision="quad")
    exact = wide @ x
    assert np.linalg.norm(y - exact) <= 5000 * np.finfo(float).eps * np.linalg.norm(exact)
    assert [note.split(":")[0] for note in op.plan().run_notes] == ["quad"], op.plan().run_notes
    assert [note.split(":")[0] for note in wide.plan().run_notes] == ["digits"], wide.plan().run_notes


# ---------------------------------------------------------------------- what does go dense, and is reported


def test_a_full_constant_goes_dense_and_says_why():
    o, c = letters_and_constants(False)
    formula = (o.MM + c.full()).inv()
    formula.op @ np.ones(formula.op.shape[1])
    assert formula.op.plan().passes.dense == 1
    for request in ("apply", "logdet", "diagonal", "trace"):
        plan = formula.op.plan(request)
        assert plan.has_dense_step and any(note.startswith("dense: ") and "full" in note for note in plan.notes), plan
        assert "full" in formula.op.explain(request) and "dense" in formula.op.explain(request)
    formula.assert_applies(np.random.default_rng(0))
    formula.assert_reductions()
    product = o.MM @ c.full() @ o.MM  # no inverse of it: applied, not factored
    assert not any("factored" in s["text"] for s in product.op.plan().steps)
    product.assert_applies(np.random.default_rng(1))


def zero_diagonal(model):
    """N + N*, N = HE_φG: each hinge couples to its parent's and not to itself, so the tip's pivot block is zero."""
    o = letters_of(model)
    N = o.H @ o.E @ o.G
    return N + N.T


@pytest.mark.parametrize("bodies", [2, 6])
def test_a_singular_pivot_block_is_reported(bodies):
    model = pc.tree(list(range(-1, bodies - 1)), "pin", seed=5)
    model.q = model.random_state(1).q
    formula = zero_diagonal(model)
    inverse = formula.inv()
    inverse.assert_applies(np.random.default_rng(0))
    inverse.assert_close(inverse.op.dense())
    plan = inverse.op.plan()
    if plan.passes.dense:  # a second order of elimination is as good an answer
        assert plan.run_notes and any("pivot" in note for note in plan.run_notes), plan
        assert "in the last run" in str(plan) and "pivot" in str(inverse.op.explain())
    assert abs(float(formula.op.logdet()) - np.linalg.slogdet(formula.value)[1]) <= 1e-9 * np.linalg.cond(formula.value)


def test_a_singular_operator_is_an_error_that_names_a_body():
    model = pc.tree([-1, 0, 1], "pin", seed=5)  # an odd number of hinges: N + N* is singular
    inverse = zero_diagonal(model).op.inv()
    with pytest.raises(pc.SingularOperatorError, match="body|hinge|pivot"):
        inverse @ np.ones(3)
    with pytest.raises(ArithmeticError):
        inverse.dense()
    with pytest.raises(pc.SingularOperatorError):
        (model.soa.M - model.soa.M).inv() @ np.ones(18)


def test_explain_is_a_table():
    o, _ = letters_and_constants(False)
    op = (o.MM + 0.1 * o.I).inv().op
    text = str(op.explain())
    plan = op.plan()
    assert text.splitlines()[0] == op.text() and all(s["text"][:30] in text for s in plan.steps) and "total" in text
    assert plan.flops == sum(s["flops"] for s in plan.steps) and plan.memory == sum(s["memory"] for s in plan.steps)
    assert repr(op.explain()) == text
