"""`pycraft.compare`: one robot in two packages: differences between the two models, in words, and the remaining ones, in digits."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..interop.export import PinocchioModel
from .twins import MuJoCoTwin, OwnTwin, PinocchioTwin, Twin

QUANTITIES = ("mass matrix", "inverse dynamics", "forward dynamics")
SHOWN = 12
"""Number of differences of one kind that a report prints; `.differences` has all."""


class Difference(NamedTuple):
    """One difference between two models.

    `kind` names it; `physical`: whether it is more than a convention; `decides`: whether it alone makes the two move differently, although
    the compared values do not show it.
    """

    kind: str
    text: str
    physical: bool
    decides: bool = False


@dataclass
class ModelComparison:
    """The result of `pycraft.compare`.

    True if the two models are the same: all quantities are within their bounds once gravity and rotor inertia are equal, and no effect of
    the other model, such as damping or a tendon, moves it differently. Contacts and stops that act at none of the states are named and do
    not count.

    `as_they_are` and `in_common` hold the largest relative difference of each quantity over the states: of the two packages' arrays entry
    by entry, and after conversion of conventions, gravity and rotor inertias. `bounds` are bounds on rounding.
    """

    ours: str
    theirs: str
    states: int
    differences: list[Difference] = field(default_factory=list)
    as_they_are: dict[str, float] = field(default_factory=dict)
    in_common: dict[str, float] = field(default_factory=dict)
    bounds: dict[str, float] = field(default_factory=dict)

    def __bool__(self) -> bool:
        same = all(self.in_common[name] <= self.bounds[name] for name in self.in_common)
        return bool(self.in_common) and same and not any(difference.decides for difference in self.differences)

    @property
    def worst(self) -> float:
        """The largest relative difference that remains in common coordinates."""
        return max(self.in_common.values(), default=0.0)

    def __repr__(self) -> str:
        lines = [f"{self.ours} beside {self.theirs}, {self.states} states"]
        for title, physical in (("Other conventions", False), ("Other models", True)):
            found = [d for d in self.differences if d.physical == physical]
            lines += [f"{title}:"] * bool(found) + [f"  {d.kind}: {d.text}" for d in found[:SHOWN]]
            lines += [f"  and {len(found) - SHOWN} more: see .differences"] * (len(found) > SHOWN)
        if not self.differences:
            lines.append("No difference found.")
        lines += ["", f"{'relative difference':<22}{'as they are':>12}{'in common':>12}{'bound':>10}"]
        for name in self.in_common:
            lines.append(f"{name:<22}{self.as_they_are[name]:>12.1e}{self.in_common[name]:>12.1e}{self.bounds[name]:>10.0e}")
        lines.append("the same robot" if self else "NOT the same robot: see what differs above")
        return "\n".join(lines)


def compare(model: Any, other: Any, *, states: int = 5, seed: int = 0, root: str | None = None) -> ModelComparison:
    """Compare a model with another package's model of the same robot.

    Hinges and joints are matched by name. Order of joints, quaternions, axes of velocities and cosine-sine pairs are conventions: they are
    reported, and converted. Gravity and rotor inertia (armature) are reported, and taken from the other model for the comparison; v ×* (J
    v) of rotors that the other package lacks (docs/conventions.md) is reported, and omitted. Masses, centres of mass, inertias and
    placements that differ are reported with the body; then the values differ as well.

    Parameters
    ----------
    model : Multibody
    other : a `pinocchio.Model` (or the result of `interop.export.to_pinocchio`), a `mujoco.MjModel`, another Multibody, or the path of a
        TOML, URDF or MJCF file
    states : random states, drawn from `seed`
    root : "fixed" or "free", for a URDF file; default: as in `model`

    Returns
    -------
    ModelComparison
        Relative differences (in the largest entry) of the mass matrix, inverse and forward dynamics; bounds are 100 n eps, times the
        condition of ℳ for the forward dynamics.

    Raises
    ------
    ModelError
        Joints that only one of the two has.

    Examples
    --------
    >>> import pycraft as pc
    >>> arm, other = pc.chain(3), pc.chain(3)
    >>> other.gravity = (0, -9.81, 0)
    >>> print(pc.compare(arm, other).differences[0].text)
    (0, 0, 0) here, (0, -9.81, 0) there
    """
    if not hasattr(model, "forward_dynamics") or not hasattr(model, "hinges"):
        raise _core.ModelError(f"the first model of compare must be a Multibody, not {type(model).__name__}")
    twin = _twin(model, other, root)
    rng = np.random.default_rng(seed)
    drawn = [model.random_state(rng) for _ in range(states)]
    result = ModelComparison(f"{model.name} here", twin.name, states)
    result.differences += [Difference(kind, text, False) for kind, text in twin.conventions()]
    common = _in_common(model, twin, result)
    result.differences += [Difference(kind, text, kind != "body frame") for kind, text in _bodies_apart(model, twin, drawn)]
    result.differences += [Difference(kind, text, True, decides) for kind, text, decides in twin.effects_apart(drawn)]
    for state in drawn:
        _compare_at(result, model, common, twin, state, rng.uniform(-1, 1, model.nv))
    return result


def _twin(model: Any, other: Any, root: str | None) -> Twin:
    if isinstance(other, (str, PathLike)):
        from ..models.loaders.load import is_toml, load

        first = next(iter(model.hinges.values()), None)
        free = first is not None and first.kind == "free" and first.name == "root"
        return OwnTwin(model, load(other, root=root or ("free" if free and not is_toml(other) else "fixed")))  # TOML specifies it itself
    if hasattr(other, "forward_dynamics") and hasattr(other, "hinges"):
        return OwnTwin(model, other)
    if isinstance(other, PinocchioModel):
        other = other.model
    package = type(other).__module__.split(".")[0]
    if package == "pinocchio":
        return PinocchioTwin(model, other)
    if package == "mujoco" and hasattr(other, "qpos0"):
        return MuJoCoTwin(model, other)
    raise _core.ModelError(
        "compare takes a pinocchio.Model, a mujoco.MjModel, a Multibody or the path of a TOML, URDF or MJCF file, "
        f"not {type(other).__name__}"
    )


def _in_common(model: Any, twin: Twin, result: ModelComparison) -> Any:
    """Return our model with the other's gravity and rotor inertias; changes are reported."""
    common = copy.deepcopy(model)
    there = np.asarray(twin.gravity, float)
    if not np.allclose(there, model.gravity, rtol=1e-14, atol=0):
        result.differences.append(Difference("gravity", f"{_vector(model.gravity)} here, {_vector(there)} there", True))
        common.gravity = there
    for name, hinge in model.hinges.items():
        own, theirs = hinge.rotor_inertia, twin.armature[hinge.v_slice]
        if not np.allclose(own, theirs, rtol=1e-14, atol=0):
            result.differences.append(Difference("rotor inertia", f"{name}: {_vector(own)} here, {_vector(theirs)} there", True))
            common.hinges[name].rotor_inertia = theirs
        turning = _rotor_forces(common, twin, np.linspace(1.0, 2.0, model.nv))[hinge.v_slice]
        if turning.any():
            text = f"{name}: v ×* (J v) of its rotors is in the equations of motion here, not there, and left out of what is compared"
            result.differences.append(Difference("rotor inertia", text, True))
    return common


