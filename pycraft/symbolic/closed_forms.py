"""Closed forms: every operator of a small mechanism as a SymPy matrix of formulas in its coordinates.

Cost: the entries of P, D, K, ψ, ... grow exponentially with the coordinates (docs/symbolic.md has the counts), so `symbolic` refuses
mechanisms beyond four of them unless it is forced to. SymPy is imported when it is first asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core

if TYPE_CHECKING:
    import sympy

    from ..models.multibody import Multibody
    from .rational import Matrix, Rationals

LARGEST = 4
_DERIVED = ("MM", "mass_matrix", "mass_matrix_inverse", "bias_forces", "innovations")


def symbolic(
    model: Multibody,
    names: Sequence[Any] | str | None = None,
    parameters: str | Mapping[Any, Any] = "numeric",
    *,
    simplify: bool = True,
    unit_quaternions: bool = False,
    force: bool = False,
) -> ClosedForms:
    """Closed forms of a mechanism's operators: any expression of its letters as a SymPy matrix.

    Parameters
    ----------
    model : Multibody
        Its structure, numbers and gravity as they are now; later edits do not show.
    names : sequence of nq names or SymPy symbols, or one string of names
        Of the coordinates q; q1, q2, ... if left out. Velocities are v1, v2, ... (nv).
    parameters : {"numeric", "symbolic"} or mapping
        "numeric": masses, lengths, ... are exact fractions (or roots) equal to the model's doubles. "symbolic": every one that is not
        zero is a symbol: masses m1, m2, ..., uniform rods along x have lengths l1, l2, ..., other bodies centres of mass c1x, ..., inertias
        I1xx, ..., places p1x, ..., rotor inertias J1, ..., pitches h1, points of axes o1x, ..., gravity g; rotations and axes stay
        numbers. A mapping gives some, e.g. ``{("upper", "mass"): "m", ("upper", "com"): [l / 2, 0, 0], "gravity": [0, 0, "-g"]}``:
        the keys are (body, "mass" | "com" | "inertia" | "position" | "rotation" | "rotor_inertia" | "pitch"), (node, "position") and
        "gravity", the values SymPy expressions or names of symbols (a name's sign is that of its expression: "g", with the model's
        own number known where it can be solved for).
    simplify : bool
        Show the shortest of several forms (reduced, factored, with sums of angles); otherwise the reduced fraction as it comes.
    unit_quaternions : bool
        Take the quaternions of ball and free hinges as of unit length. Otherwise they enter as q/|q|, as everywhere in pycraft.
    force : bool
        Go ahead beyond four coordinates.

    Returns
    -------
    ClosedForms : letters by their ASCII names (`.M`, `.D`, `.psi`, ...), `.evaluate(expression)` for everything else

    Raises
    ------
    ModelError
        The mechanism is too large, a name or parameter does not fit, or the model is not a Multibody.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.symbolic.closed_forms import symbolic
    >>> s = symbolic(pc.chain(2), parameters="symbolic")
    >>> s.mass_matrix[0, 0]
    l1**2*m1/3 + l1**2*m2 + l1*l2*m2*cos(q2) + l2**2*m2/3
    >>> s.D[1, 1]
    l2**2*m2/3
    """
    if not isinstance(model, _core.Multibody):
        raise _core.ModelError(f"closed forms are made of a Multibody, not of {type(model).__name__}: its coordinates are the symbols")
    if not force and model.nv > LARGEST and not _single_step(model):
        raise _core.ModelError(
            f"{model.name!r} has {model.nv} coordinates; closed forms grow exponentially with them, so beyond {LARGEST} they are no longer "
            f"formulas that anyone reads (a bicycle's symbolic mass matrix has over a million operations). Lock hinges until {LARGEST} "
            "coordinates are left, or evaluate the operators at a state (op.at(q).dense(), op.algorithm() for code); "
            "force=True goes ahead all the same"
        )
    return ClosedForms(model, names, parameters, simplify, unit_quaternions)


def _single_step(model: Multibody) -> bool:
    """One body on one subhinge: a free body's operators are short."""
    bodies = model.description()["bodies"]
    return len(bodies) == 1 and len(bodies[0]["hinge"]["subhinges"]) <= 1


