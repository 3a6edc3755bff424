"""Certificates: the measured error is the true one, found independently; the other numbers are what they say."""

from dataclasses import replace

import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy.certificates import certify
from pycraft.accuracy.certificates.certificate import rounding_level
from pycraft.accuracy.certificates.certify import certify_dynamics
from pycraft.accuracy.certificates.floor import floors, refinement_floor
from pycraft.accuracy.certificates.locator import condition_estimate
from pycraft.accuracy.hard_cases.case import Sample
from pycraft.accuracy.hard_cases.chains import links
from pycraft.accuracy.hard_cases.stability import _reference
from pycraft.accuracy.rungs import LADDER, WIDE_GATHER, WIDER_RESIDUAL, Rung, above
from support import multiprecision
from support.descriptions import body, model, subhinge
from support.hard_chains import HARD, hard

SOLVED = [name for name in HARD if name != "massless tip"]
RUNGS = [Rung(), Rung(refine=1), Rung("ud"), Rung("square-root"), Rung(refine=1, residual="wider")]


@pytest.fixture(scope="module")
def panda():
    arm = pc.robots.panda()
    arm.gravity = (0, 0, -9.81)
    return arm


# ---------------------------------------------------------------------- the error
@pytest.mark.parametrize("name", SOLVED)
@pytest.mark.parametrize("precision", ["double", "extended", "quad"])
def test_the_error_is_the_true_one(name, precision):
    """Against 80 digits, by other equations. A double that is right to the last bit is measured to its rounding; a tenth is allowed."""
    model, q, v, tau = hard(name)
    model.gravity = (0, 0, -9.81)
    certificate = certify_dynamics(model, q, v, tau, precision=precision, seconds=0)
    truth = multiprecision.forward_dynamics(model, q, v, tau)
    if precision == "double":
        assert certificate.error == pytest.approx(multiprecision.relative_error(certificate.value, truth), rel=1e-3)
    else:
        assert multiprecision.relative_error(certificate.value, truth) <= 2**-52 + 10 * certificate.error
    assert certificate.reference == ("50 digits" if precision == "quad" else "quad")


@pytest.mark.parametrize("name", SOLVED)
@pytest.mark.parametrize("rung", RUNGS, ids=lambda r: r.label)
def test_never_smaller_than_a_tenth_of_truth(name, rung):
    model, q, v, tau = hard(name, seed=5)
    try:
        certificate = certify_dynamics(model, q, v, tau, form=rung.form, refine=rung.refine, residual=rung.residual, seconds=0)
    except ArithmeticError:
        assert name == "tip 1e12"  # refused, which is as good
        return
    truth = multiprecision.forward_dynamics(model, q, v, tau)
    assert certificate.error >= 0.1 * multiprecision.relative_error(certificate.value, truth)


def test_digits_lost_in_double_are_there_and_gone_in_ud():
    model, q, v, tau = hard("tip 1e9")
    fast, ud = (certify_dynamics(model, q, 0 * v, tau, form=form, seconds=0) for form in ("fast", "ud"))
    assert fast.error > 1e-11 and ud.error < 1e-14
    moving = certify_dynamics(model, q, v, tau, form="ud", refine=1, seconds=0)
    assert moving.error < 1e-14  # the forces of a heavy tip that moves cancel in the sweep: ud needs the refinement then


def test_every_kind_of_hinge(panda):
    tree = pc.tree([-1, 0, 1, 1, 3], ["free", "ball", "pin", "universal", "slider"], seed=2, rotor_inertia=True)
    tree.gravity = (0, 0, -9.81)
    state = tree.random_state(0)
    certificate = certify_dynamics(tree, state, tau=np.ones(tree.nv))
    exact = tree.forward_dynamics(state.q, state.v, np.ones(tree.nv), precision="quad")
    off = np.linalg.norm(certificate.value - exact) / np.linalg.norm(exact)
    assert certificate.error == pytest.approx(off, abs=2e-16) and certificate.error < 1e-13
    assert {loss.hinge for loss in certificate.locator} == set(tree.hinges)


