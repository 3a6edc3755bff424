"""States off the loops that a scene keeps."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..models.warning import warn
from .effects.effect import Effect
from .effects.loops import Loop

FAR, SLOW = 1e-6, 1e-3
"""Residual, relative to the size of a row, beyond which a state is off the loops, as for initial states; also of rates, relative to the
largest velocity or SLOW."""


def warn_off_the_loops(model: Any, effects: Iterable[Effect], q: np.ndarray, v: np.ndarray | None) -> None:
    """Warn (ModelWarning) of the row of kept loops that a state violates most, by its residual or, at velocities v, by its rate.

    Loops with Baumgarte gains or springs cause no warning: they are meant for states off the loops.

    Accelerations at such a state keep the violation, so they belong to an open mechanism. Cost: evaluation of the rows.
    """
    keeping = [effect for effect in effects if isinstance(effect, Loop) and effect.keeps and not (effect.alpha or effect.beta)]
    if not keeping:
        return
    loops, kept = model.loops, [name for effect in keeping for name in effect.kept(model)]
    size = len(loops.rows)
    rows = [row for name in kept for row in range(size)[loops[name].slice]]
    sizes = loops.sizes(q)
    found = [(loops.residual(q), 1.0, "is off")]
    if v is not None:
        found.append((loops.rates(q, v), max(np.abs(v).max(initial=0.0), SLOW), "moves off"))
    for off, fastest, how in found if rows else []:
        by_size = np.abs(off[rows]) / (fastest * sizes[rows])
        worst = rows[int(np.argmax(by_size))]
        if by_size.max() > FAR:
            warn(
                f"the state {how} row {loops.rows[worst]!r} of {model.name!r} by {abs(off[worst]):.3g}: accelerations do not correct that; "
                "model.assemble(q, v) returns a state on the loops"
            )
            return
