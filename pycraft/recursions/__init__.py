"""The plan of an expression written out as the textbook recursion: in text, in LaTeX, as Python that needs only NumPy and as C++ that
needs only Eigen.

A plan names sweeps and kernels; this module expands them into the equations of body k, its parent p and its children c. `steps` holds one
writer per kind of step, and all four languages are written from its equations. Source is self-contained: it takes the tree, the given
blocks (E, H, M, J, and the other letters of the expression) and x, and computes P, D, G, ψ, R, Υ, ... as needed; the functions of
`runtime/` that it calls are copied to its start.
"""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np

from .. import _core
from . import step_blocks, step_realizations, step_vectors  # noqa: F401 - imported to register their writers
from .cpp_source import CppSource
from .formulas import At, Product, Quantity
from .naming import Workbook
from .passes import Equation, Once, Operator, Program, Term, fused, pruned, reads
from .python_source import PythonSource
from .recursion import Latex, Line, Text
from .steps import Recursion
from .steps_taken import Pass, Step, taken_steps, told_passes

__all__ = ["LANGUAGES", "Algorithm", "Pass", "Step", "algorithm"]

LANGUAGES = ("text", "latex", "python", "cpp")
_RESULTS = {"apply": "vector", "dense": "matrix", "diagonal": "vector", "blockdiag": "blocks"}
_TITLES = {
    "apply": "y = {} x",
    "dense": "y = {}, as a matrix",
    "diagonal": "y = the diagonal of {}",
    "blockdiag": "y = the diagonal blocks of {}",
    "trace": "y = tr({})",
    "logdet": "y = ln|det({})|",
    "norm": "y = ‖{}‖",
}


