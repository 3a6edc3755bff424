"""The judge of statements: what is not decided is not true, what does not fall with epsilon is false, bounds hold, nothing is blind."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy.hard_cases.stability_table import Stability
from pycraft.identities.judge import FAILS, HOLDS, UNDECIDED, BoundState, Judgement, Scales, Taken, Verdict, decided, judge, ladder
from pycraft.identities.report import PASSED, CheckReport, Finding, Report
from pycraft.identities.residual_bounds import Sizes
from pycraft.peers.compare import ModelComparison, _relative

EPSILON = pc._core.epsilons()


def graded(bodies=10, ratio=1e-3):
    """A chain of pins whose masses fall by `ratio` a link: double has no digit of ℳ⁻¹."""
    arm = pc.Multibody("graded")
    for k in range(bodies):
        mass = ratio**k
        arm.add_body(
            f"link{k}", f"link{k - 1}" if k else None, axis=(0, 0, 1), position=(1, 0, 0) if k else (0, 0, 0), mass=mass,
            com=(0.5, 0, 0), inertia=mass * np.diag([0.01, 0.1, 0.1]),
        )  # fmt: skip
    return arm


def heavy_tip(bodies=10, tip=1e15):
    arm = graded(bodies, 1.0)
    arm.bodies[f"link{bodies - 1}"].mass = tip
    return arm


def water(scale=1.0):
    """A water molecule in SI: masses of 1e-26 kg, lengths of 1e-10 m."""
    molecule = pc.Multibody("water")
    u, bond = 1.66e-27 * scale, 9.57e-11
    ball = 0.4 * 16 * u * (0.6e-10) ** 2 * np.eye(3)
    molecule.add_body("O", None, "free", mass=16 * u, inertia=ball)
    for k, angle in enumerate((0.0, np.radians(104.5))):
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        molecule.add_body(
            f"H{k}", "O", axis=(0, 0, 1), rotation=turn, mass=u, com=(bond, 0, 0), inertia=0.4 * u * (0.3e-10) ** 2 * np.eye(3)
        )
    return molecule


# ---------------------------------------------------------------------- the rule


def at(*residuals, bounds=None):
    """Residuals in double, extended, quad, ... with bounds of 100 epsilons, or these."""
    names = ladder()
    bounds = bounds or [100 * EPSILON[n] for n in names]
    return [Taken(n, r, b) for n, r, b in zip(names, residuals, bounds, strict=False)]


RULES = [
    (at(1e-16, 5e-20), HOLDS),
    (at(0.0, 0.0), HOLDS),
    (at(0.0, 5e-20), HOLDS),
    (at(1e-16,), UNDECIDED),  # one scalar shows no fall
    (at(1e-13, 1e-13), UNDECIDED),  # it has not fallen; one more is asked
    (at(1e-13, 1e-13, 1e-13), FAILS),
    (at(2.2e-16, 2.2e-16, 2.2e-16), FAILS),
    (at(0.0, 1e-18, 1e-18, 1e-18), FAILS),  # lucky in double
    (at(1e-9, 1e-12, 1e-12, 1e-12), FAILS),  # rounding hid it in double
    (at(0.33, 0.33, bounds=[1e9, 1e6]), UNDECIDED),  # a bound that explains everything
    (at(0.33, 0.33, 0.33, bounds=[1e9, 1e6, 1e-9]), FAILS),
    (at(1e-16, 5e-20, bounds=[1e9, 1e6]), UNDECIDED),  # below a bound that decides nothing
    (at(1e-16, 5e-20, bounds=[1e-8, 5e-12]), UNDECIDED),
    (at(1e-9, 5e-13, 1e-27, bounds=[1e-12, 1e-15, 1e-30]), HOLDS),  # falls twice: the bound was too small
    (at(1e-9, 5e-13, bounds=[1e-12, 1e-15]), UNDECIDED),
    (at(1e-9, 5e-13, 1e-27, bounds=[1e9] * 3), UNDECIDED),
    (at(0.0, 5e-10, 1e-24, 0.0, 3e-91, bounds=[1e9] * 5), HOLDS),  # two of them zero by luck
    (at(1e-16, 1e-12, 1e-12, 1e-12), FAILS),
    (at(1e-9, 5e-13, 1e-27, 1e-44, bounds=[1e9] * 4), HOLDS),  # three falls running are a bound themselves
    (at(1e-3, 1e-4, 1e-5), UNDECIDED),  # it falls, and not with epsilon
    (at(1e-12, 1e-13, bounds=[1e-11, 1e-12]), UNDECIDED),
    (at(np.nan, np.nan, np.nan), UNDECIDED),
    (at(np.inf, 1e-3, 1e-3, 1e-3), FAILS),
]  # fmt: skip


@pytest.mark.parametrize(("taken", "verdict"), RULES)
def test_rules(taken, verdict):
    assert decided(taken) == verdict


def test_what_a_sweep_amplifies_is_no_rise():
    """Zero in double by luck, or nearly: the rounding of extended, amplified by a million, is above it and falls all the same."""
    assert decided(at(1e-16, 1e-13, bounds=[1e-9, 1e-12])) == UNDECIDED
    assert decided(at(1e-16, 1e-13, bounds=[1e-9, 1e-12]), 1e6) == HOLDS


class NormsOf:
    """Roundings whose double has no digit: a bound of 1 there, of 1e3 epsilons in wider scalars."""

    size, terms, growth, counted = 1.0, 0.0, 1.0, False

    def __init__(self, lhs, rhs, precision):
        self.made_in = precision

    def bound(self, relative_size, precision):
        return 1.0 if self.made_in == "double" else 1e3 * EPSILON[precision]


def test_norms_of_double_are_taken_where_rounding_leaves_them_digits(monkeypatch):
    """Where it leaves none, the bound in quad is that of norms in quad, and 1e-9 is no rounding there."""

    class At:
        def sizes(self, precision, values):
            return precision

    monkeypatch.setattr("pycraft.identities.judge.Roundings", NormsOf)
    scales = Scales(1.0, 1.0, At(), {})
    for precision in ("double", "extended"):
        (*_, taken), _, _ = scales.taken(precision, (1e-9, 1.0, 1.0))
        assert taken.bound == 1.0
    (*_, taken), _, _ = scales.taken("quad", (1e-9, 1.0, 1.0))
    assert taken.bound == 1e3 * EPSILON["quad"] < taken.residual
    good = {"double": 1e3 * EPSILON["quad"], "quad": 1.0}
    monkeypatch.setattr(NormsOf, "bound", lambda self, relative_size, precision: good[self.made_in])
    (*_, taken), _, _ = Scales(1.0, 1.0, At(), {}).taken("quad", (1e-9, 1.0, 1.0))
    assert taken.bound == 1e3 * EPSILON["quad"]  # those of double, which cost least


def test_a_product_rounds_at_every_factor():
    """m times the worst of ‖F₁…Fᵢ₋₁‖ ‖Fᵢ‖ ‖Fᵢ₊₁…Fₘ‖: each of the m steps rounds."""
    arm = pc.chain(4)
    E, M = arm.soa("E M")
    factors = [E, E, M, E.T]
    values = [F.dense() for F in factors]
    before, after = [np.eye(len(arm.soa.F))], [np.eye(len(arm.soa.F))]
    for F, last in zip(values, reversed(values), strict=True):
        before.append(before[-1] @ F)
        after.append(last @ after[-1])
    norm = np.linalg.norm
    steps = [(norm(before[i]) if i else 1) * norm(F) * (norm(after[3 - i]) if i < 3 else 1) for i, F in enumerate(values)]
    np.testing.assert_allclose(Sizes(lambda e: e).size(E @ E @ M @ E.T), 4 * max(steps), rtol=1e-12)


def test_norms_follow_the_vectors():
    model = pc.chain(2)
    x = pc.vector("x", model.soa.Theta)
    sizes = Sizes(lambda e: e)
    found = []
    for factor in (1.0, 8.0):
        sizes.give({"x": [3.0 * factor, 4.0 * factor]})
        found.append(sizes.norm(x))
    assert found == [5.0, 40.0]


def test_theorems_are_judged_at_the_present_state_and_at_those_drawn(monkeypatch):
    some = pc.OperatorSet.theorems
    monkeypatch.setattr(pc.OperatorSet, "theorems", lambda self: some(self)[:12])
    model = pc.chain(2)
    judged = [f.states for f in model.soa.check(states=2).findings if f.states]
    assert judged and set(judged) == {3}
    assert {f.states for f in model.soa.check(states=0).findings if f.states} == {1}


def test_random_trees_follow_their_seed():
    worst = {seed: pc.check("HψMψ*H* == D", search=False, seed=seed).worst for seed in (0, 1)}
    assert worst[0] != worst[1] and worst[0] == pc.check("HψMψ*H* == D", search=False).worst


def test_in_the_widest_scalar_no_bound_makes_it_true():
    """A residual that does not fall fails whatever the bound, when there is no scalar left that could tell."""
    stays = at(*[0.33] * 5, bounds=[1e300] * 5)
    assert decided(stays) == UNDECIDED and decided(stays, last=True) == FAILS
    assert decided(at(*[0.33] * 2, bounds=[1e300] * 2), last=True) == FAILS
    assert decided(at(1e-3, 1e-6, 1e-21, bounds=[1e9] * 3), last=True) == UNDECIDED  # it falls, below a bound that says nothing
    assert decided(at(1e-1, 1e-3, 1e-5, bounds=[1e9] * 3), last=True) == UNDECIDED


def test_no_verdict_holds_with_a_bound_that_decides_nothing():
    rng = np.random.default_rng(0)
    for _ in range(500):
        residuals, bounds = (10.0 ** rng.uniform(-40, 2, 5) for _ in range(2))
        for n in range(2, 6):
            taken = at(*residuals[:n], bounds=list(bounds[:n]))
            if decided(taken) == HOLDS:
                assert taken[-1].residual <= 1e-12 and (taken[-1].bound <= 1e-12 or n > 3)


def test_one_state_that_fails_fails_the_statement():
    """Verdicts are taken state by state: a residual that stays at one state does not hide behind a larger one that falls at another."""
    arm = pc.tree([-1, 0, 0], ["pin", "ball", "pin"], seed=1)
    (phi,) = (arm.soa.phi,)
    states = [BoundState(arm.soa, arm.random_state(k)) for k in range(2)]
    whole = Verdict([judge(phi, phi, states[0]), judge(phi, (1 + 1e-12) * phi, states[1])])
    assert [j.verdict for j in whole.judgements] == [HOLDS, FAILS] and whole.verdict == FAILS
    assert whole.shown is whole.judgements[1]
    whole.judgements[1].verdict = UNDECIDED
    assert whole.verdict == UNDECIDED


# ---------------------------------------------------------------------- undecided is not true


def test_a_verdict_that_is_not_there_raises():
    report = CheckReport("a = b", UNDECIDED, 0.33, 1e9, 20, ["graded"], 100, 0.3, 1.0)
    with pytest.raises(pc.UndecidedError, match="a = b is undecided: in 100 digits the residual is 3.0e-01"):
        bool(report)
    assert not report.held and report.undecided and "UNDECIDED" in repr(report)
    assert issubclass(pc.UndecidedError, pc.Error)


def test_reports_pass_nothing_that_fails_or_is_undecided():
    verdicts = ["holds", "fails", "undecided", "expected to fail", "holds anyway", "waiting", "undefined"]
    assert set(PASSED) == set(verdicts) - {"fails", "undecided", "undefined"}
    for n in (1, 2):
        for chosen in itertools.product(verdicts, repeat=n):
            report = Report("arm", {}, [Finding(str(i), "g", "a = b", "a = b", [], [], v) for i, v in enumerate(chosen)])
            if "fails" in chosen:
                assert not report and report.status == 1 and len(report.failed) == chosen.count("fails")
            elif "undecided" in chosen:
                assert report.status == 3
                with pytest.raises(pc.UndecidedError):
                    bool(report)
            elif "undefined" in chosen or "holds" not in chosen:  # something was not shown, or nothing was
                assert not report and report.status == 3 and len(report.undefined) == chosen.count("undefined")
            else:
                assert report and report.status == 0
            assert not any(report.findings[i].passed for i, v in enumerate(chosen) if v in ("fails", "undecided", "undefined"))


def test_nothing_shown_is_not_true():
    assert not Report("arm", {}) and Report("arm", {}).status == 3
    assert Verdict().verdict == UNDECIDED
    with pytest.raises(pc.EvaluationError, match="at least one state"):
        pc.check("D = D", pc.chain(2), states=0)
    assert not ModelComparison("a", "b", 0) and not Stability([], {})
    arms = pc.chain(2), pc.chain(2)
    assert pc.compare(*arms, states=1) and not pc.compare(*arms, states=0)
    assert _relative(np.array([np.nan]), np.array([1.0])) == np.inf


def test_a_false_statement_on_a_graded_chain_fails():
    """Double has no digit of ℳ⁻¹ there, and the bound explains any residual."""
    arm = graded()
    statement = "MM.inv() == 1.5*(I-H@psi@K).T@D.inv()@(I-H@psi@K)"
    false = pc.check(statement, arm, states=2, search=False)
    assert false.verdict == FAILS and false.residual == pytest.approx(1 / 3, rel=1e-2)
    true = pc.check(statement.replace("1.5*", ""), arm, states=2)
    assert true and true.residual <= 1e-12 and true.residual_bound <= 1e-12 and true.precision in ("quad", 50, 100)


@pytest.mark.parametrize("make", [graded, heavy_tip], ids=lambda f: f.__name__)
def test_hard_models_are_decided(make):
    model = make()
    for text in ("MM.inv() == (I-H@psi@K).T@D.inv()@(I-H@psi@K)", "ψ⁻¹ = φ⁻¹ + KH", "HψMψ*H* = D", "logdet(MM) == logdet(D)"):
        assert pc.check(text, model, states=2), text
        lhs, rhs = text.split("=", 1)
        off = pc.check(f"{lhs.rstrip()} = 1.000000001*({rhs.strip('= ')})", model, states=2, search=False)
        assert off.verdict == FAILS, text


# ---------------------------------------------------------------------- bounds


def far(distance):
    """An arm whose base is far from the origin: in world axes P has entries m r², D has not."""
    arm = pc.Multibody("far")
    arm.add_body("a", position=(distance, 0, 0), axis=(0, 0, 1), mass=1.0, com=(0.3, 0, 0), inertia=0.1 * np.eye(3))
    arm.add_body("b", "a", axis=(0, 1, 0), position=(1, 0, 0), mass=1.0, com=(0.3, 0.1, 0), inertia=0.1 * np.eye(3))
    return arm


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["far", "water", "heavy tip"])
def test_derived_bounds_hold(name, every, monkeypatch):
    """In double and in the scalar that decided: a true theorem's residual is below the bound. Every day every third of them."""
    theorems = pc.OperatorSet.theorems
    monkeypatch.setattr(pc.OperatorSet, "theorems", lambda self: theorems(self)[::every])
    model = {"far": lambda: far(1e4), "water": water, "heavy tip": lambda: heavy_tip(5, 1e6)}[name]()
    report = model.soa.check(states=1)
    assert report, report.failed
    for f in report.findings:
        if f.verdict == HOLDS:
            assert f.residual <= f.bound and f.wide_residual <= f.wide_bound <= 1e-12, (f.name, f.residual, f.bound)