@pytest.mark.parametrize("precision", ["double", "extended", "quad"])
def test_the_error_near_balance(panda, precision):
    """Forces that hold the arm: what is left of the accelerations is little but rounding, and the error says how little."""
    q, rest = panda.random_state(1).q, np.zeros(7)
    hold = panda.inverse_dynamics(q, rest, rest)
    certificate = certify_dynamics(panda, q, rest, hold, precision=precision, seconds=0)
    truth = multiprecision.forward_dynamics(panda, q, rest, hold)
    off = multiprecision.relative_error(certificate.value, truth)
    if precision == "quad":
        assert certificate.error < 1e-16
    else:
        assert off > 1e-5 and certificate.error == pytest.approx(off, rel=1e-6)
    # Rounding of the data and of the computation are alike here: which is the larger is chance.
    assert certificate.input_error > 0.01 and certificate.error < 10 * certificate.input_error
    assert ("is as good as its data" in repr(certificate)) == (certificate.error <= certificate.input_error)


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
@pytest.mark.parametrize("axis", [0, 2])
def test_a_needle_whose_own_inertia_is_lost_in_quad(axis, form):
    """I/mc² = 3e-26 along the rod: the first reference has lost what the value kept, and a wider one is taken."""
    share, along = 3e-26, np.eye(3)[axis]
    inertia = share * (np.outer(along, along) + np.eye(3)) / 2
    needle = pc.Multibody.from_description(model([body("needle", -1, [subhinge("ball")], 1.0, along, inertia)], (0, 0, -9.81)))
    for seed in range(3):
        state = needle.random_state(seed)
        for v, tau in ((0 * state.v, np.zeros(3)), (state.v, np.zeros(3)), (state.v, np.ones(3))):
            certificate = certify_dynamics(needle, state.q, v, tau, form=form, seconds=0)
            exact = needle.forward_dynamics(state.q, v, tau, form="ud", precision=100)
            off = np.linalg.norm(certificate.value - exact) / np.linalg.norm(exact)
            assert abs(certificate.error - off) <= 0.01 * off + 2**-53  # exact, here, is rounded to double


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_an_exact_answer_of_zero(form):
    """Two sliders along x that fall along z. What is left, if anything, is rounding, and no multiple of nothing is claimed."""
    made = [body(f"b{k}", k - 1, [subhinge("slider", [1, 0, 0])], mass, inertia=mass * np.eye(3)) for k, mass in enumerate((1e-3, 1e9))]
    arm = pc.Multibody.from_description(model(made, (0, 0, -9.81)))
    certificate = certify_dynamics(arm, np.array([0.3, 0.2]), form=form, seconds=0)
    assert np.linalg.norm(certificate.value) <= 2**-52 * 9.81
    assert certificate.error == (np.inf if certificate.value.any() else 0)
    assert ("the exact value is zero" if certificate.value.any() else "right to rounding") in certificate.verdict()


def test_the_reference_of_hard_cases_is_exact_at_any_mass_ratio():
    rng = np.random.default_rng(3)
    model = links([1.0] * 7 + [1e24], [0.1] * 8, rng, axes="coordinate")
    q, tau = rng.uniform(-3, 3, (1, 8)), rng.normal(size=(1, 8))
    found = _reference(Sample(model, q, 0 * q, tau))[0]
    exact = model.forward_dynamics(q[0], 0 * q[0], tau[0], form="ud", precision=100)
    assert np.linalg.norm(found - exact) <= 2**-52 * np.linalg.norm(exact)


# ---------------------------------------------------------------------- the other numbers
def test_condition_is_that_of_the_mass_matrix(panda):
    q = panda.random_state(3).q
    exact = np.linalg.cond(panda.mass_matrix(q), 1)
    assert exact / 3 <= certify_dynamics(panda, q).condition <= exact * (1 + 1e-9)
    D = panda.soa.D
    assert condition_estimate(D.at(q)) == pytest.approx(np.linalg.cond(D.at(q).dense(), 1), rel=1e-9)


