"""Proofs as text, HTML and LaTeX: a chain of steps with reasons, optionally with the derivations of all lemmas."""

from __future__ import annotations

import html
from collections.abc import Collection, Sequence
from typing import Protocol

from rich.cells import cell_len

from ..identities.terminal_report import WIDTH, wrapped
from ..identities.verdict_html import verdict_html
from ..operators.formula_html import formula_html
from ..operators.latex_lines import lines_of
from ..operators.latex_text import escaped
from .equations import Step


class Shown(Protocol):
    """Display of a proof; true as a condition if there is a proof."""

    statement: str
    steps: list[Step]
    presupposes: list[str]
    note: str
    _latex: str

    @property
    def hypotheses(self) -> list[str]: ...

    @property
    def axioms(self) -> list[str]: ...

    @property
    def worst(self) -> float | None: ...

    def all_lemmas(self) -> Sequence[Shown]: ...

    def __bool__(self) -> bool: ...


ASIDE = 76
"""Largest number of characters of a step and its reason that a display sets side by side."""
GUTTER = 3
"""Least number of columns between a step and its reason."""
GAP = "\\boxed{\\;?\\;}"
"""Placeholder of a line left out."""
_STYLE = (
    "<style>.pycraft-proof{font-family:serif;max-width:60em}.pycraft-proof ol{margin:.2em 0 .8em;padding-left:2.5em}"
    ".pycraft-proof li{display:list-item;overflow-wrap:anywhere}.pycraft-proof .reason{opacity:.7;margin-left:1.5em;font-size:.9em}</style>"
)


def lines(steps: Sequence[Step], cited: dict[str, int] | None = None) -> list[str]:
    """Return the chain, one step per line of 80 columns, with reasons in a column, or below long lines; with the numbers of the cited
    lemmas, if these are given."""
    if not steps:
        return []
    made = [wrapped(f"      {steps[0].before_text()}")]
    rows = [(f"  {f'{s.number}.':>3} = {s.after_text()}", f"[{reason(s, cited)}]") for s in steps]
    column = max((cell_len(step) for step, why in rows if cell_len(step) + cell_len(why) + GUTTER <= WIDTH), default=0) + GUTTER
    for step, why in rows:
        gap = column - cell_len(step)
        beside = gap >= GUTTER and column + cell_len(why) <= WIDTH
        made.append(f"{step}{' ' * gap}{why}" if beside else f"{wrapped(step)}\n{wrapped(' ' * 8 + why)}")
    return made


def fitted(text: str) -> str:
    """Return the text with long lines broken to fit a terminal."""
    return "\n".join(wrapped(line) if cell_len(line) > WIDTH else line for line in text.split("\n"))


def reason(step: Step, cited: dict[str, int] | None = None) -> str:
    """Return the equations of a step, each with its lemma's number."""
    if not cited or step.title or not step.uses:
        return step.reason
    found = step.reason
    for equation in step.equations:
        if equation.text in cited and equation.kind in ("lemma", "structure"):
            found = found.replace(equation.text, f"{equation.text}, by ({cited[equation.text]})", 1)
    return found


def reason_latex(step: Step, cited: dict[str, int] | None = None) -> str:
    """Return the equations of a step as mathematics, with the numbers of the cited lemmas."""
    if step.title or not step.uses:
        return f"\\text{{{escaped(step.reason)}}}"
    latex = step.alphabet.latex
    made = []
    for e in step.equations:
        number = (cited or {}).get(e.text) if e.kind in ("lemma", "structure") else None
        made.append(f"{latex(e.lhs)} = {latex(e.rhs)}" + ("" if number is None else f"\\text{{, by ({number})}}"))
    return ";\\;".join(made) + (f"\\text{{{step.manner}}}" if step.manner else "")


def aligned(steps: Sequence[Step], cited: dict[str, int] | None = None, blanks: Collection[int] = ()) -> str:
    """Return the chain as an aligned display, with a box for lines left out, and reasons beside the lines, or below on a narrow page."""
    if not steps:
        return "\\begin{aligned}\\end{aligned}"
    beside = max(len(s.after_text()) for s in steps) + max(len(s.reason) for s in steps) <= ASIDE
    rows = _set_in("", steps[0].before_latex())
    for i, s in enumerate(steps, 1):
        line, number = GAP if i in blanks else s.after_latex(), f"\\text{{{i}.}}\\;"
        why = number if i in blanks else number + reason_latex(s, cited)
        rows += [f"={{}}& {line} && {why}"] if beside else [*_set_in("={}", line), *_set_in("", f"\\qquad {why}")]
    return "\\begin{aligned}" + "\\\\\n".join(rows) + "\\end{aligned}"


