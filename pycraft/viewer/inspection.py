"""Values of a scene at its present state, for the page: a body's M, P, D and frames, and the blocks of operators."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from .live_scene import LiveScene

LETTERS = {
    "ℳ": "MM", "ℳ⁻¹": "MM_inv", "M": "M", "P": "P", "D": "D", "φ": "phi", "ψ": "psi", "Υ": "Upsilon", "Ω": "Omega",
}  # fmt: skip
"""Operators with a block picture, and their names in an operator set."""
_INERTIAS, _COMPLIANCES = "kg m², kg m and kg by body", "1/(kg m²), 1/(kg m) and 1/kg by body"
UNITS = {
    "ℳ": "kg m² and kg by hinge", "ℳ⁻¹": "1/(kg m²) and 1/kg by hinge", "M": _INERTIAS, "P": _INERTIAS, "D": "kg m² and kg by hinge",
    "φ": "1 and m", "ψ": "1 and m", "Υ": _COMPLIANCES, "Ω": _COMPLIANCES,
}  # fmt: skip
"""SI units of the entries of their blocks."""
MOST = 600
"""Largest number of rows of an operator that is formed for its picture."""


def body_numbers(live: LiveScene, name: str) -> dict[str, Any]:
    """Return a body's hinge, pose and velocity, its diagonal blocks M and P, the block D of its hinge, and its frames.

    Raises ModelError for an unknown name.

    Returns
    -------
    dict
        "pose" X_WB (4, 4); "twist" (6,) in its own axes, angular first; "M", "P" (6, 6), "D" (n, n), None beyond MOST rows; "frames",
        nodes on the body by name, with their places in its frame, m.
    """
    model = live.model
    if name not in model.bodies:
        raise _core.ModelError(f"{model.name!r} has no body {name!r}")
    k = live.skeleton.bodies.index(name)
    described = model.description()
    body = described["bodies"][k]
    hinge = live.skeleton.names[k]
    at = live.model.soa
    found: dict[str, Any] = {
        "name": name, "hinge": hinge, "kind": live.skeleton.kinds[k], "mass": float(body["mass"]),
        "parent": live.skeleton.bodies[body["parent"]] if body["parent"] >= 0 else None,
        "com": np.asarray(body["com"], float).tolist(), "pose": model.pose(name, live.q).tolist(),
        "frames": {node["name"]: np.asarray(node["position"]).tolist() for node in described["nodes"] if node["body"] == k},
    }  # fmt: skip
    found["twist"] = (model.jacobian(name, live.q) @ live.v).tolist() if model.nv else [0.0] * 6
    for letter, block in (("M", name), ("P", name), ("D", hinge)):
        operator = getattr(at, letter)
        small = max(operator.shape) <= MOST and (letter != "D" or model.hinges[hinge].v_slice.stop > model.hinges[hinge].v_slice.start)
        found[letter] = operator.at(live.q).blocks()[block, block].tolist() if small else None
    return found


def blocks_of(live: LiveScene, letter: str) -> dict[str, Any]:
    """Return the largest entry of each block of an operator at the state: "rows", "columns", "values", "units".

    Raises EvaluationError for operators that are not shown.
    """
    if letter not in LETTERS:
        raise _core.EvaluationError(f"blocks of {letter!r} are not shown; choose from {', '.join(LETTERS)}")
    operator = getattr(live.model.soa, LETTERS[letter])
    if max(operator.shape, default=0) > MOST:
        raise _core.EvaluationError(f"{letter} has {max(operator.shape)} rows; the viewer shows blocks up to {MOST} rows")
    view = operator.at(live.q).blocks()
    return {"rows": view.rows, "columns": view.columns, "values": view.largest().tolist(), "units": UNITS.get(letter, "")}
