"""Warnings on doubtful runs: steps limited by stability, a lost energy balance, a motion smaller than the tolerances."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import _core
from ..dynamics.integrator_names import takes_one_size
from ..dynamics.stiff_motion import SHORTER, TAKE, TAKE_DOUBLE, stiffness_text
from ..models.warning import warn
from .motion import Motion

ROWS = 64
"""Number of rows at which a run is examined, evenly spaced: cheap compared with any run."""
LOST = 0.5
"""Change of the balance, as a share of the motion's energy, that means too long steps. Order 1 at ten steps per period gives a tenth."""
LEAST = 1e-3
"""Fraction of atol below which a motion is the rounding of a state of rest."""


def warn_of_doubts(scene: Any, run: Any) -> None:
    """Warn once for each scene and cause, based on at most 64 states of the run."""
    said: set[str] = scene._doubts_said
    rows = run._steps or {"t": run.t, "q": run.q, "v": run.v, "states": run.states, "work": run._work}
    if len(rows["t"]) < 2 or not run.model.nv:
        return
    cause, find = ("energy", _energy_lost) if takes_one_size(run._about["integrator"]) else ("atol", _below_atol)
    if cause not in said and (text := find(run, rows)):
        said.add(cause)
        warn(text)


def _looked_at(rows: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.unique(np.linspace(0, len(rows["t"]) - 1, ROWS).astype(int))


def _energy_lost(run: Any, rows: Mapping[str, np.ndarray]) -> str:
    """Return the warning on the energy balance, for fixed steps in runs that record works; steps found unstable have their own warning."""
    if not run._about["energy"] or "stiffness" in run.statistics:
        return ""
    looked = _looked_at(rows)
    some = Motion(run._about, {name: rows[name][looked] for name in ("t", "q", "v", "states", "work")}, run._calls)
    with np.errstate(over="ignore", invalid="ignore"):
        try:
            energy, balance = some.energy, some.balance
        except (ArithmeticError, _core.Error):  # an effect or a factor undefined at a state in between
            return ""
        off = np.abs(balance - balance[0]).max()
        size = energy["kinetic"].max() + np.ptp(energy["potential"]) + np.abs(energy["work"]).sum(axis=-1).max()
    if off <= LOST * size or size == 0:
        return ""
    step, integrator = run._about["options"]["step"], run._about["integrator"]
    return (
        f"the energy balance of this run changes by {off:.2g} J, while the motion has {size:.2g} J: steps of {step:g} s are too "
        f"long for {integrator!r}, which is unstable under explicit forces (Limits, Spring, NodeSpring, Damping) where "
        "h²k/m > 4 or h c/m > 2. Take a shorter step, integrator='rosenbrock4', or ImplicitSpring and ImplicitDamping with "
        "'semi-implicit-euler'"
    )


def _below_atol(run: Any, rows: Mapping[str, np.ndarray]) -> str:
    """Return the warning on a motion smaller than the allowed error of each controlled step."""
    atol = run._about["options"]["atol"]
    step = (rows["t"][-1] - rows["t"][0]) / max(run.statistics["steps"], 1)
    by = float(np.abs(rows["v"]).max()) * step
    if not 0 < by < atol:
        return ""
    zero = run.model.zero_q()
    displaced = max(float(np.abs(run.model.difference(zero, rows["q"][i])).max()) for i in _looked_at(rows))
    moved = max(displaced, by)
    if not LEAST * atol < moved < atol:
        return ""
    return (
        f"this motion is smaller than its tolerance: no coordinate is farther than {displaced:.2g} rad or m from zero, or moves by more "
        f"than {by:.2g} in a step, and atol = {atol:g} allows that as the error of each step. Take atol = {1e-3 * moved:.0e} or less"
    )


def warn_of_stiffness(scene: Any, integrator: str, found: Mapping[str, Any]) -> None:
    """Warn once for each scene of stiff motion or unstable steps, with the cause and a suitable integrator or step."""
    if scene._stiffness_said:
        return
    scene._stiffness_said = True
    remedy = TAKE if scene._how[3] == "double" else TAKE_DOUBLE
    if found["longest"]:
        remedy = SHORTER + (", or ImplicitSpring and ImplicitDamping" if integrator == "semi-implicit-euler" else "")
    elif scene._keeps_loops():
        remedy = "Take integrator='rosenbrock4' with the loops held by springs (Loop(method='penalty')), or a softer law"
    warn(stiffness_text(f"the scene of {scene.model.name!r}", integrator, found, remedy))
