"""Loops that scenes keep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from ...arguments import one_number, text
from .effect import Effect, names_of

METHODS = ("augment", "embed")


@dataclass(repr=False, eq=False)
class Loop(Effect):
    """Loops of the model (`add_loop`, `add_coupling`, `add_rolling`, ...) are kept: without it a scene is of the tree alone.

    Tree augmentation: (ℳ + J) v̇ + 𝒞 = τ + Q*λ with Q v̇ + Q̇v = 0 at every evaluation. Before it, and after each step, the state is taken
    back onto the loops, positions by the way that is shortest in kinetic energy, velocities by an impulse of the loops: nothing drifts, and
    singular states are passed on the velocity's branch. The forces Q*λ do no work; of redundant rows λ is the least. Prescribed
    coordinates are rows beside those of the loops.

    Constraint embedding: the bodies around loops that hang together are one body of a tree without loops, v = X v_r and
    X*(ℳ + J)X v̇_r = X*(τ - 𝒞 - (ℳ + J)Ẋv_r). At every evaluation, and after each step, what depends is found from the independent
    coordinates, which so follow a differential equation of their own, whatever the integrator. They are chosen anew after each step, where
    X is smallest in units of energy. Of redundant rows λ is that of as many as are independent.

    A start off the loops is an error; `model.assemble(q, v)` has states on them.

    Parameters
    ----------
    loops : name of a loop, a loop, or a list of them; None: all that the model has
    method : {"augment", "embed"}, one for all loops of a scene; "embed" has form "fast" alone
    alpha, beta : 1/s, Baumgarte's r̈ + 2α ṙ + β² r = 0 of these loops by augmentation; where all have it, no state is taken back
    """

    loops: Any = None
    method: str = "augment"
    alpha: float = 0.0
    beta: float = 0.0

    def kept(self, model: Any) -> list[str]:
        """The names of its loops."""
        names = names_of(self.loops, "loop", "loops")
        return list(model.loops) if names is None else names

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        if text(self.method, "loop: method") not in METHODS:
            raise _core.EvaluationError(f"loop: method={self.method!r}: there are {', '.join(map(repr, METHODS))}")
        names = names_of(self.loops, "loop", "loops")
        if names is not None and not names:
            raise _core.ModelError("loop: loops=[] keeps none; leave loops out for all")
        numbers = one_number(self.alpha, "loop: alpha"), one_number(self.beta, "loop: beta")
        return model.loops._core.effect(names or [], *numbers, self.method == "embed")  # type: ignore[attr-defined]  # the face's
