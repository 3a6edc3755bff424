"""The live viewer: a page, served by this machine to itself, that plays a scene, with sliders to move it and effects to change."""

from .view import View, view_model, view_scene

__all__ = ["View", "view_model", "view_scene"]
