r"""The displayed equations of a LaTeX paper, each with its verdict: `pycraft check paper.tex`.

Displays are ``\[ \]``, ``$$ $$`` and the environments of equation, align, gather, multline, eqnarray and their like. Rows are joined where
one begins with a sign and chained where one begins with an equals sign: A = B = C is A = B and B = C. Macros that the paper defines are
expanded, arguments such as ``(\theta, \dot\theta)`` behind an operator are left out. What is true under a standard hypothesis alone
(J = 0, say) is told apart from what is false: papers say their hypotheses in words. An equation that does not read as a statement of
operators is listed with the reason, never left out; one of operators whose spaces do not fit is false.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .. import _core
from .spelling import spelled
from .terminal_report import WIDTH, wrapped
from .vocabulary import ParseError, SpacesError

_ENVIRONMENTS = "equation|align|alignat|flalign|gather|multline|eqnarray|displaymath|math|dmath"
_DISPLAY = re.compile(
    rf"\\begin\{{(?P<env>({_ENVIRONMENTS})\*?)\}}(?P<body>.*?)\\end\{{(?P=env)\}}|\\\[(?P<bracket>.*?)\\\]|(?<!\\)\$\$(?P<dollar>.*?)(?<!\\)\$\$",
    re.S,
)
_EQUALS = re.compile(r"(?<![<>!:=])=(?!=)|(?<=:)=|==|≡|≜")
_DEFINES = re.compile(
    r"\\(?:re)?newcommand\*?\s*\{?\s*\\([A-Za-z]+)\s*\}?(?:\[(\d)\])?\s*\{|\\def\s*\\([A-Za-z]+)\s*\{|\\DeclareMathOperator\*?\s*\{?\\([A-Za-z]+)\}?\s*\{"
)


# What an operator depends on, behind its letter: (\theta), (\theta, \dot{\theta}), (q, \dot q).
_ANGLE = r"(?:\\d?dot\s*(?:\{\s*(?:\\theta|q)\s*\}|\s(?:\\theta|q)|\\theta)|\\theta|q)"
_ARGUMENTS = re.compile(rf"(?<=[A-Za-z}}\])])\s*(?:\\left)?\(\s*{_ANGLE}(?:\s*,\s*{_ANGLE})*\s*(?:\\right)?\)")

HOLDS, TRUE_WHERE, FAILS, UNDECIDED, NOT_READ = "holds", "true where", "fails", "undecided", "not read"


@dataclass
class Equation:
    """One statement of a paper.

    `verdict` is "holds", "fails", "undecided" or "not read", or "true where", with the hypotheses in `where`. `understood` is how it was
    read, `note` what else is to be said: the smallest counterexample, the reason why it was not read.
    """

    line: int
    latex: str
    verdict: str
    understood: str = ""
    note: str = ""
    where: str = ""

    @property
    def headline(self) -> str:
        """The verdict with its hypotheses."""
        return f"{self.verdict} {self.where}" if self.where else self.verdict


@dataclass
class PaperReport:
    """The equations of one file, in order. True if something was read, and all of that holds or is true under hypotheses that are told."""

    path: str
    equations: list[Equation]

    def __bool__(self) -> bool:
        return bool({HOLDS, TRUE_WHERE} & {*self.counts}) and not {FAILS, UNDECIDED} & {*self.counts}

    @property
    def status(self) -> int:
        """Exit status of a command: 0 if true as a condition, 1 if something fails or nothing was read, 3 if something is undecided."""
        return 0 if self else 3 if UNDECIDED in self.counts and FAILS not in self.counts else 1

    @property
    def counts(self) -> dict[str, int]:
        found: dict[str, int] = {}
        for e in self.equations:
            found[e.verdict] = found.get(e.verdict, 0) + 1
        return found

    def summary(self) -> str:
        told: dict[str, int] = {}
        for verdict in (FAILS, UNDECIDED, TRUE_WHERE, HOLDS, NOT_READ):
            for e in self.equations:
                if e.verdict == verdict:
                    told[e.headline] = told.get(e.headline, 0) + 1
        parts = [f"{count} {headline}" for headline, count in told.items()]
        return f"{Path(self.path).name}: {len(self.equations)} equations" + (": " + ", ".join(parts) if parts else "; none is displayed")

    def to_json(self) -> str:
        return json.dumps({"path": self.path, "equations": [asdict(e) for e in self.equations]}, indent=1)

    def __repr__(self) -> str:
        lines = []
        for e in self.equations:
            place, latex = f"{self.path}:{e.line}: {e.headline}:", " ".join(e.latex.split())
            whole = f"{place} {latex}"
            lines += [whole] if len(whole) <= WIDTH else [place, wrapped(f"    {latex}")]
            notes = [f"  {note}" for note in e.note.split("\n") if note.strip()]
            lines += [note if len(note) <= WIDTH else wrapped(note) for note in notes]
        return "\n".join([*lines, wrapped(self.summary())])


def check_paper(
    path: str | Path,
    model: Any = None,
    *,
    states: int = 20,
    seed: int = 0,
    search: bool = True,
    precision: str | int = "extended",
    progress: Callable[[str], None] | None = None,
) -> PaperReport:
    """Check every displayed equation of a LaTeX file numerically.

    Parameters
    ----------
    path : a LaTeX file, UTF-8; files that it includes are not followed
    model : Multibody or OperatorSet; random trees of all hinge kinds where left out
    states, seed, search, precision : as `pycraft.check` has them
    progress : called with the line of each equation, if given

    Raises
    ------
    ModelError
        No file of that name, or it is not text in UTF-8.
    EvaluationError
        No such precision, or none that is wider than double.
    """
    from .checker import check, check_wider

    def checked(text: str) -> Any:
        return check(text, model, states=states, seed=seed, search=search, precision=precision)

    check_wider(precision)
    source = _read(Path(path))
    found: list[Equation] = []
    for line, latex in equations(source):
        if progress is not None:
            progress(f"line {line}")
        found += _judged(line, latex, checked, model is None)
    return PaperReport(str(path), found)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise _core.ModelError(f"{path}: not text in UTF-8 at byte {error.start}") from None
    except OSError as error:
        raise _core.ModelError(f"{path}: {error.strerror or error}") from None


def _judged(line: int, latex: str, check: Callable[[str], Any], on_trees: bool) -> Iterator[Equation]:
    """One equation for each equals sign of a row. A model of one's own meets its hypotheses or does not; random trees do both."""
    from .truth import in_words

    sides = [side.strip() for side in _EQUALS.split(latex)]
    if len(sides) < 2:
        yield Equation(line, latex, NOT_READ, note="  it has no equals sign")
        return
    for lhs, rhs in zip(sides, sides[1:], strict=False):
        text = f"{lhs} = {rhs}"
        try:
            report = check(text)
        except SpacesError as error:
            yield Equation(line, text, FAILS, note="  spaces do not fit\n" + str(error).split("\n", 1)[-1])
        except _core.SpaceError as error:  # of a statement by block
            yield Equation(line, text, FAILS, note=f"  spaces do not fit\n  {error}")
        except ParseError as error:
            yield Equation(line, text, NOT_READ, note=str(error).split("\n", 1)[-1])
        except _core.Error as error:
            yield Equation(line, text, NOT_READ, note=f"  {error}")
        else:
            where = ", or where ".join(map(in_words, report.true_where)) if report.verdict == FAILS and on_trees else ""
            details = report.details()
            if report.verdict == HOLDS or where:
                details = [detail for detail in details if detail.startswith("  read as")]
            yield Equation(line, text, TRUE_WHERE if where else report.verdict, report.understood, "\n".join(details), where)


