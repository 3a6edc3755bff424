"""Output of `pycraft bench --peers`: the table for the terminal, docs/performance.md."""

from __future__ import annotations

from collections.abc import Iterable

from ..peers.clock import Time
from ..peers.speed import BATCH, BATCH_GOALS, COLUMNS, FITTED_FROM, GOALS, STATES, WRONG, Measured, Row, exponents
from .bench import Figure

CALLS = {
    "forward_dynamics": "forward dynamics",
    "inverse_dynamics": "inverse dynamics",
    "mass_matrix": "mass matrix ℳ",
    "mass_matrix_inverse": "inverse ℳ⁻¹",
    "inverse_dynamics_derivatives": "derivatives of inverse dynamics",
    "forward_dynamics_derivatives": "derivatives of forward dynamics",
    "coriolis_matrix": "Coriolis matrix",
    "operational_space_inertia": "operational-space inertia Λ",
    "operational_space_inertia_of_two": "Λ of two nodes",
    "mass_matrix_inverse_product": f"ℳ⁻¹X, {COLUMNS} columns",
}
COMPARED: dict[str, dict[str, str]] = {
    "forward_dynamics": {"Pinocchio": "`aba`", "MuJoCo": "`mj_forward`", "Drake": "`EvalTimeDerivatives`"},
    "inverse_dynamics": {
        "Pinocchio": "`rnea`",
        "MuJoCo": "`mj_inverse`",
        "Drake": "`CalcForceElementsContribution`, `CalcInverseDynamics`",
    },
    "mass_matrix": {"Pinocchio": "`crba`", "MuJoCo": "`mj_kinematics`, `mj_comPos`, `mj_crb`, `mj_fullM`", "Drake": "`CalcMassMatrix`"},
    "mass_matrix_inverse": {"Pinocchio": "`computeMinverse`"},
    "inverse_dynamics_derivatives": {"Pinocchio": "`computeRNEADerivatives`"},
    "forward_dynamics_derivatives": {"Pinocchio": "`computeABADerivatives`"},
    "coriolis_matrix": {"Pinocchio": "`computeCoriolisMatrix`"},
    "operational_space_inertia": {"Pinocchio": "`computeDelassusMatrix`, not inverted"},
    "operational_space_inertia_of_two": {"Pinocchio": "`computeDelassusMatrix`, not inverted"},
    "mass_matrix_inverse_product": {
        "Pinocchio": "`computeMinverse`, its product with X by NumPy",
        "MuJoCo": "`mj_kinematics`, `mj_comPos`, `mj_crb`, `mj_factorM`, `mj_solveM`",
    },
}
"""The timed calls of other packages, by call and package."""


def number(value: float | None) -> str:
    """Return three digits, without an exponent up to a million."""
    if value is None:
        return ""
    return f"{value:,.0f}" if 1000 <= value < 1e6 else f"{value:.3g}"


def _time(time: Time | None) -> str:
    return number(time and time.median)


def _ratio(ratio: float | None, met: bool | None) -> str:
    """Return a ratio to three digits, with a mark if there is a goal."""
    return "" if ratio is None else f"{ratio:.3g}" + {None: "", True: " ✓", False: " ✗"}[met]


def packages(found: Measured) -> list[str]:
    """Return the other packages that were timed, Pinocchio first."""
    return list(dict.fromkeys(name for row in found.rows for name in row.peers))


def headings(found: Measured) -> list[str]:
    """Return the headings of the table: in C++ ours, Pinocchio's and their ratio; from Python ours, all packages' and the ratio of the
    fastest."""
    return ["model", "nv", "C++", "Pinocchio", "ratio", "Python", *packages(found), "ratio"]


def cells(row: Row, others: Iterable[str]) -> list[str]:
    """Return one line of the table: times in microseconds, ratios over ours."""
    cpp, python = row.met
    theirs = [_time(row.peers.get(name)) for name in others]
    own = [row.model, str(row.nv), _time(row.kernel), _time(row.peer_kernel), _ratio(row.ratio, cpp)]
    return [*own, _time(row.python), *theirs, _ratio(row.python_ratio, python)]


