"""Direct calls for nodes: the operational-space inertia Λ and its inverse."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from .. import _core
from ..arguments import chosen, several, text
from ..state import at_state
from .by_realization import output
from .direct_calls import DirectCalls
from .prepared import direct
from .task_space import TWIST, damping_of, told
from .threads import over_threads


class OperationalSpaceCalls(DirectCalls):
    """Inertia and compliance of nodes, through the articulated bodies: no mass matrix is formed or inverted."""

    @direct
    @over_threads
    def operational_space_inertia(
        self, frame: str | Sequence[str], q=None, *, form: str = "fast", precision: str | int = "double", on_singular: str = "raise",
        damping: float = 0.02, threads: int = 1, out=None,
    ) -> np.ndarray:  # fmt: skip
        """Return Λ = (B*ΩB)⁻¹ = (𝒥(ℳ + J)⁻¹𝒥*)⁻¹ of bodies or nodes, by name: the inertia at these frames, (6, 6) or (B, 6, 6).

        In each frame's own axes about its origin, angular first, as in `jacobian`; for m names (6 m, 6 m), in their order. One sweep over
        all bodies and one along the path from each frame to the base: O(N + m² depth). `soa.Lambda(frame)` is the same as an operator, and
        accepts directions=. `form` is the form of the sweep: in other forms and precisions the operators compute it, and also near singular
        poses, where kernels are unreliable.

        on_singular, damping : treatment of states at which the frames cannot move in every direction, as in `task_space`: "raise" refuses
        them by number, "nan" returns NaN there, "damped" the damped inertia of the task space at every state, in "fast" and double.

        SingularOperatorError if the frames cannot move in every direction, as for an arm of fewer than six hinges, with the lost
        directions; SingularHingeError as in forward_dynamics; ModelError for an unknown body or node, or one fixed to the base.

        Examples
        --------
        >>> import pycraft as pc
        >>> body = pc.Multibody("flying")
        >>> _ = body.add_body("body", hinge="free", mass=2.0, inertia=np.diag([1.0, 2.0, 3.0]))
        >>> body.operational_space_inertia("body").diagonal().tolist()  # nothing but its own
        [1.0, 2.0, 3.0, 2.0, 2.0, 2.0]
        """
        q, _ = at_state(self, q)
        if damping_of(on_singular, damping) is not None:
            return _damped(self, frame, q, form, precision, damping, out)
        return _of_frames(self, True, frame, q, form, precision, out, on_singular == "nan")

    @direct
    @over_threads
    def operational_space_compliance(
        self, frame: str | Sequence[str], q=None, *, form: str = "fast", precision: str | int = "double", threads: int = 1, out=None
    ) -> np.ndarray:
        """Return B*ΩB = 𝒥(ℳ + J)⁻¹𝒥* of bodies or nodes, by name: accelerations there by forces there, (6, 6) or (B, 6, 6).

        The inverse of `operational_space_inertia`; it also exists where that does not.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).operational_space_compliance("body1", [0, 0])[[2, 4]][:, [2, 4]].round(3).tolist()  # about z, along y
        [[6.857, -2.571], [-2.571, 1.714]]
        """
        return _of_frames(self, False, frame, at_state(self, q)[0], form, precision, out)


def _of_frames(
    model: Any, inverse: bool, frame: Any, q: Any, form: str, precision: str | int, out: Any, masked: bool = False
) -> np.ndarray:  # fmt: skip
    """Compute by kernels, or by the operators if kernels are unreliable or lack the precision; operators name the singular directions."""
    names = [text(name, "a frame") for name in several(frame)]
    form, plain = chosen(form, "form"), isinstance(precision, str) and precision == "double"
    kernel = model._calls().operational_space if plain and form == "fast" else None
    result = kernel(inverse, names, q) if kernel else None
    if result is None:
        by_operators = _operator(model.soa, inverse, names)
        if not kernel:
            with suppress(_core.SingularOperatorError):  # its state is named below
                return _written(by_operators.at(q, form=form, precision=precision).dense(), out)

        def one(state: np.ndarray, told: str = "") -> np.ndarray:
            found = kernel(inverse, names, state) if kernel else None  # each state as it would be alone
            if found is not None:
                return found
            try:
                return np.asarray(by_operators.at(state, form=form, precision=precision).dense())
            except _core.SingularOperatorError as error:
                if masked:
                    return np.full((6 * len(names), 6 * len(names)), np.nan)
                said = f"{error}{told}{_what_does_not_move(model, names, state)}"
                more = "; on_singular='nan' or 'damped' keeps the other states" if told and inverse else ""
                raise _core.SingularOperatorError(said + more) from None
            except _core.Error as error:
                raise type(error)(f"{error}{told}") from None

        states = np.asarray(q, float)
        if not len(states):
            return _written(by_operators.at(q, form=form, precision=precision).dense(), out)
        several_states = len(states) if states.ndim == 2 else 1
        each = [one(x, f" (state {i} of a batch of {several_states})" * (several_states > 1)) for i, x in enumerate(np.atleast_2d(states))]
        result = np.stack(each) if states.ndim == 2 else each[0]
    return _written(result, out)


def _damped(model: Any, frame: Any, q: Any, form: str, precision: str | int, damping: float, out: Any) -> np.ndarray:
    if chosen(form, "form") != "fast" or not isinstance(precision, str) or precision != "double":
        raise _core.EvaluationError("on_singular='damped' is computed in form 'fast' and double precision; omit form= and precision=")
    names = [text(name, "a frame") for name in several(frame)]
    return _written(model.task_space(names, q, on_singular="damped", damping=damping).inertia, out)


def _written(result: np.ndarray, out: Any) -> np.ndarray:
    if out is None:
        return result
    out = output(out, result.shape)
    out[...] = result
    return out


def _what_does_not_move(model: Any, names: list[str], q: Any) -> str:
    """Return the lost directions of one state in words; empty for a batch, since its error names no direction."""
    if twice := [name for name in dict.fromkeys(names) if names.count(name) > 1]:
        return f". {', '.join(map(repr, twice))} is named twice, whose rows are the same"
    q = np.asarray(getattr(q, "q", q), float)
    if q.ndim != 1 or not (lost := model.task_space(dict.fromkeys(names, TWIST), q).lost):
        return ""
    return f". There is no motion along {told(lost)} (task_space(...).lost)"


def _operator(soa: Any, inverse: bool, names: list[str]) -> Any:
    if inverse:
        return soa.Lambda(names)
    B = soa.B(names)
    return B.T @ soa.Omega @ B
