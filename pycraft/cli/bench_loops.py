"""What dynamics on loops costs (`pycraft bench`): how it grows with the loops, apart or in one ladder; that a tree does not pay for
loops that are declared on it; and, where Pinocchio is there, its `constraintDynamics` on the ladder."""

from __future__ import annotations

import math
import time
from functools import partial
from importlib.util import find_spec

import numpy as np

from .. import _core
from ..models.linkages import n_four_bar, rod
from ..models.multibody import Multibody
from ..peers.clock import elapsed
from .bench import Figure, in_turn

SIZES = (10, 1000)
GROWTH = 1.1
"""Exponent of the time over a hundredfold of loops: one, and what larger models lose in caches."""
TREE = 1.1
"""Of a direct call of a model with loops over the same without: one, and what clocks miss."""
RUNGS, BESIDE = 100, 1 / 3
"""Of the ladder that is computed by Pinocchio too, and the share of its time that is ours at most."""


def ladder(rungs: int) -> Multibody:
    """Cranks on the ground, each joined to the next by a rod: every loop shares its cranks with its neighbours."""
    model = n_four_bar(rungs)
    model.gravity = (0, -9.81, 0)
    return model


def apart(loops: int) -> Multibody:
    """Four-bars beside each other."""
    model = Multibody(f"{loops} four-bars")
    for i in range(loops):
        inboard = None
        for j in range(3):
            model.add_body(f"rod{i}.{j}", inboard, position=(0, 0, i) if j == 0 else (1, 0, 0), **rod())
            inboard = f"rod{i}.{j}"
        model.add_loop(model.add_node(f"end{i}", inboard, position=(1, 0, 0)), hinge="pin", position=(0, 0, i), name=f"loop{i}")
    model.gravity = (0, -9.81, 0)
    return model


def _seconds(model: Multibody, q: np.ndarray, expected: float, rounds: int) -> float:
    """The least of some rounds, of this thread's own time: long calls are interrupted by others'. The cranks' accelerations are known."""
    v, times = np.zeros(model.nv), []
    for _ in range(rounds):
        begin = time.thread_time()
        vdot = model.constrained_dynamics(q, v).vdot
        times.append(time.thread_time() - begin)
        if not abs(vdot[0] - expected) <= 1e-9 * abs(expected):
            raise _core.EvaluationError(f"'{model.name}' does not move as it should, in the run that times it")
    return min(times)


def _cranks(angle: float, rungs: int) -> tuple[np.ndarray, float]:
    """A ladder's q and the accelerations of its cranks: of 1 kg and 1 m each, (n+1)/3 + n of inertia, (n+1)/2 + n of weight."""
    n = rungs
    q = np.array([angle, -angle] * n + [angle])
    return q, -9.81 * math.cos(angle) * ((n + 1) / 2 + n) / ((n + 1) / 3 + n)


def tree_with_loops(seconds: float = 0.1) -> Figure:
    """Forward dynamics of the tree of a ladder with its loops declared, over the same tree without them."""
    model, bare = ladder(SIZES[0]), ladder(SIZES[0])
    for name in list(bare.loops):
        bare.loops.remove(name)
    q, v = np.array(model.q), np.zeros(model.nv)
    if not np.array_equal(model.forward_dynamics(q, v, v), bare.forward_dynamics(q, v, v)):
        raise _core.EvaluationError(f"'{model.name}' moves otherwise with its loops declared, in the run that times it")
    declared, without = in_turn(seconds, *(partial(elapsed, partial(one.forward_dynamics, q, v, v)) for one in (model, bare)))
    return Figure("direct calls of a tree with loops declared, over one without", declared / without, "x", TREE, f"{1e6 * declared:.1f} us")


def beside_pinocchio(seconds: float = 0.1) -> list[Figure]:
    """`constrained_dynamics` of a ladder over Pinocchio's `constraintDynamics`, balls for pins; nothing where it is not installed."""
    if find_spec("pinocchio") is None:
        return []
    from ..peers.pinocchio_loops import PinocchioLoops

    model = ladder(RUNGS)
    (q, expected), v = _cranks(1.0, RUNGS), np.zeros(model.nv)
    tip = (1, 0, 0)  # rows across the plane ask nothing, so that it iterates: to the accuracy that is asked of ours
    peer = PinocchioLoops(model, [((f"crank{i}", tip), (f"rod{i}", tip)) for i in range(1, RUNGS + 1)])
    theirs = peer.call(q, v, v)

    def ours() -> np.ndarray:
        return model.constrained_dynamics(q, v).vdot

    for name, vdot in (("Pinocchio", peer.ours(theirs())), ("PyCraft", ours())):
        if not np.abs(vdot - expected * np.sign(q)).max() <= 1e-8 * abs(expected):
            raise _core.EvaluationError(f"{name} is wrong on '{model.name}', in the run that times it")
    own, other = in_turn(seconds, partial(elapsed, ours), partial(elapsed, theirs))
    told = f"{1e6 * own:.0f} of {1e6 * other:.0f} us"
    return [Figure(f"dynamics on loops, ladder of {RUNGS}, over Pinocchio's", own / other, "x", BESIDE, told)]


def loops(rounds: int = 20) -> list[Figure]:
    """Exponents of the time of `constrained_dynamics` from some loops to ten times as many."""
    angle, figures = 1.0, []
    for name, make in (("ladder", ladder), ("four-bars apart", apart)):
        times = []
        for n in SIZES:
            model = make(n)
            if make is ladder:
                q, expected = _cranks(angle, n)
            else:
                q, expected = np.tile([angle, -angle, angle - math.pi], n), -1.2 * 9.81 * math.cos(angle)
            times.append(_seconds(model, q, expected, rounds))
        growth = math.log(times[1] / times[0]) / math.log(SIZES[1] / SIZES[0])
        told = f"{1e6 * times[0]:.0f} to {1e6 * times[1]:.0f} µs"
        figures.append(Figure(f"dynamics on loops, {name}, {SIZES[0]} to {SIZES[1]}", growth, "", GROWTH, told))
    return [*figures, tree_with_loops(), *beside_pinocchio()]
