"""Names and units of what is in q and v."""

from __future__ import annotations

from typing import Any

from .. import _core
from ..state import names_of_q

POWER = {"rad": "N m", "m": "N"}
"""Units of a generalized force, by the coordinate's."""


def coordinate_units(model: Any) -> tuple[list[str], list[str], list[str]]:
    """Names of the numbers of q, their units ("" of quaternions), and the units of the coordinates of v ("rad" or "m", a second less)."""
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
