"""Number of states of a prepared call."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from .. import _core
from ..arguments import LARGEST


def states_of(batch: Any) -> int | None:
    """Return the number of states of each call, None for one. EvaluationError for an invalid number."""
    if batch is None:
        return None
    states = -1
    if not isinstance(batch, (bool, np.bool_)):
        with suppress(TypeError):
            states = operator.index(batch)
    if not 0 <= states <= LARGEST:
        raise _core.EvaluationError(f"batch={batch!r}: the number of states in each call, up to {LARGEST}, or None for one state")
    return states


def refuse_other_states(call: str, batch: int | None, given: Sequence[Any]) -> None:
    """Raise ModelError for arguments with a different number of states than the call was prepared for."""
    states = {np.shape(x)[0] for x in given if np.ndim(x) == 2}
    if states != (set() if batch is None else {batch}):
        asked, found = ("one state" if n is None else f"{n} states" for n in (batch, min(states, default=None)))
        raise _core.ModelError(f"{call} was prepared for {asked} but got {found}")
