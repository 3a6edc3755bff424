"""Other tools' conventions: SciPy, Pinocchio, MuJoCo. The only place that knows them."""

from .scipy import from_scipy, to_scipy

__all__ = ["from_scipy", "to_scipy"]
