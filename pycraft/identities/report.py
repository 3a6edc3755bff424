"""Reports of findings for every theorem (`soa.check`) and for a user's own statement (`pycraft.check`)."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import Any

from rich.text import Text

from .findings_page import finding_html, report_html, statement_html
from .judge import FAILS, HOLDS, UNDECIDED, UndecidedError, Verdict
from .terminal_report import WIDTH, findings_lines, findings_table, monospace, precision_text, read_as, text_of, wrapped

UNDEFINED = "undefined"
OPEN = ("fails", "undecided", "undefined")
"""Verdicts for which something is wrong or unknown."""
SHOWN = 1e-6
"""Residuals of statements that hold are not shown if their bound is larger."""
PASSED = ("holds", "expected to fail", "holds anyway", "waiting")
"""Verdicts for which nothing is wrong; only the first means that the statement was shown."""


@dataclass
class Finding:
    """Finding for one theorem: the verdict, and the deciding residual and bound.

    Verdicts: "holds", "fails", "undecided" (no scalar up to the widest decides), "expected to fail" (outside its hypotheses, and it
    does, or needs an inverse that does not exist: then `note` states it and there is no residual), "holds anyway" (outside its
    hypotheses, and it does not fail), "undefined" (an inverse in it does not exist), "waiting" (not evaluated yet).

    `residual` and `bound` are the largest in double, `wide_residual` and `wide_bound` belong to the deciding state in `wide_precision`,
    the deciding scalar. They are relative to the larger side, or for numbers to their terms.
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

    def judged(self, found: Verdict) -> None:
        """Record the findings at some states."""
        decisive = found.shown.decisive
        self.verdict, self.states = found.verdict, found.states
        self.residual, self.bound = found.residual, found.bound
        self.wide_residual, self.wide_bound, self.wide_precision = decisive.residual, decisive.bound, decisive.precision
        if found.zero:
            self.note = "both sides are zero here"

    @property
    def in_double(self) -> str:
        """The residual in double; empty if double does not decide, because the bound is large or both sides are only rounding."""
        return f"{self.residual:.1e}" if self.verdict == FAILS or self.residual <= self.bound <= SHOWN else ""

    @property
    def passed(self) -> bool:
        return self.verdict in PASSED

    def _repr_html_(self) -> str:
        return finding_html(self)


@dataclass
class Report:
    """The findings on one model.

    As a condition: true if everything holds that should, false if something that should hold fails or is undefined, or if nothing holds
    at all (a statement that was not shown is not true); UndecidedError if nothing fails and something is undecided. `.status` is the same
    as an exit status, 0, 1 (something fails) or 3 (something was not shown). It prints as the summary and a line for each exception;
    `.lines()` has a line for every theorem, `.full()` the long form. `report[name]` is the finding of one theorem.
    """

    model: str
    traits: dict[str, bool]
    findings: list[Finding] = field(default_factory=list)
    seconds: float = 0.0

    def __bool__(self) -> bool:
        if self.undecided and not self.failed:
            raise UndecidedError(f"{self.model}: undecided in every precision tried: {', '.join(f.name for f in self.undecided)}")
        return self.status == 0

    @property
    def status(self) -> int:
        """0 if everything holds that should, 1 if something fails, 3 if nothing fails but something, or everything, was not shown."""
        return 1 if self.failed else 3 if self.undecided or self.undefined or not self._held else 0

    @property
    def worst(self) -> float:
        """The largest residual of findings that hold, in the deciding scalar."""
        return max((f.wide_residual for f in self._held), default=0.0)

    @property
    def _held(self) -> list[Finding]:
        return [f for f in self.findings if f.verdict == HOLDS]

    @property
    def failed(self) -> list[Finding]:
        return [f for f in self.findings if f.verdict == FAILS]

    @property
    def undecided(self) -> list[Finding]:
        return [f for f in self.findings if f.verdict == UNDECIDED]

    @property
    def undefined(self) -> list[Finding]:
        """Findings that should hold but need an inverse that does not exist on the model."""
        return [f for f in self.findings if f.verdict == UNDEFINED]

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

    def __getitem__(self, name: str) -> Finding:
        for found in self.findings:
            if found.name == name:
                return found
        raise KeyError(f"no theorem is called {name!r}; .findings lists all by name")

    @property
    def exceptions(self) -> list[Finding]:
        """Findings other than "holds"."""
        return [f for f in self.findings if f.verdict not in (HOLDS, "holds anyway")]

    def table(self) -> Any:
        """Return the findings as a rich table, the long form."""
        return findings_table(self.findings)

    def lines(self, width: int = WIDTH) -> Any:
        """Return the findings as a rich text, one line per theorem with the verdict first; exceptions come before the others."""
        exceptions = self.exceptions
        parts = [exceptions, [f for f in self.findings if f not in exceptions]]
        return Text("\n").join(findings_lines(part, width) for part in parts if part)

    def summary(self) -> str:
        """Return the count of each verdict, in one or two lines; failures come first."""
        counts = self.counts()
        order = sorted(counts, key=lambda verdict: (verdict not in OPEN, verdict == "waiting", -counts[verdict]))
        known = f"{self.seconds:.1f} s"
        if self._held:
            worst = max(self._held, key=lambda f: f.wide_residual)
            decided = f"{worst.wide_residual:.1e} in {precision_text(worst.wide_precision)}, bound {worst.wide_bound:.0e}"
            known = f"largest residual of what holds: {decided}; {known}"
        if "undefined" in counts:
            known = f"undefined: an inverse in them does not exist here, so that nothing was checked\n{known}"
        found = f"{self.model}: " + ", ".join(f"{counts[verdict]} {verdict}" for verdict in order)
        return "\n".join(map(wrapped, (found, *known.split("\n"))))

    def full(self) -> str:
        """Return every theorem in the long form as text, in 80 columns."""
        return f"{self.summary()}\n\n{text_of(self.table())}"

    def __repr__(self) -> str:
        if not self.exceptions:
            return self.summary()
        return f"{self.summary()}\n\n{text_of(findings_lines(self.exceptions))}"

    def _repr_html_(self) -> str:
        return report_html(self)


