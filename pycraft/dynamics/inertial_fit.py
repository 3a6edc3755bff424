"""Inertial parameters from linear equations: base parameters, least squares, and the nearest physically possible fit.

Ten parameters are those of a body if its pseudo-inertia is positive,

    L = [[Σ, m c], [m c*, m]] ⪰ 0,   Σ = ½ tr(I) 1 - I,

I about the body's origin: Σ is the second moment of its mass.

Sources: P. M. Wensing, S. Kim, J.-J. E. Slotine, Linear matrix inequalities for physically consistent inertial parameter identification,
IEEE Robotics and Automation Letters 3 (2018); S. Traversaro, S. Brossette, A. Escande, F. Nori, Identification of fully physical consistent
inertial parameters using optimization on manifolds, IROS 2016.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core

NOTHING = 1e-8
"""Remainder of a column of unit length after the columns before it, below which it depends on them."""
ROUNDING = 1e-11
"""Entries of a combination below this are rounding of its columns."""
CONSISTENT = 1e-9
"""Tolerance for negative eigenvalues of a pseudo-inertia that should be zero, relative to its trace: rounding of a fit."""
MARGIN = 1e-6
"""Least pseudo-inertias of a fit, in each direction relative to the prior's."""
LIFT = 1e-2
"""Amount added to a prior without extent, relative to its size, where it measures distances."""
HOLDS = "pip install 'pycraft-soa[identify]'"


def _pseudo_inertia_map() -> np.ndarray:
    """Return L of each of the ten parameters: (10, 4, 4)."""
    L = np.zeros((10, 4, 4))
    L[0, 3, 3] = 1.0
    for i in range(3):
        L[1 + i, i, 3] = L[1 + i, 3, i] = 1.0
    for entry, (row, column) in enumerate(zip(*np.triu_indices(3), strict=True)):
        unit = np.zeros((3, 3))
        unit[row, column] = unit[column, row] = 1.0
        L[4 + entry, :3, :3] = 0.5 * np.trace(unit) * np.eye(3) - unit
    return L


OF_PARAMETERS = _pseudo_inertia_map()


def pseudo_inertia(pi: np.ndarray) -> np.ndarray:
    """Return L (..., 4, 4) of parameters (..., 10)."""
    return np.tensordot(pi, OF_PARAMETERS, axes=1)


def is_consistent(pi: np.ndarray) -> bool:
    """Check that parameters (n, 10) are those of bodies, to the rounding of a fit."""
    L = pseudo_inertia(pi)
    return bool((np.linalg.eigvalsh(L)[:, 0] >= -CONSISTENT * np.abs(np.trace(L, axis1=1, axis2=2))).all()) if len(pi) else True


