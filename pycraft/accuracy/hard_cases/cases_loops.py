"""Accelerations on loops, by tree augmentation and by constraint embedding: near singular states, with heavy and light rods, with rows that
are dependent or nearly so, in long loops, and where loops close at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache, partial
from typing import Any

import mpmath
import numpy as np

from ...models import linkages
from ...models.multibody import Multibody
from .case import Bound, Case, Measured, MeasuredCase

FAMILY = "loops"
DIGITS = 50
"""Of the references."""
ROOT = 2.0**-26
"""√ε, below which a row counts as dependent in double precision."""
WAYS: dict[str, dict[str, Any]] = {
    "fast": {},
    "ud": {"form": "ud"},
    "square-root": {"form": "square-root"},
    "fast + refinement, wider residual": {"refine": "auto", "residual": "wider"},
    "fast, extended": {"precision": "extended"},
    "embedded": {"method": "embed"},
    "embedded, extended": {"method": "embed", "precision": "extended"},
}
DOUBLE = ("fast", "ud", "square-root")
WIDER, EXTENDED = "fast + refinement, wider residual", "fast, extended"
EMBEDDED = ("embedded", "embedded, extended")
ALL = tuple(WAYS)


def cases() -> list[Case]:
    """The catalogue's own."""
    return [*_near_the_line(), *_across_the_line(), *_ratios(), *_nearly_dependent(), *_long(), *_redundant(), *_closing()]


def _case(name: str, hard: str, parameters: dict[str, Any], errors: Callable[[np.random.Generator], dict[str, float]], reference: str,
          bounds: tuple[Bound, ...], quantity: str = "relative error of the accelerations, 2-norm") -> MeasuredCase:  # fmt: skip
    return MeasuredCase(
        name,
        FAMILY,
        hard,
        parameters,
        partial(_measure, errors),
        quantity,
        reference,
        bounds,
        "tree augmentation and embedding, docs/loops.md",
    )


