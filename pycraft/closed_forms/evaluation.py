"""Convert an operator expression to the sparse matrix of its closed form, in one walk over the expression."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import sympy

from .. import _core
from ..proofs.rational import Rationals, exact
from .sparse import Matrix
from .sparse_letters import Letters


def _require_unbound(e: Any, binding: Any) -> None:
    if binding is not None:
        raise _core.EvaluationError(f"{e.text()} is bound to a state; closed forms need expressions without .at(q)")


class Evaluation:
    """One walk over an expression. An I without a space is a scalar until it meets a matrix.

    Parameters
    ----------
    letters : of the mechanism
    field : the field of the entries; `.field` is its extension by the symbols and roots of the expression
    given : entries of vectors and constants by name
    sample : values of all symbols, for the sign of a root
    """

    def __init__(self, letters: Letters, field: Rationals, given: Mapping[str, Any], sample: Callable[[], dict[Any, float]]):
        self.field = field
        self._letters, self._given, self._sample = letters, given, sample
        self._known: dict[Any, Any] = {}

    def of(self, e: Any) -> Any:
        """Return the matrix of an expression; for one without a space, the factor before I."""
        if e not in self._known:
            self._known[e] = getattr(self, f"_{e.kind}", self._unknown)(e)
        return self._known[e]

    def _unknown(self, e: Any) -> Any:
        raise _core.EvaluationError(f"{e.text()}: an expression of kind {e.kind!r} has no closed form here")

    def _children(self, e: Any) -> list[Any]:
        """Return the children's matrices over one field."""
        made = [self.of(c) for c in e.children]
        field = self.field
        return [x if c.domain is None else x.lifted(field) for x, c in zip(made, e.children, strict=True)]

    # ------------------------------------------------------------------ leaves
    def _symbol(self, e: Any) -> Matrix:
        _require_unbound(e, e.letter.binding)
        return self._letters(e.name, e.letter.arguments)

    def _function(self, e: Any) -> Matrix:
        """Return block functions that derivatives introduce: crm, crf, mcross of a vector, the lower triangle with half its diagonal."""
        (x,) = self._children(e)
        if e.letter is None:
            made = self._blockwise(e.children[0], x, lambda block: block.lower_half())
            if made is None:
                raise _core.EvaluationError(f"{e.text()}: a lower half is taken body by body, of a block-diagonal operator")
            return made
        _require_unbound(e, e.letter.binding)
        return self._letters.function(e.name, x)

    def _identity(self, e: Any) -> Any:
        return 1 if e.domain is None else Matrix.identity(self.field, e.domain.dimension)

    def _zero(self, e: Any) -> Matrix:
        return Matrix.zeros(self.field, e.codomain.dimension, e.domain.dimension)

    def _vector(self, e: Any) -> Matrix:
        if e.name in self._given:
            return self._entries(self._given[e.name], e)
        return self._entries([sympy.Symbol(f"{e.name}{i + 1}", real=True) for i in range(e.codomain.dimension)], e)

    def _constant(self, e: Any) -> Matrix:
        if e.name in self._given:
            return self._entries(self._given[e.name], e)
        return self._entries([[exact(x) for x in row] for row in e.dense()], e)

    def _entries(self, entries: Any, e: Any) -> Matrix:
        """Return an array of expressions as a matrix of the expression's shape, over a field with all its symbols."""
        rows, columns = e.shape
        listed = entries.tolist() if isinstance(entries, sympy.MatrixBase | np.ndarray) else list(entries)
        flat = [sympy.sympify(x) for row in listed for x in (row if isinstance(row, list | tuple) else [row])]
        if len(flat) != rows * columns:
            raise _core.EvaluationError(f"{e.text()} is given {len(flat)} entries; it is an array ({rows}, {columns})")
        self.field = self.field.extended(flat)
        return Matrix.of(self.field, [flat[i * columns : (i + 1) * columns] for i in range(rows)], columns)

    def _external(self, e: Any) -> Matrix:
        raise _core.EvaluationError(f"{e.text()} is a Python function of numbers: it has no closed form")

    # ------------------------------------------------------------------ composed
    def _number(self, x: Any, dimension: int) -> Matrix:
        """Return a factor of I as a matrix."""
        field = self.field
        return Matrix.identity(field, dimension).scaled(field.element(x))

    def _sum(self, e: Any) -> Any:
        if e.domain is None:
            return sum(self.of(c) for c in e.children)
        parts = [self._number(x, e.domain.dimension) if c.domain is None else x for x, c in zip(self._children(e), e.children, strict=True)]
        field = self.field
        total = parts[0].lifted(field)
        for part in parts[1:]:
            total = total + part.lifted(field)
        return total

    def _product(self, e: Any) -> Any:
        parts, factor, made = self._children(e), 1, None
        for x, c in zip(parts, e.children, strict=True):
            if c.domain is None:
                factor = factor * x
            else:
                made = x if made is None else made @ x
        return factor if made is None else made if factor == 1 else made.scaled(made.field.element(factor))

    def _scaled(self, e: Any) -> Any:
        (x,), number = self._children(e), exact(e.coefficient)
        if e.domain is None:
            return number * x
        field = self.field = self.field.extended([number])
        return x.lifted(field).scaled(field.element(number))

    def _transpose(self, e: Any) -> Any:
        (x,) = self._children(e)
        return x if e.domain is None else x.T

    def _inverse(self, e: Any) -> Any:
        (x,) = self._children(e)
        if e.domain is None:
            return 1 / x
        if e.children[0].kind == "symbol" and e.children[0].name == "D":
            return self._letters("D_inverse")
        made = self._blockwise(e.children[0], x, lambda block: block.inverse())
        return x.inverse() if made is None else made

    def _blockdiag(self, e: Any) -> Any:
        (x,) = self._children(e)
        if e.domain is None:
            return x
        made = Matrix.zeros(x.field, *x.shape)
        for _, rows, body in e.codomain.blocks:
            for _, columns, other in e.domain.blocks:
                if body == other:
                    made.place(rows, columns, x.block(rows, columns))
        return made

    def _blockwise(self, e: Any, x: Matrix, make: Callable[[Matrix], Matrix]) -> Matrix | None:
        """Apply make(block) to each diagonal block of an operator known to have no others; None if that is not known."""
        rows, columns = e.codomain.blocks, e.domain.blocks
        if not e.is_block_diagonal or [r[1] for r in rows] != [c[1] for c in columns]:
            return None
        made = [make(x.block(where, where)) for _, where, _ in rows]
        field = self.field
        return Matrix.diagonal(field, [block.lifted(field) for block in made])

    def _sqrt(self, e: Any) -> Matrix:
        (x,) = self._children(e)
        made = self._blockwise(e.children[0], x, self._cholesky)
        if made is None:
            raise _core.EvaluationError(f"{e.text()}: a root is taken body by body, of a block-diagonal operator")
        return made

    def _cholesky(self, a: Matrix) -> Matrix:
        """Return L, lower triangular, with A = LL*: columns of the Schur complements over the roots of their pivots."""
        n, sample, columns = len(a.rows), self._sample(), []
        for j in range(n):
            pivot = a.rows[j].get(j)
            column = a.block(slice(0, n), slice(j, j + 1))
            if not pivot:
                if any(column.rows):
                    raise _core.EvaluationError("a root of an operator that is not positive semidefinite")
                columns.append(column)
                continue
            self.field, root = self.field.root(self.field.lift(pivot), sample)
            field = self.field
            column = column.lifted(field)
            columns.append(column.scaled(field.one / root))
            a = a.lifted(field) - (column @ column.T).scaled(field.one / field.lift(pivot))
        field = self.field
        rows = [{j: x for j, c in enumerate(columns) if (x := c.lifted(field).rows[i].get(0))} for i in range(n)]
        return Matrix(field, rows, n)
