"""Other tools' conventions: SciPy, Pinocchio, MuJoCo, Drake. The only place that knows them; none is imported before it is used."""

from . import export, mujoco, pinocchio
from .scipy import from_scipy, to_scipy

__all__ = ["export", "from_scipy", "mujoco", "pinocchio", "to_scipy"]
