"""SciPy's linear operators, in both directions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core

if TYPE_CHECKING:
    from scipy.sparse.linalg import LinearOperator


def to_scipy(operator: _core.Operator) -> LinearOperator:
    """Return the operator as a `scipy.sparse.linalg.LinearOperator` with matvec, rmatvec, matmat and rmatmat; nothing is formed.

    Examples
    --------
    >>> import pycraft as pc
    >>> from scipy.sparse.linalg import cg
    >>> arm = pc.chain(4)
    >>> H, phi, M = arm.soa("H phi M")
    >>> x, info = cg(pc.interop.to_scipy(H @ phi @ M @ phi.T @ H.T), np.ones(4), rtol=1e-12)
    >>> info
    0
    """
    from scipy.sparse.linalg import LinearOperator

    if not isinstance(operator, _core.Operator):
        raise _core.SpaceError(f"to_scipy takes an operator of a model, as arm.soa.phi, not {operator!r:.60}")
    if operator.domain is None:
        raise _core.SpaceError("I has no space yet: combine it with an operator first")
    if operator.batch is not None:
        raise _core.EvaluationError("a SciPy operator acts at one state; bind one with .at(q)")
    transposed = operator.T

    def flat(op: _core.Operator):
        return lambda x: op @ np.ascontiguousarray(x)

    return LinearOperator(
        operator.shape,
        matvec=flat(operator),
        rmatvec=flat(transposed),
        matmat=flat(operator),
        rmatmat=flat(transposed),
        dtype=np.float64,
    )


def from_scipy(linear_operator: Any, domain: _core.Space, codomain: _core.Space, name: str = "L") -> _core.Operator:
    """Return a SciPy linear operator, sparse or dense matrix as an operator between spaces of a model.

    A `LinearOperator` is applied as it is, in double precision, and its inverse is dense (`explain()` shows it); a matrix becomes a
    constant, which keeps its block structure.

    SpaceError for another shape, and for invalid spaces; ModelError for anything but an operator or a matrix of numbers.
    """
    from scipy.sparse.linalg import LinearOperator

    if not isinstance(name, str):
        raise _core.ModelError(f"an operator is named by a string, not by {name!r:.60}")
    for what, space in (("domain", domain), ("codomain", codomain)):
        if not isinstance(space, _core.Space):
            raise _core.SpaceError(f"from_scipy: {what} is a space, as arm.soa.phi.{what}, not {space!r:.60}")
    given = linear_operator
    if not isinstance(given, LinearOperator):
        given = _core.real_array(given.toarray() if hasattr(given, "toarray") else given, f"from_scipy: {name!r}")
    shape = (codomain.dimension, domain.dimension)
    if tuple(given.shape) != shape:
        raise _core.SpaceError(f"{name!r} has shape {tuple(given.shape)}; from {domain} to {codomain} it takes {shape}")
    if not isinstance(given, LinearOperator):
        return _core.constant(given, domain, codomain, name)
    return _core.external(linear_operator.matmat, linear_operator.rmatmat, domain, codomain, name)
