"""A graph as C++: one function of straight lines, for one state and for a pack of states side by side, and the loop over a batch around it.

The file stands by itself: it begins with the headers of the kernels that it calls (lanes.h, sine_cosine.h).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from .. import _core
from .trace import CONSTANT, INPUT, Graph, operands

FUNCTION = "pycraft_run"
_LONGEST = 75
_PIECE = 1000
_SIGNS = {"add": " + ", "subtract": " - ", "multiply": " * ", "divide": " / "}
_STRENGTH = {"add": 1, "subtract": 1, "negate": 2, "multiply": 3, "divide": 3}
_CALLED = {"magnitude": "magnitude_of", "larger": "larger_of", "sqrt": "root_of", "log": "log_of", "sine": "sine_of", "cosine": "cosine_of"}

_PRELUDE = """\
namespace {

using pycraft::kernels::compiled::Lanes;

#if defined(__AVX512F__)
constexpr int width = 8;
#elif defined(__AVX__)
constexpr int width = 4;
#else
constexpr int width = 2;
#endif
typedef double Pack __attribute__((vector_size(width * sizeof(double))));  // as many states side by side

template <class S>
constexpr int lanes = sizeof(S) / sizeof(double);
template <class S>
using LanesOf = Lanes<double, lanes<S>>;
template <class S>
inline LanesOf<S> wide(const S& x) {
  LanesOf<S> made;
  made.v = x;
  return made;
}
inline double& lane(double& x, int) { return x; }
inline double lane(const Pack& x, int b) { return x[b]; }
template <class S>
inline S magnitude_of(const S& x) { return magnitude(wide(x)).v; }
template <class S>
inline S larger_of(const S& x, const S& y) { return larger(wide(x), wide(y)).v; }
template <class S, class F>
inline S each(S x, F f) {
  if constexpr (lanes<S> == 1) return f(x);
  else {
    for (int b = 0; b < lanes<S>; ++b) x[b] = f(x[b]);
    return x;
  }
}
template <class S>
inline S root_of(const S& x) { return each(x, [](double y) { return std::sqrt(y); }); }
template <class S>
inline S log_of(const S& x) { return each(x, [](double y) { return std::log(y); }); }
template <class S>
inline S sine_of(const S& x) { return sine_cosine(wide(x)).sine.v; }
template <class S>
inline S cosine_of(const S& x) { return sine_cosine(wide(x)).cosine.v; }
// Of n angles: packs of states angle by angle; of one state, several angles at once.
template <int n, class S>
inline void sines_and_cosines(const S (&angle)[n], S (&s)[n], S (&c)[n]) {
  if constexpr (lanes<S> > 1) {
    for (int i = 0; i < n; ++i) {
      const auto of = sine_cosine(wide(angle[i]));
      s[i] = of.sine.v, c[i] = of.cosine.v;
    }
  } else {
    for (int i = 0; i < n; i += width) {
      LanesOf<Pack> x(0.0);
      for (int b = 0; b < width && i + b < n; ++b) x.set(b, angle[i + b]);
      const auto of = sine_cosine(x);
      for (int b = 0; b < width && i + b < n; ++b) s[i + b] = of.sine.lane(b), c[i + b] = of.cosine.lane(b);
    }
  }
}

"""

_LOOP = """\
// `taken` states from state b on; how many of them are in doubt: where a guard fails, or an input or a result is not finite.
template <class S>
inline std::int64_t run(const double* const* given, const std::int64_t* strides, double* out, std::int64_t b, int taken) {{
  S input[{inputs}], y[{outputs}], odd = S{{}};
  for (int i = 0, first = 0; i < {arrays}; first += widths[i++])
    for (int j = 0; j < widths[i]; ++j) {{
      const double* const from = given[i] + b * strides[i] + j;
      S& to = input[first + j];
      if constexpr (lanes<S> == 1) to = *from;
      else for (int l = 0; l < lanes<S>; ++l) to[l] = from[(l < taken ? l : taken - 1) * strides[i]];
      odd += to - to;
    }}
  const auto held = evaluate<S>({places});
  for (int i = 0; i < {outputs}; ++i) odd += y[i] - y[i];
  const auto sound = held & (odd == S{{}});
  std::int64_t doubted = 0;
  double* const to = out + b * {outputs};
  if constexpr (lanes<S> == 1) {{
    for (int i = 0; i < {outputs}; ++i) to[i] = y[i];
    doubted = !sound;
  }} else {{
    for (int l = 0; l < taken; ++l) {{
      for (int i = 0; i < {outputs}; ++i) to[l * {outputs} + i] = y[i][l];
      doubted += !sound[l];
    }}
  }}
  return doubted;
}}

}}  // namespace

