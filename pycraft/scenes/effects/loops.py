"""Loops of the model, kept closed in a scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from ...arguments import one_number, text
from .effect import Effect, names_of

METHODS = ("augment", "embed", "penalty")


@dataclass(repr=False, eq=False)
class Loop(Effect):
    """Keep loops of the model (`add_loop`, `add_coupling`, `add_rolling`, ...) closed; without it, a scene simulates only the tree.

    Tree augmentation: (ℳ + J) v̇ + 𝒞 = τ + Q*λ with Q v̇ + Q̇v = 0 at every evaluation. Before it, and after each step, the state is projected
    onto the loops, positions by the shortest path in the metric of kinetic energy, velocities by an impulse of the loops: nothing drifts,
    and singular states are passed on the branch of the velocity. The forces Q*λ do no work; for redundant rows λ has the least norm.
    Prescribed coordinates are additional rows.

    Constraint embedding: the bodies of connected loops form one body of a tree without loops, v = X v_r and
    X*(ℳ + J)X v̇_r = X*(τ - 𝒞 - (ℳ + J)Ẋv_r). At every evaluation, and after each step, the dependent coordinates are computed from the
    independent coordinates, which follow their own differential equation, for any integrator. They are chosen again after each step, so
    that X is smallest in units of energy. For redundant rows, λ belongs to a set of independent rows.

    A start off the loops is an error; `model.assemble(q, v)` has states on them.

    Penalty: a spring and a damper along each row hold the loops approximately, in a tree with these forces:

        τ_loop = -Q*(K r + C Qv),   K = ω²/compliance,   C = 2ζω/compliance

    ω the frequency, ζ the damping ratio; rows of velocities have only dampers. Compliance is Q_i(ℳ + J)⁻¹Q_i* at the model's present
    state, the largest over a loop's rows in metres and over its rows in radians. All integrators support it, stiff ones by exact
    derivatives; the loops open by λ/K, and the energy lost in the dampers is the effect's work.

    Parameters
    ----------
    loops : name of a loop, a loop, or a list of them; None: all loops of the model
    method : {"augment", "embed", "penalty"}; all "augment" and "embed" loops of a scene must use the same one; "embed" supports only form
        "fast"
    alpha, beta : 1/s, Baumgarte stabilization r̈ + 2α ṙ + β² r = 0 of these loops by augmentation; if all loops have it, states are not
        projected
    frequency : rad/s, ω of method "penalty"
    damping_ratio : ζ of method "penalty"; default 1, where rows do not oscillate
    """

    loops: Any = None
    method: str = "augment"
    alpha: float = 0.0
    beta: float = 0.0
    frequency: float | None = None
    damping_ratio: float = 1.0

    @property
    def keeps(self) -> bool:
        """True if states lie on its loops, which springs do not ensure."""
        return self.method != "penalty"

    def kept(self, model: Any) -> list[str]:
        """Return the names of its loops."""
        names = names_of(self.loops, "loop", "loops")
        return list(model.loops) if names is None else names

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        if text(self.method, "loop: method") not in METHODS:
            raise _core.EvaluationError(f"loop: method={self.method!r}: there are {', '.join(map(repr, METHODS))}")
        names = names_of(self.loops, "loop", "loops")
        if names is not None and not names:
            raise _core.ModelError("loop: loops=[] keeps none; leave it out to keep all")
        gains = one_number(self.alpha, "loop: alpha"), one_number(self.beta, "loop: beta")
        ratio = one_number(self.damping_ratio, "loop: damping_ratio")
        loops: Any = model.loops._core  # type: ignore[attr-defined]  # the face's
        if self.keeps:
            if self.frequency is not None or ratio != 1:
                raise _core.ModelError(
                    f"loop: frequency and damping_ratio apply only to method 'penalty'; method {self.method!r} has no springs"
                )
            return loops.effect(names or [], *gains, self.method == "embed")
        if gains != (0.0, 0.0):
            raise _core.ModelError(
                "loop: Baumgarte's alpha and beta apply only to method 'augment'; 'penalty' has frequency and damping_ratio"
            )
        if self.frequency is None:
            raise _core.ModelError("loop: method 'penalty' needs frequency=, in rad/s, at which its rows oscillate")
        return loops.penalty(names or [], one_number(self.frequency, "loop: frequency"), ratio)
