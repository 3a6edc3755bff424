"""Every robot of example-robot-data against Pinocchio: mass matrix, inverse, inverse and forward dynamics, Jacobians.

Bounds: 100 N eps relative for ℳ, inverse dynamics and Jacobians, times cond(ℳ) for the inverse and the forward dynamics. A
disagreement beyond its bound is settled in quad precision: both are compared with the same call there, and the table shows which one was
off.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..interop import pinocchio as convention
from ..interop.packages import required
from ..models.loaders.named_robots import example_folders

GRAVITY = (0.0, 0.0, -9.81)
QUANTITIES = ("mass matrix", "inverse dynamics", "Jacobians", "inverse", "forward dynamics")


@dataclass
class Comparison:
    """One robot, one root: worst relative differences over states in units of their bounds, or the reason for no comparison."""

    robot: str
    root: str
    nv: int = 0
    bodies: int = 0
    states: int = 0
    ratio: dict[str, float] = field(default_factory=dict)
    largest: dict[str, float] = field(default_factory=dict)
    condition: float = 0.0
    settled: list[str] = field(default_factory=list)
    singular: str = ""
    refused: str = ""

    @property
    def passed(self) -> bool:
        return not self.refused and all(r <= 1 for r in self.ratio.values())


def robot_files() -> list[Path]:
    """Return every URDF file of the installed example-robot-data. ModelError if it is not installed."""
    for folder in example_folders():
        return sorted(folder.rglob("*.urdf"))
    raise _core.ModelError("example-robot-data is not installed: pip install 'pycraft-soa[peers]'")


def compare(path: Path, root: str, states: int = 20, seed: int = 0) -> Comparison:
    """Compare one robot with Pinocchio at `states` random states."""
    from ..models.loaders.load import load
    from ..models.warning import ModelWarning

    result = Comparison(f"{path.parent.parent.name.removesuffix('_description')}/{path.stem}", root)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ModelWarning)
            model = load(path, root=root, mimic="free")
    except _core.Error as error:
        result.refused = f"refused here: {error}"
        return result
    try:
        pin_model = convention.build(str(path), root)
    except (ValueError, RuntimeError) as error:
        result.refused = f"refused by Pinocchio: {error}"
        return result
    try:
        twin = convention.coordinates(model, pin_model)
    except _core.ModelError as error:
        result.refused = f"different models: {error}"
        return result
    result.nv, result.bodies = model.nv, len(model.bodies)
    if model.nv == 0:
        result.refused = "no degrees of freedom"
        return result
    pin_model.gravity.linear = np.array(GRAVITY)
    model.gravity = GRAVITY
    rng = np.random.default_rng(seed)
    for _ in range(states):
        _compare_at(result, model, twin, model.random_state(rng), rng)
        result.states += 1
    return result


def _compare_at(result: Comparison, model: Any, twin: convention.Coordinates, state: Any, rng: np.random.Generator) -> None:
    """Compare all quantities at one state."""
    pinocchio = required("pinocchio", "peers", "comparison with Pinocchio needs")

    pin_model = twin.pin_model
    data = pin_model.createData()
    q, v, u = state.q, state.v, rng.uniform(-1, 1, model.nv)
    pq, S = twin.q(q), twin.velocities(q)
    pv, pu = S @ v, S @ u
    # Pinocchio's Python functions fill only the upper triangle.
    pm, minverse = (
        np.triu(A) + np.triu(A, 1).T for A in (pinocchio.crba(pin_model, data, pq), pinocchio.computeMinverse(pin_model, data, pq))
    )
    condition = float(np.linalg.cond(model.mass_matrix(q)))
    result.condition = max(result.condition, condition)
    bound = 100 * model.nv * float(np.finfo(float).eps)
    frames = [name for name in model.bodies if pin_model.existFrame(name, pinocchio.FrameType.BODY)]
    chosen = [frames[i] for i in rng.choice(len(frames), min(3, len(frames)), replace=False)] if frames else []
    theirs = {
        "mass matrix": S.T @ pm @ S,
        "inverse dynamics": S.T @ pinocchio.rnea(pin_model, data, pq, pv, pu),
        "Jacobians": np.array([convention.jacobian(pin_model, data, pq, f) @ S for f in chosen]),
        "inverse": S.T @ minverse @ S,
        "forward dynamics": S.T @ pinocchio.aba(pin_model, data, pq, pv, pu),
    }

    def mine(name: str, precision: str) -> np.ndarray:
        match name:
            case "mass matrix":
                return model.mass_matrix(q, precision=precision)
            case "inverse dynamics":
                return model.inverse_dynamics(q, v, u, precision=precision)
            case "Jacobians":
                return np.array([model.jacobian(f, q, precision=precision) for f in chosen])
            case "inverse":
                return model.mass_matrix_inverse(q, precision=precision)
            case _:
                return model.forward_dynamics(q, v, u, precision=precision)

    for name, value in theirs.items():
        inverse = name in ("inverse", "forward dynamics")
        if inverse and result.singular:
            continue
        try:
            _judge(result, name, partial(mine, name), value, bound * (condition if inverse else 1))
        except _core.SingularHingeError as error:
            result.singular = str(error).split(":")[0]
            result.ratio.pop("inverse", None)


def _judge(result: Comparison, name: str, mine: Callable[[str], np.ndarray], theirs: np.ndarray, bound: float) -> None:
    value = mine("double")
    scale = max(np.abs(value).max(initial=0.0), np.abs(theirs).max(initial=0.0), 1e-300)
    difference = float(np.abs(value - theirs).max(initial=0.0) / scale)
    ratio = difference / bound
    if ratio > 1:
        exact = mine("quad")
        own, peer = (float(np.abs(x - exact).max() / scale) for x in (value, theirs))
        note = f"{name}: differ by {difference:.0e}; from quad precision {own:.0e} here, {peer:.0e} in Pinocchio"
        if note not in result.settled and len(result.settled) < 3:
            result.settled.append(note)
        ratio = own / bound  # our own error counts
    result.ratio[name] = max(result.ratio.get(name, 0.0), ratio)
    result.largest[name] = max(result.largest.get(name, 0.0), difference)


def compare_all(states: int = 20, seed: int = 0, progress: Callable[[str], None] | None = None) -> list[Comparison]:
    """Compare every robot, fixed and floating. MissingPackageError without Pinocchio."""
    required("pinocchio", "peers", "comparison with Pinocchio needs")
    results = []
    for path in robot_files():
        for root in ("fixed", "free"):
            if progress:
                progress(f"{path.stem} ({root})")
            results.append(compare(path, root, states, seed))
    return results


def markdown(results: list[Comparison], states: int) -> str:
    """Return the committed table."""
    compared = [r for r in results if not r.refused]
    refused = [r for r in results if r.refused]
    lines = [
        "# Robots against Pinocchio",
        "",
        f"Largest relative differences over {states} random states; in parentheses the largest ratio to the bound (100 N eps; times",
        "cond(ℳ) for the inverse and the forward dynamics). Made by `pycraft peers`.",
        "",
        f"{len({r.robot for r in compared})} robots compared, {sum(r.passed for r in compared)} of {len(compared)} models within all "
        f"bounds, {len(refused)} not compared.",
        "",
        "| robot | root | bodies | nv | cond(ℳ) | " + " | ".join(QUANTITIES) + " |",
        "|" + "---|" * (5 + len(QUANTITIES)),
    ]
    for r in compared:
        cells = [f"{r.largest[k]:.0e} ({r.ratio[k]:.0e})" if k in r.ratio else "—" for k in QUANTITIES]
        lines.append(f"| {r.robot} | {r.root} | {r.bodies} | {r.nv} | {r.condition:.0e} | " + " | ".join(cells) + " |")
    if any(r.settled for r in compared):
        lines += ["", "## Settled in quad precision", ""]
        lines += [f"- {r.robot} ({r.root}): {note}" for r in compared for note in r.settled]
    if any(r.singular for r in compared):
        lines += [
            "",
            "## No inverse: a massless link on a hinge",
            "",
            "ℳ, inverse dynamics and Jacobians are compared; ℳ⁻¹ and forward dynamics do not exist.",
            "",
        ]
        lines += [f"- {r.robot} ({r.root}): {r.singular}" for r in compared if r.singular]
    if refused:
        lines += ["", "## Not compared", ""]
        for r in refused:
            text = r.refused.split("\n")[0]
            for part in text.split():
                if part.startswith("/"):  # a path of this machine says nothing elsewhere
                    text = text.replace(part, Path(part.rstrip(":;,")).name)
            lines.append(f"- {r.robot} ({r.root}): {text}")
    return "\n".join(lines) + "\n"