// Input i of state b lies at given[i] + b strides[i], its {outputs} results at out + {outputs} b. How many states are in doubt.
extern "C" std::int64_t {function}(const double* const* given, const std::int64_t* strides, double* out, std::int64_t states) {{
  if (states == 1) return run<double>(given, strides, out, 0, 1);
  std::int64_t doubted = 0;
  for (std::int64_t b = 0; b < states; b += width) doubted += run<Pack>(given, strides, out, b, static_cast<int>(states - b < width ? states - b : width));
  return doubted;
}}
"""


def headers() -> str:
    """What the file begins with: the headers of lanes and of sine and cosine, as one text."""
    texts = _core.kernel_headers()
    inside = "\n".join(texts[name] for name in ("lanes.h", "sine_cosine.h"))
    inside = re.sub(r'^#pragma once\n|^#include "kernels/.*\n', "", inside, flags=re.MULTILINE)
    return "#define PYCRAFT_INSTRUCTION_SET compiled\n" + inside


def written(graph: Graph, results: np.ndarray, arguments: Sequence[tuple[str, int]], title: str) -> tuple[str, int]:
    """The source, and how many operations a state takes. `arguments`: names and widths of the inputs, `results` nodes of any shape."""
    lines = _Lines(graph, results.ravel().tolist())
    starts = np.cumsum([0, *(n for _, n in arguments)]).tolist()
    widths = ", ".join(str(n) for _, n in arguments) or "0"
    places = [f"input + {start}" for start, _ in zip(starts, arguments, strict=False)]
    loop = _LOOP.format(
        inputs=max(starts[-1], 1), outputs=max(results.size, 1), arrays=len(arguments), places=", ".join([*places, "y"]), function=FUNCTION
    )
    parts = [
        *(f"// {line}" for line in title.splitlines()),
        f"// {lines.count} operations a state; t are what is computed on the way, s and c sines and cosines.",
        headers(),
        _PRELUDE.rstrip("\n"),
        "",
        f"constexpr int widths[] = {{{widths}}};",
        "",
        *_functions(lines, [name for name, _ in arguments]),
        "",
        loop,
    ]
    return "\n".join(parts), lines.count


def _functions(lines: _Lines, names: list[str]) -> list[str]:
    """`evaluate`, in pieces where it is long: a compiler's time grows faster than a function does."""
    pieces = [lines.statements[i : i + _PIECE] for i in range(0, max(len(lines.statements), 1), _PIECE)]
    angles = len(lines.early)
    arrays = [*(f"const S* {name}" for name in names), *(["const S* s", "const S* c"] if angles else [])]
    inputs = ", ".join([*names, *(["s", "c"] if angles else [])])
    made: dict[str, int] = {}  # by what is computed, in which piece
    used: dict[str, set[int]] = {}  # and in which others it is read
    for i, piece in enumerate(pieces):
        for line in [*piece, *(lines.last if i + 1 == len(pieces) else [])]:
            target = re.match(r"const S (t\d+) =", line)
            if target:
                made[target[1]] = i
            for name in re.findall(r"\bt\d+\b", line):
                if made.get(name, i) != i:  # what is made ahead is read where angles are
                    used.setdefault(name, set()).add(i)
    kept = {name: slot for slot, name in enumerate(used)}
    if len(pieces) == 1:
        inside = [*lines.ahead, *pieces[0], *lines.last]
        return ["template <class S>", f"inline auto evaluate({', '.join([*arrays[: len(names)], 'S* y'])}) {{", *("  " + line for line in inside), "}"]
    out: list[str] = []
    for i, piece in enumerate(pieces):
        read = [f"const S {name} = kept[{slot}];" for name, slot in kept.items() if i in used[name]]
        left = [f"kept[{slot}] = {name};" for name, slot in kept.items() if made[name] == i]
        last = lines.last if i + 1 == len(pieces) else []
        out += ["template <class S>", f"[[gnu::noinline]] {'auto' if last else 'void'} piece{i}({', '.join([*arrays, 'S* kept', 'S* y'])}) {{"]
        out += ["  " + line for line in [*read, *piece, *left, *last]] + ["}", ""]
    calls = [f"{'return ' if i + 1 == len(pieces) else ''}piece{i}({', '.join(filter(None, [inputs, 'kept', 'y']))});" for i in range(len(pieces))]
    head = f"inline auto evaluate({', '.join([*arrays[: len(names)], 'S* y'])}) {{"
    return [*out, "template <class S>", head, *("  " + line for line in [*lines.ahead, f"S kept[{max(len(kept), 1)}];", *calls]), "}"]


