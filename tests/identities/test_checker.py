"""The theorem checker: what holds, what is expected to fail and why, and that nothing false passes."""

import functools
import json

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.checker import check_theorem
from support.mechanisms import every_kind
from support.perturbations import difference, exchanges

NEED_J_ZERO = {
    "Riccati equation of P",
    "H is a left inverse of G",
    "τ is a projection",
    "τ̄ projects P",
    "τ̄ leaves nothing along the hinge",
    "innovations factor by gains",
    "HψG = I",
    "ψMψ* decomposed by P",
    "innovations covariance",
    "HφMψ*H* = [I+HφK]D",
    "innovations factorization",
    "mass matrix inverse",
    "ln det ℳ = Σ ln det D(k)",
    "D^-½HψM^½ is a co-isometry",
    "ΩMΩ = Ω",
    "the bodies' shares add up to N",
    "innovations velocity",
}


def branched(rotor_inertia=False, kinds=("free", "pin", "ball", "universal", "slider"), seed=2):
    """A branched tree; the hinges of a body have siblings and are of several kinds."""
    model = pc.tree([-1, 0, 0, 1, 1], list(kinds), seed=seed, rotor_inertia=rotor_inertia)
    state = model.random_state(seed)
    model.q, model.v, model.gravity = state.q, state.v, (1.0, -2.0, -9.5)
    return model


def unmet(report):
    """{theorem: hypotheses that are not met} of what was expected to fail, and did."""
    return {f.name: f.unmet for f in report.findings if f.verdict == "expected to fail"}


# ---------------------------------------------------------------------- every theorem, every model


MODELS = {
    "chain of pins": lambda: pc.chain(4),
    "random chain": lambda: pc.tree(range(-1, 4), ["pin", "slider", "screw", "pin", "pin"], seed=3),
    "chain of many kinds": lambda: pc.tree(range(-1, 3), ["free", "universal", "ball", "custom"], seed=3, rotor_inertia=True),
    "branched": branched,
    "branched, rotors": lambda: branched(True),
    "forest of every kind, rotors": lambda: every_kind(True),
    "every kind, welds kept": every_kind,
}


@functools.cache
def checked(name, states):
    """The report on a model at its own state and random ones, `states` in all, and the names of what was reported on meanwhile."""
    names = []
    return MODELS[name]().soa.check(states=states - 1, progress=names.append), names


@pytest.mark.parametrize("name", ["chain of many kinds", "branched", "branched, rotors"])
def test_every_theorem_holds_where_its_hypotheses_are_met(name):
    every_theorem_holds(name, states=1)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_every_theorem_holds_at_several_states(name):
    every_theorem_holds(name, states=2)


def every_theorem_holds(name, states):
    report, _ = checked(name, states)
    assert report and not report.failed and report.worst < 1e-9
    traits = report.traits
    for finding in report.findings:
        for hypothesis in finding.hypotheses:
            assert (hypothesis in finding.unmet) == (not traits.get(hypothesis, name.startswith("branched"))) or hypothesis == "free root"
        if not finding.unmet:
            assert finding.verdict in ("holds", "waiting"), (finding.name, finding.verdict, finding.residual, finding.bound)
            if finding.verdict == "holds":
                assert finding.residual <= finding.bound and finding.wide_residual <= finding.wide_bound <= 1e-12
                assert finding.states == states
        else:
            assert finding.verdict in ("expected to fail", "holds anyway")


def test_on_a_branched_tree_only_the_decomposition_of_omega_is_expected_to_fail():
    report, _ = checked("branched", 1)
    several = {
        **dict.fromkeys(("∂ℳ", "slope of the kinetic energy", "derivative of inverse dynamics"), ["constant H"]),
        "∂ℳ, single-DOF form": ["single-DOF hinges"],
        "C is the Christoffel matrix": ["single-DOF hinges"],
    }
    found = unmet(report)
    assert found.pop("Ω decomposed by Υ") == ["serial chain"] and found.items() <= several.items()
    on_path = next(f for f in report.findings if f.name == "Ω decomposed by Υ, blocks on one path")
    assert on_path.verdict == "holds" and on_path.hypotheses == []


