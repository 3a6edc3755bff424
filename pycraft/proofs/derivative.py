"""∂X/∂θ_i as a side of a statement to prove: `derivative(X, i)`, and sums and products of derivatives with operators."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from .. import _core
from ..identities.vocabulary import Written, is_number

TIME = "t"
"""The direction of a derivative along time; coordinates are numbers."""


class Formula(Written):
    """A derivative, or an expression of derivatives and operators, for use wherever `prove` takes an expression.

    It supports sums, differences, products (`@`), multiples by numbers and `.T`, with operators on either side. It has no value: use
    `X.diff(i)` to evaluate a derivative.
    """

    __array_ufunc__ = None

    def __init__(self, kind: str, children: list[Any], coefficient: Any = 1.0, index: int | str = -1):
        self.kind, self.children, self.coefficient, self.index = kind, children, coefficient, index
        self.name = None

    def _key(self) -> tuple:
        return self.kind, tuple(self.children), self.coefficient, self.index

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Formula) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __add__(self, other: Any) -> Formula:
        return Formula("sum", [self, other])

    def __radd__(self, other: Any) -> Formula:
        return Formula("sum", [other, self])

    def __sub__(self, other: Any) -> Formula:
        return Formula("sum", [self, -other])

    def __rsub__(self, other: Any) -> Formula:
        return Formula("sum", [other, -self])

    def __matmul__(self, other: Any) -> Formula:
        return Formula("product", [self, other])

    def __rmatmul__(self, other: Any) -> Formula:
        return Formula("product", [other, self])

    def __mul__(self, other: Any) -> Formula:
        return self._times(other) if is_number(other) else self @ other

    def __rmul__(self, other: Any) -> Formula:
        return self._times(other) if is_number(other) else Formula("product", [other, self])

    def __truediv__(self, number: Any) -> Formula:
        return self._times(Fraction(1) / Fraction(number))

    def __neg__(self) -> Formula:
        return self._times(-1.0)

    def _times(self, number: Any) -> Formula:
        return Formula("scaled", [self], number)

    @property
    def T(self) -> Formula:
        return Formula("transpose", [self])

    def blockdiag(self) -> Formula:
        """Return its diagonal blocks."""
        return Formula("blockdiag", [self])

    @property
    def is_symmetric(self) -> bool:
        """False: symmetry is unknown."""
        return False

    def written_out(self) -> Any:
        """Return the expression, with derivatives computed by `diff`."""
        parts = [c.written_out() if isinstance(c, Formula) else c for c in self.children]
        match self.kind:
            case "derivative":
                if self.index == TIME:
                    source = parts[0].sources[0]
                    return parts[0].dot(vdot=_core.vector("vdot", source.Theta))
                return parts[0].diff(self.index)
            case "sum":
                return parts[0] + parts[1]
            case "product":
                return parts[0] @ parts[1]
            case "transpose":
                return parts[0].T
            case "blockdiag":
                return _core.blockdiag(parts[0])
        return self.coefficient * parts[0]

    @property
    def domain(self) -> Any:
        """The space on which it acts; None for an I without a space."""
        if self.kind == "transpose":
            space = self.children[0].codomain
            return None if space is None else space.dual
        spaces = (c.domain for c in (self.children[-1:] if self.kind == "product" else self.children))
        return next((s for s in spaces if s is not None), None)

    @property
    def codomain(self) -> Any:
        if self.kind == "transpose":
            space = self.children[0].domain
            return None if space is None else space.dual
        spaces = (c.codomain for c in (self.children[:1] if self.kind == "product" else self.children))
        return next((s for s in spaces if s is not None), None)

    @property
    def sources(self) -> list[Any]:
        """Models of the letters."""
        return [s for c in self.children for s in c.sources]

    # ------------------------------------------------------------------ how it is shown
    def text(self) -> str:
        return self._shown("text", "∂", "*")

    def latex(self) -> str:
        return self._shown("latex", "\\partial ", "^*")

    def _shown(self, style: str, partial: str, star: str) -> str:
        parts = [getattr(c, style)() for c in self.children]
        closed = [f"({p})" if c.kind == "sum" or c.kind == "scaled" else p for c, p in zip(self.children, parts, strict=True)]
        match self.kind:
            case "derivative":
                partial += "_t " if self.index == TIME else ""
                return partial + (parts[0] if self.children[0].kind == "symbol" else f"({parts[0]})")
            case "sum":
                return f"{parts[0]} + {parts[1]}".replace("+ −", "− ").replace("+ -", "- ")
            case "product":
                return " ".join(closed)
            case "transpose":
                return f"({parts[0]}){star}"
            case "blockdiag":
                return f"blockdiag({parts[0]})" if style == "text" else f"\\operatorname{{blockdiag}}({parts[0]})"
        sign = "−" if style == "text" else "-"
        return f"{sign}{closed[0]}" if self.coefficient == -1 else f"{_number(self.coefficient)} {closed[0]}"

    def __repr__(self) -> str:
        return f"<{self.text()}>"

    def _repr_latex_(self) -> str:
        return f"${self.latex()}$"


def _number(c: Any) -> str:
    return f"{c:g}" if isinstance(c, float) else str(c)


def derivative(expression: Any, coordinate: int | str) -> Formula:
    """Return ∂(expression)/∂θ_i, or d(expression)/dt, as a side of a statement for `prove`.

    Parameters
    ----------
    expression : an operator expression, or a first derivative, which gives a second one
    coordinate : the coordinate i, by number or by name; "t" for time, with dθ̇/dt the vector `vdot`

    Returns
    -------
    Formula

    Raises
    ------
    ModelError
        The coordinate does not exist.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.proofs import derivative, prove
    >>> soa = pc.chain(3).soa
    >>> bool(prove(derivative(soa.D, 1), soa.H @ derivative(soa.P, 1) @ soa.H.T))
    True
    """
    if coordinate == TIME:
        return Formula("derivative", [expression], index=TIME)
    names = expression.sources[0].coordinate_names if expression.sources else []
    if isinstance(coordinate, str):
        if coordinate not in names:
            raise _core.ModelError(f"no coordinate is called {coordinate!r}; there are {', '.join(names[:12])}")
        coordinate = names.index(coordinate)
    if not 0 <= coordinate < len(names):
        raise _core.ModelError(f"there is no coordinate {coordinate}: the model has {len(names)}, numbered from 0")
    return Formula("derivative", [expression], index=int(coordinate))
