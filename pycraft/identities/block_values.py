"""Values of statements by block: every letter's matrix once per precision, its blocks, and what rounding made of them.

Each value carries a bound on its error: a letter's own as in `bounds`, of its whole matrix; of products, sums and inverses what those make
of it, to first order, and the rounding of the few operations on blocks themselves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

from .. import _core
from .block_reading import Entry, SumOver, shown
from .block_relations import ancestors
from .definitions import Definition, drawn
from .extended_numbers import as_extended
from .formula import Call, Letter, Node, Number, Power, Product, Star, Sum
from .judge import BoundState
from .parse import Statements
from .residual_bounds import EPSILON, Roundings
from .vocabulary import ParseError

Place = tuple[str, str]
"""A space, and the letter of the body whose part of it is meant."""


@dataclass(frozen=True)
class Block:
    """A block, where it leads to and from (None of a number; "any" of an I), and the bound on its error in the Frobenius norm."""

    array: Any
    codomain: Place | None
    domain: Place | None
    error: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "array", np.asarray(self.array))  # arithmetic makes scalars of numbers

    @property
    def norm(self) -> float:
        return _norm(self.array)


ANY: Place = ("any", "")


class Blocks:
    """The blocks of a model's letters at one state, in one precision."""

    def __init__(self, at: BoundState, operators: Any, precision: str | int, definitions: Sequence[Definition] = ()):
        self._at, self._operators, self.precision, self._definitions = at, operators, precision, definitions
        vector = drawn()
        vdot = vector("vdot", operators.Theta)
        self._statements = Statements(operators, {"vdot": vdot}, vector=vector, derive=lambda x, _, soa: x.dot(vdot=vdot))
        self._matrices: dict[str, tuple[Any, Any, float]] = {}
        self.parents: Sequence[int] = operators._source.parents
        self.epsilon = EPSILON[precision]
        self.growth = 1.0

    def _matrix(self, name: str) -> tuple[Any, Any, float]:
        """(the operator, its matrix, the bound on its error)."""
        if name not in self._matrices:
            operator = self._operator(name)
            bound = self._at.bind(operator, self.precision)
            if self.precision == "double":
                array = np.asarray(bound.dense(), float)
            else:
                array = np.asarray(bound.dense(dtype=object))
                if self.precision == "extended":
                    array = as_extended(array)
            zero = _core.zero(operator.domain, operator.codomain)
            roundings = Roundings(operator, zero, self._at.sizes("double", {}))
            self.growth = max(self.growth, roundings.growth)
            self._matrices[name] = operator, array, roundings.absolute(self.precision)
        return self._matrices[name]

    def _operator(self, name: str) -> Any:
        made = self._statements.letter(name, self._definitions)
        if not isinstance(made, _core.Operator) or made.domain is None:
            raise ParseError(f"{name} is no operator between two spaces: it has no blocks")
        return made

    def of(self, letter: Letter, bodies: dict[str, int]) -> Block:
        """The block of a letter; raises ParseError where it has none."""
        defined = {d.name for d in self._definitions}
        if letter.name == "I" and "I" not in defined:
            return Block(np.ones((1, 1)), ANY, ANY)
        if letter.name == "N" and "N" not in defined:
            return Block(np.asarray(float(self._operators.Theta.dimension)), None, None)
        operator, array, error = self._matrix(letter.name)
        arguments, vector = letter.arguments, operator.domain.name == "R^1"
        if not arguments:
            return Block(array, (operator.codomain.name, ""), None if vector else (operator.domain.name, ""), error)
        if len(arguments) == 1 and not vector and operator.domain.name == "Θ" and not operator.is_block_diagonal:
            rows = self._part(operator.codomain, self._body(arguments[0], bodies), letter)  # J(k): how body k moves with all hinges
            return Block(array[rows], (operator.codomain.name, arguments[0]), (operator.domain.name, ""), error)
        if len(arguments) == 1 and not vector:
            if not operator.is_block_diagonal:
                raise ParseError(f"{shown(letter)}: {operator.text()} has blocks between two bodies, {operator.text()}(i,j)")
            arguments = arguments * 2
        if len(arguments) != (1 if vector else 2):
            raise ParseError(f"{shown(letter)}: blocks have {'one body' if vector else 'one body or two'}")
        rows = self._part(operator.codomain, self._body(arguments[0], bodies), letter)
        if vector:
            return Block(array[rows], (operator.codomain.name, arguments[0]), ("R^1", ""), error)
        columns = self._part(operator.domain, self._body(arguments[1], bodies), letter)
        return Block(array[rows, columns], (operator.codomain.name, arguments[0]), (operator.domain.name, arguments[1]), error)

    def entry(self, node: Entry, whole: Block, bodies: dict[str, int]) -> Block:
        """A block of an expression whose value is known; raises ParseError where it has none."""
        spaces = {space.name: space for space in (self._operators.Theta, self._operators.V, self._operators.F)}
        ends = (whole.codomain, whole.domain)
        if len(node.arguments) != 2 or any(end is None or end[0] not in spaces or end[1] for end in ends):
            raise ParseError(f"{shown(node)}: of an expression that leads between all bodies, or hinges, a block has two bodies")
        rows, columns = (
            self._part(spaces[end[0]], self._body(body, bodies), node)
            for end, body in zip(ends, node.arguments, strict=True)
            if end is not None
        )
        places = [(end[0], body) for end, body in zip(ends, node.arguments, strict=True) if end is not None]
        return Block(whole.array[rows, columns], places[0], places[1], whole.error)

    def _part(self, space: Any, body: int, node: Node) -> slice:
        """Where a body's numbers are; trees that are made of the model's know its bodies by their names."""
        own = space in (self._operators.Theta, self._operators.V, self._operators.F)
        name = next((n for n, _, k in self._operators.V.blocks if k == body), None)
        found = next((where for n, where, k in space.blocks if (k == body if own else n == name)), None)
        if found is None:
            raise ParseError(f"{shown(node)}: {space.name} is not cut into bodies")
        return found

    def _body(self, argument: str, bodies: dict[str, int]) -> int:
        if argument.startswith("parent("):
            return self.parents[bodies[argument[len("parent(") : -1]]]
        if argument.startswith("child("):
            return list(self.parents).index(bodies[argument[len("child(") : -1]])
        return bodies[argument]


