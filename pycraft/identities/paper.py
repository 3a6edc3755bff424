r"""The displayed equations of a LaTeX paper, each with its verdict: `pycraft check paper.tex`.

Displays are ``\[ \]``, ``$$ $$`` and the environments of equation, align, gather, multline, eqnarray and their like. Rows are joined where
a row begins with a sign, and chained where a row begins with an equals sign: A = B = C is A = B and B = C. Macros defined in the paper are
expanded; arguments such as ``(\theta, \dot\theta)`` after an operator are ignored. Equations true only under a standard hypothesis
(such as J = 0) are distinguished from false ones, because papers state hypotheses in words. An equation with a single unknown letter on
its left, or with :=, defines it for all equations of the paper. An equation that is not a statement of operators is listed with the
reason, never omitted; an equation of operators with spaces that do not match is false.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .. import _core
from .block_reading import says_by_block
from .definitions import Definition, is_letter, letter_name, pieces
from .dialects import dialects
from .family import Spec
from .parse import Statements
from .spelling import spelled
from .terminal_report import WIDTH, wrapped
from .vocabulary import ParseError, SpacesError, is_known

_ENVIRONMENTS = "equation|align|alignat|flalign|gather|multline|eqnarray|displaymath|math|dmath"
_DISPLAY = re.compile(
    rf"\\begin\{{(?P<env>({_ENVIRONMENTS})\*?)\}}(?P<body>.*?)\\end\{{(?P=env)\}}|\\\[(?P<bracket>.*?)\\\]|(?<!\\)\$\$(?P<dollar>.*?)(?<!\\)\$\$",
    re.S,
)
_EQUALS = re.compile(r":=|(?<![<>!=])=(?!=)|==|≡|≜|≝|\\(?:triangleq|coloneqq|equiv)(?![A-Za-z])")
_DEFINITIONS = (":=", "≜", "≝", "\\triangleq", "\\coloneqq")
_DEFINES = re.compile(
    r"\\(?:re)?newcommand\*?\s*\{?\s*\\([A-Za-z]+)\s*\}?(?:\[(\d)\])?\s*\{|\\def\s*\\([A-Za-z]+)\s*\{|\\DeclareMathOperator\*?\s*\{?\\([A-Za-z]+)\}?\s*\{"
)


# Arguments after an operator's letter: (\theta), (\theta, \dot{\theta}), (q, \dot q).
_ANGLE = r"(?:\\d?dot\s*(?:\{\s*(?:\\theta|q)\s*\}|\s(?:\\theta|q)|\\theta)|\\theta|q)"
_ARGUMENTS = re.compile(rf"(?<=[A-Za-z}}\])])\s*(?:\\left)?\(\s*{_ANGLE}(?:\s*,\s*{_ANGLE})*\s*(?:\\right)?\)")

HOLDS, TRUE_WHERE, FAILS, UNDECIDED, NOT_READ, DEFINES = "holds", "true where", "fails", "undecided", "not read", "defines"


@dataclass
class Equation:
    """One statement of a paper.

    `verdict` is "holds", "fails", "undecided" or "not read", "defines" for the definition of a letter, or "true where", with the hypotheses
    in `where`. `understood` is the equation as read, `note` further text: the smallest counterexample, or why it was not read.
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
    """The equations of one file, in order. True if something was read, and all of it holds or is true under the given hypotheses."""

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
        for verdict in (FAILS, UNDECIDED, TRUE_WHERE, HOLDS, DEFINES, NOT_READ):
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
    dialect: str | None = None,
) -> PaperReport:
    """Check every displayed equation of a LaTeX file numerically.

    Parameters
    ----------
    path : a LaTeX file, UTF-8; files that it includes are not followed
    model : Multibody or OperatorSet; default: random trees of all hinge kinds
    states, seed, search, precision : as for `pycraft.check`
    progress : called with the line of each equation, if given
    dialect : notation of the paper, see `pycraft.check`

    Raises
    ------
    ModelError
        The file does not exist, or is not text in UTF-8.
    EvaluationError
        An unknown precision, or one that is not wider than double.
    """
    from .checker import check, check_wider

    def checked(text: str) -> Any:
        return check(text, model, states=states, seed=seed, search=search, precision=precision, dialect=dialect)

    check_wider(precision)
    statements = [Said(line, *pair) for line, latex in equations(_read(Path(path))) for pair in _sides(latex)]
    letters = _Letters(statements, model, checked, dialect)
    found: list[Equation] = []
    for said in statements:
        if progress is not None:
            progress(f"line {said.line}")
        found.append(letters.definitions.get(said) or _judged(said, letters.before(said), checked, model is None))
    return PaperReport(str(path), found)


