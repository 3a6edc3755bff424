"""Controllability and observability of a linear model, with the uncontrollable or unobservable directions by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number
from .linear_model import LinearModel

SHARE = 0.1
"""A direction names a state if its entry is at least this part of the largest."""


@dataclass(frozen=True)
class Reach:
    """The controllable (observable) part of a linear model.

    Attributes
    ----------
    rank : dimension of this part
    complete : whether it is the whole state space
    directions : (n, n - rank), orthonormal: combinations of states that no input moves (displacements and velocities that no output shows)
    names : the states in each direction with their shares, the largest first
    margin : the least singular value of [A - λI, B] over the eigenvalues λ (of [A* - λI, C*]), relative to ‖A‖ + ‖B‖, states balanced and
        inputs of unit length: the distance from losing a direction; 0 without states
    """

    kind: str
    rank: int
    directions: np.ndarray
    names: tuple[dict[str, float], ...]
    margin: float

    @property
    def complete(self) -> bool:
        return self.directions.shape[1] == 0

    def __bool__(self) -> bool:
        return self.complete

    def __repr__(self) -> str:
        of = f"{self.rank} of {len(self.directions)} directions {self.kind}"
        if self.complete:
            return f"<{of}, margin {self.margin:.1e}>"
        lost = "; ".join(", ".join(f"{share:+.2g} {name}" for name, share in named.items()) for named in self.names[:4])
        return f"<{of}; not: {lost}{'; ...' if len(self.names) > 4 else ''}>"


def controllability_of(of: LinearModel, tolerance: Any = None) -> Reach:
    """Return the reach of the inputs. tolerance : relative, below which a singular value is zero; default n eps √n."""
    return _reach("controllable", of.A, of.B, of.states, tolerance)


def observability_of(of: LinearModel, tolerance: Any = None) -> Reach:
    """Return the reach of the outputs: controllability of (A*, C*)."""
    return _reach("observable", of.A.T, of.C.T, of.states, tolerance)


def _reach(kind: str, A: np.ndarray, B: np.ndarray, states: tuple[str, ...], tolerance: Any) -> Reach:
    """Compute the staircase form by orthogonal changes of states: the range of B, its image under A, and so on until nothing is new.

    Source: P. Van Dooren, The generalized eigenstructure problem in linear system theory, IEEE Trans. Automatic Control 26 (1981).
    """
    n = len(A)
    relative = n**1.5 * np.finfo(float).eps if tolerance is None else one_number(tolerance, "tolerance")
    if not 0 <= relative < np.inf:
        raise _core.EvaluationError(f"tolerance={relative:g}: the relative size below which a singular value is zero, not negative")
    scale = balanced(A)
    A, B = A * (1 / scale)[:, None] * scale, B / scale[:, None]
    lengths = np.linalg.norm(B, axis=0)
    B = B[:, lengths > 0] / lengths[lengths > 0]  # the units of inputs do not matter
    basis, new, size = np.zeros((n, 0)), B, 1.0
    while basis.shape[1] < n:
        rest = new - basis @ (basis.T @ new)
        rest -= basis @ (basis.T @ rest)
        U, sigma, _ = np.linalg.svd(rest, full_matrices=False)
        found = U[:, sigma > relative * size]
        if not found.shape[1]:
            break
        basis = np.hstack([basis, found])
        new, size = A @ found, float(np.linalg.norm(A))
    U = np.linalg.svd(basis, full_matrices=True)[0] if basis.shape[1] else np.eye(n)
    left = U[:, basis.shape[1] :] / scale[:, None]  # in the states' own units: no input moves w*x
    lost = np.linalg.qr(left)[0] if left.shape[1] else left
    names = tuple(_named(column, states) for column in lost.T)
    pencils = [np.hstack([A - value * np.eye(n), B]) for value in np.linalg.eigvals(A)] if n else []
    margin = min((np.linalg.svd(pencil, compute_uv=False)[-1] for pencil in pencils), default=0.0)
    whole = np.linalg.norm(A) + np.linalg.norm(B)
    return Reach(kind, basis.shape[1], lost, names, float(margin / whole) if whole else 0.0)


def balanced(A: np.ndarray) -> np.ndarray:
    """Return powers of two that scale the states so that rows and columns of A have similar sizes: the rank does not depend on units."""
    from scipy.linalg import matrix_balance

    return matrix_balance(A, permute=False, separate=True)[1][0] if len(A) else np.ones(0)


def _named(direction: np.ndarray, states: tuple[str, ...]) -> dict[str, float]:
    largest = np.abs(direction).max(initial=0.0)
    order = np.argsort(-np.abs(direction), kind="stable")
    sign = np.sign(direction[order[0]])
    return {states[k]: float(sign * direction[k]) for k in order if abs(direction[k]) >= SHARE * largest}
