"""Exact arithmetic for closed forms: rational functions of angles, quaternions and parameters.

Entries of the operators are rational in the sines and cosines of the angles. SymPy's own expressions would have to be simplified
after every product to stay small; here a number is one fraction of two polynomials with whole coefficients, in lowest terms. Angles
enter by t = tan(q/2): sin q = 2t/(1 + t²), cos q = (1 - t²)/(1 + t²) need no relation between them, so lowest terms are the
shortest, and a fraction is zero only if its numerator is. Results are shown with sines and cosines again. Relations remain for unit
quaternions, w² = 1 - x² - y² - z², and for roots, r² = n; they are applied after every operation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import sympy
from sympy.polys.domains import ZZ

from .. import _core


def exact(x: float | Fraction, simplest: bool = True) -> sympy.Expr:
    """Return the exact value of a number: a Fraction unchanged; a double as the fraction with a denominator up to 10⁶, or the root of
    one up to 1000, that rounds to it; any other as its binary fraction.
    """
    if isinstance(x, Fraction):
        return sympy.Rational(x.numerator, x.denominator)
    x = float(x)
    if not np.isfinite(x):
        raise _core.ModelError(f"{x} has no exact form: give a finite number")
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
    expressions : all expressions in the entries; their non-rational parts become generators
    unit : quaternions (w, x, y, z) of unit length
    """

    def __init__(self, expressions: Iterable[sympy.Expr], unit: Sequence[Sequence[sympy.Symbol]] = ()):
        atoms: dict[sympy.Expr, None] = {}
        for expression in expressions:
            _collect(sympy.sympify(expression), atoms)
        self.atoms = list(atoms)
        self._unit = [list(quaternion) for quaternion in unit]
        self._make([sympy.Dummy(f"g{i}") for i in range(len(self.atoms))])

    def _make(self, names: list[sympy.Dummy]) -> None:
        self._names = names
        self._to_atom = dict(zip(names, self.atoms, strict=True))
        self.field = ZZ.frac_field(*(names or [sympy.Dummy("g")])).field
        self.zero, self.one = self.field.zero, self.field.one
        self._gens = dict(zip(self.atoms, self.field.gens, strict=False))
        ring = self.field.ring
        # index of a generator → its square, in the ring
        self._squares: dict[int, Any] = {}
        self._roots: dict[int, tuple[Any, Any]] = {}  # generator r of a root: whole w and denominator d of the root r w/d
        self._angles: dict[int, sympy.Expr] = {}
        for i, atom in enumerate(self.atoms):
            if isinstance(atom, sympy.tan):
                self._angles[i] = 2 * atom.args[0]
            elif isinstance(atom, sympy.Pow):  # a root √(n/d) is r/d with r² = nd
                inside = self.element(atom.base)
                square, whole = self._without_squares(inside.numer * inside.denom)
                self._squares[i] = square
                self._gens[atom] = self.field.gens[i] * whole / self.field.raw_new(inside.denom, ring.one)
                self._roots[i] = whole, inside.denom
        of_atom = dict(zip(self.atoms, ring.gens, strict=False))
        for w, *u in self._unit:
            self._squares[self.atoms.index(w)] = 1 - sum(of_atom[x] ** 2 for x in u)
        self._shown: dict[tuple[Any, bool], sympy.Expr] = {}
        # The same field with sines and cosines, for display.
        cosines = [sympy.Dummy("c") for _ in self._angles]
        self._shown_ring = ring.clone(symbols=[*ring.symbols, *cosines])
        last = self._shown_ring.gens[len(ring.gens) :]
        self._trigonometric = {i: (self._shown_ring.gens[i], c) for i, c in zip(self._angles, last, strict=True)}
        self._shown_atoms = dict(zip(ring.symbols, self.atoms, strict=False)) | {
            names[i]: sympy.sin(angle) for i, angle in self._angles.items()
        }
        self._shown_atoms |= {c: sympy.cos(angle) for c, angle in zip(cosines, self._angles.values(), strict=True)}

    def _without_squares(self, p: Any) -> tuple[Any, Any]:
        """(f, w) with p = f w², w of factors 1 + t², which are positive."""
        whole = self.field.ring.one
        for i in self._angles:
            over = 1 + self.field.ring.gens[i] ** 2
            while not p.rem(over**2):
                p, whole = p.exquo(over**2), whole * over
        return p, whole

    def extended(self, expressions: Iterable[sympy.Expr]) -> Rationals:
        """Return the field with more generators, or itself if none are new; `lift` converts elements."""
        atoms = dict.fromkeys(self.atoms)
        for expression in expressions:
            _collect(sympy.sympify(expression), atoms)
        if len(atoms) == len(self.atoms):
            return self
        made = Rationals.__new__(Rationals)
        made.atoms, made._unit = list(atoms), self._unit
        made._make([*self._names, *(sympy.Dummy(f"g{i}") for i in range(len(self.atoms), len(atoms)))])
        return made

    def lift(self, f: Any) -> Any:
        """Convert an element of a field that this one extends."""
        more = len(self.field.gens) - len(f.field.gens)
        if not more and f.field == self.field:
            return f
        if not self._names[: len(f.field.gens)] == list(f.field.symbols):  # the field of rationals has its own generator
            return self.field(int(f.numer.LC)) / self.field(int(f.denom.LC)) if f.numer else self.zero
        ring, pad = self.field.ring, (0,) * more
        numerator, denominator = (ring.from_dict({m + pad: c for m, c in p.items()}) for p in (f.numer, f.denom))
        return self.field.raw_new(numerator, denominator)

    def element(self, expression: Any) -> Any:
        """Return the element of a SymPy expression in the field's atoms."""
        e = sympy.sympify(expression)
        if e.is_Rational:
            return self.field(int(e.p)) / self.field(int(e.q))
        if e in self._gens:
            return self._gens[e]
        if e.is_Add:
            return self.reduce(sum((self.element(a) for a in e.args), self.field.zero))
        if e.is_Mul:
            made = self.field.one
            for a in e.args:
                made = self.reduce(made * self.element(a))
            return made
        if e.is_Pow and e.exp.is_Integer:
            return self.reduce(self.element(e.base) ** int(e.exp))
        if e.is_Pow and e.exp.is_Rational and e.base.is_Rational and not (e.base.is_Integer and e.exp == sympy.Rational(1, 2)):
            return self.element(_root(e))
        if e.is_Pow and e.exp.is_Rational and e.exp.q == 2 and sympy.sqrt(e.base) in self._gens:
            return self.reduce(self._gens[sympy.sqrt(e.base)] ** e.exp.p)
        if isinstance(e, sympy.sin | sympy.cos | sympy.tan) and sympy.tan(e.args[0] / 2) in self._gens:
            t = self._gens[sympy.tan(e.args[0] / 2)]
            over = 2 * t if not isinstance(e, sympy.cos) else 1 - t**2
            return over / (1 - t**2 if isinstance(e, sympy.tan) else 1 + t**2)
        raise _core.EvaluationError(f"{e} is not a rational function of {', '.join(map(str, self.atoms))}")

    def reduce(self, f: Any) -> Any:
        """Return the element with squares replaced by the relations, in lowest terms. Raises EvaluationError if the denominator is 0."""
        if not self._squares:
            return f
        numerator, denominator = _replace(f.numer, self._squares), _replace(f.denom, self._squares)
        for i in self._roots:  # no root in the denominator: (a + br)(a - br) = a² - b²r²
            if any(m[i] for m in denominator):
                conjugate = self.field.ring.from_dict({m: -c if m[i] else c for m, c in denominator.items()})
                if all(m[i] for m in denominator):
                    conjugate = self.field.ring.gens[i]
                numerator, denominator = (_replace(p * conjugate, self._squares) for p in (numerator, denominator))
        if numerator is f.numer and denominator is f.denom:
            return f
        if not denominator:
            raise _core.EvaluationError("division by an entry that is zero at every state")
        if not numerator:
            return self.zero
        return self.field.new(numerator, denominator)

    def inner(self, pairs: Sequence[tuple[Any, Any]]) -> Any:
        """Return Σ xy over the pairs: products with the same denominator are added before cancellation."""
        if len(pairs) == 1:
            x, y = pairs[0]
            return self.reduce(x * y)
        sums: dict[Any, Any] = {}
        for x, y in pairs:
            below = x.denom * y.denom
            above = x.numer * y.numer
            sums[below] = sums[below] + above if below in sums else above
        total = self.field.zero
        for below, above in sums.items():
            if above:
                total = self.reduce(total + self.reduce(self.field.new(above, below)))
        return total

    def root(self, f: Any, sample: Mapping[sympy.Expr, float]) -> tuple[Rationals, Any]:
        """Return √f in a field that contains it, f positive at the sample: roots of the irreducible factors in sines and cosines.

        Raises EvaluationError if f is negative at the sample.
        """
        numerator, denominator = (p.as_expr().xreplace(self._shown_atoms) for p in self._in_sines(f))
        if float(sympy.sympify(numerator / denominator).subs(sample)) < 0:
            raise _core.EvaluationError("the root of a negative number: the operator is not positive semidefinite")
        made = sympy.S.One
        for side, power in ((numerator, 1), (denominator, -1)):
            number, factors = sympy.factor_list(side)
            made *= sympy.sqrt(abs(number)) ** power
            for factor, times in factors:
                factor = -factor if float(factor.subs(sample)) < 0 else factor
                whole = factor ** (times // 2) if (times // 2) % 2 == 0 or factor.is_positive else sympy.Abs(factor) ** (times // 2)
                made *= (whole * (sympy.sqrt(factor) if times % 2 else 1)) ** power
        field = self.extended([made])
        return field, field.element(made)

    # ------------------------------------------------------------------ as SymPy shows it
    def expression(self, f: Any, simplify: bool = True) -> sympy.Expr:
        """Return the element as a SymPy expression; with `simplify`, the shortest of several forms."""
        key = (f, simplify)
        if key not in self._shown:
            numerator, denominator = self._in_sines(f)
            if not simplify:
                self._shown[key] = (numerator.as_expr() / denominator.as_expr()).xreplace(self._shown_atoms)
            else:
                self._shown[key] = self._shortest(numerator, denominator) if numerator else sympy.S.Zero
        return self._shown[key]

    def _in_sines(self, f: Any) -> tuple[Any, Any]:
        """Numerator and denominator as polynomials in sines and cosines, of degree at most one in every sine.

        Both are multiplied by cos^{2k}(q/2), 2k the degree in t = tan(q/2): t^j cos^{2k}(q/2) is a product of (1 ∓ cos q)/2, with one
        sin q / 2 if j is odd.
        """
        ring = self._shown_ring
        pad = (0,) * len(self._angles)
        both: tuple[Any, Any] = (f.numer, f.denom)
        for i, (whole, denominator) in self._roots.items():  # the displayed root is r w/d
            if any(m[i] for p in both for m in p):
                both = _spread(both[0], i, denominator, whole).cancel(_spread(both[1], i, denominator, whole))
        parts = [ring.from_dict({m + pad: c for m, c in p.items()}) for p in both]
        for i, (s, c) in self._trigonometric.items():
            degree = max(p.degree(s) for p in parts)
            if degree <= 0:
                continue
            half = (degree + 1) // 2
            power = [(1 - c) ** (j // 2) * (1 + c) ** (half - (j + 1) // 2) * (s if j % 2 else 1) for j in range(degree + 1)]
            turned = []
            for p in parts:
                by_degree: dict[int, dict[Any, Any]] = {}
                for m, x in p.items():
                    by_degree.setdefault(m[i], {})[m[:i] + (0,) + m[i + 1 :]] = x
                turned.append(sum((ring.from_dict(rest) * power[j] for j, rest in by_degree.items()), ring.zero))
            parts = turned
        numerator, denominator = parts[0].cancel(parts[1])
        return numerator, denominator

    def _shortest(self, numerator: Any, denominator: Any) -> sympy.Expr:
        ring, forms = self._shown_ring, [(numerator, denominator)]
        index = {g: i for i, g in enumerate(ring.gens)}
        squares = {index[c]: 1 - s**2 for s, c in self._trigonometric.values()}
        by_sines = _replace(numerator, squares), _replace(denominator, squares)
        if by_sines != forms[0] and by_sines[1]:
            forms += [by_sines[0].cancel(by_sines[1]), (numerator, by_sines[1]), (by_sines[0], denominator)]
        best = min(forms, key=lambda g: (len(g[0]) + len(g[1]), _degrees(g[0]) + _degrees(g[1])))
        up, down = (p.as_expr() for p in best)
        candidates = [up / down, (-up) / (-down)] if len(best[1]) > 1 else [up / down]
        if len(best[0]) + len(best[1]) <= 40 and max(c.bit_length() for p in best for c in p.values()) <= 60:
            candidates += [sympy.factor(sign * up) / sympy.factor(sign * down) for sign in ((1, -1) if len(best[1]) > 1 else (1,))]
            candidates = [c.xreplace(self._shown_atoms) for c in candidates]
            trigonometric = sum(isinstance(a, sympy.sin | sympy.cos) for a in candidates[0].atoms(sympy.Function))
            if trigonometric > 1 and len(best[0]) + len(best[1]) <= 20:
                candidates += [_angle_sums(c) for c in candidates]
        else:
            candidates = [c.xreplace(self._shown_atoms) for c in candidates]
        candidates += [_without_minus(c) for c in candidates]
        return min(candidates, key=_burden)


def _burden(e: sympy.Expr) -> tuple[int, int, int]:
    """Return the length of a form: operations, letters, minus signs at the start of a sum."""
    text = str(e)
    return sympy.count_ops(e), len(text), text.count("(-")


def _without_minus(e: sympy.Expr) -> sympy.Expr:
    """Move a leading minus sign into a sum that is a factor."""
    number, rest = e.as_coeff_Mul()
    if number.is_negative:
        factors = list(sympy.Mul.make_args(rest))
        for i, factor in enumerate(factors):
            if factor.is_Add or factor.is_Pow and factor.exp == -1 and factor.base.is_Add:
                turned = sympy.Add(*(-a for a in (factor if factor.is_Add else factor.base).args))
                factors[i] = turned if factor.is_Add else 1 / turned
                return sympy.Mul(-number, *factors)
    return e


def _spread(p: Any, i: int, denominator: Any, whole: Any) -> Any:
    """Multiply by w, with r replaced by d r: r w/d becomes r, 1 stays 1, up to the factor w of both parts of a fraction."""
    ring = p.ring
    made = ring.zero
    for with_root in (False, True):
        part = ring.from_dict({m: c for m, c in p.items() if bool(m[i]) == with_root})
        made += part * (denominator if with_root else whole)
    return made


def _degrees(p: Any) -> int:
    return sum(sum(m) for m in p)


def _angle_sums(e: sympy.Expr) -> sympy.Expr:
    """Combine products of sines and cosines into sines and cosines of sums of angles, if that is shorter."""
    from sympy.simplify.fu import TR8, TR10i

    forms = [form for form in (TR10i(e), TR8(e)) if not form.has(sympy.pi)]
    return min(forms, key=sympy.count_ops, default=e)


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
    elif e.is_Pow and e.exp.is_Rational and e.exp.q == 2:
        _collect(e.base, atoms)
        atoms.setdefault(sympy.sqrt(e.base))
    elif isinstance(e, sympy.sin | sympy.cos | sympy.tan):
        atoms.setdefault(sympy.tan(e.args[0] / 2))
    else:
        atoms.setdefault(e)


def _root(e: sympy.Expr) -> sympy.Expr:
    """Return a power of a rational as a multiple of a square root of a whole number."""
    if e.exp.q != 2:
        raise _core.EvaluationError(f"{e} is not a square root")
    whole, p, q = e.base ** ((e.exp.p - 1) // 2), e.base.p, e.base.q
    if p < 0:
        raise _core.EvaluationError(f"{e} is not real")
    return sympy.Mul(whole / q, sympy.sqrt(p * q)) if q != 1 else sympy.Mul(whole, sympy.Pow(p, sympy.Rational(1, 2)))


def _replace(p: Any, squares: Mapping[int, Any]) -> Any:
    """Return the polynomial with x_i² replaced by squares[i], repeatedly in every monomial."""
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