def test_input_errors_are_the_slopes_times_half_a_unit(panda):
    state = panda.random_state(1)
    tau = np.linspace(-3, 3.5, 7)
    slopes = panda.forward_dynamics_derivatives(state.q, state.v, tau, precision="quad")
    size = np.linalg.norm(panda.forward_dynamics(state.q, state.v, tau))
    certificate = certify_dynamics(panda, state, tau=tau)
    for name, slope, data in (("q", slopes.q, state.q), ("v", slopes.v, state.v), ("tau", slopes.input, tau)):
        most = np.linalg.norm(np.abs(slope) @ (np.spacing(np.abs(data)) / 2)) / size
        assert most / 20 <= certificate.input_errors[name] <= most * (1 + 1e-6)
    assert certificate.input_error == max(certificate.input_errors.values()) and list(certificate.input_errors) == ["q", "v", "tau"]
    assert certificate.input_errors == certify_dynamics(panda, state, tau=tau).input_errors


def test_a_coordinate_that_is_zero_moves_by_half_an_epsilon_of_a_radian(panda):
    tau = np.ones(7)
    slope = panda.forward_dynamics_derivatives(np.zeros(7), np.zeros(7), tau, precision="quad").q
    most = np.linalg.norm(np.abs(slope) @ np.full(7, 2**-53)) / np.linalg.norm(panda.forward_dynamics(np.zeros(7), np.zeros(7), tau))
    certificate = certify_dynamics(panda, np.zeros(7), tau=tau)
    assert most / 20 <= certificate.input_errors["q"] <= most * (1 + 1e-6)
    assert certificate.input_errors["v"] == 0 and "v is zero, and exact" in repr(certificate)


def test_forces_that_cancel_are_data_too():
    """The stretched chain: half a unit of the forces makes more than the error, and the certificate reports it."""
    rods = pc.chain(200)
    tau = rods.mass_matrix(np.zeros(200))[:, 0]
    certificate = certify_dynamics(rods, np.zeros(200), tau=tau, seconds=0)
    assert 1e-9 < certificate.error < certificate.input_errors["tau"] < 1e-6 and certificate.input_errors["q"] < 1e-20
    assert certificate.verdict() == "the value is as good as its data: a higher rung helps only if tau is exact"
    assert certificate.next_rung.rung == WIDE_GATHER and certificate.next_rung.error < 1e-10
    assert set(certificate.next_rung.passed) == {"fast + 1 refinement"}
    assert repr(certificate).count("no step up") == 1 and "no hinge lost a digit" in repr(certificate)


@pytest.mark.parametrize(
    ("error", "moved", "floor", "words"),
    [
        (2e-16, {"q": 1e-20}, None, "right to rounding: no higher rung is needed"),
        (1e-9, {"q": 2e-9, "v": 1e-12, "tau": 3e-9}, None, "only if q and tau are exact"),
        (1e-9, {"q": 2e-9, "v": 2e-9, "tau": 3e-9}, None, "only if q, v and tau are exact"),
        (1e-9, {"q": 2e-10, "tau": 0.0}, 2e-9, "within the floor: refinement with this residual may leave as much"),
        (1e-9, {"q": 2e-10, "tau": 0.0}, 1e-10, "nearly as good as its data"),
        (1e-9, {"q": 1e-16, "tau": 1e-12}, None, "1e+03 times the effect of rounding tau"),
        (1e-9, {"q": 0.0}, None, "changes nothing"),
        (1e-9, {}, None, ""),
    ],
)
def test_verdicts(panda, error, moved, floor, words):
    certificate = replace(certify_dynamics(panda, np.zeros(7), seconds=0), error=error, input_errors=moved, floor=floor)
    assert words in certificate.verdict()
    assert bool(certificate.verdict()) == bool(words)


