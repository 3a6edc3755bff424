"""Theorems: the checker, a user's own statements, the search for counterexamples, reports. The theorems themselves are the core's."""

from .checker import check, check_model

__all__ = ["check", "check_model"]
