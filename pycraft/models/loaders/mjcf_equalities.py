"""Equality constraints of an MJCF file as loops of the model (docs/loops.md): connect, weld and joint.

equality   loop
connect    a ball at the anchor, or at both sites
weld       a weld at the file's relative pose, or the relative pose of both sites; a ball at its anchor if torquescale is 0
joint      a coupling: q₁ - ref₁ = Σ a_k (q₂ - ref₂)^k; of one joint q₁ - ref₁ = a₀

Those that are not active when MuJoCo starts or that a flag disables, and equalities of tendons and flexes, are omitted.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from ... import _core
from ...interop import mujoco as conventions
from ...interop.mujoco import disabled
from ..multibody import Multibody
from .rotations import rotation_from_quaternion

_CONNECT, _WELD, _JOINT = range(3)  # mjtEq
_KINDS = ("connect", "weld", "joint", "tendon", "flex", "flexvert", "flexstrain", "distance")
_SITE = 6  # mjtObj


def add_equalities(m: Any, model: Multibody, bodies: list[str]) -> tuple[list[str], list[str]]:
    """Declare the equality constraints that a model can have as loops; return the others, and the inactive ones.

    Both by kind, name and objects. `bodies`: names by MuJoCo's number.
    """
    left_out, inactive = [], []
    off = disabled(m, "equality") or disabled(m, "constraint")
    for e in range(m.neq):
        kind, called = int(m.eq_type[e]), _called(m, e, bodies)
        name = m.equality(e).name or _unused(called, model)
        try:
            if off or not m.eq_active0[e]:
                inactive.append(called)
            elif kind in (_CONNECT, _WELD):
                _add_pair(m, e, model, bodies, name)
            elif kind == _JOINT:
                _add_coupling(m, e, model, name)
            else:
                left_out.append(called)
        except _core.ModelError as error:
            left_out.append(f"{called} ({error})")
    return left_out, inactive


def _unused(called: str, model: Multibody) -> str:
    """Return the name, with a number added if a loop has it: a hinge is two connects of one pair."""
    name, count = called, 1
    while name in model.loops:
        count += 1
        name = f"{called} ({count})"
    return name


def _add_pair(m: Any, e: int, model: Multibody, bodies: list[str], name: str) -> None:
    first, second = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
    weld = int(m.eq_type[e]) == _WELD
    data = m.eq_data[e]
    # With a on the first body, b on the second: the poses of the ends there, which coincide.
    a, b = np.eye(4), np.eye(4)
    if int(m.eq_objtype[e]) == _SITE:
        for X, site in ((a, first), (b, second)):
            X[:3, :3], X[:3, 3] = rotation_from_quaternion(m.site_quat[site]), m.site_pos[site]
        first, second = int(m.site_bodyid[first]), int(m.site_bodyid[second])
    elif weld:
        b[:3, 3] = data[:3]
        a[:3, :3], a[:3, 3] = rotation_from_quaternion(data[6:10]), data[3:6]
    else:
        a[:3, 3], b[:3, 3] = data[:3], data[3:6]
    if weld and data[10] > 0:
        rotation = a[:3, :3] @ b[:3, :3].T
        hinge: dict[str, Any] = dict(hinge="weld", rotation=rotation, position=a[:3, 3] - rotation @ b[:3, 3])
    else:
        hinge = dict(hinge="ball", point=b[:3, 3], position=a[:3, 3] - b[:3, 3])
    model.add_loop(bodies[second] if second else None, bodies[first] if first else None, name=name, **hinge)


def _add_coupling(m: Any, e: int, model: Multibody, name: str) -> None:
    order = conventions.permutation(model)[1]
    joints = [int(m.eq_obj1id[e])] + ([int(m.eq_obj2id[e])] if int(m.eq_obj2id[e]) >= 0 else [])
    reference = [float(m.qpos0[m.jnt_qposadr[j]]) for j in joints]
    numbers = [int(order[m.jnt_dofadr[j]]) for j in joints]
    coefficients = m.eq_data[e][:5]
    terms: dict[int, list[float]] = {numbers[0]: [-reference[0], 1.0]}
    constant = -float(coefficients[0])
    if len(joints) == 2:
        powers = Polynomial([0.0, *coefficients[1:]])(Polynomial([-reference[1], 1.0]))
        terms[numbers[1]] = [-float(c) for c in powers.coef]
    model.add_coupling(terms, constant=constant, name=name)


def _called(m: Any, e: int, bodies: list[str]) -> str:
    kind = _KINDS[int(m.eq_type[e])]
    ids = [int(i) for i in (m.eq_obj1id[e], m.eq_obj2id[e]) if i >= 0]
    if kind in ("joint", "tendon"):
        objects = [(m.joint(i) if kind == "joint" else m.tendon(i)).name or str(i) for i in ids]
    elif kind in ("connect", "weld"):
        sites = int(m.eq_objtype[e]) == _SITE
        objects = [(m.site(i).name or str(i)) if sites else bodies[i] for i in ids]
    else:
        objects = []
    name = m.equality(e).name
    return f"equality {kind}{f' {name!r}' if name else ''}{' of ' + ' and '.join(map(repr, objects)) if objects else ''}"
