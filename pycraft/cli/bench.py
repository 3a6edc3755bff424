"""`pycraft bench`: measure the bounds on speed; each result is checked in the same run that times it. Figures are ratios within one run.

The calls of a ratio are timed in turn, several times, and the least of the medians counts: a machine's speed changes from one second to the
next, and other programs only add time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from .. import _core
from ..models.generators import chain, tree
from ..models.multibody import Multibody

SHORT, LONG = 100, 1000


@dataclass
class Figure:
    """One measured figure: value, unit, and its bound (None without one)."""

    name: str
    value: float
    unit: str
    bound: float | None = None
    note: str = ""

    @property
    def passed(self) -> bool:
        return self.bound is None or self.value <= self.bound


def operators_of(arm: Any) -> dict[str, _core.Operator]:
    """Return the operators to time: every operator, ℳ, its inverse, and one inverse that no theorem gives."""
    soa = arm.soa
    names = "E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi psi_tilde Upsilon Omega".split()
    chosen = {name: getattr(soa, name) for name in names}
    chosen |= {"phi*": soa.phi.T, "psi*": soa.psi.T, "H*": soa.H.T, "D^-1": soa.D.inv()}
    MM = soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T
    last = list(arm.bodies)[-1]
    chosen |= {"Jacobian(tip)": soa.Jacobian(last), "MM": MM, "MM^-1": MM.inv(), "(MM + 0.1 I)^-1": (MM + 0.1 * soa.I).inv()}
    return chosen


def _checked(name: str, operator: _core.Operator, x: np.ndarray) -> None:
    """Check that the rules change the cost and not the result: the planned evaluation against the typed one."""
    fast = operator @ x
    literal = operator.at(precision="quad")
    exact = literal @ x
    error = np.abs(fast - exact).max(initial=0.0) / max(np.abs(exact).max(initial=0.0), 1e-300)
    if not error < 1e-6:
        raise _core.EvaluationError(f"{name} is wrong in the run that times it: off by {error:.1e}")


Timed: TypeAlias = Callable[[float], Mapping[str, float]]
"""Times a call for that many seconds."""


def in_turn(seconds: float, *timed: Timed, rounds: int = 5) -> list[float]:
    """Return the time of each, in seconds per call: one after the other for several rounds, the least median of each."""
    medians = [[each(seconds / rounds)["median"] for each in timed] for _ in range(rounds)]
    return [min(of_one) for of_one in zip(*medians, strict=True)]


def per_link(seconds: float = 0.1) -> list[Figure]:
    """Return the time per link for chains of 1000 links over 100, of every operator and of ℳ⁻¹x: O(N) means about one."""
    rng = np.random.default_rng(0)
    arms, timed = [chain(n, seed=1) for n in (SHORT, LONG)], dict[str, list[Timed]]()
    for arm in arms:
        arm.q = arm.random_state(1).q
        for name, operator in operators_of(arm).items():
            x = rng.uniform(-1, 1, operator.shape[1])
            if arm is arms[0]:
                _checked(name, operator, x)
            timed.setdefault(name, []).append(partial(_core.time_apply, operator, x))
        for call in ("forward_dynamics", "inverse_dynamics"):
            timed.setdefault(call, []).append(partial(_core.time_dynamics, arm, call, *_states(arm)))
    figures = []
    for name, both in timed.items():
        short, long = (t / n for t, n in zip(in_turn(seconds, *both), (SHORT, LONG), strict=True))
        figures.append(Figure(name, long / short, "x", 1.5, f"{1e9 * long:.0f} ns a link at {LONG}, {1e9 * short:.0f} at {SHORT}"))
    return figures


WHOLE_PACKS = 64
"""States of a batch timed in packs: several whole packs in every precision; the widest pack holds sixteen."""


def _states(arm: Any, count: int = 8) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    states = [arm.random_state(seed) for seed in range(count)]
    return np.array([s.q for s in states]), np.array([s.v for s in states]), np.array([s.v for s in states[::-1]])


def _elapsed(f: Any, repeats: int) -> float:
    begin = time.perf_counter()
    for _ in range(repeats):
        f()
    return (time.perf_counter() - begin) / repeats


def direct_calls(seconds: float = 0.2) -> list[Figure]:
    """Time direct calls on the package's robots, microseconds; each is checked by the other (forward of inverse dynamics)."""
    from ..models import robots

    figures = []
    for name in ("panda", "a1", "g1"):
        robot = getattr(robots, name)()
        q, v, u = _states(robot)
        back = robot.forward_dynamics(q, v, robot.inverse_dynamics(q, v, u))
        error = np.abs(back - u).max() / np.abs(u).max()
        if not error < 1e-6:
            raise _core.EvaluationError(f"forward dynamics of {name} is wrong in the run that times it: off by {error:.1e}")
        for call in ("forward_dynamics", "inverse_dynamics", "mass_matrix"):
            (own,) = in_turn(seconds, partial(_core.time_dynamics, robot, call, q, v, u))
            figures.append(Figure(f"{name} ({robot.nv} dof): {call}", 1e6 * own, "us"))
    return figures