# ---------------------------------------------------------------------- numbers


def test_numbers_are_judged_against_their_terms():
    """∂ ln det of a light model is 1e-9 and less: judged against one, any error in it is rounding."""
    arm = pc.tree([-1, 0, 1], "pin", seed=3)
    H, phi, M, D, J = arm.soa("H phi M D J")
    slope = (H @ phi @ M @ phi.T @ H.T).logdet().diff(1)
    assert pc.check((slope, D.logdet().diff(1)), arm, states=2)
    assert not pc.check((slope, (1 + 1e-9) * slope), arm, states=2, search=False)
    assert not pc.check((1e-9 * D.trace(), 1e-9 * (1 + 1e-9) * D.trace()), arm, states=2, search=False)
    assert not pc.check(("logdet(D) == logdet(D) + 1e-12*trace(D)"), arm, states=2, search=False)


def test_ln_det_equal_to_zero_says_something():
    arm = pc.tree([-1, 0, 0], "pin", seed=3, rotor_inertia=True)
    report = pc.check("logdet(I + H@phi@K) == 0", arm, states=2)
    assert report and not report.notes
    for false in ("logdet(I + H@phi@G) == 0", "logdet(I + H@phi@K) == 1e-13", "logdet(I + 1e-9*D) == 0"):
        assert not pc.check(false, arm, states=2, search=False), false


