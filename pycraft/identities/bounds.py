"""How large a residual may be: a bound from sizes, norms and epsilon, derived and not tuned to what was measured.

A product F₁F₂…Fₘ is applied factor by factor. The rounding of step i is at most a few eps times ‖Fᵢ‖‖Fᵢ₊₁…Fₘ‖ and reaches the result
through F₁…Fᵢ₋₁; so the product is off by at most

    c · eps · m · maxᵢ ‖F₁…Fᵢ₋₁‖ ‖Fᵢ‖ ‖Fᵢ₊₁…Fₘ‖

with c the number of roundings that an entry meets in one sweep: six products a body, along a path of the tree. A resolvent φ rounds at
every body of the sweep: ‖F₁…φ‖‖E‖‖φ…Fₘ‖. An inverse X⁻¹ passes the error of X on: ‖F₁…X⁻¹‖ size(X) ‖X⁻¹…Fₘ‖. A sum adds. Values of the
Riccati sweep (P, D, G, K, ψ, Υ, Ω) carry that sweep's rounding: the downdate P⁺ = P - GDG* rounds at the size of P, so D(k) at that of
H(M + EPE*)H* + J, the inertia it would have with the next hinges outboard locked. Its terms may be larger than itself, far from the
hinge; see `Sizes.amplification`. The largest ratio of that to D amplifies, in the frame in which each
sweep is made. Residuals are judged relative to the larger side, numbers relative to their terms.
"""

from __future__ import annotations

from collections.abc import Callable
from numbers import Real
from typing import Any

import numpy as np

from .. import _core

EPSILON = _core.epsilons()
"""Epsilon of each precision by name."""
CONSTANT = 4.0
"""Roundings per product that the count above leaves out: forming the entry of a letter, adding it up, two sides."""

_NUMBERS = _core.euclidean(1)
"""The domain of a vector."""
_TRACE, _LOGDET, _SCALED, _PRODUCT, _RECIPROCAL = 1, 2, 5, 6, 7
"""Kinds of scalar expressions, as the core numbers them."""
_RICCATI = {"P", "P_plus", "D", "G", "K", "tau", "tau_bar", "E_psi", "psi", "psi_tilde", "Upsilon", "Omega", "Lambda"}


