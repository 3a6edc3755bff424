"""Bounds on residuals from sizes, norms and epsilon, derived instead of fitted to measurements.

A product F₁F₂…Fₘ is applied factor by factor. The rounding of step i is at most a few eps times ‖Fᵢ‖‖Fᵢ₊₁…Fₘ‖ and reaches the result
through F₁…Fᵢ₋₁; so the product is off by at most

    c · eps · m · maxᵢ ‖F₁…Fᵢ₋₁‖ ‖Fᵢ‖ ‖Fᵢ₊₁…Fₘ‖

with c the number of roundings of an entry in one sweep: six products per body, along a path of the tree. A resolvent φ rounds at
every body of the sweep: ‖F₁…φ‖‖E‖‖φ…Fₘ‖. An inverse X⁻¹ propagates the error of X: ‖F₁…X⁻¹‖ size(X) ‖X⁻¹…Fₘ‖. A sum adds. Values of the
Riccati sweep (P, D, G, K, ψ, Υ, Ω) carry that sweep's rounding: the downdate P⁺ = P - GDG* rounds at the size of P, so D(k) at that of
H(M + EPE*)H* + J, the inertia with the next outboard hinges locked. Its terms may be larger than itself, far from the
hinge; see `Sizes.amplification`. The amplification is the largest ratio of this inertia to D, in the frame in which each
sweep is made. Residuals are judged relative to the larger side, numbers relative to their terms.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core
from .vocabulary import is_number

EPSILON = _core.epsilons()
"""Epsilon of each precision by name."""
CONSTANT = 4.0
"""Roundings per product not counted above: forming the entry of a letter, adding it up, two sides."""

_NUMBERS = _core.euclidean(1)
"""The domain of a vector."""
_RICCATI = {"P", "P_plus", "D", "G", "K", "tau", "tau_bar", "E_psi", "psi", "psi_tilde", "Upsilon", "Omega", "Lambda"}


class Sizes:
    """Cached norms of expressions at one state, and their rounding errors.

    With `double`, norms of small expressions come from dense matrices of their parts: there are as many products as places in a
    statement, and planning each of them takes longer. The rounding error of such a matrix is counted along with it, and added to
    its norm.
    """

    def __init__(self, bind: Callable[[Any], Any], double: bool = False):
        self._bind, self._double = bind, double
        self._norms: dict[Any, tuple[float, float | None]] = {}
        self._least, self._uncounted, self._rough = False, False, False
        self._norms_with_vectors: dict[Any, float] = {}
        self._matrices: dict[Any, tuple[np.ndarray, float]] = {}
        self._amplification: dict[Any, float] = {}
        self._vectors: dict[str, Any] = {}

    def give(self, vectors: dict[str, Any]) -> None:
        """Set the values of named vectors from here on."""
        if vectors != self._vectors:
            self._vectors = vectors
            self._norms_with_vectors.clear()

    def norm(self, operator: _core.Operator) -> float:
        """Return the Frobenius norm, estimated by a few random vectors if the operator is large."""
        if operator.kind == "identity":
            return float(np.sqrt(operator.shape[0]))
        if operator not in self._norms:
            if operator in self._norms_with_vectors or _has_vectors(operator):
                if operator not in self._norms_with_vectors:
                    self._norms_with_vectors[operator] = self._norm_with_vectors(operator)
                self._uncounted = True
                return self._norms_with_vectors[operator]
            self._norms[operator] = self._norm(operator)
        norm, off = self._norms[operator]
        if off is None:
            self._uncounted = True
            return norm
        self._rough |= off > 0.1 * norm
        return max(0.0, norm - off) if self._least else norm + off

    def of_sides(self, lhs: Any, rhs: Any) -> tuple[float, bool]:
        """Return the size of both sides, and True if it is known to a factor of two."""
        self._uncounted = self._rough = False
        size = self.size(lhs) + self.size(rhs)
        counted = not self._uncounted
        if counted and self._rough:
            self._least = True
            counted = size <= 2 * (self.size(lhs) + self.size(rhs))
            self._least = False
        return size, counted

    def _norm(self, operator: _core.Operator) -> tuple[float, float | None]:
        """Return the norm of an expression, and its rounding error if it is counted."""
        n = operator.shape[1]
        if n > PROBE_ABOVE:
            return float(np.linalg.norm(self._bind(operator) @ probes(n)) / np.sqrt(PROBES)), None
        if self._double and max(operator.shape) <= DENSE_BELOW:
            try:
                matrix, off = self._matrix(operator)
                return float(np.linalg.norm(matrix)), off
            except (_core.SingularOperatorError, _core.SingularHingeError):
                pass  # a part may have no value although the whole has one
        return float(self._bind(operator).norm()), None

    def _matrix(self, operator: _core.Operator) -> tuple[np.ndarray, float]:
        """Return the matrix of an expression from the matrices of its parts, and its possible error, as a norm."""
        if operator not in self._matrices:
            self._matrices[operator] = self._made(operator)
        return self._matrices[operator]

    def _made(self, operator: _core.Operator) -> tuple[np.ndarray, float]:
        eps = EPSILON["double"]
        parts = [self._matrix(child) for child in operator.children]
        match operator.kind:
            case "product":
                made, off = parts[0]
                size = np.linalg.norm(made)
                for factor, its in parts[1:]:
                    own = np.linalg.norm(factor)
                    off = off * (own + its) + size * (its + len(factor) * eps * own)
                    made = made @ factor
                    size = np.linalg.norm(made)
            case "sum":
                made = np.sum([matrix for matrix, _ in parts], axis=0)
                off = sum(its + len(parts) * eps * np.linalg.norm(matrix) for matrix, its in parts)
            case "scaled":
                c = float(operator.coefficient)
                made, off = c * parts[0][0], abs(c) * parts[0][1]
            case "transpose":
                made, off = parts[0][0].T, parts[0][1]
            case _:
                made = self._bind(operator).dense()
                off = self._off(operator, float(np.linalg.norm(made)), parts[0][1] if parts else 0.0)
        return made, float(off)

    def _off(self, operator: _core.Operator, norm: float, inner: float) -> float:
        """Return the possible error of an operator that is not a product or sum: from its own sweep, and from `inner` of its operand."""
        match operator.kind:
            case "inverse":
                return norm**2 * inner
            case "sqrt":  # |√(x + e) - √x| is at most √e
                return float(np.sqrt(inner))
            case "function":  # linear in its operand: crm(x), lower½(X)
                return 2 * inner
            case "blockdiag":
                return inner
        growth = max([1.0, *(self.amplification(s) for s in sources(operator, True))])
        return CONSTANT * max([6.0, *(sweep(s) for s in sources(operator))]) * EPSILON["double"] * growth * norm

    def _norm_with_vectors(self, operator: _core.Operator) -> float:
        # A column is recognized by its space: a row on a model of one degree of freedom also has one column.
        if _NUMBERS not in (operator.domain, operator.codomain):
            norms = [self.norm(c) for c in operator.children]
            match operator.kind:  # an outer product, or a sum of some: at most
                case "product":
                    return float(np.prod(norms))
                case "sum":
                    return sum(norms)
                case "scaled":
                    return abs(float(operator.coefficient)) * norms[0]
                case "transpose":
                    return norms[0]
                case "function":  # crm(x) and its like
                    return 2 * norms[0]
        column = operator if operator.domain == _NUMBERS else operator.T
        return float(np.linalg.norm(self._bind(column).value(**self._vectors)))

    def size(self, side: Any) -> float:
        """Return the error of a side per unit of c · eps."""
        if is_number(side):
            return abs(float(side))
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
        """Return the effect of the rounding of factor i on the product."""
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
        kind, value, operand, terms = side.kind, side.number, side.operand, side.terms
        if operand is None:
            if not terms:
                return float(abs(value))
            own = [self._scalar(t) for t in terms]
            if kind == "product":
                sizes = [self.terms(t) for t in terms]
                return float(sum(x * np.prod(sizes[:i] + sizes[i + 1 :]) for i, x in enumerate(own)))
            if kind == "reciprocal":
                return own[0] * self.terms(side) ** 2
            return float(abs(value) if kind == "scaled" else 1.0) * sum(own)
        if kind == "logdet":  # ln|det X| moves by tr(X⁻¹ δX)
            return max(1.0, self.size(operand) * self.norm(operand.inv()))
        return self.size(operand)

    def terms(self, side: _core.Scalar) -> float:
        """Return the size of the terms of a number: the diagonal of a trace, one for a logarithm, scaling a relative error."""
        kind, value, operand, terms = side.kind, side.number, side.operand, side.terms
        if operand is None:
            if not terms:
                return float(abs(value))
            if kind == "product":
                return float(np.prod([self.terms(t) for t in terms]))
            if kind == "reciprocal":
                return 1 / max(abs(float(self._bind(terms[0]))), 1e-300)
            return float(abs(value) if kind == "scaled" else 1.0) * sum(self.terms(t) for t in terms)
        if kind == "trace":
            return float(self._diagonal(operand).sum())
        if kind == "logdet":
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
            largest = (columns * locked[:, None]).max(axis=0, initial=0.0)
            bodies = {body: where for _, where, body in M.codomain.blocks}
            reach = rows @ largest  # hinges may be numbered differently from bodies
            for _, hinge, body in H.codomain.blocks if len(bodies) == len(H.codomain.blocks) else ():
                reach[hinge] = rows[hinge, : bodies[body].stop - bodies[body].start] @ locked[bodies[body]]
            felt = reach**2 + self._diagonal(J)
            self._amplification[source] = float(max([1.0, *(felt * self._diagonal(D.inv()))]))
        return self._amplification[source]

    def _diagonal(self, operator: _core.Operator) -> np.ndarray:
        return np.abs(np.asarray(self._bind(operator).diagonal(), float))


def sweep(source: Any) -> float:
    """Return the number of roundings of an entry in one sweep: six products per body along the longest path to the base."""
    depth: list[int] = []
    for parent in source.parents:
        depth.append(depth[parent] + 1 if parent >= 0 else 1)
    return 6.0 * max([1, *depth])


def _has_vectors(operator: _core.Operator) -> bool:
    return operator.kind == "vector" or any(_has_vectors(c) for c in operator.children)


PROBE_ABOVE = 400
"""Largest number of columns of operators compared entry by entry; larger ones are compared on random vectors."""
PROBES = 8
DENSE_BELOW = 120
"""Largest size for which the dense matrix of a product costs less than its plan."""


def probes(dimension: int) -> np.ndarray:
    """Return random vectors of signs (dimension, PROBES): the mean of |Ax|² over them is the squared Frobenius norm."""
    return np.random.default_rng(dimension).choice([-1.0, 1.0], (dimension, PROBES))


def sources(side: Any, riccati: bool = False) -> list[Any]:
    """Return the models of a side's letters; with `riccati`, only of letters from the Riccati sweep."""
    if isinstance(side, _core.Scalar):
        return [s for e in side.operands() for s in sources(e, riccati)]
    if not isinstance(side, _core.Operator):
        return []
    if not side.children:
        return list(side.sources) if not riccati or side.name in _RICCATI else []
    return [s for c in side.children for s in sources(c, riccati)]