def _rotor_forces(common: Any, twin: Twin, v: np.ndarray) -> np.ndarray:
    """Return v ×* (J v) (nv,) if the other package omits it."""
    return np.where(twin.lacks_rotor_forces(), common.rotor_forces(v), 0.0)


def _bodies_apart(model: Any, twin: Twin, drawn: list[Any]) -> list[tuple[str, str]]:
    """Report bodies with different motion, mass, centre of mass or inertia, each seen in the body's own axes."""
    found: list[tuple[str, str]] = []
    if not drawn:
        return found
    theirs = [twin.bodies(s.q) for s in drawn[:2]]
    for body in model.bodies.values():
        if body.name not in theirs[0]:
            continue
        frames = [np.linalg.inv(there[body.name].pose) @ model.pose(body.name, s.q) for there, s in zip(theirs, drawn, strict=False)]
        offset = frames[0]
        size = 1 + np.abs(model.pose(body.name, drawn[0].q)[:3, 3]).max()
        if np.abs(frames[-1] - offset).max() > 1e-9 * size:
            found.append(("geometry", f"{body.name} moves otherwise: a placement or an axis inboard of it differs"))
            continue
        if np.abs(offset - np.eye(4)).max() > 1e-9 * size:
            found.append(("body frame", f"{body.name}: its frame lies {_vector(offset[:3, 3])} from the joint's there"))
        there = theirs[0][body.name].seen_from(np.linalg.inv(offset))
        for what, a, b, scale in (
            ("mass", body.mass, there.mass, body.mass),
            ("centre of mass", body.com, there.com, np.linalg.norm(body.com) + np.sqrt(np.trace(body.inertia) / max(body.mass, 1e-300))),
            ("inertia", body.inertia, there.inertia, np.abs(body.inertia).max()),
        ):
            if body.mass == there.mass == 0:
                continue
            if np.abs(np.subtract(a, b)).max() > 1e-9 * max(scale, 1e-300):
                found.append((what, f"{body.name}: {_vector(a)} here, {_vector(b)} there"))
    return found


