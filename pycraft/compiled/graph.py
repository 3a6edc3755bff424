"""Graphs of operations: a tape of the core (cpp/lanes/tape.h) with fewer operations, before it becomes straight-line code.

A node is a constant, an input, or an operation on nodes, and is identified by its number. Operations on constants are computed, sums with
zero and products with zero or one are dropped, and equal operations are one node. A division becomes a product with the reciprocal of the
divisor, which is computed once and rounds once more; the root of a square is a magnitude, and cos x + 2 sin² x/2 is one.

Dropping 0 x is exact for finite x alone; the code that is built of a graph checks that its inputs and results are finite (source.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

__all__ = ["Graph"]

CONSTANT, INPUT = "constant", "input"
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sine": math.sin,
    "cosine": math.cos,
    "sqrt": lambda x: math.sqrt(x) if x >= 0 else math.nan,
    "log": lambda x: math.log(x) if x > 0 else math.nan,
    "magnitude": abs,
    "fraction": lambda x: math.frexp(x)[0],
    "exponent": lambda x: float(math.frexp(x)[1]),
}


class Graph:
    """Operations in the order of their making, each after its operands.

    Attributes
    ----------
    operations : list of (name, *operands): ("constant", number), ("input", array, entry), ("add", a, b), ("sine", a), ...
    guards : nodes of ("greater", a, b) or ("at_least", a, b), or 1 or 0 where that is known; they must hold for the results to be trusted
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
        """Return the value of a constant, None for other nodes."""
        operation = self.operations[index]
        return operation[1] if operation[0] == CONSTANT else None

    def number(self, x: float) -> int:
        """Return the node of a constant."""
        return self._node(CONSTANT, float(x) + 0.0)  # no -0

    def input(self, array: str, entry: int) -> int:
        """Return the node of an entry of an input."""
        return self._node(INPUT, array, entry)

    def put(self, name: str, *taken: int) -> int:
        """Return the node of an operation, an earlier one where it is equal."""
        folded = getattr(self, "_" + name, None)
        return folded(*taken) if folded else self._function(name, *taken)

    # ------------------------------------------------------------------ folding
    def _function(self, name: str, a: int) -> int:
        x = self.constant_of(a)
        return self._node(name, a) if x is None else self.number(_FUNCTIONS[name](x))

    def _of_constants(self, a: int, b: int, operate: Any) -> int | None:
        x, y = self.constant_of(a), self.constant_of(b)
        return None if x is None or y is None else self.number(operate(x, y))

    def _negate(self, a: int) -> int:
        operation = self.operations[a]
        match operation[0]:
            case "constant":
                return self.number(-operation[1])
            case "negate":
                return operation[1]
        return self._node("negate", a)

    def _negated(self, a: int) -> int | None:
        """Return b where a is -b, else None."""
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
            return self.number(1)
        return self._node("add", *sorted((a, b)))

    def _are_one(self, a: int, b: int) -> bool:
        """Check for cos x + 2 sin² x/2, an entry of every rotation about an axis."""
        cosine, product = self.operations[a], self.operations[b]
        if cosine[0] != "cosine" or product[0] != "multiply":
            return False
        half = self.put("multiply", self.number(0.5), cosine[1])
        sine = self._known.get(("sine", half))
        return sine is not None and b == self._multiply(self._multiply(self.number(2), sine), sine)

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
            if factor < 0:  # signs go outward, where sums take them in
                return self._negate(self._multiply(self.number(-factor), y))
            inner = self.operations[y]
            if inner[0] == "multiply" and self.constant_of(inner[1]) is not None and math.log2(factor) == int(math.log2(factor)):
                return self._multiply(self._multiply(x, inner[1]), inner[2])  # by a power of two: exact in any order
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
            return self._multiply(a, self.number(1 / divisor if (divisor := self.constant_of(b)) else math.nan))
        negative = self._negated(a)
        if negative is not None:
            return self._negate(self._divide(negative, b))
        return self._multiply(a, self._node("divide", self.number(1), b))  # one reciprocal, whatever is divided by b

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

    # ------------------------------------------------------------------ use
    def needed(self, results: Iterable[int]) -> list[int]:
        """Return the nodes that the results and guards depend on, in order."""
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
