"""Direct calls beside other packages' on the same models, in one run: the measurements of `pycraft bench --peers`.

Every figure is the least of several medians, and calls that a ratio compares are timed in turn. Ours are timed inside C++, checks included,
one state after another of a set, and from Python. Peers are installed packages, called from Python. For forward and inverse dynamics
Pinocchio has loops in C++ over states, which give its time in C++; for its other calls that time is the time from Python minus the
bindings' time on a model without joints, and minus the copies of matrices that they make. Each result is checked against the peer's before
it is timed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

import numpy as np

from .. import _core
from ..interop.peer import PeerRefusal
from . import compiled_speed
from .clock import Clock, Time, elapsed, in_turn, machine, pin_to_one_core
from .compiled_speed import CompiledRow, compiled_row
from .peer_calls import Call, other_packages
from .timed_models import CHAINS, timed_models

LINEAR = ("forward_dynamics", "inverse_dynamics", "operational_space_inertia")
STATES = 8
BATCH = 1024
COLUMNS = 64
WRONG = 1e-6
"""Largest relative difference of two packages' results, of the largest entry; beyond, nothing is timed."""

GOALS: dict[str, tuple[float | None, float | None]] = {  # times faster than the fastest peer: in C++; from Python
    "forward_dynamics": (3.0, 2.0),
    "inverse_dynamics": (2.0, 2.0),
    "mass_matrix": (1.3, 1.3),
    "mass_matrix_inverse": (1.5, 1.5),
    "inverse_dynamics_derivatives": (1.5, 1.5),
    "forward_dynamics_derivatives": (2.0, 2.0),
    "coriolis_matrix": (1.3, 1.3),
    "operational_space_inertia": (1.5, 1.5),
    "operational_space_inertia_of_two": (1.5, None),
    "mass_matrix_inverse_product": (None, None),
}
BATCH_GOALS = {"baseline": (None, None), "avx2": (6.0, 10.0), "avx512": (12.0, 20.0)}
"""Goals for a state of a batch over one call of the peer in C++, in double and in single precision, by instruction set."""


@dataclass
class Row:
    """One call on one model: our times in C++ and from Python, the peers' from Python by name, Pinocchio's in C++; ours against each."""

    model: str
    nv: int
    call: str
    kernel: Time
    python: Time
    peers: dict[str, Time] = field(default_factory=dict)
    peer_kernel: Time | None = None
    errors: dict[str, float] = field(default_factory=dict)

    @property
    def ratio(self) -> float | None:
        """Pinocchio's time in C++ over ours."""
        return None if self.peer_kernel is None else self.peer_kernel.median / self.kernel.median

    @property
    def python_ratio(self) -> float | None:
        """The fastest peer's time over ours, both called from Python."""
        return min(t.median for t in self.peers.values()) / self.python.median if self.peers else None

    @property
    def met(self) -> tuple[bool | None, bool | None]:
        """Return whether the goals are met, in C++ and from Python; None without a goal or a peer."""
        goals, ratios = GOALS[self.call], (self.ratio, self.python_ratio)
        cpp, python = (None if goal is None or ratio is None else ratio >= goal for goal, ratio in zip(goals, ratios, strict=True))
        return cpp, python


@dataclass
class BatchRow:
    """Forward dynamics of one state of a batch of `BATCH`, and one call of Pinocchio's in C++ over it (double, single)."""

    model: str
    nv: int
    double: Time
    single: Time
    ratios: tuple[float, float] | None = None


