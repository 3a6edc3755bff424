"""Proofs as text, HTML and LaTeX: a chain of steps with its reasons, and with the derivations of all lemmas unfolded."""

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
    """What is shown of a proof; it is true as a condition where there is one."""

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
"""Characters of a step and its reason that a display sets side by side."""
GUTTER = 3
"""Columns between a step and its reason, at least."""
GAP = "\\boxed{\\;?\\;}"
"""What stands for a line left out."""
_STYLE = (
    "<style>.pycraft-proof{font-family:serif;max-width:60em}.pycraft-proof ol{margin:.2em 0 .8em;padding-left:2.5em}"
    ".pycraft-proof li{display:list-item;overflow-wrap:anywhere}.pycraft-proof .reason{opacity:.7;margin-left:1.5em;font-size:.9em}</style>"
)


def lines(steps: Sequence[Step], cited: dict[str, int] | None = None) -> list[str]:
    """The chain, one step a line of 80 columns, reasons in a column, or below what leaves no room for them; with the numbers of the lemmas
    that are cited, where these are given."""
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
    """The text with the lines broken that do not fit a terminal."""
    return "\n".join(wrapped(line) if cell_len(line) > WIDTH else line for line in text.split("\n"))


def reason(step: Step, cited: dict[str, int] | None = None) -> str:
    """The equations of a step, each with the number of the lemma that it is."""
    if not cited or step.title or not step.uses:
        return step.reason
    found = step.reason
    for equation in step.equations:
        if equation.text in cited and equation.kind in ("lemma", "structure"):
            found = found.replace(equation.text, f"{equation.text}, by ({cited[equation.text]})", 1)
    return found


def reason_latex(step: Step, cited: dict[str, int] | None = None) -> str:
    """The equations of a step as mathematics, with the numbers of the lemmas that are cited."""
    if step.title or not step.uses:
        return f"\\text{{{escaped(step.reason)}}}"
    latex = step.alphabet.latex
    made = []
    for e in step.equations:
        number = (cited or {}).get(e.text) if e.kind in ("lemma", "structure") else None
        made.append(f"{latex(e.lhs)} = {latex(e.rhs)}" + ("" if number is None else f"\\text{{, by ({number})}}"))
    return ";\\;".join(made) + (f"\\text{{{step.manner}}}" if step.manner else "")


def aligned(steps: Sequence[Step], cited: dict[str, int] | None = None, blanks: Collection[int] = ()) -> str:
    """The chain as an aligned display, a box for the lines left out; reasons beside the lines, or below them where a page is too narrow."""
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
    """The rows of an aligned display that a line takes, with the sign before it."""
    first, *others = lines_of(latex)
    return [f"{sign}& {first}", *(f"& \\quad {other}" for other in others)]


class FullProof:
    """A proof with the derivations of its lemmas, each numbered and before what cites it, down to the axioms. See `Proof.full`."""

    def __init__(self, proof: Shown):
        self.proof = proof
        self.lemmas = proof.all_lemmas() if proof else []
        self._numbers = {lemma.statement: i for i, lemma in enumerate(self.lemmas, 1)}

    def __len__(self) -> int:
        """How many steps there are in all."""
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
        """Sections of aligned displays, one a lemma."""
        made = []
        for p in (*self.lemmas, self.proof):
            number = self._numbers.get(p.statement)
            title = f"\\text{{({number})}}\\quad " if number is not None and p is not self.proof else ""
            made.append(f"{title}{p._latex}{_where_latex(p)}\\\\\n{aligned(p.steps, self._numbers)}")
        return "\\begin{gathered}" + "\\\\[1ex]\n".join(made) + "\\end{gathered}"


def where(proof: Shown) -> str:
    """The hypotheses, as the end of a sentence."""
    return f", where {' and '.join(proof.hypotheses)}" if proof.hypotheses else ""


def _where_latex(proof: Shown) -> str:
    return f"\\quad\\text{{where {escaped(' and '.join(proof.hypotheses))}}}" if proof.hypotheses else ""


def page(proof: Shown) -> str:
    """A proof alone, as HTML; its steps wrap."""
    return f'{_STYLE}<div class="pycraft-proof">{_section(proof, None, {})}</div>'


def _section(proof: Shown, number: int | None, cited: dict[str, int]) -> str:
    """One proof: verdict, statement and hypotheses, and its steps as a list."""
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