def sensitivities(seconds: float = 0.2) -> list[Figure]:
    """Measure the cost of derivatives: sweeps of ∂ℳ x, ratios to one forward dynamics, and Pinocchio's own if it is installed."""
    from ..models import robots

    figures = []
    for name in ("panda", "g1"):
        robot = getattr(robots, name)()
        q, v, u = _states(robot)
        H, phi, M = robot.soa("H phi M")
        MM = H @ phi @ M @ phi.T @ H.T
        i, x = robot.nv - 1, u[0]
        derivative = MM.diff(i).at(q[0])
        _checked("derivative of MM", derivative, x)
        passes = derivative.plan().passes
        sweeps = passes.gathers + passes.scatters + passes.kernels
        figures.append(Figure(f"{name}: MM.diff(i) @ x", float(sweeps), "sweeps", 6.0))
        dense = robot.mass_matrix_derivative(q[0])[:, :, i] @ x
        if not np.abs(derivative @ x - dense).max() <= 1e-9 * (1 + np.abs(dense).max()):
            raise _core.EvaluationError(f"the derivative of the mass matrix of {name} is wrong in the run that times it")
        slope = float((MM + robot.soa.J).logdet().diff(i).at(q[0]))
        if not abs(robot.log_determinant_gradient(q[0])[i] - slope) <= 1e-9 * (1 + abs(slope)):
            raise _core.EvaluationError(f"the gradient of ln det of {name} is wrong in the run that times it")
        for call in ("log_determinant_gradient", "inverse_dynamics_derivatives", "forward_dynamics_derivatives"):
            forward, own = in_turn(seconds, *(partial(_core.time_dynamics, robot, c, q, v, u) for c in ("forward_dynamics", call)))
            bound, what = 4.0 if call == "log_determinant_gradient" else None, f"{name} ({robot.nv} dof): {call} over forward dynamics"
            figures.append(Figure(what, own / forward, "x", bound, f"{1e6 * own:.2f} us"))
        figures.extend(_beside_pinocchio(name, robot, q[0], v[0], u[0]))
    return figures


def _beside_pinocchio(name: str, robot: Any, q: np.ndarray, v: np.ndarray, u: np.ndarray) -> list[Figure]:
    """Time derivative calls from Python, ours over Pinocchio's; none if Pinocchio is not installed."""
    try:
        from ..interop.pinocchio import derivative_calls

        theirs = derivative_calls(name, robot.nq != robot.nv)
    except ImportError:
        return []
    figures = []
    for call, ours in (
        ("inverse_dynamics_derivatives", lambda: robot.inverse_dynamics_derivatives(q, v, u)),
        ("forward_dynamics_derivatives", lambda: robot.forward_dynamics_derivatives(q, v, u)),
    ):
        mine, other = (min(_elapsed(f, 300) for _ in range(5)) for f in (ours, theirs[call]))
        note = f"{1e6 * mine:.1f} us and {1e6 * other:.1f} us a call from Python"
        figures.append(Figure(f"{name}: {call} over Pinocchio's", mine / other, "x", None, note))
    return figures