class Roundings:
    """Possible effect of rounding on the difference of two sides, from norms at one state.

    Attributes
    ----------
    size : errors of both sides per unit of c · eps, without the amplification by the Riccati sweep
    terms : for numbers, the size of their terms; 0 for operators
    growth : amplification of roundings by the Riccati sweep, 1 if no side has a letter from it
    counted : True if the size is correct to a factor of two, including rounding of the norms
    """

    def __init__(self, lhs: Any, rhs: Any, sizes: Sizes):
        self.size, self.counted = sizes.of_sides(lhs, rhs)
        self.terms = max(sizes.terms(lhs), sizes.terms(rhs)) if isinstance(lhs, _core.Scalar) else 0.0
        self.growth = max([1.0, *(sizes.amplification(s) for s in dict.fromkeys(sources(lhs, True) + sources(rhs, True)))])
        self._sweep = max([6.0, *(sweep(s) for s in dict.fromkeys(sources(lhs) + sources(rhs)))])

    def absolute(self, precision: str | int) -> float:
        """Return the bound on |lhs - rhs| itself."""
        return CONSTANT * self._sweep * EPSILON[precision] * self.size * self.growth

    def bound(self, relative_size: float, precision: str | int) -> float:
        """Return the bound on |lhs - rhs| over a scale; `relative_size` is the size over that scale."""
        return CONSTANT * self._sweep * EPSILON[precision] * max(1.0, relative_size) * self.growth
