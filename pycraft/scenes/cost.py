"""Cost of a scene: every pass, every effect that is on, the cost that effects that are off would have, and shares of a step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from .. import _core
from ..accuracy.checked_options import checked_seconds
from ..tidy import TidyTable, refusal_text, seconds_text, share_text
from .measuring import ROUNDS, effects_on, evaluation_of, having_on, in_turn, measured_states, timed_run

_KINDS = {
    "pass": "pass",
    "between": "the rest",
    "integrator": "integrator",
    "step": "all of it",
    "on": "effect",
    "off": "effect, off",
    "works": "off",
}
LONGEST, SHORTEST = 1.0, 1e-6
"""Durations of motion, s, of the runs that measure an integrator's share."""


class CostTable(TidyTable):
    """Rows of `Scene.cost`: measured times of one evaluation of the accelerations, and of the rest of a step.

    Each row is a dictionary: "what" (its name), "kind" ("pass", "between" them, "integrator", "step" for their sum; "on", "off" of effects;
    "works"), "seconds" (for a pass its own time; for an effect that is on, the time saved without it; for an effect that is off, the time
    added with it: below `noise` both are insignificant), "share" (of a step), "because" (the effects that need a pass, and other
    notes), "refused" (why an effect that is off cannot be turned on, else empty).

    `noise` : s, difference of two measurements of the scene itself.
    """

    columns = ("what", "kind", "seconds", "share", "because", "refused")
    shown = {"what": "what", "kind": "is", "seconds": "time", "share": "of a step", "because": "why"}

    short: ClassVar[dict[str, str]] = {"share": "share"}
    measure = "seconds"

    @property
    def noise(self) -> float:
        return self.about["noise"]

    def marks(self, row: dict[str, Any]) -> str:
        return self.cell("because", row)  # this column is shown on any width of terminal

    def of(self, *kinds: str) -> list[dict[str, Any]]:
        """Return the rows of these kinds."""
        return [row for row in self.rows if row["kind"] in kinds]

    def __getitem__(self, index: Any) -> dict[str, Any]:
        """Return a row by its number, or the row of an effect by its name."""
        if isinstance(index, str):
            for row in self.of("on", "off"):
                if row["what"] == index:
                    return row
            raise KeyError(
                f"no effect {index!r} in {self.title!r}; there are {', '.join(r['what'] for r in self.of('on', 'off')) or 'none'}"
            )
        return super().__getitem__(index)

    def cell(self, key: str, row: dict[str, Any]) -> str:
        if key == "kind":
            return _KINDS[row["kind"]]
        if key == "because":
            return refusal_text(row["refused"]) or row["because"]
        if row["seconds"] is not None and key in ("seconds", "share"):
            small = row["kind"] in ("on", "off", "works") and row["seconds"] < self.noise
            if key == "share":
                return "" if small else share_text(row["share"])
            return f"< {seconds_text(self.noise)}" if small else seconds_text(row["seconds"])
        return "" if key in ("seconds", "share") else super().cell(key, row)

    def style(self, row: dict[str, Any]) -> str:
        return "bold" if row["kind"] == "step" else "dim" if row["kind"] in ("off", "works") else ""

    def plot(self, axes: Any = None) -> Any:
        """Plot two panels: the parts of a step, and the actual or potential cost of each effect; return the axes."""
        from .cost_pictures import cost_plot

        return cost_plot(self, axes)


def cost(
    scene: Any, q: Any, v: Any, integrator: str, step: float | None, rtol: float, atol: float, seconds: Any,
    progress: Callable[[str], None] | None,
) -> CostTable:  # fmt: skip
    """`Scene.cost`."""
    q, v = measured_states(scene, q, v)
    seconds = checked_seconds(seconds)
    tell = progress or (lambda _: None)
    tell("passes")
    calls = scene._calls()
    plan = calls.plan("motion")
    rounds = [_core.time_passes(calls, q, v, seconds / ROUNDS) for _ in range(ROUNDS)]
    passes = np.min(rounds, axis=0)
    tell("effects")
    variants, refused = _variants(scene)
    timed = [evaluation_of(scene, q, v), *(evaluation_of(other, q, v) for other in variants.values())]
    # The scene itself once more, for the noise; and with the powers of its effects.
    whole, *others, again, works = in_turn(seconds, [*timed, timed[0], evaluation_of(scene, q, v, works=True)])
    whole, noise = min(whole, again), abs(whole - again)
    tell(integrator)
    a_step, steps = _a_step(scene, q[0], v[0], seconds, integrator=integrator, step=step, rtol=rtol, atol=atol)
    a_step = max(a_step, whole)

    def row(what: str, kind: str, time: float | None, because: str = "", reason: str = "") -> dict[str, Any]:
        share = None if time is None else time / a_step
        return {"what": what, "kind": kind, "seconds": time, "share": share, "because": because, "refused": reason}

    rows = [row(name, "pass", float(t), ", ".join(because)) for (name, _, because), t in zip(plan, passes, strict=True)]
    rows.append(row("calls, forces cleared", "between", max(whole - float(passes.sum()), 0.0)))
    rows.append(row(integrator, "integrator", a_step - whole, steps))
    rows.append(row("a step, for each evaluation", "step", a_step))
    found = dict(zip(variants, others, strict=True))
    for name in scene.effects:
        on = scene.is_on(name)
        time = None if name in refused else whole - found[name] if on else found[name] - whole
        rows.append(row(name, "on" if on else "off", time, "" if on else "if it were on", refused.get(name, "")))
    if calls.workers:
        rows.append(row("account of works", "works", works - whole, "if energy=True"))
    model, precision = scene.model, scene._how[3]
    title = f"Cost of the scene of {model.name}, {model.nv} degrees of freedom, {precision}, over {len(q)} state{'s' * (len(q) > 1)}"
    about = {"model": model.name, "nv": model.nv, "states": len(q), "noise": noise, "evaluation": whole, "integrator": integrator}
    return CostTable(title, rows, about)


def _variants(scene: Any) -> tuple[dict[str, Any], dict[str, str]]:
    """Return for each effect the scene with this effect switched, and the reason if it cannot be."""
    on = effects_on(scene)
    variants, refused = {}, {}
    for name in scene.effects:
        try:
            variants[name] = having_on(scene, set(on) ^ {name})
            variants[name]._calls()
        except _core.Error as reason:
            variants.pop(name, None)
            refused[name] = str(reason)
    return variants, refused


def _a_step(scene: Any, q: np.ndarray, v: np.ndarray, seconds: float, **options: Any) -> tuple[float, str]:
    """Return the seconds of a run per evaluation, and its steps in words."""
    T, spent, best, words = SHORTEST, 0.0, np.inf, ""
    while True:
        run, took = timed_run(scene, [T], q, v, **options)
        about = run.statistics
        best, spent = min(best, took / max(about["evaluations"], 1)), spent + about["seconds"]
        words = f"{about['evaluations'] / max(about['steps'], 1):.3g} evaluations per step"
        if spent >= seconds and (T >= LONGEST or spent >= 2 * seconds) or spent >= 20 * seconds + 0.1:
            return float(best), words
        T = min(4 * T, LONGEST)
