"""A graph as C++: one function of straight lines, for one state and for a pack of states side by side, and the loop over a batch around it.

The file is self-contained: it begins with the headers of the kernels that it calls (lanes.h, sine_cosine.h).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib import resources

import numpy as np

from .. import _core
from .graph import CONSTANT, INPUT, Graph, operands

FUNCTION = "pycraft_run"
_KNOWN = ("q", "v", "x", "tau", "vdot")
_LONGEST = 75
_PIECE = 1000
_SIGNS = {"add": " + ", "subtract": " - ", "multiply": " * ", "divide": " / "}
_STRENGTH = {"add": 1, "subtract": 1, "negate": 2, "multiply": 3, "divide": 3}
_COMPARED = {"greater": " > ", "at_least": " >= "}
_CALLED = {
    "magnitude": "magnitude_of",
    "larger": "larger_of",
    "sqrt": "root_of",
    "log": "log_of",
    "sine": "sine_of",
    "cosine": "cosine_of",
    "fraction": "fraction_of",
    "exponent": "exponent_of",
}


def _runtime(name: str) -> str:
    return resources.files(f"{__package__}.runtime").joinpath(name).read_text(encoding="utf-8").rstrip("\n")


def _headers() -> str:
    """Return the headers of lanes and of sine and cosine as one text."""
    texts = _core.kernel_headers()
    inside = "\n".join(texts[name] for name in ("lanes.h", "sine_cosine.h"))
    inside = re.sub(r'^#pragma once\n|^#include "lanes/.*\n', "", inside, flags=re.MULTILINE)
    return "#define PYCRAFT_INSTRUCTION_SET compiled\n" + inside


def written(graph: Graph, results: np.ndarray, arguments: Sequence[tuple[str, int]], title: str) -> tuple[str, int]:
    """Return the source and the operations per state. `arguments`: names and widths of the inputs; `results`: nodes of any shape."""
    lines = _Lines(graph, results.ravel().tolist())
    blanks = {
        "@INPUTS@": max(sum(n for _, n in arguments), 1),
        "@OUTPUTS@": max(results.size, 1),
        "@ARRAYS@": len(arguments),
        "@FUNCTION@": FUNCTION,
    }
    loop = _runtime("loop.h")
    for blank, value in blanks.items():
        loop = loop.replace(blank, str(value))
    parts = [
        *(f"// {line}" for line in title.splitlines()),
        f"// {lines.count} operations per state; t are intermediate values, s and c sines and cosines.",
        _headers(),
        _runtime("prelude.h"),
        "",
        f"constexpr int widths[] = {{{', '.join(str(n) for _, n in arguments) or '0'}}};",
        "",
        *_functions(lines, [_array(name) for name, _ in arguments]),
        "",
        loop,
        "",
    ]
    return "\n".join(parts), lines.count


def _array(name: str) -> str:
    """Return the C++ name of an input, because a user's vector may have a name that the source already uses."""
    return name if name in _KNOWN else f"in_{name}"


def _function(head: str, inside: Iterable[str]) -> list[str]:
    return ["template <class S>", head + " {", *("  " + line for line in inside), "}"]


def _functions(lines: _Lines, names: list[str]) -> list[str]:
    """Return `evaluate`, split into pieces if it is long, because compile time grows faster than the length of a function."""
    pieces = [lines.statements[i : i + _PIECE] for i in range(0, len(lines.statements), _PIECE)] or [[]]
    head = f"inline auto evaluate({', '.join([*(f'const S* {name}' for name in names), 'S* y'])})"
    if len(pieces) == 1:
        return _function(head, [*lines.ahead, *pieces[0], *lines.last])
    pieces[-1] += lines.last
    made, used = _across(pieces)
    kept = {name: f"kept[{slot}]" for slot, name in enumerate(used)}
    given = [*names, *(["s", "c"] if lines.early else [])]
    takes = ", ".join([*(f"const S* {name}" for name in given), "S* kept", "S* y"])
    out, calls = list[str](), list[str]()
    for i, piece in enumerate(pieces):
        last = i + 1 == len(pieces)
        read = [f"const S {name} = {place};" for name, place in kept.items() if i in used[name]]
        left = [f"{place} = {name};" for name, place in kept.items() if made[name] == i]
        inside = [*read, *piece[:-1], *left, piece[-1]] if last else [*read, *piece, *left]
        out += [*_function(f"[[gnu::noinline]] {'auto' if last else 'void'} piece{i}({takes})", inside), ""]
        calls.append(f"{'return ' if last else ''}piece{i}({', '.join([*given, 'kept', 'y'])});")
    return [*out, *_function(head, [*lines.ahead, f"S kept[{max(len(kept), 1)}];", *calls])]


def _across(pieces: list[list[str]]) -> tuple[dict[str, int], dict[str, set[int]]]:
    """Return the piece that computes each t, and the pieces that read it."""
    made: dict[str, int] = {}
    used: dict[str, set[int]] = {}
    for i, piece in enumerate(pieces):
        for line in piece:
            target = re.match(r"const S (t\d+) =", line)
            if target:
                made[target[1]] = i
            for name in re.findall(r"\bt\d+\b", line):
                if made[name] != i:
                    used.setdefault(name, set()).add(i)
    return made, used


