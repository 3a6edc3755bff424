"""Exact arithmetic for closed forms: rational functions of sines, cosines, quaternions, parameters, and sparse matrices of them.

Entries of the operators are rational in the sines and cosines of the angles. SymPy's own expressions would be simplified after every
product to stay small; here a number is one fraction of two polynomials in generators c, s, q, v, m, ..., reduced by the relations
s² = 1 - c² (of every angle), w² = 1 - x² - y² - z² (of unit quaternions) and r² = n (of square roots). The squared generators
are coprime, so the relations are a Gröbner basis: a numerator that is zero on every state reduces to zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import sympy
from sympy.polys.domains import ZZ

from .. import _core


def exact(x: float, simplest: bool = True) -> sympy.Expr:
    """A double as an exact number: the fraction with a denominator up to 10⁶, or the root of one up to 1000, whose double it is.

    Any other double is the binary fraction that it stands for.
    """
    x = float(x)
    if not np.isfinite(x):
        raise _core.ModelError(f"{x} has no exact form")
    if simplest:
        near = Fraction(x).limit_denominator(10**6)
        if float(near) == x:
            return sympy.Rational(near.numerator, near.denominator)
        square = Fraction(x * x).limit_denominator(1000)
        root = sympy.sqrt(sympy.Rational(square.numerator, square.denominator))
        if square and abs(float(square) ** 0.5 - abs(x)) <= 2 * np.spacing(abs(x)):
            return root if x > 0 else -root
    return sympy.Rational(Fraction(x).numerator, Fraction(x).denominator)


class Rationals:
    """The field of the entries: generators, relations, and the way to and from SymPy expressions.

    Parameters
    ----------
    expressions : every expression that entries are made of; what is not rational in them becomes a generator
    unit : quaternions (w, x, y, z) taken as of unit length
    """

    def __init__(self, expressions: Iterable[sympy.Expr], unit: Sequence[Sequence[sympy.Symbol]] = ()):
        atoms: dict[sympy.Expr, None] = {}
        for expression in expressions:
            _collect(sympy.sympify(expression), atoms)
        for atom in list(atoms):  # a sine brings its cosine
            if isinstance(atom, sympy.sin):
                atoms.setdefault(sympy.cos(*atom.args))
            elif isinstance(atom, sympy.cos):
                atoms.setdefault(sympy.sin(*atom.args))
        self.atoms = list(atoms)
        names = [sympy.Dummy(f"g{i}") for i in range(len(self.atoms))]
        self._of_atom = dict(zip(self.atoms, names, strict=True))
        self._to_atom = dict(zip(names, self.atoms, strict=True))
        self.field = ZZ.frac_field(*(names or [sympy.Dummy("g")])).field
        self._gens = dict(zip(self.atoms, self.field.gens, strict=False))
        ring_gens = dict(zip(self.atoms, self.field.ring.gens, strict=False))
        # index of a generator → what its square is, in the ring
        self._squares: dict[int, Any] = {}
        self._cosines: dict[int, Any] = {}
        for i, atom in enumerate(self.atoms):
            if isinstance(atom, sympy.sin):
                cosine = sympy.cos(*atom.args)
                self._squares[i] = 1 - ring_gens[cosine] ** 2
                self._cosines[self.atoms.index(cosine)] = 1 - ring_gens[atom] ** 2
            elif isinstance(atom, sympy.Pow):
                self._squares[i] = self.field.ring(int(atom.base))
        for w, *u in unit:
            self._squares[self.atoms.index(w)] = 1 - sum(ring_gens[x] ** 2 for x in u)
        self.zero, self.one = self.field.zero, self.field.one
        self._shown: dict[tuple[Any, bool], sympy.Expr] = {}

    def element(self, expression: Any) -> Any:
        """The element that a SymPy expression in the field's atoms is."""
        e = sympy.sympify(expression)
        if e.is_Rational:
            return self.field(int(e.p)) / self.field(int(e.q))
        if e in self._gens:
            return self._gens[e]
        if e.is_Add:
            return self.reduce(sum((self.element(a) for a in e.args), self.zero))
        if e.is_Mul:
            made = self.one
            for a in e.args:
                made = self.reduce(made * self.element(a))
            return made
        if e.is_Pow and e.exp.is_Integer:
            return self.reduce(self.element(e.base) ** int(e.exp))
        if e.is_Pow and e.exp.is_Rational and e.base.is_Rational:
            return self.element(_root(e))
        raise _core.EvaluationError(f"{e} is no rational function of {', '.join(map(str, self.atoms))}")

    def reduce(self, f: Any) -> Any:
        """The same element with squares replaced by the relations, in lowest terms. Raises EvaluationError where the denominator is 0."""
        if not self._squares:
            return f
        numerator, denominator = _replace(f.numer, self._squares), _replace(f.denom, self._squares)
        if numerator is f.numer and denominator is f.denom:
            return f
        if not denominator:
            raise _core.EvaluationError("division by an entry that is zero at every state")
        if not numerator:
            return self.zero
        return self.field.new(numerator, denominator)

    def expression(self, f: Any, simplify: bool = True) -> sympy.Expr:
        """The element as a SymPy expression, shortest of the forms tried where `simplify` is set."""
        key = (f, simplify)
        if key not in self._shown:
            self._shown[key] = self._shortest(f) if simplify else f.as_expr().xreplace(self._to_atom)
        return self._shown[key]

    def _shortest(self, f: Any) -> sympy.Expr:
        if not f.numer:
            return sympy.S.Zero
        forms = [f]
        if self._cosines:
            by_sines = _replace(f.numer, self._cosines), _replace(f.denom, self._cosines)
            if by_sines[1]:
                forms.append(self.field.new(*by_sines))
        terms = lambda g: len(g.numer) + len(g.denom)  # noqa: E731
        best = min(forms, key=terms)
        made = best.as_expr().xreplace(self._to_atom)
        candidates = [made]
        if terms(best) <= 40 and max(c.bit_length() for part in (best.numer, best.denom) for c in part.values()) <= 60:
            numerator, denominator = best.numer.as_expr(), best.denom.as_expr()
            candidates += [
                (sympy.factor(sign * numerator) / sympy.factor(sign * denominator)).xreplace(self._to_atom)
                for sign in ((1, -1) if len(best.denom) > 1 else (1,))
            ]
            if sum(isinstance(a, sympy.sin | sympy.cos) for a in made.atoms(sympy.Function)) > 1:
                candidates += [_angle_sums(c) for c in candidates]
        return min(candidates, key=lambda e: (sympy.count_ops(e), len(str(e))))


