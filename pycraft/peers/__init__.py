"""Comparison with other tools: differences between models, and results of both tools."""

from .compare import ModelComparison, compare

__all__ = ["ModelComparison", "compare"]
