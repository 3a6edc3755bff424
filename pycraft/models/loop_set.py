"""Loops of a model and their rows: closures of chains, rolling, or couplings of coordinates (docs/loops.md)."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from .. import _core
from ..arguments import listed, name_of, one_number, pose_parts, several, text
from ..closed import Closed
from ..dynamics.by_realization import checked_forces
from ..dynamics.loop_tangents import RANK
from ..state import at_state
from .coordinates import coordinate_numbers
from .curves import Curve, checked, curve_of, with_normals
from .handles import Body, Node
from .held_couplings import with_held
from .hinge_axes import hinge_axes

Relation = Callable[[np.ndarray], Any]
"""A function of coordinates (n,): (r, its gradient (n,), its second derivatives (n, n)), and optionally third ones (n, n, n)."""


class Loop(Closed):
    """A loop of a model, by its name: `.kind`, `.rows`, and its own rows of `residual`, `jacobian` and `bias`.

    Arguments and costs are the same as for the calls on all loops, `Loops`; these are slices of them.

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.chain(3)
    >>> arm.add_loop("body2", hinge="ball", position=(1.5, 0, 0))
    <loop 'base to body2': ball, 3 rows>
    >>> arm.loops["base to body2"].residual([0, 0, 0]).tolist()
    [0.5, 0.0, 0.0]
    """

    def __init__(self, loops: Loops, name: str):
        self._loops, self._name = loops, name

    @property
    def name(self) -> str:
        """The loop's name in its model."""
        return self._name

    @property
    def kind(self) -> str:
        """The kind of its hinge ("pin", ...; "ball" also for a gimbal, "custom" for one with oblique axes), or "blade", "wheel", "rolling
        ball", "surface", "curve", "coupling"."""
        return self._loops._core.kind(self._name)

    @property
    def slice(self) -> slice:
        """The place of its rows among those of all loops."""
        place, first = self._loops._place(self._name)
        return slice(first[place], first[place + 1])

    @property
    def rows(self) -> list[str]:
        """Names of its rows: "loop: direction"."""
        return self._loops.rows[self.slice]

    def residual(self, q=None, *, precision: str = "double") -> np.ndarray:
        """Return r (rows,) or (B, rows): see `Loops.residual`."""
        return self._loops.residual(q, precision=precision)[..., self.slice]

    def jacobian(self, q=None, *, precision: str = "double") -> np.ndarray:
        """Return Q (rows, nv) or (B, rows, nv): see `Loops.jacobian`."""
        return self._loops.jacobian(q, precision=precision)[..., self.slice, :]

    def bias(self, q=None, v=None, *, precision: str = "double") -> np.ndarray:
        """Return Q̇θ̇ (rows,) or (B, rows): see `Loops.bias`."""
        return self._loops.bias(q, v, precision=precision)[..., self.slice]

    def remove(self) -> None:
        """Remove the loop from its model."""
        self._loops.remove(self._name)

    def __repr__(self) -> str:
        try:
            rows = len(self.rows)
        except _core.ModelError:
            return f"<loop {self._name!r}: missing, or without the bodies that it was declared on>"
        return f"<loop {self._name!r}: {self.kind}, {rows} row{'' if rows == 1 else 's'}>"


