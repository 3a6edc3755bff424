"""Certificates: the measured error is the true one, found independently; the other numbers are what they say."""

import re

import multiprecision
import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy import certify
from pycraft.accuracy.certify import certify_dynamics, certify_expression, condition_estimate
from pycraft.accuracy.chains import links
from pycraft.accuracy.rungs import LADDER, Rung, above


def hard(name, seed=0):
    """A chain that costs digits, a state of it and forces."""
    masses, lengths = HARD[name]
    rng = np.random.default_rng(seed)
    model = links(masses, lengths, rng, axes="coordinate")
    return model, rng.uniform(-3, 3, model.nv), rng.uniform(-1, 1, model.nv), rng.normal(size=model.nv)


HARD = {
    "even": ([1.0] * 8, [0.3] * 8),
    "tip 1e3": ([1.0] * 7 + [1e3], [0.1] * 8),
    "tip 1e6": ([1.0] * 7 + [1e6], [0.1] * 8),
    "tip 1e9": ([1.0] * 7 + [1e9], [0.1] * 8),
    "tip 1e12": ([1.0] * 7 + [1e12], [0.1] * 8),
    "growing": ([10.0**k for k in range(8)], [0.1] * 8),
    "growing, longer": ([10.0**k for k in range(8)], [0.1 * 2**k for k in range(8)]),
    "massless tip": ([1.0, 1.0, 0.0], [0.1] * 3),
    "alternating": ([1.0, 1e6] * 4, [0.1] * 8),
}


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


# ---------------------------------------------------------------------- the other numbers
def test_condition_is_that_of_the_mass_matrix(panda):
    q = panda.random_state(3).q
    exact = np.linalg.cond(panda.mass_matrix(q), 1)
    assert exact / 3 <= certify_dynamics(panda, q).condition <= exact * (1 + 1e-9)
    D = panda.soa.D
    assert condition_estimate(D.at(q)) == pytest.approx(np.linalg.cond(D.at(q).dense(), 1), rel=1e-9)


def test_input_error_is_the_slope_times_half_a_unit(panda):
    state = panda.random_state(1)
    tau = np.linspace(-3, 3, 7)
    slope = panda.forward_dynamics_derivatives(state.q, state.v, tau, precision="quad").q
    half = np.spacing(np.abs(state.q)) / 2
    exact = panda.forward_dynamics(state.q, state.v, tau)
    most = np.linalg.norm(np.abs(slope) @ half) / np.linalg.norm(exact)
    measured = certify_dynamics(panda, state, tau=tau).input_error
    assert most / 20 <= measured <= most * (1 + 1e-6)
    assert measured == certify_dynamics(panda, state, tau=tau).input_error
    assert certify_dynamics(panda, 0 * state.q, tau=tau).input_error == 0  # there is nothing to round in zero


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
    assert names[:5] == ["fast + 1 refinement", "ud", "ud + 1 refinement", "fast, extended", "fast, quad"]
    assert names[5:] == ["fast, 50 digits", "fast, 100 digits"]
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


def test_a_rung_that_refuses_is_told(panda, monkeypatch):
    """The next one that answers is measured, and the one passed over is named with its reason."""
    forward_dynamics = type(panda).forward_dynamics

    def refusing(self, *state, **options):
        if options.get("refine"):
            raise pc.RefinementError("the first correction is 0.4 of the solution")
        return forward_dynamics(self, *state, **options)

    monkeypatch.setattr(type(panda), "forward_dynamics", refusing)
    certificate = certify_dynamics(panda, panda.random_state(0))
    assert certificate.next_rung.rung == Rung("ud") and certificate.next_rung.refused == {
        "fast + 1 refinement": "the first correction is 0.4 of the solution"
    }
    assert "refused" in repr(certificate) and "0.4 of the solution" in repr(certificate)


