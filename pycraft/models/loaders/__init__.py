"""Models from files: TOML, URDF, SDF and MJCF."""

from .load import load, read

__all__ = ["load", "read"]