class ClosedForms:
    """The operators of one mechanism as SymPy matrices, see `symbolic`. Letters are attributes; each is computed when first read.

    Attributes
    ----------
    q, v : tuples of symbols, (nq,) and (nv,)
    parameters : dict from the symbols of masses, lengths, ... to the model's numbers, where they are known
    MM, mass_matrix, mass_matrix_inverse, innovations, bias_forces : ℳ = HφMφ*H*; ℳ + J; its inverse; I - HψK; 𝒞 with gravity, (nv, 1)
    """

    def __init__(
        self, model: Multibody, names: Sequence[Any] | str | None, parameters: str | Mapping[Any, Any], simplify: bool, unit: bool
    ):
        from .letters import Letters
        from .parameters import Parameters

        self.model, self._simplify = model, simplify
        self.q, self.v = _symbols(model, names)
        made = Parameters(model.description(), parameters)
        self._letters = Letters(made, self.q, self.v, unit)
        self.parameters: dict[sympy.Symbol, float] = made.values
        taken = {x for e in made.expressions() for x in e.free_symbols} & {*self.q, *self.v}
        if taken:
            raise _core.ModelError(f"{', '.join(sorted(map(str, taken)))}: a parameter and a coordinate of one name; give names=")
        self._field: Rationals = self._letters.field
        self._shown: dict[Any, sympy.ImmutableDenseMatrix] = {}

    # ------------------------------------------------------------------ letters
    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        from .letters import LETTERS

        if name in ("B", "Jacobian", "Lambda"):
            return lambda nodes: self._letter(name, [nodes] if isinstance(nodes, str) else list(nodes))
        if name == "Delta":
            return lambda coordinate: self._letter(name, self._coordinate(coordinate))
        if name not in LETTERS:
            raise AttributeError(f"no closed form is called {name!r}; there are {', '.join(LETTERS)}, and evaluate(expression)")
        return self._letter(name)

    def __dir__(self) -> list[str]:
        from .letters import LETTERS

        return [*super().__dir__(), *LETTERS]

    def __call__(self, names: str) -> Any:
        """Several letters at once: ``M, D = s("M D")``."""
        made = tuple(getattr(self, name) for name in names.split())
        return made[0] if len(made) == 1 else made

    def _letter(self, name: str, argument: Any = None) -> sympy.ImmutableDenseMatrix:
        key = (name, tuple(argument) if isinstance(argument, list) else argument)
        if key not in self._shown:
            self._shown[key] = self._letters(name, argument).sympy(self._simplify)
        return self._shown[key]

    def _coordinate(self, coordinate: int | str) -> int:
        names = self.model.coordinate_names
        if isinstance(coordinate, str):
            if coordinate not in names:
                raise _core.ModelError(f"no coordinate of {self.model.name!r} is called {coordinate!r}; there are {', '.join(names)}")
            return names.index(coordinate)
        if not 0 <= coordinate < len(self.v):
            raise _core.ModelError(f"coordinate {coordinate} of {self.model.name!r}: there are {len(self.v)}")
        return int(coordinate)

    # ------------------------------------------------------------------ expressions
    def evaluate(self, expression: Any, given: Mapping[str, Any] | None = None) -> Any:
        """An operator or scalar expression as a SymPy matrix (codomain, domain), or as a SymPy number.

        Parameters
        ----------
        expression : an expression of this model's letters (not bound to a state), or a letter's name
        given : what named vectors and constants stand for, as arrays of SymPy expressions; a vector "T" that is not listed has the
            entries T1, T2, ..., a constant that is not listed its numbers

        Returns
        -------
        sympy.ImmutableDenseMatrix, or a SymPy expression for a scalar

        Raises
        ------
        EvaluationError
            The expression is of another model, bound to a state (`.at(q)`), an I without a space, or made of a Python function.
        SingularHingeError, SingularOperatorError
            D(k), or what is inverted, is singular at every state.
        """
        return self._value(expression, given or {}, self._simplify)

    def _value(self, expression: Any, given: Mapping[str, Any], simplify: bool) -> Any:
        if isinstance(expression, str):
            return getattr(self, expression) if simplify == self._simplify else self._letters(expression).sympy(simplify)
        if isinstance(expression, _core.Scalar):
            return self._scalar(expression, given, simplify)
        if not isinstance(expression, _core.Operator):
            raise TypeError(f"closed forms are of operator expressions, not of {type(expression).__name__}")
        return self._matrix(expression, given).sympy(simplify)

    def _matrix(self, expression: Any, given: Mapping[str, Any]) -> Matrix:
        expression.check_current()
        if any(source is not self.model.soa._source for source in expression.sources):
            raise _core.EvaluationError(f"{expression.text()} is not made of the letters of {self.model.name!r}")
        made = _Evaluation(self, given).of(expression)
        if expression.domain is None:
            raise _core.EvaluationError(f"{expression.text()} is said of no space: an I takes its space from an operator beside it")
        return made

    def _scalar(self, scalar: Any, given: Mapping[str, Any], simplify: bool) -> Any:
        import sympy

        from .rational import exact

        kind, value, operand, terms = scalar._parts()
        name = ("number", "trace", "logdet", "norm", "sum", "scaled")[kind]
        if name == "number":
            return exact(value)
        if name == "sum":
            return sympy.Add(*(self._scalar(t, given, simplify) for t in terms))
        if name == "scaled":
            return exact(value) * self._scalar(terms[0], given, simplify)
        matrix = self._matrix(operand, given)
        show = lambda x: matrix.field.expression(x, simplify)  # noqa: E731
        if name == "trace":
            return show(matrix.trace())
        if name == "logdet":
            determinant = matrix.determinant()
            if not determinant:
                raise _core.SingularOperatorError(f"ln det of {operand.text()}, which is singular at every state")
            return sympy.log(sympy.Abs(show(determinant)))
        return sympy.sqrt(show((matrix.T @ matrix).trace()))

    def diff(self, expression: Any, coordinate: int | str, given: Mapping[str, Any] | None = None) -> Any:
        """∂_i of an expression, a letter's name or a SymPy matrix: along the velocity of coordinate i, v held fixed.

        For ball and free hinges that is the directional derivative along the body twist e_i, q̇ = Γ(q)e_i.
        """
        return self._along(expression, [int(k == self._coordinate(coordinate)) for k in range(len(self.v))], given)

    def dot(self, expression: Any, given: Mapping[str, Any] | None = None) -> Any:
        """The time derivative along v, v itself held fixed."""
        return self._along(expression, self.v, given)

    def _along(self, expression: Any, direction: Sequence[Any], given: Mapping[str, Any] | None) -> Any:
        import sympy

        if isinstance(expression, sympy.MatrixBase | sympy.Expr):
            value = sympy.expand_trig(expression)
        else:
            value = self._value(expression, given or {}, False)
        rates = self._letters.rates().sympy(False) * sympy.Matrix(direction)
        turned = lambda e: self._again(sum((e.diff(x) * r for x, r in zip(self.q, rates, strict=True)), sympy.S.Zero))  # noqa: E731
        return value.applyfunc(turned) if isinstance(value, sympy.MatrixBase) else turned(value)

    def _again(self, e: Any) -> Any:
        """A derivative brought to the form of the entries, where it is a rational function again."""
        try:
            return self._field.expression(self._field.element(e), self._simplify)
        except _core.EvaluationError:
            return e

    # ------------------------------------------------------------------ numbers
    def at(
        self,
        expression: Any,
        q: Any = None,
        v: Any = None,
        values: Mapping[Any, float] | None = None,
        given: Mapping[str, Any] | None = None,
    ) -> np.ndarray:
        """The formulas' value at a state: float64 (codomain, domain), computed with 50 digits.

        q, v: the model's present state where left out; values: of symbols, the model's own numbers where left out.
        """
        import mpmath
        import sympy

        formula = expression if isinstance(expression, sympy.MatrixBase | sympy.Expr) else self.evaluate(expression, given)
        state = dict(
            zip([*self.q, *self.v], [*_listed(self.model.q if q is None else q), *_listed(self.model.v if v is None else v)], strict=True)
        )
        numbers = self.parameters | state | dict(values or {})
        missing = sorted(map(str, formula.free_symbols - set(numbers)))
        if missing:
            raise _core.EvaluationError(f"values= is missing for {', '.join(missing)}")
        used = sorted(formula.free_symbols, key=str)
        function = sympy.lambdify(used, formula, "mpmath", cse=True)
        with mpmath.workdps(50):
            found = function(*(mpmath.mpf(numbers[x]) for x in used))
        entries = found.tolist() if isinstance(formula, sympy.MatrixBase) else found
        return np.array(entries, dtype=float).reshape(formula.shape if isinstance(formula, sympy.MatrixBase) else ())

    def block(self, expression: Any, row: str, column: str) -> Any:
        """The block of an operator expression in the row and column of these labels: body, hinge or node names."""
        if isinstance(expression, str):
            expression = getattr(self.model.soa, expression)
        made = self.evaluate(expression)
        cut = []
        for label, space in ((row, expression.codomain), (column, expression.domain)):
            found = {name: where for name, where, _ in space.blocks}
            if label not in found:
                raise KeyError(f"no block row or column is called {label!r}; there are {', '.join(found)}")
            cut.append(found[label])
        return made[cut[0], cut[1]]

    def __repr__(self) -> str:
        known = f"; parameters {', '.join(map(str, self.parameters))}" if self.parameters else ""
        return f"<closed forms of {self.model.name!r} in {', '.join(map(str, self.q))}{known}>"


