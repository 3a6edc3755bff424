"""Direct calls beside other packages' on the same models, in one run: `pycraft bench --peers`.

Every figure is the least of several medians, and what a ratio compares is timed in turn. Kernels are timed inside C++, checks included, one
state after another of a set; a peer has only its call from Python, so what its bindings take is measured on a model without joints and
taken off. Each result is checked against the peer's before it is timed.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from functools import partial
from importlib.resources import as_file, files
from typing import Any

import numpy as np

from .. import _core
from ..interop import pinocchio as convention
from ..interop.export import PeerRefusal, to_mjcf, to_pinocchio
from ..interop.mujoco import to_mujoco
from ..interop.packages import required
from ..models import robots
from ..models.generators import chain

CHAINS = (10, 30, 100, 300, 1000)
LONGEST = (10_000, 100_000)
"""Chains that only calls of cost O(N) are timed on."""
LINEAR = ("forward_dynamics", "inverse_dynamics")
WITH_PINOCCHIO = 400
"""Links of the longest chain with Pinocchio beside: its work space grows as nv³, 32 GB at 1000."""
STATES = 8
BATCH = 1024

GOALS = {  # of the kernels in C++; from Python
    "forward_dynamics": (3.0, 2.0),
    "inverse_dynamics": (2.0, 2.0),
    "mass_matrix": (1.3, None),
    "mass_matrix_inverse": (1.5, None),
    "inverse_dynamics_derivatives": (1.5, None),
    "forward_dynamics_derivatives": (2.0, None),
}
BATCH_GOALS = {"baseline": (None, None), "avx2": (6.0, 10.0), "avx512": (12.0, 20.0)}
"""Of a state of a batch over one call of the peer, in double and in single precision."""


@dataclass
class Row:
    """One call on one model, microseconds; a peer's time in C++ is that from Python less what its bindings take."""

    model: str
    nv: int
    call: str
    kernel: float
    python: float
    peers: dict[str, float] = field(default_factory=dict)
    peer_kernel: float | None = None
    error: float | None = None

    @property
    def ratio(self) -> float | None:
        """Pinocchio's kernel over ours."""
        return None if self.peer_kernel is None else self.peer_kernel / self.kernel

    @property
    def python_ratio(self) -> float | None:
        """The fastest peer over ours, both called from Python."""
        return min(self.peers.values()) / self.python if self.peers else None


@dataclass
class BatchRow:
    """A state of a batch of `BATCH`, microseconds, and one call of the peer's kernel over it."""

    model: str
    double: float
    single: float
    ratios: tuple[float, float] | None = None


@dataclass
class Measured:
    """All of a run."""

    machine: dict[str, str]
    rows: list[Row] = field(default_factory=list)
    batches: list[BatchRow] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    def as_json(self) -> dict[str, Any]:
        """Plain data, ratios and fitted exponents included."""
        rows = [{**asdict(row), "ratio": row.ratio, "python_ratio": row.python_ratio} for row in self.rows]
        return {**asdict(self), "rows": rows, "exponents": exponents(self.rows)}


def machine() -> dict[str, str]:
    """What was measured on."""
    model = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as info:
            model = next((line.split(":", 1)[1].strip() for line in info if line.startswith("model name")), model)
    except OSError:
        pass
    return {"processor": model, "instruction set": _core.instruction_set(), "python": platform.python_version(), "numpy": np.__version__}


