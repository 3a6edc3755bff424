"""The oracle for tests, loaded from its files, and how closely results are compared with it.

`reference` needs nothing of the rest of the package, so tests of it pass before the core is built.

Tolerances. Poses, H, φ, ℳ and forces are sums of at most some hundred products, handed through at most ten bodies by matrices
with entries up to about 10: `ROUNDING` allows 10⁴ roundings relative to the largest entry, and complex steps have no truncation
error to add. Results behind an inverse are allowed that times its condition number. Fourth-order differences with step h lose
eps/h to rounding and about h⁴ to truncation: with h = 1e-3 both are near 1e-12, and `DIFFERENCE` allows 10³ of it.
"""

import importlib
import pathlib
import pickle
import sys
import types

import numpy as np

FOLDER = pathlib.Path(__file__).parents[2] / "pycraft"
SOURCES = sorted((FOLDER / "reference").glob("*.py"))
alone = sys.modules["pycraft_alone"] = types.ModuleType("pycraft_alone")  # the folder as a package without its __init__
alone.__path__ = [str(FOLDER)]
reference = importlib.import_module("pycraft_alone.reference")

_operators, _kept = reference.operators, {}


def _operators_once(description, q, v=None, form="fast"):
    """`reference.operators`, the last ones kept: one test asks for many things at one state, each of which would make all of them again."""
    key = pickle.dumps((description, q, v, form))
    if key not in _kept:
        while len(_kept) >= 8:
            del _kept[next(iter(_kept))]
        _kept[key] = _operators(description, q, v, form)
    return _kept[key]


reference.operators = _operators_once

ROUNDING = 1e4 * np.finfo(float).eps
DIFFERENCE = 1e-9


def agree(actual, expected, tolerance=ROUNDING):
    """Assert that the arrays differ by at most tolerance times their largest entry (1 where that is less)."""
    actual, expected = np.asarray(actual), np.asarray(expected)
    assert actual.shape == expected.shape
    error, size = np.abs(actual - expected).max(initial=0.0), np.abs([*actual.flat, *expected.flat]).max(initial=1.0)
    assert error <= tolerance * size, f"error {error:.2e} against {size:.2e}, tolerance {tolerance:.1e}"
