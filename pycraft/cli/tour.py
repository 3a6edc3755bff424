"""The tour: an overview of the workbench, on one robot, in a terminal."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table
from rich.tree import Tree

from .. import _core
from ..identities.checker import check
from ..identities.terminal_report import monospace
from ..models.generators import chain

LARGEST_PICTURE = 24


def run(robot: Any, console: Console) -> None:
    """Show the robot, its operators, factorization, inverse, determinants and theorems."""
    say = Say(console)
    robot.q = robot.random_state(seed=0).q
    _show_model(robot, say)
    if robot.nv == 0:
        say.text("This model has no degrees of freedom: Θ has dimension 0 and every operator on it is empty. Load a robot that moves.")
        return
    soa = robot.soa
    H, phi, M, D, K, psi, I = soa("H phi M D K psi I")
    MM = H @ phi @ M @ phi.T @ H.T
    _show_operators(robot, MM, soa, say)
    _show_factorization(robot, MM, soa, say)
    _show_beyond(MM, soa, say)
    _show_tip(robot, soa, say)
    _show_theorems(robot, soa, say)
    _show_growth(say)


class Say:
    """Headings, formulas and results, in one style."""

    def __init__(self, console: Console):
        self.console = console
        self._number = 0

    def heading(self, text: str) -> None:
        self._number += 1
        self.console.print(f"\n{self._number}. {text}", style="bold", markup=False, highlight=False)

    def text(self, text: str) -> None:
        self.console.print(Padding(escape(monospace(text)), (0, 0, 0, 3)), highlight=False)

    def code(self, code: str, result: str = "") -> None:
        self.console.print(Padding(f"[cyan]>>> {escape(monospace(code))}[/]", (0, 0, 0, 3)), highlight=False)
        if result:
            self.console.print(Padding(escape(monospace(result)), (0, 0, 0, 3)), highlight=False)

    def show(self, thing: Any) -> None:
        self.console.print(Padding(thing, (0, 0, 0, 3)))


def _numbers(values: np.ndarray, limit: int = 7) -> str:
    shown = " ".join(f"{x:.4g}" for x in values[:limit])
    return f"[{shown}{' ...' if len(values) > limit else ''}]"


def _relative(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max(initial=0.0) / max(np.abs(b).max(initial=0.0), 1e-300))


def _show_model(robot: Any, say: Say) -> None:
    say.heading(
        f"{robot.name}: {len(robot.bodies)} bodies, {robot.nv} degrees of freedom, "
        f"{sum(b.mass for b in robot.bodies.values()):.4g} kg that move"
    )
    root = Tree(f"[bold]{escape(robot.name)}[/] (base)")
    branches: dict[str | None, Tree] = {None: root}
    for i, body in enumerate(robot.bodies.values()):
        if i == 40:
            root.add(f"... {len(robot.bodies) - 40} more bodies")
            break
        parent = body.parent
        hinge = body.hinge
        branch = branches.get(parent.name if parent else None, root)
        branches[body.name] = branch.add(f"{escape(body.name)}  [dim]{hinge.kind} '{escape(hinge.name)}', {body.mass:.4g} kg[/]")
    say.show(root)


def _show_operators(robot: Any, MM: _core.Operator, soa: Any, say: Say) -> None:
    say.heading("The operators, typed as on paper")
    say.code('H, phi, M, D, K, psi, I = robot.soa("H phi M D K psi I")')
    say.code("MM = H @ phi @ M @ phi.T @ H.T; MM", repr(MM))
    x = np.ones(robot.nv)
    y = MM @ x
    say.code("MM @ np.ones(robot.nv)        # O(N), nothing formed", _numbers(y))
    say.text(f"against the composite-body assembly: {_relative(y + soa.J @ x, robot.mass_matrix(robot.q) @ x):.0e} relative")
    if len(robot.bodies) <= LARGEST_PICTURE:
        S = soa.I - soa.H @ soa.psi @ soa.K
        say.text("\nWhich blocks are there, in the book's order (tip to base): φ gathers forces along the tree; [I-HψK] is what inverts.")
        left, right = _pattern(soa.phi), _pattern(S)
        table = Table(box=None, pad_edge=False)
        table.add_column("φ", justify="left")
        table.add_column("I - HψK", justify="left")
        table.add_row(left, right)
        say.show(table)


def _pattern(operator: _core.Operator) -> str:
    """Return blocks as dots and squares, last body first."""
    norms = operator.blocks(order="tip-to-base").norms()
    return "\n".join(" ".join("■" if x > 1e-14 else "·" for x in row) for row in norms)


def _show_factorization(robot: Any, MM: _core.Operator, soa: Any, say: Say) -> None:
    say.heading("Factor and invert: a filter and a smoother on the tree")
    H, psi, K, D, I, J = soa("H psi K D I J")
    system = MM + J if robot.has_rotor_inertia else MM
    name = "(MM + J)" if robot.has_rotor_inertia else "MM"
    if robot.has_rotor_inertia:
        say.text("This robot has rotor inertia: the hinge-diagonal J enters D, and the factors invert MM + J.")
    S = I - H @ psi @ K
    by_hand = S.T @ D.inv() @ S
    x = np.ones(robot.nv)
    solved = system.inv() @ x
    say.code("S = I - H@psi@K")
    say.code("by_hand = (S.T @ D.inv() @ S).dense(rules=False)    # letter by letter")
    typed = by_hand.dense(rules=False)
    say.code(f"{name}.inv() @ x - by_hand @ x", f"{_relative(solved, typed @ x):.0e} relative")
    exact = np.linalg.solve(system.dense(), x)
    say.text(
        f"against a dense solve: {_relative(solved, exact):.0e} relative (condition of the matrix {np.linalg.cond(system.dense()):.0e})"
    )
    say.code(f"print({name}.inv().explain())", str(system.inv().explain()).rstrip())
    say.code(f"{name}.logdet(), D.logdet()", f"{float(system.logdet()):.12f}, {float(D.logdet()):.12f}")
    share = {body: float(np.trace(block)) for body, block in _shares(robot, soa)}
    top = sorted(share.items(), key=lambda item: -item[1])[:4]
    say.text(
        f"\nEach body's share of the {robot.nv} degrees of freedom, tr(Υ(k)M(k)): "
        + ", ".join(f"{name} {value:.3f}" for name, value in top)
        + f", ...; all together {sum(share.values()):.12g}"
        + (", the rest is the rotors'" if robot.has_rotor_inertia else "")
    )


def _shares(robot: Any, soa: Any) -> Any:
    blocks = (soa.Upsilon @ soa.M).blocks()
    return ((name, blocks[name, name]) for name in robot.bodies)


def _show_beyond(MM: _core.Operator, soa: Any, say: Say) -> None:
    say.heading("Beyond the theorems: any rational expression is still O(N)")
    D, I = soa("D I")
    n = MM.shape[0]
    x = np.ones(n)
    A, Dd = MM.dense(), D.dense()
    for code, operator, dense in (
        ("(MM + 0.1*I).inv()", (MM + 0.1 * I).inv(), np.linalg.inv(A + 0.1 * np.eye(n))),
        ("(MM.inv() + 0.01*D).inv()", (MM.inv() + 0.01 * D).inv(), np.linalg.inv(np.linalg.inv(A) + 0.01 * Dd)),
    ):
        y = operator @ x
        say.code(
            f"{code} @ x",
            f"against dense inverses {_relative(y, dense @ x):.0e} relative; dense step in the plan: {operator.plan().has_dense_step}",
        )
    say.code(
        "(MM + 0.1*I).inv().logdet()",
        f"{float((MM + 0.1 * I).inv().logdet()):.12f}   dense: {-np.linalg.slogdet(A + 0.1 * np.eye(n))[1]:.12f}",
    )


def _show_tip(robot: Any, soa: Any, say: Say) -> None:
    tip = list(robot.bodies)[-1]
    say.heading(f"Operational space of '{tip}'")
    say.code(f'soa.Lambda("{tip}")', "(B*ΩB)⁻¹, the inertia that a hand at the tip feels")
    try:
        inertia = soa.Lambda(tip).dense()
        say.text(f"principal inertias {_numbers(np.sort(np.linalg.eigvalsh((inertia + inertia.T) / 2))[::-1], 6)}")
    except _core.SingularOperatorError as error:
        say.text(f"B*ΩB is singular here, the tip cannot move in every direction: {error}".split(";")[0])


def _show_theorems(robot: Any, soa: Any, say: Say) -> None:
    say.heading("Every theorem, checked on this robot")
    robot.v = robot.random_state(seed=1).v
    report = soa.check(states=1)
    say.text(repr(report))
    say.text("Every one of them: soa.check().full(), or pycraft check --all.")
    say.heading("A conjecture, typed, tested and refuted")
    for statement in ("HψMψ*H* == D", "Ω = Υ + ψ̃*Υ + Υψ̃"):
        say.code(f'pc.check("{statement}")', repr(check(statement)))


def _show_growth(say: Say) -> None:
    say.heading("Cost: chains of rods")
    table = Table(box=None, header_style="bold")
    for column in ("links", "ℳx, µs", "ℳ⁻¹x, µs", "ns a link, ℳ⁻¹x"):
        table.add_column(column, justify="right")
    for n in (10, 100, 1000, 10000):
        arm = chain(n, seed=1)
        H, phi, M = arm.soa("H phi M")
        MM = H @ phi @ M @ phi.T @ H.T
        x = np.ones(n)
        timing = [_core.time_apply(operator, x, 0.05)["median"] for operator in (MM, MM.inv())]
        table.add_row(str(n), *(f"{1e6 * t:.1f}" for t in timing), f"{1e9 * timing[1] / n:.0f}")
    say.show(table)
    begin = time.perf_counter()
    for _ in range(1000):
        H @ phi @ M @ phi.T @ H.T
    say.text(f"typing ℳ in Python: {1e3 * (time.perf_counter() - begin):.1f} µs")