def _measure(errors: Callable[[np.random.Generator], dict[str, float]], seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    found: dict[str, list[float]] = {}
    for seed in seeds:
        for name, error in errors(np.random.default_rng(seed)).items():
            found.setdefault(name, []).append(error)
    return {name: np.array(values) for name, values in found.items()}


def _each_way(
    model: Multibody, q: np.ndarray, v: np.ndarray, tau: np.ndarray, exact: np.ndarray, scale: float | None = None
) -> dict[str, float]:
    size = float(np.linalg.norm(exact)) if scale is None else scale
    return {name: float(np.linalg.norm(model.constrained_dynamics(q, v, tau, **how).vdot - exact)) / size for name, how in WAYS.items()}


# Singular states ------------------------------------------------------------------------------------------------------


def _near_the_line() -> list[MeasuredCase]:
    """The line of a rhombus: rounding of the state turns the rows by eps / distance; below √eps one of them is left out, and what that
    makes of θ̈ is of the size √eps under loads along the branch. Across it loads would be held by forces of the size 1 / distance."""
    formula = "100 eps / distance, or 8 √eps where that is the distance"
    return [
        _case(
            f"four-bar {distance:g} rad from the line",
            "a singular state: rows hang together there, and the motion goes on",
            {"N": 3, "distance": distance},
            partial(_rhombus_errors, distance),
            "the closed form",
            (Bound(ALL, "worst", formula, _of_the_line),),
            "error of the accelerations, over 10 rad/s²",
        )
        for distance in (1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-12)
    ]


def _of_the_line(measured: Measured) -> float:
    distance = measured.parameters["distance"]
    return max(100 * measured.eps / distance if distance > ROOT else 0.0, 8 * ROOT if distance < 4 * ROOT else 0.0)


def _rhombus_errors(distance: float, rng: np.random.Generator) -> dict[str, float]:
    model = linkages.n_four_bar(1)
    model.gravity = (0, -9.81, 0)
    speed, torque = rng.uniform(1, 3), rng.uniform(-5, 5)
    q, v = distance * np.array([1, -1, 1.0]), speed * np.array([1, -1, 1.0])
    # T on either crank; the inertia felt is 2/3 + 1 of a crank's angle, the weight that of two halves and the rod
    exact = (2 * torque - 2 * 9.81 * np.cos(distance)) / (5 / 3) * np.array([1, -1, 1.0])
    return _each_way(model, q, v, np.array([torque, 0, torque]), exact, 10.0)


def _across_the_line() -> list[MeasuredCase]:
    """Loads across the branch are held by multipliers of the size 1 / distance; what bars feel is Q*λ. Below √eps, of the precision, that
    row is left out (docs/loops.md): there no method is asked for what it holds."""

    def limit(measured: Measured, from_distance: float = 0.0) -> float | None:
        distance = measured.parameters["distance"]
        return 100 * measured.eps / distance if distance > from_distance else None

    return [
        _case(
            f"four-bar loaded across its branch, {distance:g} rad from the line",
            "multipliers grow as the way to a singular state shrinks, and none may be wrong in silence",
            {"N": 3, "distance": distance},
            partial(_across_errors, distance),
            f"the dense equations in {DIGITS} digits",
            (
                Bound((EXTENDED, EMBEDDED[1]), "worst", "100 eps / distance", limit),
                Bound((*DOUBLE, EMBEDDED[0]), "worst", "100 eps / distance", partial(limit, from_distance=ROOT)),
            ),
            "error of the loop's forces Q*λ, over the largest load",
        )
        for distance in (1e-2, 1e-4, 1e-6, 1e-9)
    ]


def _across_errors(distance: float, rng: np.random.Generator) -> dict[str, float]:
    model = linkages.n_four_bar(1)
    model.gravity = (0, -9.81, 0)
    q, v, tau = distance * np.array([1, -1, 1.0]), rng.uniform(1, 3) * np.array([1, -1, 1.0]), rng.uniform(-5, 5, 3)
    forces = model.inverse_dynamics(q, v, _dense(model, q, v, tau, 2), precision="quad") - tau
    Q = model.loops.jacobian(q)
    found = {name: Q.T @ model.constrained_dynamics(q, v, tau, **how).multipliers for name, how in WAYS.items()}
    return {name: float(np.abs(own - forces).max() / np.abs(tau).max()) for name, own in found.items()}


# Dense references -----------------------------------------------------------------------------------------------------


def _dense(model: Multibody, q: np.ndarray, v: np.ndarray, tau: np.ndarray, rank: int) -> np.ndarray:
    """θ̈ of the closed model by the mass matrix and its null space of rows, in many digits, from values in quad precision."""
    with mpmath.workdps(DIGITS):

        def exact(array: Any) -> mpmath.matrix:  # fmt: skip
            return mpmath.matrix(np.atleast_2d(np.asarray(array, dtype=object)).tolist())

        M = exact(model.soa.MM.at(q, precision=DIGITS).dense(dtype=object))
        force = tau - model.inverse_dynamics(q, v, np.zeros(model.nv), precision="quad")
        Q, c = exact(model.soa.Q.at(q, precision=DIGITS).dense(dtype=object)), exact(model.loops.bias(q, v, precision="quad")).T
        rows = _independent(Q, rank)
        A, b = mpmath.matrix(rank, model.nv), mpmath.matrix(rank, 1)
        for i, row in enumerate(rows):
            A[i, :], b[i] = Q[row, :], c[row]
        free = M**-1 * exact(force).T
        lam = (A * M**-1 * A.T) ** -1 * (-(A * free + b))
        return np.array((free + M**-1 * A.T * lam).tolist(), float).ravel()


def _independent(Q: Any, rank: int) -> list[int]:
    """So many rows by elimination with pivoting."""
    left, rows = Q.copy(), list[int]()
    for _ in range(rank):
        sizes = [max(abs(left[r, j]) for j in range(left.cols)) if r not in rows else mpmath.mpf(-1) for r in range(left.rows)]
        row = sizes.index(max(sizes))
        column = max(range(left.cols), key=lambda j: abs(left[row, j]))  # noqa: B023 - used at once
        for r in range(left.rows):
            if r not in (*rows, row):
                left[r, :] -= left[r, column] / left[row, column] * left[row, :]
        rows.append(row)
    return rows


# Heavy and light ------------------------------------------------------------------------------------------------------


def _ratios() -> list[MeasuredCase]:
    """The rod against its cranks: both rows of the loop are felt by the lighter ones alone, so that they nearly hang together in units of
    energy, whatever the form of the tree; a wider residual gives back what is lost. Embedding adds up what is felt along the one free
    coordinate, and loses nothing."""
    return [
        _case(
            f"four-bar, rod {ratio:g} times its cranks",
            "masses around a loop that are far apart",
            {"N": 3, "ratio": ratio},
            partial(_ratio_errors, ratio),
            f"the dense equations in {DIGITS} digits",
            (
                *_of_ratios(DOUBLE, 10, _apart),
                *_of_ratios_extended(10, _apart),
                Bound((WIDER,), "p95", "1e-14", lambda m: 1e-14),
                Bound((WIDER,), "worst", "1e-13", lambda m: 1e-13),
                Bound(EMBEDDED, "p95", "50 eps", lambda m: 50 * m.eps),
                Bound(EMBEDDED, "worst", "500 eps", lambda m: 500 * m.eps),
            ),
        )
        for ratio in (1e-12, 1e-6, 1e6, 1e12)
    ]


def _of_ratios(methods: tuple[str, ...], factor: float, apart: Callable[[Measured], float], of: str = "eps") -> tuple[Bound, ...]:
    """Bounds on the loss by ratios; it is worst for forces that nearly cancel, with small accelerations."""

    def limit(times: float, measured: Measured) -> float:
        eps = measured.eps if of == "eps" else float(np.finfo(np.longdouble).eps)
        return times * max(factor * eps * apart(measured), 50 * measured.eps)

    texts = {times: f"{times * factor:g} {of} ratio, or {50 * times:g} eps" for times in (1, 10)}
    return Bound(methods, "p95", texts[1], partial(limit, 1)), Bound(methods, "worst", texts[10], partial(limit, 10))


def _of_ratios_extended(factor: float, apart: Callable[[Measured], float]) -> tuple[Bound, ...]:
    return _of_ratios((EXTENDED,), factor, apart, "eps of extended")


def _apart(measured: Measured) -> float:
    return max(measured.parameters["ratio"], 1 / measured.parameters["ratio"])


def _ratio_errors(ratio: float, rng: np.random.Generator) -> dict[str, float]:
    model = linkages.n_four_bar(1)
    for name, value in linkages.rod(mass=ratio).items():
        setattr(model.bodies["rod1"], name, value)
    model.gravity = (0, -9.81, 0)
    angle = rng.uniform(0.5, 2.5)
    q, v = angle * np.array([1, -1, 1.0]), rng.uniform(-3, 3) * np.array([1, -1, 1.0])
    tau = rng.uniform(-1, 1, 3) * max(ratio, 1.0)
    return _each_way(model, q, v, tau, _dense(model, q, v, tau, 2))


# Rows that hang together, or nearly -----------------------------------------------------------------------------------


def _nearly_dependent() -> list[MeasuredCase]:
    """A level rod is asked for once more, by a coupling that is δ off: then nothing moves, held by forces of size 1/δ. Embedded no
    coordinate is left free, and rest is exact."""
    return [
        _case(
            f"four-bar, one row {delta:g} from another",
            "rows that nearly hang together hold what moves by forces of the size 1/δ",
            {"N": 3, "distance": delta},
            partial(_held_errors, delta),
            "rest",
            (
                Bound(DOUBLE, "worst", "100 eps / distance", lambda m: 100 * m.eps / m.parameters["distance"]),
                Bound(EMBEDDED, "worst", "eps", lambda m: m.eps),
            ),
            "acceleration where nothing moves, over that without the row",
        )
        for delta in (1e-2, 1e-4, 1e-6)
    ]


def _held_errors(delta: float, rng: np.random.Generator) -> dict[str, float]:
    model = linkages.n_four_bar(1)
    model.gravity = (0, -9.81, 0)
    q = rng.uniform(0.5, 2.5) * np.array([1, -1, 1.0])
    model.add_coupling({"crank0": 1.0, "rod1": 1.0 + delta}, constant=delta * q[0], name="level")
    return _each_way(model, q, np.zeros(3), np.zeros(3), np.zeros(3), 10.0)


def _redundant() -> list[MeasuredCase]:
    """One of five rows is redundant, and no particular one."""
    return [
        _case(
            "Bricard's linkage",
            "a redundant row that is no particular one",
            {"N": 5},
            _bricard_errors,
            f"the dense equations of four rows in {DIGITS} digits",
            (Bound(ALL, "worst", "1e-12", lambda m: 1e-12),),
        )
    ]


def _bricard_errors(rng: np.random.Generator) -> dict[str, float]:
    model = linkages.bricard()
    model.gravity = (0, -9.81, 0)
    state = model.assemble(model.q + 0.3 * rng.normal(size=5), rng.normal(size=5))
    tau = rng.normal(size=5)
    return _each_way(model, state.q, state.v, tau, _dense(model, state.q, state.v, tau, 4))


# Long loops -----------------------------------------------------------------------------------------------------------


def _long() -> list[MeasuredCase]:
    """The loss grows as the square of the number of rungs, by both methods and all forms, in units of the precision of residuals."""
    return [
        _case(
            f"ladder of {rungs} rungs",
            "as many loops, each with its neighbours' cranks",
            {"N": rungs},
            partial(_ladder_errors, rungs),
            "the closed form",
            (
                Bound((*DOUBLE, "embedded"), "worst", "eps N², or 10 eps", lambda m: m.eps * max(10.0, m.N**2)),
                Bound((WIDER, EXTENDED, EMBEDDED[1]), "worst", "10 eps, or eps N² of extended", _of_wider),
            ),
            "relative error of the accelerations, largest",
        )
        for rungs in (10, 100, 1000)
    ]


def _of_wider(measured: Measured) -> float:
    return max(10 * measured.eps, float(np.finfo(np.longdouble).eps) * measured.N**2)


@lru_cache(maxsize=1)
def _ladder(rungs: int) -> Multibody:
    model = linkages.n_four_bar(rungs)
    model.gravity = (0, -9.81, 0)
    return model


def _ladder_errors(rungs: int, rng: np.random.Generator) -> dict[str, float]:
    model = _ladder(rungs)
    angle, speed = rng.uniform(0.5, 1.2), rng.uniform(-3, 3)
    signs = np.array([1.0, -1] * rungs + [1])
    exact = -9.81 * np.cos(angle) * ((rungs + 1) / 2 + rungs) / ((rungs + 1) / 3 + rungs)
    return {
        name: float(np.abs(model.constrained_dynamics(angle * signs, speed * signs, **how).vdot - exact * signs).max() / abs(exact))
        for name, how in WAYS.items()
    }


# Closures -------------------------------------------------------------------------------------------------------------


def _closing() -> list[MeasuredCase]:
    """A chain whose end is caught: velocities after the impulse keep the loop, and are the nearest in kinetic energy."""
    return [
        _case(
            f"a chain is caught, tip {ratio:g} times its links",
            "a loop closes at once, between masses that are far apart",
            {"N": 5, "ratio": ratio},
            partial(_caught_errors, ratio),
            f"the dense equations in {DIGITS} digits",
            (
                *_of_ratios(DOUBLE, 300, _heavier),
                *_of_ratios_extended(300, _heavier),
            ),
            "relative error of the velocities, 2-norm",
        )
        for ratio in (1e-9, 1.0, 1e6)
    ]


def _heavier(measured: Measured) -> float:
    return max(measured.parameters["ratio"], 1.0)


def _caught_errors(ratio: float, rng: np.random.Generator) -> dict[str, float]:
    model = Multibody("chain")
    for i in range(5):
        model.add_body(
            f"link{i}", f"link{i - 1}" if i else None, position=(float(i > 0), 0, 0), **linkages.rod(mass=ratio if i == 4 else 1.0)
        )
    model.q = np.array([1.0, -0.7, -0.6, -0.5, -0.4]) + 0.1 * rng.normal(size=5)
    end = model.add_node("end", "link4", position=(1, 0, 0))
    place = model.pose("end", model.q)[:3, 3]
    model.add_loop(end, hinge="pin", position=place, name="catch")
    v = rng.normal(size=5)
    with mpmath.workdps(DIGITS):
        M = mpmath.matrix(model.soa.MM.at(model.q, precision=DIGITS).dense(dtype=object).tolist())
        A = mpmath.matrix(model.soa.Q.at(model.q, precision=DIGITS).dense(dtype=object)[2:4].tolist())
        before = mpmath.matrix(v.tolist())
        after = before - M**-1 * A.T * ((A * M**-1 * A.T) ** -1 * (A * before))
        exact = np.array(after.tolist(), float).ravel()
    found = {}
    for name, how in WAYS.items():
        if "refine" in how or "method" in how:
            continue
        found[name] = float(np.linalg.norm(model.constrained_velocities(model.q, v, **how).v - exact) / np.linalg.norm(exact))
    return found