class Loops(Closed, Mapping):
    """The loops of a model by name, in order of declaration, and the rows of all of them.

    A row of positions has a residual r(q), zero where it is kept; with θ̇ the model's v, it requires Q θ̇ = 0 and Q θ̈ + Q̇θ̇ = 0. A row of
    velocities (rolling, blades) requires only the last two. Q is the exact derivative of r, also where the loops are open.

    The calls take q and v as direct calls do: one state, a batch (B, ...), a `State`, or by default the model's present state; and
    precision "single" to "quad". Cost: the hinges around the loops, per state. ModelError for a loop that has lost a body, node or hinge:
    it names the loop.

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.chain(3)
    >>> loop = arm.add_loop("body2", hinge="pin", position=(1, 0, 0), name="close")
    >>> arm.loops.rows
    ['close: about x', 'close: about y', 'close: along x', 'close: along y', 'close: along z']
    >>> arm.loops["close"].residual([0, 0, 0])[2:].tolist()
    [1.0, 0.0, 0.0]
    """

    def __init__(self, model: Any):
        self._model, self._core = model, _core.LoopSet(model)
        self._declared: dict[str, dict[str, Any]] = {}
        self._numbered: tuple[int, dict[str, int], list[int]] | None = None

    def __reduce__(self):
        return attrgetter("loops"), (self._model,)  # a model brings its loops

    # ------------------------------------------------------------------ rows
    @property
    def rows(self) -> list[str]:
        """Names of all rows: "loop: direction", for couplings the name alone. x, y, z are axes of the hinge, z along its own axis."""
        return self._core.rows()[0]

    def numbered(self) -> tuple[Mapping[str, int], Sequence[int]]:
        """Return the loops' numbers by name, and the first row of each, and the end. Cached until a loop is added or removed."""
        edits = self._core.edits
        if self._numbered is None or self._numbered[0] != edits:
            self._numbered = edits, {name: i for i, name in enumerate(self._core.names())}, self._core.first_rows()
        return self._numbered[1:]

    @property
    def of_positions(self) -> np.ndarray:
        """Mask (rows,) of rows of positions, as opposed to rows of velocities."""
        return np.array(self._core.rows()[1], dtype=bool)

    @property
    def ends(self) -> list[str]:
        """Bodies and nodes on which loops of two ends were declared, each once, without the base: the nodes of `soa.A`."""
        return self._core.ends(self._core.operators(self._model.soa._source))

    def residual(self, q=None, *, precision: str = "double") -> np.ndarray:
        """Return r (rows,) or (B, rows), zero where the loops are closed, and for rows of velocities; metres, and radians to first
        order."""
        return self._core.residual(at_state(self._model, q)[0], precision)

    def sizes(self, q=None, *, precision: str = "double") -> np.ndarray:
        """Return the scale of each row, (rows,) or (B, rows): the largest of its entries in Q, of lengths before cancellation.

        Metres and radians per unit of the coordinate that moves it most; one if none does. A residual r corresponds to r/size of that
        coordinate, in a watch as in a crane. Cost: the rows' entries; Q is not formed.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> gear = arm.add_coupling({"hinge0": 1.0, "hinge1": -3.0}, name="gear")
        >>> arm.loops.sizes([0.5, 0.25]).tolist()
        [3.0]
        """
        sizes = self._core.sizes(at_state(self._model, q)[0], precision)
        return np.where(sizes > 0, sizes, 1.0)

    def jacobian(self, q=None, *, precision: str = "double") -> np.ndarray:
        """Return Q (rows, nv) or (B, rows, nv): ṙ = Q θ̇, zero for rows of velocities. Exact zeros for hinges around no loop.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> gear = arm.add_coupling({"hinge0": 1.0, "hinge1": -3.0}, name="gear")
        >>> arm.loops.jacobian([0.5, 0.25]).tolist(), arm.loops.residual([0.5, 0.25]).tolist()
        ([[1.0, -3.0]], [-0.25])
        """
        return self._core.jacobian(at_state(self._model, q)[0], precision)

    def rates(self, q=None, v=None, *, precision: str = "double") -> np.ndarray:
        """Return Qθ̇ (rows,) or (B, rows): ṙ, or the rates of rows of velocities. Cost: the rows' entries; Q is not formed.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> gear = arm.add_coupling({"hinge0": 1.0, "hinge1": -3.0}, name="gear")
        >>> arm.loops.rates([0.5, 0.25], [3.0, 1.5]).tolist()
        [-1.5]
        """
        return self._core.rates(*at_state(self._model, q, v), precision)

    def bias(self, q=None, v=None, *, precision: str = "double") -> np.ndarray:
        """Return Q̇θ̇ (rows,) or (B, rows): the rows' second derivatives at θ̈ = 0."""
        return self._core.bias(*at_state(self._model, q, v), precision)

    def acceleration(self, q=None, v=None, vdot=None, *, fix: Any = ()) -> np.ndarray:
        """Return v̇ (nv,) or (B, nv) that keeps the rows, Q v̇ + Q̇v = 0, the nearest to `vdot`: v̇ = vdot - Q⁺(Q vdot + Q̇v).

        Parameters
        ----------
        q, v, vdot : a state on the loops, and accelerations to start from; default: v and vdot zero
        fix : names of hinges or coordinates, or a list of them, with fixed accelerations

        EvaluationError if no accelerations of the others keep a row, by its name, for instance if v leaves the loops at a singular state or
        too many are fixed. Cost: dense factors of Q.

        Examples
        --------
        >>> import pycraft as pc
        >>> bars = pc.chain(3)
        >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
        >>> bars.loops.acceleration([1, -1, 1 - np.pi], [0, 0, 0], [2.0, 0, 0], fix="hinge0").round(9).tolist()
        [2.0, -2.0, 2.0]
        """
        fix, (q, v) = several(fix), at_state(self._model, q, v)
        start = np.zeros(self._model.nv) if vdot is None else checked_forces(self._model, vdot, "vdot")
        Q, bias = self.jacobian(q), self.bias(q, v)
        batch = np.broadcast_shapes(bias.shape[:-1], start.shape[:-1])
        start = np.array(np.broadcast_to(start, (*batch, self._model.nv)))
        moving = np.ones(self._model.nv, bool)
        moving[coordinate_numbers(self._model, fix) or []] = False
        if not len(self.rows):
            return start
        off = np.einsum("...ij,...j->...i", Q, start) + bias
        start[..., moving] -= np.einsum("...ij,...j->...i", np.linalg.pinv(Q[..., moving], rcond=RANK), off)
        left = np.abs(np.einsum("...ij,...j->...i", Q, start) + bias)
        size = np.abs(bias) + self.sizes(q) * np.maximum(np.abs(start).max(axis=-1, initial=0.0), 1e-13)[..., None]
        if not (left <= 1e-8 * size).all():
            part = np.atleast_2d(left / size)
            b, worst = (int(i) for i in np.unravel_index(np.argmax(part), part.shape))
            which = f" (state {b} of a batch of {len(part)})" if len(part) > 1 else ""
            held = f" with {', '.join(repr(getattr(one, 'name', one)) for one in fix)} as given" if fix else ""
            raise _core.EvaluationError(
                f"no accelerations of {self._model.name!r} keep row {self.rows[worst]!r}{held}{which}; fix fewer, or take a state that is "
                "not singular (mobility(q))"
            )
        return start

    def coupled(self, name: str) -> list[int]:
        """Return the numbers of the coordinates of a coupling, in its order. KeyError if there is none of that name."""
        terms = self._declared[name].get("terms", ())
        return [self._model.hinges[hinge].v_slice.start + coordinate for hinge, coordinate, _ in terms]

    def ends_of(self, name: str) -> tuple[str, str]:
        """Return the bodies or nodes b and a that a loop joins: "" for the base, and twice for a coupling. KeyError for an unknown name."""
        declared = self._declared[name]
        return declared.get("b", ""), declared.get("a", "")

    # ------------------------------------------------------------------ edits
    def remove(self, name: str | Loop) -> None:
        """Remove a loop. ModelError if there is none of that name."""
        name = name.name if isinstance(name, Loop) else text(name, "a loop")
        self._core.remove(name)
        self._declared.pop(name)

    def add_hinge(self, b: Any, a: Any, hinge: str, given: Mapping[str, Any], name: str | None) -> Loop:
        """Close a chain by a hinge: see `Multibody.add_loop`."""
        hinge = text(hinge, "the kind of a hinge")
        declared = self._ends(a, b, name) | {"kind": hinge}
        what = f"loop {declared['name']!r}"
        axes = hinge_axes(what, hinge, given["axis"], given["axes"], given["point"], given["subhinges"])
        declared["axes"] = [_numbers(axis, f"axis of {what}") for axis in axes]
        rotation, position = pose_parts(what, given["rotation"], given["position"], given["placement"])
        parts = {"point": given["point"], "rotation": rotation, "position": position}
        declared |= {key: None if part is None else _numbers(part, f"{key} of {what}") for key, part in parts.items()}
        if given["subhinges"] is not None:
            declared["subhinges"] = [_subhinge(one, what) for one in listed(given["subhinges"], f"subhinges of {what}")]
        return self._declare(declared | {"pitch": one_number(given["pitch"], f"the pitch of {what}")})

    def add_pair(self, b: Any, a: Any, kind: str, radius: Any, name: str | None) -> Loop:
        """Add a rolling pair: see `Multibody.add_rolling`."""
        return self._declare(self._ends(a, b, name) | {"kind": kind, "radius": one_number(radius, "radius")})

    def add_surface(self, b: Any, a: Any, quadratic: Any, linear: Any, constant: Any, name: str | None) -> Loop:
        """Add a surface for a point: see `Multibody.add_surface`."""
        declared = self._ends(a, b, name) | {"kind": "surface"}
        what = f"of the surface of {declared['name']!r}"
        A = np.zeros((3, 3)) if quadratic is None else _numbers(quadratic, f"A {what}")
        slopes = np.zeros(3) if linear is None else _numbers(linear, f"b {what}")
        return self._declare(declared | {"quadratic": A, "linear": slopes, "constant": one_number(constant, f"c {what}")})

    def add_curve(self, b: Any, a: Any, curve: Any, parameters: Any, closed: Any, name: str | None, ends: Any = "not-a-knot") -> Loop:
        """Add a curve for a point: see `Multibody.add_curve`. A `Curve` is used as it is."""
        declared = self._ends(a, b, name) | {"kind": "curve"}
        what = f"loop {declared['name']!r}"
        found = checked(curve, what) if isinstance(curve, Curve) else curve_of(curve, parameters, closed, what, ends)
        return self._declare(declared | found._asdict())

    def add_coupling(self, coordinates: Any, constant: Any, function: Relation | None, name: str | None) -> Loop:
        """Add a relation of coordinates: see `Multibody.add_coupling`."""
        name = name_of(name, "a coupling", "coupling")
        if function is None and not isinstance(coordinates, Mapping):
            raise _core.ModelError(f"coupling {name!r}: coefficients by coordinate, {{'a': 1.0, 'b': -2.0}}, or coordinates and function=")
        if function is not None and (isinstance(coordinates, Mapping) or not callable(function)):
            raise _core.ModelError(f"coupling {name!r}: a list of coordinates beside a function that can be called, not {function!r}")
        by_coordinate = (
            coordinates.items() if isinstance(coordinates, Mapping) else [(one, 0.0) for one in listed(coordinates, "coordinates")]
        )
        terms, numbers = [], []
        for coordinate, given in by_coordinate:
            number = self._coordinate(coordinate, name)
            if number in numbers:
                raise _core.ModelError(f"coupling {name!r} names coordinate {self._model.coordinate_names[number]!r} twice; give it once")
            numbers.append(number)
            terms.append((*self._of_hinge(number), _coefficients(given, f"coefficients of {coordinate!r} in coupling {name!r}")))
        constant = one_number(constant, f"the constant of coupling {name!r}")
        return self._declare({"name": name, "kind": "coupling", "terms": terms, "constant": constant, "function": function})

    def _ends(self, a: Any, b: Any, name: str | None) -> dict[str, Any]:
        a, b = self._frame(a), self._frame(b)
        return {"name": name_of(name, "a loop", f"{a or 'base'} to {b or 'base'}"), "a": a, "b": b}

    def _declare(self, declared: Mapping[str, Any]) -> Loop:
        """Return the loop of plain data, as in `_description`."""
        name, kind = declared["name"], declared["kind"]
        if kind == "coupling":
            self._core.add_coupling(name, declared["terms"], declared["constant"], declared["function"])
        elif kind == "surface":
            surface = (declared["quadratic"], declared["linear"], declared["constant"])
            self._core.add_pair(name, declared["a"], declared["b"], kind, 0.0, surface)
        elif kind == "curve":
            curve = Curve(declared["parameters"], declared["coefficients"], declared["closed"])
            self._core.add_curve(name, declared["a"], declared["b"], with_normals(curve, f"loop {name!r}"), curve.closed)
        elif "radius" in declared:
            self._core.add_pair(name, declared["a"], declared["b"], kind, declared["radius"], None)
        else:
            shape: list[Any] = [declared.get(key) for key in ("axes", "point", "pitch", "subhinges", "rotation", "position")]
            self._core.add_hinge(name, declared["a"], declared["b"], kind, *shape)
        self._declared[name] = dict(declared)
        return Loop(self, name)

    # ------------------------------------------------------------------ as a mapping
    def __getitem__(self, name: str) -> Loop:
        if name not in self._declared:
            raise KeyError(f"{self._model.name!r} has no loop called {name!r}; there are {', '.join(map(repr, self._declared)) or 'none'}")
        return Loop(self, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._core.names())

    def __len__(self) -> int:
        return len(self._core.names())

    def _ipython_key_completions_(self) -> Sequence[str]:
        return list(self)

    def __repr__(self) -> str:
        return f"<loops of {self._model.name!r}: {', '.join(map(repr, self)) or 'none'}>"

    # ------------------------------------------------------------------ common parts
    def _place(self, name: str) -> tuple[int, Sequence[int]]:
        """Return a loop's number, and the first row of each."""
        places, first = self.numbered()
        try:
            return places[name], first
        except KeyError:
            raise _core.ModelError(f"{self._model.name!r} has no loop called {name!r} any more") from None

    def _frame(self, frame: Any) -> str:
        """Return the name of a body or node of this model, "" for the base."""
        if isinstance(frame, (Body, Node)):
            if frame._model is not self._model:
                raise _core.ModelError(f"frame {frame.name!r} belongs to another model, {frame._model.name!r}, not to {self._model.name!r}")
            return frame.name
        return name_of(frame, "an end of a loop", "")

    def _coordinate(self, coordinate: Any, name: str) -> int:
        found = coordinate_numbers(self._model, [coordinate]) or []
        if len(found) != 1:
            raise _core.ModelError(f"coupling {name!r}: hinge {coordinate!r} has {len(found)} coordinates; name one of them")
        return found[0]

    def _of_hinge(self, number: int) -> tuple[str, int]:
        """Return the hinge of a coordinate, and its number within the hinge."""
        model = self._model

        def first(body: int) -> int:
            return model._slices(body)[1].start

        body = bisect_right(range(model._size), number, key=first) - 1  # the last that begins there or before; welds have no coordinates
        return model._body(body)["hinge"]["name"], number - first(body)

    def _stands_on(self, name: str) -> set[str]:
        """Return the names on which a loop was declared: bodies, nodes and hinges, "" for the base."""
        declared = self._declared[name]
        declared = declared.get("whole", declared)
        return {hinge for hinge, _, _ in declared["terms"]} if "terms" in declared else {declared["a"], declared["b"]}

    def _held(self, locked: Mapping[str, np.ndarray]) -> dict[str, dict[str, Any]]:
        """Return new declarations of couplings that change if exactly these hinges are locked at these coordinates."""
        changed = {}
        for name, declared in self._declared.items():
            if "terms" in declared and ("whole" in declared or any(hinge in locked for hinge, *_ in declared["terms"])):
                changed[name] = with_held(declared, locked)
        return changed

    def _declare_anew(self, changed: Mapping[str, Mapping[str, Any]]) -> None:
        """Declare these anew, with all loops in their present order."""
        if changed:
            before = self._description()
            for loop in before:
                self.remove(loop["name"])
            for loop in before:
                self._declare(changed.get(loop["name"], loop))

    def _turned(self, hinges: Mapping[str, int]) -> None:
        """Adapt couplings to hinges with reversed coordinates, given with their counts; the order of loops stays."""
        before = self._description()
        if not any(hinges.get(hinge, 1) > 1 for loop in before for hinge, *_ in loop.get("terms", ())):
            return
        for loop in before:
            self.remove(loop["name"])
        for loop in before:
            terms = [(hinge, hinges[hinge] - 1 - j if hinge in hinges else j, given) for hinge, j, given in loop.get("terms", ())]
            self._declare(loop | ({"terms": terms} if terms else {}))

    def _description(self) -> list[dict[str, Any]]:
        """Return the loops as plain data (functions of couplings as they are), in order."""
        return [dict(self._declared[name]) for name in self]


def _numbers(given: Any, what: str) -> np.ndarray:
    return np.array(_core.real_array(given, what))


def _subhinge(given: Any, what: str) -> Any:
    """Return a copy of a subhinge's data, lists as tuples; the core reports faults."""
    if not isinstance(given, Mapping):
        return given
    return {
        key: tuple(_numbers(part, f"{key} of a subhinge of {what}")) if key in ("axis", "point") else part for key, part in given.items()
    }


def _coefficients(given: Any, what: str) -> list[float]:
    """Return the coefficients of 1, q, q², ...; a scalar is the coefficient of q."""
    numbers = _core.real_array(given, what)
    if numbers.ndim > 1:
        raise _core.ModelError(f"{what}: one number, or those of 1, q, q², ..., not an array {numbers.shape}")
    return [0.0, float(numbers)] if numbers.ndim == 0 else [float(c) for c in numbers]
