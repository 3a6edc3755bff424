"""Every precision has the digits it says: single, double, extended, quad, and 50 and 100 decimal digits.

Against the reference in mpmath at 120 digits. An error is compared with the running bound of `formulas` in the precision's own
epsilon, and with the error one rung up and down: a wider rung that was narrower somewhere inside would show as an error of the narrower.
Nothing leaves the core as a double unless it is asked to: `dtype=object` gives mpmath numbers with all the digits.
"""

import mpmath
import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.descriptions import random_description
from support.forms import RICCATI, epsilon, largest
from support.formulas import EPS, letters_of, norm
from support.mechanisms import build, rotors_on_some, uniform_batch
from support.oracle import reference

DIGITS = 120
PRECISIONS = ("single", "double", "extended", "quad", 50, 100)
DECIMALS = {"single": 7, "double": 15, "extended": 18, "quad": 31, 50: 50, 100: 100}
each_precision = pytest.mark.parametrize("precision", PRECISIONS)


@pytest.fixture(scope="module", params=["free root", "chain", "rotors"])
def case(request):
    """(model, its letters as formulas, the oracle in 120 digits): between them every sort of coordinate."""
    description = {
        "free root": lambda: random_description([-1, 0, 0], ["free", "universal", "screw"], 12),
        "chain": lambda: random_description([-1, 0, 1], ["gimbal", "cylindrical", "ball"], 13),
        "rotors": rotors_on_some,
    }[request.param]()
    multibody = build(description, 3)
    multibody.take_warnings()
    with mpmath.workdps(DIGITS):
        exact = reference.operators(description, multibody.q * mpmath.mpf(1), multibody.v)
        for name in (*RICCATI, "mass_matrix_inverse"):
            getattr(exact, name)  # made with these digits, and kept
    return multibody, letters_of(multibody), exact


def formulas(letters):
    """Expressions of every sort of plan, as formulas with bounds: sweeps, the Riccati sweep, inverses by theorem and by realization."""
    H, phi, M, J, P, K, psi = (getattr(letters, name) for name in "H phi M J P K psi".split())
    total = letters.MM + J
    return {
        "φ": phi,
        "ℳ": letters.MM,
        "P": P,
        "D": letters.D,
        "K": K,
        "ψ": psi,
        "Υ": letters.Upsilon,
        "Ω": letters.Omega,
        "(ℳ + J)⁻¹": total.inv(),
        "[I - HψK]*": (letters.I - H @ psi @ K).T,
        "(ℳ + J + 0.1 I)⁻¹": (total + 0.1 * letters.I).inv(),
        "(P + 0.5 M)⁻¹": (P + M * 0.5 + letters.constant(np.eye(len(M.value)), M.op.domain, M.op.codomain)).inv(),
        "blockdiag(φMφ*)": (phi @ M @ phi.T).blockdiag(),
    }


def in_digits(o):
    """The same formulas from the oracle in mpmath numbers."""
    inv, one = reference.inv, np.eye(len(o.D))
    total = o.mass_matrix + o.J
    whole, kept = o.phi @ o.M @ o.phi.T, 0 * o.M
    for s in o.states:
        kept[s, s] = whole[s, s]
    return {
        "φ": o.phi,
        "ℳ": o.mass_matrix,
        "P": o.P,
        "D": o.D,
        "K": o.K,
        "ψ": o.psi,
        "Υ": o.Upsilon,
        "Ω": o.Omega,
        "(ℳ + J)⁻¹": inv(total),
        "[I - HψK]*": (one - o.H @ o.psi @ o.K).T,
        "(ℳ + J + 0.1 I)⁻¹": inv(total + mpmath.mpf(0.1) * one),
        "(P + 0.5 M)⁻¹": inv(o.P + o.M * 0.5 + o.I),
        "blockdiag(φMφ*)": kept,
    }