# Bounds on the cost of a method over `fast` in double (extended: 64 bits of an old coprocessor; without one, all of quad's).
WAYS: dict[str, tuple[dict[str, Any], float]] = {
    "fast + 1 refinement": ({"refine": 1}, 2.2),
    "fast + 1 refinement, wide gather": ({"refine": 1, "residual": "gather"}, 2.6),
    "ud": ({"form": "ud"}, 3.5),
    "square-root": ({"form": "square-root"}, 6.0),
    "extended": ({"precision": "extended"}, 15.0 if _core.epsilons()["extended"] > 1e-25 else 80.0),
    "quad": ({"precision": "quad"}, 280.0),
}


UD_AT_WORST = 3.5
"""`ud` over `fast` if every joint has one coordinate and little other work, or bodies exceed a cache."""


def ud_at_worst(seconds: float) -> list[Figure]:
    """Measure `ud` over `fast` on sliders, stars, hinges of three subhinges and 2000 bodies."""
    n = 50
    models = {
        "50 sliders": tree(range(-1, n - 1), ["slider"] * n),
        "star of 50 pins": tree([-1] + [0] * (n - 1), ["pin"] * n),
        "50 custom hinges": tree(range(-1, n - 1), ["custom"] * n),
        "chain of 2000": chain(2000, seed=1),
    }
    figures = []
    for name, model in models.items():
        fast, own = in_turn(seconds, *(partial(_core.time_forward, model, *_states(model), form=form) for form in ("fast", "ud")))
        figures.append(Figure(f"{name}: ud over fast", own / fast, "x", UD_AT_WORST, f"{1e6 * own:.1f} us"))
    return figures


def heavy_tips(seconds: float) -> list[Figure]:
    """Measure chains of rods with a heavy tip over `fast` without one, of the same cost: no ratio makes a method expensive."""
    figures = []
    for n in (4, 8, 20):
        even = chain(n)
        at, plain = _states(even), partial(_core.time_forward, even)
        for way, ratios in (("ud", (1e8, 1e12, 1e16)), ("fast + 1 refinement", (1e3,))):
            options, _ = WAYS[way]
            for ratio in ratios:
                model = chain(n)
                tip = model.bodies[f"body{n - 1}"]
                tip.mass, tip.inertia = ratio, ratio * np.asarray(tip.inertia)
                fast, own = in_turn(seconds, partial(plain, *at), partial(_core.time_forward, model, *at, **options))
                figures.append(
                    Figure(f"chain of {n}, tip {ratio:.0e}: {way} over fast", own / fast, "x", UD_AT_WORST, f"{1e6 * own:.2f} us")
                )
    return figures


def loads_under_rotors(seconds: float) -> list[Figure]:
    """Measure `ud` with loads on eight pins with rotors over `fast` without a load: rotors leave no doubt either."""
    plain, figures = partial(_core.time_forward, _pins_with_rotors(1.0)), []
    at = _states(_pins_with_rotors(1.0))
    for ratio in (1.0, 1e8, 1e12, 1e16):
        fast, own = in_turn(seconds, partial(plain, *at), partial(_core.time_forward, _pins_with_rotors(ratio), *at, form="ud"))
        name = f"8 pins with rotors, load {ratio:.0e}: ud over fast"
        figures.append(Figure(name, own / fast, "x", UD_AT_WORST, f"{1e6 * own:.2f} us"))
    return figures


