"""Trajectories of a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Trajectory:
    """States of a model over time, and the cost of computing them.

    Attributes
    ----------
    t : (T,) s, the requested times
    q, v : (T, nq), (T, nv), the states at them; the first is the initial one
    evaluations : evaluations of forward dynamics
    seconds : wall time
    steps, rejected : steps taken, and rejected steps (0 for solvers of other packages, which do not report them)
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    evaluations: int
    seconds: float
    steps: int
    rejected: int = 0
