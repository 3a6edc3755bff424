"""Numbers for words: both sides of a step at a random state of a model, applied to a few random vectors.

This checks proofs and decides none. A letter's value comes from the operator set of the model, or from its own expression carried over to that
model; what is applied is what was typed, no theorem used.
"""

from __future__ import annotations

import functools
import operator
from typing import Any

import numpy as np

from .. import _core
from .equations import Step
from .expand import symbol_parts
from .words import FURTHER, Alphabet, Polynomial, Word, split

PROBES = 3
LARGEST = 600
"""Entries of a body vector up to which steps are checked by themselves."""


class NoValue(ArithmeticError):
    """A letter has no value on this model: a constant of another model's spaces, an inverse that does not exist there."""


class Values:
    """Values of letters of one alphabet on one model at one state.

    Parameters
    ----------
    operators : the model's operator set
    state : of `model.random_state`, or None for the present one
    own : whether the letters' expressions are this model's own
    """

    def __init__(self, alphabet: Alphabet, operators: Any, state: Any = None, own: bool = True, seed: int = 0, contexts: Any = ()):
        self.alphabet, self.operators, self.own, self.seed = alphabet, operators, own, seed
        self._contexts = list(contexts)
        q, v = (None, None) if state is None else (state.q, state.v)
        self._binding = _core._bind([operators.E], q, v, "fast", 0, "double")
        self.state = state
        self._values: dict[str, np.ndarray] = {}
        self._probes: dict[int, np.ndarray] = {}
        self._products: dict[Word, np.ndarray] = {}

    def letter(self, letter: str) -> np.ndarray:
        """The value of a letter with its marks. Raises NoValue."""
        if letter not in self._values:
            name, mark = split(letter)
            if mark:
                value = self.letter(name)
                if mark in ("⁻¹", "⁻*"):
                    try:
                        value = np.linalg.inv(value)
                    except np.linalg.LinAlgError as error:
                        raise NoValue(f"{self.alphabet.letter_text(letter)}: {error}") from None
                self._values[letter] = value.T if mark in ("*", "⁻*") else value
            else:
                self._values[letter] = self._base(name)
        return self._values[letter]

    def _base(self, name: str) -> np.ndarray:
        known = self.alphabet.letters.get(name)
        if known is None:
            raise NoValue(f"{name} has no value")
        try:
            if name.startswith("∂"):
                return self._derivative(known)
            return self._dense(self._expression(name))
        except (_core.SpaceError, _core.ModelError, AttributeError) as error:
            raise NoValue(f"{known.text} has no value on this model: {error}") from None

    def _expression(self, name: str) -> Any:
        """The expression that a letter stands for, on this model."""
        o, known = self.operators, self.alphabet.letters[name]
        if known.expression is not None:
            return known.expression if self.own else transferred(known.expression, o)
        if name.startswith("⟨blockdiag("):
            factors = [self._marked(x) for x in name[len("⟨blockdiag(") : -2].split(" ")]
            return _core.blockdiag(functools.reduce(operator.matmul, factors))
        source = o._source
        if name[-1] in FURTHER:
            if not self.own:
                raise NoValue(f"{known.text} belongs to its own model")
            source, name = self._contexts[1 + FURTHER.index(name[-1])][0], name[:-1]
        if name == "S":
            E_psi, Upsilon = source.symbol("E_psi"), source.symbol("Upsilon")
            X = E_psi.T @ Upsilon @ E_psi
            return X - _core.blockdiag(X)
        if known.ascii is None:
            raise NoValue(f"{known.text} has no value")
        return source.symbol(known.ascii)

    def _marked(self, letter: str) -> Any:
        name, mark = split(letter)
        e = self._expression(name)
        return {"": lambda: e, "*": lambda: e.T, "⁻¹": lambda: e.inv(), "⁻*": lambda: e.inv().T}[mark]()

    def _dense(self, e: Any) -> np.ndarray:
        vectors = {}
        for name, space in sorted(_vectors(e).items()):
            rng = np.random.default_rng([self.seed, *name.encode()])
            vectors[name] = [float(x) for x in rng.uniform(-1, 1, space.dimension)]
        bound = e._bound(self._binding)
        if vectors:
            if e.kind != "vector":
                raise NoValue(f"{e.text()}: a function of a vector")
            return np.asarray(vectors[e.name])[:, None]
        return np.asarray(bound.dense(rules=False))

    def _derivative(self, letter: Any) -> np.ndarray:
        """∂X: by differences of fourth order along the coordinate."""
        source, index = letter.expression
        e = source if self.own else transferred(source, self.operators)
        diff = getattr(e, "diff", None)
        if diff is not None:
            return np.asarray(diff(index)._bound(self._binding).dense())
        return self._differences(e, index)

    def _differences(self, e: Any, index: int) -> np.ndarray:
        model, h = self.operators._model, 1e-3
        q = np.array(model.q if self.state is None else self.state.q)
        direction = np.eye(model.nv)[index]

        def at(x: float) -> np.ndarray:
            return np.asarray(e.at(model.integrate(q, x * direction)).dense(rules=False))

        return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)

    # ------------------------------------------------------------------ polynomials
    def word(self, word: Word) -> np.ndarray:
        """A word applied to the probes of its domain."""
        if word not in self._products:
            head = self.letter(word[0])
            rest = self.word(word[1:]) if len(word) > 1 else self._probe(head.shape[1])
            self._products[word] = head @ rest
        return self._products[word]

    def _probe(self, n: int) -> np.ndarray:
        if n not in self._probes:
            self._probes[n] = np.random.default_rng([self.seed, n]).uniform(-1, 1, (n, PROBES))
        return self._probes[n]

    def residual(self, step: Step) -> float:
        """|before - after| relative to the largest term of either side. Raises NoValue."""
        before, after = step.full()
        dimension = next((self.letter(w[-1]).shape[1] for p in (before, after) for w in p if w), None)
        total: Any = 0.0
        largest = 0.0
        for sign, p in ((1.0, before), (-1.0, after)):
            for word, c in p.items():
                if not word and dimension is None:
                    total, largest = total + sign * float(c), max(largest, abs(float(c)))
                    continue
                term = float(c) * (self.word(word) if word else self._probe(dimension or 0))
                total = total + sign * term
                largest = max(largest, float(np.abs(term).max(initial=0.0)))
        return float(np.abs(total).max(initial=0.0)) / largest if largest else 0.0


