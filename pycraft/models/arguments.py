"""What users give to models, taken apart before the core checks the numbers: poses, limits, names, lists."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .. import _core


def text(name: Any, what: str) -> str:
    """A name. ModelError where it is no text."""
    if not isinstance(name, str):
        raise _core.ModelError(f"{what} is called by a text, not by {name!r}")
    return name


def listed(items: Any, what: str) -> list[Any]:
    """The items of a list. ModelError where it is none."""
    if isinstance(items, (str, bytes, dict)) or not isinstance(items, Iterable):
        raise _core.ModelError(f"{what}: a list, not {items!r}")
    return list(items)


def pose_parts(what: str, rotation: Any, position: Any, placement: Any) -> tuple[Any, Any]:
    """Rotation and position of a pose given as these two, None for none, or as a (4, 4) matrix. `what` it belongs to, for errors."""
    if placement is None:
        return rotation, position
    if rotation is not None or position is not None:
        raise _core.ModelError(f"{what}: give placement, or rotation and position, not both")
    try:
        pose = np.asarray(placement)
    except ValueError:
        raise _core.ModelError(f"placement of {what} is not an array of numbers") from None
    if pose.shape != (4, 4):
        raise _core.ModelError(f"placement of {what} takes a (4, 4) pose, not an array {pose.shape}")
    if not np.array_equal(pose[3], (0, 0, 0, 1)):
        raise _core.ModelError(f"placement of {what}: the last row of a pose is (0, 0, 0, 1), not {tuple(pose[3].tolist())}")
    return pose[:3, :3], pose[:3, 3]


def limit_pair(what: str, limits: Any) -> tuple[Any, Any]:
    """Lower and upper limits of a pair, None for none. `what` they belong to, for errors."""
    if limits is None:
        return None, None
    try:
        lower, upper = limits
    except (TypeError, ValueError):
        raise _core.ModelError(f"limits of {what} are a pair (lower, upper), not {limits!r}") from None
    return lower, upper
