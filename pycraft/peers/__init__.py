"""Other tools beside this one: what a model of theirs differs in, and both tools' numbers."""

from .compare import ModelComparison, compare

__all__ = ["ModelComparison", "compare"]
