"""Masses, lengths, ... of a model as exact numbers or as symbols, for closed forms."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import sympy

from .. import _core
from ..proofs.rational import exact

_OF_BODY = ("mass", "com", "inertia", "position", "rotation", "rotor_inertia", "pitch")
_POSITIVE = ("mass", "inertia", "rotor_inertia")


class Parameters:
    """A model's description with exact or symbolic entries.

    Parameters
    ----------
    description : from `Multibody.description()`
    given : "numeric": exact numbers; "symbolic": a symbol for every nonzero value (m1, l1, I1zz, ...); or a mapping with the keys (body,
        "mass" | "com" | "inertia" | "position" | "rotation" | "rotor_inertia" | "pitch"), (node, "position") and "gravity" to expressions,
        names of symbols, or arrays of them; all others stay numeric

    Attributes
    ----------
    bodies, nodes, gravity : the description with its numbers as SymPy expressions
    values : the model's own value of every symbol, if known
    """

    def __init__(self, description: Mapping[str, Any], given: str | Mapping[Any, Any] = "numeric"):
        if isinstance(given, str) and given not in ("numeric", "symbolic"):
            raise _core.ModelError(
                f"parameters={given!r}: there are 'numeric', 'symbolic', or a mapping such as {{('upper', 'mass'): 'm1'}}"
            )
        self.values: dict[sympy.Symbol, float] = {}
        self._pairs: list[tuple[sympy.Expr, float]] = []  # an expression, and its value
        self.bodies = [_exact_body(body) for body in description["bodies"]]
        self.nodes = [
            {"name": n["name"], "body": n["body"], "rotation": _turned(n["rotation"]), "position": _all(n["position"])}
            for n in description["nodes"]
        ]
        self.gravity = _all(description["gravity"])
        if isinstance(given, Mapping):
            self._substitute(description, given)
        elif given == "symbolic":
            self._name_everything(description)
        self._solve_for_values()

    def expressions(self) -> list[sympy.Expr]:
        """Return every entry."""
        found: list[sympy.Expr] = list(self.gravity)
        for body in self.bodies:
            for key in _OF_BODY:
                if key != "pitch":
                    found += _flat(body[key])
            for s in body["subhinges"]:
                found += [*s["axis"], *s["point"], s["pitch"]]
        for node in self.nodes:
            found += [*_flat(node["rotation"]), *node["position"]]
        return found

    # ------------------------------------------------------------------ values of a user
    def _substitute(self, description: Mapping[str, Any], given: Mapping[Any, Any]) -> None:
        bodies = {b["name"]: k for k, b in enumerate(description["bodies"])}
        hinges = {b["hinge"]["name"]: k for k, b in enumerate(description["bodies"])}
        nodes = {n["name"]: i for i, n in enumerate(description["nodes"])}
        for key, value in given.items():
            if key == "gravity":
                self.gravity = self._taken(value, description["gravity"], "gravity", False)
                continue
            owner, quantity = key if isinstance(key, tuple) and len(key) == 2 else (None, None)
            if owner in nodes and quantity == "position":
                node = description["nodes"][nodes[owner]]
                self.nodes[nodes[owner]]["position"] = self._taken(value, node["position"], f"position of node {owner!r}", False)
                continue
            k = bodies.get(owner, hinges.get(owner)) if owner is not None else None
            if k is None or quantity not in _OF_BODY:
                raise _core.ModelError(
                    f"no parameter is called {key!r}: a key is 'gravity', (node, 'position') or (body, quantity); "
                    f"bodies are {', '.join(list(bodies)[:12])}; quantities {', '.join(_OF_BODY)}"
                )
            what = f"{quantity} of {owner!r}"
            if quantity == "pitch":
                screws = [i for i, s in enumerate(self.bodies[k]["subhinges"]) if s["kind"] == "screw"]
                if len(screws) != 1:
                    raise _core.ModelError(f"{what}: the hinge has {len(screws)} screws, not one")
                number = description["bodies"][k]["hinge"]["subhinges"][screws[0]]["pitch"]
                self.bodies[k]["subhinges"][screws[0]]["pitch"] = self._taken(value, number, what, False)
            else:
                number = _number(description["bodies"][k], quantity)
                self.bodies[k][quantity] = self._taken(value, number, what, quantity in _POSITIVE)

    def _taken(self, value: Any, number: Any, what: str, positive: bool) -> Any:
        """Return the expressions of a value, in the shape of the number; a scalar stands for an array of one."""
        entries = np.asarray(value.tolist() if isinstance(value, sympy.MatrixBase) else value, dtype=object)
        numbers = np.asarray(number, float)
        if entries.shape != numbers.shape and entries.size == numbers.size == 1:
            entries = entries.reshape(numbers.shape)
        if entries.shape != numbers.shape:
            raise _core.ModelError(f"{what}: an array {numbers.shape} is needed, not {entries.shape}")
        made = np.empty(entries.shape, dtype=object)
        for i in np.ndindex(*entries.shape):
            made[i] = self._one(entries[i], float(numbers[i]), positive and (len(i) < 2 or i[0] == i[1]))
        return made.tolist()

    def _one(self, entry: Any, number: float, positive: bool) -> sympy.Expr:
        if isinstance(entry, str) and entry.startswith("-"):
            return -self._one(entry[1:], -number, positive)
        if isinstance(entry, str):
            if not entry.isidentifier():
                raise _core.ModelError(f"{entry!r} is not a name of a parameter; write formulas as SymPy expressions")
            entry = sympy.Symbol(entry, real=True, positive=True if positive and number > 0 else None)
        if isinstance(entry, float | np.floating):
            return exact(float(entry))
        expression = sympy.sympify(entry)
        if not isinstance(expression, sympy.Expr):
            raise _core.ModelError(f"{entry!r} is not a number, name or SymPy expression")
        if expression.free_symbols:
            self._pairs.append((expression, number))
        return expression

    # ------------------------------------------------------------------ symbols for all parameters
    def _name_everything(self, description: Mapping[str, Any]) -> None:
        rods: dict[int, sympy.Symbol] = {}
        for k, body in enumerate(description["bodies"]):
            n = k + 1
            mass = self._one(f"m{n}", body["mass"], True) if body["mass"] else sympy.S.Zero
            length = rod_length(body)
            made = self.bodies[k]
            made["mass"] = mass
            if length is not None:
                l = rods[k] = self._one(f"l{n}", length, True)
                made["com"] = [l / 2, sympy.S.Zero, sympy.S.Zero]
                square = mass * l**2 / 12
                made["inertia"] = [[square if i == j > 0 else sympy.S.Zero for j in range(3)] for i in range(3)]
            else:
                made["com"] = [self._unless_zero(f"c{n}{x}", c) for x, c in zip("xyz", body["com"], strict=True)]
                made["inertia"] = [
                    [self._unless_zero(f"I{n}{min(x, y)}{max(x, y)}", body["inertia"][i][j], i == j) for j, y in enumerate("xyz")]
                    for i, x in enumerate("xyz")
                ]
            made["position"] = self._placed(f"p{n}", body["hinge"]["placement"]["position"], body["parent"], description, rods)
            rotors = body["hinge"]["rotor_inertia"]
            made["rotor_inertia"] = [
                self._unless_zero(f"J{n}" if len(rotors) == 1 else f"J{n}_{i + 1}", r, True) for i, r in enumerate(rotors)
            ]
            for i, s in enumerate(body["hinge"]["subhinges"]):
                made["subhinges"][i]["point"] = [self._unless_zero(f"o{n}{x}", c) for x, c in zip("xyz", s["point"], strict=True)]
                if s["kind"] == "screw":
                    made["subhinges"][i]["pitch"] = self._unless_zero(f"h{n}", s["pitch"])
        for i, node in enumerate(description["nodes"]):
            self.nodes[i]["position"] = self._placed(f"n{i + 1}", node["position"], node["body"], description, rods)
        down = np.flatnonzero(description["gravity"])
        if len(down) == 1:  # the usual case: g along one axis
            number = float(description["gravity"][down[0]])
            g = self._one("g", abs(number), True)
            self.gravity[down[0]] = g if number > 0 else -g
        else:
            self.gravity = [self._unless_zero(f"g{x}", c) for x, c in zip("xyz", description["gravity"], strict=True)]

    def _unless_zero(self, name: str, number: float, positive: bool = False) -> sympy.Expr:
        return self._one(name, float(number), positive) if number else sympy.S.Zero

    def _placed(self, name: str, position: Sequence[float], parent: int, description: Mapping[str, Any], rods: Mapping[int, sympy.Symbol]):
        """Return a position on a body: at the end of a rod it is the rod's length."""
        if parent in rods:
            length = rod_length(description["bodies"][parent])
            if length is not None and abs(position[0] - length) <= 1e-12 * length and not np.any(position[1:]):
                return [rods[parent], sympy.S.Zero, sympy.S.Zero]
        return [self._unless_zero(f"{name}{x}", c) for x, c in zip("xyz", position, strict=True)]

    def _solve_for_values(self) -> None:
        """Solve for the model's values of the symbols, from the entries that contain them."""
        waiting = self._pairs
        while True:
            left = []
            for expression, number in waiting:
                unknown = [x for x in expression.free_symbols if x not in self.values]
                if len(unknown) == 1:
                    self._solve(expression, number, unknown[0])
                elif unknown:
                    left.append((expression, number))
            if len(left) == len(waiting):
                return
            waiting = left

    def _solve(self, expression: sympy.Expr, number: float, x: sympy.Symbol) -> None:
        if expression == x:
            self.values[x] = number
            return
        known = {s: v for s, v in self.values.items() if s in expression.free_symbols}
        roots = sympy.solve(expression.subs(known) - number, x)
        real = [float(r) for r in roots if r.is_number and abs(sympy.im(r)) == 0]
        if real:
            self.values[x] = max(real)


