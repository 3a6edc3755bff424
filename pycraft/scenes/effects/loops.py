"""Loops that scenes keep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from ...arguments import one_number, text
from .effect import Effect, names_of

METHODS = ("augment", "embed", "penalty")


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

    Penalty: the loops are not kept but held, by a spring and a damper along each row, in a tree with these forces:

        τ_loop = -Q*(K r + C Qv),   K = ω²/compliance,   C = 2ζω/compliance

    ω the frequency, ζ the damping ratio; rows of velocities have dampers alone. Compliance is Q_i(ℳ + J)⁻¹Q_i* at the model's present
    state, the largest of a loop's rows in metres and of those in radians. Any integrator takes it, stiff ones by exact derivatives; the
    loops open by λ/K, and what the dampers take is the effect's work.

    Parameters
    ----------
    loops : name of a loop, a loop, or a list of them; None: all that the model has
    method : {"augment", "embed", "penalty"}; one of the first two for all loops that a scene keeps; "embed" has form "fast" alone
    alpha, beta : 1/s, Baumgarte's r̈ + 2α ṙ + β² r = 0 of these loops by augmentation; where all have it, no state is taken back
    frequency : rad/s, ω of method "penalty"
    damping_ratio : ζ of method "penalty"; 1, where rows do not swing
    """

    loops: Any = None
    method: str = "augment"
    alpha: float = 0.0
    beta: float = 0.0
    frequency: float | None = None
    damping_ratio: float = 1.0

    @property
    def keeps(self) -> bool:
        """Whether states are on its loops: not where springs hold them."""
        return self.method != "penalty"

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
        gains = one_number(self.alpha, "loop: alpha"), one_number(self.beta, "loop: beta")
        ratio = one_number(self.damping_ratio, "loop: damping_ratio")
        loops: Any = model.loops._core  # type: ignore[attr-defined]  # the face's
        if self.keeps:
            if self.frequency is not None or ratio != 1:
                raise _core.ModelError(f"loop: frequency and damping_ratio are of method 'penalty'; method {self.method!r} has no springs")
            return loops.effect(names or [], *gains, self.method == "embed")
        if gains != (0.0, 0.0):
            raise _core.ModelError("loop: Baumgarte's alpha and beta are of method 'augment'; 'penalty' has frequency and damping_ratio")
        if self.frequency is None:
            raise _core.ModelError("loop: method 'penalty' takes frequency=, rad/s, at which its rows swing")
        return loops.penalty(names or [], one_number(self.frequency, "loop: frequency"), ratio)