def test_expressions_have_the_digits_of_their_precision(case):
    """Each error is within the bound in that epsilon, and no rung is stuck at the one below: 100 digits mean 1e-95."""
    multibody, letters, exact = case
    with mpmath.workdps(DIGITS):
        expected, made = in_digits(exact), formulas(letters)
        for name, formula in made.items():
            error = {}
            for precision in PRECISIONS:
                got = formula.op.at(multibody.q, precision=precision).dense(dtype=object)
                assert got.dtype == object and isinstance(got.flat[0], mpmath.mpf)
                error[precision] = largest(got - expected[name])
                bound = formula.bound * epsilon(precision) / EPS
                assert error[precision] <= bound, f"{name} in {precision}: off by {error[precision]:.1e}, bound {bound:.1e}"
            assert error[100] <= 1e-95 * (1 + largest(expected[name]))
            for narrow, wide in zip(PRECISIONS, PRECISIONS[1:], strict=False):
                both = f"{name}: {error[narrow]:.1e} in {narrow}, {error[wide]:.1e} in {wide}"
                assert error[wide] <= 1e4 * error[narrow] * epsilon(wide) / epsilon(narrow) or error[narrow] == 0, both


@each_precision
def test_products_with_arrays(case, precision):
    """The double that is returned is the wider number rounded once."""
    multibody, letters, exact = case
    made = formulas(letters)
    with mpmath.workdps(DIGITS):
        expected = in_digits(exact)
        for name, formula in made.items():
            x = np.random.default_rng(1).uniform(-1, 1, formula.value.shape[1])
            got = formula.op.at(multibody.q, precision=precision) @ x
            assert got.dtype == float
            bound = np.sqrt(len(x)) * formula.bound * epsilon(precision) / EPS
            wanted = expected[name] @ x
            assert all(abs(g - w) <= bound + EPS / 2 * abs(w) * (1 + 1e-9) for g, w in zip(got, wanted, strict=True)), name


@each_precision
def test_reductions(case, precision):
    multibody, letters, exact = case
    with mpmath.workdps(DIGITS):
        scale = epsilon(precision) / EPS
        total = letters.MM + letters.J
        n, inverse = len(total.value), norm(np.linalg.inv(total.value))
        logarithm = mpmath.log(mpmath.det(mpmath.matrix((exact.mass_matrix + exact.J).tolist())))
        for op in (total.op, letters.D.op):
            moved = 8 * inverse * (total.error + n * EPS * norm(total.value)) * n * scale + EPS * abs(float(logarithm)) + n * EPS * scale
            assert abs(float(op.logdet().at(multibody.q, precision=precision)) - logarithm) <= moved
        trace = np.trace(exact.P)
        off = abs(float(letters.P.op.trace().at(multibody.q, precision=precision)) - trace)
        assert off <= n * letters.P.bound * scale + EPS * abs(trace)
        size = mpmath.sqrt(sum(x * x for x in exact.Upsilon.flat))
        bound = 6 * n * letters.Upsilon.bound * scale + EPS * size
        assert abs(float(letters.Upsilon.op.norm().at(multibody.q, precision=precision)) - size) <= bound
        diagonal = total.inv().op.at(multibody.q, precision=precision).diagonal()
        off = largest(diagonal - np.diag(exact.mass_matrix_inverse))
        assert off <= total.inv().bound * scale + EPS * np.abs(diagonal).max()


@each_precision
def test_forward_dynamics(case, precision):
    """At least as wide as a double: right to the last bit but one. Single: to what its epsilon makes of it."""
    multibody, letters, exact = case
    tau = np.random.default_rng(2).normal(size=multibody.nv)
    with mpmath.workdps(DIGITS):
        wanted = reference.forward_dynamics(multibody.description(), multibody.q * mpmath.mpf(1), multibody.v, tau)
        got = multibody.forward_dynamics(multibody.q, multibody.v, tau, precision=precision)
        o = letters.o
        size = norm(o.H @ o.phi) * (norm(o.M @ o.a) + norm(o.b)) * (1 + norm(o.phi)) + norm(tau)
        bound = 8 * letters._grown * norm(o.mass_matrix_inverse) * size * epsilon(precision) / EPS
        assert all(abs(g - w) <= bound + EPS / 2 * abs(w) * (1 + 1e-9) for g, w in zip(got, wanted, strict=True))
        inverse = multibody.mass_matrix_inverse(multibody.q, precision=precision)
        total = letters.MM + letters.J
        assert largest(inverse - exact.mass_matrix_inverse) <= total.inv().bound * epsilon(precision) / EPS + EPS * norm(inverse)