def _compare_at(result: ModelComparison, model: Any, common: Any, twin: Twin, state: Any, u: np.ndarray) -> None:
    """Compare all quantities at one state, on arrays in each package's form and on our coordinates."""
    q, v, n = state.q, state.v, model.nv
    T = twin.velocities(q)  # v_theirs = T v
    eps = float(np.finfo(float).eps)
    M = common.mass_matrix(q)
    condition = float(np.linalg.cond(M)) if n else 1.0
    left_out = _rotor_forces(common, twin, v)
    raw: dict[str, tuple[Callable[[], np.ndarray], np.ndarray]] = {
        "mass matrix": (lambda: common.mass_matrix(q), twin.mass_matrix(q)),
        "inverse dynamics": (lambda: common.inverse_dynamics(q, v, u) - left_out, twin.inverse_dynamics(q, v, u)),
        "forward dynamics": (lambda: common.forward_dynamics(q, v, u + left_out), twin.forward_dynamics(q, v, u)),
    }
    as_is = {
        "mass matrix": (model.mass_matrix(q), T @ raw["mass matrix"][1] @ T.T),
        "inverse dynamics": (model.inverse_dynamics(q, v, u), T @ raw["inverse dynamics"][1]),
        "forward dynamics": (model.forward_dynamics(q, v, u), T @ raw["forward dynamics"][1]),
    }
    for name, (ours, theirs) in raw.items():
        bound = 100 * max(n, 1) * eps * (condition if name == "forward dynamics" else 1)
        result.bounds[name] = max(result.bounds.get(name, 0.0), bound)
        result.in_common[name] = max(result.in_common.get(name, 0.0), _relative(ours(), theirs))
        result.as_they_are[name] = max(result.as_they_are.get(name, 0.0), _relative(*as_is[name]))


def _relative(a: np.ndarray, b: np.ndarray) -> float:
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return float("inf")
    scale = max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0))
    return float(np.abs(a - b).max(initial=0.0) / scale) if scale > 0 else 0.0


def _vector(x: Any) -> str:
    flat = np.ravel(x)
    text = ", ".join(f"{value + 0.0:.6g}" for value in flat)
    return text if len(flat) == 1 else f"({text})"
