"""Names and units of what is in q and v."""

from __future__ import annotations

from typing import Any

from .. import _core

POWER = {"rad": "N m", "m": "N"}
"""Units of a generalized force, by the coordinate's."""


def coordinate_units(model: Any) -> tuple[list[str], list[str], list[str]]:
    """Names of the numbers of q, their units ("" of quaternions), and the units of the coordinates of v ("rad" or "m", a second less)."""
    names: list[str] = []
    of_q: list[str] = []
    of_v: list[str] = []
    for name, hinge in model.hinges.items():
        count = hinge.q_slice.stop - hinge.q_slice.start
        names += [name] if count == 1 else [f"{name}[{i}]" for i in range(count)]
        for subhinge in hinge.subhinges:
            kind = _core.subhinge_kinds[subhinge["kind"]]
            if kind.nq == 1:
                of_q.append("rad" if kind.angle else "m")
                of_v.append("rad" if kind.angle else "m")
            else:
                of_q += [""] * 4 + ["m"] * (kind.nq - 4)
                of_v += ["rad"] * 3 + ["m"] * (kind.nv - 3)
    return names, of_q, of_v
