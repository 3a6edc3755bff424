"""Parameters of effects as fields of a page: numbers and lists of numbers that can be shown, and changed while a scene plays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from .. import _core

EVERY = {"hinges": "all hinges", "coordinates": "all coordinates", "bodies": "all bodies"}
"""Text for fields that select nothing, so that the effect acts on all, by the name of the field."""


def shown_fields(effect: Any, model: Any) -> list[dict[str, Any]]:
    """Return each parameter of an effect in a model's scene: its name, and a number, a list of numbers, or the text of anything else."""
    return [{"name": name, **_shown(value, name)} for name, value in _parameters(effect.completed_for(model))]


def set_field(scene: Any, effect: str, field: str, value: Any) -> None:
    """Set a parameter of an effect to a number or a list of numbers. On ModelError the effect is unchanged."""
    changed = scene.effects[effect]
    before, present = dict(_parameters(changed.completed_for(scene.model))).get(field), getattr(changed, field, None)
    if before is None or "value" not in _shown(before, field):
        raise _core.ModelError(f"{effect} has no numeric parameter {field!r} that can be set here")
    given = np.asarray(_core.real_array(value, f"{effect}: {field}"))
    if given.shape != np.shape(before):
        raise _core.ModelError(f"{effect}: {field} takes the shape {np.shape(before)}, not {given.shape}")
    if not np.isfinite(given).all():
        raise _core.ModelError(f"{effect}: {field} takes finite numbers")
    new = type(before)(given.item()) if np.ndim(before) == 0 else given.tolist()
    try:
        setattr(changed, field, new)
        scene._calls()
    except BaseException:
        setattr(changed, field, present)
        raise


def _parameters(effect: Any) -> Iterator[tuple[str, Any]]:
    for field in fields(effect):
        if not field.name.startswith("_"):
            yield field.name, getattr(effect, field.name)


def _shown(value: Any, name: str) -> dict[str, Any]:
    if value is None:
        return {"text": EVERY.get(name, "not given")}
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return {"value": value}
    if isinstance(value, (list, tuple, np.ndarray)) and len(value):
        numbers = np.asarray(value) if all(isinstance(x, (int, float, np.number)) for x in np.ravel(value)) else np.zeros(0)
        if numbers.ndim == 1 and numbers.size and numbers.dtype.kind in "if":
            return {"value": numbers.tolist()}
    if isinstance(value, (list, tuple)) and all(isinstance(x, str) for x in value):
        return {"text": ", ".join(value)}
    return {"text": value if isinstance(value, str) else repr(value)[:120]}
