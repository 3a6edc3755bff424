"""Sparse matrices of rational functions (`rational`), with exact elimination, for closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy

from .. import _core
from ..proofs.rational import Rationals


class Matrix:
    """A sparse matrix over the field: rows as dictionaries from column to nonzero element."""

    def __init__(self, field: Rationals, rows: list[dict[int, Any]], columns: int):
        self.field, self.rows, self.columns = field, rows, columns

    # ------------------------------------------------------------------ construction
    @classmethod
    def of(cls, field: Rationals, entries: Sequence[Sequence[Any]], columns: int | None = None) -> Matrix:
        """Return a matrix of SymPy expressions or numbers, given row by row."""
        rows = [{j: x for j, e in enumerate(row) if (x := field.element(e))} for row in entries]
        return cls(field, rows, len(entries[0]) if columns is None else columns)

    @classmethod
    def zeros(cls, field: Rationals, rows: int, columns: int) -> Matrix:
        return cls(field, [{} for _ in range(rows)], columns)

    @classmethod
    def identity(cls, field: Rationals, n: int) -> Matrix:
        return cls(field, [{i: field.one} for i in range(n)], n)

    @classmethod
    def diagonal(cls, field: Rationals, blocks: Sequence[Matrix]) -> Matrix:
        """Return the block diagonal of the given blocks."""
        rows: list[dict[int, Any]] = []
        at = 0
        for block in blocks:
            rows += [{at + j: x for j, x in row.items()} for row in block.rows]
            at += block.columns
        return cls(field, rows, at)

    def lifted(self, field: Rationals) -> Matrix:
        """Return the same matrix over a field that extends this one."""
        if field is self.field:
            return self
        return Matrix(field, [{j: field.lift(x) for j, x in row.items()} for row in self.rows], self.columns)

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.rows), self.columns

    # ------------------------------------------------------------------ blocks
    def block(self, rows: slice, columns: slice) -> Matrix:
        low, high = columns.start, columns.stop
        cut = [{j - low: x for j, x in row.items() if low <= j < high} for row in self.rows[rows]]
        return Matrix(self.field, cut, high - low)

    def place(self, rows: slice, columns: slice, block: Matrix) -> None:
        """Write a block."""
        for i, row in zip(range(rows.start, rows.stop), block.rows, strict=True):
            kept = {j: x for j, x in self.rows[i].items() if not columns.start <= j < columns.stop}
            self.rows[i] = kept | {columns.start + j: x for j, x in row.items()}

    # ------------------------------------------------------------------ arithmetic
    @property
    def T(self) -> Matrix:
        rows: list[dict[int, Any]] = [{} for _ in range(self.columns)]
        for i, row in enumerate(self.rows):
            for j, x in row.items():
                rows[j][i] = x
        return Matrix(self.field, rows, len(self.rows))

    def __matmul__(self, other: Matrix) -> Matrix:
        made = []
        for row in self.rows:
            products: dict[int, list[tuple[Any, Any]]] = {}
            for k, x in row.items():
                for j, y in other.rows[k].items():
                    products.setdefault(j, []).append((x, y))
            made.append({j: total for j, pairs in products.items() if (total := self.field.inner(pairs))})
        return Matrix(self.field, made, other.columns)

    def __add__(self, other: Matrix) -> Matrix:
        reduce, made = self.field.reduce, []
        for mine, theirs in zip(self.rows, other.rows, strict=True):
            row = dict(mine)
            for j, y in theirs.items():
                row[j] = reduce(row[j] + y) if j in row else y
            made.append({j: x for j, x in row.items() if x})
        return Matrix(self.field, made, self.columns)

    def scaled(self, number: Any) -> Matrix:
        reduce = self.field.reduce
        return Matrix(self.field, [{j: reduce(number * x) for j, x in row.items()} if number else {} for row in self.rows], self.columns)

    def __neg__(self) -> Matrix:
        return self.scaled(-self.field.one)

    def __sub__(self, other: Matrix) -> Matrix:
        return self + -other

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Matrix) and self.shape == other.shape and not any((self - other).rows)

    __hash__ = None  # type: ignore[assignment]  # how Python spells unhashable

    def eliminated(self, right: Matrix) -> tuple[Matrix, Any]:
        """Return A⁻¹B and det A, by Gauss-Jordan elimination with entries reduced at every step.

        The pivot is the shortest nonzero entry of its column. Raises ArithmeticError for a matrix that is singular at every state.
        """
        n, reduce = len(self.rows), self.field.reduce
        rows = [dict(row) | {n + j: x for j, x in other.items()} for row, other in zip(self.rows, right.rows, strict=True)]
        determinant = self.field.one
        for column in range(n):
            candidates = [i for i in range(column, n) if column in rows[i]]
            if not candidates:
                raise _core.SingularOperatorError("an inverse of an operator that is singular at every state")
            best = min(candidates, key=lambda i: (_length(rows[i][column]), len(rows[i])))
            if best != column:
                rows[column], rows[best] = rows[best], rows[column]
                determinant = -determinant
            pivot = rows[column][column]
            determinant = reduce(determinant * pivot)
            if pivot != self.field.one:
                rows[column] = {j: reduce(x / pivot) for j, x in rows[column].items() if j != column}
                rows[column][column] = self.field.one
            for i in range(n):
                if i == column or column not in rows[i]:
                    continue
                factor, row = rows[i].pop(column), rows[i]
                for j, x in rows[column].items():
                    if j == column:
                        continue
                    product = reduce(factor * x)
                    value = reduce(row[j] - product) if j in row else -product
                    if value:
                        row[j] = value
                    else:
                        row.pop(j, None)
        made = [{j - n: x for j, x in row.items() if j >= n} for row in rows]
        return Matrix(self.field, made, right.columns), determinant

    def inverse(self) -> Matrix:
        """Return the inverse by cofactors up to (3, 3), which divide once; by elimination above."""
        if len(self.rows) <= 3:
            return self._by_cofactors()
        return self.eliminated(Matrix.identity(self.field, len(self.rows)))[0]

    def _by_cofactors(self) -> Matrix:
        n, field = len(self.rows), self.field
        at = lambda i, j: self.rows[i % n].get(j % n, field.zero)
        if n == 3:
            minor = lambda i, j: field.inner([(at(i + 1, j + 1), at(i + 2, j + 2)), (-at(i + 1, j + 2), at(i + 2, j + 1))])
        elif n == 2:
            minor = lambda i, j: at(i + 1, j + 1) if i == j else -at(i + 1, j + 1)
        else:
            minor = lambda i, j: field.one
        cofactors = [[minor(i, j) for j in range(n)] for i in range(n)]
        determinant = field.inner([(at(0, j), cofactors[0][j]) for j in range(n)]) if n else field.one
        if not determinant:
            raise _core.SingularOperatorError("an inverse of an operator that is singular at every state")
        transposed = [{j: field.reduce(cofactors[j][i] / determinant) for j in range(n) if cofactors[j][i]} for i in range(n)]
        return Matrix(field, transposed, n)

    def determinant(self) -> Any:
        """Return the determinant, zero for a singular matrix."""
        try:
            return self.eliminated(Matrix.zeros(self.field, len(self.rows), 0))[1]
        except _core.SingularOperatorError:
            return self.field.zero

    def lower_half(self) -> Matrix:
        """Return the lower triangle with half the diagonal."""
        half = self.field.one / 2
        rows = [{j: self.field.reduce(half * x) if j == i else x for j, x in row.items() if j <= i} for i, row in enumerate(self.rows)]
        return Matrix(self.field, rows, self.columns)

    def trace(self) -> Any:
        total = self.field.zero
        for i, row in enumerate(self.rows):
            total = self.field.reduce(total + row.get(i, self.field.zero))
        return total

    def sympy(self, simplify: bool = True) -> sympy.ImmutableDenseMatrix:
        """Return the matrix as a SymPy matrix."""
        entries = {(i, j): self.field.expression(x, simplify) for i, row in enumerate(self.rows) for j, x in row.items()}
        return sympy.ImmutableDenseMatrix(sympy.SparseMatrix(len(self.rows), self.columns, entries))


def _length(f: Any) -> int:
    return len(f.numer) + len(f.denom)