def test_both_sides_zero_is_said():
    arm = pc.tree([-1, 0, 0], "pin", seed=3)
    assert "nothing was compared" in repr(pc.check("gravity_field == 7*gravity_field", arm, states=2))
    assert not pc.check("H@tau_bar == 0", arm, states=2).notes  # that it is zero is what is said
    arm.gravity = (0, 0, -9.81)
    assert not pc.check("gravity_field == 7*gravity_field", arm, states=2, search=False)


# ---------------------------------------------------------------------- norms


def test_norms_that_are_rounding_are_not_relied_on():
    """The rounding of a matrix is counted along: HψMψ*H* - D is zero, and its norm in double nothing but that."""
    soa = pc.chain(4, seed=2).soa
    H, psi, M, D, phi, E = soa("H psi M D phi E")
    x = pc.vector("x", soa.Theta)
    nothing = H @ psi @ M @ psi.T @ H.T - D
    sizes = Sizes(lambda e: e, double=True)
    sizes.give({"x": [1.0, 2.0, 3.0, 4.0]})
    rounding = np.finfo(float).eps * np.linalg.norm(D.dense())
    assert rounding <= sizes.norm(nothing) <= 1e6 * rounding
    assert sizes.of_sides(phi, pc.identity(phi.domain) + phi @ E)[1]
    for side in (nothing @ nothing, (nothing + 1e-16 * D).inv() @ D, D @ x):
        assert not sizes.of_sides(side, 0.0)[1], side
    assert not Sizes(lambda e: e).of_sides(phi, phi)[1]  # by plans in another precision: nothing is counted
    # What rounding may have made of a difference counts though it left none, and that of a letter by the sweep that made it.
    vanishing = phi - pc.identity(phi.domain) - soa.phi_tilde
    assert not vanishing.dense().any() and rounding < sizes.norm(vanishing) < 1e-12 * sizes.norm(phi)
    assert 1.0 < sizes.norm(psi) / np.linalg.norm(psi.dense()) < 1 + 1e-9
    before = sizes.norm(D @ x)
    sizes.give({"x": [10.0, 20.0, 30.0, 40.0]})
    assert sizes.norm(D @ x) == pytest.approx(10 * before)


