"""Cost of dynamics on loops (`pycraft bench`): growth with the number of loops, apart or in one ladder, by either method; the cost for a
tree of declared loops; and, if Pinocchio is installed, its `constraintDynamics` on ladders and on Cassie."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from .. import _core
from ..compiled.source import FUNCTION
from ..models.linkages import n_four_bar, rod
from ..models.multibody import Multibody
from ..peers.clock import elapsed
from ..scenes import Scene
from ..scenes.effects import Gravity
from ..scenes.effects import Loop as LoopEffect
from .bench import Figure, in_turn

SIZES = (10, 100, 1000, 10_000)
GROWTH = 1.1
"""Exponent of the time by the loops, least squares of its logarithm: one, plus the cache misses of larger models."""
TREE = 1.1
"""A direct call of a model with loops over the same without: one, plus the resolution of clocks."""
RUNGS, COMPILED, BESIDE = 100, (1, 3, 10, 30), 1 / 3
"""Ladders that Pinocchio computes as well, by the call and by the compiled call, and our largest share of its time."""

BY_HAND = 2.0
"""A four-bar's compiled accelerations over its own compiled equations."""


def ladder(rungs: int) -> Multibody:
    """Return cranks on the ground, each joined to the next by a rod: every loop shares its cranks with its neighbours."""
    model = n_four_bar(rungs)
    model.gravity = (0, -9.81, 0)
    return model


def apart(loops: int) -> Multibody:
    """Return four-bars beside each other."""
    model = Multibody(f"{loops} four-bars")
    for i in range(loops):
        inboard = None
        for j in range(3):
            model.add_body(f"rod{i}.{j}", inboard, position=(0, 0, i) if j == 0 else (1, 0, 0), **rod())
            inboard = f"rod{i}.{j}"
        model.add_loop(model.add_node(f"end{i}", inboard, position=(1, 0, 0)), hinge="pin", position=(1, 0, i), name=f"loop{i}")
    model.gravity = (0, -9.81, 0)
    return model


def _by_augmentation(model: Multibody, q: np.ndarray) -> Callable[[], np.ndarray]:
    v = np.zeros(model.nv)
    return lambda: model.constrained_dynamics(q, v).vdot


def _by_embedding(model: Multibody, q: np.ndarray) -> Callable[[], np.ndarray]:
    scene, v = Scene(model).add(Gravity(model.gravity), LoopEffect(method="embed")), np.zeros(model.nv)
    return lambda: scene.evaluate(q, v).vdot


def _seconds(name: str, call: Callable[[], np.ndarray], expected: float) -> float:
    """Return the least time of some rounds, in this thread's own time, since other programs interrupt long calls. The cranks' accelerations
    are known."""
    times: list[float] = []
    while len(times) < 5 or (len(times) < 100 and sum(times) < 0.2):
        begin = time.thread_time()
        vdot = call()
        times.append(time.thread_time() - begin)
        if not abs(vdot[0] - expected) <= 1e-7 * abs(expected):  # for 10⁴ rungs, eps times the square of their number
            raise _core.EvaluationError(f"{name} does not move as it should, in the run that times it")
    return min(times)


def growth() -> list[Figure]:
    """Return the exponents of the time of accelerations on loops, for ladders and for separate four-bars."""
    angle, figures = 1.0, []
    for name, make, by in (
        ("ladder", ladder, _by_augmentation),
        ("ladder, embedded", ladder, _by_embedding),
        ("four-bars apart", apart, _by_augmentation),
        ("four-bars apart, embedded", apart, _by_embedding),
    ):
        times = []
        for n in SIZES:
            model = make(n)
            if make is ladder:
                q, expected = _cranks(angle, n)
            else:
                q, expected = np.tile([angle, -angle, angle - math.pi], n), -1.2 * 9.81 * math.cos(angle)
            times.append(_seconds(f"{name!r} of {n}", by(model, q), expected))
        exponent = float(np.polyfit(np.log(SIZES), np.log(times), 1)[0])
        told = f"{', '.join(f'{1e6 * t:.0f}' for t in times)} us"
        figures.append(Figure(f"dynamics on loops, {name}, {SIZES[0]} to {SIZES[-1]}", exponent, "", GROWTH, told))
    return figures


def _cranks(angle: float, rungs: int) -> tuple[np.ndarray, float]:
    """Return a ladder's q and the accelerations of its cranks: of 1 kg and 1 m each, (n+1)/3 + n of inertia, (n+1)/2 + n of weight."""
    n = rungs
    q = np.array([angle, -angle] * n + [angle])
    return q, -9.81 * math.cos(angle) * ((n + 1) / 2 + n) / ((n + 1) / 3 + n)


