"""Reports in a terminal: 80 columns, the book's letters, important parts never truncated."""

from __future__ import annotations

import textwrap
import unicodedata
from collections.abc import Sequence
from io import StringIO
from typing import Any

from rich.cells import cell_len

WIDTH = 80
STYLES = {
    "holds": "green",
    "fails": "bold red",
    "undecided": "yellow",
    "expected to fail": "cyan",
    "holds anyway": "green",
    "waiting": "dim",
    "undefined": "yellow",
}


def monospace(text: str) -> str:
    """Return the text for a terminal: letters and their accents composed if Unicode has one character for both.

    Other accents, as in φ̃, are left: a Unicode terminal sets them on their letters, as pages and notebooks do.
    """
    return unicodedata.normalize("NFC", text)


def wrapped(line: str, width: int = WIDTH) -> str:
    """Return a line broken to the width of a terminal, with continuations indented by two."""
    indent = " " * (len(line) - len(line.lstrip()))
    broken = textwrap.wrap(line, width, initial_indent="", subsequent_indent=indent + "  ", break_long_words=False, break_on_hyphens=False)
    return "\n".join(broken) or line


def read_as(text: str, understood: str) -> list[str]:
    """Return a line with the text as read; none if it equals the text."""
    plain = "".join(text.split()).replace("==", "=")
    return [] if not understood or "".join(understood.split()) == plain else [f"  read as {monospace(understood)}"]


def precision_text(precision: str | int) -> str:
    """ "quad", "50 digits"."""
    return f"{precision} digits" if str(precision).isdigit() else str(precision)


def findings_lines(findings: Sequence[Any], width: int = WIDTH) -> Any:
    """Return one line per theorem, the verdict first: its statement, or its name if that is too long, and its unmet hypotheses.

    Nothing is truncated and no line is continued; `findings_table` is the long form.
    """
    from rich.text import Text

    edge = max((len(f.verdict) for f in findings), default=0) + 2
    lines = Text(no_wrap=True, overflow="ignore")
    for i, f in enumerate(findings):
        lines.append("\n" if i else "").append(f"{f.verdict:<{edge}}", style=STYLES[f.verdict])
        statement = monospace(f.statement).replace("\n", " ")
        need = f"  needs {', '.join(f.unmet)}" if f.unmet else f"  waits for {f.note}" if f.verdict == "waiting" else ""
        name = monospace(f.name)
        said = [(statement, need), (name, need), (statement, ""), (name, "")]
        shown, note = next((pair for pair in said if cell_len("".join(pair)) <= width - edge), (name, ""))
        lines.append(shown).append(note, style="dim")
    return lines


def findings_table(findings: Sequence[Any]) -> Any:
    """Return the long form, theorems by group: statement, the deciding residual and bound and their precision, the verdict."""
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 1, 0, 0))
    table.add_column("theorem", overflow="fold", ratio=1)
    for header, justify in (("residual", "right"), ("bound", "right"), ("in", "left"), ("verdict", "left")):
        table.add_column(header, justify=justify, no_wrap=True, overflow="ignore")  # type: ignore[arg-type]  # rich's literal
    group = None
    for f in findings:
        if f.group != group:
            group = f.group
            table.add_row(Text(monospace(group), style="bold underline"))
        statement = Text(monospace(f.statement).replace("\n", " "))
        if f.unmet:
            statement.append(f"\nneeds {', '.join(f.unmet)}", style="dim")
        elif f.verdict == "waiting":
            statement.append(f"\nwaits for {f.note}", style="dim")
        elif f.note and f.verdict != "holds":
            statement.append(f"\n{monospace(f.note)}", style="dim")
        verdict = Text(f.verdict, style=STYLES[f.verdict])
        if f.states:
            numbers = (f"{f.wide_residual:.1e}", f"{f.wide_bound:.0e}", precision_text(f.wide_precision))
        else:
            numbers = ("", "", "no inverse" if f.verdict in ("expected to fail", "undefined") else "")
        table.add_row(Padding(statement, (0, 0, 0, 2)), *numbers, verdict)  # continuations are also indented, unlike a heading
    return table


def text_of(renderable: Any, width: int = WIDTH) -> str:
    """Return the display of a terminal of this width, without colors."""
    from rich.console import Console

    console = Console(file=StringIO(), width=width, color_system=None, force_jupyter=False)
    console.print(renderable)
    return "\n".join(line.rstrip() for line in console.file.getvalue().splitlines()).strip("\n")  # type: ignore[attr-defined]  # a StringIO
