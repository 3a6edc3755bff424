"""Proofs by cases: with the assumption "J > 0 or J = 0", a statement is proved for J > 0 and for J = 0."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from .proof import HYPOTHESES, Proof
from .shown import page


def alternatives(assume: Iterable[str]) -> list[list[str]]:
    """Return every choice of one case of each assumption; one choice if no assumption has several."""
    texts = [assume] if isinstance(assume, str) else list(assume)
    return [list(chosen) for chosen in itertools.product(*([case.strip() for case in text.split(" or ")] for text in texts))]


def by_cases(assume: Iterable[str], prove: Callable[[list[str]], Proof]) -> Proof:
    """Return the proof under the assumptions, case by case if they have cases."""
    texts = [assume] if isinstance(assume, str) else list(assume)
    chosen = alternatives(texts)
    if len(chosen) == 1:
        return prove(chosen[0])
    cases = []
    for case in chosen:
        cases.append(prove(case))
        if not cases[-1]:
            break
    return CaseProof([text for text in texts if " or " in text], chosen, cases)


class CaseProof(Proof):
    """Several proofs of one statement, one for each case: true if each is.

    Attributes
    ----------
    cases : the proofs, up to the first that was not found
    """

    def __init__(self, split: Sequence[str], chosen: Sequence[Sequence[str]], cases: Sequence[Proof]):
        self.__dict__ |= copy.copy(cases[-1]).__dict__
        self._split, self._chosen, self.cases = list(split), [list(c) for c in chosen], list(cases)
        self.steps = [step for case in cases for step in case.steps]
        self.rests_on = list(dict.fromkeys(e for case in cases for e in case.rests_on))
        self.presupposes = list(dict.fromkeys(x for case in cases for x in case.presupposes))
        self.unmet = []
        self._found = len(cases) == len(chosen) and all(cases) and all(map(self._keeps_to_its_case, range(len(cases))))

    def _keeps_to_its_case(self, i: int) -> bool:
        """Return True if a case was proved without the hypothesis of another case, and uses no inverse that does not exist in it."""
        case, own = self.cases[i], self._chosen[i]
        others = {name for j, c in enumerate(self._chosen) if j != i for name in c} - {*own}
        return not others & {*case.hypotheses} and not case.void_where([name for name in HYPOTHESES if name in {*own, *case.hypotheses}])

    def recheck(self) -> bool:
        return self._found and all(case.recheck() for case in self.cases)

    @property
    def hypotheses(self) -> list[str]:
        """Hypotheses: that one of the cases holds, and the other hypotheses of the proofs."""
        own = {name for chosen in self._chosen for name in chosen}
        used = dict.fromkeys(h for case in self.cases for h in case.hypotheses if h not in own)
        return [*(name for name in HYPOTHESES if name in used), *(n for n in used if n not in HYPOTHESES), *self._split]

    def __str__(self) -> str:
        if not self:
            failed = next((i for i, case in enumerate(self.cases) if not case or not self._keeps_to_its_case(i)), 0)
            return f"{self.statement}\n  no proof found where {' and '.join(self._chosen[failed])}\n{self.cases[failed]}"
        return "\n\n".join([f"{self.statement}\n  proved in {len(self.cases)} cases: {'; '.join(self._split)}", *map(str, self.cases)])

    def _repr_html_(self) -> str:
        return "".join(f"<p><b>Where {' and '.join(c)}</b></p>{page(case)}" for c, case in zip(self._chosen, self.cases, strict=False))

    def latex(self) -> str:
        return " \\\\ ".join(case.latex() for case in self.cases)

    def verify(self, model: Any = None, seed: int = 0) -> float:
        """Verify each case on the model, or on an example that meets it: see `Proof.verify`."""
        return max(case.verify(model, seed) for case in self.cases)