def _angle_sums(e: sympy.Expr) -> sympy.Expr:
    """Products of sines and cosines gathered into those of sums of angles, where that makes it shorter."""
    from sympy.simplify.fu import TR8, TR10i

    forms = [TR10i(e), TR8(e)]
    return min(forms, key=sympy.count_ops)


def _collect(e: sympy.Expr, atoms: dict[sympy.Expr, None]) -> None:
    if e.is_Rational:
        return
    if e.is_Add or e.is_Mul:
        for a in e.args:
            _collect(a, atoms)
    elif e.is_Pow and e.exp.is_Integer:
        _collect(e.base, atoms)
    elif e.is_Pow and e.exp.is_Rational and e.base.is_Rational:
        for a in _root(e).atoms(sympy.Pow):
            if a.exp == sympy.Rational(1, 2):
                atoms.setdefault(a)
    else:
        atoms.setdefault(e)


def _root(e: sympy.Expr) -> sympy.Expr:
    """A power of a rational as a multiple of a square root of a whole number."""
    if e.exp.q != 2:
        raise _core.EvaluationError(f"{e} is no square root")
    whole, p, q = e.base ** ((e.exp.p - 1) // 2), e.base.p, e.base.q
    if p < 0:
        raise _core.EvaluationError(f"{e} is not real")
    return sympy.Mul(whole / q, sympy.sqrt(p * q)) if q != 1 else sympy.Mul(whole, sympy.Pow(p, sympy.Rational(1, 2)))


def _replace(p: Any, squares: Mapping[int, Any]) -> Any:
    """The polynomial with x_i² replaced by squares[i], in every monomial as often as it goes."""
    if not any(monomial[i] > 1 for monomial in p for i in squares):
        return p
    ring, made = p.ring, p.ring.zero
    for monomial, coefficient in p.terms():
        factor, rest = None, list(monomial)
        for i, square in squares.items():
            if rest[i] > 1:
                power = square ** (rest[i] // 2)
                factor = power if factor is None else factor * power
                rest[i] %= 2
        term = ring({tuple(rest): coefficient})
        made += term if factor is None else term * factor
    return _replace(made, squares)


class Matrix:
    """A sparse matrix over the field: rows as dictionaries from column to nonzero element."""

    def __init__(self, field: Rationals, rows: list[dict[int, Any]], columns: int):
        self.field, self.rows, self.columns = field, rows, columns

    # ------------------------------------------------------------------ making them
    @classmethod
    def of(cls, field: Rationals, entries: Sequence[Sequence[Any]], columns: int | None = None) -> Matrix:
        """A matrix of SymPy expressions or numbers, given row by row."""
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
        """Block diagonal of the given blocks."""
        rows: list[dict[int, Any]] = []
        at = 0
        for block in blocks:
            rows += [{at + j: x for j, x in row.items()} for row in block.rows]
            at += block.columns
        return cls(field, rows, at)

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
        reduce, made = self.field.reduce, []
        for row in self.rows:
            sums: dict[int, Any] = {}
            for k, x in row.items():
                for j, y in other.rows[k].items():
                    product = reduce(x * y)
                    sums[j] = reduce(sums[j] + product) if j in sums else product
            made.append({j: x for j, x in sums.items() if x})
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

    __hash__ = None  # type: ignore[assignment]

    def eliminated(self, right: Matrix) -> tuple[Matrix, Any]:
        """A⁻¹B and det A, by Gauss and Jordan on entries reduced at every step.

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
        return self.eliminated(Matrix.identity(self.field, len(self.rows)))[0]

    def determinant(self) -> Any:
        """Zero for a singular matrix."""
        try:
            return self.eliminated(Matrix.zeros(self.field, len(self.rows), 0))[1]
        except _core.SingularOperatorError:
            return self.field.zero

    def trace(self) -> Any:
        total = self.field.zero
        for i, row in enumerate(self.rows):
            total = self.field.reduce(total + row.get(i, self.field.zero))
        return total

    def sympy(self, simplify: bool = True) -> sympy.ImmutableDenseMatrix:
        """The matrix as SymPy shows it."""
        entries = {(i, j): self.field.expression(x, simplify) for i, row in enumerate(self.rows) for j, x in row.items()}
        return sympy.ImmutableDenseMatrix(sympy.SparseMatrix(len(self.rows), self.columns, entries))


def _length(f: Any) -> int:
    return len(f.numer) + len(f.denom)
