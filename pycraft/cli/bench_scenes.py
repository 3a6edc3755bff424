"""Cost of scenes (`pycraft bench`): a scene and the same written by hand in C++, ratios within one run; results have the same bits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from .. import _core
from ..models.generators import chain
from ..scenes import Scene, effects
from .bench import Figure, _states, in_turn

EMPTY, ONE, OFF, TEN = 1.05, 1.10, 1.03, 1.0
"""Bounds: an empty scene over the bare kernel, one effect over the same by hand, disabled effects over none, ten over each alone."""


def _by_hand(last: str) -> dict[str, list[effects.Effect]]:
    """Return scenes of no or one effect, by the name of the hand-written version (cpp/bench/scenes_by_hand.h)."""
    return {
        "nothing": [],
        "gravity": [effects.Gravity()],
        "damping": [effects.Damping(0.1)],
        "spring": [effects.Spring(2.0, 0.1)],
        "friction": [effects.CoulombFriction(0.3, 0.01)],
        "motor": [effects.Motor(0.5, 5.0, 100.0)],
        "wrench": [effects.Wrench(last, (1, 2, 3, 4, 5, 6))],
    }


def _ten(last: str, hinge: str) -> list[effects.Effect]:
    """Return ten effects, three of which read the same poses."""
    return [
        effects.Gravity(),
        effects.Damping(0.1),
        effects.QuadraticDamping(0.1),
        effects.CoulombFriction(0.3, 0.01),
        effects.TorqueSource(0.2),
        effects.Motor(0.5, 5.0, 100.0),
        effects.RotorInertia(0.05, hinges=hinge),
        effects.Wrench(last, (1, 2, 3, 4, 5, 6)),
        effects.NodeSpring(None, last, 3.0),
        effects.NodeDamper(None, last, 0.3),
    ]


def _timed(scene: Scene, q: np.ndarray, v: np.ndarray) -> Callable[[float], Mapping[str, float]]:
    return partial(_core.time_scene, scene._calls(), q, v)


def _timed_by_hand(model: Any, what: str, q: np.ndarray, v: np.ndarray, seconds: float) -> Mapping[str, float]:
    return _core.time_by_hand(model, what, q, v, seconds)[0]


def _beside_hand(name: str, model: Any, seconds: float) -> list[Figure]:
    """Time each scene over the same written by hand."""
    q, v, _ = _states(model)
    figures = []
    for what, of in _by_hand(list(model.bodies)[-1]).items():
        if what == "spring" and model.nq != model.nv:
            continue  # the hand-written version supports scalar coordinates only
        scene = Scene(model).add(*of)
        vdot = _core.time_by_hand(model, what, q, v, 0.0)[1]
        if not np.array_equal(vdot, scene.evaluate(q[0], v[0]).vdot):
            raise _core.EvaluationError(f"the scene of {what} on {name} is wrong in the run that times it")
        hand, own = in_turn(seconds, partial(_timed_by_hand, model, what, q, v), _timed(scene, q, v), rounds=9)
        text = "empty scene over the bare kernel" if what == "nothing" else f"{what} over the same by hand"
        figures.append(Figure(f"{name}: {text}", own / hand, "x", ONE if of else EMPTY, f"{1e9 * own:.0f} ns and {1e9 * hand:.0f} ns"))
    return figures


def _beside_itself(name: str, model: Any, seconds: float) -> list[Figure]:
    """Time disabled effects, and ten effects over each alone."""
    q, v, _ = _states(model)
    ten = _ten(list(model.bodies)[-1], list(model.hinges)[-1])
    off = Scene(model).add(*ten)
    off.disable(*off.effects)
    if off.evaluate(q[0], v[0]).passes != {"accelerations": 1}:
        raise _core.EvaluationError(f"what is off on {name} has passes")
    scenes = [Scene(model), off, Scene(model).add(*ten), *(Scene(model).add(effect) for effect in ten)]
    empty, disabled, all_, *alone = in_turn(seconds, *(_timed(scene, q, v) for scene in scenes), rounds=9)
    total = sum(each - empty for each in alone)
    return [
        Figure(f"{name}: ten effects that are off over none", disabled / empty, "x", OFF, f"{1e9 * disabled:.0f} ns"),
        Figure(f"{name}: ten effects over the sum of each alone", (all_ - empty) / total, "x", TEN, f"{1e9 * all_:.0f} ns in all"),
    ]


def scenes(seconds: float = 0.2) -> list[Figure]:
    """Return all pairs, on two robots and a chain."""
    from ..models import robots

    figures = []
    for name, model in (("panda", robots.panda()), ("g1", robots.g1()), ("chain of 100", chain(100, seed=1))):
        figures += _beside_hand(name, model, seconds) + _beside_itself(name, model, 3 * seconds)
    return figures