def _pins_with_rotors(ratio: float) -> Multibody:
    """Return eight links on pins about z, their masses off its plane, with a load as the last."""
    model = Multibody("pins with rotors")
    for k in range(8):
        heavy = ratio if k == 7 else 1.0
        inertia = heavy * np.array([[0.1, 0.01, 0.02], [0.01, 0.12, 0.01], [0.02, 0.01, 0.09]])
        model.add_body(
            f"link{k}", f"link{k - 1}" if k else None, "pin", axis=(0, 0, 1), position=(1.0, 0.2, 0.3) if k else (0, 0, 0), mass=heavy,
            com=(0.5, 0.1, 0.2), inertia=inertia, rotor_inertia=0.3,
        )  # fmt: skip
    model.gravity = (3.0, -9.81, 4.0)
    return model


def accuracy(seconds: float = 0.2) -> list[Figure]:
    """Measure the cost of accuracy: forward dynamics by every method over `fast` in double, and batches in packs."""
    from ..models import robots

    figures = []
    for name, model in (("panda", robots.panda()), ("g1", robots.g1()), ("chain of 100", chain(100, seed=1))):
        q, v, u = _states(model)
        many = _states(model, WHOLE_PACKS)
        exact = model.forward_dynamics(q, v, u, precision="quad")
        plain = partial(_core.time_forward, model, q, v, u)
        for way, (options, bound) in WAYS.items():
            error = np.abs(model.forward_dynamics(q, v, u, **options) - exact).max() / np.abs(exact).max()
            if not error < 1e-6:
                raise _core.EvaluationError(f"{way} of {name} is wrong in the run that times it: off by {error:.1e}")
            fast, own = in_turn(seconds, plain, partial(plain, **options))
            measured = f"{1e6 * own:.2f} us, error {error:.0e}"
            figures.append(Figure(f"{name} ({model.nv} dof): {way} over fast", own / fast, "x", bound, measured))
        fast, own = in_turn(seconds, plain, partial(plain, precision="single"))
        error = np.abs(model.forward_dynamics(q, v, u, precision="single") - exact).max() / np.abs(exact).max()
        note = f"{1e6 * own:.2f} us, error {error:.0e}"
        figures.append(Figure(f"{name} ({model.nv} dof): single, one by one, over double", own / fast, "x", None, note))
        for form in ("fast", "ud"):
            precisions = ("double", "single")
            packs = [partial(_core.time_packs, model, *many, form=form, precision=precision) for precision in precisions]
            fast, *packed = in_turn(seconds, plain, *packs)
            for precision, own in zip(precisions, packed, strict=True):
                note = f"{1e6 * own:.2f} us a state"
                figures.append(Figure(f"{name}: {form} in packs, {precision}, over one by one in double", own / fast, "x", None, note))
            figures.append(Figure(f"{name}: {form} in batches, single over double", packed[1] / packed[0], "x", 1.0))
    return figures + ud_at_worst(seconds) + heavy_tips(seconds) + loads_under_rotors(seconds)


def run(seconds: float = 0.1) -> dict[str, list[Figure]]:
    """Return all figures, by heading."""
    from .bench_expressions import expressions
    from .bench_frames import frames
    from .bench_hybrid import hybrid
    from .bench_locking import locking
    from .bench_loops import loops
    from .bench_parts import parts
    from .bench_scenes import scenes
    from .bench_structure import structure

    return {
        f"O(N): time per link at {LONG} links over {SHORT}": per_link(seconds),
        "Expressions": expressions(2 * seconds),
        "Direct calls": direct_calls(2 * seconds),
        "Hybrid dynamics": hybrid(seconds),
        "Sensitivities": sensitivities(2 * seconds),
        "What accuracy costs": accuracy(2 * seconds),
        "Frames": frames(2 * seconds),
        "Scenes": scenes(2 * seconds),
        "Parts": parts(2 * seconds),
        "Locking": locking(2 * seconds),
        "Structure": structure(),
        "Loops": loops(),
    }