def _vectors(e: Any) -> dict[str, Any]:
    found = {e.name: e.codomain} if e.kind == "vector" else {}
    for child in e.children:
        found |= _vectors(child)
    return found


def transferred(e: Any, operators: Any) -> Any:
    """The same expression on another model.

    Raises
    ------
    NoValue
        It holds a constant or something external, which belongs to its own model's spaces.
    """
    children = [transferred(c, operators) for c in e.children]
    match e.kind:
        case "symbol":
            _, name, arguments, _ = symbol_parts(e)
            source = operators._source
            if name == "Delta":
                return source.symbol("Delta", coordinate=arguments[0])
            return source.symbol(name, nodes=list(arguments))
        case "vector":
            return _core.vector(e.name, _space(e.codomain, operators))
        case "identity":
            return _core.identity() if e.domain is None else _core.identity(_space(e.domain, operators))
        case "zero":
            return _core.zero(_space(e.domain, operators), _space(e.codomain, operators))
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
    raise NoValue(f"{e.text()} belongs to its own model")


def _space(space: Any, operators: Any) -> Any:
    name = space.name
    if name == "Θ":
        return operators.Theta
    if name in ("V", "F"):
        return getattr(operators, name)
    if name.startswith("R^"):
        return space
    raise NoValue(f"a space {name} belongs to its own model")


def check_steps(steps: list[Step], values: Values) -> float:
    """Sets every step's residual; returns the worst."""
    worst = 0.0
    for step in steps:
        step.residual = values.residual(step)
        worst = max(worst, step.residual)
    return worst


def value_of(p: Polynomial, values: Values) -> np.ndarray:
    """A polynomial applied to the probes."""
    step = Step(p, {}, [], values.alphabet)
    before, _ = step.full()
    total: Any = 0.0
    dimension = next((values.letter(w[-1]).shape[1] for w in before if w), 1)
    for word, c in before.items():
        total = total + float(c) * (values.word(word) if word else values._probe(dimension))
    return np.asarray(total)