def test_with_rotor_inertia_what_needs_j_zero_is_expected_to_fail():
    model = branched(True)
    found = unmet(model.soa.check(states=2))
    assert {name: hypotheses for name, hypotheses in found.items() if hypotheses != ["J = 0"]}.keys() <= {
        "Ω decomposed by Υ",
        "two-filter form",
        "∂ℳ",
        "∂ℳ, single-DOF form",
        "slope of the kinetic energy",
        "derivative of inverse dynamics",
        "C is the Christoffel matrix",
    }
    assert found["Ω decomposed by Υ"] == ["serial chain"]
    assert set(found) >= NEED_J_ZERO, NEED_J_ZERO - set(found)
    chain = pc.tree(range(-1, 3), "pin", seed=1, rotor_inertia=True)
    found = unmet(chain.soa.check())
    assert set(found) >= NEED_J_ZERO and "Ω decomposed by Υ" not in found
    plain = pc.tree(range(-1, 3), "pin", seed=1)
    assert set(unmet(plain.soa.check())) <= {"two-filter form"}


def test_a_model_of_one_degree_of_freedom():
    for kind in ("pin", "slider"):
        model = pc.chain(1, kind)
        report = model.soa.check(states=1)
        assert report and report.counts().get("undecided", 0) == 0


def test_singular_models_are_reported_and_not_crashed_on():
    arm = pc.Multibody("massless tip")
    arm.add_body("link", mass=1.0, com=(1, 0, 0), inertia=np.eye(3))
    arm.add_body("tip", "link", axis=(1, 0, 0))
    with pytest.warns(pc.ModelWarning):
        report = arm.soa.check(states=0)
    verdicts = {f.name: f.verdict for f in report.findings}
    assert verdicts["Riccati equation of P"] == "undefined" and verdicts["φ is the resolvent of E"] == "holds"
    assert not report.failed and not report and report.status == 3  # not all that should hold was shown


def test_reports_show_themselves():
    report, names = checked("branched, rotors", 1)
    text, data = repr(report), json.loads(report.to_json())
    assert "needs serial chain" in text and "waits for" in text and "φ = I + E_φ φ" not in text and "φ = I + E_φ φ" in report.full()
    assert {f["name"] for f in data["findings"]} == {f.name for f in report.findings} and data["traits"]["J = 0"] is False
    assert "<table" in report._repr_html_() and sum(report.counts().values()) == len(report.findings)
    assert names == [t.name for t in branched(True).soa.theorems()]


# ---------------------------------------------------------------------- nothing false passes


def statements(theorems):
    return [t for t in theorems if not t.waiting and not t.at_most and not t.on_one_path]


def held(lhs, rhs, model):
    """The checker's word on two expressions of a model, at its own state and another."""
    return bool(pc.check((lhs, rhs), model, states=1, search=False))


def for_theorem(theorem):
    """A model on which the theorem's hypotheses hold and everything else that may be false is; it moves."""
    needs = set(theorem.hypotheses)
    rotor = "J = 0" not in needs
    if "serial chain" in needs:
        model = pc.tree(range(-1, 4), ["free", "pin", "ball", "universal", "slider"], seed=6, rotor_inertia=rotor)
    elif "single-DOF hinges" in needs:
        model = pc.tree([-1, 0, 1, 1, 0], ["pin", "screw", "pin", "slider", "pin"], seed=6, rotor_inertia=rotor)
    elif "constant H" in needs:
        model = pc.tree([-1, 0, 1, 1, 0], ["free", "pin", "ball", "slider", "screw"], seed=6, rotor_inertia=rotor)
    else:
        return branched(rotor)
    state = model.random_state(6)
    model.q, model.v = state.q, state.v
    return model


THEOREMS = [t.name for t in statements(branched().soa.theorems())]


