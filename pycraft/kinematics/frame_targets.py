"""Check targets of users and turn them into rows: see `solve_ik`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

import numpy as np

from .. import _core
from ..arguments import several
from ..dynamics.task_space import TWIST
from ..models.limits import pin_coordinates
from .target_rows import LoopRows, MassCentreRows, PointingRows, PoseRows, Rows

WHAT = ("pose", "position", "orientation", "axis")
KEYS = (*WHAT, "along", "wrt", "directions", "axes", "weight", "tolerance")
MASS_CENTRE_KEYS = ("position", "wrt", "directions", "weight", "tolerance")
MASS_CENTRE = "centre of mass"
LARGEST, WEIGHTS = 1e100, (1e-30, 1e30)
"""Bounds of values in targets, and of weights: the square of their product, times the largest damping, is still a double."""
SHAPES = {"pose": (4, 4), "orientation": (3, 3), "position": (3,), "along": (3,), "axis": (3,)}
DIGITS = 1e-6
"""Largest deviation of a target's rotation from orthogonality: six digits, as for the poses of a model."""


def rows_of(model: Any, targets: Any, centre_of_mass: Any, tolerance: Any) -> tuple[list[Rows], int | None]:
    """Return the rows of all targets, and the number of states for which there are targets, None if each is one for all.

    ModelError names the frame, the fault, and the choices.
    """
    overall = _tolerance(tolerance, "tolerance")
    rows: list[Rows] = []
    counts: dict[str, int] = {}
    for frame, given in _pairs(targets):
        handle = model.frame(frame)
        name = handle.name
        if handle.kind == "base":
            raise _core.ModelError("a target of the base, which moves nowhere; name a body, a node or a loose frame")
        keys = _keys(given, f"target of {name!r}", KEYS)
        rows.append(_frame_rows(model, handle, keys, overall))
        counts |= _counts(keys, name)
    if centre_of_mass is not None:
        keys = _keys(centre_of_mass, f"target of the {MASS_CENTRE}", MASS_CENTRE_KEYS)
        rows.append(_mass_centre_rows(model, keys, overall))
        counts |= _counts(keys, MASS_CENTRE)
    if not rows:
        raise _core.ModelError("no target: give {frame: pose}, or centre_of_mass=")
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{count} of {what}" for what, count in counts.items())
        raise _core.ModelError(f"targets of batches of different sizes: {told}")
    return [*rows, *_loop_rows(model, overall)], next(iter(counts.values()), None)


def _loop_rows(model: Any, overall: tuple[float, float]) -> list[Rows]:
    """Return every loop's rows of positions: a configuration with open loops is not one of the model.

    Angles are rows about axes, and couplings of angles alone.
    """
    found: list[Rows] = []
    for loop in model.loops.values():
        chosen = loop.slice.start + np.flatnonzero(model.loops.of_positions[loop.slice])
        if not len(chosen):
            continue
        names = tuple(model.loops.rows[i] for i in chosen)
        if loop.kind == "coupling":
            angular = np.array([pin_coordinates(model)[model.loops.coupled(loop.name)].all()])
        else:
            angular = np.array([name.removeprefix(f"{loop.name}: ").startswith(("about", "between")) for name in names])
        name, weights = f"loop {loop.name!r}", np.ones(len(names))
        found.append(LoopRows(name, names, angular, tolerance=overall, weights=weights, model=model, chosen=chosen))
    return found


def _counts(given: dict[str, Any], name: str) -> dict[str, int]:
    """Return the sizes of the batches among the values of a target, which are checked."""
    shapes = {key: np.shape(given[key]) for key in SHAPES if key in given}
    return {f"{key} of {name!r}": shape[0] for key, shape in shapes.items() if len(shape) > len(SHAPES[key])}


def _pairs(targets: Any) -> list[tuple[Any, Any]]:
    if targets is None:
        return []
    if isinstance(targets, Mapping):
        return list(targets.items())
    if isinstance(targets, Iterable) and not isinstance(targets, (str, np.ndarray)):
        pairs = list(targets)
        if all(isinstance(pair, tuple) and len(pair) == 2 for pair in pairs):
            return pairs
    raise _core.ModelError(f"targets must be a dictionary {{frame: target}}, or a list of such pairs, not {targets!r:.80}")


