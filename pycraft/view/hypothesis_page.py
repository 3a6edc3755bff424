"""Hypotheses as switches: a page that shows which theorems of the catalogue break, and by how much, when a hypothesis is violated.

Every combination of the switches is a model. When the page is made, all theorems are checked on all models, as by `soa.check`: the
residuals are computed at a random state, in the deciding precision. The page needs no server.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from ..arguments import whole
from ..identities.checker import check_model
from ..identities.family import Spec
from ..identities.report import Report
from ..progress_bar import StepProgress
from .figure_data import figure_data, number_text, pose_rows
from .page import Page
from .skeleton import Skeleton
from .web_page import web_page

SWITCHES = {
    "J": ("J = 0", "J > 0"),
    "tree": ("chain", "branch"),
    "hinges": ("single-DOF", "ball", "universal"),
    "base": ("fixed", "free"),
}
"""The switches and their positions; the first position is the initial one. Balls have three coordinates and a constant H; universal
hinges have two and an H that is not constant."""
_KINDS = {"single-DOF": "pin", "ball": "ball", "universal": "universal"}
_LEAST, _MOST = 3, 16
"""Least and largest number of bodies: two bodies have no branch; many make the page slow to build."""


class HypothesisPage(Page):
    """`pycraft.hypothesis_switches`.

    Attributes
    ----------
    specs : dict
        Models by the switches' positions, such as ("J = 0", "chain", "ball", "fixed").
    """

    HEIGHT = 620

    def __init__(self, bodies: Any = 4, seed: Any = 0, progress: Callable[[str], None] | bool = True):
        count = whole(bodies, "bodies")
        if not _LEAST <= count <= _MOST:
            raise _core.EvaluationError(f"bodies={count}: give {_LEAST} (the fewest that branch) to {_MOST}")
        self._seed = whole(seed, "seed")
        if self._seed < 0:
            raise _core.EvaluationError(f"seed={self._seed}: give a whole number, 0 or more")
        self.specs = {positions: _spec(positions, count, self._seed) for positions in itertools.product(*SWITCHES.values())}
        self._progress, self._reports = progress, dict[tuple[str, ...], Report]()

    def broken(self, *positions: str) -> list[Any]:
        """Return the findings of theorems that fail with these positions: theorems outside their hypotheses whose residuals are large or
        undefined."""
        return [finding for finding in self.report(*positions).findings if _state(finding) in ("breaks", "undefined")]

    def report(self, *positions: str) -> Report:
        """Return the report of all theorems on the model of these positions, one per switch in order. Others raise EvaluationError."""
        if positions not in self.specs:
            known = "; ".join(f"{name}: {', '.join(map(repr, choices))}" for name, choices in SWITCHES.items())
            raise _core.EvaluationError(f"unknown positions {positions}: give one of each of {known}, in this order")
        if positions not in self._reports:
            if callable(self._progress):
                self._progress(", ".join(positions))
            self._reports[positions] = check_model(
                _in_motion(self.specs[positions], self._seed).soa, states=0, seed=self._seed, progress=False
            )
        return self._reports[positions]

    @cached_property
    def html(self) -> str:
        said: dict[str, Any] = {}  # some statements exist only on some models
        findings = []
        with StepProgress(len(self.specs), "models", not callable(self._progress) and self._progress is not False) as bar:
            for positions in self.specs:
                bar(", ".join(positions))
                findings += self.report(*positions).findings
        for finding in (finding for finding in findings if finding.verdict != "waiting"):
            said.setdefault(finding.name, {"name": finding.name, "group": finding.group, "text": finding.statement,
                                           "hypotheses": finding.hypotheses})  # fmt: skip
        groups = list(dict.fromkeys(theorem["group"] for theorem in said.values()))
        theorems = sorted(said.values(), key=lambda theorem: groups.index(theorem["group"]))
        numbers = {theorem["name"]: i for i, theorem in enumerate(theorems)}
        cases = {"|".join(positions): self._case(positions, numbers) for positions in self.specs}
        data = {"switches": SWITCHES, "theorems": theorems, "cases": cases}
        return web_page(
            "switches", "Which theorems need which hypotheses", data, {"said": f"{len(theorems)} theorems, {len(cases)} models"}
        )

    def _case(self, positions: tuple[str, ...], numbers: dict[str, int]) -> dict[str, Any]:
        model = _in_motion(self.specs[positions], self._seed)
        skeleton, found = Skeleton(model), self.report(*positions).findings
        rows: list[Any] = [None] * len(numbers)
        for finding in found:
            if finding.name in numbers:
                rows[numbers[finding.name]] = [_state(finding), _size(finding), finding.unmet, finding.note]
        return {
            "met": sorted(self.specs[positions].met), "rows": rows, "said": f"{len(model.bodies)} bodies, N = {model.nv}",
            "figure": figure_data(skeleton, np.asarray(model.q)), "poses": number_text(pose_rows(skeleton, np.asarray(model.q))),
        }  # fmt: skip

    def __repr__(self) -> str:
        bodies = len(next(iter(self.specs.values())).parents)
        return f"<switches of hypotheses: {len(self.specs)} models of {bodies} bodies, {len(self._reports)} of them checked by now>"


def hypothesis_switches(bodies: int = 4, seed: int = 0, *, progress: Callable[[str], None] | bool = True) -> HypothesisPage:
    """Return a page with switches for the hypotheses of theorems: J, chain or branch, the kind of hinges, fixed or free base.

    Flipping a switch shows which theorems of the catalogue break, and by how much. Each of the 24 combinations is a model, on which the
    theorems are checked as by `soa.check` on first use: half a second each at four bodies; the page uses all.

    Parameters
    ----------
    bodies : number of bodies of each model, 3 to 16
    seed : seed of their random inertias, hinges and state
    progress : True shows a bar in a terminal or notebook while the page is made; a function is called with the positions before each
        model; False shows nothing

    Returns
    -------
    HypothesisPage
        A notebook shows it; `save("hypotheses.html")` writes a page that opens offline; `broken("J > 0", "chain", "ball", "fixed")` returns
        the failures of one combination, `report(...)` all of its findings.

    Raises
    ------
    EvaluationError
        An invalid number of bodies or seed.

    Examples
    --------
    >>> import pycraft as pc
    >>> page = pc.hypothesis_switches(bodies=3)
    >>> [f.name for f in page.broken("J = 0", "chain", "single-DOF", "fixed")]
    ['two-filter form']
    >>> page
    <switches of hypotheses: 24 models of 3 bodies, 1 of them checked by now>
    """
    return HypothesisPage(bodies, seed, progress)


def _spec(positions: tuple[str, ...], count: int, seed: int) -> Spec:
    """Return the specification of the model of these positions: a chain, or two branches from the first body."""
    J, tree, hinges, base = positions
    parents = tuple(range(-1, count - 1)) if tree == "chain" else (-1, 0, *(max(0, k - 2) for k in range(2, count)))
    kinds = ["free" if base == "free" else _KINDS[hinges], *[_KINDS[hinges]] * (count - 1)]
    return Spec(parents, tuple(kinds), J == "J > 0", seed)


def _in_motion(spec: Spec, seed: int) -> Any:
    """Return the model, set to a random state."""
    model = spec.model()
    state = model.random_state(seed)
    model.q, model.v = state.q, state.v
    return model


def _state(finding: Any) -> str:
    """Return the page's word: "holds"; outside the hypotheses "breaks" or "holds anyway"; else the verdict."""
    if finding.verdict == "expected to fail":
        return "breaks" if finding.states else "undefined"
    return str(finding.verdict)


def _size(finding: Any) -> float | None:
    """Return the relative residual: in double if the theorem fails, in the deciding precision if it holds."""
    if not finding.states:
        return None
    value = finding.residual if finding.verdict in ("expected to fail", "fails") else finding.wide_residual
    return float(f"{value:.3g}") if np.isfinite(value) else None
