"""The operators of a model with embedded loops: their bodies, rows and coordinates, and the data for the core."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import listed
from ..operators.operator_set import OperatorSet
from ..state import State, at_state

_RANK = 1e-8  # relative to the longest row of Q, as in mobility

Set = tuple[list[int], list[int], list[int]]
"""For connected loops: bodies, rows, dependent coordinates, by number."""


class EmbeddedOperators(OperatorSet):
    """The operators of a tree whose nodes are the bodies around each loop and single bodies, on independent velocities θ̇_r.

    The letters are those of any tree, and ``X_r`` with θ̇ = X_r θ̇_r, block diagonal, Θ_r → Θ, and ``X_r_dot`` along θ̇. docs/loops.md.
    """

    def __init__(self, whole: OperatorSet, sets: list[Set]):
        model: Any = whole._model
        self._source: _core.EmbeddedOperators
        base: Any = whole._source
        super().__init__(_core._embedded(base, model.loops._core, sets), model)
        self._whole, self._sets = whole, sets

    def __reduce__(self):
        return EmbeddedOperators, (self._whole, self._sets)

    @property
    def independent(self) -> list[int]:
        """The numbers of the independent coordinates in the model, in the order of Θ_r: θ̇_r = v[independent]."""
        return list(self._source.independent)

    @property
    def sets(self) -> list[Set]:
        """For each group of connected loops: bodies, the solved rows, dependent coordinates, by number."""
        return [(list(bodies), list(rows), list(dependent)) for bodies, rows, dependent in self._sets]

    @property
    def unconstrained(self) -> OperatorSet:
        """The same groups of bodies without embedding: H = X_r* H_g on the same spaces V and F."""
        return OperatorSet(self._source.grouped, self._model)

    def state(self, q_r: Any, v_r: Any = None, near: Any = None) -> State:
        """Return the state on the loops with these independent coordinates, by Newton on the rows from a state nearby, and v = X_r v_r.

        There is no drift: the loops are kept to rounding, however long a motion is.

        Parameters
        ----------
        q_r : their entries of q, in the order of Θ_r; for a hinge with a quaternion all seven or four entries at its first coordinate
        v_r : (Θ_r,), default: zero
        near : a q or State from which the dependent coordinates are sought; default: the model's present state

        Raises
        ------
        ModelError
            No state is near, with the open loops; arrays of the wrong size; a hinge with a quaternion with only some of its coordinates
            independent.
        """
        model: Any = self._model
        places = self._places()
        q = np.array(at_state(model, near)[0], float)
        given = _core.real_array(q_r, "q_r")
        if given.shape != (len(places),):
            raise _core.ModelError(f"q_r of {self._source.name!r} takes {len(places)} numbers, not an array {given.shape}")
        q[places] = given
        q = model.assemble(q, fix=[model.coordinate_names[i] for i in self.independent], starts=1).q
        rates = np.zeros(len(self.independent)) if v_r is None else _core.real_array(v_r, "v_r")
        if rates.shape != (len(self.independent),) or not np.isfinite(rates).all():
            raise _core.ModelError(f"v_r of {self._source.name!r} takes {len(self.independent)} finite numbers, not {v_r!r}")
        return State(q, self.X_r.at(q).dense() @ rates)

    def _places(self) -> list[int]:
        """Return the places of the independent coordinates in q."""
        places: list[int] = []
        for i in self.independent:
            hinge = next(h for h in self._model.hinges.values() if h.v_slice.start <= i < h.v_slice.stop)
            first, last, at = hinge.v_slice.start, hinge.v_slice.stop, hinge.q_slice.start
            if hinge.q_slice.stop - at == last - first:
                places.append(at + i - first)
                continue
            if not set(range(first, last)) <= set(self.independent):
                raise _core.ModelError(
                    f"hinge {hinge.name!r} has a rotation of which single coordinates are independent: they do not determine it; "
                    "take all of them, independent=, or none"
                )
            if i == first:
                places.extend(range(at, hinge.q_slice.stop))
        return places

    def random_state(self, rng: Any) -> State:
        """Return a state on the loops near the present one, where these coordinates are independent."""
        model: Any = self._model
        X = self.X_r.at(model.q).dense()
        for width in (0.5, 0.2, 0.1, 0.01, 0.0):
            try:
                moved = model.integrate(model.q, width * (X @ rng.normal(size=X.shape[1])))
                state = model.assemble(moved, rng.normal(size=model.nv), starts=1)
                self.X_r.at(state).dense()
            except (_core.ModelError, _core.EvaluationError):
                continue
            return state
        return State(np.array(model.q), np.array(model.v))

    def __getattr__(self, name: str) -> Any:
        if name in ("X_r", "X_r_dot"):
            if name not in self._made:
                self._made[name] = self._source.symbol(name)
            return self._made[name]
        return super().__getattr__(name)


def source_again(model: Any, sets: list[Set]) -> _core.SkoSource:
    """Rebuild a source from its pickle."""
    return _core._embedded(model.soa._source, model.loops._core, sets)


def embedded(whole: OperatorSet, independent: Any, q: Any) -> EmbeddedOperators:
    """`OperatorSet.embedded`."""
    model: Any = whole._model
    if model is None or not isinstance(whole._source, _core.MultibodyOperators):
        raise _core.ModelError(f"loops of {whole._source.name!r} cannot be embedded: it is not a complete multibody model")
    q = _core.real_array(at_state(model, q)[0], "q")
    mobility = model.mobility(q)  # refuses states that are off the loops
    if mobility.singular:
        lost = ", ".join(map(repr, mobility.lost))
        raise _core.ModelError(
            f"loops of {model.name!r} are singular at this state, where {lost} depend on other rows, but not nearby: "
            "embed them at a state beside it, q="
        )
    wanted = _wanted(model, independent)
    Q = model.loops.jacobian(q)
    sets: list[Set] = []
    for bodies, rows in _bodies_around(model, Q):
        coordinates = [i for k in bodies for i in _coordinates(whole._source, k)]
        sets.append((bodies, *_solved(model, Q, rows, coordinates, wanted)))
    return EmbeddedOperators(whole, sets)


def _wanted(model: Any, independent: Any) -> list[int] | None:
    """Return the numbers of the coordinates that a user wants as independent."""
    if independent is None:
        return None
    found: list[int] = []
    for one in listed(independent, "independent: coordinates or hinges"):
        name = getattr(one, "name", one)
        if name in model.coordinate_names:
            found.append(model.coordinate_names.index(name))
        elif isinstance(name, str) and name in model.hinges:
            found.extend(range(model.hinges[name].v_slice.start, model.hinges[name].v_slice.stop))
        else:
            known = ", ".join(model.coordinate_names)
            raise _core.ModelError(f"independent: {one!r} is no coordinate or hinge of {model.name!r}; there are {known}")
    if len(set(found)) < len(found):
        raise _core.ModelError(f"independent: {[model.coordinate_names[i] for i in found]} has a coordinate twice")
    return found


def _coordinates(source: Any, k: int) -> range:
    first = sum(source.dof[:k])
    return range(first, first + source.dof[k])


def _bodies_around(model: Any, Q: np.ndarray) -> list[tuple[list[int], list[int]]]:
    """Return bodies and rows of connected loops: up to the nearest body that carries all, merging loops with a body in common."""
    source = model.soa._source
    parents = source.parents
    of_coordinate = [k for k, dof in enumerate(source.dof) for _ in range(dof)]
    generic = model.loops.jacobian(model.random_state().q) if model.nv else Q
    sets: list[tuple[set[int], list[int]]] = []
    for loop in model.loops.values():
        rows = list(range(loop.slice.start, loop.slice.stop))
        moving = ((Q[rows] != 0) | (generic[rows] != 0)).any(axis=0)
        bodies = {of_coordinate[i] for i in np.flatnonzero(moving)}
        if not bodies or not rows:
            continue
        merged, all_rows = _carried_by_one(bodies, parents), rows
        while met := next((one for one in sets if one[0] & merged), None):
            sets.remove(met)
            merged, all_rows = _carried_by_one(met[0] | merged, parents), [*met[1], *all_rows]
        sets.append((merged, all_rows))
    return [(sorted(bodies), sorted(rows)) for bodies, rows in sets]


def _carried_by_one(bodies: set[int], parents: list[int]) -> set[int]:
    """Return these bodies and those between them and the nearest common carrier, without the carrier."""

    def inboard(k: int) -> list[int]:
        way = []
        while k >= 0:
            k = parents[k]
            way.append(k)
        return way

    ways = [inboard(k) for k in bodies]
    common = next(p for p in ways[0] if all(p in way for way in ways))
    return bodies | {k for way in ways for k in way[: way.index(common)]}


def _solved(model: Any, Q: np.ndarray, rows: list[int], coordinates: list[int], wanted: list[int] | None) -> tuple[list[int], list[int]]:
    """Return the independent rows and the coordinates for which they are solved, by pivoted factorizations of Q and of its adjoint."""
    from scipy.linalg import qr  # SciPy takes a quarter of a second to import

    A = Q[np.ix_(rows, coordinates)]
    A = A / max(np.linalg.norm(A, axis=1).max(initial=0), np.finfo(float).tiny)
    rank = int((np.linalg.svd(A, compute_uv=False) > _RANK).sum()) if A.size else 0
    if rank == 0:
        return [], []
    names = model.coordinate_names
    places = list(range(len(coordinates)))
    if wanted is not None and any(i in wanted for i in coordinates):
        places = [j for j in places if coordinates[j] not in wanted]
    _, R, order = qr(A[:, places], mode="economic", pivoting=True)
    if len(places) != rank or abs(R[rank - 1, rank - 1]) <= _RANK:
        kept = {coordinates[j] for j in qr(A, mode="r", pivoting=True)[1][:rank]}
        good = [names[i] for i in coordinates if i not in kept]
        if wanted is not None and any(i in wanted for i in coordinates):
            given = [names[i] for i in coordinates if i in wanted]
            loops = ", ".join(sorted({repr(model.loops.rows[row].split(":")[0]) for row in rows}))
            raise _core.ModelError(
                f"independent: around {loops} are {len(coordinates) - rank} coordinate(s), and {given} do not determine the others at "
                f"this state; {good} do"
            )
    dependent = [coordinates[places[j]] for j in order[:rank]]
    at = [coordinates.index(i) for i in dependent]
    chosen = qr(A[:, at].T, mode="r", pivoting=True)[1][:rank]
    return sorted(rows[i] for i in chosen), sorted(dependent)
