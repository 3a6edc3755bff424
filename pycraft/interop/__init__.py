"""Other tools' conventions: SciPy, Pinocchio, MuJoCo, Drake. No other layer knows them; each tool is imported on first use."""

from . import export, mujoco, pinocchio
from .scipy import from_scipy, to_scipy

__all__ = ["export", "from_scipy", "mujoco", "pinocchio", "to_scipy"]
