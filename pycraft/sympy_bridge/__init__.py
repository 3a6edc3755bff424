"""The bridge to SymPy: expressions as matrix expressions of noncommuting symbols, and back."""

from .sympy_bridge import from_sympy, parse, to_sympy

__all__ = ["from_sympy", "parse", "to_sympy"]