# ------------------------------------------------------------------ LaTeX


def equations(source: str) -> Iterator[tuple[int, str]]:
    """(line, text) of every row of every display that makes a statement, macros expanded."""
    source = re.sub(r"(?<!\\)%.*", "", source)
    macros = _macros(source)
    for match in _DISPLAY.finditer(source):
        group = next(name for name in ("body", "bracket", "dollar") if match[name] is not None)
        body = match[group]
        if (match["env"] or "").startswith("alignat"):
            body = re.sub(r"^\s*\{\d+\}", "", body)
        yield from _rows(body, source.count("\n", 0, match.start(group)) + 1, macros)


def _rows(body: str, line: int, macros: dict[str, tuple[int, str]]) -> Iterator[tuple[int, str]]:
    rows: list[tuple[int, str]] = []
    at = 0
    for piece in re.split(r"(\\\\(?:\[[^\]]*\])?)", body):
        if not piece.startswith("\\\\"):
            text = _plain(_expanded(piece, macros))
            before = re.match(r"(\s|\\label\{[^{}]*\}|\\begin\{[a-z]+\})*", piece)
            begins = before.end() if before else 0
            start = line + body.count("\n", 0, at + begins)
            for part in _apart(text):
                rows.append((start, part))
        at += len(piece)
    joined: list[tuple[int, str]] = []
    for start, text in rows:
        if joined and re.match(r"[-+=·@]|\\(cdot|times)", text):  # a row that goes on
            joined[-1] = (joined[-1][0], f"{joined[-1][1]} {text}")
        else:
            joined.append((start, text))
    return iter(joined)