class Sizes:
    """Norms of expressions at one state, remembered; and what rounding makes of them."""

    def __init__(self, bind: Callable[[_core.Operator], _core.Operator]):
        self._bind = bind
        self._norms: dict[Any, float] = {}
        self._amplification: dict[Any, float] = {}
        self._vectors: dict[str, Any] = {}

    def give(self, vectors: dict[str, Any]) -> None:
        """The values of named vectors from here on."""
        if vectors != self._vectors:
            self._vectors = vectors
            self._norms = {e: x for e, x in self._norms.items() if not _has_vectors(e)}

    def norm(self, operator: _core.Operator) -> float:
        """Frobenius norm, estimated by a few random vectors where the operator is large."""
        if operator.kind == "identity":
            return float(np.sqrt(operator.shape[0]))
        if operator not in self._norms:
            if _has_vectors(operator):
                self._norms[operator] = self._norm_with_vectors(operator)
            else:
                self._norms[operator] = _norm(self._bind(operator))
        return self._norms[operator]

    def _norm_with_vectors(self, operator: _core.Operator) -> float:
        # A column is told by its space: a row on a model of one degree of freedom has one column as well.
        if _NUMBERS not in (operator.domain, operator.codomain):
            norms = [self.norm(c) for c in operator.children]
            match operator.kind:  # an outer product, or what is made of some: at most
                case "product":
                    return float(np.prod(norms))
                case "sum":
                    return sum(norms)
                case "scaled":
                    return abs(operator.coefficient) * norms[0]
                case "transpose":
                    return norms[0]
                case "function":  # crm(x) and its like
                    return 2 * norms[0]
        column = operator if operator.domain == _NUMBERS else operator.T
        return float(np.linalg.norm(self._bind(column).value(**self._vectors)))

    def size(self, side: Any) -> float:
        """The error of a side per unit of c · eps."""
        if isinstance(side, Real):
            return float(abs(side))
        if isinstance(side, _core.Scalar):
            return self._scalar(side)
        children = side.children
        match side.kind:
            case "sum":
                return sum(self.size(c) for c in children)
            case "product":
                return len(children) * max(self._step(children, i) for i in range(len(children)))
            case "scaled":
                return abs(side.coefficient) * self.size(children[0])
            case "zero":
                return 0.0
            case _:
                return self._step([side], 0)

    def _step(self, factors: list[_core.Operator], i: int) -> float:
        """What the rounding of factor i makes of the product."""
        factor = factors[i]
        base = factor.children[0] if factor.kind == "transpose" else factor
        if base.kind in ("sum", "scaled", "product"):
            own = self.size(factor if factor.kind != "transpose" else base)
        elif base.kind == "inverse":
            own = self.size(base.children[0])
            return self._product(factors[: i + 1]) * own * self._product(factors[i:])
        elif base.name in ("phi", "psi", "phi_tilde", "psi_tilde"):
            edge = self.norm(base.sources[0].symbol("E" if base.name.startswith("phi") else "E_psi"))
            # a bare resolvent: its own norm counts once for the sweep that made it
            return max(self._product(factors[: i + 1]) * edge * self._product(factors[i:]), self._product(factors))
        elif base.kind in ("blockdiag", "sqrt"):
            inner = self.size(base.children[0])
            own = inner if base.kind == "blockdiag" else inner / max(self.norm(base), 1e-300)
        elif base.kind == "function":  # linear in its operand: crm(x), lower½(X)
            own = 2 * self.size(base.children[0])
        else:
            own = self.norm(base)
        return self._product(factors[:i]) * own * self._product(factors[i + 1 :])

    def _product(self, factors: list[_core.Operator]) -> float:
        if not factors:
            return 1.0
        return self.norm(factors[0] if len(factors) == 1 else _core._make("product", factors, 1.0))

    def _scalar(self, side: _core.Scalar) -> float:
        kind, value, operand, terms = side._parts()
        if operand is None:
            if not terms:
                return float(abs(value))
            own = [self._scalar(t) for t in terms]
            if kind == _PRODUCT:
                sizes = [self.terms(t) for t in terms]
                return float(sum(x * np.prod(sizes[:i] + sizes[i + 1 :]) for i, x in enumerate(own)))
            if kind == _RECIPROCAL:
                return own[0] * self.terms(side) ** 2
            return float(abs(value) if kind == _SCALED else 1.0) * sum(own)
        if kind == _LOGDET:  # ln|det X| moves by tr(X⁻¹ δX)
            return max(1.0, self.size(operand) * self.norm(operand.inv()))
        return self.size(operand)

    def terms(self, side: _core.Scalar) -> float:
        """The size of what a number is a sum of: the diagonal of a trace, one for a logarithm, by which a relative error moves it."""
        kind, value, operand, terms = side._parts()
        if operand is None:
            if not terms:
                return float(abs(value))
            if kind == _PRODUCT:
                return float(np.prod([self.terms(t) for t in terms]))
            if kind == _RECIPROCAL:
                return 1 / max(abs(float(self._bind(terms[0]))), 1e-300)
            return float(abs(value) if kind == _SCALED else 1.0) * sum(self.terms(t) for t in terms)
        if kind == _TRACE:
            return float(self._diagonal(operand).sum())
        if kind == _LOGDET:
            return max(1.0, abs(float(self._bind(operand).logdet())))
        return self.norm(operand)

    def amplification(self, source: Any) -> float:
        """max over coordinates j of ((Σ_a |H(j,a)| √L(a,a))² + J(j,j)) D⁻¹(j,j), L = M + EPE*: the rounding of D over D."""
        if source not in self._amplification:
            H, M, E, P, J, D = (source.symbol(name) for name in ("H", "M", "E", "P", "J", "D"))
            locked = np.sqrt(self._diagonal(M + E @ P @ E.T))
            sizes = [where.stop - where.start for _, where, _ in M.codomain.blocks]
            columns = np.zeros((len(locked), max(sizes, default=0)))  # entry a of every body in column a: H has one block in a row
            columns[np.arange(len(locked)), [a for size in sizes for a in range(size)]] = 1
            rows = np.abs(np.asarray(self._bind(H) @ columns, float))
            largest = (columns * locked[:, None]).max(axis=0)
            bodies = {body: where for _, where, body in M.codomain.blocks}
            reach = rows @ largest  # where hinges are not numbered as the bodies are
            for _, hinge, body in H.codomain.blocks if len(bodies) == len(H.codomain.blocks) else ():
                reach[hinge] = rows[hinge, : bodies[body].stop - bodies[body].start] @ locked[bodies[body]]
            felt = reach**2 + self._diagonal(J)
            self._amplification[source] = float(max([1.0, *(felt * self._diagonal(D.inv()))]))
        return self._amplification[source]

    def _diagonal(self, operator: _core.Operator) -> np.ndarray:
        return np.abs(np.asarray(self._bind(operator).diagonal(), float))