def test_floor_is_the_formula(panda):
    state = panda.random_state(2)
    tau = np.ones(7)
    certificate = certify_dynamics(panda, state, tau=tau)
    H, phi, M, a, b, a0 = (x.at(state.q, state.v).dense() for x in panda.soa("H phi M a b gravity_base"))
    alpha = phi.T @ (H.T @ certificate.value[:, None] + a + a0)
    force = phi @ (M @ alpha + b)
    inverse = np.linalg.inv(H @ phi @ M @ phi.T @ H.T)
    pushed = np.abs(M) @ np.abs(alpha) + np.abs(force)
    rounding = np.abs(inverse @ H @ phi @ M @ phi.T) @ np.abs(alpha) + np.abs(inverse @ H @ phi) @ pushed
    expected = 2**-53 * np.linalg.norm(rounding) / np.linalg.norm(certificate.value)
    assert certificate.floor == pytest.approx(expected, rel=1e-9)
    wider = certify_dynamics(panda, state, tau=tau, refine=1, residual="wider")
    assert wider.floor == pytest.approx(max(expected * pc._core.epsilons()["extended"] / 2**-52, 2**-53), rel=1e-6)


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_a_stretched_chain_stays_at_its_floor(form):
    """Refinement with a residual in double ends at the floor, in every form; with a wider one at the floor of that."""
    rods = pc.chain(100)
    q, tau = np.zeros(100), rods.mass_matrix(np.zeros(100))[:, 0]
    for residual in ("same", "wider"):
        certificate = certify_dynamics(rods, q, tau=tau, form=form, refine=1, residual=residual, seconds=0)
        assert certificate.error <= 10 * certificate.floor
    assert certificate.floor < 1e-11 and certificate.condition == pytest.approx(4e8, rel=1)


def test_one_formula_of_the_floor():
    rods = pc.chain(30)
    q = np.vstack([np.zeros(30), np.zeros(30), np.full(30, 0.2)])
    vdots = np.random.default_rng(0).normal(size=(3, 30))
    units = floors(rods, q, vdots)
    for i in range(3):
        tau = rods.inverse_dynamics(q[i], np.zeros(30), vdots[i])
        assert units[i] * 2**-53 == pytest.approx(certify_dynamics(rods, q[i], tau=tau, seconds=0).floor, rel=1e-6)


def test_a_floor_that_is_no_number_is_a_note(panda, monkeypatch):
    monkeypatch.setattr(certify, "refinement_floor", lambda *_: float("nan"))
    certificate = certify_dynamics(panda, panda.random_state(0), seconds=0)
    assert certificate.floor is None and certificate.notes["floor"] and "nan" not in repr(certificate)


def test_no_floor_relative_to_nothing(panda):
    """Accelerations that are zero, where forces cancel in them."""
    with pytest.raises(pc.EvaluationError, match="relative to the accelerations, and they are zero"):
        refinement_floor(panda, panda.random_state(0).q, np.zeros(7), np.zeros(7), Rung())
    assert refinement_floor(pc.chain(2), np.zeros(2), np.zeros(2), np.zeros(2), Rung()) == 2**-53  # and where nothing is there to round


def test_no_floor_on_long_chains():
    rods = pc.chain(401, seed=1)
    certificate = certify_dynamics(rods, rods.random_state(0), seconds=0)
    assert certificate.floor is None and "400" in certificate.notes["floor"] and "400" in repr(certificate)


