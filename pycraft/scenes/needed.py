"""Effects that matter at a tolerance, at states or along a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from .. import _core
from ..accuracy.checked_options import checked_positive
from ..tidy import TidyTable, error_text, refusal_text
from .comparison import Leaving
from .measuring import effects_on, having_on, measured_states


class NeededTable(TidyTable):
    """Rows of `Scene.needed`, one for each effect that is on, the most important first.

    Each row is a dictionary: "effect", "error" (of leaving only this effect out), "together" (of leaving it out together with all effects
    that are not needed and matter less; None if it is needed by itself), "needed", "refused" (why the scene does not run without it,
    else empty; such an effect is needed).
    """

    columns = ("effect", "error", "together", "needed", "refused")
    shown = {"effect": "effect", "error": "error without it", "together": "and without those below", "needed": ""}
    short: ClassVar[dict[str, str]] = {"together": "with those below"}

    def marks(self, row: dict[str, Any]) -> str:
        return "needed" if row["needed"] else ""

    @property
    def names(self) -> list[str]:
        """The effects that matter."""
        return [row["effect"] for row in self.rows if row["needed"]]

    @property
    def others(self) -> list[str]:
        """The effects that may be left out, all together."""
        return [row["effect"] for row in self.rows if not row["needed"]]

    def cell(self, key: str, row: dict[str, Any]) -> str:
        if key in ("error", "together"):
            return error_text(row[key])
        if key == "needed":
            return refusal_text(row["refused"]) or ("needed" if row["needed"] else "may be left out")
        return super().cell(key, row)

    def style(self, row: dict[str, Any]) -> str:
        return "bold" if row["needed"] else ""


def needed(
    scene: Any, tolerance: Any, q: Any, v: Any, T: Any, options: dict[str, Any], progress: Callable[[str], None] | None
) -> NeededTable:
    """`Scene.needed`."""
    (tolerance,) = checked_positive(tolerance, "tolerance", "a positive, finite tolerance")
    error_of, where = _at_states(scene, q, v) if T is None else _along_a_run(scene, T, q, v, options)
    alone: dict[str, float] = {}
    refused: dict[str, str] = {}
    for name in effects_on(scene):
        if progress is not None:
            progress(f"without {name}")
        try:
            alone[name] = error_of([name])
        except (ArithmeticError, _core.Error) as reason:
            refused[name] = str(reason)
    left: list[str] = []
    together: dict[str, float] = {}
    for name in sorted(alone, key=alone.__getitem__):
        if alone[name] > tolerance:
            continue
        try:
            together[name] = error_of([*left, name])
        except (ArithmeticError, _core.Error):
            together[name] = np.inf
        if together[name] <= tolerance:
            left.append(name)
    empty: dict[str, Any] = {"error": None, "together": None, "needed": True, "refused": ""}
    rows = [empty | {"effect": name, "refused": reason} for name, reason in refused.items()]
    for name in sorted(alone, key=alone.__getitem__, reverse=True):
        rows.append(empty | {"effect": name, "error": alone[name], "together": together.get(name), "needed": name not in left})
    return NeededTable(f"Effects that matter at {tolerance:g} in the scene of {scene.model.name}, {where}", rows, {"tolerance": tolerance})


def _at_states(scene: Any, q: Any, v: Any) -> tuple[Callable[[list[str]], float], str]:
    """Return errors of the accelerations, ‖δv̇‖ / ‖v̇‖, the largest over the states, at t = 0."""
    q, v = measured_states(scene, q, v)
    whole = [scene.evaluate(*state).vdot for state in zip(q, v, strict=True)]

    def error_of(names: list[str]) -> float:
        other = having_on(scene, set(effects_on(scene)) - set(names))
        off = [np.linalg.norm(other.evaluate(*state).vdot - vdot) for *state, vdot in zip(q, v, whole, strict=True)]
        sizes = [float(np.linalg.norm(vdot)) for vdot in whole]
        return max((float(d) / size if size else float(np.inf if d else 0.0) for d, size in zip(off, sizes, strict=True)), default=0.0)

    return error_of, f"accelerations at {len(q)} state{'s' * (len(q) > 1)}, relative"


def _along_a_run(scene: Any, T: Any, q: Any, v: Any, options: dict[str, Any]) -> tuple[Callable[[list[str]], float], str]:
    whole = Leaving(scene, T, q, v, options)
    return lambda names: whole.trajectory_error(whole.run_without(names)), f"a run of {whole.times[-1]:g} s, rad and m"
