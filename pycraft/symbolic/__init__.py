"""The algebra as formulas: closed forms of small mechanisms, the bridge to SymPy."""

from .closed_forms import ClosedForms, symbolic