def test_locator_points_where_digits_go(panda):
    model, q, v, tau = hard("tip 1e9")
    certificate = certify_dynamics(model, q, v, tau)
    D = [model.soa.D.at(q, precision=p).dense(dtype=object).diagonal() for p in ("double", "quad")]
    expected = {f"hinge{k}": float(abs((x - e) / e)) for k, (x, e) in enumerate(zip(*D, strict=True))}
    assert {loss.hinge: loss.error for loss in certificate.locator} == pytest.approx(expected)
    errors = [loss.error for loss in certificate.locator]
    assert errors == sorted(errors, reverse=True) and certificate.locator[0].digits > 4
    assert certificate.locator[-1].digits < 2
    well = certify_dynamics(panda, panda.random_state(0))
    assert max(loss.digits for loss in well.locator) < 2


# ---------------------------------------------------------------------- the ladder
def test_the_next_rung_climbs_the_ladder():
    rung, names = Rung(), []
    while steps := above(rung):
        rung = steps[0]
        names.append(rung.label)
    assert names[:5] == [
        "fast + 1 refinement", "fast + 1 refinement, wide gather", "ud", "ud + 1 refinement", "fast + 1 refinement, wider residual",
    ]  # fmt: skip
    assert names[5:] == ["fast, extended", "fast, quad", "fast, 50 digits", "fast, 100 digits"]
    assert above(Rung("ud", refine="auto", residual="wider"))[0].precision == "extended" and WIDER_RESIDUAL not in LADDER
    assert above(Rung("square-root"))[0] == above(Rung("ud"))[0]
    assert above(Rung(method="cholesky"))[0] == LADDER[0]
    assert above(Rung("ud", precision="single"))[0] == Rung("ud")


def test_the_next_rung_is_measured():
    model, q, v, tau = hard("tip 1e6")
    certificate = certify_dynamics(model, q, v, tau)
    step = certificate.next_rung
    own = certify_dynamics(model, q, v, tau, **step.rung.binding)
    assert step.rung == Rung(refine=1) and step.error == pytest.approx(own.error, abs=1e-17)
    assert step.error < 1e-3 * certificate.error and 1 < step.cost < 20


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", SOLVED)
def test_the_next_rung_is_a_step_up(name, seed):
    model, q, v, tau = hard(name, seed)
    certificate = certify_dynamics(model, q, v, tau, seconds=0)
    step = certificate.next_rung
    if certificate.error <= rounding_level("double"):
        assert step is None and "none is needed" in repr(certificate) and certificate.verdict().endswith("no higher rung is needed")
        return
    assert 2 * step.error <= certificate.error and all(2 * error > certificate.error for error in step.passed.values())


def test_where_no_rung_is_a_step_up(panda, monkeypatch):
    """None, and a note with what was tried."""
    model, q, v, tau = hard("tip 1e6")
    monkeypatch.setattr(certify, "above", lambda rung: [Rung("square-root", refine=1), Rung()])
    assert certify_dynamics(model, q, 0 * v, tau, form="ud", seconds=0).error > 0
    monkeypatch.setattr(certify, "above", lambda rung: [Rung()])
    certificate = certify_dynamics(model, q, v, tau, seconds=0)
    assert certificate.error > 1e-14 and certificate.next_rung is None
    assert certificate.notes["next_rung"].startswith("no rung above halves the error: fast ") and "no rung above" in repr(certificate)


def test_a_rung_that_refuses_is_told(monkeypatch):
    """The next one that answers is measured, and the one passed over is named with its reason."""
    model, q, v, tau = hard("tip 1e6")
    forward_dynamics = type(model).forward_dynamics

    def refusing(self, *state, **options):
        if options.get("refine"):
            raise pc.RefinementError("the first correction is 0.4 of the solution")
        return forward_dynamics(self, *state, **options)

    monkeypatch.setattr(type(model), "forward_dynamics", refusing)
    certificate = certify_dynamics(model, q, 0 * v, tau)
    assert certificate.next_rung.rung == Rung("ud")
    reason = "the first correction is 0.4 of the solution"
    assert certificate.next_rung.refused == {"fast + 1 refinement": reason, "fast + 1 refinement, wide gather": reason}
    assert "refused" in repr(certificate) and "0.4 of the solution" in repr(certificate)
