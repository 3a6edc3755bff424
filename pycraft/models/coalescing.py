"""Coalesce rigidly joined bodies, split them again, and prune massless leaves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from typing import Any

import numpy as np

from .. import _core
from ..arguments import several, text
from .asides import Asides
from .grafting import Removed
from .handles import Body, Node
from .locking import Locking

Mass = tuple[float, np.ndarray, np.ndarray]
Pose = tuple[np.ndarray, np.ndarray]


class Coalescing(Locking):
    """Bodies that were coalesced with their carriers, and can be split again."""

    _bodies_before: Mapping[str, dict[str, Any]] = {}
    """For each coalesced body, in order of coalescing: "body" as it was; "carrier", empty for the base; "next", the body that followed it
    there; mass properties of the carrier "before" and "after"; "children" that it carried, each with its placement there and the present
    one; "nodes" that were on it, each with its pose there."""

    def coalesce(self, bodies: Any = None) -> list[str]:
        """Coalesce bodies on welds with their carriers; default: all of them.

        The carrier takes their mass properties; bodies and nodes that they carried stay where they were, and their names become nodes, as
        with welds of a file that is loaded with welds="lump". Mass matrix, motions, momentum and energy stay, to rounding; on the base the
        body's mass is no longer counted, which moves nothing (potential energy has another datum). Coordinates and their order stay.

        Parameters
        ----------
        bodies : names or handles of bodies, one or several

        Returns
        -------
        list of str : names of the bodies that are nodes now, in the model's order

        Raises
        ------
        ModelError
            An unknown body, a body on a hinge that moves (lock it first), a body in a chain that a loop closes to its future carrier, a
            part. The model is unchanged.

        Cost: O(N) once, as a few calls of forward dynamics; each evaluation then saves one body's step per coalesced body.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> arm = pc.chain(4)
        >>> arm.q = [0.1, 0.2, 0.3, 0.4]
        >>> stop = arm.lock("hinge2")
        >>> before = arm.mass_matrix()
        >>> arm.coalesce()
        ['body2']
        >>> list(arm.bodies), bool(np.allclose(arm.mass_matrix(), before))
        (['body0', 'body1', 'body3'], True)
        >>> arm.split("body2"), arm.unlock("hinge2"), arm.q.tolist()
        (['body2'], ['hinge2'], [0.1, 0.2, 0.3, 0.4])
        """
        if bodies is None:
            numbers = [k for k, size in enumerate(self._hinge_sizes()[1]) if not size]
        else:
            numbers = sorted({self._body_index(name) for name in _names(bodies, "a body")})
        self._require_open(numbers)
        return self._coalesced_now(numbers)

    def split(self, bodies: Any = None) -> list[str]:
        """Split coalesced bodies off; default: all of them. Each is a body on its weld again, and carries what it carried before.

        The order is free: obstacles, such as a carrier that is coalesced itself or a body that was carried by it and coalesced later, are
        split off and coalesced again. A locked hinge of the body can then be unlocked.

        If the carrier's mass properties were not set since, they and all placements are restored to the last bit. Else the body's own are
        subtracted from them; placements that were set move along.

        Parameters
        ----------
        bodies : names of bodies, or handles of their nodes, one or several

        Returns
        -------
        list of str : names of the bodies that are split off, the last coalesced first

        Raises
        ------
        ModelError
            A body that is not coalesced; a remainder that is not a possible body (a mass below zero, an inertia with a negative moment); a
            hinge with the name of the body's own that was added meanwhile; a part. The model is unchanged.

        Cost: as `coalesce`.
        """
        self._split([])  # a part refuses
        there = self.coalesced
        wanted = there if bodies is None else list(dict.fromkeys(_names(bodies, "a body")))
        for name in wanted:
            if name not in self._bodies_before:
                raise _core.ModelError(f"body {name!r} of {self.name!r} is not coalesced; coalesced are {', '.join(there[:12]) or 'none'}")
        opened = self._in_the_way(wanted)
        records, left = self._plan_of(opened)
        aside = Asides(self)
        self._split(records)
        aside.put(self)
        self._bodies_before = left
        again = [name for name in reversed(opened) if name not in set(wanted)]
        self._coalesced_now(sorted(self._body_index(name) for name in again))
        return [name for name in opened if name in set(wanted)]

    def prune(self) -> list[str]:
        """Make massless leaves nodes of their carriers, repeatedly until there are none.

        A leaf has nothing outboard; it is massless if it has neither mass nor inertia, and its hinge no rotor inertia. Such bodies move
        nothing, and forward dynamics refuses the hinges that move them; bodies with a loop closure or a coupled hinge carry forces, and
        stay. The names, nodes and frames of pruned bodies stay, fixed to their carriers. They are locked and coalesced, so that `split` and
        `unlock` restore them.

        Returns
        -------
        list of str : names of the bodies that are nodes now, in the model's order

        Raises
        ------
        ModelError
            A part: its structure belongs to the whole model.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> finger = arm.add_body("finger", parent="body1", position=(1, 0, 0))
        >>> nail = arm.add_body("nail", parent="finger", position=(0.1, 0, 0))
        >>> arm.prune(), list(arm.bodies), list(arm.nodes)
        (['finger', 'nail'], ['body0', 'body1'], ['finger', 'nail'])
        """
        data = [self._body(k) for k in range(self._size)]
        outboard = [0] * len(data)
        for body in data:
            if body["parent"] >= 0:
                outboard[body["parent"]] += 1
        pruned, held = [], self._held_by_loops()
        for k in range(len(data) - 1, -1, -1):
            body = data[k]
            leaf = not outboard[k] and k not in held
            if leaf and not body["mass"] and not body["inertia"].any() and not body["hinge"]["rotor_inertia"].any():
                pruned.append(k)
                if body["parent"] >= 0:
                    outboard[body["parent"]] -= 1
        pruned.reverse()
        self._locked_now([k for k in pruned if data[k]["hinge"]["subhinges"]], np.array(self.v))  # massless: no other motion changes
        return self._coalesced_now(pruned)

    @property
    def coalesced(self) -> list[str]:
        """Names of the coalesced bodies, in order of coalescing; for a part, its own."""
        if self._whole is not None:
            own = {node["name"] for node in self._nodes()}
            return [name for name in self._whole.coalesced if name in own]
        return list(self._bodies_before)

    def remove_body(self, name: str | Body, *, with_uses: bool = False) -> Removed:  # locked and coalesced bodies there go along
        removed = super().remove_body(name, with_uses=with_uses)
        if not self._bodies_before and not self._hinges_before:
            return removed
        (bodies, hinges), nodes = map(set, self._names()), {node["name"] for node in self._nodes()}
        kept = {name: one for name, one in self._bodies_before.items() if name in nodes}
        for name, one in kept.items():
            kept[name] = one | {"children": {child: poses for child, poses in one["children"].items() if child in bodies or child in kept}}
        self._bodies_before = kept
        self._hinges_before = {name: one for name, one in self._hinges_before.items() if name in hinges or one["body"] in kept}
        return removed

    # ------------------------------------------------------------------ loops
    def _closed_between(self) -> dict[str, tuple[int, int]]:
        """Return, for each loop except couplings, the numbers of the bodies that it joins, -1 for the base."""
        ends = {name: self.loops.ends_of(name) for name in self._kept_loops or () if self.loops[name].kind != "coupling"}
        return {name: (self._frame_body(b) if b else -1, self._frame_body(a) if a else -1) for name, (b, a) in ends.items()}

    def _held_by_loops(self) -> set[int]:
        """Return the numbers of the bodies with loop closures, and of those on coupled hinges."""
        coupled = [self.loops._stands_on(name) for name in self._kept_loops or () if self.loops[name].kind == "coupling"]
        return {self._hinge_index(hinge) for hinge in set().union(*coupled)}.union(*self._closed_between().values())

    def _require_open(self, numbers: list[int]) -> None:
        """Check for loops of a body with itself: they would not constrain any motion, and neither copies nor files could hold them."""
        joined = set(numbers)

        def carrier(k: int) -> int:
            while k in joined:
                k = self._body(k)["parent"]
            return k

        for name, (b, a) in self._closed_between().items():
            if carrier(b) == carrier(a):
                ends = " and ".join(f"body {self._body(k)['name']!r}" if k >= 0 else "the base" for k in (b, a))
                what = f"loop {name!r} closes a chain between {ends}, which would be one body"
                raise _core.ModelError(f"{what}; remove that first, or name others")

    # ------------------------------------------------------------------ coalescing
    def _coalesced_now(self, numbers: list[int]) -> list[str]:
        data, aside = [self._body(k) for k in numbers], Asides(self)
        records = dict(self._bodies_before)
        for body, one in zip(data, self._coalesce(numbers), strict=True):
            rotation, position = one.pop("placement")
            body["hinge"]["placement"] = {"rotation": rotation, "position": position}
            records[body["name"]] = one | {"body": body}
        aside.put(self)
        self._bodies_before = records
        return [body["name"] for body in data]

    # ------------------------------------------------------------------ splitting
    def _in_the_way(self, wanted: list[str]) -> list[str]:
        """Return the bodies to split off for these, the last coalesced first.

        The carrier of a coalesced body was coalesced later, and so were bodies that it carried.
        """
        records, found, open_ = self._bodies_before, set(wanted), list(wanted)
        while open_:
            one = records[open_.pop()]
            for name in (one["carrier"], *one["children"]):
                if name in records and name not in found:
                    found.add(name)
                    open_.append(name)
        return [name for name in reversed(list(records)) if name in found]

    def _plan_of(self, opened: list[str]) -> tuple[list[dict[str, Any]], dict[str, dict[str, Any]]]:
        """Return the core's instructions for each, and the remaining records."""
        left = {name: dict(one) for name, one in self._bodies_before.items()}
        on: dict[str, list[str]] = {}
        for name, one in left.items():
            on.setdefault(one["carrier"], []).append(name)
        masses: dict[str, Mass] = {}
        placements: dict[str, Pose] = {}
        plan = []
        for name in opened:
            one = left.pop(name)
            body, carrier, X = one["body"], one["carrier"], _pose(one["body"]["hinge"])
            after = on[carrier][on[carrier].index(name) + 1 :]
            on[carrier].remove(name)
            if carrier:
                masses[carrier] = self._mass_without(one, [left[later] for later in after], masses)
            masses[name] = _mass(body)
            children = {}
            for child, (before, made) in one["children"].items():
                now = placements.get(child) or self._placement_of(child)
                if now is not None:
                    children[child] = placements[child] = before if _same(now, made) else _product(_inverse(X), now)
            placements[name] = X
            places = [*children, *self._places(one["next"], left)]
            plan.append({
                "body": body, "carrier": carrier, "places": places, "mass": masses.get(carrier, _NO_MASS), "children": children,
                "nodes": one["nodes"],
            })  # fmt: skip
        return plan, left

    def _mass_without(self, one: dict[str, Any], later: list[dict[str, Any]], masses: dict[str, Mass]) -> Mass:
        """Return the carrier's mass properties without this body: the earlier ones, and later additions joined again, unless they were
        set."""
        carrier = one["carrier"]
        now = masses[carrier] if carrier in masses else _mass(self._body(self._body_index(carrier)))
        steps = [one, *later]
        ends = [*(step["before"] for step in later), now]
        if not all(_same(step["after"], end) for step, end in zip(steps, ends, strict=True)):
            return _core._parted(now, carrier, _pose(one["body"]["hinge"]), _mass(one["body"]), one["body"]["name"])
        mass: Mass = one["before"]
        for step in later:
            step["before"] = mass
            if not _massless(step["body"]):
                mass = _core._joined(mass, carrier, _pose(step["body"]["hinge"]), _mass(step["body"]), step["body"]["name"])
            step["after"] = mass
        return mass

    def _placement_of(self, body: str) -> Pose | None:
        """Return the placement of its hinge; None if there is no such body."""
        try:
            return _pose(self._body(self._body_index(body))["hinge"])
        except _core.ModelError:
            return None

    def _places(self, following: str, left: Mapping[str, dict[str, Any]]) -> list[str]:
        """Return the bodies that may follow a body without children: its former successor; if that is coalesced, its children or
        successor."""
        places: list[str] = []
        while following in left:
            places += left[following]["children"]
            following = left[following]["next"]
        return [*places, following] if following else places

    # ------------------------------------------------------------------ files and copies
    def _described_edits(self) -> dict[str, Any]:
        """Return the data that a copy needs to unlock and split; for a part, its own."""
        of_whole = self if self._whole is None else self._whole
        locked, coalesced = set(self.locked), {name: of_whole._bodies_before[name] for name in self.coalesced}
        hinges = {name: one for name, one in of_whole._hinges_before.items() if name in locked or one["body"] in coalesced}
        return deepcopy({key: value for key, value in (("locked", hinges), ("coalesced", coalesced)) if value})


_NO_MASS: Mass = (0.0, np.zeros(3), np.zeros((3, 3)))


def _names(given: Any, what: str) -> list[str]:
    return [one.name if isinstance(one, (Body, Node)) else text(one, what) for one in several(given, (str, Body, Node))]


def _mass(body: dict[str, Any]) -> Mass:
    return body["mass"], body["com"], body["inertia"]


def _massless(body: dict[str, Any]) -> bool:
    return not body["mass"] and not body["inertia"].any()


def _pose(hinge: dict[str, Any]) -> Pose:
    return hinge["placement"]["rotation"], hinge["placement"]["position"]


def _product(X: Pose, Y: Pose) -> Pose:
    return X[0] @ Y[0], X[1] + X[0] @ Y[1]


def _inverse(X: Pose) -> Pose:
    return X[0].T, -X[0].T @ X[1]


def _same(a: Iterable[Any], b: Iterable[Any]) -> bool:
    """Check that values are equal to the last bit, except for the sign of zero."""
    return all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))
