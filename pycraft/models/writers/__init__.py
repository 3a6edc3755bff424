"""Write models to files: TOML for every model, URDF and MJCF for the features that they have."""

from .save import save

__all__ = ["save"]
