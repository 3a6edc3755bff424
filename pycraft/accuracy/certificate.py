"""What a certificate says."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape
from typing import Any

from .rungs import Rung
from .tidy import error_text

LISTED = 5
"""Hinges that the table names, worst first."""


@dataclass(frozen=True)
class HingeLoss:
    """A hinge, the relative error of its D(k), and the decimal digits that are gone there."""

    hinge: str
    error: float
    digits: float


@dataclass(frozen=True)
class NextRung:
    """The next step of the ladder: its measured error, against what, and its measured time over the time of the rung in use.

    `refused` has the steps that were tried before it and refused, with their reason.
    """

    rung: Rung
    error: float
    reference: str
    cost: float
    refused: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Certificate:
    """A value, and what is known of its accuracy.

    Attributes
    ----------
    value : the array or number, as the call returns it
    error : float
        Relative error, measured against `reference`: 2-norm of the difference over that of the reference.
    reference : str
        "quad" for a value in double, single or extended precision; the next wider precision for one in quad or more.
    condition : float or None
        1-norm condition number, estimated, of `condition_of`: ℳ + J for forward dynamics, else the square operator itself.
    input_error : float or None
        Relative change of the value, in the reference's precision, when every coordinate of q moves by half a unit in its last place.
        What rounding of the data alone does: no algorithm on doubles can promise less unless q is exact.
    floor : float or None
        What refinement can reach, see `pycraft.accuracy.floor`.
    locator : list of HingeLoss
        The relative error of D(k) at each hinge, worst first; empty where no D(k) is used. It shows where digits went. It proves
        nothing: a wrong D(k) may matter little to the value, and sweeps lose digits where every D(k) is right.
    next_rung : NextRung or None
    notes : dict
        Why a number is None.
    """

    what: str
    rung: Rung
    value: Any
    error: float
    reference: str
    condition: float | None
    condition_of: str
    input_error: float | None
    floor: float | None
    locator: list[HingeLoss]
    next_rung: NextRung | None
    notes: dict[str, str] = field(default_factory=dict)

    def verdict(self) -> str:
        """One sentence: is a higher rung worth it?"""
        if self.input_error is None:
            return ""
        if self.error <= self.input_error:
            return "the value is as good as its data: a higher rung helps only if q is exact"
        if self.floor is not None and self.error <= self.floor:
            return "the error is below the floor of refinement: only a residual or a precision that is wider can lower it"
        if not self.input_error:
            return "moving q in its last place changes nothing: what is lost, the algorithm loses"
        times = self.error / self.input_error
        if times < 10:
            return "the value is nearly as good as its data"
        return f"the error is {times:{'.0f' if times < 1000 else '.0e'}} times what rounding q does"

    def lines(self) -> list[tuple[str, str, str]]:
        """Name, number and remark of each line of the table."""
        out = [("error", error_text(self.error), f"relative, measured against {self.reference}")]
        moved = "q moved by half a unit in the last place of every coordinate"
        out.append(("data", error_text(self.input_error), moved if self.input_error is not None else self.notes.get("input_error", "")))
        of = f"of {self.condition_of}, 1-norm, estimated"
        out.append(("condition", error_text(self.condition), of if self.condition is not None else self.notes.get("condition", "")))
        reach = "what refinement can reach"
        out.append(("floor", error_text(self.floor), reach if self.floor is not None else self.notes.get("floor", "")))
        if self.next_rung is not None:
            step = self.next_rung
            against = "" if step.reference == self.reference else f", against {step.reference}"
            out.append(("next rung", error_text(step.error), f"{step.rung.label}, at {step.cost:.2g} times the time{against}"))
            out += [("", "refused", f"{label}: {reason}") for label, reason in step.refused.items()]
        for i, loss in enumerate(self.locator[:LISTED]):
            remark = f"D({loss.hinge}): {loss.digits:.1f} digits lost" + (" (shows where, proves nothing)" if i == 0 else "")
            out.append(("locator" if i == 0 else "", error_text(loss.error), remark))
        return out

    def __repr__(self) -> str:
        lines = [f"{self.what}: {self.rung.label}" + ("" if self.rung.precision != "double" else ", double")]
        lines += [f"  {name:<10}{number:>8}   {remark}" for name, number, remark in self.lines()]
        if len(self.locator) > LISTED:
            lines.append(f"  {'':<10}{'':>8}   and {len(self.locator) - LISTED} hinges more")
        verdict = self.verdict()
        return "\n".join(lines + ([f"  {verdict}"] if verdict else []))

    def _repr_html_(self) -> str:
        cell = "<td style='text-align:left;padding:1px 10px 1px 0'>"
        rows = "".join(
            f"<tr>{cell}{escape(name)}</td>{cell}<b>{escape(number)}</b></td>{cell}{escape(remark)}</td></tr>"
            for name, number, remark in self.lines()
        )
        title = f"{self.what}: {self.rung.label}" + ("" if self.rung.precision != "double" else ", double")
        return f"<p><b>{escape(title)}</b></p><table>{rows}</table><p>{escape(self.verdict())}</p>"