_AMONG: dict[str, Callable[[Sequence[int], int], list[int]]] = {
    "children": lambda parents, of: [k for k, p in enumerate(parents) if p == of],
    "path": lambda parents, of: ancestors(parents, of),
    "outboard": lambda parents, of: [k for k in range(len(parents)) if of in ancestors(parents, k)],
}


def _multiplied(values: list[Block], node: Node, eps: float) -> Block:
    """The product of numbers."""
    if any(v.domain is not None for v in values):
        raise _core.SpaceError(f"{shown(node)}: ∏ multiplies numbers, such as det D(k)")
    whole = Block(np.asarray(1.0), None, None, 0.0)
    for v in values:
        whole = _times(whole, v, (node, node), eps)
    return whole


_DUAL = {"V": "F", "F": "V"}


def value(node: Node, blocks: Blocks, bodies: dict[str, int]) -> Block:
    """The value of a side for these bodies.

    Raises
    ------
    SpaceError
        Blocks that do not meet: the one ends at another body, or in another space, than the next begins.
    SingularOperatorError
        An inverse that does not exist.
    """
    eps = blocks.epsilon
    match node:
        case Letter():
            return blocks.of(node, bodies)
        case Number(value=number):
            made = np.asarray(mpmath.mpf(number.numerator) / number.denominator if blocks.precision != "double" else float(number))
            return Block(as_extended(made) if blocks.precision == "extended" else made, None, None, eps * abs(float(number)))
        case Star(inner=inner):
            x = value(inner, blocks, bodies)
            return x if x.domain is None else Block(x.array.T, _dual(x.domain), _dual(x.codomain), x.error)
        case Entry(inner=inner):
            return blocks.entry(node, value(inner, blocks, bodies), bodies)
        case SumOver(index=index, of=of, inner=inner, among=among, multiplied=multiplied):
            over = _AMONG[among](blocks.parents, bodies[of]) if of else range(len(blocks.parents))
            values = [value(inner, blocks, {**bodies, index: k}) for k in over]
            if multiplied:
                return _multiplied(values, node, eps)
            if not values:
                return Block(np.zeros((1, 1)), ANY, ANY)
            array, error = values[0].array, sum(v.error for v in values)
            for v in values[1:]:
                array = array + v.array
            return Block(array, values[0].codomain, values[0].domain, error + eps * len(values) * _norm(array))
        case Product(factors=factors):
            whole = value(factors[0], blocks, bodies)
            for factor, before in zip(factors[1:], factors, strict=False):
                whole = _times(whole, value(factor, blocks, bodies), (before, factor), eps)
            return whole
        case Sum(terms=terms, signs=signs):
            return _sum([value(term, blocks, bodies) for term in terms], signs, node, eps)
        case Power(inner=inner, exponent=-1):
            return _inverse(value(inner, blocks, bodies), inner, eps)
        case Call(function=("trace" | "logdet" | "det") as function, inner=inner):
            return _number(function, value(inner, blocks, bodies), inner, eps)
    raise ParseError(f"{shown(node)}: of blocks there are products, sums, transposes, inverses, traces and ln det")


def _dual(place: Place | None) -> Place | None:
    return None if place is None else (_DUAL.get(place[0], place[0]), place[1])


def place_text(place: Place | None) -> str:
    if place is None:
        return "a number"
    return f"{place[0]} of body {place[1]}" if place[1] else f"{place[0]} of all bodies"


