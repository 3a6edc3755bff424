"""Letters with arguments: names of nodes, or a coordinate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..arguments import clipped, several, text

if TYPE_CHECKING:
    from .operator_set import OperatorSet

NAMES = {s.name: s for s in _core.symbols}
"""The records of the letters by name."""


class LetterWithArguments:
    """soa.B, soa.Jacobian, soa.Lambda, soa.Delta: operators that take node names or a coordinate."""

    def __init__(self, operators: OperatorSet, name: str):
        self._operators, self._name = operators, name
        self.__doc__ = NAMES[name].meaning

    def __call__(self, argument: str | int | Sequence[str], directions: Any = None, **of_frames: Any) -> _core.Operator:
        """Return the operator of these nodes (or, for Delta, along this coordinate).

        Only Jacobian takes `relative_to`, `axes`, `coordinates`, for one frame, including loose ones: as `Frame.jacobian_operator`.

        Only Lambda takes `directions`: the rows of C (k, 6 m), on the m nodes' motions stacked, angular first in each node's axes; for
        one node also names among "rx", "ry", "rz", "x", "y", "z". Then it is (C B*ΩB C*)⁻¹: R^k → R^k, the inertia along these
        directions. It exists even if B*ΩB is singular, as for an arm of fewer than six hinges, provided that every motion along the
        directions is possible.
        """
        source = self._operators._source
        if of_frames:
            return _relative_jacobian(self._operators, self._name, listed_names(argument), **of_frames)  # type: ignore[arg-type]  # as below
        if directions is not None:
            if self._name != "Lambda":
                raise _core.EvaluationError(f"{self._name} takes no directions; Lambda does")
            return _directed_inertia(self._operators, listed_names(argument), directions)  # type: ignore[arg-type]  # listed_names checks
        if NAMES[self._name].takes == "nodes":
            return source.symbol(self._name, nodes=listed_names(argument))  # type: ignore[arg-type]  # listed_names checks
        if isinstance(argument, str):
            names = source.coordinate_names
            if argument not in names:
                raise _core.ModelError(f"no coordinate of {source.name!r} is called {argument!r}; there are {', '.join(names[:12])}")
            argument = names.index(argument)
        return source.symbol(self._name, coordinate=clipped(argument, f"a coordinate of {source.name!r}"))

    def __repr__(self) -> str:
        return f"<{self._name}: {NAMES[self._name].meaning}>"


def _relative_jacobian(
    soa: OperatorSet, name: str, frames: list[str], relative_to: Any = None, axes: Any = "body", coordinates: Any = None
) -> _core.Operator:
    """Return the Jacobian of one frame relative to another."""
    if name != "Jacobian":
        raise _core.EvaluationError(f"{name} takes no relative_to, axes or coordinates; Jacobian does")
    if len(frames) != 1:
        raise _core.ModelError(f"a Jacobian relative to a frame takes one frame, not {len(frames)}")
    if not isinstance(soa._source, _core.MultibodyOperators):
        raise _core.ModelError(f"{soa._source.name!r} has no frames: it is not a complete multibody model")
    return soa._model.frame(frames[0]).jacobian_operator(wrt=relative_to, axes=axes, coordinates=coordinates)


_TWIST = ("rx", "ry", "rz", "x", "y", "z")


def _directed_inertia(soa: OperatorSet, nodes: list[str], directions: Any) -> _core.Operator:
    """Return (C B*ΩB C*)⁻¹ for the rows C of directions, or their names."""
    named = [directions] if isinstance(directions, str) else directions
    if all(isinstance(d, str) for d in named):
        if len(nodes) != 1 or not set(named) <= set(_TWIST) or len(set(named)) < len(named):
            text = f"of one node, different ones of {', '.join(_TWIST)}; of several, rows (k, 6 m)"
            raise _core.EvaluationError(f"directions {named!r}: {text}")
        rows = np.eye(6)[[_TWIST.index(d) for d in named]]
    else:
        rows = np.atleast_2d(_core.real_array(directions, "directions"))
    if rows.ndim != 2 or rows.shape[1] != 6 * len(nodes) or not len(rows):
        raise _core.EvaluationError(f"directions of {len(nodes)} nodes: rows (k, {6 * len(nodes)}), not {np.shape(directions)}")
    if np.linalg.matrix_rank(rows) < len(rows):
        raise _core.EvaluationError(f"directions: the {len(rows)} rows are linearly dependent; omit the redundant ones")
    B = soa.B(nodes)
    C = _core.constant(rows, B.domain.dual, len(rows), "C")
    return (C @ B.T @ soa.Omega @ B @ C.T).inv()


def listed_names(names: str | Sequence[str]) -> list[str]:
    """Return one name or several as a list. ModelError for an invalid name."""
    listed = several(names)
    for name in listed:
        if not isinstance(name, str):
            raise _core.ModelError(f"nodes are called by their names, not by {name!r}")
        text(name, "a node")
    return listed