def _set_in(sign: str, latex: str) -> list[str]:
    """Return the rows of an aligned display for a line, with the sign before it."""
    first, *others = lines_of(latex)
    return [f"{sign}& {first}", *(f"& \\quad {other}" for other in others)]


class FullProof:
    """A proof with the derivations of its lemmas, numbered, each before its citations, down to the axioms. See `Proof.full`."""

    def __init__(self, proof: Shown):
        self.proof = proof
        self.lemmas = proof.all_lemmas() if proof else []
        self._numbers = {lemma.statement: i for i, lemma in enumerate(self.lemmas, 1)}

    def __len__(self) -> int:
        """Return the total number of steps."""
        return sum(len(p.steps) for p in (*self.lemmas, self.proof))

    def __str__(self) -> str:
        parts = []
        for lemma in self.lemmas:
            head = f"({self._numbers[lemma.statement]}) {lemma.statement}{where(lemma)}"
            notes = [f"      {lemma.note}"] if lemma.note else []
            parts.append("\n".join([head, *lines(lemma.steps, self._numbers), *notes]))
        own = "\n".join([f"{self.proof.statement}{where(self.proof)}", *lines(self.proof.steps, self._numbers)])
        return fitted("\n\n".join([*parts, own if self.proof else str(self.proof)]))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        parts = [_section(p, self._numbers.get(p.statement), self._numbers) for p in self.lemmas]
        return f'{_STYLE}<div class="pycraft-proof">{"".join(parts)}{_section(self.proof, None, self._numbers)}</div>'

    def latex(self) -> str:
        """Return sections of aligned displays, one per lemma."""
        made = []
        for p in (*self.lemmas, self.proof):
            number = self._numbers.get(p.statement)
            title = f"\\text{{({number})}}\\quad " if number is not None and p is not self.proof else ""
            made.append(f"{title}{p._latex}{_where_latex(p)}\\\\\n{aligned(p.steps, self._numbers)}")
        return "\\begin{gathered}" + "\\\\[1ex]\n".join(made) + "\\end{gathered}"


def where(proof: Shown) -> str:
    """Return the hypotheses as the end of a sentence."""
    return f", where {' and '.join(proof.hypotheses)}" if proof.hypotheses else ""


def _where_latex(proof: Shown) -> str:
    return f"\\quad\\text{{where {escaped(' and '.join(proof.hypotheses))}}}" if proof.hypotheses else ""


def page(proof: Shown) -> str:
    """Return a single proof as HTML; its steps wrap."""
    return f'{_STYLE}<div class="pycraft-proof">{_section(proof, None, {})}</div>'


def _section(proof: Shown, number: int | None, cited: dict[str, int]) -> str:
    """Return one proof: verdict, statement and hypotheses, and its steps as a list."""
    label = f"({number}) " if number is not None else ""
    hypotheses = f"where {' and '.join(proof.hypotheses)}" if proof.hypotheses else "no hypothesis"
    said = verdict_html("proved", f"proved, {hypotheses}" if number is None else hypotheses) if proof else verdict_html("no proof found")
    head = f"{said} &ensp; <b>{label}{formula_html(proof.statement)}</b>"
    if not proof:
        why = html.escape(str(proof).partition("\n")[2].partition("no proof found")[2].lstrip(": \n"))
        return f'<p>{head}</p><div style="white-space:pre-wrap">{why}</div>'
    first = f"<div>{formula_html(proof.steps[0].before_text())}</div>" if proof.steps else ""
    items = "".join(
        f'<li>= {formula_html(s.after_text())} <span class="reason">[{formula_html(reason(s, cited))}]</span></li>' for s in proof.steps
    )
    notes = [proof.note, f"presupposes {', '.join(proof.presupposes)}" if proof.presupposes else ""]
    if number is None and proof.axioms:
        notes.append(f"rests on {'; '.join(proof.axioms)}")
    if number is None and proof.worst is not None:
        notes.append(f"largest residual of a step at a random state: {proof.worst:.1e}")
    told = "".join(f'<div class="reason">{html.escape(note)}</div>' for note in notes if note)
    return f"<p>{head}</p>{first}<ol>{items}</ol>{told}"