@dataclass(frozen=True)
class Said:
    """A statement of a paper: its line, its sides ("" where there is no equals sign), and the sign between them."""

    line: int
    lhs: str
    rhs: str
    sign: str

    @property
    def text(self) -> str:
        return f"{self.lhs} = {self.rhs}" if self.rhs else self.lhs


def _sides(latex: str) -> Iterator[tuple[str, str, str]]:
    """Yield (lhs, rhs, sign) for each equals sign of a row outside brackets; commas separate statements."""
    rows = pieces(latex, ",")
    if len(rows) > 1 and (says_by_block(latex) or not all(len(_chain(row)) > 1 for row in rows)):
        rows = [latex]
    for row in rows:
        sides = _chain(row)
        if len(sides) < 2:
            yield row.strip(), "", ""
        for (lhs, _), (rhs, sign) in zip(sides, sides[1:], strict=False):
            yield lhs, rhs, sign


def _chain(row: str) -> list[tuple[str, str]]:
    """Return (side, the sign before it)."""
    found: list[tuple[str, str]] = []
    begin, sign = 0, ""
    for match in _EQUALS.finditer(row):
        before = re.sub(r"\\[{}]", "", row[: match.start()])
        if sum(before.count(c) for c in "([{") <= sum(before.count(c) for c in ")]}"):
            found.append((row[begin : match.start()].strip(), sign))
            begin, sign = match.end(), match[0]
    return [*found, (row[begin:].strip(), sign)]


class _Letters:
    """The letters that a paper defines, and the defining statements."""

    def __init__(self, statements: Sequence[Said], model: Any, check: Callable[[str], Any], dialect: str | None = None):
        self.definitions: dict[Said, Equation] = {}
        self._made: list[tuple[Said, Definition]] = []
        school = [] if dialect is None else [*dialects()[dialect].definitions]
        known = {d.name for d in school}
        for said in statements:
            if not said.rhs or not is_letter(said.lhs):
                continue
            name = letter_name(said.lhs)
            told = said.sign in _DEFINITIONS
            if (
                (is_known(name) or name in known)
                and not (told and not self._holds(said.text, check))
                or not told
                and any(d.name == name for _, d in self._made)
            ):
                continue
            self._made.append((said, Definition(name, said.rhs, f"{said.lhs} := {said.rhs}")))
        operators = getattr(model if model is not None else Spec((-1, 0), ("pin", "pin"), True, 1).model(), "soa", model)
        for said, made in self._made:
            try:
                Statements(operators).letter(made.name, [*school, *(d for s, d in self._made if s == said or d.name != made.name)])
            except (_core.Error, ArithmeticError, TypeError, ValueError) as error:
                self.definitions[said] = Equation(said.line, said.text, NOT_READ, note=str(error).split("\n", 1)[-1])
            else:
                self.definitions[said] = Equation(said.line, said.text, DEFINES)
        self._made = [(said, made) for said, made in self._made if self.definitions[said].verdict == DEFINES]

    @staticmethod
    def _holds(text: str, check: Callable[[str], Any]) -> bool:
        """Return True if a definition of a letter of the book is correct."""
        try:
            report = check(text)
        except (_core.Error, ArithmeticError):
            return False
        return report.verdict == HOLDS or bool(report.true_where)

    def before(self, said: Said) -> str:
        """Return the definitions that a statement needs: for each letter the last one before it, else the first after it."""
        chosen: dict[str, tuple[Said, Definition]] = {}
        for at, made in self._made:
            if made.name not in chosen or at.line <= said.line:
                chosen[made.name] = at, made
        needed: list[str] = []
        todo = [said.text]
        while todo:
            text = spelled(todo.pop()).text
            for name, (_, made) in chosen.items():
                if name not in needed and name in text:
                    needed.append(name)
                    todo.append(made.what)
        return "".join(f"{made.typed}; " for name, (_, made) in chosen.items() if name in needed)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise _core.ModelError(f"{path}: not text in UTF-8 at byte {error.start}") from None
    except OSError as error:
        raise _core.ModelError(f"{path}: {error.strerror or error}") from None


