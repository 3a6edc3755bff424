"""Fourth-order differences of an expression in extended precision, which derivatives by rule are compared with.

A fourth-order difference of step h has a truncation error of h⁴ f⁽⁵⁾/30 and a rounding error of about 2 eps |f| / h in the state (q is a
double, moved by h on the group). With h = 2⁻¹⁰ both are near 1e-12 of the operators' own size; operators that invert D are amplified by
its condition, and TOLERANCE leaves a factor of 100.
"""

import numpy as np

import pycraft as pc

TOLERANCE, STEP = 1e-9, 2.0**-10


def difference(f, h=STEP):
    """Fourth order, of a function of a step along the direction."""
    return np.array((8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h), float)


def value(op, *state):
    bound = op.at(*state, precision="extended")
    return bound.value(dtype=object) if op.shape[1] == 1 and op.domain == pc.euclidean(1) else bound.dense(dtype=object)


def along(model, op, i, q, v):
    e = np.eye(model.nv)[i]
    return difference(lambda t: value(op, model.integrate(q, t * e), v))


def numbers(op, q, v):
    bound = op.at(q, v)
    return bound.value() if op.domain == pc.euclidean(1) else bound.dense()


def assert_close(got, expected, label):
    assert got.shape == expected.shape
    error = np.abs(got - expected).max(initial=0) / (1 + np.abs(expected).max(initial=0))
    assert error <= TOLERANCE, f"{label}: off by {error:.1e}"
