"""Linear models of motion on the loops (docs/loops.md): the tree's model on the tangent space of states that keep every row."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import of_state
from ..linear.linear_model import LinearModel, names_of_states, stacked
from .linearization import linear_model, listed
from .loop_tangents import KeptRows, TreeDerivatives, kept_rows, on_loops

FAR, STOPPED = 1e-6, 1e-13
"""Bound for a state on the loops, as in mobility; rad/s, m/s: slower velocities are rounding of velocities that stopped."""


def independent_numbers(model: Any, names: Any) -> list[int] | None:
    """Return the numbers of coordinates, in the order of these names; None if they are to be chosen (no names, None or an empty list)."""
    if names is None:
        return None
    found = [j for name in listed(names, "independent") for j in _core.coordinates_named(model, [name], "independent")]
    if len(set(found)) < len(found):
        raise _core.ModelError(f"independent: {[model.coordinate_names[j] for j in found]} has a coordinate twice")
    return found or None


def linear_model_on_loops(
    rows: KeptRows, tree: TreeDerivatives, inputs: tuple[str, ...], outputs: Any, independent: list[int] | None, t: float = 0.0
) -> LinearModel:
    """Return the model in independent coordinates of displacements and velocities, and other states; `tangent` maps them to the tree's."""
    model, nv, k = rows.model, rows.model.nv, len(tree.rates)
    tangents, (along_q, along_rest, along_inputs) = on_loops(rows, tree, independent)
    i, j, own = tangents.displacements, tangents.velocities, list(range(nv, k))
    wide_q, wide_rest = np.zeros((k, nv)), np.zeros((k, k))
    wide_q[:, i], wide_rest[:, [*j, *own]] = along_q, along_rest
    states = names_of_states(model.coordinate_names, len(own))
    whole = linear_model(model, rows.q, tree.v, tree.rates, wide_q, wide_rest, along_inputs, inputs, outputs, states, t)
    kept = [*i, *(nv + one for one in j), *(nv + one for one in own)]
    T = np.zeros((nv + k, len(kept)))
    T[:nv, : len(i)], T[nv : 2 * nv, : len(i)] = tangents.X, tangents.Y
    T[nv : 2 * nv, len(i) : len(i) + len(j)], T[2 * nv :, len(i) + len(j) :] = tangents.Z, np.eye(len(own))
    names = tuple(states[one] for one in kept)
    C, D, shown = (np.eye(len(kept)), whole.D[kept], names) if outputs is None else (whole.C @ T, whole.D, whole.outputs)
    units = {name: whole.units[name] for name in names}
    A, B, rate = whole.A[kept] @ T + 0.0, whole.B[kept] + 0.0, whole.rate[kept]
    return LinearModel(A, B, C + 0.0, D, rate, names, inputs, shown, units, model, rows.q, tree.v, t, tangent=T)


def chosen_numbers(of: LinearModel) -> list[int]:
    """Return the independent coordinates of its displacements, those of velocities first."""
    numbers = {name: j for j, name in enumerate(of.model.coordinate_names)}
    found = {part: [numbers[name[2:]] for name in of.states if name.startswith(part)] for part in ("q.", "v.")}
    return [*found["v."], *(j for j in found["q."] if j not in found["v."])]


def linearize_on_loops(
    model: Any, q: Any, v: Any, tau: Any, chosen: list[int], names: tuple[str, ...], outputs: Any, independent: Any, how: dict[str, Any]
) -> LinearModel:
    """`Multibody.linearize` with loops=True."""
    q, v, tau = (np.asarray(_core.real_array(x, name), float) for name, x in (("q", q), ("v", v), ("tau", tau)))
    numbers = independent_numbers(model, independent)
    batch = np.broadcast_shapes(q.shape[:-1], v.shape[:-1], tau.shape[:-1])
    if not batch:
        return _at(model, q, v, tau, chosen, names, outputs, numbers, how)
    if not batch[0]:
        raise _core.ModelError("a linear model of no states: q has no rows")
    given = [np.broadcast_to(x, (*batch, x.shape[-1])) for x in (q, v, tau)]
    each: list[LinearModel] = []
    for b, (one_q, one_v, one_tau) in enumerate(zip(*given, strict=True)):
        with of_state(b, batch[0]):
            each.append(_at(model, one_q, one_v, one_tau, chosen, names, outputs, numbers, how))
        numbers = numbers or chosen_numbers(each[0])
    return stacked(each)


def _at(
    model: Any, q: np.ndarray, v: np.ndarray, tau: np.ndarray, chosen: list[int], names: tuple[str, ...], outputs: Any,
    independent: list[int] | None, how: dict[str, Any],
) -> LinearModel:  # fmt: skip
    _check_on_loops(model, q, v)
    motion = model.constrained_dynamics(q, v, tau, **how)
    along_q, along_v, mass = model.inverse_dynamics_derivatives(q, v, motion.vdot)
    forces = model.loops.jacobian(q).T @ motion.multipliers
    tree = TreeDerivatives(mass, -along_q, -along_v, np.eye(model.nv)[:, chosen], v, motion.vdot, forces)
    return linear_model_on_loops(kept_rows(model, q, model.loops), tree, names, outputs, independent)


def _check_on_loops(model: Any, q: np.ndarray, v: np.ndarray) -> None:
    """Raise ModelError for a state that is off the loops, or moves off them, with the row."""
    rows, sizes = model.loops.rows, model.loops.sizes(q)
    fastest = max(np.abs(v).max(initial=0.0), STOPPED / FAR)
    for what, off in (
        ("is off", np.abs(model.loops.residual(q)) / sizes),
        ("moves off", np.abs(model.loops.rates(q, v)) / (fastest * sizes)),
    ):
        worst = int(off.argmax()) if len(rows) else None
        if worst is not None and not off[worst] <= FAR:
            raise _core.ModelError(
                f"{model.name!r}: the state given {what} row {rows[worst]!r} by {off[worst]:.3g}; model.assemble(q, v) finds another"
            )
