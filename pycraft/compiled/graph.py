"""Graphs of operations: a tape of the core (cpp/lanes/tape.h) with fewer operations, before it becomes straight-line code.

A node is a constant, an input, or an operation on nodes, and is identified by its number. Operations on constants are computed, sums with
zero and products with zero or one are dropped, and equal operations are one node. A division becomes a product with the reciprocal of the
divisor, which is computed once and rounds once more; the root of a square is a magnitude, and cos x + 2 sin² x/2 is one.

Dropping 0 x and x - x is exact for finite x alone. The graph lists every x that was dropped. The code checks that results are finite, and
that inputs and a few values in between are not so large that a dropped x could be infinite (source.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

__all__ = ["Graph"]

CONSTANT, INPUT = "constant", "input"
LARGEST = 2.0**200
"""Bound of the magnitudes of inputs and of checked values in compiled code: a product of four of them does not overflow."""
_SURE = 1e300  # rounding takes no bound below it to infinity
_SHOWING = ("add", "subtract", "multiply", "negate", "magnitude", "sine", "cosine", "sqrt", "log")  # of what is not finite: not finite
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
    finite : nodes that were multiplied by zero or subtracted from themselves, and must be finite for the results to be trusted
    """

    def __init__(self) -> None:
        self.operations: list[tuple[Any, ...]] = []
        self.guards: list[int] = []
        self.finite: dict[int, None] = {}  # in the order of their finding
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

    def require_finite(self, node: int) -> int:
        """Record that the results hold only where a node is finite. Return the node of zero times the node."""
        x = self.constant_of(node)
        if x is None:
            self.finite[node] = None
        return self.zero if x is None or math.isfinite(x) else self.number(math.nan)

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
        for cosine, product in ((a, b), (b, a)):
            if self._are_one(cosine, product):
                self.require_finite(self.operations[cosine][1])
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
            return self.require_finite(a)
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
            return self.require_finite(b if a == self.zero else a)
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
        known = self._of_constants(a, b, lambda x, y: x / y if y else math.nan)
        if known is not None:
            return known
        if a == self.zero:
            return self.require_finite(self._node("divide", self.number(1), b))
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
    def needed(self, results: Sequence[int]) -> list[int]:
        """Return the nodes that the results, guards and checks depend on, in order."""
        return sorted(self._reached([*results, *self.guards, *self.checked(results)]))

    def checked(self, results: Sequence[int]) -> list[int]:
        """Return the nodes of which no magnitude may exceed `LARGEST`, so that with these all nodes of `finite` are finite.

        A node needs no check if its bound is known, or if the results would not be finite. A node that is computed for nothing else is
        bounded by the nodes that it is made of, where these are few factors.
        """
        bounds: dict[int, float] = {}
        for node, operation in enumerate(self.operations):
            bounds[node] = _bound(operation, bounds)
        shown, used, found = set(results), self._reached([*results, *self.guards]), set[int]()
        for node in range(len(self.operations) - 1, -1, -1):
            if node in self.finite and node not in shown and bounds[node] == math.inf:
                found.update(self._parts(node, used, bounds))
                shown.add(node)
            if node in shown and self.operations[node][0] in _SHOWING:
                shown.update(operands(self.operations[node]))
        return sorted(found)

    def _parts(self, node: int, used: set[int], bounds: dict[int, float]) -> set[int]:
        """Return the used nodes that bound a node if they are bounded, or the node itself."""
        parts, inside, waiting = set[int](), set[int](), [node]
        while waiting:
            x = waiting.pop()
            if x in used and bounds[x] == math.inf:
                parts.add(x)
            elif bounds[x] == math.inf and x not in inside:
                inside.add(x)
                waiting += operands(self.operations[x])
        own = bounds | dict.fromkeys(parts, LARGEST)
        for x in sorted(inside):
            own[x] = _bound(self.operations[x], own)
        return parts if own[node] < math.inf else {node}

    def _reached(self, waiting: list[int]) -> set[int]:
        """Return the nodes that some nodes depend on, and these."""
        seen = set[int]()
        while waiting:
            node = waiting.pop()
            if node not in seen:
                seen.add(node)
                waiting += operands(self.operations[node])
        return seen


def _bound(operation: Sequence[Any], bounds: Mapping[int, float]) -> float:
    """Return a bound of the magnitude of an operation, infinity where none is known."""
    of = [bounds[x] for x in operands(operation)]
    match operation[0]:
        case "constant":
            bound = abs(operation[1])
        case "input":
            bound = LARGEST
        case "add" | "subtract":
            bound = of[0] + of[1]
        case "multiply":
            bound = of[0] * of[1]
        case "negate" | "magnitude":
            bound = of[0]
        case "larger":
            bound = max(of)
        case "choose":
            bound = max(of[1:])
        case "sine" | "cosine" if of[0] < math.inf:
            bound = 1.0
        case _:
            bound = math.inf
    return bound if bound < _SURE else math.inf


def operands(operation: Sequence[Any]) -> tuple[int, ...]:
    """Return the operands of an operation."""
    return () if operation[0] in (CONSTANT, INPUT) else tuple(operation[1:])
