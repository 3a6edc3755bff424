"""The result of a run of the hard cases: tidy rows."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ...tidy import TidyTable, error_text
from ..rungs import Rung
from .case import Case, quantile

COLUMNS = (
    "family", "case", "hard", "parameters", "quantity", "reference", "source", "method", "precision", "peer", "seeds", "refused",
    "median", "p95", "worst", "bound", "ratio", "passed", "failed", "text", "fault",
)  # fmt: skip


def row(
    case: Case, label: str, rung: Rung | None, outcome: Any, bounds: list[str], ratio: float, failed: list[str], text: str, peer: bool
) -> dict[str, Any]:
    """Return the row of one method in one case. `ratio` is the largest ratio to a bound; `failed` names the violated bounds, `fault` the
    hinge that a refusal must name."""
    answered = outcome.answered
    statistics = {"median": 0.5, "p95": 0.95, "worst": 1.0}
    values = {name: quantile(answered, share) if len(answered) else None for name, share in statistics.items()}
    return {
        "family": case.family,
        "case": case.name,
        "hard": case.hard,
        "parameters": dict(case.parameters),
        "quantity": case.quantity,
        "reference": case.reference,
        "source": case.source,
        "method": label,
        "precision": rung.precision if rung else "double",
        "peer": peer,
        "seeds": len(outcome.errors),
        "refused": int(np.count_nonzero(np.isnan(outcome.errors))),
        **values,
        "bound": "; ".join(bounds),
        "ratio": ratio if bounds else None,
        "passed": not failed,
        "failed": "; ".join(failed),
        "text": " ".join(text.split()),
        "fault": getattr(case, "fault", ""),
    }


class Stability(TidyTable):
    """Rows of a run, true if there are bounds and all hold. The committed table: `stability_markdown.py`."""

    columns: ClassVar[tuple[str, ...]] = COLUMNS
    shown: ClassVar[dict[str, str]] = {
        "case": "case", "method": "method", "median": "median", "p95": "95 %", "worst": "worst", "refused": "refused", "ratio": "of bound",
        "failed": "does not hold",
    }  # fmt: skip
    short: ClassVar[dict[str, str]] = {"failed": ""}
    legend: ClassVar[dict[str, str]] = {"!": "a bound does not hold"}
    common: ClassVar[str] = "case"

    def __init__(self, rows: list[dict[str, Any]], about: dict[str, Any] | None = None):
        super().__init__("Hard cases", rows, about)

    def __bool__(self) -> bool:
        return bool(self.rows) and all(row["passed"] for row in self.rows)

    @property
    def failures(self) -> list[dict[str, Any]]:
        """Rows with a violated bound."""
        return [row for row in self.rows if not row["passed"]]

    def of(self, case: str, method: str) -> dict[str, Any]:
        """Return the row of one method in one case."""
        return next(row for row in self.rows if (row["case"], row["method"]) == (case, method))

    def cell(self, key: str, row: dict[str, Any]) -> str:
        value = row[key]
        if key in ("median", "p95", "worst"):
            return number(value)
        if key == "ratio":
            return "" if value is None else f"{value:.2g}"
        if key == "refused":
            return f"{value} of {row['seeds']}" if value else ""
        return super().cell(key, row)

    def marks(self, row: dict[str, Any]) -> str:
        return "" if row["passed"] else "!"

    def style(self, row: dict[str, Any]) -> str:
        return "" if row["passed"] else "bold red"


def number(value: float | None) -> str:
    """Return an error in two digits; a returned NaN counts as an infinite error."""
    return "0" if value == 0 else "NaN" if value is not None and np.isinf(value) else error_text(value)
