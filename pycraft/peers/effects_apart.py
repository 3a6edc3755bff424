"""Further differences between two models' files: damping, springs, friction, drives, forces on bodies, loops, unread elements."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..models.loaders.left_aside import OFF, QUANTITIES
from ..models.offers import BoxInFluid, HeldWeight

_EPS = 1e-12
"""Relative tolerance for equal values: both files write all digits, and frames are rotated in between."""
_BOUNDS = ("effort limit", "velocity limit")
_ONE_SIDED = ("contacts", "stops at the limits")


class Apart(NamedTuple):
    """One difference: `kind`, words for it, and whether it makes the two models move differently."""

    kind: str
    text: str
    decides: bool


def effects_apart(ours: Any, theirs: Any, one_sided_act: bool | None = None) -> list[Apart]:
    """Return the differences between the effects of two models' files.

    Parameters
    ----------
    ours, theirs : Multibody
        Matched by the names of hinges, else of bodies.
    one_sided_act : bool, optional
        Whether contacts or stops act at one of the states, if the other model belongs to a program that applies its whole file. Omitted for
        a model of this package, which does not apply unread elements.
    """
    found = [*_by_coordinate(ours, theirs), *_on_bodies(ours, theirs), *_drives(ours, theirs), *_loops(ours, theirs)]
    if one_sided_act is None:
        more = [text for text in theirs.not_read if text not in ours.not_read]
        return found + [Apart("not read", f"{text}, in the other file", False) for text in more]
    for text in theirs.not_read:
        free = text.startswith(_ONE_SIDED) and not one_sided_act
        found.append(Apart("not read", f"{text}{'; none acts at these states' if free else ''}", not free))
    return found


def _by_coordinate(ours: Any, theirs: Any) -> Iterator[Apart]:
    places = _places(ours, theirs)
    for quantity in QUANTITIES:
        if quantity in _BOUNDS:
            continue  # drives that give no force yet
        own = np.nan_to_num(ours.left_aside.get(quantity, np.zeros(ours.nv)))
        other = np.zeros(ours.nv)
        if quantity in theirs.left_aside:
            other[places >= 0] = np.nan_to_num(theirs.left_aside[quantity])[places[places >= 0]]
        differs = np.abs(own - other) > _EPS * np.maximum(np.abs(own), np.abs(other))
        if differs.any():
            yield Apart(quantity, _named(ours, differs, own, other), True)
    own, other = (model.left_aside.get("spring rest", np.asarray(model.zero_q())) for model in (ours, theirs))
    if "stiffness" in theirs.left_aside and own.shape == other.shape and np.abs(own - other).max(initial=0) > 1e-9:
        yield Apart("spring rest", "springs are slack at other positions there", True)


def _places(ours: Any, theirs: Any) -> np.ndarray:
    """Return, by our coordinate, the number of theirs, -1 for none."""
    places = np.full(ours.nv, -1)
    by_body = {hinge.body.name: hinge for hinge in theirs.hinges.values()}
    for name, hinge in ours.hinges.items():
        twin = theirs.hinges[name] if name in theirs.hinges else by_body.get(hinge.body.name)
        if twin is not None and twin.v_slice.stop - twin.v_slice.start == hinge.v_slice.stop - hinge.v_slice.start:
            places[hinge.v_slice] = np.arange(twin.v_slice.start, twin.v_slice.stop)
    return places


def _named(ours: Any, differs: np.ndarray, own: np.ndarray, other: np.ndarray) -> str:
    texts = [f"{ours.coordinate_names[j]}: {own[j]:.6g} here, {other[j]:.6g} there" for j in np.flatnonzero(differs)[:3]]
    more = int(differs.sum()) - len(texts)
    return "; ".join(texts) + (f"; and {more} more" if more else "")


def _on_bodies(ours: Any, theirs: Any) -> Iterator[Apart]:
    for kind, what in (("gravity compensation", _held), ("fluid", _boxes)):
        own, other = what(ours), what(theirs)
        if own.keys() != other.keys() or any(np.abs(own[key] - other[key]).max() > 1e-9 * (1 + np.abs(own[key]).max()) for key in own):
            yield Apart(kind, f"{_listed(own)} here, {_listed(other)} there", True)


def _held(model: Any) -> dict[str, np.ndarray]:
    """Return, by body, the compensated mass, and that mass times its point, both times the gravity."""
    found: dict[str, np.ndarray] = {}
    for offer in (offer for offer in model.offers if isinstance(offer, HeldWeight)):
        body, X = _carrier(model, offer.body)
        one = np.append(offer.mass, offer.mass * (X[:3, :3] @ offer.point + X[:3, 3]))
        found[body] = found.get(body, 0.0) + np.outer(one, offer.g or (0.0, 0.0, -9.81))
    return {body: value for body, value in found.items() if np.any(value)}


def _boxes(model: Any) -> dict[str, np.ndarray]:
    """Return, by body, sums over its boxes that distinguish them."""
    found: dict[str, np.ndarray] = {}
    for offer in (offer for offer in model.offers if isinstance(offer, BoxInFluid)):
        body, X = _carrier(model, offer.body)
        one = np.concatenate([np.sort(offer.size), (X @ offer.placement)[:3, 3], [offer.density, offer.viscosity], offer.wind])
        found[body] = found.get(body, 0.0) + np.append(one, 1.0)
    return found


def _carrier(model: Any, name: str) -> tuple[str, np.ndarray]:
    if name in model.bodies:
        return name, np.eye(4)
    node = model.nodes[name]
    return node.body.name if node.body is not None else "", node.pose


def _listed(found: dict[str, np.ndarray]) -> str:
    return ", ".join(map(repr, list(found)[:3])) + ", ..." * (len(found) > 3) if found else "none"


def _drives(ours: Any, theirs: Any) -> Iterator[Apart]:
    """Yield actuators that only one of the two has; those without force at zero controls do not decide."""
    sides = ((theirs, ours, "there"), (ours, theirs, "here"))
    for model, other, side in sides:
        known = [_key(drive) for drive in other.actuators]
        for drive in model.actuators:
            if (why := drive["why not"]) == OFF:
                continue
            if why and side == "there":
                yield Apart("actuator", f"{drive['name']!r} there, which is no effect here: {why}", True)
            elif not why and _key(drive) not in known:
                silent = not np.any(drive["bias"]) and not drive["control"] * drive["gain"]
                yield Apart("actuator", f"{drive['name']!r} {side} alone", not silent)


def _key(drive: dict[str, Any]) -> tuple[Any, ...]:
    numbers = (drive["gear"], drive["gain"], *drive["bias"], drive["control"], *drive["force range"])
    return drive["coordinate"], drive["why not"], *(float(f"{x:.12g}") for x in numbers)


def _loops(ours: Any, theirs: Any) -> Iterator[Apart]:
    own, other = len(ours.loops), len(theirs.loops)
    kinds = [sorted(loop["kind"] for loop in model.loops._description()) for model in (ours, theirs)]
    if kinds[0] != kinds[1]:
        yield Apart(
            "equality constraints",
            f"{own or 'none'} here, {other or 'none'} there: {', '.join(map(repr, [*theirs.loops, *ours.loops][:3]))}",
            True,
        )
