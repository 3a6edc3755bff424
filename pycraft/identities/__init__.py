"""Theorems: the checker, a user's own statements, the search for counterexamples, reports. The theorems are defined in the core."""

from .checker import check, check_model
from .judge import UndecidedError
from .truth import TruthMap, truth

__all__ = ["TruthMap", "UndecidedError", "check", "check_model", "truth"]