@pytest.mark.parametrize("precision", ["single", "extended", "quad", 50])
def test_batches(precision):
    multibody = build(random_description([-1, 0, 0], ["free", "universal", "pin"], 14), 1)
    Q, V = uniform_batch(multibody, 3, 4)
    tau = np.random.default_rng(0).normal(size=V.shape)
    P, K, Omega, H, phi, M = multibody.soa("P K Omega H phi M")
    inverse = (H @ phi @ M @ phi.T @ H.T).inv()
    for op in (P, K, Omega, inverse):
        whole = op.at(Q, precision=precision)
        values = whole.dense(dtype=object)
        assert values.shape == (3, *op.shape) and whole.dense().dtype == float
        for i, q in enumerate(Q):
            assert np.array_equal(values[i], op.at(q, precision=precision).dense(dtype=object))
    assert np.array_equal(inverse.at(Q, precision=precision) @ tau,
                          [inverse.at(q, precision=precision) @ t for q, t in zip(Q, tau, strict=True)])  # fmt: skip
    whole = multibody.forward_dynamics(Q, V, tau, precision=precision)
    single = [multibody.forward_dynamics(q, v, t, precision=precision) for q, v, t in zip(Q, V, tau, strict=True)]
    # packs may round in another order; what is wider than a double is rounded to the same one, except for a rare tie
    assert np.abs(whole - single).max() <= 1e4 * max(epsilon(precision), 1e-4 * EPS) * (1 + np.abs(single).max())


def test_digits_that_there_are_not():
    """60 digits: told which there are, and where more come from."""
    multibody = pc.chain(2)
    x = np.ones(2)
    for wrong in (60, 200, 0, "60 digits", None):
        for call in (
            lambda: multibody.forward_dynamics(x, x, x, precision=wrong),  # noqa: B023 - called before the next
            lambda: multibody.soa.D.at(x, precision=wrong),  # noqa: B023 - called before the next
            lambda: multibody.mass_matrix_inverse(x, precision=wrong),  # noqa: B023 - called before the next
        ):
            with pytest.raises((pc.Error, TypeError)) as error:
                pytest.fail(str(call()))
            text = str(error.value)
            assert "precision" in text and "50" in text and "100" in text and "quad" in text, text
            if wrong in (60, 200):
                assert str(wrong) in text and "reference" in text, text


@each_precision
def test_digits_by_number_or_name(precision):
    """50 and "50" are the same; a binding tells what it is bound to."""
    multibody = pc.chain(2)
    q = np.array([0.3, 0.4])
    D = multibody.soa.D.at(q, precision=precision)
    assert np.array_equal(D.dense(dtype=object), multibody.soa.D.at(q, precision=str(precision)).dense(dtype=object))
    assert str(precision) in [str(name) for name in _core.precisions()]


def test_numbers_keep_their_digits_outside_of_mpmath_contexts():
    """The digits are in the numbers, whatever mpmath's own precision is at the time."""
    multibody = build(random_description([-1, 0], ["pin", "ball"], 15), 2)
    values = multibody.soa.D.at(multibody.q, precision=100).dense(dtype=object)
    with mpmath.workdps(30):
        again = multibody.soa.D.at(multibody.q, precision=100).dense(dtype=object)
    assert np.array_equal(values, again)
    with mpmath.workdps(DIGITS):
        exact = reference.operators(multibody.description(), multibody.q * mpmath.mpf(1)).D
        assert largest(again - exact) <= 1e-97 * largest(exact)


def test_wider_is_the_next_rung():
    names = [str(name) for name in _core.precisions()]
    assert [str(_core.wider(name)) for name in _core.precisions()[:-1]] == names[1:]
    assert all(epsilon(name) <= 10.0 ** (1 - DECIMALS[int(name) if name.isdigit() else name]) for name in names)
