"""Theorems change what a plan costs, never its result: every value against dense NumPy, within the running bounds of `formulas`."""

import numpy as np
import pytest

import pycraft as pc
from support.formulas import Letters, letters_of
from support.mechanisms import LARGE_TREE, build, every_kind, random_tree
from support.oracle import reference
from support.random_formulas import draw, seeded


@pytest.mark.parametrize("seed", range(40))
def test_rules_never_change_a_result(seed):
    rng = np.random.default_rng(seed)
    model = random_tree(rng, int(rng.integers(1, 6)), kinds=["pin", "slider", "screw", "universal", "ball", "free", "planar", "weld"])
    letters = letters_of(model)
    domain, codomain = (str(s) for s in rng.choice(list("TVF"), 2))
    formula = draw(seeded(rng), letters, domain, codomain, 3)
    formula.assert_close(formula.op.dense(rules=True))
    formula.assert_close(formula.op.dense(rules=False))
    simple = formula.op.simplify()
    formula.assert_close(simple.dense(rules=False))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2000, 2400))
def test_rules_never_change_a_result_of_deep_expressions(seed):
    rng = np.random.default_rng(seed)
    model = random_tree(rng, int(rng.integers(1, 7)), kinds=["pin", "slider", "screw", "universal", "ball", "free", "planar", "weld"])
    letters = letters_of(model)
    domain, codomain = (str(s) for s in rng.choice(list("TVF"), 2))
    formula = draw(seeded(rng), letters, domain, codomain, 6)
    formula.assert_close(formula.op.dense(rules=True))
    formula.assert_close(formula.op.dense(rules=False))


def test_an_expression_too_long_to_expand_is_left_as_typed():
    """Words of products of sums outgrow any limit; the value must not."""
    model = pc.tree([-1, 0], "pin", seed=0, rotor_inertia=True)
    o = letters_of(model)
    middle = o.P_plus @ o.Omega @ o.M @ o.Omega @ o.P_plus
    formula = o.MM @ o.H @ middle @ o.H.T @ o.MM
    assert formula.op.simplify() != pc.zero(o.soa.Theta, o.soa.Theta)
    formula.assert_close(formula.op.dense())
    (o.D + formula).inv().assert_applies(np.random.default_rng(0))
    other = 2 * o.MM @ o.H @ middle @ o.H.T @ o.MM
    assert not pc._core.equal_by_theorems(formula.op, other.op)


def test_forests_and_single_bodies_have_plans_too():
    for parents, kinds in (([-1], ["ball"]), ([-1, -1, -1], ["pin", "free", "pin"]), ([-1, 0], ["weld", "pin"])):
        o = letters_of(pc.tree(parents, kinds, seed=3, welds="keep"))
        for formula in (o.MM.inv(), (o.MM + 0.1 * o.I).inv(), (o.phi + o.psi).inv(), (o.Omega + o.M.inv()).inv()):
            assert not formula.op.plan().has_dense_step
            formula.assert_applies(np.random.default_rng(0))


def test_operators_of_two_states_in_one_plan():
    model = build({**every_kind().description()}, 4)
    q0, q1 = model.random_state(1).q, model.random_state(2).q
    description = model.description()
    a, b = (Letters(At(model.soa, q), reference.operators(description, q)) for q in (q0, q1))
    mixed = (a.MM + b.MM).inv()
    assert not mixed.op.plan().has_dense_step and len(LARGE_TREE) == len(model.bodies)
    mixed.assert_applies(np.random.default_rng(0))
    (a.MM.inv() @ b.MM).assert_applies(np.random.default_rng(0))


class At:
    """An operator set whose letters are bound to a state."""

    def __init__(self, soa, q):
        self._soa, self._q = soa, q

    def __getattr__(self, name):
        made = getattr(self._soa, name)
        return made.at(self._q) if isinstance(made, pc.Operator) and name != "I" else made


@pytest.mark.parametrize("share", [2.0, 0.5, -1.0])
def test_a_multiple_of_the_rotors_is_that_multiple(share):
    """ℳ + J is one kernel; ℳ + cJ is not c = 1."""
    arm = pc.tree([-1, 0, 0], ["pin", "ball", "slider"], seed=2, rotor_inertia=True)
    H, phi, M, J = arm.soa("H phi M J")
    MM = H @ phi @ M @ phi.T @ H.T
    x = np.linspace(1, 2, arm.nv)
    expected = MM.dense() @ x + share * (J.dense() @ x)
    for op in (MM + share * J, share * J + MM, -(-share * J - MM)):
        assert np.abs(op @ x - expected).max() <= 1e-14 * np.abs(expected).max()
    assert np.abs((2 * MM + 2 * J) @ x - 2 * (MM + J).dense() @ x).max() <= 1e-13 * np.abs(expected).max()


def test_a_solve_that_is_refined_stays_a_solve():
    """ℳ⁻¹𝒥* is computed with ψ where nothing is refined; a correction needs the solve itself."""
    arm = pc.chain(4)
    arm.add_node("tool", "body3", position=(1, 0, 0))
    H, phi, M = arm.soa("H phi M")
    op = (H @ phi @ M @ phi.T @ H.T).inv() @ arm.soa.Jacobian(["tool"]).T
    solve = "[I-HψK]* D⁻¹ [I-HψK]"
    q = arm.random_state(1).q
    assert solve in str(op.at(q, refine=1).explain()) and solve not in str(op.at(q).explain())


def test_a_refined_product_without_a_solve_says_so():
    arm = pc.chain(3)
    arm.add_node("tip", list(arm.bodies)[-1], position=(1, 0, 0))
    H, phi, M = arm.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    note = "refinement: there is no solve here, so nothing is corrected"
    product = MM.inv() @ H @ phi @ arm.soa.B(["tip"])
    assert note in product.at(arm.q, refine=1).plan().notes and note not in product.at(arm.q).plan().notes
    assert f"by {note}" in str(product.at(arm.q, refine=1).plan())
    np.testing.assert_array_equal(product.at(arm.q, refine=1).dense(), product.at(arm.q).dense())  # and nothing is
    for solved in (MM.inv(), (MM + arm.soa.D).inv(), product.T, MM.inv() @ MM.inv()):
        assert note not in solved.at(arm.q, refine=1).plan().notes, solved.text()
    assert note in MM.at(arm.q, refine=1).plan().notes
