"""Models to files: TOML for every model, URDF for what URDF knows."""

from .save import save

__all__ = ["save"]
