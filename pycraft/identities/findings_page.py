"""Theorems and findings in HTML: a single one, and all as a table with filters by verdict and by words.

The page is self-contained. Where scripts do not run, as in untrusted notebooks, it shows the whole table,
without buttons.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any

from .. import _core
from ..operators.formula_html import formula_html
from .terminal_report import precision_text
from .verdict_html import verdict_html

_CARD = '<div style="font:13px/1.5 system-ui,sans-serif;color:inherit">{}</div>'
_WORDS = "text-align:left;vertical-align:top;white-space:normal"
"""Style of a cell, set here because a notebook's own style sheet would override it."""
_KEPT = "text-align:left;vertical-align:top;white-space:nowrap;width:1%"
_NUMBER = "text-align:right;vertical-align:top;white-space:nowrap;width:1%"
_SMALL = '<div style="font-size:85%;opacity:.8">{}</div>'


def theorem_html(theorem: _core.Theorem) -> str:
    """Return name, statement, hypotheses with the unmet ones, use and source (`Theorem._repr_html_`)."""
    if theorem.waiting:
        return _CARD.format(f"<b>{escape(theorem.name)}</b><div>waits for {escape(theorem.waiting)}</div>")
    sources = getattr(theorem.lhs, "sources", []) or getattr(theorem.rhs, "sources", [])
    unmet = theorem.unmet(sources[0]) if sources else []
    needs = f"where {', '.join(theorem.hypotheses)}" if theorem.hypotheses else "no hypothesis"
    if theorem.on_one_path:
        needs += "; of blocks on one path to the base"
    if unmet:
        needs += f"; not met by {sources[0].name}: {', '.join(unmet)}"
    use = {"check": "", "rewrite": "; the planner rewrites by it", "inverse": "; the planner inverts by it"}[theorem.use]
    about = f"{needs}; {theorem.group}; {theorem.source}{use}"
    return _CARD.format(f"<b>{escape(theorem.name)}</b><div>{formula_html(theorem.text)}</div>{_SMALL.format(escape(about))}")


def finding_html(found: Any) -> str:
    """Return a single finding: the verdict, the theorem, its hypotheses, and the deciding residual and bound."""
    about = [f"where {', '.join(found.hypotheses)}" if found.hypotheses else "no hypothesis", *_notes(found), *_numbers(found)]
    head = f"{verdict_html(found.verdict)} &ensp; <b>{escape(found.name)}</b>"
    return _CARD.format(f"{head}<div>{formula_html(found.statement)}</div>{_SMALL.format(escape('; '.join(about)))}")


def report_html(report: Any) -> str:
    """Return a report as a table, exceptions before the groups, with buttons for verdicts and a field for words."""
    exceptions: Sequence[Any] = report.exceptions
    counts = report.counts()
    buttons = "".join(
        f'<button type="button" data-verdict="{escape(verdict)}" aria-pressed="true">{verdict_html(verdict)} {count}</button>'
        for verdict, count in counts.items()
    )
    groups: dict[str, list[Any]] = {"What does not simply hold": list(exceptions)}
    for found in report.findings:
        if found not in exceptions:
            groups.setdefault(found.group, []).append(found)
    rows = []
    for group, findings in groups.items():
        rows += [f'<tr class="group"><th colspan="4" style="{_WORDS}">{escape(group)}</th></tr>'] if findings else []
        rows += map(_row, findings)
    titles = (("", _KEPT, "verdict"), ("", _WORDS, "theorem"), ("number", _NUMBER, "residual"), ("number", _NUMBER, "bound"))
    head = f"<tr>{''.join(f'<th class={kind!r} style={style!r}>{title}</th>' for kind, style, title in titles)}</tr>"
    summary = escape(report.summary()).replace("\n", "<br>")
    return (
        f'<div class="pycraft-report"><style>{_text("css")}</style><p><b>{summary}</b></p>'
        f'<div class="controls" hidden style="display:none">{buttons}'
        f'<input type="search" placeholder="words or letters" aria-label="words or letters"><span class="count" role="status"></span></div>'
        f'<div class="rows" style="max-height:460px;overflow:auto">'
        f'<table style="table-layout:auto;width:100%">{head}{"".join(rows)}</table></div>'
        f"<script>{_text('js')}</script></div>"
    )


def statement_html(report: Any) -> str:
    """Return a `CheckReport`: verdict, statement and details; on random trees, "true under hypotheses" has its own sign."""
    from .truth import in_words

    details = "".join(f'<div style="white-space:pre-wrap">{escape(line.strip())}</div>' for line in report.details())
    statement = "<br>".join(map(formula_html, report.statement.split("\n")))
    where = ", or where ".join(map(in_words, report.true_where)) if report.verdict == "fails" and len(report.models) > 1 else ""
    verdict = verdict_html("true where", f"true where {where}") if where else verdict_html(report.verdict)
    return _CARD.format(f"{verdict}<div>{statement}</div>{_SMALL.format(details)}")


def _row(found: Any) -> str:
    words = escape(" ".join([found.name, found.statement, found.group, *found.hypotheses, *found.unmet, found.note]).casefold())
    needs = [f"where {', '.join(found.hypotheses)}"] if found.hypotheses else []
    notes = "; ".join([*needs, *_notes(found)])
    numbers = [f"{found.wide_residual:.1e}", f"{found.wide_bound:.0e}"] if found.states else ["", ""]
    told = f"{found.name}; in {precision_text(found.wide_precision)}" if found.states else found.name
    told += f"; in double {found.in_double}" if found.states and found.in_double else ""
    cells = "".join(f'<td class="number" style="{_NUMBER}">{number}</td>' for number in numbers)
    return (
        f'<tr data-verdict="{escape(found.verdict)}" data-words="{words}" title="{escape(told)}">'
        f'<td style="{_KEPT}">{verdict_html(found.verdict)}</td>'
        f"<td style='{_WORDS}'>{formula_html(found.statement)}{_SMALL.format(escape(notes)) if notes else ''}</td>{cells}</tr>"
    )


def _notes(found: Any) -> list[str]:
    if found.unmet:
        return [f"not met here: {', '.join(found.unmet)}"]
    if found.verdict == "waiting":
        return [f"waits for {found.note}"]
    return [found.note] if found.note else []


def _numbers(found: Any) -> list[str]:
    if not found.states:
        return []
    decided = f"residual {found.wide_residual:.1e} in {precision_text(found.wide_precision)}, bound {found.wide_bound:.0e}"
    return [decided, f"{found.states} state{'s' * (found.states > 1)}"]


@cache
def _text(ending: str) -> str:
    return files(__package__).joinpath(f"findings.{ending}").read_text(encoding="utf-8")