@pytest.fixture(scope="module")
def theorems():
    """Each theorem with its model, models shared by those of equal hypotheses."""
    found, models = {}, {}
    for theorem in statements(branched().soa.theorems()):
        key = tuple(sorted(theorem.hypotheses))
        models.setdefault(key, for_theorem(theorem))
        found[theorem.name] = models[key], next(t for t in statements(models[key].soa.theorems()) if t.name == theorem.name)
    return found


@pytest.mark.parametrize("name", THEOREMS)
def test_one_coefficient_off(name, theorems):
    """Every theorem with one side off by 1e-13, far below what double decides: refuted by the wider scalar."""
    model, theorem = theorems[name]
    lhs, rhs = theorem.lhs, theorem.rhs
    assert theorem.unmet(model.soa._source) == []
    if isinstance(lhs, pc.Scalar):
        assert held(lhs, rhs, model) and not held(lhs, rhs + 1e-13 * max(1.0, abs(float(rhs))), model)
        return
    assert held(lhs, rhs, model)
    off = 1 + 1e-13
    side = lhs if rhs.kind == "zero" else rhs
    if rhs.kind == "zero":  # a multiple of zero is zero: its last factor is moved instead
        factors = list(lhs.children)
        factors[-1] = factors[-1] + 1e-13 * pc.identity()
        assert not held(_product(factors), rhs, model)
    elif side.kind == "sum":
        for i, term in enumerate(side.children):
            changed = [off * t if i == j else t for j, t in enumerate(side.children)]
            moved = sum(changed)
            if difference(moved, side) > 1e-14:  # not where the term vanishes on this model
                assert not held(lhs, moved, model), f"{term.text()} off by 1e-13"
    else:
        assert not held(lhs, off * side, model)


def _product(factors):
    made = factors[0]
    for factor in factors[1:]:
        made = made @ factor
    return made


OF_OPERATORS = [t.name for t in statements(branched().soa.theorems()) if not isinstance(t.lhs, pc.Scalar)]
"""Scalars: see test_scalar_statements_with_a_letter_exchanged."""


@pytest.mark.parametrize("name", OF_OPERATORS)
def test_one_letter_exchanged(name, theorems):
    """Every theorem with one letter exchanged for another between the same spaces: refuted where dense NumPy says false."""
    exchanged(*theorems[name], most=3)


@pytest.mark.slow
@pytest.mark.parametrize("name", OF_OPERATORS)
def test_many_letters_exchanged(name, theorems):
    exchanged(*theorems[name], most=12)


def exchanged(model, theorem, most):
    """So many of the exchanges at most: derivatives are long, and each letter stands in them many times."""
    lhs, rhs = theorem.lhs, theorem.rhs
    lhs, rhs = (side @ pc.identity(other.domain) if side.domain is None else side for side, other in ((lhs, rhs), (rhs, lhs)))
    tried = 0
    all_of_them = [*((w, c, rhs) for w, c in exchanges(lhs)), *((w, c, lhs) for w, c in exchanges(rhs))]
    drawn = np.random.default_rng(0).permutation(len(all_of_them))
    for i in drawn:
        if tried == most:
            break
        what, changed, other = all_of_them[i]
        try:
            apart = difference(changed, other) if other.kind != "zero" else np.abs(changed.dense()).max()
        except np.linalg.LinAlgError:
            continue
        if apart > 1e-7:
            tried += 1
            try:
                assert not held(changed, other, model), f"{what}: {changed.text()} = {other.text()}, off by {apart:.1e}"
            except pc.SingularOperatorError:
                continue  # an inverse that exists only by the noise of dense NumPy
        elif apart < 1e-11:
            assert held(changed, other, model), f"{what}: {changed.text()} = {other.text()} is true and was refuted"
    assert tried > 0, "no exchange made it false"


