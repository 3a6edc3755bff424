"""Where a statement is true: its truth map over chains and trees, J, hinge kinds and bases, and the hypotheses that follow from it."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import _core
from ..file_targets import writable_target
from ..progress_bar import StepProgress
from .budget import Budget
from .dialects import in_dialect
from .family import CELLS, CONSTANT, EVERY, HYPOTHESES, ONE, VARIANTS, WITH_J, Cell, Spec, family, nilpotency, read_on, specs
from .judge import FAILS, HOLDS, UNDECIDED
from .parse import Statements, as_text
from .search import Counterexample, judged, smallest, understood
from .terminal_report import STYLES, monospace, read_as, text_of, wrapped
from .truth_picture import truth_html, truth_page, truth_plot, truth_size

TRUE, FALSE, UNREAD = "true", "FALSE", "not said"
PICTURES = (".png", ".svg", ".pdf")
_WORDS = {HOLDS: TRUE, FAILS: FALSE, UNDECIDED: UNDECIDED}


@dataclass
class CellTruth:
    """What was found in one cell: "true", "FALSE", "undecided", or "not said" where no model has what the statement names."""

    cell: Cell
    verdict: str
    models: int
    example: Counterexample | None = None
    """The smallest case that was found, of a false one."""

    @property
    def word(self) -> str:
        """The verdict, with the smallest case of a false one."""
        if self.example is None:
            return self.verdict
        kinds = self.example.kinds
        runs = [(kind, len(list(group))) for kind, group in itertools.groupby(kinds)]
        hinges = " ".join(kind if n == 1 else f"{n}×{kind}" for kind, n in runs)
        chain = "serial chain" in self.example.spec.met
        return f"{self.verdict}: {hinges}{'' if chain else f' on {self.example.parents}'}{', J' if self.example.rotor_inertia else ''}"


@dataclass
class TruthMap:
    """Where a statement is true. As a condition: true where it is true in every cell. See `truth`.

    Iterating gives the cells; `map[shape, J, hinges, base]` is one of them; `.where` the fewest hypotheses under which it is true.
    """

    statement: str
    cells: list[CellTruth]
    seconds: float = 0.0
    understood: str = ""
    """How the text was read, in the package's own letters."""
    partial: bool = False
    """Whether a budget ended before the large models of every cell were tried."""

    def __iter__(self) -> Iterator[CellTruth]:
        return iter(self.cells)

    def __getitem__(self, key: tuple[str, str, str, str]) -> CellTruth:
        return next(c for c in self.cells if c.cell == Cell(*key))

    def __bool__(self) -> bool:
        return all(c.verdict in (TRUE, UNREAD) for c in self.cells) and any(c.verdict == TRUE for c in self.cells)

    @property
    def where(self) -> list[frozenset[str]]:
        """The sets of hypotheses, each without one to spare, under which it is true in every cell; [frozenset()] if it is true without."""
        found: list[frozenset[str]] = []
        for size in range(len(HYPOTHESES) + 1):
            for chosen in map(frozenset, itertools.combinations(HYPOTHESES, size)):
                meeting = [c for c in self.cells if chosen <= c.cell.least and c.verdict != UNREAD]
                if any(smaller <= implied(chosen) for smaller in found) or not meeting:
                    continue
                if all(c.verdict == TRUE for c in meeting):
                    found.append(chosen)
        weaker = {chosen: -sum(chosen <= c.cell.least for c in self.cells) for chosen in found}
        return sorted(found, key=lambda chosen: (len(chosen), weaker[chosen]))

    @property
    def needs_rotor_inertia(self) -> bool:
        """Whether an inverse in it exists where J > 0, and on no model without rotor inertia."""
        read = {c.cell.J for c in self.cells if c.verdict != UNREAD}
        return read == {WITH_J}

    @property
    def verdict(self) -> str:
        """The headline in words."""
        where = self.where
        if where == [frozenset()] and self.needs_rotor_inertia:
            return "TRUE where J > 0; elsewhere an inverse in it does not exist"
        if where == [frozenset()]:
            return "TRUE on every model tried"
        if where:
            return "TRUE where " + ", or where ".join(in_words(chosen) for chosen in where)
        if any(c.verdict == TRUE for c in self.cells):
            return "FALSE under every standard hypothesis, true in some cells"
        return "FALSE in every cell" if any(c.verdict == FALSE for c in self.cells) else "undecided"

    def table(self) -> Any:
        """The map as a rich table: a row for each shape, J and base, a column for the hinges."""
        from rich.table import Table
        from rich.text import Text

        table = Table(box=None, pad_edge=False, header_style="bold")
        for header in ("tree", "J", "base", ONE, CONSTANT, EVERY):
            table.add_column(header, overflow="fold")
        for shape, J, base in dict.fromkeys((c.cell.shape, c.cell.J, c.cell.base) for c in self.cells):
            row = [self[shape, J, hinges, base] for hinges in (ONE, CONSTANT, EVERY)]
            styles = {TRUE: STYLES["holds"], FALSE: STYLES["fails"], UNDECIDED: STYLES["undecided"], UNREAD: STYLES["waiting"]}
            table.add_row(shape, J, base.removesuffix(" base"), *(Text(c.word, style=styles[c.verdict]) for c in row))
        return table

    def __repr__(self) -> str:
        count = sum(c.models for c in self.cells)
        lines = [monospace(self.statement), *read_as(self.statement, self.understood), *wrapped(self.verdict).split("\n")]
        head = "\n".join([*lines, f"{count} models, {self.seconds:.1f} s; in false cells the smallest case"])
        return f"{head}\n\n{text_of(self.table())}"

    def _repr_html_(self) -> str:
        return truth_html(self)

    def plot(self, ax: Any = None) -> Any:
        """The map as a picture: true and false tiles, in the false ones the smallest cases drawn as trees; returns the axes."""
        return truth_plot(self, ax)

    def save(self, path: Any) -> Path:
        """Write the map: as a page (".html") or as the picture of `plot` (".png", ".svg", ".pdf").

        EvaluationError for another ending, OSError where it cannot be written.
        """
        target = writable_target(path, (".html", *PICTURES), "a truth map")
        if target.suffix == ".html":
            target.write_text(truth_page(self), encoding="utf-8")
            return target
        from matplotlib.figure import Figure

        axes = self.plot(Figure(figsize=truth_size(self), layout="constrained").subplots())
        axes.figure.savefig(target, dpi=150)
        return target


