"""Cost of parts (`pycraft bench`): a call on a part and on the same bodies loaded alone, ratios within one run; results have the same
bits."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from .. import _core
from ..models import robots
from ..models.generators import chain
from ..models.multibody import Multibody
from .bench import Figure, _elapsed, _states, in_turn

BOUND = 1.05
"""A call on a part over the same call on the same model loaded alone."""

CALLS = ("forward_dynamics", "inverse_dynamics", "mass_matrix")


def _alone(part: Multibody) -> Multibody:
    """Return the same bodies as a model that shares nothing."""
    return Multibody.from_description(part.description())


def _of_part(name: str, part: Multibody, seconds: float) -> list[Figure]:
    alone, (q, v, u) = _alone(part), _states(part)
    figures = []
    for call in CALLS:
        own, other = (_results(model, call, q, v, u) for model in (part, alone))
        if not np.array_equal(own, other):
            raise _core.EvaluationError(f"{call} of {part.name} is not that of its bodies alone, in the run that times it")
        here, there = in_turn(seconds, *(partial(_core.time_dynamics, model, call, q, v, u) for model in (part, alone)), rounds=9)
        note = f"{1e6 * here:.2f} us, alone {1e6 * there:.2f}"
        figures.append(Figure(f"{name}: {call} of a part, over the same alone", here / there, "x", BOUND, note))
    q0, v0, x = q[0], v[0], u[0]
    here, there = in_turn(
        seconds, *(partial(_from_python, partial(model.forward_dynamics, q0, v0, x)) for model in (part, alone)), rounds=9
    )
    figures.append(Figure(f"{name}: forward_dynamics from Python, over the same alone", here / there, "x", BOUND, f"{1e6 * here:.2f} us"))
    inverses = [model.soa.MM.inv().at(q[0]) for model in (part, alone)]
    here, there = in_turn(seconds, *(partial(_core.time_apply, inverse, x) for inverse in inverses), rounds=9)
    figures.append(Figure(f"{name}: MM^-1 x of a part, over the same alone", here / there, "x", BOUND, f"{1e6 * here:.2f} us"))
    return figures


def _from_python(call: Callable[[], Any], seconds: float) -> dict[str, float]:
    """Return the median time of a call, in groups of a hundred."""
    call()
    times: list[float] = []
    end = time.perf_counter() + seconds
    while not times or time.perf_counter() < end:
        times.append(_elapsed(call, 100))
    return {"median": float(np.median(times))}


def _results(model: Multibody, call: str, q: np.ndarray, v: np.ndarray, u: np.ndarray) -> Any:
    return getattr(model, call)(q) if call == "mass_matrix" else getattr(model, call)(q, v, u)


def parts(seconds: float = 0.2) -> list[Figure]:
    """Measure an arm of a humanoid, a leg of a quadruped, and the outer half of a long chain."""
    humanoid, quadruped, long = robots.g1(), robots.a1(), chain(200, seed=1)
    chosen = {
        "g1, an arm": humanoid.subgraph(root=_behind(humanoid, "left_shoulder_pitch")),
        "a1 without a leg": quadruped.subgraph(without=_behind(quadruped, "FL_hip")),
        "half of 200 links": long.subgraph(root="body100"),
    }
    return [figure for name, part in chosen.items() for figure in _of_part(name, part, seconds)]


def _behind(robot: Multibody, hinge: str) -> str:
    """Return the body on the hinge with a name that begins so."""
    return next(of.body.name for name, of in robot.hinges.items() if name.startswith(hinge))
