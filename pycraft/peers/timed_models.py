"""Models for timing beside other packages: robots, and chains of growing length."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .. import _core
from ..models import robots
from ..models.loaders.load import read
from ..models.multibody import Multibody
from .peers import GRAVITY, robot_files

CHAINS = (10, 30, 100, 300, 1000)
LONGEST = (10_000, 100_000)
"""Chains for timing only calls of cost O(N)."""
AXES = np.eye(3)[[1, 0, 2]]
ELSEWHERE = {"ANYmal": ("anymal_b_simple_description", "anymal"), "Talos": ("talos_data", "talos_full_v2")}
"""Robots of example-robot-data, each by its folder and its file; on a free base."""


def chain_of_machines(n: int) -> Multibody:
    """Return a chain of n pins about y, x and z in turn, as in machines: links of 0.5 to 1 kg and 0.1 m, no symmetry.

    Other packages have their fastest joints for coordinate axes, so the choice of axes slows none of them.
    """
    model = Multibody(f"chain of {n}")
    inertia = np.array([[2e-3, 1e-4, 0], [1e-4, 1.8e-3, 1e-4], [0, 1e-4, 8e-4]])
    for k in range(n):
        mass = 0.5 + 0.5 * ((0.618 * (k + 1)) % 1)
        model.add_body(
            f"body{k}",
            f"body{k - 1}" if k else None,
            "pin",
            axis=AXES[k % 3],
            position=(0.02, 0.01, 0.1) if k else None,
            mass=mass,
            com=(0.01, 0.005, 0.05),
            inertia=mass * inertia,
        )
    return model


def timed_models(quick: bool, leave_out: Callable[[str], None]) -> Iterator[tuple[str, Any]]:
    """Yield every model with its name, gravity along -z; missing ones are reported. `quick`: two robots and two short chains."""
    for name, model in _robots(quick, leave_out):
        model.gravity = GRAVITY
        yield name, model
    for n in CHAINS[:2] if quick else (*CHAINS, *LONGEST):
        model = chain_of_machines(n)
        model.gravity = GRAVITY
        yield model.name, model


def _robots(quick: bool, leave_out: Callable[[str], None]) -> Iterator[tuple[str, Any]]:
    yield "UR5", robots.ur5()
    yield "Panda", robots.panda()
    if quick:
        return
    for name, (folder, file) in ELSEWHERE.items():
        try:
            paths = [path for path in robot_files() if path.stem == file and folder in path.parts]
        except _core.Error as missing:
            leave_out(f"{name}: {missing}")
            continue
        if not paths:
            leave_out(f"{name}: the installed example-robot-data has no {folder}/{file}.urdf")
            continue
        yield name, read(paths[0], root="free", mimic="free")[0]
    yield "G1", robots.g1()
