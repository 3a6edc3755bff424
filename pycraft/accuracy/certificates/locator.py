"""Locator of lost digits: the error of every D(k), and the condition of a square operator."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mpmath
import numpy as np

from ... import _core
from ..exact import BITS, EXACT, relative_error
from ..rungs import Rung, epsilon
from .certificate import HingeLoss


def runs_articulated_sweep(expr: Any, request: str) -> bool:
    """Return True if the evaluation plan contains the sweep that computes P(k), D(k) and G(k).

    Parameters
    ----------
    expr : an operator or scalar expression
    request : request of an operator, as in `plan`: "apply", "dense"; a scalar has its own
    """
    if isinstance(expr, _core.Scalar):
        if expr.operand is not None:
            return runs_articulated_sweep(expr.operand, expr.kind)
        return any(runs_articulated_sweep(term, request) for term in expr.terms)
    return any("Riccati sweep" in step["text"] for step in expr.plan(request).steps)


def hinge_losses(source: _core.SkoSource, q: Any, v: Any, rung: Rung, reference: Any) -> Iterator[HingeLoss]:
    """Return the relative error of each D(k), in the form and precision used, against the wider one: a locator of lost digits, not a proof.

    The error of D(k) is ‖L⁻¹δD L⁻*‖₂ with D = LL*, also for a hinge with coordinates in different units. The effect of a wrong D(k)
    on the result depends on the rest of the model; and other sweeps may also lose digits.
    """
    D = source.symbol("D")
    sizes = [n for n in source.dof if n]
    names = [name for name, n in zip(getattr(source, "hinge_names", source.body_names), source.dof, strict=True) if n]
    if not sizes:
        return
    width = max(sizes)
    ones = np.vstack([np.eye(n, width) for n in sizes])  # one column for all first coordinates of hinges, one for all second ones
    columns = D @ _core.constant(ones, _core.euclidean(width), D.domain, "1")
    used = columns.at(q, v, form=rung.form, precision=rung.precision).dense(dtype=object)
    exact = columns.at(q, v, form=EXACT, precision=reference).dense(dtype=object)
    start = 0
    for name, n in zip(names, sizes, strict=True):
        block = slice(start, start + n)
        error = _block_error(used[block, :n], exact[block, :n])
        yield HingeLoss(name, error, max(0.0, float(np.log10(error / (epsilon(rung.precision) / 2)))) if error else 0.0)
        start += n


def condition_estimate(operator: _core.Operator) -> float:
    """Return an estimate of the 1-norm condition number of a square operator, from products and solves, none of them dense.

    SciPy's block 1-norm estimator (Higham and Tisseur 2000): a lower bound that is rarely off by more than a small factor.
    """
    from scipy.sparse.linalg import onenormest

    from ...interop.scipy import to_scipy

    columns = min(4, operator.shape[0])
    return float(onenormest(to_scipy(operator), t=columns) * onenormest(to_scipy(operator.inv()), t=columns))


def _block_error(used: np.ndarray, exact: np.ndarray) -> float:
    with mpmath.workprec(BITS):
        off, size = mpmath.matrix((used - exact).tolist()), mpmath.matrix(exact.tolist())
        if exact.size == 1:
            return float(abs(off[0] / size[0])) if size[0] else float("inf") if off[0] else 0.0
        try:
            root = mpmath.cholesky((size + size.T) / 2)
        except ValueError:  # not positive definite
            return relative_error(used, exact)
        scaled = mpmath.inverse(root) * off * mpmath.inverse(root).T
    return float(np.linalg.norm(np.array(scaled.tolist(), float), 2))
