"""Equilibria of scenes, and the forces in hinges under their effects."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import moment, of_state
from ..dynamics.equilibrium import TOLERANCE, Balance, Equilibrium, solved
from ..dynamics.equilibrium_on_loops import solved_on_loops
from ..dynamics.interbody import forces_of_scene, refuse_state
from ..dynamics.statics import held_by
from ..state import at_state, moment_of


class Statics:
    """Forces in hinges, and equilibria."""

    model: Any
    _calls: Any
    _keeps_loops: Any
    _kept_loops: Any

    def interbody_forces(
        self, hinges: Any = None, q=None, v=None, t: Any = None, *, states: Any = None, axes: Any = "body", about: Any = None,
        part: str = "whole",
    ) -> np.ndarray:  # fmt: skip
        """Return the spatial forces (moment; force) of parents on their children at a state, under all effects: N m and N.

        Parameters
        ----------
        hinges : a name or `Hinge`, or a list of them; None: all, in the model's order
        q, v : (nq,), (nv,), each with an optional leading batch axis, by the rule of direct calls
        t, states : as in `evaluate`, a single one or one for each state
        axes, about, part : as in `Multibody.interbody_forces`; frames moved by a function are placed at t

        Returns
        -------
        (N, 6) or (B, N, 6); for one hinge (6,) or (B, 6). Along a run: `Run.interbody_forces`.

        Raises the errors of `evaluate` and `Multibody.interbody_forces`.

        Examples
        --------
        >>> import pycraft as pc
        >>> scene = pc.Scene(pc.chain(1)).add(pc.effects.Gravity(g=(0, -10, 0)))
        >>> scene.interbody_forces("hinge0", [0.0]).tolist()  # falling from level, the pin carries a quarter of the weight
        [0.0, 0.0, 0.0, 0.0, 2.5, 0.0]
        """
        refuse_state(hinges)
        t, states = moment_of(q, t, states)
        q, v = (np.asarray(_core.real_array(x, name), float) for x, name in zip(at_state(self.model, q, v), "qv", strict=True))
        for x, name, width in ((q, "q", self.model.nq), (v, "v", self.model.nv)):
            if x.ndim not in (1, 2) or x.shape[-1] != width:
                raise _core.ModelError(
                    f"{name} of {self.model.name!r} takes {width} numbers, or (B, {width}) for a batch, not an array {x.shape}"
                )
        own = np.zeros(0) if states is None else np.atleast_1d(_core.real_array(states, "states"))
        times = np.expand_dims(np.array([moment(one) for one in t] if np.ndim(t) == 1 else moment(t)), -1)
        many = sorted({len(x) for x in (times, q, v, own) if x.ndim == 2})
        if len(many) > 1 or own.ndim > 2:
            times_too = f", t {times.shape[:-1]}" if times.ndim == 2 else ""
            raise _core.ModelError(f"q {q.shape}, v {v.shape} and states {own.shape}{times_too} are batches of different sizes")
        time, q, v, own = (np.broadcast_to(x, (*(many or [1]), x.shape[-1])) for x in (times, q, v, own))
        f = forces_of_scene(self._calls(), self.model, time[:, 0], q, v, own, hinges, axes, about, part)
        return f if many else f[0]

    def equilibrium(
        self, q0: Any = None, t: float = 0.0, *, states: Any = None, hold: Any = (), limits: bool = False, stable: bool = False,
        tolerance: float = TOLERANCE,
    ) -> Any:  # fmt: skip
        """Find a configuration at rest where all effects balance, with the tests and errors of `Multibody.equilibrium`.

        The model's own gravity does not act; effects that act only in motion give no force. Effects' own states are held, and
        prescribed coordinates follow their motion at t. If effects keep loops, the search starts at the state on them near
        q0, and forces of the loops also balance (docs/loops.md).

        Parameters
        ----------
        q0 : (nq,) or a State, or (B, nq); default: the model's present state
        t : s
        states : the effects' own states; default: the initial ones
        hold, limits, stable, tolerance : as in `Multibody.equilibrium`

        Raises
        ------
        EvaluationError
            As for `Multibody.equilibrium`; a scene in another precision than double.

        Examples
        --------
        >>> import pycraft as pc
        >>> scene = pc.Scene(pc.chain(1)).add(pc.effects.Gravity(g=(0, -10, 0)), pc.effects.Spring(100.0))
        >>> found = scene.equilibrium([0.0])
        >>> bool(abs(100 * found.q[0] + 5 * np.cos(found.q[0])) < 1e-12), found.stability
        (True, 'stable')
        """
        calls, time = self._calls(), moment(t)
        own = [] if states is None else np.atleast_1d(_core.real_array(states, "states")).ravel().tolist()
        held = held_by(self.model, hold)
        starts = np.asarray(_core.real_array(at_state(self.model, q0)[0], "q"), float)

        def at(q: np.ndarray) -> Balance:
            found = _core.scene_at_rest(calls, q, time, own)
            return Balance(found["residual"], found["along_q"], found["mass"], found["size"])

        def one(q: np.ndarray) -> Equilibrium:
            placed = _core.scene_at_rest(calls, q, time, own)  # with prescribed coordinates at t
            fixed = {*held, *np.flatnonzero(placed["known"])}
            if self._keeps_loops():
                return solved_on_loops(self.model, at, placed["q"], self._kept_loops(), fixed, bool(limits), bool(stable), tolerance)
            return solved(self.model, at, placed["q"], fixed, bool(limits), bool(stable), tolerance)

        if starts.ndim > 2:
            raise _core.ModelError(
                f"q of {self.model.name!r} takes {self.model.nq} numbers, or (B, {self.model.nq}), not an array {starts.shape}"
            )
        if starts.ndim != 2:
            return one(starts)
        found = []
        for b, q in enumerate(starts):
            with of_state(b, len(starts)):
                found.append(one(q))
        return found