class Algorithm:
    """A recursion that computes an expression, as text, LaTeX, Python or C++. `str()` returns the requested language.

    Attributes
    ----------
    text, latex : the recursion in textbook notation
    language, request : the arguments of `Operator.algorithm`

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.chain(3)
    >>> H, phi, M = arm.soa("H phi M")
    >>> print((H @ phi @ M).algorithm())
    y = H φ M x
    given: E(p,k), H(k), M(k) of every body k, p its parent, c its children; what is read at the parent of a root is zero
    for k from tip to base:
      f(k) = M(k) x(k) + Σ_c E(k,c) f(c)
      y(k) = H(k) f(k)
    cost: O(N), about 531 flops for one column; 3 bodies, 3 coordinates
    """

    def __init__(self, expression: Any, language: str = "text", request: str = "apply"):
        if language not in LANGUAGES:
            raise _core.EvaluationError(f"no algorithm is written in {language!r}; there are {', '.join(LANGUAGES)}")
        self.language, self.request, self._expression = language, request, expression
        self._book = Workbook()
        self._parts = _parts_of(expression, request)
        self._plans = [operand.plan(kind) for operand, kind, _ in self._parts]
        self._recursions: list[Recursion] = []
        vectors: dict[str, Quantity] = {}
        scalar = isinstance(expression, _core.Scalar)
        for plan in self._plans:
            recursion = Recursion(self._book, plan.program, "t" if scalar else "y", vectors)
            self._recursions.append(recursion)
            recursion.nested |= scalar
            recursion.write()
        self._program = self._sum() if scalar else self._recursions[0].program
        self._vectors = list(vectors.values())
        self._book.sort_leaves()
        needed = {q for item in self._program.items for q in reads(item)} | {self._program.result}
        inside = [q for item in self._program.items if isinstance(item, Operator) for q in reads(item)]
        self._needed = needed.union(inside)

    def __reduce__(self):
        return Algorithm, (self._expression, self.language, self.request)  # a plan belongs to one process and is built again

    def _sum(self) -> Program:
        """Add up the numbers and parts of a scalar."""
        program = Program(items=list(self._book.items))
        terms = []
        for recursion, (_, _, coefficient) in zip(self._recursions, self._parts, strict=True):
            program.items += recursion.program.items
            program.inputs += recursion.program.inputs
            program.identity_columns |= recursion.program.identity_columns
            terms.append(Term(At(recursion.program.result, ""), coefficient))
        constant = _constant_of(self._expression)
        if len(terms) == 1 and terms[0].coefficient == 1 and not constant:
            program.result = self._recursions[0].program.result
            program.items = fused(pruned(program.items, {program.result}))
            return program
        if constant or not terms:
            terms.append(Term(Product(()), constant))
        program.result = self._book.new("y", "scalar")
        program.items.append(Once(Equation(program.result, tuple(terms))))
        program.items = fused(pruned(program.items, {program.result}))
        return program

    # ------------------------------------------------------------------ what is shown
    @property
    def title(self) -> str:
        """The computed result, in one line."""
        if isinstance(self._expression, _core.Scalar):
            return f"{Text().letter(self._program.result)} = {self._expression.text()}"
        shape = "y = {}" if self.request == "apply" and not self._program.inputs else _TITLES[self.request]
        return shape.format(self._bracketed(self._expression.text()) if " x" in shape else self._expression.text())

    def _bracketed(self, text: str) -> str:
        return f"({text})" if self._expression.kind == "sum" else text

    @property
    def text(self) -> str:
        """The recursion in Unicode letters."""
        words = Text()
        lines = [self.title, *(f"by {note}" for plan in self._plans for note in plan.notes)]
        lines += [f"in {precision} precision; source is written in double" for precision in self._precisions()]
        leaves = [leaf for leaf in self._book.leaves if leaf.quantity in self._needed]
        blocks = ", ".join(_place(words, leaf.quantity) for leaf in leaves if leaf.quantity.kind == "blocks")
        if blocks:
            lines.append(f"given: {blocks} of every body k, p its parent, c its children; what is read at the parent of a root is zero")
        others = ", ".join(words.letter(leaf.quantity) for leaf in leaves if leaf.quantity.kind != "blocks")
        lines += [f"given: {others}"] if others else []
        for model in self._book.models if len(self._book.models) > 1 else []:
            own = ", ".join(words.letter(leaf.quantity) for leaf in leaves if leaf.context == model.index)
            lines += [f"  {own}: {model.words}"] if own else []
        lines += ["  " * depth + line for depth, line in self._lines(words)]
        return "\n".join([*lines, self._cost()])

    @property
    def latex(self) -> str:
        """The recursion in LaTeX: an aligned block."""
        words = Latex()
        lines = self._lines(words)
        rows = "\\\\\n".join("&" + "\\quad " * depth + line for depth, line in lines)
        return "\\begin{aligned}\n" + rows + "\n\\end{aligned}"

    def _precisions(self) -> list[str]:
        return sorted({r.plan["precision"] for r in self._recursions} - {"double"})

    def _lines(self, words: Text) -> list[Line]:
        columns = [(0, f"{words.letter(x)} = I") for x in self._program.inputs if self._program.identity_columns]
        return columns + words.items(self._program.items)

    def _cost(self) -> str:
        flops = sum(plan.flops for plan in self._plans)
        dense = any(plan.has_dense_step for plan in self._plans)
        columns = any(recursion.plan["columns_of_identity"] for recursion in self._recursions)
        order = "O(N³), a dense step" if dense else "O(N) for each column of the identity" if columns else "O(N)"
        if any(step["kind"] == "mass_matrix_dense" for recursion in self._recursions for step in recursion.plan["steps"]):
            order = "O(N · depth)"
        sizes = "".join(f"; {len(m.bodies.rows)} bodies, {m.theta.total} coordinates" for m in self._book.models[:1])
        return f"cost: {order}, about {flops:.0f} flops for one column{sizes}"

    def __str__(self) -> str:
        return {"text": lambda: self.text, "latex": lambda: self.latex, "python": self.python, "cpp": self.cpp}[self.language]()

    def __repr__(self) -> str:
        return str(self)

    def _repr_latex_(self) -> str | None:
        return f"$\\displaystyle {self.latex}$" if self.language in ("text", "latex") else None

    # ------------------------------------------------------------------ source
    def python(self, *, with_data: bool = False, name: str = "algorithm") -> str:
        """Return a Python module that needs only NumPy: `name(data, x)`; `with_data` adds DATA, the values at the present state."""
        _check_name(name)
        source = PythonSource(self._book, self._arguments(), self._needed)
        return source.module(self._program, self.title, self._shape(), _listed(self.data()) if with_data else None, name)

    def cpp(self, *, with_data: bool = False, name: str = "algorithm") -> str:
        """Return a C++17 source that needs only Eigen: `name::run(data, x)` in a namespace of that name.

        `with_data` adds `name::present()`, the values at the present state, and a `main` that prints the result for x = 1
        (omitted if NO_MAIN is defined).
        """
        _check_name(name)
        source = CppSource(self._book, self._arguments(), self._needed)
        return source.file(self._program, self.title, self._shape(), self.data() if with_data else None, name)

    # ------------------------------------------------------------------ steps
    def lines(self) -> list[tuple[int, str]]:
        """Return the recursion line by line, with the indentation of each: `text` without its head."""
        return self._lines(Text())

    def passes(self) -> list[Pass]:
        """Return the recursion's passes over trees in order: direction, tree and lines of each.

        Examples
        --------
        >>> import pycraft as pc
        >>> soa = pc.chain(2).soa
        >>> [(one.ways, one.parents) for one in soa.MM.inv().algorithm().passes()]
        [((-1,), (-1, 0)), ((1,), (-1, 0))]
        """
        return told_passes(self._program, self._book.trees)

    def steps(self, x: Any = None, q: Any = None, v: Any = None, *, state: int = 0) -> list[Step]:
        """Return the intermediate results of the recursion, equation by equation and body by body, in the order of its passes.

        Parameters
        ----------
        x : (n,) or (n, m), argument of the operator; default: ones
        q, v, state : as for `data`

        Returns
        -------
        list of Step
            An elimination, or a recursion inside the recursion, is one step without a body; its inner steps are not listed.

        Raises
        ------
        EvaluationError
            An x that the expression does not take; an external operator, which has no equations.

        Cost: one run of the Python source.

        Examples
        --------
        >>> import pycraft as pc
        >>> H, phi, M = pc.chain(2).soa("H phi M")
        >>> written = (H @ phi @ M @ phi.T @ H.T).algorithm()
        >>> for step in written.steps()[:3]:
        ...     print(step.body, written.lines()[step.line][1])
        0 α(k) = E*(p,k) α(p) + H*(k) x(k)
        1 α(k) = E*(p,k) α(p) + H*(k) x(k)
        1 f(k) = M(k) α(k) + Σ_c E(k,c) f(c)
        """
        source = PythonSource(self._book, self._arguments(), self._needed)
        written = source.module(self._program, self.title, "everything", None, "algorithm")
        return taken_steps(self._program, self._arguments(), written, self.data(q, v, state=state), x)

    def _arguments(self) -> list[Quantity]:
        return [*self._program.inputs, *self._vectors]

    def _shape(self) -> str:
        if isinstance(self._expression, _core.Scalar):
            return "scalar"
        whole = self._program.result.kind == "matrix"  # of R^n, which is not divided among bodies
        return "matrix" if self.request == "blockdiag" and whole else _RESULTS.get(self.request, "scalar")

    # ------------------------------------------------------------------ numbers
    def data(self, q: Any = None, v: Any = None, *, state: int = 0) -> dict[str, Any]:
        """Return the data that the source takes: the tree and the given blocks, at the present state or at (q, v).

        Parameters
        ----------
        q, v : state of the unbound letters; default: the model's present state
        state : index in the batch, if the expression is bound to a batch

        Returns
        -------
        A dictionary of lists and arrays. An external operator is missing: put a callable in its place.
        """
        plans = self._plans
        if q is not None:
            bound = self._expression.at(q, v)
            plans = [operand.plan(kind) for operand, kind, _ in _parts_of(bound, self.request)]
        data: dict[str, Any] = {}
        for tree in self._book.trees:
            data[f"parent{tree.suffix}"] = list(tree.parents)
        for cut in self._book.cuts:
            data[cut.key] = [len(r) for r in cut.rows] if cut.contiguous else [list(r) for r in cut.rows]
        for leaf in self._book.leaves:
            if leaf.quantity not in self._needed or leaf.source == "external":
                continue
            if leaf.source == "constant":
                data[leaf.quantity.name] = leaf.numbers
                continue
            model = self._book.models[leaf.context]
            part, context = self._place_of(model)
            numbers = plans[part].numbers(context, leaf.symbol, leaf.arguments, state)
            if leaf.source == "root frame":
                numbers = [b if p < 0 else np.zeros_like(b) for b, p in zip(numbers, model.source.parents, strict=True)]
            data[leaf.quantity.name] = numbers
        return data

    def json(self, q: Any = None, v: Any = None, *, state: int = 0) -> str:
        """Return the same data as JSON text; the Python source accepts the parsed data."""
        return json.dumps(_listed(self.data(q, v, state=state)))

    def _place_of(self, model: Any) -> tuple[int, int]:
        """Part and context of a model's letters."""
        for part, recursion in enumerate(self._recursions):
            if model in recursion.models:
                return part, recursion.models.index(model)
        raise AssertionError("a model of no part")