@dataclass
class Measured:
    """All results of a run."""

    machine: dict[str, str]
    rows: list[Row] = field(default_factory=list)
    batches: list[BatchRow] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    compiled: list[CompiledRow] = field(default_factory=list)

    def as_json(self) -> dict[str, Any]:
        """Return plain data: times in microseconds, with ratios, goals met and fitted exponents."""
        rows = []
        for row in self.rows:
            times: dict[str, Any] = {"kernel": row.kernel._asdict(), "python": row.python._asdict()}
            times["peer_kernel"] = row.peer_kernel and row.peer_kernel._asdict()
            peers = {name: t._asdict() for name, t in row.peers.items()}
            judged = {"ratio": row.ratio, "python_ratio": row.python_ratio, "goals": GOALS[row.call], "met": row.met}
            rows.append({**asdict(row), **times, "peers": peers, **judged})
        batches = [{**asdict(row), "double": row.double._asdict(), "single": row.single._asdict()} for row in self.batches]
        compiled = [row.as_json() for row in self.compiled]
        fitted = {"ours": exponents(self.rows), "Pinocchio": exponents(self.rows, peer=True)}
        return {**asdict(self), "unit": "microseconds", "rows": rows, "batches": batches, "compiled": compiled, "exponents": fitted}

    def leave_out(self, text: str) -> None:
        """Report once a call that is not compared, and the reason."""
        if text not in self.left_out:
            self.left_out.append(text)


