"""Worksheets: a class set of exercises as notebooks, a different one for every student, with an answer key and grading by proof.

A worksheet's notebook holds derivations with gaps and cells of answers; its metadata holds the questions, but not the solutions.
Grading reads the answers back without running the notebook, and judges each as `Exercise.answer` does: by proof, so that another
way to the same line counts.
"""

from __future__ import annotations

import ast
import json
import random
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from numbers import Integral
from pathlib import Path
from typing import Any

from .. import _core
from ..identities.terminal_report import monospace, wrapped
from .exercise import Exercise, Judgement, exercise
from .pdf import to_pdf

TOPICS = {
    "resolvents": ["ψ⁻¹φ = I + KHφ", "φψ⁻¹ = I + φKH", "[I-HψK]Hφ = Hψ", "φK[I-HψK] = ψK", "[I+HφK]⁻¹ = I - HψK"],
    "composite bodies": ["φMφ* = R + φ̃R + Rφ̃*", "ℳ = H(R + φ̃R + Rφ̃*)H*"],
    "projections": ["τP = Pτ*", "τ² = τ", "τ̄Pτ̄* = τ̄P", "Hτ̄ = 0"],
    "factorization": ["ψMψ* = P + ψ̃P + Pψ̃*", "HψMψ*H* = D", "HφMψ*H* = [I+HφK]D", "ℳ = [I+HφK]D[I+HφK]*"],
    "inverse": ["ℳ⁻¹ = [I-HψK]*D⁻¹[I-HψK]", "[I+HφK]⁻¹ = I - HψK", "φ*H*ℳ⁻¹ = ψ*H*D⁻¹[I-HψK]"],
    "operational space": ["Ω = φ*H*ℳ⁻¹Hφ", "(I-ΩM)φ* = ψ* - ΩP"],
}
"""Topics of worksheets: statements of the book with proofs of several lines."""


@dataclass(frozen=True)
class Question:
    """One derivation of a worksheet and the lines left out."""

    statement: str
    blanks: tuple[int, ...]

    def exercise(self) -> Exercise:
        return exercise(self.statement).leaving_out(*self.blanks)


@dataclass
class Grade:
    """The judgements of one worksheet, by (question from 1, line)."""

    student: str
    judgements: dict[tuple[int, int], Judgement] = field(default_factory=dict)

    @property
    def points(self) -> int:
        return sum(map(bool, self.judgements.values()))

    @property
    def possible(self) -> int:
        return len(self.judgements)

    def __repr__(self) -> str:
        lines = [f"{self.student}: {self.points} of {self.possible}"]
        lines += [f"  {question}, line {line}: {judgement}" for (question, line), judgement in self.judgements.items()]
        return "\n".join(lines)


@dataclass
class Worksheet:
    """The exercises of one student."""

    topic: str
    student: str
    questions: list[Question]

    def notebook(self, solved: bool = False) -> dict[str, Any]:
        """The notebook as JSON data (nbformat 4.5); with `solved` the answer key, solutions below each derivation."""
        title = f"# {self.topic[:1].upper()}{self.topic[1:]}\n\n{'Answer key' if solved else 'Worksheet'} of {self.student}."
        text = "" if solved else (
            "\n\nFill in the lines that are left out: text in Unicode, ASCII or LaTeX, as in `\"HψPH* + HPψ*H* - D\"`. "
            "The last cell judges the answers so far, by proof; another way to the same line counts."
        )  # fmt: skip
        cells = [_cell("markdown", title + text)]
        for k, question in enumerate(self.questions, 1):
            task = question.exercise()
            cells.append(_cell("markdown", f"## Question {k}\n\n{task._repr_latex_()}"))
            if solved:
                rows = [f"- line {b}: `{task.gap(b).solution()}`" for b in question.blanks]
                cells.append(_cell("markdown", "\n".join(rows)))
            else:
                answers = "".join(f'    {b}: "",\n' for b in question.blanks)
                cells.append(_cell("code", f"answers_{k} = {{\n{answers}}}", [f"answers-{k}"]))
        if not solved:
            drawn = [(q.statement, list(q.blanks)) for q in self.questions]
            check = "\n".join(
                ["import pycraft as pc", "", f"for k, ((statement, blanks), answers) in enumerate(zip({drawn!r},"]
                + [f"        [{', '.join(f'answers_{k}' for k in range(1, len(drawn) + 1))}]), 1):"]
                + ["    for line, text in answers.items():", "        if text:"]
                + ["            print(k, line, pc.exercise(statement).leaving_out(*blanks).gap(line).answer(text))"]
            )
            cells.append(_cell("code", check))
        asked = [{"statement": q.statement, "blanks": list(q.blanks)} for q in self.questions]
        return {
            "cells": cells,
            "metadata": {
                "pycraft": {"topic": self.topic, "student": self.student, "questions": asked},
                "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
                "language_info": {"name": "python"},
            },
            "nbformat": 4,
            "nbformat_minor": 5,
        }


