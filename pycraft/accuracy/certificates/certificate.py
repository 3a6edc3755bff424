"""The contents of a certificate."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape
from typing import Any

from ...tidy import error_text
from ..rungs import Rung, epsilon

LISTED = 5
"""Largest number of hinges in the table, worst first."""

LOST = 1.0
"""Least number of lost digits that the table reports: a few roundings of D(k) cost a few units of the last place."""


@dataclass(frozen=True)
class HingeLoss:
    """A hinge, the relative error of its D(k), and the decimal digits lost there."""

    hinge: str
    error: float
    digits: float


@dataclass(frozen=True)
class NextRung:
    """The first step above with at most half the error: its measured error, the reference, and its time relative to the rung in use.

    `refused` lists earlier steps that refused, with the reason; `passed` lists earlier steps that were no better, with their error.
    """

    rung: Rung
    error: float
    reference: str
    cost: float
    refused: dict[str, str] = field(default_factory=dict)
    passed: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Certificate:
    """A value, and measurements of its accuracy.

    Attributes
    ----------
    value : the array or number returned by the call
    error : float
        Relative error, measured against `reference`: 2-norm of the difference over the 2-norm of the reference.
    reference : str
        "quad" for a value in double, single or extended precision; the next wider precision for a value in quad or more, and if the next
        wider one shows an error of the reference itself above a tenth of the error.
    condition : float or None
        1-norm condition number, estimated, of `condition_of`: ℳ + J for forward dynamics, else the square operator itself.
    input_errors : dict
        For each input array, q, v, tau or x: the relative change of the value, in the reference's precision, when all its
        numbers move by half a unit in their last place. A coordinate that is 0 moves by half an epsilon of 1 rad or 1 m; a zero of v, tau
        or x is exact. This is the effect of rounding the data alone: no algorithm on doubles can promise less unless the data are exact.
    input_error : float or None
        The largest of `input_errors`.
    floor : float or None
        Limit of refinement in the worst case of signs, see `pycraft.accuracy.certificates.floor`; the error may be below it.
    locator : list of HingeLoss
        The relative error of D(k) at each hinge, worst first; empty if the plan has no articulated sweep. It shows where digits were lost.
        It proves nothing: an inaccurate D(k) may hardly affect the value, and sweeps may lose digits although every D(k) is accurate.
    next_rung : NextRung or None
        The first step above that at least halves the error; None if the error is at rounding level, or if no step does.
    notes : dict
        Reasons why values are None.
    """

    what: str
    rung: Rung
    value: Any
    error: float
    reference: str
    condition: float | None
    condition_of: str
    input_errors: dict[str, float]
    floor: float | None
    locator: list[HingeLoss]
    next_rung: NextRung | None
    notes: dict[str, str] = field(default_factory=dict)

    @property
    def input_error(self) -> float | None:
        """The largest of `input_errors`, None if nothing was moved."""
        return max(self.input_errors.values(), default=None)

    def verdict(self) -> str:
        """Return one sentence: is a higher rung worth it?"""
        if self.error <= rounding_level(self.rung.precision):
            return "the value is right to rounding: no higher rung is needed"
        if self.input_error is None:
            return ""
        if self.error == float("inf"):
            return "the exact value is zero, and the returned value is rounding: no relative error is finite"
        if self.error <= self.input_error:
            names = [name for name, moved in self.input_errors.items() if moved >= self.error]
            exact = f"{_listed(names)} {'is' if len(names) == 1 else 'are'} exact"
            return f"the value is as good as its data: a higher rung helps only if {exact}"
        if self.floor is not None and self.error <= self.floor:
            return "the error is within the floor: refinement with this residual may leave as much"
        if not self.input_error:
            return "moving the data in their last place changes nothing: the algorithm causes the whole error"
        times = self.error / self.input_error
        if times < 10:
            return "the value is nearly as good as its data"
        worst = max(self.input_errors, key=lambda name: self.input_errors[name])
        return f"the error is {times:{'.0f' if times < 1000 else '.0e'}} times the effect of rounding {worst}"

    def lines(self) -> list[tuple[str, str, str]]:
        """Return name, number and remark of each line of the table."""
        against = f"relative, measured against {self.reference}"
        out = [("error", error_text(self.error), f"{self.notes['error']}, by {self.reference}" if "error" in self.notes else against)]
        moved = "moved by half a unit in the last place of every number"
        data = [(error_text(error), self.notes.get(name, f"{name} {moved}")) for name, error in self.input_errors.items()]
        if "input_error" in self.notes:
            data.append(("", self.notes["input_error"]))
        out += [("data" if i == 0 else "", *line) for i, line in enumerate(data)]
        of = f"of {self.condition_of}, 1-norm, estimated"
        out.append(("condition", error_text(self.condition), of if self.condition is not None else self.notes.get("condition", "")))
        reach = "limit of refinement in the worst case of signs"
        out.append(("floor", error_text(self.floor), reach if self.floor is not None else self.notes.get("floor", "")))
        return out + self._climb() + self._located()

    def _climb(self) -> list[tuple[str, str, str]]:
        step = self.next_rung
        if step is None:
            return [("next rung", "", self.notes.get("next_rung", ""))]
        against = "" if step.reference == self.reference else f", against {step.reference}"
        out = [("next rung", error_text(step.error), f"{step.rung.label}, at {step.cost:.2g} times the time{against}")]
        out += [("", error_text(error), f"{label}: no step up") for label, error in step.passed.items()]
        return out + [("", "refused", f"{label}: {reason}") for label, reason in step.refused.items()]

    def _located(self) -> list[tuple[str, str, str]]:
        if not self.locator:
            return [("locator", "", self.notes["locator"])] if "locator" in self.notes else []
        lost = [loss for loss in self.locator if not loss.digits < LOST]
        if not lost:
            return [("locator", error_text(self.locator[0].error), "no hinge lost a digit in its D(k)")]
        out = [("", error_text(loss.error), f"D({loss.hinge}): {loss.digits:.1f} digits lost") for loss in lost[:LISTED]]
        out[0] = ("locator", out[0][1], out[0][2] + " (shows where, proves nothing)")
        more = len(lost) - LISTED
        return out + ([("", "", f"and {counted(more, 'hinge')} more")] if more > 0 else [])

    def __repr__(self) -> str:
        lines = [f"{self.what}: {self.rung.label}" + ("" if self.rung.precision != "double" else ", double")]
        lines += [f"  {name:<10}{number:>8}   {remark}" for name, number, remark in self.lines()]
        verdict = self.verdict()
        return "\n".join(lines + ([f"  {verdict}"] if verdict else []))

    def _repr_html_(self) -> str:
        cell = "<td style='text-align:left;padding:1px 10px 1px 0'>"
        rows = "".join(
            f"<tr>{cell}{escape(name)}</td>{cell}<b>{escape(number)}</b></td>{cell}{escape(remark)}</td></tr>"
            for name, number, remark in self.lines()
        )
        title = f"{self.what}: {self.rung.label}" + ("" if self.rung.precision != "double" else ", double")
        return f"<p><b>{escape(title)}</b></p><table style='table-layout:auto'>{rows}</table><p>{escape(self.verdict())}</p>"


def rounding_level(precision: Any) -> float:
    """Return the error that counts as rounding: a unit in the last place of the precision, but at least of the returned double."""
    return min(epsilon(precision), epsilon("double"))


def counted(count: int, noun: str, nouns: str = "") -> str:
    """ "1 hinge", "2 hinges"."""
    return f"{count} {noun if count == 1 else nouns or noun + 's'}"


def _listed(names: list[str]) -> str:
    """ "q", "q and v", "q, v and tau"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
