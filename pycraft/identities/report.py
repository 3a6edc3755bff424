"""Reports: the theorem table for people (rich) and for programs (JSON)."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass
class Finding:
    """What was found for one theorem: worst residual in double and in the wider scalar, the bounds they are judged against, the verdict.

    Verdicts: "holds", "fails", "undecided" (the bound is above 1e-6 even in the wider scalar), "expected to fail" (outside its
    hypotheses, and it does, or asks for an inverse that does not exist: then `note` says so and there is no residual), "holds anyway"
    (outside its hypotheses, and it does not fail), "undefined" (an inverse in it does not exist), "waiting" (not evaluated yet).
    """

    name: str
    group: str
    statement: str
    latex: str
    hypotheses: list[str]
    unmet: list[str]
    verdict: str
    residual: float = 0.0
    bound: float = 0.0
    wide_residual: float = 0.0
    wide_bound: float = 0.0
    wide_precision: str | int = "extended"
    states: int = 0
    seconds: float = 0.0
    note: str = ""

    @property
    def passed(self) -> bool:
        return self.verdict in ("holds", "expected to fail", "holds anyway", "waiting", "undecided", "undefined")


@dataclass
class Report:
    """The findings on one model. True if nothing that should hold fails; `.worst` is the largest residual of what holds."""

    model: str
    traits: dict[str, bool]
    findings: list[Finding] = field(default_factory=list)
    seconds: float = 0.0

    def __bool__(self) -> bool:
        return all(f.passed for f in self.findings)

    @property
    def worst(self) -> float:
        """Worst residual of what holds: in double where double decides (a bound below 1e-6), else in the wider scalar."""
        held = (f for f in self.findings if f.verdict == "holds")
        return max((f.residual if f.bound <= 1e-6 else f.wide_residual for f in held), default=0.0)

    @property
    def failed(self) -> list[Finding]:
        return [f for f in self.findings if not f.passed]

    def counts(self) -> dict[str, int]:
        counts: dict[str, int] = {}
        for f in self.findings:
            counts[f.verdict] = counts.get(f.verdict, 0) + 1
        return counts

    def to_json(self) -> str:
        return json.dumps(
            {"model": self.model, "traits": self.traits, "seconds": self.seconds, "findings": [asdict(f) for f in self.findings]},
            indent=1,
        )

    def table(self):
        """The findings as a rich table."""
        from rich.table import Table
        from rich.text import Text

        wide = next((str(f.wide_precision) for f in self.findings if f.states), "extended")
        table = Table(title=Text(f"Theorems on {self.model}"), title_justify="left", box=None, pad_edge=False, header_style="bold")
        for header, justify in (
            ("theorem", "left"),
            ("hypotheses", "left"),
            ("double", "right"),
            (wide, "right"),
            ("bound", "right"),
            ("verdict", "left"),
            ("ms", "right"),
        ):
            table.add_column(header, justify=justify, no_wrap=header in ("double", "bound", wide, "ms"), overflow="fold")
        group = None
        style = {
            "holds": "green",
            "fails": "bold red",
            "undecided": "yellow",
            "expected to fail": "cyan",
            "holds anyway": "green",
            "waiting": "dim",
            "undefined": "yellow",
        }
        for f in self.findings:
            if f.group != group:
                group = f.group
                table.add_row(Text(group, style="bold underline"))
            hypotheses = Text(", ".join(f.hypotheses))
            if not f.states:
                reason = f"{', '.join(f.unmet)} not met, an inverse does not exist" if f.unmet else "an inverse does not exist"
                text = f"waits for {f.note}" if f.verdict == "waiting" else f"{f.verdict}: {reason}"
                table.add_row(Text("  " + f.statement), hypotheses, "", "", "", Text(text, style=style[f.verdict]), "")
                continue
            verdict = f.verdict + (f": {', '.join(f.unmet)} not met" if f.unmet else "")
            table.add_row(
                Text("  " + f.statement),
                hypotheses,
                f"{f.residual:.1e}",
                f"{f.wide_residual:.1e}" + ("q" if f.wide_precision == "quad" and wide != "quad" else ""),
                f"{f.bound:.0e}",
                Text(verdict, style=style[f.verdict]),
                f"{1e3 * f.seconds:.0f}",
            )
        return table

    def summary(self) -> str:
        parts = [f"{n} {verdict}" for verdict, n in self.counts().items()]
        return f"{self.model}: " + ", ".join(parts) + f"; worst residual of what holds {self.worst:.1e}; {self.seconds:.1f} s"

    def __repr__(self) -> str:
        from io import StringIO

        from rich.console import Console

        console = Console(file=StringIO(), width=150, color_system=None)
        console.print(self.table())
        return console.file.getvalue() + "\n" + self.summary()  # type: ignore[attr-defined]

    def _repr_html_(self) -> str:
        from html import escape

        rows, group = [], None
        color = {
            "holds": "#2a7",
            "fails": "#c22",
            "undecided": "#c90",
            "expected to fail": "#28a",
            "holds anyway": "#2a7",
            "waiting": "#999",
            "undefined": "#c90",
        }
        for f in self.findings:
            if f.group != group:
                group = f.group
                rows.append(f"<tr><th colspan=6 style='text-align:left;padding-top:8px'>{escape(group)}</th></tr>")
            numbers = (
                "<td></td><td></td><td></td>"
                if not f.states
                else f"<td>{f.residual:.1e}</td><td>{f.wide_residual:.1e}</td><td>{f.bound:.0e}</td>"
            )
            note = f" ({escape(', '.join(f.unmet))} not met)" if f.unmet else f" ({escape(f.note)})" if f.note else ""
            rows.append(
                f"<tr><td style='text-align:left'>${f.latex}$</td>"
                f"<td style='text-align:left'>{escape(', '.join(f.hypotheses))}</td>{numbers}"
                f"<td style='text-align:left;color:{color[f.verdict]}'>{f.verdict}{note}</td></tr>"
            )
        head = "<tr><th>theorem</th><th>hypotheses</th><th>double</th><th>extended</th><th>bound</th><th>verdict</th></tr>"
        return f"<p><b>{escape(self.summary())}</b></p><table style='font-size:85%'>{head}{''.join(rows)}</table>"


@dataclass
class CheckReport:
    """The outcome of `pycraft.check`: true where the statement held at every state.

    `.counterexample` is the smallest refutation found of a false one.
    """

    statement: str
    held: bool
    worst: float
    bound: float
    states: int
    models: list[str]
    counterexample: Any = None
    undecided: bool = False
    notes: list[str] = field(default_factory=list)

    def __bool__(self) -> bool:
        return self.held

    def __repr__(self) -> str:
        on = self.models[0] if len(self.models) == 1 else f"{len(self.models)} models"
        if self.held:
            word = "undecided" if self.undecided else "holds"
            text = f"{self.statement}\n  {word} on {on}, {self.states} states: "
            text += f"worst relative residual {self.worst:.1e} (bound {self.bound:.0e})"
        else:
            text = f"{self.statement}\n  FALSE: relative residual {self.worst:.1e} (bound {self.bound:.0e})"
            if self.counterexample is not None:
                text += f"\n{self.counterexample}"
        return text + "".join(f"\n  {note}" for note in self.notes)
