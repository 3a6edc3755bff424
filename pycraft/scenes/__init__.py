"""Scenes: a model and the effects that act on it, each added by name. Effects that are not added cost nothing."""

from . import effects, mechanisms
from .checkpoint import Checkpoint
from .events import Event
from .file_reader import load_scene
from .runs_on_disk import load_run
from .scene import Scene

__all__ = ["Checkpoint", "Event", "Scene", "effects", "load_run", "load_scene", "mechanisms"]