def without_rounding(pi: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """Return parameters (n, 10), with massless bodies set to zero if the fit found only the rounding of others in them."""
    size = np.abs(pi).max(axis=1, initial=0.0)
    return np.where((~prior.any(axis=1) & (size < ROUNDING * size.max(initial=0.0)))[:, None], 0.0, pi)


@dataclass
class Base:
    """Identifiable combinations of parameters: β = combinations @ θ, by the columns that represent them."""

    columns: np.ndarray  # (r,)
    combinations: np.ndarray  # (r, p)


def base_of(columns: np.ndarray) -> Base:
    """Return the base parameters of columns (rows, p) at states that excite everything.

    Columns are taken in order, by QR: a column without a remainder is a combination of those before it, and its parameter joins theirs.
    """
    size = np.linalg.norm(columns, axis=0)
    used = np.flatnonzero(size > NOTHING * size.max(initial=0.0)) if size.size else np.zeros(0, int)
    scaled = columns[:, used] / size[used]
    own: list[int] = []
    basis = np.zeros((len(columns), 0))
    for i in range(len(used)):
        left = scaled[:, i]
        for _ in range(2):  # twice is enough
            left = left - basis @ (basis.T @ left)
        if (length := np.linalg.norm(left)) > NOTHING:
            own.append(i)
            basis = np.column_stack([basis, left / length])
    combinations = np.zeros((len(own), columns.shape[1]))
    if own:
        upper = basis.T @ scaled
        combinations[:, used] = np.linalg.solve(upper[:, own], upper) * size[used] / size[used[own]][:, None]
        combinations[np.abs(combinations) * size < ROUNDING * size[used[own]][:, None]] = 0.0
    return Base(used[own] if own else np.zeros(0, int), combinations)


@dataclass
class LeastSquares:
    """β with rows @ β near to b, if the rows determine all of it."""

    beta: np.ndarray  # zeros if they do not
    R: np.ndarray  # of rows = Q R
    left: float  # the mean square of the residual, by degrees of freedom
    singular: np.ndarray  # of columns of unit length
    weakest: np.ndarray  # the direction that changes the left side least

    @property
    def rank(self) -> int:
        return int((self.singular > NOTHING * self.singular[:1]).sum())

    @property
    def condition(self) -> float:
        return float(self.singular[0] / self.singular[-1]) if len(self.singular) else 1.0


def least_squares(rows: np.ndarray, b: np.ndarray) -> LeastSquares:
    """Solve by QR of columns of unit length."""
    size = np.linalg.norm(rows, axis=0)
    size[size == 0] = 1.0
    if not len(size):
        return LeastSquares(size, np.zeros((0, 0)), float(b @ b) / max(len(b), 1), size, size)
    Q, R = np.linalg.qr(rows / size)
    _, singular, directions = np.linalg.svd(R, full_matrices=True)
    singular = np.concatenate([singular, np.zeros(len(size) - len(singular))])
    found = LeastSquares(np.zeros(len(size)), R * size, 0.0, singular, directions[-1] / size)
    if found.rank == len(size):
        found.beta = np.linalg.solve(R, Q.T @ b) / size
        left = b - rows @ found.beta
        found.left = float(left @ left) / max(len(b) - len(size), 1)
    return found


def distance(prior: np.ndarray, scalars: np.ndarray, regularizer: str) -> np.ndarray:
    """Return W (p, p) of the squared distance from the prior (n, 10), then from scalars by their sizes.

    "frobenius": ‖L - L₀‖²; "metric": tr(L₀⁻¹ΔL L₀⁻¹ΔL), which is independent of units and axes, and is twice the entropic divergence of L
    from L₀ to its first nonzero order. Source: T. Lee, P. M. Wensing, F. C. Park, Geometric robot dynamic identification: a convex
    programming approach, IEEE Transactions on Robotics 36 (2020).
    """
    if regularizer not in ("metric", "frobenius"):
        raise _core.EvaluationError(f"regularizer={regularizer!r}: there are 'metric' and 'frobenius'")
    many = 10 * len(prior)
    W = np.zeros((many + len(scalars), many + len(scalars)))
    L = pseudo_inertia(prior)
    moments, masses = np.einsum("nii->n", L[:, :3, :3]) / 3, L[:, 3, 3]
    for k in range(len(prior)):
        to = np.eye(4)
        if regularizer == "metric":
            lift = [
                x if x > 0 else np.mean(of[of > 0]) if (of > 0).any() else 1.0 for x, of in ((moments[k], moments), (masses[k], masses))
            ]
            to = np.linalg.inv(np.linalg.cholesky(L[k] + LIFT * np.diag([lift[0]] * 3 + [lift[1]])))
        seen = (to @ OF_PARAMETERS @ to.T).reshape(10, 16)
        W[10 * k : 10 * k + 10, 10 * k : 10 * k + 10] = seen @ seen.T
    W[many:, many:] = np.diag(1.0 / scalars**2 if regularizer == "metric" else np.ones(len(scalars)))
    return W


def nearest(prior: np.ndarray, W: np.ndarray, base: Base, beta: np.ndarray) -> np.ndarray:
    """Return θ with these base parameters that is nearest to the prior."""
    if not len(beta):
        return prior.copy()
    carried, theta = np.linalg.solve(W, base.combinations.T), prior
    for _ in range(2):  # once more to remove rounding
        theta = theta + carried @ np.linalg.solve(base.combinations @ carried, beta - base.combinations @ theta)
    return theta


def nearest_bodies(
    prior: np.ndarray, W: np.ndarray, base: Base, found: LeastSquares, sigma: float, weight: float, bodies: int
) -> np.ndarray:
    """Return physically possible θ, scalars not negative: the least ‖R(β - β̂)‖²/σ² + weight ‖θ - θ₀‖². A semidefinite program, by
    Clarabel.

    The correction of the plain fit is S C⁻¹ y, S the sizes of the prior and C triangular, C*C = S (B*R*RB/(weight σ²) + W) S from a QR that
    squares nothing: the objective is ½‖y‖² and a linear part, whatever the ratio of the log's part and the prior's.

    Raises
    ------
    ImportError
        Clarabel is missing (extra [identify]).
    EvaluationError
        The solver gives up.
    """
    try:
        import clarabel
    except ImportError:
        raise ImportError(
            f"least squares give parameters that are not physically possible; the nearest that are "
            f"need clarabel: {HOLDS}; or take consistent=False"
        ) from None
    from scipy import linalg, sparse

    told = found.R @ base.combinations / sigma
    size, plain = 1.0 / np.sqrt(np.diag(W)), nearest(prior, W, base, found.beta)
    stacked = np.vstack([told * size / np.sqrt(weight), np.linalg.cholesky(W * np.outer(size, size)).T])
    to = size[:, None] * linalg.solve_triangular(np.linalg.qr(stacked, mode="r"), np.eye(len(prior)))  # S C⁻¹
    upper = np.triu_indices(4)
    order = np.lexsort((upper[0], upper[1]))  # column by column
    i, j = upper[0][order], upper[1][order]
    root = np.where(i == j, 1.0, np.sqrt(2.0))
    rows, least = [], []
    for k, L in enumerate(pseudo_inertia(prior[: 10 * bodies].reshape(bodies, 10))):
        lengths = np.sqrt(np.where(np.diag(L) > 0, np.diag(L), 1.0))
        scaled = OF_PARAMETERS / np.outer(lengths, lengths)
        block = np.zeros((10, len(prior)))
        block[:, 10 * k : 10 * k + 10] = (scaled[:, i, j] * root).T
        rows.append(block)
        least.append(np.where(i == j, MARGIN * (np.diag(L)[i] > 0), 0.0))
    rows.append(np.eye(len(prior))[10 * bodies :])
    least.append(np.zeros(len(prior) - 10 * bodies))
    cones = [clarabel.PSDTriangleConeT(4)] * bodies
    if len(prior) > 10 * bodies:
        cones.append(clarabel.NonnegativeConeT(len(prior) - 10 * bodies))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-9
    settings.tol_infeas_abs = settings.tol_infeas_rel = 1e-300  # a feasible point exists: the prior
    positive = np.vstack(rows)
    solution: Any = clarabel.DefaultSolver(
        sparse.eye(len(prior), format="csc"), to.T @ (W @ (plain - prior)), sparse.csc_matrix(-positive @ to),
        positive @ plain - np.concatenate(least), cones, settings,
    ).solve()  # fmt: skip
    if str(solution.status) not in ("Solved", "AlmostSolved"):
        raise _core.EvaluationError(f"the nearest bodies to this fit are not found: Clarabel says {solution.status}")
    return plain + to @ np.asarray(solution.x)
