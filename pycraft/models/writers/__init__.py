"""Models to files: TOML for every model, URDF and MJCF for what they know."""

from .save import save

__all__ = ["save"]