def pinned() -> None:
    """This process on one core, where the system lets it."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def elapsed(f: Callable[[], Any], seconds: float) -> float:
    """Seconds a call: the median of batches long enough for the clock, after a first call to warm up."""
    f()
    begin = time.perf_counter()
    f()
    count = max(1, int(2e-4 / max(time.perf_counter() - begin, 1e-8)))
    batches: list[float] = []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or len(batches) < 5:
        begin = time.perf_counter()
        for _ in range(count):
            f()
        batches.append((time.perf_counter() - begin) / count)
    return float(np.median(batches))


def least(seconds: float, *timed: Callable[[float], float], rounds: int = 3) -> list[float]:
    """Of each the least of several measurements, one after the other, in microseconds."""
    found = [[each(seconds / rounds) for each in timed] for _ in range(rounds)]
    return [1e6 * min(of_one) for of_one in zip(*found, strict=True)]


class Pinocchio:
    """Pinocchio's calls on a model of ours, in our order where they are checked."""

    def __init__(self, model: Any, path: str | None):
        self.pin = required("pinocchio", "peers", "comparison with Pinocchio needs")
        floating = model.nq != model.nv
        if path is None:
            twin = to_pinocchio(model)
            self.model, self.q, self.S = twin.model, twin.q, np.eye(model.nv)[twin.of_v]
        else:  # joints about coordinate axes are then of Pinocchio's faster kinds
            self.model = convention.build(path, "free" if floating else "fixed")
            order = convention.coordinates(model, self.model)
            self.q, self.S = order.q, order.velocities(model.random_state(0).q)
        self.model.gravity.linear = np.array(model.gravity, float)
        self.data = self.model.createData()

    def calls(self, q: np.ndarray, v: np.ndarray, u: np.ndarray) -> dict[str, tuple[Callable[[], Any], Callable[[], np.ndarray]]]:
        """By our names: the call, and its value as we write it."""
        pin, model, data, S = self.pin, self.model, self.data, self.S
        q, v, u = self.q(q), S @ v, S @ u

        def full(upper: np.ndarray) -> np.ndarray:
            return S.T @ (np.triu(upper) + np.triu(upper, 1).T) @ S

        return {
            "forward_dynamics": (lambda: pin.aba(model, data, q, v, u), lambda: S.T @ pin.aba(model, data, q, v, u)),
            "inverse_dynamics": (lambda: pin.rnea(model, data, q, v, u), lambda: S.T @ pin.rnea(model, data, q, v, u)),
            "mass_matrix": (lambda: pin.crba(model, data, q), lambda: full(pin.crba(model, data, q))),
            "mass_matrix_inverse": (lambda: pin.computeMinverse(model, data, q), lambda: full(pin.computeMinverse(model, data, q))),
            "inverse_dynamics_derivatives": (
                lambda: pin.computeRNEADerivatives(model, data, q, v, u),
                lambda: S.T @ pin.computeRNEADerivatives(model, data, q, v, u)[1] @ S,
            ),
            "forward_dynamics_derivatives": (
                lambda: pin.computeABADerivatives(model, data, q, v, u),
                lambda: S.T @ pin.computeABADerivatives(model, data, q, v, u)[1] @ S,
            ),
        }

    def bindings(self, seconds: float) -> dict[str, float]:
        """What each call takes on a model without joints, seconds."""
        empty = Pinocchio.__new__(Pinocchio)
        empty.pin, empty.model, empty.q, empty.S = self.pin, self.pin.Model(), lambda q: q, np.eye(0)
        empty.data = empty.model.createData()
        return {name: elapsed(call, seconds) for name, (call, _) in empty.calls(np.zeros(0), np.zeros(0), np.zeros(0)).items()}


def models(quick: bool = False) -> Iterator[tuple[Any, str | None]]:
    """What is timed: robots with their files, then chains."""
    for name in ("ur5", "panda") if quick else ("ur5", "panda", "a1", "g1"):
        with as_file(files("pycraft.models") / "robots" / f"{name}.urdf") as path:
            yield getattr(robots, name)(), str(path)
    for n in CHAINS[:2] if quick else (*CHAINS, *LONGEST):
        yield chain(n, seed=1), None


