"""The operators of a model by their letters, and views of their blocks."""

from .operator_set import OperatorSet

__all__ = ["OperatorSet"]
