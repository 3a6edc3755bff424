"""Generated models: the uniform chain, random trees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import _core
from ..arguments import LARGEST, listed, name_of, one_number, parents_of, seed_of, text, whole
from .multibody import Multibody

_CUSTOM = ("pin", "slider", "pin")
"""Subhinges of the custom hinges that are generated here."""


def chain(
    n: int,
    kind: str = "pin",
    seed: int | None = None,
    *,
    mass: float = 1.0,
    length: float = 1.0,
    welds: str = "lump",
    name: str | None = None,
) -> Multibody:
    """Return a serial chain of n bodies.

    With `seed=None`: uniform thin rods of 1 kg and 1 m along x, all axes z, so that everything has a closed form. With a seed: random
    poses, axes and positive definite inertias.

    Examples
    --------
    >>> import pycraft as pc
    >>> pc.chain(3).nv
    3
    """
    n, kind = whole(n, "the number of bodies of a chain"), text(kind, "a hinge kind")
    if not 0 <= n <= LARGEST // 6:
        raise _core.ModelError(f"a chain of {n} bodies: a number from 0 to {LARGEST // 6}")
    if seed is not None:
        return tree(range(-1, n - 1), [kind] * n, seed=seed, welds=welds, name=name_of(name, "a model", f"chain of {n}"))
    model = Multibody(name_of(name, "a model", f"chain of {n} rods"), welds=welds)
    mass, length = one_number(mass, "mass of a rod"), one_number(length, "length of a rod")
    if not abs(length) < 1e150:
        raise _core.ModelError(f"length of a rod: {length:g} m; its square overflows")
    rod: dict[str, Any] = dict(mass=mass, com=(length / 2, 0, 0), inertia=np.diag([0.0, mass * length**2 / 12, mass * length**2 / 12]))
    for k in range(n):
        options: dict[str, Any] = {}
        if kind == "custom":
            options["subhinges"] = [{"kind": s, "axis": (0, 0, 1)} for s in _CUSTOM]
        elif kind in _core.hinge_kinds and _core.hinge_kinds[kind].axes > 1:
            options["axes"] = [(0, 0, 1), (0, 1, 0), (1, 0, 0)][: _core.hinge_kinds[kind].axes]
        model.add_body(
            f"body{k}",
            f"body{k - 1}" if k else None,
            kind,
            hinge_name=f"hinge{k}",
            position=(length, 0, 0) if k else (0, 0, 0),
            **rod,
            **options,
        )
    return model


def tree(
    parents: Sequence[int],
    kinds: Sequence[str] | str = "pin",
    seed: int = 0,
    *,
    rotor_inertia: bool = False,
    welds: str = "lump",
    name: str | None = None,
) -> Multibody:
    """Return a random tree: `parents[k] < k`, -1 for the base; poses, axes and positive definite inertias drawn from the seed.

    Bodies are named "body0", "body1", ... and hinges "hinge0", ... by their index in `parents`; the model keeps them depth first. A
    "custom" hinge here is pin, slider, pin. With `rotor_inertia` every coordinate has one. Bodies on welds are lumped into the bodies that
    move them and become nodes, unless `welds="keep"`.
    """
    parents = parents_of(parents, "a tree")
    if not isinstance(kinds, str):
        kinds = listed(kinds, "hinge kinds of a tree")
    kinds = [kinds] * len(parents) if isinstance(kinds, str) else [text(kind, "a hinge kind") for kind in kinds]
    if len(kinds) != len(parents):
        raise _core.ModelError(f"a tree of {len(parents)} bodies takes {len(parents)} hinge kinds, not {len(kinds)}")
    rng = seed_of(seed)
    model = Multibody(name_of(name, "a model", f"tree of {len(parents)}"), welds=welds)
    for k, (parent, kind) in enumerate(zip(parents, kinds, strict=True)):
        options = _random_options(kind, rng)
        spread = rng.normal(size=(3, 3))
        inertia = 0.1 * spread @ spread.T + 0.05 * np.eye(3)
        # Second moments of a body are a positive definite matrix S; tr(S) 1 - S obeys the triangle inequality.
        inertia = np.trace(inertia) * np.eye(3) - inertia
        options |= dict(
            rotation=_orthogonal(rng), position=rng.uniform(-1, 1, 3), mass=rng.uniform(0.5, 3.0), com=rng.uniform(-0.2, 0.2, 3)
        )
        if rotor_inertia and kind != "weld":
            options["rotor_inertia"] = rng.uniform(0.05, 0.5, sum(_core.subhinge_kinds[s].nv for s in _subhinges(kind)))
        model.add_body(
            f"body{k}",
            f"body{parent}" if parent >= 0 else None,
            kind,
            hinge_name=f"hinge{k}",
            inertia=(inertia + inertia.T) / 2,
            **options,
        )
    return model


def _subhinges(kind: str) -> tuple[str, ...]:
    """Return the kinds of a hinge's subhinges; none for an unknown name."""
    return _CUSTOM if kind == "custom" else _core.hinge_kinds[kind].subhinges if kind in _core.hinge_kinds else ()


def _random_options(kind: str, rng: np.random.Generator) -> dict[str, Any]:
    """Return random axes, point and pitch, if the kind has them."""
    if kind == "custom":
        return {"subhinges": [{"kind": s, "axis": _axis(rng), "point": rng.uniform(-0.2, 0.2, 3)} for s in _CUSTOM]}
    subhinges = [_core.subhinge_kinds[s] for s in _subhinges(kind)]
    options: dict[str, Any] = {}
    axes = _core.hinge_kinds[kind].axes if subhinges else 0
    if axes > 1:
        options["axes"] = list(_orthogonal(rng)[:axes])
    elif axes:
        options["axis"] = _axis(rng)
    if any(s.point for s in subhinges):
        options["point"] = rng.uniform(-0.2, 0.2, 3)
    if any(s.pitch for s in subhinges):
        options["pitch"] = rng.uniform(0.05, 0.3)
    return options


def _axis(rng: np.random.Generator) -> np.ndarray:
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def _orthogonal(rng: np.random.Generator) -> np.ndarray:
    """Return a rotation matrix, uniform on the group."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    if np.linalg.det(q) < 0:
        q[:, 0] *= -1
    return q
