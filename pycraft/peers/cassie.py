"""Cassie of example-robot-data as published: an SDF file, with links connected in loops by pins and balls.

Source: Agility Robotics, cassie_v2.sdf.
"""

from __future__ import annotations

from pathlib import Path

from .. import _core
from ..models.loaders.load import read
from ..models.loaders.named_robots import example_robots
from ..models.multibody import Multibody


def cassie_file() -> Path:
    """Return its path in the installed example-robot-data. ModelError if it is missing."""
    if "cassie_v2" not in (files := example_robots()):
        raise _core.ModelError("the installed example-robot-data has no Cassie")
    return files["cassie_v2"]


def cassie() -> Multibody:
    """Return the model at the pose of the file, free at its pelvis, without warnings."""
    return read(cassie_file(), root="free")[0]
