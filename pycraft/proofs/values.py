"""Values of words: both sides of a step at a random state of a model, applied to a few random vectors.

This checks proofs and decides nothing. A letter's value is the model's operator of that name, or the letter's own expression transferred to
that model, applied as typed, without theorems.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from .. import _core
from .equations import Step
from .expand import symbol_parts
from .walk import Walk, carried_out
from .words import FURTHER, NUMBERS, Alphabet, Polynomial, Word, derivations, factors_of, inverse_of, split

PROBES = 3
SINGULAR = 1e-13
"""Ratio of the smallest singular value to the largest below which an operator of a small model of ordinary bodies counts as singular."""
LARGEST = 600
"""Largest size of a body vector for which steps are checked automatically."""


class NoValue(ArithmeticError):
    """A letter has no value on this model: a constant of another model's spaces, an inverse that does not exist there."""


class Values:
    """Values of the letters of one alphabet on one model at one state.

    Parameters
    ----------
    operators : the model's operator set
    state : a state of `model.random_state`, or None for the present one
    contexts : (source, binding) of the letters' models if the letters are the model's own; empty if they are transferred
    seed : seed of the random vectors
    """

    def __init__(self, alphabet: Alphabet, operators: Any, state: Any = None, contexts: Sequence[tuple[Any, Any]] = (), seed: int = 0):
        self.alphabet, self.operators, self.state, self.seed = alphabet, operators, state, seed
        self._contexts = list(contexts)
        q, v = (None, None) if state is None else (state.q, state.v)
        self._binding = _core._bind([operators.E], q, v)
        self._values: dict[str, np.ndarray] = {}
        self._probes: dict[int, np.ndarray] = {}
        self._products: dict[Word, np.ndarray] = {}

    # ------------------------------------------------------------------ letters
    def letter(self, letter: str) -> np.ndarray:
        """Return the value of a letter with its marks. Raises NoValue."""
        if letter not in self._values:
            name, mark = split(letter)
            value = self._base(name) if not mark else self.letter(name)
            if mark in ("⁻¹", "⁻*"):
                try:
                    value = np.linalg.inv(value)
                except np.linalg.LinAlgError as error:
                    raise NoValue(f"{self.alphabet.letter_text(letter)}: {error}") from None
                if is_singular(self.letter(inverse_of(letter))):
                    raise NoValue(f"{self.alphabet.letter_text(letter)} does not exist on this model")
            self._values[letter] = value.T if mark in ("*", "⁻*") else value
        return self._values[letter]

    def _base(self, name: str) -> np.ndarray:
        known = self.alphabet.letters.get(name)
        if known is None:
            raise NoValue(f"{name} has no value")
        try:
            if name.startswith("∂"):
                return self._derivative(name)
            return self._dense(self._expression(name))
        except (_core.SpaceError, _core.ModelError, _core.EvaluationError, AttributeError) as error:
            raise NoValue(f"{known.text} has no value on this model: {error}") from None

    def _expression(self, name: str) -> Any:
        """Return the expression of a letter on this model."""
        o, known = self.operators, self.alphabet.letters[name]
        if known.expression is not None:
            return known.expression if self._contexts else transferred(known.expression, o)
        if known.word:
            return _core.blockdiag(functools.reduce(operator.matmul, map(self._marked, known.word)))
        source, binding = self._contexts[0] if self._contexts else (o._source, None)
        if name[-1] in FURTHER:
            if not self._contexts:
                raise NoValue(f"{known.text} belongs to its own model")
            (source, binding), name = self._contexts[1 + FURTHER.index(name[-1])], name[:-1]
        if name == "S":
            E_psi, Upsilon = source.symbol("E_psi"), source.symbol("Upsilon")
            X = E_psi.T @ Upsilon @ E_psi
            e = X - _core.blockdiag(X)
        elif known.ascii is None:
            raise NoValue(f"{known.text} has no value")
        else:
            e = source.symbol(known.ascii)
        return e if binding is None else e._bound(binding)

    def _marked(self, letter: str) -> Any:
        name, mark = split(letter)
        e = self._expression(name)
        e = e.inv() if mark in ("⁻¹", "⁻*") else e
        return e.T if mark in ("*", "⁻*") else e

    def _dense(self, e: Any) -> np.ndarray:
        if e.kind == "vector":
            rng = np.random.default_rng([self.seed, *e.name.encode()])
            return rng.uniform(-1, 1, (e.codomain.dimension, 1))
        return np.asarray(e._bound(self._binding).dense(rules=False))

    def _derivative(self, name: str) -> np.ndarray:
        """Return ∂X along the coordinates, or time, of its marks, by the core's rules."""
        marks, inner = derivations(name)
        e = self._expression(inner)
        for mark in reversed(marks):
            index = self.alphabet.along[mark]
            e = e.dot(vdot=_core.vector("vdot", self.operators.Theta)) if index == "t" else e.diff(index)
        if any(x.kind == "vector" for x in _parts(e)):
            rng = np.random.default_rng([self.seed, *b"vdot"])
            return np.asarray(e._bound(self._binding).value(vdot=rng.uniform(-1, 1, self.operators.Theta.dimension))).reshape(-1, 1)
        return np.asarray(e._bound(self._binding).dense())

    def dimension(self, space: str) -> int:
        """Return the dimension of a space that every model has. Raises NoValue."""
        if space not in ("Θ", "V", "F"):
            raise NoValue(f"a space {space} belongs to its own model")
        return _space_named(space, self.operators).dimension

    # ------------------------------------------------------------------ words
    def word(self, word: Word) -> np.ndarray:
        """Return a word applied to the random vectors of its domain."""
        if word not in self._products:
            head = self.letter(word[0])
            self._products[word] = head @ (self.word(word[1:]) if len(word) > 1 else self._probe(head.shape[1]))
        return self._products[word]

    def _probe(self, n: int) -> np.ndarray:
        if n not in self._probes:
            self._probes[n] = np.random.default_rng([self.seed, n]).uniform(-1, 1, (n, PROBES))
        return self._probes[n]

    def residual(self, step: Step) -> float:
        """Return |before - after| relative to the largest term of either side, or partial product in a term. Raises NoValue."""
        before, after = step.full()
        if any(word and word[0] in NUMBERS for word in [*before, *after]):
            return self._between_numbers(before, after)
        n = next((self.letter(w[-1]).shape[1] for w in [*before, *after] if w), 1)
        total: Any = 0.0
        largest = 0.0
        for sign, p in ((1.0, before), (-1.0, after)):
            for word, c in p.items():
                rest = self.word(word[1:]) if len(word) > 1 else self._probe(self.letter(word[0]).shape[1] if word else n)
                size = _largest(rest) * (_largest(self.letter(word[0])) if word else 1.0)
                largest = max(largest, abs(float(c)) * size)
                total = total + sign * float(c) * (self.word(word) if word else rest)
        return _largest(total) / largest if largest else 0.0

    def _between_numbers(self, before: Polynomial, after: Polynomial) -> float:
        """Return `residual` for polynomials in traces, determinants and norms."""
        total, largest = 0.0, 0.0
        for sign, p in ((1.0, before), (-1.0, after)):
            for word, c in p.items():
                term, size = self._number(word)
                total, largest = total + sign * float(c) * term, max(largest, abs(float(c)) * size)
        return abs(total) / largest if largest else 0.0

    def _number(self, word: Word) -> tuple[float, float]:
        """Return the value of a word, and the size of the terms summed in it."""
        kind, *letters = word
        if kind == "×":
            parts = [self._number(w) for w in factors_of(word)]
            return math.prod(x for x, _ in parts), math.prod(size for _, size in parts)
        if kind == "1/":
            if letters[0].startswith("⟨"):
                raise NoValue(f"1/({letters[0][1:-1]}) is not a word")
            value, _ = self._number(tuple(letters))
            return 1 / value, 1 / abs(value)
        if kind in ("1", "ln") or letters[0].startswith("I["):
            n = 1.0 if kind == "1" else float(self.dimension(letters[-1][2:-1]))
            return n * (float(np.log(float(Fraction(letters[0])))) if kind == "ln" else 1.0), n
        factors = [self.letter(x) for x in letters]
        if kind == "ln det":
            found = float(np.linalg.slogdet(factors[0])[1])
            return found, max(abs(found), float(len(factors[0])))
        if kind == "norm":
            return (size := float(np.linalg.norm(factors[0]))), size
        product, bound = (functools.reduce(operator.matmul, x) for x in (factors, [np.abs(f) for f in factors]))
        return float(np.trace(product)), float(np.trace(bound))


