"""Closed forms: every operator of a small mechanism as a SymPy matrix of formulas in its coordinates.

Cost: the entries of P, D, K, ψ, ... grow exponentially with the coordinates (docs/symbolic.md has the counts), so `symbolic` refuses
mechanisms beyond four of them unless it is forced to. SymPy is imported on first use.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core

if TYPE_CHECKING:
    import sympy

    from ..models.multibody import Multibody
    from ..proofs.rational import Rationals
    from .sparse import Matrix

LARGEST = 4

_TAKES = {s.name: s.takes for s in _core.symbols}
"""Letters and their arguments."""


def symbolic(
    model: Multibody,
    names: Sequence[Any] | str | None = None,
    parameters: str | Mapping[Any, Any] = "numeric",
    *,
    simplify: bool = True,
    unit_quaternions: bool = False,
    force: bool = False,
) -> ClosedForms:
    """Return closed forms of a mechanism's operators: any expression of its letters as a SymPy matrix.

    Parameters
    ----------
    model : Multibody
        Its structure, parameters and gravity at present; later edits have no effect.
    names : sequence of nq names or SymPy symbols, or one string of names
        For the coordinates q; default: q1, q2, .... Velocities are v1, v2, ... (nv).
    parameters : {"numeric", "symbolic"} or mapping
        "numeric": masses, lengths, ... are exact fractions (or roots) equal to the model's doubles. "symbolic": every nonzero one is a
        symbol: masses m1, m2, ..., uniform rods along x have lengths l1, l2, ..., other bodies centres of mass c1x, ..., inertias I1xx,
        ..., places p1x, ..., rotor inertias J1, ..., pitches h1, points of axes o1x, ..., gravity g; rotations and axes stay numeric. A
        mapping replaces some of them, e.g. ``{("upper", "mass"): "m", ("upper", "com"): [l / 2, 0, 0], "gravity": [0, 0, "-g"]}``: the keys
        are (body, "mass" | "com" | "inertia" | "position" | "rotation" | "rotor_inertia" | "pitch"), (node, "position") and "gravity", the
        values SymPy expressions or names of symbols, "-g" for a negative one.
    simplify : bool
        Return the shortest of several forms (reduced, factored, with sums of angles); otherwise the reduced fraction.
    unit_quaternions : bool
        Assume unit quaternions for ball and free hinges. Otherwise they enter as q/|q|, as everywhere in pycraft.
    force : bool
        Proceed beyond four coordinates.

    Returns
    -------
    ClosedForms : letters by their ASCII names (`.M`, `.D`, `.psi`, ...), `.evaluate(expression)` for everything else

    Raises
    ------
    ModelError
        The mechanism is too large, a name or parameter does not match, or the model is not a Multibody.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.closed_forms.closed_forms import symbolic
    >>> s = symbolic(pc.chain(2), parameters="symbolic")
    >>> s.mass_matrix[0, 0]
    l1**2*m1/3 + l1**2*m2 + l1*l2*m2*cos(q2) + l2**2*m2/3
    >>> s.D[1, 1]
    l2**2*m2/3
    """
    if not isinstance(model, _core.Multibody):
        raise _core.ModelError(f"closed forms need a Multibody, not a {type(model).__name__}: its coordinates are the symbols")
    if not force and model.nv > LARGEST and not _single_step(model):
        raise _core.ModelError(
            f"{model.name!r} has {model.nv} coordinates; closed forms grow exponentially with them, so beyond {LARGEST} they are no longer "
            f"formulas that anyone reads (a bicycle's symbolic mass matrix has over a million operations). Lock hinges until {LARGEST} "
            "coordinates are left, or evaluate the operators at a state (op.at(q).dense(), op.algorithm() for code); "
            "force=True goes ahead all the same"
        )
    return ClosedForms(model, names, parameters, simplify, unit_quaternions)


def _single_step(model: Multibody) -> bool:
    """Return whether the model is one body on one subhinge: a free body's operators are short."""
    bodies = model.description()["bodies"]
    return len(bodies) == 1 and len(bodies[0]["hinge"]["subhinges"]) <= 1


