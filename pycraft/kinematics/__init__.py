"""Inverse kinematics: configurations that bring frames to targets (docs/inverse_kinematics.md)."""

from .inverse_kinematics import solve_ik
from .solution import Solution

__all__ = ["Solution", "solve_ik"]
