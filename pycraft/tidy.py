"""Tidy tables: lists of rows with named columns, and their exports."""

from __future__ import annotations

import copy
import csv
import json
import math
from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path
from shutil import get_terminal_size
from typing import Any, ClassVar

from rich.cells import cell_len


class TidyTable:
    """Rows as dictionaries with the same keys, one measurement each. Supports iteration over rows, `len` and indexing.

    Exports: `to_pandas()`, `to_csv(path)`, `to_json(path)`, `table()` for a terminal; a notebook shows a table.
    """

    columns: ClassVar[tuple[str, ...]] = ()
    shown: ClassVar[dict[str, str]] = {}
    """Columns of the displayed table: key and heading."""
    short: ClassVar[dict[str, str]] = {}
    """Headings used in narrow terminals."""
    legend: ClassVar[dict[str, str]] = {}
    """Signs for the last column in narrow terminals; see `marks`."""
    measure: ClassVar[str] = "error"
    """The column that shows "refused" in narrow terminals."""
    common: ClassVar[str] = ""
    """The column shown as a line of its own above the rows with the same value, in narrow terminals."""

    def __init__(self, title: str, rows: list[dict[str, Any]], about: dict[str, Any] | None = None):
        self.title, self.rows, self.about = title, rows, dict(about or {})

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, index: int) -> dict[str, Any]:
        return self.rows[index]

    def part(self, rows: list[dict[str, Any]]) -> Any:
        """Return the same table with some of its rows."""
        other = copy.copy(self)
        other.rows = list(rows)
        return other

    # ------------------------------------------------------------------ export
    def to_pandas(self) -> Any:
        """Return the rows as a pandas data frame. Needs pandas."""
        try:
            import pandas
        except ImportError:
            raise ImportError("to_pandas() needs pandas: pip install pandas; to_csv() and to_json() need nothing") from None
        return pandas.DataFrame(self.rows, columns=list(self.columns))

    def to_csv(self, path: str | Path) -> None:
        """Write the rows as CSV, one column per key; missing measurements stay empty."""
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, self.columns)
            writer.writeheader()
            writer.writerows(self.rows)

    def to_json(self, path: str | Path | None = None) -> str:
        """Return the title, the conditions of the measurement and the rows as JSON text, and write it to `path` if given. Values that are
        not finite are null."""
        rows = [{key: None if isinstance(x, float) and not math.isfinite(x) else x for key, x in row.items()} for row in self.rows]
        text = json.dumps({"title": self.title, **self.about, "rows": rows}, indent=1, ensure_ascii=False)
        if path is not None:
            Path(path).write_text(text + "\n", encoding="utf-8")
        return text

    # ------------------------------------------------------------------ display
    def cell(self, key: str, row: dict[str, Any]) -> str:
        """Return the text of one cell of the displayed table."""
        value = row[key]
        return "" if value is None else str(value)

    def style(self, row: dict[str, Any]) -> str:
        """Return the style of a row in a terminal."""
        return ""

    def label(self, row: dict[str, Any]) -> str:
        """Return the name of a row."""
        return self.cell(next(iter(self.shown)), row)

    @property
    def refusals(self) -> dict[str, list[str]]:
        """Return each reason of a refusal, in full, with the names of the refused rows."""
        found: dict[str, list[str]] = {}
        for row in self.rows:
            if row.get("refused"):
                found.setdefault(row["refused"], []).append(self.label(row))
        return found

    def marks(self, row: dict[str, Any]) -> str:
        """Return signs of `legend` that stand for the words of the last column, for terminals too narrow for the words."""
        return ""

    @property
    def note(self) -> str:
        """Return a sentence shown below the table."""
        return ""

    def table(self, width: int | None = None) -> Any:
        """Return the rows as a rich table for a terminal of this width (default: the present one): numbers and words are never cut.

        If the table does not fit: shorter headings, signs with a legend for the last column, a line for values that rows share, and names
        folded between words.
        """
        from rich.markup import escape as plain
        from rich.table import Table

        width = width or terminal_width()
        titles = dict(self.shown)
        cells = [[self.cell(key, row) for key in titles] for row in self.rows]
        legend, heading_of = [], [""] * len(cells)
        if sum(_widths(titles.values(), cells)) + len(titles) - 1 > width:
            titles |= self.short
            used = "".join(self.marks(row) for row in self.rows)
            legend = [f"{sign} {text}" for sign, text in self.legend.items() if sign in used]
            for row, texts in zip(self.rows, cells, strict=True):
                texts[-1] = self.marks(row)
                if isinstance(row.get("refused"), str) and row["refused"]:
                    texts[list(titles).index(self.measure)] = "refused"
            if self.common:
                at = list(titles).index(self.common)
                heading_of = [texts.pop(at) for texts in cells]
                del titles[self.common]
        own = _widths(titles.values(), cells)
        own[0] = max(12, min(own[0], width - sum(own[1:]) - len(own) + 1))
        table = Table(
            title=plain(self.title),
            caption="\n".join(filter(None, ["; ".join(legend), plain(self.note)])) or None,
            box=None,
            pad_edge=False,
            header_style="bold",
        )
        table.title_justify = table.caption_justify = "left"
        table.padding = (0, 1, 0, 0)
        table.min_width = min(width, cell_len(self.title))
        for i, (heading, size) in enumerate(zip(titles.values(), own, strict=True)):
            number = 0 < i < len(titles) - 1
            table.add_column(heading, justify="right" if number else "left", width=size, no_wrap=number, overflow="fold")
        for row, texts, heading, before in zip(self.rows, cells, heading_of, ["", *heading_of], strict=False):
            if heading != before:
                table.add_section()
                table.add_row(plain(heading))
            table.add_row(*map(plain, texts), style=self.style(row))
        return table

    def __repr__(self) -> str:
        from io import StringIO

        from rich.console import Console

        width = terminal_width()
        console = Console(file=StringIO(), width=width, color_system=None, force_jupyter=False)
        console.print(self.table(width))
        return "\n".join(line.rstrip() for line in console.file.getvalue().rstrip().split("\n"))  # type: ignore[attr-defined]  # a StringIO

    def _repr_html_(self) -> str:
        last = len(self.shown) - 1
        kept = ["text-align:left;white-space:" + ("nowrap" if 0 < i < last else "normal") for i in range(last + 1)]  # numbers in one piece
        head = "".join(f"<th style='text-align:left'>{escape(heading)}</th>" for heading in self.shown.values())
        body = "".join(
            f"<tr style='{'font-weight:bold' if 'bold' in self.style(row) else ''}'>"
            + "".join(f"<td style='{style}'>{escape(self.cell(key, row))}</td>" for key, style in zip(self.shown, kept, strict=True))
            + "</tr>"
            for row in self.rows
        )
        note = f"<p>{escape(self.note)}</p>" if self.note else ""
        table = f"<table style='font-size:85%;table-layout:auto'><tr>{head}</tr>{body}</table>"
        return f"<p><b>{escape(self.title)}</b></p><div style='overflow-x:auto'>{table}</div>{note}"