def _keys(given: Any, what: str, known: tuple[str, ...]) -> dict[str, Any]:
    """Return a target as a dictionary; an array is a pose, an orientation or a position, by its shape."""
    if isinstance(given, Mapping):
        for key in given:
            if key not in known:
                near = get_close_matches(str(key), known, 1)
                said = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known)}"
                raise _core.ModelError(f"the {what} has no {key!r}; {said}")
        return dict(given)
    array = _core.real_array(given, what)
    for key in ("pose", "orientation", "position"):  # three positions (3, 3) are one orientation, unless their key differs
        shape = SHAPES[key]
        if key in known and array.shape[-len(shape) :] == shape and array.ndim <= len(shape) + 1:
            return {key: array}
    shapes = "a pose (4, 4), an orientation (3, 3) or a position (3,), or a batch of them"
    raise _core.ModelError(f"the {what} is {shapes}, not an array of shape {array.shape}")


def _values(given: dict[str, Any], key: str, what: str) -> np.ndarray:
    """Return values (T, ...) of the key's shape, T = 1 for all members."""
    shape, array = SHAPES[key], np.array(_core.real_array(given[key], f"{key} of the {what}"), float)
    if array.shape[-len(shape) :] != shape or array.ndim > len(shape) + 1:
        raise _core.ModelError(f"{key} of the {what} takes shape {shape}, with a leading axis for a batch, not {array.shape}")
    if not np.isfinite(array).all():
        at = np.argwhere(~np.isfinite(array))[0].tolist()
        raise _core.ModelError(f"{key} of the {what}: entry {at} is {array[tuple(at)]}")
    if np.abs(array).max(initial=0.0) > LARGEST:
        raise _core.ModelError(f"{key} of the {what}: {np.abs(array).max():.0e} is beyond {LARGEST:.0e}; take other units")
    return array[None] if array.ndim == len(shape) else array


def _rotations(R: np.ndarray, what: str) -> np.ndarray:
    """Return the nearest rotations to these matrices. ModelError for a matrix that is not a rotation to six digits."""
    off = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(-1, -2), initial=0.0)
    wrong = np.flatnonzero((off > DIGITS) | (np.linalg.det(R) < 0))
    if len(wrong):
        b = int(wrong[0])
        at = f" of state {b}" if len(R) > 1 else ""
        turned = "it mirrors" if off[b] <= DIGITS else f"R*R is {off[b]:.1e} from the identity"
        raise _core.ModelError(f"the {what}: its matrix{at} is no rotation, {turned}")
    U, _, Vt = np.linalg.svd(R)
    return U @ Vt


def _tolerance(given: Any, what: str) -> tuple[float, float]:
    pair = np.atleast_1d(_core.real_array(given, what)).tolist()
    if np.ndim(given) > 1 or len(pair) not in (1, 2) or not all(x > 0 and np.isfinite(x) for x in pair):
        raise _core.ModelError(f"{what} must be a positive number for rad and m, or a pair (rad, m), not {given!r}")
    return pair[0], pair[-1]


def _weights(given: dict[str, Any], angular: np.ndarray, what: str) -> np.ndarray:
    """Return the weights of every row, 1/rad or 1/m."""
    pair = np.atleast_1d(_core.real_array(given.get("weight", 1.0), f"weight of the {what}")).tolist()
    if len(pair) not in (1, 2) or not all(x > 0 and np.isfinite(x) for x in pair):
        raise _core.ModelError(f"weight of the {what} must be a positive number, or a pair (1/rad, 1/m), not {given['weight']!r}")
    if not all(WEIGHTS[0] <= x <= WEIGHTS[1] for x in pair):
        raise _core.ModelError(f"weight of the {what}: from {WEIGHTS[0]:.0e} to {WEIGHTS[1]:.0e}, not {given['weight']!r}")
    return np.where(angular, pair[0], pair[-1])


def _chosen(given: dict[str, Any], possible: tuple[str, ...], what: str) -> list[str]:
    if (directions := given.get("directions")) is None:
        return list(possible)
    named = several(directions)
    if not named or len(set(map(str, named))) < len(named) or any(one not in possible for one in map(str, named)):
        raise _core.ModelError(f"directions of the {what} must be different ones of {', '.join(possible)}, not {named!r:.80}")
    return [one for one in possible if one in named]


