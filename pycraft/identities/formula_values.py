"""Dense values of formulas, in double: comparison of two sides on a model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from .. import _core
from .definitions import Definition, drawn
from .formula import INDEXED, SYMBOLS, Call, Formula, Letter, Node, Number, Power, Product, Star, Sum
from .parse import Statements


class Misfit(Exception):
    """Spaces do not match, or an inverse does not exist."""


@dataclass(frozen=True)
class Value:
    """A dense array (a number if the spaces are None), its codomain and domain; "any" for an I without a space."""

    array: np.ndarray
    codomain: str | None
    domain: str | None


class DenseLetters(Mapping[str, Value]):
    """The letters of a model at its state, as dense arrays, with defined letters; and the duals of their spaces."""

    def __init__(self, model: Any, definitions: Sequence[Definition] = ()):
        self._operators, self._definitions = model.soa, definitions
        vector = drawn()
        vdot = vector("vdot", model.soa.Theta)
        self._statements = Statements(model.soa, {"vdot": vdot}, vector=vector, derive=lambda x, _, soa: x.dot(vdot=vdot))
        self._values: dict[Any, Value] = {}
        self.dual: dict[str | None, str | None] = {None: None, "any": "any"}
        self._plain = [name for name in SYMBOLS if name not in (*INDEXED, "MM", "I", "N")]
        H, phi, M = model.soa("H phi M")
        self._store("MM", H @ phi @ M @ phi.T @ H.T)
        self._values["I"] = Value(np.eye(1), "any", "any")
        self._values["N"] = Value(np.array(float(model.nv)), None, None)
        for name in self._plain:
            self._store(name, getattr(model.soa, name))
        for made in definitions:
            self._values.pop(made.name, None)

    def _store(self, key: Any, operator: _core.Operator) -> None:
        self._values[key] = Value(np.asarray(operator.dense(), float), operator.codomain.name, operator.domain.name)
        turned = operator.T
        self.dual |= {operator.codomain.name: turned.domain.name, operator.domain.name: turned.codomain.name}

    def of(self, letter: Letter) -> Value:
        """Return the value of a letter, with or without arguments."""
        if not letter.arguments:
            return self[letter.name]
        key = (letter.name, *letter.arguments)
        if key not in self._values:
            try:
                made = getattr(self._operators, letter.name)
                self._store(key, made(letter.arguments[0]) if letter.name == "Delta" else made(list(letter.arguments)))
            except (_core.Error, ArithmeticError) as error:
                raise Misfit from error
        return self._values[key]

    def __getitem__(self, name: str) -> Value:
        if name not in self._values:
            try:
                made = self._statements.letter(name, self._definitions)
                if not isinstance(made, _core.Operator) or made.domain is None:
                    raise Misfit
                self._store(name, made)
            except (_core.Error, ArithmeticError, TypeError, ValueError) as error:
                raise Misfit from error
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(["MM", "I", *self._plain])

    def __len__(self) -> int:
        return len(self._plain) + 2


def evaluate(node: Node, letters: DenseLetters) -> Value:
    """Return the value of a formula. Raises Misfit if spaces do not match."""
    match node:
        case Letter():
            return letters.of(node)
        case Number(value=number):
            return Value(np.array(float(number)), None, None)
        case Star(inner=inner):
            value = evaluate(inner, letters)
            if value.domain is None:
                raise Misfit
            return Value(value.array.T, letters.dual[value.domain], letters.dual[value.codomain])
        case Power(inner=inner, exponent=exponent):
            return _power(evaluate(inner, letters), exponent, letters)
        case Call(function=function, inner=inner):
            return _function(function, evaluate(inner, letters), inner)
        case Product(factors=factors):
            value = evaluate(factors[0], letters)
            for factor in factors[1:]:
                value = _times(value, evaluate(factor, letters))
            return value
        case Sum(terms=terms, signs=signs):
            values = [evaluate(term, letters) for term in terms]
            return _sum(values, signs)
    raise AssertionError(node)


def _times(a: Value, b: Value) -> Value:
    if a.domain is None or b.domain is None:
        return Value(a.array * b.array, a.codomain or b.codomain, a.domain or b.domain)
    if "any" in (a.domain, b.domain):
        made = a if b.domain == "any" else b
        return Value(a.array[0, 0] * b.array if made is b else a.array * b.array[0, 0], made.codomain, made.domain)
    if a.domain != b.codomain:
        raise Misfit
    return Value(a.array @ b.array, a.codomain, b.domain)


def _sum(values: list[Value], signs: tuple[int, ...]) -> Value:
    known = {(v.codomain, v.domain) for v in values if v.domain != "any"}
    if len(known) > 1:
        raise Misfit
    if not known:
        return Value(np.sum([s * v.array for v, s in zip(values, signs, strict=True)], axis=0), "any", "any")
    ((codomain, domain),) = known
    shape = next(v.array.shape for v in values if v.domain != "any")
    if any(v.domain == "any" for v in values) and (domain is None or codomain != domain):
        raise Misfit
    arrays = [v.array if v.domain != "any" else v.array[0, 0] * np.eye(shape[0]) for v in values]
    return Value(np.sum([s * a for a, s in zip(arrays, signs, strict=True)], axis=0), codomain, domain)


def _power(value: Value, exponent: int, letters: DenseLetters) -> Value:
    if value.domain is None or value.array.shape[0] != value.array.shape[1] or abs(exponent) > 50:
        raise Misfit
    if exponent != -1 and value.codomain != value.domain:
        raise Misfit
    try:
        made = np.linalg.matrix_power(value.array, exponent)
    except np.linalg.LinAlgError as error:
        raise Misfit from error
    if exponent < 0 and not np.linalg.cond(value.array) < 1e12:
        raise Misfit
    return Value(made, value.domain, value.codomain)


def _function(function: str, value: Value, inner: Node) -> Value:
    if value.domain in (None, "any"):
        raise Misfit
    square = value.array.shape[0] == value.array.shape[1]
    if function == "norm":
        return Value(np.array(np.linalg.norm(value.array)), None, None)
    if not square:
        raise Misfit
    if function == "trace":
        return Value(np.array(np.trace(value.array)), None, None)
    if function == "logdet":
        return Value(np.array(np.linalg.slogdet(value.array)[1]), None, None)
    if function == "blockdiag" and len(value.array) % 6 == 0:
        blocks = np.kron(np.eye(len(value.array) // 6), np.ones((6, 6)))
        return Value(value.array * blocks, value.codomain, value.domain)
    if function == "sqrt":
        try:
            return Value(np.linalg.cholesky(value.array), value.codomain, value.domain)
        except np.linalg.LinAlgError as error:
            raise Misfit from error
    raise Misfit


def residual(formula: Formula, letters: DenseLetters) -> float:
    """Return the difference of both sides relative to the larger; infinite if both are zero, or if one is zero without stating so.

    Raises Misfit if spaces do not match.
    """
    left, right = evaluate(formula[0], letters), evaluate(formula[1], letters)
    said_zero = [side == Number(Fraction(0)) for side in formula]
    if not any(said_zero):
        both = _sum([left, right], (1, -1))
        size = max(np.abs(left.array).max(initial=0.0), np.abs(right.array).max(initial=0.0))
        return float(np.abs(both.array).max(initial=0.0) / size) if 1e-9 < size < np.inf else np.inf
    other = right if said_zero[0] else left
    return float(np.abs(other.array).max(initial=0.0))
