"""Certificates of expressions, what cannot be certified, and how a certificate reads."""

import re
from dataclasses import replace

import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy.certificates import certify
from pycraft.accuracy.certificates.certify import certify_dynamics, certify_expression
from pycraft.accuracy.certificates.locator import runs_articulated_sweep
from pycraft.accuracy.rungs import Rung
from support.hard_chains import hard


@pytest.fixture(scope="module")
def panda():
    arm = pc.robots.panda()
    arm.gravity = (0, 0, -9.81)
    return arm


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
    assert dense.error == pytest.approx(_off(P, q), rel=1e-6)
    assert not certify_expression(H @ phi, q).locator  # no D(k) in it
    heavy, there, _, _ = hard("tip 1e9")
    lost = certify_expression(heavy.soa.P, there)
    assert lost.next_rung.rung == Rung("ud") and lost.next_rung.error < 0.1 * lost.error

    quad = certify_expression(MM, q, precision="quad")
    assert quad.reference == "50 digits" and 0 < quad.error < 1e-30


def test_data_of_an_expression(panda):
    """ℳ⁻¹x moves with x as with q; x alone where the tree has no coordinates."""
    state, x = panda.random_state(0), np.linspace(-1, 1.5, 7)
    H, phi, M = panda.soa("H phi M")
    certificate = certify_expression((H @ phi @ M @ phi.T @ H.T).inv(), state, x)
    inverse = np.linalg.inv(panda.mass_matrix(state.q))
    most = np.linalg.norm(np.abs(inverse) @ (np.spacing(np.abs(x)) / 2)) / np.linalg.norm(inverse @ x)
    assert most / 20 <= certificate.input_errors["x"] <= most * (1 + 1e-6)
    assert list(certificate.input_errors) == ["q", "v", "x"] and certificate.input_errors["v"] == 0 < certificate.input_errors["q"]
    C = pc.constant(np.diag([1.0, 3.0]), pc.euclidean(2), pc.euclidean(2), "C")
    bare = C.certify(x=[0.1, 0.3])
    assert list(bare.input_errors) == ["x"] and bare.input_error > 1e-17 and "coordinates of one model" in repr(bare)


