"""Conversion of docstrings for Sphinx: in plain text stars are adjoints and bars are norms, not markup."""

import re
from typing import Any

# Plain text that reStructuredText would read as markup: emphasis, substitutions, footnotes and references.
MARKUP = re.compile(r"\\|\*|\||(?<=\w)_(?!\w)|\[(?=\d+\]_)")
LISTS = ("Parameters", "Other Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns")
LITERAL = re.compile(r"(``.*?``|`[^`]*`)")


def escaped(line: str) -> str:
    """Escape the stars, bars and final underscores of a line of prose; text in backquotes is code."""
    parts = LITERAL.split(line)
    return "".join(part if number % 2 else MARKUP.sub(r"\\\g<0>", part) for number, part in enumerate(parts))


def with_notes(lines: list[str]) -> list[str]:
    """Move paragraphs after a list of parameters, returns or errors into notes, so that they are not read as further items."""
    made: list[str] = []
    listing = False
    for number, line in enumerate(lines):
        following = lines[number + 1] if number + 1 < len(lines) else ""
        if re.fullmatch(r"-{3,}", following.strip()):
            listing = line.strip() in LISTS
        elif listing and line.strip() and made and not made[-1].strip():
            item = re.match(r"\s*[\w*, ]+ : ", line) or _indent(following) > _indent(line)
            if not item and _indent(line) == _indent(lines[0]):
                made += ["Notes", "-----"]
                listing = False
        made.append(line)
    return made


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def as_markup(lines: list[str]) -> list[str]:
    """Convert a docstring to reStructuredText; examples and indented displays are kept."""
    lines = with_notes(lines)
    made: list[str] = []
    example = False
    display: int | None = None  # the indentation below which a display ends
    for number, line in enumerate(lines):
        indent = _indent(line)
        blank = not line.strip()
        if display is not None and not blank and indent <= display:
            display = None
        if blank:
            example = False
        elif line.lstrip().startswith(">>>") and not example:
            example = True
            if made and made[-1].strip():
                made.append("")
        verbatim = example or display is not None
        heading = re.fullmatch(r"\s*[-=]{3,}\s*", line)
        made.append(line if verbatim or blank or heading else escaped(line))
        if display is None and line.rstrip().endswith("::"):
            display = indent
        elif display is None and not example and _opens_display(lines, number):
            made[-1] += ":" if line.rstrip().endswith(":") else ""
            display = indent
            if not line.rstrip().endswith(":"):
                made += ["", " " * indent + "::"]
    return made


def _opens_display(lines: list[str], number: int) -> bool:
    """Check for a line of prose before a blank line and an indented block: displayed formulas."""
    line, rest = lines[number], lines[number + 1 :]
    if not line.strip() or len(rest) < 2 or rest[0].strip():
        return False
    indent = _indent(line)
    after = next((text for text in rest if text.strip()), "")
    return _indent(after) >= indent + 4 and not after.lstrip().startswith(">>>")


def setup(app: Any) -> None:
    def process(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
        lines[:] = as_markup(lines)

    app.connect("autodoc-process-docstring", process, priority=100)  # before napoleon reads the sections