def terminal_width() -> int:
    """Return the width of the terminal, or COLUMNS, or 140."""
    return get_terminal_size((140, 24)).columns


def _widths(headings: Iterable[str], cells: list[list[str]]) -> list[int]:
    """Return the widths of columns that hold their headings and texts in one line each."""
    return [max(map(cell_len, texts)) for texts in zip(headings, *cells, strict=True)]


def seconds_text(seconds: float | None) -> str:
    """Return a time with its unit: 0.45 µs, 12 ms."""
    if seconds is None:
        return ""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.0f} ns"


def refusal_text(reason: str, width: int = 48) -> str:
    """Return the reason why a row has no values, cut to a width; the row itself has the whole text."""
    text = f"refused: {reason}" if reason else ""
    return text if len(text) <= width else text[: width - 1].rstrip() + "…"


def error_text(error: float | None) -> str:
    """Return an error in two figures."""
    return "" if error is None else f"{error:.1e}"


def share_text(share: float | None) -> str:
    """Return a share in two figures: 0.35 %, 47 %."""
    return "" if share is None else f"{100 * share:.2g} %" if abs(share) < 0.0995 else f"{100 * share:.0f} %"


def bytes_text(count: int | None) -> str:
    """Return a size with its unit: 640 B, 5.3 kB."""
    if count is None:
        return ""
    return f"{count} B" if count < 1000 else f"{count / 1000:.1f} kB"
