"""Loops that a scene keeps, and loops that close during motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeGuard

import numpy as np

from .. import _core
from ..arguments import moment
from ..state import State, at_state
from .effects import Effect, Loop


def _keeps(effect: Effect) -> TypeGuard[Loop]:
    """Return True if an effect keeps loops."""
    return isinstance(effect, Loop) and effect.keeps


class OnLoops:
    """Methods of a scene for its loops."""

    _model: Any
    _entries: dict[str, tuple[Effect, bool]]
    _calls: Callable[[], Any]
    _name: Callable[[Any], str]
    enable: Callable[..., Any]
    disable: Callable[..., Any]
    is_on: Callable[[Any], bool]

    def _kept_loops(self) -> list[str]:
        """Return the loops kept by active effects, by name."""
        return [name for effect, on in self._entries.values() if on and _keeps(effect) for name in effect.kept(self._model)]

    def _keeps_loops(self) -> bool:
        """Return True if an active effect keeps loops."""
        return any(on and _keeps(effect) for effect, on in self._entries.values())

    def _loops_now(self) -> tuple[int, bytes]:
        """Return the change counts of its loops, and for loops held by springs the present q, which the model does not count."""
        loops = [effect for effect, _ in self._entries.values() if isinstance(effect, Loop)]
        held = any(not effect.keeps for effect in loops)
        return self._model.loops._core.edits if loops else 0, np.asarray(self._model.q).tobytes() if held else b""

    def close_loops(self, *effects: Any, q: Any = None, v: Any = None, t: float = 0.0) -> State:
        """Turn on effects that keep loops when a motion reaches them, and project its state onto all kept loops: a plastic impact.

        (ℳ + J)(v⁺ - v) = Q*λ,   Q v⁺ = 0: the impulse of the loops, which gives the nearest velocities in kinetic energy, for any
        method of the effects. J includes rotors, and prescribed coordinates continue as prescribed. Newton's steps move q by the error of
        an event's time. The loss of the impact is the difference of kinetic energies. `disable` opens loops without changing states.

        Parameters
        ----------
        effects : names or effects; none: keep the effects that are on
        q, v : (nq,), (nv,) at t, by the rule of direct calls
        t : s

        Returns
        -------
        State : the state from which the motion continues

        Raises
        ------
        ModelError
            Effects that the scene does not have, or that keep no loops; arrays of a wrong shape, or not finite; rows that require different
            velocities, such as rows of prescribed coordinates.
        EvaluationError
            A state farther off the loops than 10⁻⁴, with the rows. The effects are then unchanged.
        SingularHingeError
            As for forward dynamics of the tree.

        Examples
        --------
        >>> import pycraft as pc
        >>> gears = pc.chain(2)
        >>> gear = gears.add_coupling({"hinge0": 1.0, "hinge1": -1.0}, name="gear")
        >>> scene = pc.Scene(gears).add(pc.effects.Loop(method="embed")).disable("loop")
        >>> state = scene.close_loops("loop", q=[0, 0], v=[1.0, 0.0])
        >>> state.v.round(6).tolist(), scene.is_on("loop")
        ([0.75, 0.75], True)
        """
        names = [self._name(effect) for effect in effects]
        for name in names:
            if not _keeps(self._entries[name][0]):
                raise _core.ModelError(f"effect {name!r} keeps no loops to close; turn it on with enable")
        before = [name for name in names if not self.is_on(name)]
        try:
            self.enable(*names)
            if not self._keeps_loops():
                raise _core.ModelError(f"the scene of {self._model.name!r} keeps no loops: add effects.Loop()")
            return State(*self._calls().close(*at_state(self._model, q, v), moment(t)))
        except BaseException:
            self.disable(*before)
            raise