class _Lines:
    """The statements of one graph.

    Attributes
    ----------
    ahead : angles of inputs alone, their sines and cosines
    statements : one a line, `const S t... = ...;`, results and guards among them
    last : what is returned
    count : how many operations they have
    """

    def __init__(self, graph: Graph, results: list[int]):
        self.graph, self.results = graph, results
        self.order = graph.needed(results)
        self.uses = Counter(taken for node in self.order for taken in operands(graph.operations[node]))
        self.uses.update(results)
        self.text: dict[int, tuple[str, int]] = {}  # what stands for a node, and how strongly it binds (4: a name)
        self.early = self._early()
        self.count = 0
        self.ahead: list[str] = []
        self.statements: list[str] = []
        for node in self.order:
            self._take(node)
        self._put_angles_ahead()
        self.statements += [f"y[{i}] = {self._result(r)};" for i, r in enumerate(results)]
        self.last = self._guards()

    def _early(self) -> list[int]:
        """Angles of inputs alone: their sines and cosines are taken together, first."""
        fixed: set[int] = set()
        angles: list[int] = []
        for node in self.order:
            name, *taken = self.graph.operations[node]
            if name in (CONSTANT, INPUT) or (name in ("add", "subtract", "multiply", "negate") and all(x in fixed for x in taken)):
                fixed.add(node)
            elif name in ("sine", "cosine") and taken[0] in fixed and taken[0] not in angles:
                angles.append(taken[0])
        return angles

    def _take(self, node: int) -> None:
        name, *taken = self.graph.operations[node]
        match name:
            case "constant":
                self.text[node] = (_number(taken[0]), 4 if taken[0] >= 0 else 2)
                return
            case "input":
                self.text[node] = (f"{taken[0]}[{taken[1]}]", 4)
                return
        self.count += 1
        if name in ("sine", "cosine") and taken[0] in self.early:
            self.text[node] = (f"{name[0]}[{self.early.index(taken[0])}]", 4)
            return
        expression, strength = self._expression(name, taken)
        if name == "greater" or (self.uses[node] == 1 and len(expression) < _LONGEST and node not in self.early):
            self.text[node] = (expression, strength)
        else:
            self.statements.append(f"const S t{node} = {expression};")
            self.text[node] = (f"t{node}", 4)

    def _put_angles_ahead(self) -> None:
        n = len(self.early)
        if not n:
            return
        of_inputs = tuple(f"const S t{angle} =" for angle in self.early)
        self.ahead = [line for line in self.statements if line.startswith(of_inputs)]
        self.statements = [line for line in self.statements if not line.startswith(of_inputs)]
        angles = ", ".join(self.text[a][0] for a in self.early)
        self.ahead += [f"const S angle[{n}] = {{{angles}}};", f"S s[{n}], c[{n}];", "sines_and_cosines(angle, s, c);"]

    def _result(self, node: int) -> str:
        return self._whole(node) if self._is_constant(node) else self.text[node][0]

    def _guards(self) -> list[str]:
        graph = self.graph
        if any(graph.constant_of(g) == 0 for g in graph.guards):
            return ["return S{} > S{};"]  # never
        guards = dict.fromkeys(f"({self.text[g][0]})" for g in graph.guards if not self._is_constant(g))
        return [f"return {' & '.join(guards) or 'S{} == S{}'};"]

    def _is_constant(self, node: int) -> bool:
        return self.graph.constant_of(node) is not None

    def _whole(self, node: int) -> str:
        """As a number of every state, which a constant alone is not."""
        return f"S{{}} + {self.text[node][0]}" if self._is_constant(node) else f"S({self.text[node][0]})"

    def _bracketed(self, node: int, strength: int) -> str:
        text, own = self.text[node]
        return text if own > strength else f"({text})"

    def _expression(self, name: str, taken: list[int]) -> tuple[str, int]:
        if name in _CALLED:
            return f"{_CALLED[name]}({', '.join(map(self._whole, taken))})", 4
        if name == "greater":
            return " > ".join(map(self._whole, taken)), 0
        strength = _STRENGTH[name]
        if name == "negate":
            return f"-{self._bracketed(taken[0], 2)}", 2
        first, second = taken
        left = self._bracketed(first, strength - 1)
        return left + _SIGNS[name] + self._bracketed(second, strength - (name in ("add", "multiply"))), strength


def _number(x: float) -> str:
    """A double that reads back as itself."""
    if x != x:
        return 'std::nan("")'
    if x in (float("inf"), float("-inf")):
        return f"{'-' if x < 0 else ''}HUGE_VAL"
    return repr(x)