def _judged(said: Said, before: str, check: Callable[[str], Any], on_trees: bool) -> Equation:
    """Judge a statement with the definitions before it. A user's model meets its hypotheses or not; random trees do both."""
    from .truth import in_words

    line, text = said.line, said.text
    if not said.rhs:
        return Equation(line, text, NOT_READ, note="  it has no equals sign")
    try:
        report = check(before + text)
    except SpacesError as error:
        return Equation(line, text, FAILS, note="  spaces do not fit\n" + str(error).split("\n", 1)[-1])
    except _core.SpaceError as error:  # of a statement by block
        return Equation(line, text, FAILS, note=f"  spaces do not fit\n  {error}")
    except ParseError as error:
        return Equation(line, text, NOT_READ, note=str(error).split("\n", 1)[-1])
    except _core.Error as error:
        return Equation(line, text, NOT_READ, note=f"  {error}")
    where = ", or where ".join(map(in_words, report.true_where)) if report.verdict == FAILS and on_trees else ""
    details = report.details()
    if report.verdict == HOLDS or where:
        details = [detail for detail in details if detail.startswith("  read as")]
    return Equation(line, text, TRUE_WHERE if where else report.verdict, report.understood, "\n".join(details), where)


# ------------------------------------------------------------------ LaTeX


def equations(source: str) -> Iterator[tuple[int, str]]:
    """Return (line, text) of every statement in the displays, with macros expanded."""
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
        if joined and re.match(r"[-+=·@]|\\(cdot|times)", text):  # a continued row
            joined[-1] = (joined[-1][0], f"{joined[-1][1]} {text}")
        else:
            joined.append((start, text))
    return iter(joined)


def _plain(row: str) -> str:
    """Return a row without numbers, labels and layout, and without its final full stop."""
    row = re.sub(r"\\(label|tag\*?|notag|nonumber|intertext|shortintertext)\s*(\{[^{}]*\})?", " ", row)
    row = re.sub(r"\\(begin|end)\{(split|aligned|gathered|subequations)\}(\[[^\]]*\])?", " ", row)
    row = _ARGUMENTS.sub("", row)
    return row.replace("&", " ").strip()


def _apart(row: str) -> Iterator[str]:
    r"""Return the statements in one row, separated by \quad; words between them are ignored."""
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
    """Return the text between the brace at `at` and its partner."""
    depth = 0
    for end in range(at, len(source)):
        depth += {"{": 1, "}": -1}.get(source[end], 0)
        if depth == 0:
            return source[at + 1 : end]
    return source[at + 1 :]


def _expanded(row: str, macros: dict[str, tuple[int, str]]) -> str:
    """Return a row with the paper's macros expanded, recursively."""
    if not macros:
        return row
    pattern = re.compile(r"\\(" + "|".join(map(re.escape, macros)) + r")(?![A-Za-z])")
    for _ in range(1000):  # a recursive macro has no end
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