class _Lines:
    """The statements of one graph.

    Attributes
    ----------
    ahead : angles that depend only on inputs, with their sines and cosines
    statements : one per line, `const S t... = ...;`, including results and guards
    last : the checks and the return statement
    count : number of operations
    """

    def __init__(self, graph: Graph, results: list[int]):
        self.graph, self.results = graph, results
        self.order, self.checked = graph.needed(results), graph.checked(results)
        self.uses = Counter(taken for node in self.order for taken in operands(graph.operations[node]))
        self.uses.update([*results, *self.checked])
        self.text: dict[int, tuple[str, int]] = {}  # text of a node, and its binding strength (4: a name)
        self.early, self.of_inputs = self._early()
        self.count = 0
        self.ahead: list[str] = []
        self.statements: list[str] = []
        for node in self.order:
            self._take(node)
        self._put_angles_ahead()
        self.statements += [f"y[{i}] = {self._result(r)};" for i, r in enumerate(results)]
        self.last = self._guards()

    def _early(self) -> tuple[list[int], set[int]]:
        """Return the angles that depend only on inputs, whose sines and cosines are computed together first, and the nodes inside them."""
        fixed: set[int] = set()
        angles: list[int] = []
        for node in self.order:
            name, *taken = self.graph.operations[node]
            if name in (CONSTANT, INPUT) or (name in ("add", "subtract", "multiply", "negate") and all(x in fixed for x in taken)):
                fixed.add(node)
            elif name in ("sine", "cosine") and taken[0] in fixed and taken[0] not in angles:
                angles.append(taken[0])
        inside, waiting = set[int](), list(angles)
        while waiting:
            node = waiting.pop()
            inside.add(node)
            waiting += operands(self.graph.operations[node])
        return angles, inside

    def _take(self, node: int) -> None:
        name, *taken = self.graph.operations[node]
        match name:
            case "constant":
                self.text[node] = (_number(taken[0]), 4 if taken[0] >= 0 else 2)
                return
            case "input":
                self.text[node] = (f"{_array(taken[0])}[{taken[1]}]", 4)
                return
        self.count += 1
        if name in ("sine", "cosine") and taken[0] in self.early:
            self.text[node] = (f"{name[0]}[{self.early.index(taken[0])}]", 4)
            return
        expression, strength = self._expression(name, taken)
        if name in _COMPARED or node in self.of_inputs or (self.uses[node] == 1 and len(expression) < _LONGEST):
            self.text[node] = (expression, strength)
        else:
            self.statements.append(f"const S t{node} = {expression};")
            self.text[node] = (f"t{node}", 4)

    def _put_angles_ahead(self) -> None:
        n = len(self.early)
        if not n:
            return
        angles = ", ".join(self.text[a][0] for a in self.early)
        self.ahead = [f"const S angle[{n}] = {{{angles}}};", f"S s[{n}], c[{n}];", "sines_and_cosines(angle, s, c);"]

    def _result(self, node: int) -> str:
        return self._whole(node) if self._is_constant(node) else self.text[node][0]

    def _guards(self) -> list[str]:
        graph = self.graph
        if any(graph.constant_of(g) == 0 for g in graph.guards):
            return ["return S{} > S{};"]  # never
        guards = dict.fromkeys(f"({self.text[g][0]})" for g in graph.guards if not self._is_constant(g))
        if not self.checked:
            return [f"return {' & '.join(guards) or 'S{} == S{}'};"]
        checked, n = ", ".join(self._whole(node) for node in self.checked), len(self.checked)
        guards[f"(large_of<{n}>(checked) == S{{}})"] = None
        return [f"const S checked[{n}] = {{{checked}}};", f"return {' & '.join(guards)};"]

    def _is_constant(self, node: int) -> bool:
        return self.graph.constant_of(node) is not None

    def _whole(self, node: int) -> str:
        """Return the text of a node as a pack of states, which a bare constant is not."""
        return f"S{{}} + {self.text[node][0]}" if self._is_constant(node) else f"S({self.text[node][0]})"

    def _bracketed(self, node: int, strength: int) -> str:
        text, own = self.text[node]
        return text if own > strength else f"({text})"

    def _expression(self, name: str, taken: list[int]) -> tuple[str, int]:
        if name in _CALLED:
            return f"{_CALLED[name]}({', '.join(map(self._whole, taken))})", 4
        if name in _COMPARED:
            return _COMPARED[name].join(map(self._whole, taken)), 0
        if name == "choose":
            return f"({self.text[taken[0]][0]}) ? {self._whole(taken[1])} : {self._whole(taken[2])}", 0
        strength = _STRENGTH[name]
        if name == "negate":
            inside, *swapped = self.graph.operations[taken[0]]
            if inside == "subtract" and self.uses[taken[0]] == 1:
                return self._expression("subtract", swapped[::-1])
            return f"-{self._bracketed(taken[0], 2)}", 2
        first, second = taken
        if name == "multiply":
            for one, other in ((first, second), (second, first)):
                operation = self.graph.operations[one]
                # A quotient whose dividend is available before its divisor; otherwise the reciprocal costs no wait.
                if operation[0] == "divide" and self.uses[one] == 1 and operation[2] > other:
                    return self._bracketed(other, strength - 1) + _SIGNS["divide"] + self._bracketed(operation[2], strength), strength
                if operation[0] == "divide" and one is second:
                    first, second = second, first
        left = self._bracketed(first, strength - 1)
        return left + _SIGNS[name] + self._bracketed(second, strength - (name in ("add", "multiply"))), strength


def _number(x: float) -> str:
    """Return a literal that reads back as the same double."""
    if x != x:
        return 'std::nan("")'
    if x in (float("inf"), float("-inf")):
        return f"{'-' if x < 0 else ''}HUGE_VAL"
    return repr(x)