@pytest.mark.parametrize(
    ("counted", "terms", "sides", "fall", "trusted"),
    [
        (True, 0.0, 1e-14, False, True),
        (False, 0.0, 1.0, False, True),
        (False, 0.0, 1e-14, False, False),
        (False, 0.0, 1e-14, True, True),
        (False, 1.0, 1e-14, True, False),
    ],
)
def test_when_norms_of_double_are_trusted(counted, terms, sides, fall, trusted):
    made = SimpleNamespace(counted=counted, terms=terms, size=1.0, bound=lambda relative, _: 1e-16 * max(1.0, relative))
    assert Scales._trusted(made, sides, fall) == trusted
    made.bound = lambda relative, _: 1e-2  # by what the sweep makes of its roundings
    assert not Scales._trusted(made, sides, fall)


def test_a_verdict_over_states_is_its_worst():
    def at_a_state(verdict, precision="quad", residual=1e-30):
        return Judgement([Taken(precision, residual, 1e-3)], verdict=verdict)

    holds, fails, undecided = map(at_a_state, (HOLDS, FAILS, UNDECIDED))
    cases = [([holds, undecided, fails], FAILS), ([undecided, fails], FAILS), ([holds, undecided], UNDECIDED), ([holds, holds], HOLDS)]
    for some, worst in cases:
        assert {Verdict(list(order)).verdict for order in itertools.permutations(some)} == {worst}
    wide, wider = at_a_state(HOLDS, residual=2e-30), at_a_state(HOLDS, "extended", 1e-5)
    for order in itertools.permutations([holds, wide, wider]):
        assert Verdict(list(order)).shown is wide