def test_locator_and_forms_only_where_the_sweep_runs():
    """tr ℳ and ℳx are composite bodies and Newton-Euler: no D(k), no form; tr ℳ⁻¹ and ln det ℳ = ln det D have both."""
    model, q, _, _ = hard("tip 1e9")
    H, phi, M, D = model.soa("H phi M D")
    MM = H @ phi @ M @ phi.T @ H.T
    without = [MM.trace(), 2 * MM.trace() + 1, MM, H @ phi]
    having = [MM.inv().trace(), MM.logdet(), 2 * MM.logdet() + 1, D.logdet(), D.logdet() - MM.trace(), MM.inv(), D]
    for expr in without:
        certificate = certify_expression(expr, q, seconds=0)
        assert not certificate.locator and "no articulated sweep" in repr(certificate)
        assert certificate.next_rung is None or certificate.next_rung.rung.precision != "double"
        assert not runs_articulated_sweep(expr, "apply")
    for expr in having:
        certificate = certify_expression(expr, q, seconds=0)
        assert len(certificate.locator) == 8 and "locator" not in certificate.notes
    assert not certify_expression(MM, q, np.ones(8), seconds=0).locator and certify_expression(MM.inv(), q, np.ones(8), seconds=0).locator


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
        (lambda arm: certify_expression(arm.soa.M.trace(), arm.q, np.ones(7)), "cannot be applied to x"),
        (lambda arm: certify_expression(arm.soa.M, np.zeros((3, 7))), "one state: q of 'panda' takes 7 numbers"),
        (lambda arm: certify_dynamics(arm, np.zeros((3, 7))), "one state: q of 'panda' takes 7 numbers"),
        (lambda arm: certify_dynamics(arm, np.zeros(7), precision=100), "nothing is wider than 100 digits"),
        (lambda arm: certify_dynamics(arm, np.zeros(7), form="joseph"), "joseph"),
        (lambda arm: certify_expression(arm.soa.M, np.zeros(7), form="ufo"), "no form.*'ufo'; there are 'fast', 'ud' and 'square-root'"),
        (lambda arm: certify_expression(arm.soa.D, np.zeros(7), np.ones(3)), r"x: D is applied to .*\(7,\), or \(7, m\).*shape \(3,\)"),
        (lambda arm: certify_expression(arm.soa.D, np.zeros(7), np.ones((2, 7, 1))), r"shape \(2, 7, 1\)"),
        (lambda arm: certify_expression(arm.soa.D, np.zeros(7), 3.0), r"applied to an array \(7,\).*shape \(\)"),
        (lambda arm: certify_expression(arm.soa.D, np.zeros(7), ["a"] * 7), r"x of D takes \(7,\).*not list"),
        (lambda arm: certify_expression(arm.soa.D, np.zeros(7), v=np.zeros(3)), r"v of 'panda' takes 7 numbers, not an array \(3,\)"),
        (lambda arm: certify_expression(arm.soa.D, np.zeros(7), np.full(7, np.inf)), "x of D has an entry that is not finite"),
        (lambda arm: certify_dynamics(arm, np.full(7, np.nan)), "q of 'panda' has an entry that is not finite"),
        (lambda arm: certify_dynamics(arm, np.zeros(7), np.zeros(3)), r"v of 'panda' takes 7 numbers, not an array \(3,\)"),
        (lambda arm: certify_dynamics(arm, np.zeros(7), tau=1.0), r"tau of 'panda' takes 7 numbers, not an array \(\)"),
        (lambda arm: certify_dynamics(arm, np.zeros(7), seed=-1), "seed=-1.*whole number, 0 or above"),
        (lambda arm: certify_expression(arm.soa.D, np.zeros(7), seed=0.5), "seed=0.5.*whole number"),
        (lambda arm: arm.certify(np.zeros(7), method="ldl"), "method='ldl': certificates support only the articulated method"),
        (lambda arm: arm.soa.D.certify(np.zeros(7), on_singular="minimum-norm"), "on_singular='minimum-norm'.*articulated method"),
        (lambda arm: pc.Multibody("post").certify([]), "model 'post' has no coordinates: nothing to certify"),
        (lambda arm: certify_expression(pc.Multibody("post").soa.D.trace(), []), "model 'post' has no coordinates: nothing to certify"),
        (lambda arm: certify_expression(pc.Multibody("post").soa.M), "model 'post' has no coordinates: nothing to certify"),
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
    for word in ("forward dynamics of panda", "error", "data", "condition", "floor", "next rung", "locator", "quad"):
        assert word in text
    assert "no hinge lost a digit" in text and "proves nothing" not in text
    assert max(map(len, text.splitlines())) < 120
    html = certificate._repr_html_()
    assert html.count("<tr>") == html.count("</tr>") > 5 and not re.search(r"\bNone\b|nan", text + html)


def test_plurals_and_hinges():
    one = pc.chain(1)
    text = repr(certify_dynamics(one, [0.3], tau=[1.0], seconds=0))
    assert "1 degree of freedom:" in text and "more" not in text
    model, q, v, tau = hard("tip 1e9")
    certificate = certify_dynamics(model, q, v, tau, seconds=0)
    lost = [loss for loss in certificate.locator if loss.digits >= 1]
    assert repr(certificate).count("digits lost") == len(lost) < 8 and "more" not in repr(certificate)
    six = replace(certificate, locator=[replace(loss, digits=2.0) for loss in certificate.locator[:6]])
    text, html = repr(six), six._repr_html_()
    assert text.count("digits lost") == 5 and "and 1 hinge more" in text and "and 1 hinge more" in html and "proves nothing" in text


def test_methods(panda):
    q = panda.random_state(0).q
    assert panda.certify(q, tau=np.ones(7), refine=1).rung == Rung(refine=1)
    assert panda.soa.M.certify(q).error < 1e-15 and panda.soa.M.trace().certify(q).error < 1e-15
    assert certify.certify_dynamics.__doc__ and panda.certify.__doc__


def test_expressions_of_loops_beside_the_trees_letters():
    """The compliance of loops: rows of loops have no sweep of their own, the tree has, and its D(k) are located."""
    model = pc.chain(3)
    model.add_loop("body2", hinge="ball", point=(1, 0, 0), position=(0.5, 0.5, 0))
    soa, q = model.soa, np.array([0.1, 0.4, -0.7])
    Q, MM, I = soa("Q MM I")
    for op in (Q @ MM.inv() @ Q.T, Q @ (MM + soa.J).inv(), MM.inv() @ Q.T):
        certificate = op.certify(q)
        assert certificate.error < 1e-13 and len(certificate.locator) == 3
    assert not (Q @ Q.T).certify(q).locator
    trace = (Q @ MM.inv() @ Q.T).trace().certify(q)
    assert trace.error < 1e-13 and len(trace.locator) == 3
    assert (I + Q.T @ Q).inv().certify(q).error < 1e-13