def sweep(source: Any) -> float:
    """Roundings that an entry meets in one sweep: six products a body along the longest path to the base."""
    depth: list[int] = []
    for parent in source.parents:
        depth.append(depth[parent] + 1 if parent >= 0 else 1)
    return 6.0 * max([1, *depth])


def _has_vectors(operator: _core.Operator) -> bool:
    return operator.kind == "vector" or any(_has_vectors(c) for c in operator.children)


PROBE_ABOVE = 400
"""Columns up to which operators are compared entry by entry; larger ones are compared on random vectors."""
PROBES = 8


def probes(dimension: int) -> np.ndarray:
    """Random vectors of signs (dimension, PROBES): the mean of |Ax|² over them is the squared Frobenius norm."""
    return np.random.default_rng(dimension).choice([-1.0, 1.0], (dimension, PROBES))


def _norm(operator: _core.Operator) -> float:
    n = operator.shape[1]
    if n <= PROBE_ABOVE:
        return float(operator.norm())
    return float(np.linalg.norm(operator @ probes(n)) / np.sqrt(PROBES))


def sources(side: Any, riccati: bool = False) -> list[Any]:
    """The models whose letters a side mentions; only values that the Riccati sweep makes, if `riccati`."""
    if isinstance(side, _core.Scalar):
        return [s for e in side.operands() for s in sources(e, riccati)]
    if not isinstance(side, _core.Operator):
        return []
    if not side.children:
        return list(side.sources) if not riccati or side.name in _RICCATI else []
    return [s for c in side.children for s in sources(c, riccati)]


class Roundings:
    """What rounding can make of the difference of two sides, from norms at one state.

    Attributes
    ----------
    size : the errors of both sides per unit of c · eps, without what the Riccati sweep makes of them
    terms : of numbers, the size of what they are sums of; 0 of operators
    growth : what the Riccati sweep makes of its roundings, 1 where no side mentions a value of it
    """

    def __init__(self, lhs: Any, rhs: Any, sizes: Sizes):
        self.size = sizes.size(lhs) + sizes.size(rhs)
        self.terms = max(sizes.terms(lhs), sizes.terms(rhs)) if isinstance(lhs, _core.Scalar) else 0.0
        self.growth = max([1.0, *(sizes.amplification(s) for s in dict.fromkeys(sources(lhs, True) + sources(rhs, True)))])
        self._sweep = max([6.0, *(sweep(s) for s in dict.fromkeys(sources(lhs) + sources(rhs)))])

    def absolute(self, precision: str | int) -> float:
        """The bound on |lhs - rhs| itself."""
        return CONSTANT * self._sweep * EPSILON[precision] * self.size * self.growth

    def bound(self, relative_size: float, precision: str | int) -> float:
        """The bound on |lhs - rhs| over a scale, `relative_size` the size over that scale."""
        return CONSTANT * self._sweep * EPSILON[precision] * max(1.0, relative_size) * self.growth