def states_of(model: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q (8, nq), v and u (8, nv): the timed states."""
    states = [model.random_state(seed) for seed in range(STATES)]
    return np.array([s.q for s in states]), np.array([s.v for s in states]), np.array([s.v for s in states[::-1]])


class OwnCalls:
    """Our calls on a model at the first of its states, in their fastest form from Python, and their clocks in C++."""

    def __init__(self, model: Any, states: tuple[np.ndarray, np.ndarray, np.ndarray]):
        self.model, self.states = model, states
        Q, V, U = states
        self.q, self.v, self.u = Q[0], V[0], U[0]
        n = model.nv
        self.X = np.random.default_rng(0).uniform(-1, 1, (n, COLUMNS)) if n <= max(CHAINS) else np.empty((n, 0))
        self.vector, self.matrix, self.square = np.empty(n), np.empty((n, n) if n <= max(CHAINS) else (0, 0)), np.empty((6, 6))
        bodies = list(model.bodies)
        self.tip, self.both = bodies[-1], [bodies[-1], bodies[len(bodies) // 2]]
        H, phi, M, J = model.soa("H phi M J")
        self.inverse = (H @ phi @ M @ phi.T @ H.T + J).inv()

    @property
    def calls(self) -> list[str]:
        """Calls of `GOALS` that the model has at every state: two nodes may not move in every direction independently."""
        Q = self.states[0]
        try:
            self.model.operational_space_inertia(self.both, Q)
        except _core.SingularOperatorError:
            return [call for call in GOALS if call != "operational_space_inertia_of_two"]
        return list(GOALS)

    def run(self, call: str) -> Any:
        """Return the result of the call."""
        model, q, v, u = self.model, self.q, self.v, self.u
        match call:
            case "forward_dynamics" | "inverse_dynamics":
                return getattr(model, call)(q, v, u, out=self.vector)
            case "mass_matrix" | "mass_matrix_inverse":
                return getattr(model, call)(q, out=self.matrix)
            case "coriolis_matrix":
                return model.coriolis_matrix(q, v, out=self.matrix)
            case "operational_space_inertia":
                return model.operational_space_inertia(self.tip, q, out=self.square)
            case "operational_space_inertia_of_two":
                return model.operational_space_inertia(self.both, q)
            case "mass_matrix_inverse_product":
                model.q = q
                return self.inverse @ self.X
        return getattr(model, call)(q, v, u)

    def from_python(self, call: str) -> Callable[[], Any]:
        """Return the function to time: nothing is looked up while the clock runs."""
        model, q, v, u, vector, matrix = self.model, self.q, self.v, self.u, self.vector, self.matrix
        tip, square = self.tip, self.square
        own = getattr(model, call, None)
        match call:
            case "forward_dynamics" | "inverse_dynamics":
                return lambda: own(q, v, u, out=vector)  # type: ignore[misc]  # a call of the model
            case "mass_matrix" | "mass_matrix_inverse":
                return lambda: own(q, out=matrix)  # type: ignore[misc]  # a call of the model
            case "coriolis_matrix":
                return lambda: own(q, v, out=matrix)  # type: ignore[misc]  # a call of the model
            case "operational_space_inertia":
                return lambda: own(tip, q, out=square)  # type: ignore[misc]  # a call of the model
            case "operational_space_inertia_of_two" | "mass_matrix_inverse_product":
                return lambda: self.run(call)
        return lambda: own(q, v, u)  # type: ignore[misc]  # a call of the model

    def in_cpp(self, call: str) -> Clock:
        """Return a clock without Python in the loop."""
        if call == "mass_matrix_inverse_product":
            self.model.q = self.q
            return partial(_core.time_apply, self.inverse, self.X)
        return partial(_core.time_dynamics, self.model, call, *self.states)


def _checked(name: str, call: str, given: Any, expected: tuple[np.ndarray, ...], whose: str) -> float:
    """Return the largest relative difference of a call's arrays. Raises EvaluationError if they differ."""
    ours = given if isinstance(given, tuple) else (given,)
    worst = 0.0
    for mine, other in zip(ours, expected, strict=True):
        size = max(float(np.abs(mine).max(initial=0.0)), float(np.abs(other).max(initial=0.0)), 1e-300)
        error = float(np.abs(mine - other).max(initial=0.0)) / size
        if not error < WRONG:
            raise _core.EvaluationError(f"{call} of {name} is not {whose} in the run that times it: off by {error:.1e}")
        worst = max(worst, error)
    return worst


def _checked_alone(name: str, call: str, own: OwnCalls) -> float:
    """Check without a peer: against extended precision; derivatives against each other, ℳ ∂v̇ = -∂τ at the accelerations of τ."""
    model, q, v, u = own.model, own.q, own.v, own.u
    exact = partial(getattr(model, call, model.mass_matrix_inverse), precision="extended")
    match call:
        case "forward_dynamics" | "inverse_dynamics":
            return _checked(name, call, own.run(call), (exact(q, v, u),), "that of extended precision")
        case "mass_matrix" | "mass_matrix_inverse":
            return _checked(name, call, own.run(call), (exact(q),), "that of extended precision")
        case "coriolis_matrix":
            return _checked(name, call, own.run(call), (exact(q, v),), "that of extended precision")
        case "operational_space_inertia":
            return _checked(name, call, own.run(call), (exact(own.tip, q),), "that of extended precision")
        case "operational_space_inertia_of_two":
            other = model.operational_space_inertia(own.both, q, precision="extended")
            return _checked(name, call, own.run(call), (other,), "that of extended precision")
        case "mass_matrix_inverse_product":
            return _checked(name, call, own.run(call), (exact(q) @ own.X,), "that of extended precision")
    slopes = model.forward_dynamics_derivatives(q, v, u)
    forces = model.inverse_dynamics_derivatives(q, v, model.forward_dynamics(q, v, u))
    M = model.mass_matrix(q)
    worst = 0.0
    for slope, force in zip(slopes[:2], forces[:2], strict=True):
        error = float(np.abs(M @ slope + force).max() / (np.abs(M) @ np.abs(slope)).max())
        if not error < WRONG:
            raise _core.EvaluationError(f"derivatives of {name} are inconsistent in the run that times them: off by {error:.1e}")
        worst = max(worst, error)
    return worst


def measured_row(name: str, own: OwnCalls, call: str, peers: dict[str, Call], seconds: float, pinocchio: Any = None) -> Row:
    """Return one call on one model, checked, then timed in turn with the peers'. `pinocchio`: its calls, for its time in C++."""
    row = Row(name, own.model.nv, call, Time(0.0, 0.0), Time(0.0, 0.0))
    for peer, other in peers.items():
        row.errors[peer] = _checked(name, call, own.run(call), other.value(), f"{peer}'s")
    if not peers:
        row.errors["alone"] = _checked_alone(name, call, own)
    clocks: list[Clock] = [own.in_cpp(call), partial(elapsed, own.from_python(call))]
    clocks += [partial(elapsed, other.run) for other in peers.values()]
    loop = None if pinocchio is None else pinocchio.in_cpp(call, *own.states)
    row.kernel, row.python, *others = in_turn(seconds, *clocks, *([loop[0]] if loop else []))
    row.peers = dict(zip(peers, others, strict=False))
    if loop:
        row.peer_kernel = others[-1].shared(loop[1])
    elif pinocchio is not None:
        row.peer_kernel = row.peers["Pinocchio"].less(_not_its_own(pinocchio, call, peers["Pinocchio"].copies, own.model.nv, seconds))
    return row


def _not_its_own(pinocchio: Any, call: str, copies: int, n: int, seconds: float) -> float:
    """Return the time of Pinocchio's bindings in a call, microseconds: the call without joints, and copies of an n by n matrix."""
    bare, empty, matrix = pinocchio.bindings(call), np.empty((0, 0)), np.empty((n, n))
    if not copies:
        return in_turn(seconds / 4, partial(elapsed, bare))[0].median
    clocks = (partial(elapsed, f) for f in (bare, empty.copy, matrix.copy))
    overhead, nothing, copy = in_turn(seconds / 4, *clocks)
    return overhead.median + copies * max(copy.median - nothing.median, 0.0)


def _batch(name: str, own: OwnCalls, peer_kernel: Time | None, seconds: float) -> BatchRow:
    Q, V, U = (np.tile(x, (BATCH // STATES, 1)) for x in own.states)
    out, model = np.empty_like(V), own.model
    double, single = (
        time.shared(BATCH)
        for time in in_turn(
            seconds,
            partial(elapsed, lambda: model.forward_dynamics(Q, V, U, out=out)),
            partial(elapsed, lambda: model.forward_dynamics(Q, V, U, precision="single", out=out)),
        )
    )
    ratios = None if peer_kernel is None else (peer_kernel.median / double.median, peer_kernel.median / single.median)
    return BatchRow(name, model.nv, double, single, ratios)


def _compiled(found: Measured, name: str, own: OwnCalls, seconds: float) -> None:
    peers = {row.call: row.peer_kernel for row in found.rows if row.model == name}
    try:
        found.compiled += [compiled_row(name, own.model, call, own.states, peers.get(call), seconds) for call in compiled_speed.CALLS]
    except _core.EvaluationError as error:
        if "compiler" not in str(error):
            raise
        found.leave_out(f"code compiled for a model: {error}")


def measure(seconds: float = 0.1, quick: bool = False, progress: Callable[[str], None] = lambda text: None) -> Measured:
    """Return all figures, `seconds` for each; `quick`: two robots and two short chains. MissingPackageError without Pinocchio."""
    found = Measured(machine() | {"cores": pin_to_one_core()})
    makers = other_packages(found.leave_out)
    for name, model in timed_models(quick, found.leave_out):
        progress(name)
        own = OwnCalls(model, states_of(model))
        if model.nv > max(CHAINS):
            found.rows += [measured_row(name, own, call, {}, seconds) for call in LINEAR]
            continue
        packages = {}
        for make in makers:
            try:
                packages[make.name] = make(model)
            except PeerRefusal as refusal:
                found.leave_out(f"{make.name} on {name}: {refusal}")
        theirs = {peer: package.calls(own.q, own.v, own.u, own.X) for peer, package in packages.items()}
        for call in own.calls:
            progress(f"{name}: {call.replace('_', ' ')}")
            peers = {peer: calls[call] for peer, calls in theirs.items() if call in calls}
            found.rows.append(measured_row(name, own, call, peers, seconds, packages.get("Pinocchio")))
        forward = next(row for row in found.rows if (row.model, row.call) == (name, "forward_dynamics"))
        found.batches.append(_batch(name, own, forward.peer_kernel, seconds))
        if model.nv <= compiled_speed.LARGEST:
            progress(f"{name}: compiled")
            _compiled(found, name, own, seconds)
    return found


FITTED_FROM = 30
"""Links of the shortest chain in the fit of an exponent."""


def exponents(rows: list[Row], peer: bool = False) -> dict[str, float]:
    """Return by call the fitted p of time ~ N^p in C++, ours or Pinocchio's, on chains of 30 links and more."""
    fitted = {}
    for call in dict.fromkeys(row.call for row in rows):
        chains = [row for row in rows if row.call == call and row.model.startswith("chain") and row.nv >= FITTED_FROM]
        times = [(row.nv, row.peer_kernel if peer else row.kernel) for row in chains]
        points = np.array([(n, time.median) for n, time in times if time is not None])
        if len(points) >= 2:
            sizes, costs = np.log(points).T
            fitted[call] = float(np.polyfit(sizes, costs, 1)[0])
    return fitted