def tree_with_loops(seconds: float = 0.1) -> Figure:
    """Time forward dynamics of the tree of a ladder with its loops declared, over the same tree without them."""
    model, bare = ladder(SIZES[0]), ladder(SIZES[0])
    for name in list(bare.loops):
        bare.loops.remove(name)
    q, v = np.array(model.q), np.zeros(model.nv)
    if not np.array_equal(model.forward_dynamics(q, v, v), bare.forward_dynamics(q, v, v)):
        raise _core.EvaluationError(f"'{model.name}' moves otherwise with its loops declared, in the run that times it")
    declared, without = in_turn(seconds, *(partial(elapsed, partial(one.forward_dynamics, q, v, v)) for one in (model, bare)))
    return Figure("direct calls of a tree with loops declared, over one without", declared / without, "x", TREE, f"{1e6 * declared:.1f} us")


def four_bar_by_hand(seconds: float = 0.1) -> Figure:
    """Time a four-bar's compiled accelerations over the equations that SymPy derives and prints for it, without any checks; both in C++."""
    from ..sympy_bridge import four_bar_by_sympy

    model, rng = ladder(1), np.random.default_rng(0)
    compiled, library = model.compile("constrained_dynamics"), four_bar_by_sympy.library(9.81)
    angles, speeds = rng.uniform(0.4, 2.6, 8), rng.normal(size=8)
    given = [np.column_stack([x, -x, x]) for x in (angles, speeds)] + [rng.normal(size=(8, 3))]
    by_hand = four_bar_by_sympy.accelerations(library, *given)
    wanted = np.array([compiled(*one) for one in zip(*given, strict=True)])
    if not np.abs(by_hand - wanted).max() <= 1e-10 * np.abs(wanted).max():  # rounding times the loss of rows at an angle of 0.4 rad
        raise _core.EvaluationError("a four-bar's own equations and its accelerations disagree, in the run that times them")

    def clock(place: str) -> Callable[[float], dict[str, float]]:
        return lambda seconds: _core.time_compiled(place, FUNCTION, given, 3, seconds)

    own, other = in_turn(seconds, clock(str(compiled.library)), clock(library))
    told = f"{1e9 * own:.0f} and {1e9 * other:.0f} ns"
    return Figure("dynamics on loops, a four-bar compiled, over its equations by SymPy, compiled", own / other, "x", BY_HAND, told)


def _beside(name: str, ours: Callable[[], np.ndarray], theirs: Callable[[], np.ndarray], near: float, peer: Any, seconds: float) -> Figure:
    """Time our call over Pinocchio's; `near`: the tolerance, relative to the largest acceleration."""
    wanted = ours()
    if not np.abs(peer.ours(theirs()) - wanted).max() <= near * np.abs(wanted).max():
        raise _core.EvaluationError(f"Pinocchio and PyCraft disagree on {name}, in the run that times them")
    own, other = in_turn(seconds, partial(elapsed, ours), partial(elapsed, theirs))
    return Figure(f"dynamics on loops, {name}, over Pinocchio's", own / other, "x", BESIDE, f"{1e6 * own:.2f} of {1e6 * other:.2f} us")


def beside_pinocchio(seconds: float = 0.1, ladders: tuple[int, ...] = (*COMPILED, RUNGS)) -> list[Figure]:
    """Time accelerations on loops over Pinocchio's `constraintDynamics`: ladders, balls for pins, and Cassie; nothing without it."""
    if find_spec("pinocchio") is None:
        return []
    from ..peers.cassie import cassie
    from ..peers.pinocchio_loops import PinocchioLoops

    figures = []
    tip = (1, 0, 0)  # rows normal to the plane constrain nothing, so that it iterates: to the accuracy required of ours
    for rungs in ladders:
        model = ladder(rungs)
        (q, _), v = _cranks(1.0, rungs), np.zeros(model.nv)
        peer = PinocchioLoops(model, [((f"crank{i}", tip), (f"rod{i}", tip)) for i in range(1, rungs + 1)])
        if rungs == RUNGS:
            name, ours = f"ladder of {rungs}", _by_augmentation(model, q)
        else:
            name, ours = f"ladder of {rungs}, compiled", partial(model.compile("constrained_dynamics"), q, v, v)
        figures.append(_beside(name, ours, peer.call(q, v, v), 1e-8, peer, seconds))
    model = cassie()
    model.gravity = (0, 0, -9.81)
    state = model.assemble(model.q, np.random.default_rng(0).normal(size=model.nv))
    peer, tau = PinocchioLoops.of_balls(model), np.zeros(model.nv)
    ours = partial(model.compile("constrained_dynamics"), np.array(state.q), np.array(state.v), tau)
    # Two of its rows depend on others: its proximal steps leave an error there, rounding over 1e-8 (docs/loops.md).
    return [*figures, _beside("Cassie, compiled", ours, peer.call(state.q, state.v, tau), 1e-2, peer, seconds)]


def loops() -> list[Figure]:
    """Return all of these figures."""
    return [*growth(), tree_with_loops(), four_bar_by_hand(), *beside_pinocchio()]
