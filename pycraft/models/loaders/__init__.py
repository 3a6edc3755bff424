"""Models from files: URDF and MJCF."""

from .load import load, read

__all__ = ["load", "read"]
