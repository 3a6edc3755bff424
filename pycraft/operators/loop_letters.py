"""Rows of loops as operators, beside the letters of the tree that they are declared on (docs/loops.md).

    Q = Σ Q_k : Θ → R^rows          A = Σ A_k : NodesV(ends) → R^rows          Q = A B* φ* H*   for loops of two ends

Q_k and A_k are the letters of the core, block diagonal, to the rows by body; Σ, ones, sums the parts of a row.
"""

from __future__ import annotations

from typing import Any

from .. import _core

NAMES = ("Q", "A")


def loop_letter(source: Any, model: Any, name: str, made: dict[str, Any]) -> _core.Operator:
    """Return Q or A of a model's loops; `made` caches them as long as its loops stay."""
    if not isinstance(source, _core.MultibodyOperators) or model is None:
        raise AttributeError(f"rows of loops are operators of a whole model, model.soa.{name}: {source.name!r} is none")
    loops = made.get("loops")
    try:
        if loops is not None:
            loops.check_current()
    except _core.StaleOperatorError:
        loops = None
    if loops is None:
        loops = made["loops"] = model.loops._core.operators(source)
        for letter in NAMES:
            made.pop(letter, None)
    if name not in made:
        made[name] = _core._whole_rows(loops, name)
    return made[name]


def loop_source(model: Any) -> _core.SkoSource:
    """Rebuild a source from its pickle."""
    made: dict[str, Any] = model.soa._made
    loop_letter(model.soa._source, model, "Q", made)
    return made["loops"]