def _listed(x: Any) -> list[float]:
    return np.asarray(x, float).ravel().tolist()


def _symbols(model: Multibody, names: Sequence[Any] | str | None) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    import sympy

    if isinstance(names, str):
        names = names.replace(",", " ").split()
    given = [f"q{i + 1}" for i in range(model.nq)] if names is None else list(names)
    if len(given) != model.nq:
        raise _core.ModelError(f"{model.name!r} has {model.nq} coordinates, so names= takes {model.nq}, not {len(given)}")
    q = tuple(sympy.Symbol(x, real=True) if isinstance(x, str) else x for x in given)
    v = sympy.symbols(f"v1:{model.nv + 1}", real=True)
    if len({*q, *v}) < len(q) + len(v) or not all(isinstance(x, sympy.Symbol) for x in q):
        raise _core.ModelError(
            f"names of coordinates are different symbols, and none of v1, ..., v{model.nv}: got {', '.join(map(str, q))}"
        )
    return q, tuple(v)


def _require_unbound(e: Any, binding: Any) -> None:
    if binding is not None:
        raise _core.EvaluationError(f"{e.text()} is bound to a state; closed forms are of expressions without .at(q)")


class _Evaluation:
    """One walk over an expression. An I without a space is a number until it meets a matrix."""

    def __init__(self, forms: ClosedForms, given: Mapping[str, Any]):
        self._forms, self._given = forms, given
        self._known: dict[Any, Any] = {}

    def of(self, e: Any) -> Any:
        """The matrix of an expression; of one without a space, the factor before I."""
        if e not in self._known:
            self._known[e] = getattr(self, f"_{e.kind}", self._unknown)(e)
        return self._known[e]

    def _unknown(self, e: Any) -> Any:
        raise _core.EvaluationError(f"{e.text()}: an expression of kind {e.kind!r} has no closed form here")

    def _children(self, e: Any) -> list[Any]:
        """The children's matrices over one field."""
        made = [self.of(c) for c in e.children]
        field = self._forms._field
        return [x if c.domain is None else x.lifted(field) for x, c in zip(made, e.children, strict=True)]

    # ------------------------------------------------------------------ leaves
    def _symbol(self, e: Any) -> Matrix:
        _, name, numbers, nodes, _, binding = e._parts()[1]
        _require_unbound(e, binding)
        arguments = list(nodes) or list(numbers)
        if len(arguments) == 1 and not nodes:
            return self._forms._letters(name, arguments[0])
        return self._forms._letters(name, arguments) if arguments else self._forms._letters(name)

    def _function(self, e: Any) -> Matrix:
        """Block functions, which derivatives bring up: crm, crf, mcross of a vector, the lower triangle with half its diagonal."""
        (x,) = self._children(e)
        payload = e._parts()[1]
        if payload is None:
            made = self._blockwise(e.children[0], x, lambda block: block.lower_half())
            if made is None:
                raise _core.EvaluationError(f"{e.text()}: a lower half is taken body by body, of a block-diagonal operator")
            return made
        _require_unbound(e, payload[-1])
        return self._forms._letters.function(payload[1], x)

    def _identity(self, e: Any) -> Any:
        from .rational import Matrix

        return 1 if e.domain is None else Matrix.identity(self._forms._field, e.domain.dimension)

    def _zero(self, e: Any) -> Matrix:
        from .rational import Matrix

        return Matrix.zeros(self._forms._field, e.codomain.dimension, e.domain.dimension)

    def _vector(self, e: Any) -> Matrix:
        import sympy

        if e.name in self._given:
            return self._entries(self._given[e.name], e)
        return self._entries([sympy.Symbol(f"{e.name}{i + 1}", real=True) for i in range(e.codomain.dimension)], e)

    def _constant(self, e: Any) -> Matrix:
        from .rational import exact

        name = e._parts()[1][-1]
        if name in self._given:
            return self._entries(self._given[name], e)
        return self._entries([[exact(x) for x in row] for row in e.dense()], e)

    def _entries(self, entries: Any, e: Any) -> Matrix:
        """An array of expressions as a matrix of the expression's shape, over a field that has all its symbols."""
        import sympy

        from .rational import Matrix

        rows, columns = e.shape
        listed = entries.tolist() if isinstance(entries, sympy.MatrixBase | np.ndarray) else list(entries)
        flat = [sympy.sympify(x) for row in listed for x in (row if isinstance(row, list | tuple) else [row])]
        if len(flat) != rows * columns:
            raise _core.EvaluationError(f"{e.text()} is given {len(flat)} entries; it is an array ({rows}, {columns})")
        self._forms._field = self._forms._field.extended(flat)
        return Matrix.of(self._forms._field, [flat[i * columns : (i + 1) * columns] for i in range(rows)], columns)

    def _external(self, e: Any) -> Matrix:
        raise _core.EvaluationError(f"{e.text()} is a Python function of numbers: it has no closed form")

    # ------------------------------------------------------------------ composed
    def _number(self, x: Any, dimension: int) -> Matrix:
        """A factor of I as a matrix."""
        from .rational import Matrix

        field = self._forms._field
        return Matrix.identity(field, dimension).scaled(field.element(x))

    def _sum(self, e: Any) -> Any:
        if e.domain is None:
            return sum(self.of(c) for c in e.children)
        parts = [self._number(x, e.domain.dimension) if c.domain is None else x for x, c in zip(self._children(e), e.children, strict=True)]
        field = self._forms._field
        total = parts[0].lifted(field)
        for part in parts[1:]:
            total = total + part.lifted(field)
        return total

    def _product(self, e: Any) -> Any:
        parts, factor, made = self._children(e), 1, None
        for x, c in zip(parts, e.children, strict=True):
            if c.domain is None:
                factor = factor * x
            else:
                made = x if made is None else made @ x
        return factor if made is None else made if factor == 1 else made.scaled(made.field.element(factor))

    def _scaled(self, e: Any) -> Any:
        from .rational import exact

        (x,), number = self._children(e), exact(e.coefficient)
        if e.domain is None:
            return number * x
        field = self._forms._field = self._forms._field.extended([number])
        return x.lifted(field).scaled(field.element(number))

    def _transpose(self, e: Any) -> Any:
        (x,) = self._children(e)
        return x if e.domain is None else x.T

    def _inverse(self, e: Any) -> Any:
        (x,) = self._children(e)
        if e.domain is None:
            return 1 / x
        if e.children[0].kind == "symbol" and e.children[0].name == "D":
            return self._forms._letters("D_inverse")
        made = self._blockwise(e.children[0], x, lambda block: block.inverse())
        return x.inverse() if made is None else made

    def _blockdiag(self, e: Any) -> Any:
        from .rational import Matrix

        (x,) = self._children(e)
        if e.domain is None:
            return x
        made = Matrix.zeros(x.field, *x.shape)
        for _, rows, body in e.codomain.blocks:
            for _, columns, other in e.domain.blocks:
                if body == other:
                    made.place(rows, columns, x.block(rows, columns))
        return made

    def _blockwise(self, e: Any, x: Matrix, make: Callable[[Matrix], Matrix]) -> Matrix | None:
        """make(block) of each diagonal block of an operator known to have no others; None where that is not known."""
        from .rational import Matrix

        rows, columns = e.codomain.blocks, e.domain.blocks
        if not e.is_block_diagonal or [r[1] for r in rows] != [c[1] for c in columns]:
            return None
        made = [make(x.block(where, where)) for _, where, _ in rows]
        field = self._forms._field
        return Matrix.diagonal(field, [block.lifted(field) for block in made])

    def _sqrt(self, e: Any) -> Matrix:
        (x,) = self._children(e)
        made = self._blockwise(e.children[0], x, self._cholesky)
        if made is None:
            raise _core.EvaluationError(f"{e.text()}: a root is taken body by body, of a block-diagonal operator")
        return made

    def _cholesky(self, a: Matrix) -> Matrix:
        """L, lower triangular, with A = LL*: columns of the Schur complements over the roots of their pivots."""
        from .rational import Matrix

        n, sample, columns = len(a.rows), self._sample(), []
        for j in range(n):
            pivot = a.rows[j].get(j)
            column = a.block(slice(0, n), slice(j, j + 1))
            if not pivot:
                if any(column.rows):
                    raise _core.EvaluationError("a root of an operator that is not positive semidefinite")
                columns.append(column)
                continue
            self._forms._field, root = self._forms._field.root(self._forms._field.lift(pivot), sample)
            field = self._forms._field
            column = column.lifted(field)
            columns.append(column.scaled(field.one / root))
            a = a.lifted(field) - (column @ column.T).scaled(field.one / field.lift(pivot))
        field = self._forms._field
        rows = [{j: x for j, c in enumerate(columns) if (x := c.lifted(field).rows[i].get(0))} for i in range(n)]
        return Matrix(field, rows, n)

    def _sample(self) -> dict[Any, float]:
        """A state and parameters at which signs are looked at: the model's numbers, and a random state."""
        state = self._forms.model.random_state(1)
        known = dict(zip([*self._forms.q, *self._forms.v], [*state.q, *state.v], strict=True))
        return {x: float(value) for x, value in (known | self._forms.parameters).items()}
