"""The operators of a model by their letters, and how their blocks are shown."""

from .operator_set import OperatorSet

__all__ = ["OperatorSet"]