# ---------------------------------------------------------------------- expressions
def test_expressions(panda):
    q = panda.random_state(0).q
    H, phi, M, P = panda.soa("H phi M P")
    MM = H @ phi @ M @ phi.T @ H.T
    x = np.linspace(-1, 1, 7)
    inverse = certify_expression(MM.inv(), q, x)
    exact = np.linalg.solve(MM.at(q).dense(), x)
    assert np.allclose(inverse.value, exact, rtol=1e-10) and inverse.value.shape == (7,) and inverse.error < 1e-14
    assert inverse.condition == pytest.approx(np.linalg.cond(MM.at(q).dense(), 1), rel=0.7)
    assert certify_expression(MM.inv(), q, np.eye(7)[:, :3]).value.shape == (7, 3)

    dense = certify_expression(P, q)
    assert dense.condition is None and "square" in dense.notes["condition"] and dense.value.shape == (42, 42) and dense.locator
    assert dense.error == pytest.approx(_off(P, q), rel=1e-6) and dense.next_rung.rung == Rung("ud")
    assert not certify_expression(H @ phi, q).locator  # no D(k) in it

    quad = certify_expression(MM, q, precision="quad")
    assert quad.reference == "50 digits" and 0 < quad.error < 1e-30


def _off(operator, q):
    used, exact = (operator.at(q, precision=p).dense(dtype=object) for p in ("double", "quad"))
    return float(np.sqrt(((used - exact) ** 2).sum() / (exact**2).sum()))


def test_scalars(panda):
    panda.q = panda.random_state(4).q
    H, phi, M = panda.soa("H phi M")
    determinant = (H @ phi @ M @ phi.T @ H.T).logdet()
    certificate = certify_expression(determinant)
    assert certificate.value == float(determinant) and certificate.error < 1e-14 and certificate.condition > 1
    assert certify_expression(M.trace()).value == float(M.trace())


def test_a_bare_tree_of_matrices():
    soa = pc.sko_model([-1, 0], [None, np.eye(2)], [np.eye(1, 2)] * 2, [np.eye(2)] * 2)
    certificate = certify_expression(soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T)
    assert certificate.value.tolist() == [[2, 1], [1, 1]] and certificate.error == 0
    assert certificate.input_error is None and certificate.notes["input_error"]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda arm: certify_expression(arm.soa.M.at(arm.q)), "bound to a state already.*expr.certify"),
        (lambda arm: certify_expression(arm.soa.M.trace(), arm.q, np.ones(7)), "nothing to apply"),
        (lambda arm: certify_expression(arm.soa.M, np.zeros((3, 7))), "one state: q of 'panda' takes 7 numbers"),
        (lambda arm: certify_dynamics(arm, np.zeros((3, 7))), "one state: q of 'panda' takes 7 numbers"),
        (lambda arm: certify_dynamics(arm, np.zeros(7), precision=100), "nothing is wider than 100 digits"),
        (lambda arm: certify_dynamics(arm, np.zeros(7), form="joseph"), "joseph"),
    ],
)
def test_what_cannot_be_certified(panda, call, words):
    with pytest.raises(pc.Error, match=words):
        call(panda)


@pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")
def test_a_refused_value_has_no_certificate():
    model, q, v, tau = hard("massless tip")
    with pytest.raises(pc.SingularHingeError, match="hinge2"):
        certify_dynamics(model, q, v, tau)


# ---------------------------------------------------------------------- how it reads
def test_the_table(panda):
    certificate = certify_dynamics(panda, panda.random_state(0), tau=np.ones(7))
    text = repr(certificate)
    for word in ("forward dynamics of panda", "error", "data", "condition", "floor", "next rung", "locator", "proves nothing", "quad"):
        assert word in text
    assert max(map(len, text.splitlines())) < 120
    html = certificate._repr_html_()
    assert html.count("<tr>") == html.count("</tr>") > 5 and not re.search(r"\bNone\b|nan", text + html)


def test_methods(panda):
    q = panda.random_state(0).q
    assert panda.certify(q, tau=np.ones(7), refine=1).rung == Rung(refine=1)
    assert panda.soa.M.certify(q).error < 1e-15 and panda.soa.M.trace().certify(q).error < 1e-15
    assert certify.certify_dynamics.__doc__ and panda.certify.__doc__
