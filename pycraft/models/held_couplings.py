"""Couplings with some locked hinges: they constrain the others, with the locked coordinates constant (docs/locking.md).

In constant + Σ P_i(q_i) the terms of locked coordinates are added to the constant; a function is called with their values.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import _core


class PartlyHeld:
    """The function of a coupling of n coordinates with some of them held, of the others alone; it pickles if the function does."""

    def __init__(self, function: Any, count: int, held: Mapping[int, float]):
        self._function, self._count, self._held = function, count, dict(held)
        self._free = [i for i in range(count) if i not in self._held]

    def __call__(self, q: np.ndarray) -> tuple[Any, ...]:
        whole = np.empty(self._count)
        whole[list(self._held)], whole[self._free] = list(self._held.values()), q
        r, *derivatives = self._function(whole)
        cut = [np.asarray(one, float) for one in derivatives]
        return (r, *(one[np.ix_(*[self._free] * one.ndim)] if one.ndim and set(one.shape) == {self._count} else one for one in cut))


def with_held(declared: Mapping[str, Any], held: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Return a coupling as it is declared with the coordinates of these hinges, by name, locked at these values.

    "whole" holds its earlier form, and "held" the locked hinges. ModelError if none of its coordinates is left, or none that it can
    constrain.
    """
    whole = dict(declared.get("whole", declared))
    held = {hinge: q for hinge, q in held.items() if any(hinge == own for own, *_ in whole["terms"])}
    if not held:
        return whole
    fixed = {i: float(held[hinge][j]) for i, (hinge, j, _) in enumerate(whole["terms"]) if hinge in held}
    terms = [term for i, term in enumerate(whole["terms"]) if i not in fixed]
    function, constant = whole["function"], whole["constant"]
    if function is None:
        constant += sum(float(np.polynomial.polynomial.polyval(q, whole["terms"][i][2])) for i, q in fixed.items())
    else:
        function = PartlyHeld(function, len(whole["terms"]), fixed)
    if not terms or function is None and not any(np.any(np.asarray(own)[1:]) for *_, own in terms):
        names = ", ".join(map(repr, dict.fromkeys(hinge for hinge, *_ in whole["terms"])))
        raise _core.ModelError(
            f"coupling {whole['name']!r} would have no free coordinate left, of {names}: lock fewer of them, or remove it first"
        )
    held_now = {hinge: np.array(q, float) for hinge, q in held.items()}
    return whole | {"terms": terms, "constant": constant, "function": function, "whole": whole, "held": held_now}