def of_call(found: Measured, call: str) -> list[Row]:
    """Return the rows of one call."""
    return [row for row in found.rows if row.call == call]


def goals(found: Measured) -> list[list[str]]:
    """Return, by call: the goal in C++, how many models meet it, the range of ratios; the same from Python."""
    lines = []
    for call, both in GOALS.items():
        line = [CALLS[call]]
        for which, goal in enumerate(both):
            rows = of_call(found, call)
            ratios = [r for r in ((row.ratio, row.python_ratio)[which] for row in rows) if r is not None]
            met = [m for m in (row.met[which] for row in rows) if m is not None]
            line += [number(goal), f"{sum(met)} of {len(met)}" if met else "", f"{min(ratios):.3g} to {max(ratios):.3g}" if ratios else ""]
        lines.append(line)
    return lines


GOAL_HEADINGS = ["call", "goal in C++", "met", "ratios", "goal from Python", "met", "ratios"]
BATCH_HEADINGS = ["model", "nv", "double, a state", "ratio", "single, a state", "ratio"]


def batch_cells(found: Measured) -> list[list[str]]:
    """Return the lines of the table of batches."""
    lines = []
    for row in found.batches:
        line = [row.model, str(row.nv)]
        for time, ratio, goal in zip(
            (row.double, row.single), row.ratios or (None, None), BATCH_GOALS[found.machine["instruction set"]], strict=True
        ):
            line += [_time(time), _ratio(ratio, None if goal is None or ratio is None else ratio >= goal)]
        lines.append(line)
    return lines


COMPILED_HEADINGS = ["model", "nv", "call", "operations", "build, s", "C++", "the call itself", "its ratio", "Pinocchio", "ratio", "Python"]


def compiled_cells(found: Measured) -> list[list[str]]:
    """Return the lines of the table of code compiled for one model."""
    lines = []
    for row in found.compiled:
        line = [row.model, str(row.nv), CALLS[row.call], f"{row.operations:,}", f"{row.built:.1f}", _time(row.kernel), _time(row.ordinary)]
        lines.append([*line, number(row.ordinary.median / row.kernel.median), _time(row.peer_kernel), number(row.ratio), _time(row.python)])
    return lines


def cost_cells(figures: list[Figure]) -> list[list[str]]:
    """Return the lines of the table of the cost of accuracy."""
    return [[f.name, f"{f.value:.3g}", "" if f.bound is None else f"{f.bound:g}" + (" ✓" if f.passed else " ✗"), f.note] for f in figures]


COST_HEADINGS = ["way", "ratio", "bound", "time and error"]


def fitted(found: Measured) -> list[list[str]]:
    """Return the lines of the table of exponents, ours and Pinocchio's."""
    own, theirs = exponents(found.rows), exponents(found.rows, peer=True)
    return [[CALLS[call], f"{p:.2f}", f"{theirs[call]:.2f}" if call in theirs else ""] for call, p in own.items()]


def _markdown(head: list[str], lines: list[list[str]], words: int = 1) -> str:
    """Return a table; its first `words` columns are text."""
    rule = ["---" if i < words else "---:" for i in range(len(head))]
    return "\n".join("| " + " | ".join(line) + " |" for line in (head, rule, *lines)) + "\n"


def _compared(found: Measured) -> str:
    others = packages(found)
    own = {call: f"`{call}`" for call in CALLS} | {
        "operational_space_inertia_of_two": "`operational_space_inertia`, two names",
        "mass_matrix_inverse_product": "`(H φ M φ* H* + J)⁻¹ @ X`",
    }
    lines = [[title, own[call], *(COMPARED[call].get(name, "") for name in others)] for call, title in CALLS.items()]
    return _markdown(["call", "here", *others], lines, words=2 + len(others))