def _states(model: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    states = [model.random_state(seed) for seed in range(STATES)]
    return np.array([s.q for s in states]), np.array([s.v for s in states]), np.array([s.v for s in states[::-1]])


def _ours(model: Any, call: str, q: np.ndarray, v: np.ndarray, u: np.ndarray) -> Callable[[], Any]:
    """The call from Python, as it is fastest."""
    n = model.nv
    vector, matrix = np.empty(n), np.empty((n, n) if n <= max(CHAINS) else (0, 0))
    return {
        "forward_dynamics": lambda: model.forward_dynamics(q, v, u, out=vector),
        "inverse_dynamics": lambda: model.inverse_dynamics(q, v, u, out=vector),
        "mass_matrix": lambda: model.mass_matrix(q, out=matrix),
        "mass_matrix_inverse": lambda: model.mass_matrix_inverse(q, out=matrix),
        "inverse_dynamics_derivatives": lambda: model.inverse_dynamics_derivatives(q, v, u),
        "forward_dynamics_derivatives": lambda: model.forward_dynamics_derivatives(q, v, u),
    }[call]


def _value(call: str, given: Any) -> np.ndarray:
    """What is compared: of derivatives those along velocities."""
    return given[1] if isinstance(given, tuple) else np.asarray(given)


def _row(model: Any, call: str, peer: Pinocchio | None, overhead: dict[str, float], seconds: float) -> Row:
    Q, V, U = _states(model)
    ours = _ours(model, call, Q[0], V[0], U[0])
    timed: list[Callable[[float], float]] = [lambda s: _core.time_dynamics(model, call, Q, V, U, s)["median"], partial(elapsed, ours)]
    row = Row(model.name, model.nv, call, 0.0, 0.0)
    if peer is not None:
        theirs, value = peer.calls(Q[0], V[0], U[0])[call]
        found, other = _value(call, ours()), value()
        row.error = float(np.abs(found - other).max() / np.abs(found).max())
        if not row.error < 1e-6:
            raise _core.EvaluationError(f"{call} of {model.name} is not Pinocchio's in the run that times both: off by {row.error:.1e}")
        timed.append(partial(elapsed, theirs))
    row.kernel, row.python, *of_peer = least(seconds, *timed)
    if of_peer:
        row.peers["Pinocchio"] = of_peer[0]
        row.peer_kernel = max(of_peer[0] - 1e6 * overhead[call], 1e-3)
    return row


def _with_mujoco(model: Any, row: Row, seconds: float, left_out: list[str]) -> None:
    """MuJoCo's `mj_forward` beside forward dynamics: kinematics, inertia and its factors, as that call has them."""
    try:
        import mujoco
    except ImportError:
        left_out.append("MuJoCo: not installed")
        return
    try:
        twin = mujoco.MjModel.from_xml_string(to_mjcf(model))
    except (ValueError, PeerRefusal) as refusal:
        left_out.append(f"MuJoCo on {model.name}: {refusal}")
        return
    data = mujoco.MjData(twin)
    q, v, u = (x[0] for x in _states(model))
    data.qpos, data.qvel = to_mujoco(model, q, v)
    data.qfrc_applied = u
    row.peers["MuJoCo"] = least(seconds, partial(elapsed, lambda: mujoco.mj_forward(twin, data)))[0]


def _batch(model: Any, peer_kernel: float | None, seconds: float) -> BatchRow:
    Q, V, U = (np.tile(x, (BATCH // STATES, 1)) for x in _states(model))
    out = np.empty_like(V)
    double, single = least(
        seconds,
        partial(elapsed, lambda: model.forward_dynamics(Q, V, U, out=out)),
        partial(elapsed, lambda: model.forward_dynamics(Q, V, U, precision="single", out=out)),
    )
    double, single = double / BATCH, single / BATCH
    return BatchRow(model.name, double, single, None if peer_kernel is None else (peer_kernel / double, peer_kernel / single))


def measure(seconds: float = 0.1, quick: bool = False, progress: Callable[[str], None] = lambda text: None) -> Measured:
    """All figures. `quick`: two robots and two short chains. MissingPackageError where Pinocchio is not installed."""
    required("pinocchio", "peers", "comparison with Pinocchio needs")
    pinned()
    found = Measured(machine())
    if not quick:
        found.left_out += ["ANYmal, Talos: their files come with no package that is needed here", "Drake, CasADi: not compared"]
    overhead: dict[str, float] = {}
    for model, path in models(quick):
        progress(model.name)
        model.gravity = (0, 0, -9.81)
        beyond = model.nv > max(CHAINS)
        peer = None if model.nv > WITH_PINOCCHIO else Pinocchio(model, path)
        if not beyond and peer is None:
            found.left_out.append(f"Pinocchio on {model.name}: its work space grows as nv³")
        overhead = overhead or (peer.bindings(seconds) if peer else {})
        calls = LINEAR if beyond else tuple(GOALS) if model.nv < max(CHAINS) else tuple(GOALS)[:-1]
        for call in calls:
            found.rows.append(_row(model, call, peer, overhead, seconds))
            if call == "forward_dynamics" and peer:
                _with_mujoco(model, found.rows[-1], seconds, found.left_out)
        if not beyond and model.nv <= 100:
            kernel = next(row.peer_kernel for row in found.rows if row.model == model.name and row.call == "forward_dynamics")
            found.batches.append(_batch(model, kernel, seconds))
    return found


def exponents(rows: list[Row]) -> dict[str, float]:
    """By call the fitted p of time ~ N^p on chains of 100 links and more."""
    fitted = {}
    for call in dict.fromkeys(row.call for row in rows):
        points = [(row.nv, row.kernel) for row in rows if row.call == call and row.model.startswith("chain") and row.nv >= 100]
        if len(points) >= 2:
            sizes, times = np.log(np.array(points)).T
            fitted[call] = float(np.polyfit(sizes, times, 1)[0])
    return fitted
