"""Scenes: a model and the effects that act on it, each added by name; what is not named costs nothing."""

from . import effects
from .file_reader import load_scene
from .scene import Scene

__all__ = ["Scene", "effects", "load_scene"]
