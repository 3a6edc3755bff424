"""Names and units of the entries of q and v."""

from __future__ import annotations

from typing import Any

from .. import _core
from ..state import names_of_q

POWER = {"rad": "N m", "m": "N"}
"""Unit of a generalized force, by the unit of its coordinate."""


def coordinate_units(model: Any) -> tuple[list[str], list[str], list[str]]:
    """Return names of the entries of q, their units ("" for quaternions), and units of the coordinates of v ("rad" or "m", without 1/s)."""
    of_q: list[str] = []
    of_v: list[str] = []
    for hinge in model.hinges.values():
        for subhinge in hinge.subhinges:
            kind = _core.subhinge_kinds[subhinge["kind"]]
            if kind.nq == 1:
                of_q.append("rad" if kind.angle else "m")
                of_v.append("rad" if kind.angle else "m")
            else:
                of_q += [""] * 4 + ["m"] * (kind.nq - 4)
                of_v += ["rad"] * 3 + ["m"] * (kind.nv - 3)
    return names_of_q(model), of_q, of_v
