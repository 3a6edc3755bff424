"""Linearization of scenes near states and along runs, including their effects."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import of_state, one_number
from ..dynamics.linear_on_loops import chosen_numbers, independent_numbers, linear_model_on_loops
from ..dynamics.linearization import linear_model, listed
from ..dynamics.loop_tangents import TreeDerivatives, kept_rows
from ..linear.linear_model import LinearModel, names_of_states, stacked
from ..state import at_state, moment_of


def linearize(
    scene: Any, q: Any, v: Any, t: Any, *, states: Any, inputs: Any, outputs: Any, dt: float | None, method: str, independent: Any
) -> LinearModel:
    """`Scene.linearize`."""
    model, calls = scene.model, scene._calls()
    t, states = moment_of(q, t, states)
    q, v = at_state(model, q, v)
    q = np.asarray(getattr(q, "q", q), float)
    v = np.zeros(model.nv) if v is None else np.asarray(getattr(v, "v", v), float)
    chosen = list(range(model.nv)) if inputs is None else _core.coordinates_named(model, listed(inputs, "inputs"), "inputs")
    names = tuple(f"tau.{model.coordinate_names[j]}" for j in chosen)
    if independent is not None and not scene._keeps_loops():
        raise _core.ModelError("independent: coordinates of a tree are all independent; with effects.Loop() a scene keeps loops")
    numbers = independent_numbers(model, independent)
    if q.ndim == v.ndim == 1:
        made = _at(scene, calls, q, v, one_number(t, "t"), () if states is None else states, chosen, names, outputs, numbers)
    else:
        made = _along(scene, calls, q, v, t, states, chosen, names, outputs, numbers)
    return made if dt is None else made.discrete(dt, method)


def _along(
    scene: Any, calls: Any, q: np.ndarray, v: np.ndarray, t: Any, states: Any, chosen: list[int], names: tuple[str, ...], outputs: Any,
    independent: list[int] | None,
) -> LinearModel:  # fmt: skip
    count = len(q) if q.ndim == 2 else len(v)
    times, own = (
        _core.real_array(t, "t"),
        np.zeros((count, 0)) if states is None else np.atleast_1d(_core.real_array(states, "states")),
    )
    for name, x, axes in (("q", q, 2), ("v", v, 2), ("t", times, 1), ("states", own, 2)):
        if x.ndim > axes or (x.ndim == axes and len(x) != count):
            raise _core.ModelError(f"{name} of {scene.model.name!r} has the shape {x.shape}; give {count} states, or one for all")
    q, v, own = (np.broadcast_to(x, (count, x.shape[-1])) for x in (q, v, own))
    times = np.broadcast_to(times, (count,))
    if not count:  # a batch of none: use the sizes of one
        q0 = scene.model.zero_q()
        q0 = scene.model.assemble(q0).q if scene._keeps_loops() else q0
        one = _at(scene, calls, q0, np.zeros(scene.model.nv), 0.0, np.zeros(own.shape[-1]), chosen, names, outputs, independent)
        return stacked([one], 0)
    each: list[LinearModel] = []
    for b in range(count):
        with of_state(b, count):
            each.append(_at(scene, calls, q[b], v[b], float(times[b]), own[b], chosen, names, outputs, independent))
        independent = independent or (chosen_numbers(each[0]) if each[0].tangent is not None else None)
    return stacked(each)


def _at(
    scene: Any, calls: Any, q: np.ndarray, v: np.ndarray, t: float, states: Any, chosen: list[int], names: tuple[str, ...], outputs: Any,
    independent: list[int] | None,
) -> LinearModel:  # fmt: skip
    model, states = scene.model, np.atleast_1d(_core.real_array(states, "states")) if np.size(states) else np.zeros(0)
    if not np.isfinite(states).all():
        raise _core.ModelError(f"states: entry {int(np.flatnonzero(~np.isfinite(states))[0])} is {states[~np.isfinite(states)][0]}")
    found = _core.scene_linearized(calls, q, v, t, states.ravel().tolist())
    nv, own = model.nv, len(found["rates"]) - model.nv
    known = known_coordinates(found)
    given = np.zeros((nv + own, len(chosen)))
    for column, j in enumerate(chosen):
        given[j, column] = 0.0 if j in known else 1.0
    if scene._keeps_loops():
        given[:nv] = np.eye(nv)[:, chosen]  # prescribed coordinates absorb forces on them
        mass, along_q, along_rest = found["mass"], found["along_q"], found["along_rest"]
        tree = TreeDerivatives(mass, along_q, along_rest, given, found["v"], found["rates"], found["forces"])
        return linear_model_on_loops(kept_rows(model, found["q"], scene._kept_loops(), known), tree, names, outputs, independent, t)
    along_q, along_rest, along_inputs = np.split(solved(found, given), [nv, 2 * nv + own], axis=1)
    states_named = names_of_states(model.coordinate_names, own)
    at_q, at_v = found["q"], found["v"]
    return linear_model(model, at_q, at_v, found["rates"], along_q, along_rest, along_inputs, names, outputs, states_named, t, known)


def known_coordinates(found: dict[str, Any]) -> list[int]:
    """Return the prescribed coordinates, from `_core.scene_linearized`."""
    return [j for j, held in enumerate(found["known"]) if held]


def solved(found: dict[str, Any], given: np.ndarray) -> np.ndarray:
    """Return derivatives of (v̇, ẏ) along displacements, (v, y), and generalized forces `given`, as columns."""
    sides = np.hstack([found["along_q"], found["along_rest"], given])
    slopes = np.linalg.solve(found["mass"], sides) if len(sides) else sides
    slopes[known_coordinates(found)] = 0.0
    return slopes