def implied(chosen: frozenset[str]) -> frozenset[str]:
    """The hypotheses with those that they imply: hinges of one coordinate have a constant H."""
    return chosen | {"constant H"} if "single-DOF hinges" in chosen else chosen


def in_words(chosen: Iterable[str]) -> str:
    """Hypotheses as they are said."""
    says = {
        "serial chain": "the tree is a serial chain",
        "constant H": "H is constant",
        "single-DOF hinges": "every hinge has one degree of freedom",
        "free root": "the root is free",
    }
    shown = [
        h for h in HYPOTHESES if h in chosen and not (h == "constant H" and "single-DOF hinges" in chosen)
    ]  # the one implies the other
    return " and ".join(says.get(h, h) for h in shown)


def truth(
    statement: str,
    *,
    smallest_case: bool = True,
    precision: str | int = "extended",
    budget: float = 5.0,
    vectors: Mapping[str, str] | None = None,
    dialect: str | None = None,
    progress: bool = True,
) -> TruthMap:
    """The truth map of a statement: where it is true, over chains and trees, J, hinge kinds and bases.

    Parameters
    ----------
    statement : as text, see `check`. Names are those of random trees: "body0", "hinge0", "node0", ...
    smallest_case : look for the smallest case in each false cell
    precision : the first scalar beside double
    budget : CPU seconds for the smallest cases, of all cells together
    vectors : names of the vectors in the text, and of their spaces, "Θ", "V" or "F"
    dialect : the school in whose letters it is written, see `check`
    progress : whether a bar is shown in a terminal or notebook if it takes more than a second

    Returns
    -------
    TruthMap
        It prints as a table, shows as one in a notebook, `.plot()` draws it, `.save(path)` writes it; `.where` are the fewest
        hypotheses under which it is true.

    Raises
    ------
    ParseError
        No model of the family has what the statement names, or it does not read as a statement.

    Examples
    --------
    >>> import pycraft as pc
    >>> pc.truth("HG == I", smallest_case=False).verdict
    'TRUE where J = 0'
    """
    begin = time.perf_counter()
    statement = in_dialect(as_text(statement), dialect)
    made = truth_within(statement, Budget(math.inf), precision, vectors, progress)
    assert made is not None
    false = [c for c in made.cells if c.example is not None]
    whole = Budget(budget)
    with StepProgress(len(false), "smallest cases", progress) as bar:
        for i, found in enumerate(false if smallest_case else []):
            bar(", ".join((found.cell.shape, found.cell.J, found.cell.hinges, found.cell.base)))
            left = whole.left / (len(false) - i)
            only: dict[str, Any] = dict(meets=found.cell.least, allowed=found.cell.holds, vectors=vectors)
            found.example = smallest(statement, precision=precision, budget=left, found=found.example, **only)
    made.seconds = time.perf_counter() - begin
    return made


