"""The live viewer: a scene that plays, is moved by sliders and changed while it goes, in a page that this machine serves to itself."""

from .view import View, view_model, view_scene

__all__ = ["View", "view_model", "view_scene"]