def _check_name(name: str) -> None:
    """Check that a name is valid in both languages."""
    if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII):
        raise _core.EvaluationError(f"name={name!r}: start with a letter, and use only letters, digits and underscores")


def _place(words: Text, quantity: Quantity) -> str:
    """A given quantity with its place."""
    return words.node(At(quantity, "k" if quantity.kind == "blocks" else ""))


def _parts_of(expression: Any, request: str) -> list[tuple[Any, str, float]]:
    """(operator, request, coefficient) of an operator, or of every operator in a scalar."""
    if not isinstance(expression, _core.Scalar):
        return [(expression, request, 1.0)]
    if expression.operand is not None:
        return [(expression.operand, expression.kind, 1.0)]
    factor = expression.number if expression.kind == "scaled" else 1.0
    return [(o, r, factor * c) for term in expression.terms for o, r, c in _parts_of(term, request)]


def _constant_of(scalar: Any) -> float:
    """The number in a scalar."""
    if scalar.kind == "number":
        return float(scalar.number)
    inner = sum(_constant_of(term) for term in scalar.terms)
    return float(scalar.number * inner) if scalar.kind == "scaled" else float(inner)


def _listed(value: Any) -> Any:
    """Arrays as lists, throughout."""
    if isinstance(value, dict):
        return {key: _listed(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_listed(item) for item in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def algorithm(expression: Any, language: str = "text", request: str = "apply") -> Algorithm:
    """Return the recursion that computes an operator's request (apply, dense, diagonal, blockdiag, trace, logdet, norm), or a scalar.

    Examples
    --------
    >>> import numpy as np, pycraft as pc
    >>> arm = pc.chain(2)
    >>> H, phi, M = arm.soa("H phi M")
    >>> MM = H @ phi @ M @ phi.T @ H.T
    >>> written = MM.inv().algorithm("python")
    >>> names = {}
    >>> exec(str(written), names)
    >>> x = np.array([1.0, 2.0])
    >>> bool(np.allclose(names["algorithm"](written.data(), x), MM.inv() @ x))
    True
    """
    return Algorithm(expression, language, request)
