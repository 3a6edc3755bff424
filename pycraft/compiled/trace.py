"""Numbers that record their operations, so that a computation becomes straight-line code.

A `Traced` is a node of a graph: a constant, an input, or an operation on nodes. Operations on constants are evaluated, additions of zero
and multiplications by zero or one are dropped, and equal operations share a node. Several divisions by a number use one shared
reciprocal, which rounds once more; the root of a square is a magnitude, and cos x + 2 sin² x/2 is one. Loops, tables and zeros of a
recursion that runs on such numbers disappear from the recorded code.

Dropping 0 x is exact only for finite x; the built code checks its inputs and results for other values (source.py).
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterable, Sequence
from typing import Any

__all__ = ["Graph", "Traced"]

CONSTANT, INPUT = "constant", "input"
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sine": math.sin,
    "cosine": math.cos,
    "sqrt": lambda x: math.sqrt(x) if x >= 0 else math.nan,
    "log": lambda x: math.log(x) if x > 0 else math.nan,
    "magnitude": abs,
}


class Traced:
    """A number of a graph. It supports arithmetic with numbers and arrays of objects, but no comparisons, because it has no value yet."""

    __slots__ = ("graph", "index")

    def __init__(self, graph: Graph, index: int):
        self.graph, self.index = graph, index

    @property
    def value(self) -> float | None:
        """The number, if the node is a constant."""
        return self.graph.constant_of(self.index)

    def _with(self, operation: str, other: Any, swapped: bool = False) -> Any:
        if not isinstance(other, (Traced, int, float)):
            if not isinstance(other, numbers.Real):
                return NotImplemented  # an array applies it entry by entry
        a, b = self.index, self.graph.number(other).index
        return Traced(self.graph, self.graph.put(operation, *((b, a) if swapped else (a, b))))

    def __add__(self, other: Any) -> Any:
        return self._with("add", other)

    def __sub__(self, other: Any) -> Any:
        return self._with("subtract", other)

    def __mul__(self, other: Any) -> Any:
        return self._with("multiply", other)

    def __truediv__(self, other: Any) -> Any:
        return self._with("divide", other)

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: Any) -> Any:
        return self._with("subtract", other, swapped=True)

    def __rtruediv__(self, other: Any) -> Any:
        return self._with("divide", other, swapped=True)

    def __neg__(self) -> Traced:
        return self.function("negate")

    def __abs__(self) -> Traced:
        return self.function("magnitude")

    def __pow__(self, exponent: Any) -> Traced:
        if exponent != 2:
            raise TypeError("a traced number supports no power except its square")
        return self * self

    def __bool__(self) -> bool:
        raise TypeError("whether a traced number is zero is not known before it has a value")

    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = None  # type: ignore[assignment]  # undecided
    __hash__ = None  # type: ignore[assignment]  # because equality is undecided

    def function(self, name: str) -> Traced:
        """Return negate, sine, cosine, sqrt, log or magnitude of the number."""
        return Traced(self.graph, self.graph.put(name, self.index))

    def __repr__(self) -> str:
        return f"Traced({self.graph.operations[self.index]})"


class Graph:
    """Operations in the order of their recording, each after its operands.

    Attributes
    ----------
    operations : list of (name, *operands): ("constant", number), ("input", array, entry), ("add", a, b), ("sine", a), ...
    guards : nodes of ("greater", a, b) or ("at_least", a, b), or 1 or 0 if already known; they must hold for valid results
    """

    def __init__(self) -> None:
        self.operations: list[tuple[Any, ...]] = []
        self.guards: list[int] = []
        self._known: dict[tuple[Any, ...], int] = {}
        self.zero = self._node(CONSTANT, 0.0)

    def _node(self, *operation: Any) -> int:
        found = self._known.get(operation)
        if found is None:
            found = self._known[operation] = len(self.operations)
            self.operations.append(operation)
        return found

    def constant_of(self, index: int) -> float | None:
        """Return the number of a constant, None for other nodes."""
        operation = self.operations[index]
        return operation[1] if operation[0] == CONSTANT else None

    def number(self, x: Any) -> Traced:
        """Return a constant as traced, and a traced number unchanged."""
        return x if isinstance(x, Traced) else Traced(self, self._node(CONSTANT, float(x) + 0.0))  # no -0

    def input(self, array: str, entry: int) -> Traced:
        """Return entry `entry` of an input."""
        return Traced(self, self._node(INPUT, array, entry))

    def inputs(self, array: str, size: int) -> list[Traced]:
        """Return all entries of an input."""
        return [self.input(array, i) for i in range(size)]

    def guard(self, larger: Any, smaller: Any) -> None:
        """Add a guard: results are valid only if larger > smaller."""
        node = self.put("greater", self.number(larger).index, self.number(smaller).index)
        if node not in self.guards:
            self.guards.append(node)

    def put(self, name: str, *taken: int) -> int:
        """Return the node of an operation, an existing one if the result is the same."""
        folded = getattr(self, "_" + name, None)
        return folded(*taken) if folded else self._function(name, *taken)

    # ------------------------------------------------------------------ what is folded
    def _function(self, name: str, a: int) -> int:
        x = self.constant_of(a)
        return self._node(name, a) if x is None else self.number(_FUNCTIONS[name](x)).index

    def _of_constants(self, a: int, b: int, operate: Any) -> int | None:
        x, y = self.constant_of(a), self.constant_of(b)
        return None if x is None or y is None else self.number(operate(x, y)).index

    def _negate(self, a: int) -> int:
        operation = self.operations[a]
        match operation[0]:
            case "constant":
                return self.number(-operation[1]).index
            case "negate":
                return operation[1]
        return self._node("negate", a)

    def _negated(self, a: int) -> int | None:
        """Return the operand of a if a is a negation."""
        operation = self.operations[a]
        return operation[1] if operation[0] == "negate" else None

    def _add(self, a: int, b: int) -> int:
        if a == self.zero:
            return b
        if b == self.zero:
            return a
        known = self._of_constants(a, b, lambda x, y: x + y)
        if known is not None:
            return known
        negative = self._negated(b)
        if negative is not None:
            return self._subtract(a, negative)
        negative = self._negated(a)
        if negative is not None:
            return self._subtract(b, negative)
        if self._are_one(a, b) or self._are_one(b, a):
            return self.number(1).index
        return self._node("add", *sorted((a, b)))

    def _are_one(self, a: int, b: int) -> bool:
        """Return True for cos x + 2 sin² x/2, which occurs along the axis of a rotation."""
        cosine, product = self.operations[a], self.operations[b]
        if cosine[0] != "cosine" or product[0] != "multiply":
            return False
        half = self.put("multiply", self.number(0.5).index, cosine[1])
        sine = self._known.get(("sine", half))
        return sine is not None and b == self._multiply(self._multiply(self.number(2).index, sine), sine)

    def _subtract(self, a: int, b: int) -> int:
        if a == b:
            return self.zero
        if b == self.zero:
            return a
        if a == self.zero:
            return self._negate(b)
        known = self._of_constants(a, b, lambda x, y: x - y)
        if known is not None:
            return known
        negative = self._negated(b)
        if negative is not None:
            return self._add(a, negative)
        swapped = self._known.get(("subtract", b, a))
        return self._node("subtract", a, b) if swapped is None else self._negate(swapped)

    def _multiply(self, a: int, b: int) -> int:
        if self.zero in (a, b):
            return self.zero
        known = self._of_constants(a, b, lambda x, y: x * y)
        if known is not None:
            return known
        for x, y in ((a, b), (b, a)):
            factor = self.constant_of(x)
            if factor is None:
                continue
            if factor == 1:
                return y
            if factor < 0:  # signs move outward, where sums absorb them
                return self._negate(self._multiply(self.number(-factor).index, y))
            inner = self.operations[y]
            if inner[0] == "multiply" and self.constant_of(inner[1]) is not None and math.log2(factor) == int(math.log2(factor)):
                return self._multiply(self._multiply(x, inner[1]), inner[2])  # a power of two: exact in any order
        negatives = self._negated(a), self._negated(b)
        if negatives != (None, None):
            product = self._multiply(*(x if n is None else n for x, n in zip((a, b), negatives, strict=True)))
            return product if None not in negatives else self._negate(product)
        first, second = sorted((a, b))
        if self.constant_of(second) is not None:
            first, second = second, first
        return self._node("multiply", first, second)

    def _divide(self, a: int, b: int) -> int:
        if a == self.zero:
            return a
        known = self._of_constants(a, b, lambda x, y: x / y if y else math.nan)
        if known is not None:
            return known
        if self.constant_of(b) is not None:
            return self._multiply(a, self.number(1 / divisor if (divisor := self.constant_of(b)) else math.nan).index)
        negative = self._negated(a)
        if negative is not None:
            return self._negate(self._divide(negative, b))
        return self._multiply(a, self._node("divide", self.number(1).index, b))  # one reciprocal for all divisions by b

    def _sqrt(self, a: int) -> int:
        operation = self.operations[a]
        if operation[0] == "multiply" and operation[1] == operation[2]:
            return self._magnitude(operation[1])
        return self._function("sqrt", a)

    def _magnitude(self, a: int) -> int:
        negative = self._negated(a)
        return self._magnitude(negative) if negative is not None else self._function("magnitude", a)

    def _larger(self, a: int, b: int) -> int:
        if a == b:
            return a
        known = self._of_constants(a, b, max)
        return self._node("larger", *sorted((a, b))) if known is None else known

    def _greater(self, a: int, b: int) -> int:
        known = self._of_constants(a, b, lambda x, y: float(x > y))
        return self._node("greater", a, b) if known is None else known

    def _at_least(self, a: int, b: int) -> int:
        known = self._of_constants(a, b, lambda x, y: float(x >= y))
        return self._node("at_least", a, b) if known is None else known

    def _choose(self, truth: int, a: int, b: int) -> int:
        known = self.constant_of(truth)
        if known is None:
            return a if a == b else self._node("choose", truth, a, b)
        return a if known else b

    # ------------------------------------------------------------------ what is used
    def needed(self, results: Iterable[int]) -> list[int]:
        """Return the nodes on which these depend, in order."""
        seen, waiting = set(), [*results, *self.guards]
        while waiting:
            node = waiting.pop()
            if node in seen:
                continue
            seen.add(node)
            waiting += operands(self.operations[node])
        return sorted(seen)


def operands(operation: Sequence[Any]) -> tuple[int, ...]:
    """Return the operands of an operation."""
    return () if operation[0] in (CONSTANT, INPUT) else tuple(operation[1:])