def _parts(e: Any) -> list[Any]:
    """Yield an expression and all its parts."""
    seen = [e]
    for x in seen:
        seen += [c for c in x.children if c not in seen]
    return seen


def is_singular(X: np.ndarray) -> bool:
    """Return True if a matrix of ordinary values is singular: its smallest singular value is rounding relative to its largest."""
    values = np.linalg.svd(X, compute_uv=False) if np.isfinite(X).all() else np.zeros(1)
    return values.size > 0 and not values[-1] > SINGULAR * values[0]


def _largest(x: Any) -> float:
    return float(np.abs(x).max(initial=0.0))


def transferred(e: Any, operators: Any) -> Any:
    """Return the same expression on another model.

    Raises
    ------
    NoValue
        The expression holds a constant or an external operator, which belongs to its own model's spaces.
    """
    return carried_out(_transferred(e, operators))


def _transferred(e: Any, operators: Any) -> Walk:
    children = []
    for child in e.children:
        children.append((yield _transferred(child, operators)))
    match e.kind:
        case "symbol":
            _, name, arguments, _ = symbol_parts(e)
            source = operators._source
            if name == "Delta":  # any coordinate suffices
                return source.symbol(name, coordinate=min(arguments[1], operators.Theta.dimension - 1))
            return source.symbol(name, nodes=list(arguments[1:]))
        case "vector":
            return _core.vector(e.name, _space(e.codomain, operators))
        case "identity":
            return _core.identity() if e.domain is None else _core.identity(_space(e.domain, operators))
        case "zero":
            return _core.zero(_space(e.domain, operators), _space(e.codomain, operators))
    made = rebuilt(e, children) if children else None
    if made is None:
        raise NoValue(f"{e.text()} belongs to its own model")
    return made


def rebuilt(e: Any, children: Sequence[Any]) -> Any:
    """Return the same node with other children; None for a node with other data."""
    match e.kind:
        case "sum":
            return functools.reduce(operator.add, children)
        case "product":
            return functools.reduce(operator.matmul, children)
        case "scaled":
            return e.coefficient * children[0]
        case "transpose":
            return children[0].T
        case "inverse":
            return children[0].inv()
        case "blockdiag":
            return _core.blockdiag(children[0])
        case "sqrt":
            return children[0].sqrt()
    return None


def _space(space: Any, operators: Any) -> Any:
    if space.name in ("Θ", "V", "F"):
        return _space_named(space.name, operators)
    if space.name.startswith("R^"):
        return space
    raise NoValue(f"a space {space.name} belongs to its own model")


def _space_named(name: str, operators: Any) -> Any:
    return getattr(operators, "Theta" if name == "Θ" else name)