def _calls(found: Measured) -> str:
    others = packages(found)
    parts = []
    for call, title in CALLS.items():
        wanted = [f"{goal:g} {where}" for goal, where in zip(GOALS[call], ("in C++", "from Python"), strict=True) if goal]
        said = f"Goals: {', '.join(wanted)}." if wanted else "No goal."
        parts.append(f"### {title[0].upper()}{title[1:]}\n\n{said}\n")
        parts.append(_markdown(headings(found), [cells(row, others) for row in of_call(found, call)]))
    return "\n".join(parts)


def page(found: Measured, costs: list[Figure]) -> str:
    """Return docs/performance.md: all its figures are measured in the run that writes it."""
    machine = "\n".join(f"- {name}: {value}" for name, value in found.machine.items())
    batch_goals = BATCH_GOALS[found.machine["instruction set"]]
    asked = " and ".join(f"{goal:g} in {p}" for goal, p in zip(batch_goals, ("double", "single"), strict=True) if goal) or "none here"
    left_out = "".join(f"- {text}\n" for text in found.left_out) or "- nothing\n"
    return f"""# Speed

Written by `pycraft bench --peers --page docs/performance.md`: no figure on this page is typed by hand. `--plot` draws cost against length,
`--json` keeps all times, minimum and median. Measured on

{machine}

Compare only figures of one run: they differ between machines.

Times are microseconds. Each is the least median of several rounds on one core, after a warm-up; the two times of a ratio are taken in
turns. A ratio is the other package's time over ours: above one ours is faster; ✓ meets its goal, ✗ misses it. All results are compared in
the run that times them, and agree to {WRONG:g} of the largest entry with every package, or, where no package runs, with our own in
extended precision.

*C++* is our call in the core, its checks included, over {STATES} states in rotation. For forward and inverse dynamics of up to 100
coordinates, Pinocchio's time in C++ is the time of its own C++ loops over states (`abaInParallel`, `rneaInParallel`, one thread);
otherwise it is its call from Python less the same call on a model without joints and less the copies of matrices that its bindings make.
*Python* is a call from Python on existing arrays; the ratio is to the fastest package.

{_compared(found)}
ℳ and ℳ⁻¹ are full and symmetric here; Pinocchio's `crba` from Python also fills both triangles, and its time includes this. MuJoCo's
calls have contacts and constraints disabled; its `mj_forward` computes positions, inertias, their factors and accelerations, and the time
does not include setting a state. Pins of the chains turn about y, x and z in turn, the axes for which other packages have their fastest
joints; robots are used as in their files, legged ones on a free base. Λ is computed for the last body, 6 × 6, and for the last and the
middle body together, 12 × 12, if both move in every direction; Pinocchio's time covers only its inverse, which remains to be inverted,
less the time on a model of one joint.

## Goals

{_markdown(GOAL_HEADINGS, goals(found))}
## Calls

{_calls(found)}
## Batches

Forward dynamics of {BATCH} states at once from Python, per state, and the ratio of one call of Pinocchio's in C++ to it. Goals on this
instruction set: {asked}.

{_markdown(BATCH_HEADINGS, batch_cells(found))}
## Code for one model

Calls compiled for their model ([compiled.md](compiled.md)), one state after another in C++, compared with the ordinary call and
Pinocchio's in C++; ratios to the compiled call. Code built where it runs uses all instructions of the machine.

{_markdown(COMPILED_HEADINGS, compiled_cells(found), words=3)}
## Growth of cost

The fitted p of time ~ Nᵖ in C++, on chains of {FITTED_FROM} links and more, up to the longest one timed. ℳ and ℳ⁻¹ have N² entries,
derivatives twice and three times as many.

{_markdown(["call", "p, ours", "p, Pinocchio"], fitted(found))}
## Cost of accuracy

Forward dynamics in other forms and precisions, as a ratio to form `fast` in double, timed in turn; errors against quad precision; ✓ is
within its bound, ✗ over it. Direct calls of forward dynamics run kernels in every row here. [accuracy.md](accuracy.md)
describes each method.

{_markdown(COST_HEADINGS, cost_cells(costs))}
## Not measured

{left_out}"""
