"""Logged motion and forces: arrays, runs and tables, as checked arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import _core
from ..arguments import listed
from ..state import at_state, names_of_q


def logged_motion(model: Any, q: Any, v: Any, vdot: Any, tau: Any) -> tuple[np.ndarray, ...]:
    """Return q, v, v̇, T as (K, n), finite."""
    if hasattr(q, "forces") and hasattr(q, "vdot"):
        q, v, vdot, tau = q.q, q.v, q.vdot, sum(_of_effects(q.forces, tau))
    elif hasattr(q, "columns"):
        q, v, vdot, tau = _of_table(model, q, tau)
    else:
        q, v = at_state(model, q, v)
    arrays = []
    for name, given, width in (("q", q, model.nq), ("v", v, model.nv), ("vdot", vdot, model.nv), ("tau", tau, model.nv)):
        if given is None:
            raise _core.ModelError(f"identify: {name} of {model.name!r} is missing; a log has q, v, vdot and tau")
        x = np.atleast_2d(_core.real_array(given, name)).astype(float)
        if x.ndim != 2 or x.shape[1] != width:
            raise _core.ModelError(f"identify: {name} of {model.name!r} has the shape {np.shape(given)}; it takes (K, {width})")
        bad = np.argwhere(~np.isfinite(x))
        if len(bad):
            row, column = bad[0]
            of = (names_of_q(model) if name == "q" else model.coordinate_names)[column]
            raise _core.ModelError(
                f"identify: row {row} of {name} is {x[row, column]} at {of!r}; leave such rows out ({len(set(bad[:, 0]))} of {len(x)})"
            )
        arrays.append(x)
    counts = {len(x) for x in arrays}
    if len(counts) > 1:
        raise _core.ModelError(
            f"identify: q, v, vdot and tau have {', '.join(str(len(x)) for x in arrays)} rows; give one of each per state"
        )
    return tuple(arrays)


def _of_effects(forces: Any, names: Any) -> list[np.ndarray]:
    if names is None:
        raise _core.ModelError(f"identify: for a run, tau= names the effects with measured forces, among {', '.join(forces)}")
    wanted = [names] if isinstance(names, str) else listed(names, "tau")
    for name in wanted:
        if name not in forces:
            raise _core.ModelError(f"identify: the run has no effect {name!r}; there are {', '.join(forces)}")
    return [np.asarray(forces[name]) for name in wanted]


def _of_table(model: Any, table: Any, names: Any) -> tuple[np.ndarray, ...]:
    """Return columns by coordinate, in any order of the table."""
    columns = [str(name) for name in table.columns]

    def by_name(start: str, of: Sequence[str] = model.coordinate_names) -> np.ndarray:
        wanted = [f"{start}.{name}" for name in of]
        if missing := [name for name in wanted if name not in columns]:
            raise _core.ModelError(f"identify: the table has no column {missing[0]!r}")
        return np.column_stack([_core.real_array(table[name], name) for name in wanted]) if wanted else np.zeros((len(table), 0))

    starts = ["tau"] if names is None else [f"force.{name}" for name in ([names] if isinstance(names, str) else listed(names, "tau"))]
    return by_name("q", names_of_q(model)), by_name("v"), by_name("vdot"), sum(map(by_name, starts), np.zeros(()))