@dataclass(repr=False)
class Worksheets:
    """The worksheets of a class, see `worksheet`. It prints each student's questions, and the lines left out."""

    topic: str
    sheets: list[Worksheet]

    def __len__(self) -> int:
        return len(self.sheets)

    def __iter__(self) -> Iterator[Worksheet]:
        return iter(self.sheets)

    def __getitem__(self, k: int) -> Worksheet:
        return self.sheets[k]

    def __repr__(self) -> str:
        lines = [f"{len(self)} worksheets: {self.topic}"]
        for sheet in self.sheets:
            asked = "; ".join(f"{q.statement} (lines {', '.join(map(str, q.blanks))})" for q in sheet.questions)
            lines.append(monospace(f"  {sheet.student}: {asked}"))
        return "\n".join(map(wrapped, lines))

    def save(self, folder: str | Path, pdf: bool = False) -> list[Path]:
        """Write `<student>.ipynb` for every student and `key/<student>.ipynb` with the solutions; with `pdf`, each also as PDF.

        Raises
        ------
        ModelError
            The folder cannot be written; for PDF, nbconvert (extra [lab]) or a program that it needs is missing, named in the message. The
            notebooks are written nevertheless.
        """
        folder = Path(folder)
        written = []
        try:
            (folder / "key").mkdir(parents=True, exist_ok=True)
            for sheet in self.sheets:
                for path, solved in ((folder / f"{sheet.student}.ipynb", False), (folder / "key" / f"{sheet.student}.ipynb", True)):
                    path.write_text(json.dumps(sheet.notebook(solved), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
                    written.append(path)
        except OSError as error:
            raise _core.ModelError(f"{folder}: {error.strerror or error}") from None
        return written + [to_pdf(path) for path in written] if pdf else written

    def grade(self, folder: str | Path) -> list[Grade]:
        """Judge the submitted `<student>.ipynb` of every student of the class in a folder; a missing one gets no points."""
        grades = []
        for sheet in self.sheets:
            path = Path(folder) / f"{sheet.student}.ipynb"
            grades.append(grade(path, sheet) if path.is_file() else _judged(sheet, {}))
        return grades


def worksheet(
    topic: str | Sequence[str], students: int | Sequence[str] = 30, seed: int = 0, *, questions: int = 3, blanks: int = 2
) -> Worksheets:
    """Return a different worksheet for every student of a class.

    Parameters
    ----------
    topic : "resolvents", "composite bodies", "projections", "factorization", "inverse", "operational space"; or statements or names of
        theorems of your own choice
    students : their number, or their names, which name the notebooks
    seed : seed of the choice of statements, their order and the lines left out
    questions : derivations per sheet, at most the number of the topic's statements
    blanks : lines left out of each derivation, at most the number of its informative lines

    Returns
    -------
    Worksheets
        `.save(folder, pdf=False)` writes notebooks and answer keys, `.grade(folder)` judges the submissions.

    Raises
    ------
    EvaluationError
        An unknown topic; a statement without a proof; no students or questions.

    Examples
    --------
    >>> import pycraft as pc
    >>> sheets = pc.worksheet("resolvents", students=["ada", "emmy"], seed=1, questions=1, blanks=1)
    >>> [(sheet.student, len(sheet.questions)) for sheet in sheets]
    [('ada', 1), ('emmy', 1)]
    """
    if isinstance(topic, str) and topic not in TOPICS:
        raise _core.EvaluationError(f"no topic is called {topic!r}; there are {', '.join(TOPICS)}, or give a list of statements")
    statements = TOPICS[topic] if isinstance(topic, str) else list(topic)
    names = _names(students)
    if not statements or not names or questions < 1 or blanks < 1:
        raise _core.EvaluationError("a worksheet needs at least one statement, one student, one question and one blank")
    if len(set(names)) < len(names) or any(not n or Path(n).name != n for n in names):
        raise _core.EvaluationError("students need different names that are valid file names")
    gaps = {statement: _gaps(exercise(statement)) for statement in statements}
    sheets = []
    for k, name in enumerate(names):
        draw = random.Random(f"{seed} {k}")
        chosen = draw.sample(statements, min(questions, len(statements)))
        sheets.append(
            Worksheet(topic if isinstance(topic, str) else "exercises", name, [_question(s, gaps[s], blanks, draw) for s in chosen])
        )
    return Worksheets(sheets[0].topic, sheets)


def _names(students: int | Sequence[str]) -> list[str]:
    if isinstance(students, Integral) and not isinstance(students, bool):
        return [f"student{k:02d}" for k in range(1, int(students) + 1)]
    if isinstance(students, str) or not isinstance(students, Iterable) or not all(isinstance(name, str) for name in students):
        raise _core.EvaluationError(f"students={students!r}: give their number, or a list of their names")
    return list(students)


def _gaps(task: Exercise) -> list[int]:
    """Return the lines whose own text is accepted as an answer: a line that only names an expression of the line before is not a gap."""
    fit = [line for line in task.gaps() if task.leaving_out(line).answer(task.steps[line - 1].after_text())]
    return fit or task.gaps()


def _question(statement: str, gaps: list[int], blanks: int, draw: random.Random) -> Question:
    """Return the lines to leave out, avoiding neighbours, so that each gap lies between visible lines."""
    chosen: list[int] = []
    for line in draw.sample(gaps, len(gaps)):
        if len(chosen) < blanks and not any(abs(line - other) == 1 for other in chosen):
            chosen.append(line)
    return Question(statement, tuple(sorted(chosen)))


def grade(path: str | Path, sheet: Worksheet | None = None) -> Grade:
    """Judge the answers in a worksheet's notebook. With `sheet`, the questions come from the sheet instead of the file.

    Raises
    ------
    ModelError
        The file is not a notebook, or not a worksheet of `worksheet`.
    """
    path = Path(path)
    try:
        notebook = json.loads(path.read_text(encoding="utf-8"))
        if sheet is None:
            told = notebook["metadata"]["pycraft"]
            asked = [Question(q["statement"], tuple(int(b) for b in q["blanks"])) for q in told["questions"]]
            sheet = Worksheet(str(told["topic"]), str(told["student"]), asked)
        cells = [(cell.get("metadata", {}).get("tags", []), "".join(cell.get("source", ""))) for cell in notebook["cells"]]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise _core.ModelError(f"{path} is not the notebook of a worksheet ({type(error).__name__}: {error})") from None
    answers = {tag: _answers(source) for tags, source in cells for tag in tags if tag.startswith("answers-")}
    return _judged(sheet, answers)


def _answers(source: str) -> dict[Any, Any]:
    """Return the dictionary assigned in a cell of answers, read as data: a student's notebook is never run."""
    try:
        for statement in ast.parse(source).body:
            if isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Dict):
                return dict(ast.literal_eval(statement.value))
    except (SyntaxError, ValueError, TypeError):
        pass
    return {}


def _judged(sheet: Worksheet, answers: dict[str, dict[Any, Any]]) -> Grade:
    found = Grade(sheet.student)
    for k, question in enumerate(sheet.questions, 1):
        task, given = question.exercise(), answers.get(f"answers-{k}", {})
        for line in question.blanks:
            text = given.get(line, "")
            empty = not isinstance(text, str) or not text.strip()
            found.judgements[k, line] = Judgement("no answer", "") if empty else task.gap(line).answer(text)
    return found


def _cell(kind: str, source: str, tags: Sequence[str] = ()) -> dict[str, Any]:
    import hashlib

    cell: dict[str, Any] = {
        "cell_type": kind,
        "id": hashlib.sha256(source.encode()).hexdigest()[:12],
        "metadata": {"tags": list(tags)} if tags else {},
        "source": source,
    }
    return cell | ({"execution_count": None, "outputs": []} if kind == "code" else {})
