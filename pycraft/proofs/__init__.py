"""Proofs from the definitions: derivations of statements, exercises with gaps, grading, and repair of wrong formulas."""

from .derivative import derivative
from .exercise import Exercise, Judgement, exercise
from .proof import Proof
from .prove import prove, prove_derivative
from .repair import Repairs, repair
from .worksheet import worksheet

__all__ = ["Exercise", "Judgement", "Proof", "Repairs", "derivative", "exercise", "prove", "prove_derivative", "repair", "worksheet"]