class ClosedForms:
    """The operators of one mechanism as SymPy matrices; see `symbolic`. Letters are attributes; each is computed on first use.

    Attributes
    ----------
    q, v : tuples of symbols, (nq,) and (nv,)
    parameters : dict from the symbols of masses, lengths, ... to the model's values, if known
    MM, mass_matrix, mass_matrix_inverse, innovations, bias_forces : ℳ = HφMφ*H*; ℳ + J; its inverse; I - HψK; 𝒞 with gravity, (nv, 1)
    """

    def __init__(
        self, model: Multibody, names: Sequence[Any] | str | None, parameters: str | Mapping[Any, Any], simplify: bool, unit: bool
    ):
        from .parameters import Parameters
        from .sparse_letters import Letters

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
        from .sparse_letters import LETTERS

        match _TAKES.get(name):
            case "nodes":
                return lambda nodes: self._letter(name, ("nodes", nodes) if isinstance(nodes, str) else ("nodes", *nodes))
            case "coordinate":
                return lambda coordinate: self._letter(name, ("coordinate", self._coordinate(coordinate)))
        if name not in LETTERS:
            raise AttributeError(f"no closed form is called {name!r}; there are {', '.join(LETTERS)}, and evaluate(expression)")
        return self._letter(name)

    def __dir__(self) -> list[str]:
        from .sparse_letters import LETTERS

        return [*super().__dir__(), *LETTERS]

    def __call__(self, names: str) -> Any:
        """Return several letters at once: ``M, D = s("M D")``."""
        made = tuple(getattr(self, name) for name in names.split())
        return made[0] if len(made) == 1 else made

    def _letter(self, name: str, of: tuple[Any, ...] = ()) -> sympy.ImmutableDenseMatrix:
        if (name, of) not in self._shown:
            self._shown[name, of] = self._letters(name, of).sympy(self._simplify)
        return self._shown[name, of]

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
        """Return an operator or scalar expression as a SymPy matrix (codomain, domain), or as a SymPy number.

        Parameters
        ----------
        expression : an expression of this model's letters (not bound to a state), or a letter's name
        given : values of named vectors and constants, as arrays of SymPy expressions; by default a vector "T" has the entries T1, T2, ...,
            and a constant its own values

        Returns
        -------
        sympy.ImmutableDenseMatrix, or a SymPy expression for a scalar

        Raises
        ------
        EvaluationError
            The expression belongs to another model, is bound to a state (`.at(q)`), is an I without a space, or is a Python function.
        SingularHingeError, SingularOperatorError
            D(k), or an operator to invert, is singular at every state.
        """
        return self._value(expression, given or {}, self._simplify)

    def _value(self, expression: Any, given: Mapping[str, Any], simplify: bool) -> Any:
        if isinstance(expression, str):
            return getattr(self, expression) if simplify == self._simplify else self._letters(expression).sympy(simplify)
        if isinstance(expression, _core.Scalar):
            return self._scalar(expression, given, simplify)
        if not isinstance(expression, _core.Operator):
            raise TypeError(f"closed forms need an operator expression, not a {type(expression).__name__}")
        return self._matrix(expression, given).sympy(simplify)

    def _matrix(self, expression: Any, given: Mapping[str, Any]) -> Matrix:
        expression.check_current()
        if any(source is not self.model.soa._source for source in expression.sources):
            raise _core.EvaluationError(f"{expression.text()} is not made of the letters of {self.model.name!r}")
        from .evaluation import Evaluation

        walk = Evaluation(self._letters, self._field, given, self._sample)
        made = walk.of(expression)
        self._field = walk.field
        if expression.domain is None:
            raise _core.EvaluationError(f"{expression.text()} has no space: an I takes its space from an operator beside it")
        return made

    def _sample(self) -> dict[Any, float]:
        """Return a state and parameters for testing signs: the model's values, and a random state."""
        state = self.model.random_state(1)
        known = dict(zip([*self.q, *self.v], [*state.q, *state.v], strict=True))
        return {x: float(value) for x, value in (known | self.parameters).items()}

    def _scalar(self, scalar: Any, given: Mapping[str, Any], simplify: bool) -> Any:
        import sympy

        from ..proofs.rational import exact

        name, value, operand, terms = scalar.kind, scalar.number, scalar.operand, scalar.terms
        if name == "number":
            return exact(value)
        if name == "sum":
            return sympy.Add(*(self._scalar(t, given, simplify) for t in terms))
        if name == "scaled":
            return exact(value) * self._scalar(terms[0], given, simplify)
        if name == "product":
            return sympy.Mul(*(self._scalar(t, given, simplify) for t in terms))
        if name == "reciprocal":
            return 1 / self._scalar(terms[0], given, simplify)
        matrix = self._matrix(operand, given)
        show = lambda x: matrix.field.expression(x, simplify)
        if name == "trace":
            return show(matrix.trace())
        if name == "logdet":
            determinant = matrix.determinant()
            if not determinant:
                raise _core.SingularOperatorError(f"ln det of {operand.text()}, which is singular at every state")
            return sympy.log(sympy.Abs(show(determinant)))
        return sympy.sqrt(show((matrix.T @ matrix).trace()))

    def diff(self, expression: Any, coordinate: int | str, given: Mapping[str, Any] | None = None) -> Any:
        """Return ∂_i of an expression, a letter's name or a SymPy matrix: along the velocity of coordinate i, v held fixed.

        For ball and free hinges that is the directional derivative along the body twist e_i, q̇ = Γ(q)e_i.
        """
        return self._along(expression, [int(k == self._coordinate(coordinate)) for k in range(len(self.v))], given)

    def dot(self, expression: Any, given: Mapping[str, Any] | None = None) -> Any:
        """Return the time derivative along v, with v held fixed."""
        return self._along(expression, self.v, given)

    def _along(self, expression: Any, direction: Sequence[Any], given: Mapping[str, Any] | None) -> Any:
        import sympy

        if isinstance(expression, sympy.MatrixBase | sympy.Expr):
            value = sympy.expand_trig(expression)
        else:
            value = self._value(expression, given or {}, False)
        rates = self._letters.hinges.rates().sympy(False) * sympy.Matrix(direction)
        turned = lambda e: self._again(sum((e.diff(x) * r for x, r in zip(self.q, rates, strict=True)), sympy.S.Zero))
        return value.applyfunc(turned) if isinstance(value, sympy.MatrixBase) else turned(value)

    def _again(self, e: Any) -> Any:
        """Return a derivative in the form of the entries, if it is a rational function again."""
        try:
            return self._field.expression(self._field.element(e), self._simplify)
        except _core.EvaluationError:
            return e

    # ------------------------------------------------------------------ values
    def at(
        self,
        expression: Any,
        q: Any = None,
        v: Any = None,
        values: Mapping[Any, float] | None = None,
        given: Mapping[str, Any] | None = None,
    ) -> np.ndarray:
        """Return the formulas' value at a state: float64 (codomain, domain), computed with 50 digits.

        q, v: default: the model's present state; values: of symbols, default: the model's own values.
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
        """Return the block of an operator expression in the row and column of these labels: body, hinge or node names."""
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