def _common(given: dict[str, Any], name: str, names: list[str], what: str, overall: tuple[float, float]) -> dict[str, Any]:
    angular = np.array([not one.startswith(("x", "y", "z")) for one in names])
    tolerance = _tolerance(given["tolerance"], f"tolerance of the {what}") if "tolerance" in given else overall
    weights = _weights(given, angular, what)
    return dict(name=name, names=tuple(f"{name}.{one}" for one in names), angular=angular, tolerance=tolerance, weights=weights)


def _frame_rows(model: Any, frame: Any, given: dict[str, Any], overall: tuple[float, float]) -> Rows:
    what = f"target of {frame.name!r}"
    asked = [key for key in WHAT if key in given]
    if not asked or ("pose" in asked or "axis" in asked) and len(asked) > 1:
        raise _core.ModelError(
            f"the {what} takes one of pose, position, orientation, position and orientation, or axis and along; it has {asked or 'none'}"
        )
    wrt = model.frame(given.get("wrt"))
    if asked == ["axis"]:
        return _pointing_rows(frame, wrt, given, what, overall)
    if "along" in given:
        raise _core.ModelError(f"the {what}: along= is the direction of an axis; give axis= with it")
    rotation = position = None
    if "pose" in given:
        poses = _values(given, "pose", what)
        if not np.array_equal(poses[:, 3], np.broadcast_to([0, 0, 0, 1.0], (len(poses), 4))):
            raise _core.ModelError(f"pose of the {what}: its last row is not (0, 0, 0, 1)")
        rotation, position = _rotations(poses[:, :3, :3], what), poses[:, :3, 3]
    if "position" in given:
        position = _values(given, "position", what)
    if "orientation" in given:
        rotation = _rotations(_values(given, "orientation", what), what)
    possible = (*(TWIST[:3] if rotation is not None else ()), *(TWIST[3:] if position is not None else ()))
    names = _chosen(given, possible, what)
    axes = given.get("axes", "aligned")
    if isinstance(axes, str) and axes == "target" and rotation is None:
        raise _core.ModelError(f"the {what} has no axes of its own without an orientation; give axes='aligned', or a frame")
    if isinstance(axes, str) and axes in ("aligned", "target"):
        chosen_axes = None if axes == "aligned" else axes
    else:
        chosen_axes = model.frame(axes)
    rows = [TWIST.index(one) for one in names]
    return PoseRows(
        **_common(given, frame.name, names, what, overall), frame=frame, wrt=wrt, axes=chosen_axes, rotation=rotation, position=position,
        chosen_rotation=[i for i in rows if i < 3], chosen_position=[i - 3 for i in rows if i >= 3],
    )  # fmt: skip


def _pointing_rows(frame: Any, wrt: Any, given: dict[str, Any], what: str, overall: tuple[float, float]) -> Rows:
    for key in ("directions", "axes"):
        if key in given:
            raise _core.ModelError(f"the {what}: an axis along a direction takes no {key}=")
    if "along" not in given:
        raise _core.ModelError(f"the {what}: axis= without along=, the direction in the axes of wrt that it is to have")
    units = {}
    for key in ("axis", "along"):
        vectors = _values(given, key, what)
        length = np.linalg.norm(vectors, axis=-1, keepdims=True)
        if not np.all(length > 0):
            raise _core.ModelError(f"{key} of the {what} has no direction: its length is zero")
        units[key] = vectors / length
    if np.ndim(given["axis"]) != 1:
        raise _core.ModelError(f"axis of the {what} is one for all states, (3,); a batch has along=")
    along = units["along"]
    return PointingRows(
        **_common(given, frame.name, ["tilt1", "tilt2"], what, overall), frame=frame, wrt=wrt, axis=units["axis"][0], along=along,
        across=np.linalg.svd(along[:, None, :])[2][:, 1:],
    )  # fmt: skip


def _mass_centre_rows(model: Any, given: dict[str, Any], overall: tuple[float, float]) -> Rows:
    what = f"target of the {MASS_CENTRE}"
    if "position" not in given:
        raise _core.ModelError(f"the {what} takes a position")
    wrt = model.frame(given.get("wrt"))
    names = _chosen(given, TWIST[3:], what)
    return MassCentreRows(
        **_common(given, MASS_CENTRE, names, what, overall), model=model, wrt=None if wrt.kind == "base" else wrt,
        position=_values(given, "position", what), chosen=[TWIST.index(one) - 3 for one in names],
    )  # fmt: skip