def _plain(row: str) -> str:
    """A row without what numbers, labels and sets it, and without the point that ends its sentence."""
    row = re.sub(r"\\(label|tag\*?|notag|nonumber|intertext|shortintertext)\s*(\{[^{}]*\})?", " ", row)
    row = re.sub(r"\\(begin|end)\{(split|aligned|gathered|subequations)\}(\[[^\]]*\])?", " ", row)
    row = _ARGUMENTS.sub("", row)
    return row.replace("&", " ").strip()


def _apart(row: str) -> Iterator[str]:
    r"""Statements that stand in one row, apart by \quad; words beside them are left out."""
    for part in re.split(r"\\q?quad(?![A-Za-z])", row):
        part = re.sub(r"\\(?:text|mbox|textrm|textit)\s*\{(?=[^{}]*\s)[^{}]*\}", " ", part)
        part = re.sub(r"(\\[,;:!>\s]|[.,;:\s])+$", "", part.strip())
        if part and spelled(part).text.strip():
            yield part


def _macros(source: str) -> dict[str, tuple[int, str]]:
    r"""\newcommand, \def and \DeclareMathOperator: name to the number of arguments and the body."""
    found = {}
    for match in _DEFINES.finditer(source):
        body = _braced(source, match.end() - 1)
        name = match[1] or match[3] or match[4]
        found[name] = (int(match[2] or 0), f"\\operatorname{{{body}}}" if match[4] else body)
    return found


def _braced(source: str, at: int) -> str:
    """What stands between the brace at `at` and its partner."""
    depth = 0
    for end in range(at, len(source)):
        depth += {"{": 1, "}": -1}.get(source[end], 0)
        if depth == 0:
            return source[at + 1 : end]
    return source[at + 1 :]


def _expanded(row: str, macros: dict[str, tuple[int, str]]) -> str:
    """A row with the paper's own macros put in, macros of macros too."""
    if not macros:
        return row
    pattern = re.compile(r"\\(" + "|".join(map(re.escape, macros)) + r")(?![A-Za-z])")
    for _ in range(1000):  # a macro of itself has no end
        match = pattern.search(row)
        if match is None:
            break
        count, body = macros[match[1]]
        end = match.end()
        for k in range(count):
            while end < len(row) and row[end].isspace():
                end += 1
            argument = _braced(row, end) if row[end : end + 1] == "{" else row[end : end + 1]
            end += len(argument) + (2 if row[end : end + 1] == "{" else 0)
            body = body.replace(f"#{k + 1}", argument)
        raised = row[: match.start()].rstrip().endswith(("^", "_"))  # what is raised is one group
        row = row[: match.start()] + (f"{{{body}}}" if raised else body) + row[end:]
    return row