def _times(a: Block, b: Block, texts: tuple[Node, Node], eps: float) -> Block:
    if a.domain is None and a.codomain is None or b.domain is None and b.codomain is None:
        made = a if b.codomain is None else b
        error = a.error * b.norm + a.norm * b.error
        return Block(a.array * b.array, made.codomain, made.domain, error + eps * a.norm * b.norm)
    if ANY in (a.domain, b.codomain):
        made, other = (a, b) if b.codomain == ANY else (b, a)
        return Block(made.array * other.array[0, 0], made.codomain, made.domain, made.error)
    if a.domain != b.codomain:
        raise _core.SpaceError(
            f"{shown(texts[0])} acts on {place_text(a.domain)}, and {shown(texts[1])}, applied before it, leads to {place_text(b.codomain)}"
        )
    error = a.error * b.norm + a.norm * b.error + eps * a.array.shape[-1] * a.norm * b.norm
    return Block(a.array @ b.array, a.codomain, b.domain, error)


def _sum(values: list[Block], signs: Sequence[int], node: Node, eps: float) -> Block:
    known = [v for v in values if v.codomain != ANY]
    first = known[0] if known else values[0]
    for v, term in zip(values, node.children, strict=True):
        if v.codomain != ANY and (v.codomain, v.domain) != (first.codomain, first.domain):
            places = [f"from {place_text(x.domain)} to {place_text(x.codomain)}" for x in (first, v)]
            raise _core.SpaceError(f"the terms of a sum lead between different places: {places[0]}; {shown(term)} {places[1]}")
    arrays = [v.array if v.codomain != ANY or not known else v.array[0, 0] * np.eye(*first.array.shape) for v in values]
    total = arrays[0] * signs[0]
    for array, sign in zip(arrays[1:], signs[1:], strict=True):
        total = total + sign * array
    return Block(total, first.codomain, first.domain, sum(v.error for v in values) + eps * sum(map(_norm, arrays)))


def _eliminated(a: Any) -> Any:
    """The inverse of a block, by elimination with partial pivoting, in the block's own numbers."""
    n = len(a)
    work = np.concatenate([a, np.eye(n).astype(a.dtype) if a.dtype != object else np.eye(n).astype(int).astype(object)], axis=1)
    for k in range(n):
        row = k + int(np.argmax([abs(x) for x in work[k:, k]]))
        if not work[row, k]:
            raise _core.SingularOperatorError("a block without an inverse")
        work[[k, row]] = work[[row, k]]
        work[k] = work[k] / work[k, k]
        for i in range(n):
            if i != k:
                work[i] = work[i] - work[i, k] * work[k]
    return work[:, n:]


def _pivots(a: Any) -> list[Any]:
    """Of elimination with partial pivoting, in the block's own numbers; their product is the determinant."""
    work, pivots = a.copy(), []
    for k in range(len(work)):
        row = k + int(np.argmax([abs(x) for x in work[k:, k]]))
        if not work[row, k]:
            raise _core.SingularOperatorError("a block without an inverse")
        if row != k:
            work[[k, row]] = work[[row, k]]
        pivots.append(work[k, k] if row == k else -work[k, k])
        work[k + 1 :, k:] -= np.outer(work[k + 1 :, k] / work[k, k], work[k, k:])
    return pivots


def _inverse(x: Block, inner: Node, eps: float) -> Block:
    if x.domain is None or x.array.shape[0] != x.array.shape[1]:
        raise _core.SpaceError(f"{shown(inner)} has no inverse: it leads from {place_text(x.domain)} to {place_text(x.codomain)}")
    if x.codomain == ANY:
        return Block(1 / x.array, ANY, ANY)
    made = _eliminated(x.array)
    size = _norm(made)
    return Block(made, x.domain, x.codomain, size**2 * (x.error + eps * len(made) * x.norm))


def _number(function: str, x: Block, inner: Node, eps: float) -> Block:
    if x.domain is None or x.array.shape[0] != x.array.shape[1]:
        raise _core.SpaceError(f"{function} of {shown(inner)}, which leads from {place_text(x.domain)} to {place_text(x.codomain)}")
    n = len(x.array)
    if function == "trace":
        return Block(np.asarray(sum(x.array[k, k] for k in range(n))), None, None, float(np.sqrt(n)) * (x.error + eps * x.norm))
    pivots = _pivots(x.array)
    inverse = np.linalg.inv(np.asarray(x.array, float))  # of which the bound takes the size alone
    if function == "det":
        size = np.asarray(math.prod(pivots[1:], start=pivots[0]) if n else 1.0)
        return Block(size, None, None, abs(float(size)) * _norm(inverse) * (x.error + eps * n * x.norm))
    log = mpmath.log if x.array.dtype == object else np.log
    total = np.asarray(sum((log(abs(p)) for p in pivots), start=0 * x.array.flat[0] if n else 0.0))
    return Block(total, None, None, _norm(inverse) * (x.error + eps * n * x.norm) + eps * abs(float(total)))


def _norm(array: Any) -> float:
    array = np.asarray(array)
    if array.dtype == object:
        array = array.astype(float)
    return float(np.sqrt((array * array).sum()))