@pytest.mark.parametrize(
    ("true", "false"),
    [
        ("logdet(MM + J) == logdet(D)", ["logdet(MM) == logdet(D)", "logdet(MM + J) == logdet(J)", "logdet(R) == logdet(P)"]),
        ("logdet(I + H@phi@K) == 0", ["logdet(I + H@phi@G) == 0", "logdet(I + H@phi@K) == 1e-13", "logdet(D) == 0"]),
        (
            "trace(phi@psi) == trace(psi)",
            ["trace(phi@psi) == 1.0000000000001*trace(psi)", "trace(Upsilon@M) == N", "norm(phi) == norm(psi)"],
        ),
    ],
)
def test_scalar_statements_with_a_letter_exchanged(true, false):
    model = branched(True)
    assert pc.check(true, model, search=False)
    for text in false:
        assert not pc.check(text, model, search=False), text


@pytest.mark.parametrize("power", [10, 13, 15, 16])
def test_residuals_must_fall_with_epsilon(power):
    """A statement that is off by less than double can see is false all the same."""
    model = branched()
    phi, M, D = model.soa("phi M D")
    off = 1 + 10.0**-power if power < 16 else 1 + 2.0**-52
    for lhs, rhs in (
        (phi, off * phi),
        (M, off * M),
        (D.inv() @ D, off * pc.identity()),
        (phi @ M @ phi.T, phi @ (off * M) @ phi.T),
    ):
        report = pc.check((lhs, rhs), model, search=False)
        assert not report and report.worst <= 10.0**-power + 1e-12
    assert not pc.check(f"{off!r}*phi == phi", model, search=False)


def test_what_falls_and_is_exact_passes():
    model = branched()
    phi, H = model.soa("phi H")
    assert pc.check((phi, phi), model) and pc.check((H - H, pc.zero(model.soa.F, model.soa.Theta)), model)
    zero = pc.check("0*phi == 0", model)
    assert zero and not zero.undecided and zero.worst == 0.0


def test_an_inverse_that_is_not_there_is_a_way_to_fail_outside_the_hypotheses_alone(monkeypatch):
    """Where all hypotheses are met nothing was expected to fail: the theorem is undefined there."""

    def singular(*_, **__):
        raise pc.SingularOperatorError("no inverse")

    monkeypatch.setattr("pycraft.identities.checker.judge_states", singular)
    theorem = next(t for t in statements(pc.chain(2).soa.theorems()) if t.hypotheses)
    found = {bool(unmet): check_theorem(theorem, unmet, [], np.random.default_rng(0)) for unmet in ([], theorem.hypotheses)}
    assert (found[False].verdict, found[True].verdict) == ("undefined", "expected to fail") and found[False].note == "no inverse"


def test_precisions_by_name(monkeypatch):
    some = pc.OperatorSet.theorems
    monkeypatch.setattr(pc.OperatorSet, "theorems", lambda self: some(self)[:12])
    model = pc.chain(2)
    for call in (lambda p: model.soa.check(precision=p), lambda p: pc.check("phi == phi", model, precision=p)):
        for narrow in ("single", "double"):
            with pytest.raises(pc.EvaluationError, match=f"'{narrow}' is not wider than double.*.*choose .'extended', 'quad', 50, 100."):
                call(narrow)
        with pytest.raises(ValueError, match="no precision is called 'half'"):
            call("half")
    for wide in ("quad", 50):
        report = model.soa.check(precision=wide, states=1)
        assert report and report.findings[0].wide_precision == wide


def test_a_statement_checked_in_double_alone_is_refused():
    """With double for both there is no fall to see: everything within the bound would pass."""
    model = branched()
    assert pc.check("1.0000000000000002*phi == phi", model, search=False).held is False
    with pytest.raises(pc.EvaluationError, match="wider"):
        pc.check("1.0000000000000002*phi == phi", model, search=False, precision="double")


@pytest.mark.parametrize("model", [pc.Multibody("none"), pc.tree([-1, 0], ["weld", "weld"])], ids=["no bodies", "welds"])
def test_a_model_without_bodies_is_checked(model):
    report = model.soa.check()
    assert report and not {finding.verdict for finding in report.findings} & {"fails", "undecided", "undefined"}
