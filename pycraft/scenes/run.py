"""What a scene did over time."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from .. import _core


def run_times(T: float, t_eval: Any) -> tuple[list[float], bool, slice]:
    """Times for the core, whether every step is given out, and which of what comes back was asked for."""
    if not (0 < T < np.inf):
        raise _core.EvaluationError(f"T={T:g}: a run lasts a positive number of seconds")
    if t_eval is None:
        return [0.0, T], True, slice(None)
    times = np.atleast_1d(_core.real_array(t_eval, "t_eval"))
    if times.ndim != 1 or not times.size or not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        raise _core.EvaluationError("t_eval: a rising list of times in seconds")
    if times[0] < 0 or times[-1] > T:
        raise _core.EvaluationError(f"t_eval goes from {times[0]:g} to {times[-1]:g} s; the run goes from 0 to T = {T:g} s")
    before, after = times[0] > 0, times[-1] < T
    return [*([0.0] if before else []), *times.tolist(), *([T] if after else [])], False, slice(int(before), -1 if after else None)


class Run:
    """States of a scene over time, and what follows from them.

    Attributes
    ----------
    t : (K,) s
    q, v : (K, nq), (K, nv)
    states : (K, n), the effects' own
    statistics : evaluations, steps, rejected steps, seconds, and how often each pass ran
    """

    def __init__(self, model: Any, calls: _core.SceneCalls, names: list[str], found: dict[str, Any], keep: slice, energy: bool):
        self._model, self._calls, self._names, self._counted = model, calls, names, energy
        self.t, self.q, self.v, self.states = (found[name][keep] for name in ("t", "q", "v", "own"))
        self._work = found["work"][keep]
        self.statistics = {name: found[name] for name in ("evaluations", "steps", "rejected", "seconds", "passes")}

    @cached_property
    def _along(self) -> dict[str, np.ndarray]:
        return self._calls.along(self.t, self.q, self.v, self.states)

    @property
    def vdot(self) -> np.ndarray:
        """(K, nv) accelerations."""
        return self._along["vdot"]

    @property
    def forces(self) -> dict[str, np.ndarray]:
        """(K, nv) generalized forces of every effect."""
        return dict(zip(self._names, self._along["forces"], strict=True))

    @cached_property
    def energy(self) -> dict[str, np.ndarray]:
        """Energies in J: "kinetic" (K,), rotors included; "potential" (K,), of all effects that have one; "work" (K, n), of each effect of
        `workers`, what it has done since the start besides. kinetic + potential - Σ work is constant, but for the integrator's error.
        """
        if not self._counted:
            raise _core.EvaluationError("this run kept no account of works; simulate with energy=True")
        return {"kinetic": self._along["kinetic"], "potential": self._along["potential"].sum(axis=1), "work": self._work}

    @property
    def workers(self) -> list[str]:
        """The effects whose works are counted, in the order of the columns of `energy["work"]`."""
        return [self._names[i] for i in self._calls.workers]

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return (
            f"<run of {self._model.name!r}: {len(self.t)} states from {self.t[0]:g} to {self.t[-1]:g} s, {self.statistics['steps']} steps>"
        )
