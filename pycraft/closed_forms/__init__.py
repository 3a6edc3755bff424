"""Closed forms of small mechanisms: every letter and every expression as formulas in the coordinates and parameters."""

from .closed_forms import ClosedForms, symbolic

__all__ = ["ClosedForms", "symbolic"]