def rod_length(body: Mapping[str, Any]) -> float | None:
    """Return the length of a uniform thin rod along x from the body frame's origin, or None for any other body."""
    m, c, inertia = body["mass"], np.asarray(body["com"]), np.asarray(body["inertia"])
    if m <= 0 or c[0] <= 0 or np.any(c[1:]):
        return None
    length = 2 * float(c[0])
    rod = np.diag([0.0, 1.0, 1.0]) * m * length**2 / 12
    return length if np.abs(inertia - rod).max() <= 1e-12 * m * length**2 else None


def _number(body: Mapping[str, Any], quantity: str) -> Any:
    hinge = body["hinge"]
    return {
        "mass": body["mass"],
        "com": body["com"],
        "inertia": body["inertia"],
        "position": hinge["placement"]["position"],
        "rotation": hinge["placement"]["rotation"],
        "rotor_inertia": hinge["rotor_inertia"],
    }[quantity]


def _exact_body(body: Mapping[str, Any]) -> dict[str, Any]:
    hinge = body["hinge"]
    return {
        "name": body["name"],
        "parent": body["parent"],
        "hinge": hinge["name"],
        "mass": exact(body["mass"]),
        "com": _all(body["com"]),
        "inertia": [_all(row) for row in body["inertia"]],
        "position": _all(hinge["placement"]["position"]),
        "rotation": _turned(hinge["placement"]["rotation"]),
        "rotor_inertia": _all(hinge["rotor_inertia"]),
        "subhinges": [
            {"kind": s["kind"], "axis": _direction(s["axis"]), "point": _all(s["point"]), "pitch": exact(s["pitch"])}
            for s in hinge["subhinges"]
        ],
    }


def _all(numbers: Iterable[float]) -> list[sympy.Expr]:
    return [exact(x) for x in np.asarray(numbers, float)]


def _turned(rotation: Any) -> list[list[sympy.Expr]]:
    """Return a rotation matrix with entries within a rounding of 0 and ±1 made exact, as cos(π/2) is zero."""
    return [_direction(row) for row in np.asarray(rotation, float)]


def _direction(numbers: Iterable[float]) -> list[sympy.Expr]:
    return [exact(round(float(x)) if abs(x - round(float(x))) < 1e-15 else x) for x in numbers]


def _flat(x: Any) -> list[sympy.Expr]:
    if isinstance(x, list):
        return [e for part in x for e in _flat(part)]
    return [x]
