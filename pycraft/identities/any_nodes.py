"""Nodes of B, 𝒥 and Λ in a statement that names none and so applies to any."""

from __future__ import annotations

from typing import Any


def any_nodes(operators: Any) -> list[str]:
    """Return a node on the body with the most coordinates between it and the base, or that body's own frame: there Λ exists, if anywhere.

    Raises
    ------
    ParseError
        The operators have no bodies with frames.
    """
    from .vocabulary import ParseError

    source, model = operators._source, operators._model
    names = [name for name, *_ in operators.V.blocks]
    if model is None or not names:
        raise ParseError(f"{source.name!r} has no nodes")
    moving: list[int] = []
    for k, parent in enumerate(source.parents):
        moving.append(source.dof[k] + (moving[parent] if parent >= 0 else 0))
    best = max(range(len(names)), key=lambda k: moving[k])
    nodes = getattr(model, "nodes", {})
    on_it = [name for name in nodes if nodes[name].body is not None and nodes[name].body.name == names[best]]
    return [on_it[0] if on_it else names[best]]