def depth_for(statement: str, vectors: Mapping[str, str] | None = None) -> int:
    """How deep the deep models must be for no product to vanish by its depth alone; raises ParseError where no model can be spoken of."""
    deepest = 0
    refused: Exception | None = None
    for spec in family(1):
        model = spec.model()
        read = read_on(statement, spec, model, vectors)
        if read is not None:
            if read.rhs is None:
                raise _core.EvaluationError(f"{statement!r} has one side; a statement is lhs == rhs")
            deepest = max(nilpotency(read.lhs), nilpotency(read.rhs))
            refused = None
            break
        refused = refused or _refusal(statement, model)
    if refused is not None:
        raise refused
    return min(max(12, deepest + 2), 40)


def _refusal(statement: str, model: Any) -> Exception | None:
    try:
        Statements(model.soa).read(statement, inequalities=True)
    except (_core.EvaluationError, _core.SpaceError, _core.ModelError) as error:
        return error
    return None


def truth_within(
    statement: str,
    budget: Budget,
    precision: str | int = "extended",
    vectors: Mapping[str, str] | None = None,
    progress: bool = True,
) -> TruthMap | None:
    """The truth map without smallest cases. Every cell is tried on a small model first; where the budget ends after that and before the
    large ones were tried, the map is `partial`, and None where it ends earlier."""
    begin = time.perf_counter()
    depth = depth_for(statement, vectors)
    cells = [_CellTrial(cell) for cell in CELLS]
    rounds = [(turn, trial) for turn in range(VARIANTS) for trial in cells]
    partial = False
    with StepProgress(len(rounds), "models in the cells of the truth map", progress) as bar:
        for turn, trial in rounds:
            cell = trial.cell
            bar(", ".join((cell.shape, cell.J, cell.hinges, cell.base)))
            if trial.refuted is not None:
                continue
            if budget.over:
                if turn == 0:
                    return None
                partial = True
                break
            trial.judge(statement, specs(cell, depth)[turn], precision, vectors)
    return TruthMap(statement, [trial.truth() for trial in cells], time.perf_counter() - begin, understood(statement), partial)


class _CellTrial:
    """The models of a cell one after the other, up to the first that refutes."""

    def __init__(self, cell: Cell):
        self.cell = cell
        self.refuted: Counterexample | None = None
        self._found: list[str] = []

    def judge(self, statement: str, spec: Spec, precision: str | int, vectors: Mapping[str, str] | None) -> None:
        verdict = judged(statement, spec, 1, precision, vectors)
        if verdict is None:
            return
        self._found.append(verdict.verdict)
        if verdict.verdict == FAILS:
            shown = verdict.shown
            self.refuted = Counterexample(spec, shown.state, shown.decisive.residual)

    def truth(self) -> CellTruth:
        if self.refuted is not None:
            return CellTruth(self.cell, FALSE, len(self._found), self.refuted)
        if not self._found:
            return CellTruth(self.cell, UNREAD, 0)
        return CellTruth(self.cell, UNDECIDED if UNDECIDED in self._found else TRUE, len(self._found))


def saving(found: TruthMap, traits: Callable[[], dict[str, bool]] | None = None) -> list[frozenset[str]]:
    """The hypotheses under which a statement that was refuted is true; not those that the refuting model meets (`traits`)."""
    met = {name for name, is_met in traits().items() if is_met} if traits is not None else set()
    return [chosen for chosen in found.where if chosen and not chosen <= met]


def explained(
    statement: str,
    *,
    seed: int = 0,
    precision: str | int = "extended",
    budget: float = 5.0,
    found: Counterexample | None = None,
    traits: Callable[[], dict[str, bool]] | None = None,
    vectors: Mapping[str, str] | None = None,
) -> tuple[TruthMap | None, Counterexample | None]:
    """(the truth map of a false statement, the case that tells most): the smallest of all where a hypothesis saves it; else the
    smallest that meets all hypotheses under which it still fails, so that it is not blamed on what the true formula does not hold for
    either. No map where the budget, CPU seconds for each of the two, ends before every cell was tried on one model."""
    found_map = truth_within(statement, Budget(budget), precision, vectors)
    saved = saving(found_map, traits) if found_map is not None else []
    start: Counterexample | None = found
    meets: frozenset[str] = frozenset()
    if found_map is not None and not saved:
        false = [c for c in found_map.cells if c.verdict == FALSE]
        if false:
            strictest = max(false, key=lambda c: len(c.cell.least))
            start, meets = strictest.example, strictest.cell.least
    if start is None and found_map is not None:
        start = next((c.example for c in found_map.cells if c.example is not None), None)
    example = smallest(statement, seed=seed, precision=precision, budget=budget, found=start, meets=meets, vectors=vectors)
    if example is not None:
        example.saved_by = [in_words(chosen) for chosen in saved]
    return found_map, example
