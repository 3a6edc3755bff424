"""The loops that a scene keeps, and loops that close while it moves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeGuard

import numpy as np

from .. import _core
from ..arguments import moment
from ..state import State, at_state
from .effects import Effect, Loop


def _keeps(effect: Effect) -> TypeGuard[Loop]:
    """Whether it keeps loops."""
    return isinstance(effect, Loop) and effect.keeps


class OnLoops:
    """What a scene knows of its loops."""

    _model: Any
    _entries: dict[str, tuple[Effect, bool]]
    _calls: Callable[[], Any]
    _name: Callable[[Any], str]
    enable: Callable[..., Any]
    disable: Callable[..., Any]
    is_on: Callable[[Any], bool]

    def _kept_loops(self) -> list[str]:
        """The loops that effects which are on keep, by name."""
        return [name for effect, on in self._entries.values() if on and _keeps(effect) for name in effect.kept(self._model)]

    def _keeps_loops(self) -> bool:
        """Whether an effect that is on keeps loops."""
        return any(on and _keeps(effect) for effect, on in self._entries.values())

    def _loops_now(self) -> tuple[int, bytes]:
        """What its loops count of their changes, and where springs hold them the present q: they are no part of the model's numbers."""
        loops = [effect for effect, _ in self._entries.values() if isinstance(effect, Loop)]
        held = any(not effect.keeps for effect in loops)
        return self._model.loops._core.edits if loops else 0, np.asarray(self._model.q).tobytes() if held else b""

    def close_loops(self, *effects: Any, q: Any = None, v: Any = None, t: float = 0.0) -> State:
        """Turn effects that keep loops on where a motion meets them, and take its state onto all loops that are kept: a plastic impact.

        (ℳ + J)(v⁺ - v) = Q*λ,   Q v⁺ = 0: the impulse of the loops, which leaves the velocities nearest in kinetic energy, whatever the
        method of the effects. Rotors are in J, prescribed coordinates go on as they are told. q is moved by Newton's steps as far as an
        event's time is off. What the impact loses is the difference of kinetic energies. `disable` opens loops: states go on as they are.

        Parameters
        ----------
        effects : names, or effects themselves; none: those that are on as they are
        q, v : (nq,), (nv,) at t, by the rule of direct calls
        t : s

        Returns
        -------
        State : where the motion goes on

        Raises
        ------
        ModelError
            Effects that the scene does not have, that keep no loops; arrays of another shape, not finite; rows that ask for different
            velocities, as of what is prescribed.
        EvaluationError
            A state further off the loops than 10⁻⁴, with the rows. The effects are then as they were.
        SingularHingeError
            As forward dynamics of the tree.

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
                raise _core.ModelError(f"effect {name!r} keeps no loops: there is nothing that it closes; enable it")
        before = [name for name in names if not self.is_on(name)]
        try:
            self.enable(*names)
            if not self._keeps_loops():
                raise _core.ModelError(f"the scene of {self._model.name!r} keeps no loops: add effects.Loop()")
            return State(*self._calls().close(*at_state(self._model, q, v), moment(t)))
        except BaseException:
            self.disable(*before)
            raise