@dataclass
class CheckReport:
    """The outcome of `pycraft.check`: true as a condition if the statement holds at every state, false if it fails at one.

    If the widest scalar decides neither, its `verdict` is "undecided", and as a condition it raises UndecidedError: an undecided statement
    is not true. If an inverse in it does not exist on the model but would with J > 0, it is "undefined", and false as a
    condition. `.counterexample` is the smallest refutation found of a false statement.
    """

    statement: str
    verdict: str
    worst: float
    """The largest residual in double, relative."""
    bound: float
    """The bound on it."""
    states: int
    models: list[str]
    precision: str | int = "extended"
    """The deciding scalar, the widest that was needed."""
    residual: float = 0.0
    residual_bound: float = 0.0
    """The residual and the bound in that scalar, at the deciding state."""
    counterexample: Any = None
    true_where: list[frozenset[str]] = field(default_factory=list)
    """Standard hypotheses under which a false statement is true, weakest first; each set suffices."""
    untried: bool = False
    """True if the search for these hypotheses ended before all were tried."""
    notes: list[str] = field(default_factory=list)
    understood: str = ""
    """The text as read, in the package's own letters; empty if expressions were given."""

    @classmethod
    def of(cls, statement: str, found: Verdict, models: list[str], understood: str = "") -> CheckReport:
        """Return the report of a verdict."""
        decisive = found.shown.decisive
        report = cls(statement, found.verdict, found.residual, found.bound, found.states, models, understood=understood)
        report.precision, report.residual, report.residual_bound = decisive.precision, decisive.residual, decisive.bound
        if found.zero:
            report.notes.append("both sides are zero at every state: nothing was compared")
        return report

    @property
    def held(self) -> bool:
        return self.verdict == HOLDS

    @property
    def undecided(self) -> bool:
        return self.verdict == UNDECIDED

    def __bool__(self) -> bool:
        if self.undecided:
            raise UndecidedError(f"{self.statement} is undecided: in {self._decisive()}")
        return self.held

    def _decisive(self) -> str:
        return f"{precision_text(self.precision)} the residual is {self.residual:.1e} (bound {self.residual_bound:.0e})"

    def _headline(self) -> str:
        from .truth import in_words

        if self.verdict == UNDEFINED:
            return f"{'TRUE' if self.true_where else 'FALSE'} where J > 0; UNDEFINED here"
        if self.true_where:
            said = ", or where ".join(in_words(chosen) for chosen in self.true_where)
            return f"TRUE where {said}; FALSE elsewhere"
        met = self.counterexample.meets if self.counterexample is not None else ()
        if self.untried:
            return "FALSE in general; hypotheses under which it may be true were not all tried"
        return f"FALSE, also where {in_words(met)}" if met else "FALSE"

    def __repr__(self) -> str:
        return "\n".join([*map(wrapped, monospace(self.statement).split("\n")), *self.details()])

    def _repr_html_(self) -> str:
        return statement_html(self)

    def details(self) -> list[str]:
        """Return the lines of the report below the statement."""
        on = self.models[0] if len(self.models) == 1 else f"{len(self.models)} models"
        lines = read_as(self.statement, self.understood)
        if self.verdict == FAILS:
            lines.append(f"  {self._headline()}")
            lines.append(f"  relative residual {self.worst:.1e} in double; in {self._decisive()}")
            lines += [repr(self.counterexample)] if self.counterexample is not None else []
        elif self.verdict == UNDEFINED:
            lines.append(f"  {self._headline()}")
        else:
            lines.append(f"  {self.verdict.upper() if self.undecided else self.verdict} on {on}, {self.states} states")
            narrow = f"; in double {self.worst:.1e}" if self.worst <= self.bound <= SHOWN else ""
            lines.append(f"  in {self._decisive()}{narrow}")
        lines += [f"  {note}" for note in self.notes]
        return [wrapped(line) if len(line) > WIDTH else line for part in lines for line in part.split("\n")]
