"""A state-space model as an SKO tree: its filter, its smoother and its likelihood are operator expressions, each of O(N)."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, TypeVar

import numpy as np

from .. import _core
from ..models.bare_trees import sko_model
from ..operators.operator_set import OperatorSet
from .dictionary import Dictionary
from .matrices_over_time import count_of_steps, matrices, over_time, require_covariance, roots, stationary, symmetric

_Answer = TypeVar("_Answer")


@dataclass
class Filtered:
    """Results of a filter at each of N steps, forward in time; entries of missing measurements are NaN.

    predicted (N, n) and predicted_covariance (N, n, n) before the step's measurement, filtered and filtered_covariance after it;
    innovations (N, m), innovation_covariance (N, m, m), gain (N, n, m).
    """

    predicted: np.ndarray
    predicted_covariance: np.ndarray
    filtered: np.ndarray
    filtered_covariance: np.ndarray
    innovations: np.ndarray
    innovation_covariance: np.ndarray
    gain: np.ndarray
    log_likelihood: float


@dataclass
class Smoothed:
    """Estimates of every step from all measurements: states (N, n), covariance (N, n, n), the adjoint variable λ (N, n).

    noise (N, n) is the smoothed process noise Bw that entered each step (at the first step: the difference of the state from x0).
    """

    states: np.ndarray
    covariance: np.ndarray
    adjoint: np.ndarray
    noise: np.ndarray


def _naming_the_step(call: Callable[..., _Answer]) -> Callable[..., _Answer]:
    """Report a singular D in the terms of filters."""

    @wraps(call)
    def said(*arguments: Any, **options: Any) -> _Answer:
        try:
            return call(*arguments, **options)
        except _core.SingularHingeError as error:
            step = re.search(r"hinge 't(\d+)'", str(error))
            raise _core.SingularHingeError(
                f"the covariance of the innovation, D = CPC* + R, is singular at step {step[1] if step else '?'}: some measurement there "
                "is known exactly beforehand; give it noise R, or leave it out as NaN"
            ) from error

    return said


def kalman(
    A: Any,
    B: Any = None,
    C: Any = None,
    Q: Any = None,
    R: Any = None,
    x0: Any = None,
    P0: Any = None,
    measurements: Any = None,
    *,
    steps: int | None = None,
) -> StateSpace:
    """Return the SKO model of x_{t+1} = A_t x_t + B_t w_t, y_t = C_t x_t + v_t with w ~ N(0, Q), v ~ N(0, R), for t = 0, ..., N - 1.

    Parameters
    ----------
    A, B, C, Q, R : (n, n), (n, p), (m, n), (p, p), (m, m), or with a leading axis over time
        A_t, B_t, Q_t lead from step t to t + 1: there are N - 1 of them, and one more is ignored. C_t, R_t: N. B=None and C=None are
        identities: noise enters every state, every state is measured. Q and R are required, symmetric positive semidefinite; R may be zero
        where C P C* is not. Scalars are 1 x 1 matrices.
    x0, P0 : (n,), (n, n)
        Mean and covariance of the first state, before its measurement. Defaults: zero, and the stationary covariance of a stable model that
        does not change with time.
    measurements : (N, m), or (N,) where m = 1
        NaN where one is missing. They give the number of steps, determine which rows `.soa` leaves out, and are the default of `.filter()`.
    steps : int
        N, needed if neither measurements nor a time axis of C or R gives it.

    Returns
    -------
    StateSpace : `.soa` the operators, `.dictionary`, `.filter(y)`, `.smooth(y)`, `.log_likelihood(y)`; each costs O(N)

    Raises
    ------
    ModelError
        A model of a mechanism in place of A, a missing Q or R, shapes that do not match, a covariance that is not symmetric positive
        semidefinite, a missing P0 that is needed, values that are not finite.

    Examples
    --------
    A random walk, measured once a step with unit noise:

    >>> import numpy as np
    >>> from pycraft.kalman import kalman
    >>> walk = kalman(1.0, 1.0, 1.0, 1.0, 1.0, x0=0.0, P0=1.0, measurements=[1.0, 2.0])
    >>> walk.filter().filtered.ravel().round(12).tolist()
    [0.5, 1.4]
    >>> (walk.soa.H @ walk.soa.phi @ walk.soa.M @ walk.soa.phi.T @ walk.soa.H.T + walk.soa.J).dense()
    array([[3., 1.],
           [1., 2.]])
    """
    return StateSpace(A, B, C, Q, R, x0, P0, measurements, steps)


_EXAMPLE = "pc.kalman(A=[[1, 0.1], [0, 1]], C=[[1, 0]], Q=0.5 * np.eye(2), R=0.2, P0=np.eye(2), steps=8)"


def _require_matrices(A: Any, Q: Any, R: Any) -> None:
    """Raise ModelError, with an example, for a mechanism in place of a state-space model, or for missing covariances of the noises."""
    if isinstance(A, (_core.Multibody, OperatorSet)):
        raise _core.ModelError(
            f"kalman takes the matrices of a linear state-space model, such as {_EXAMPLE}; a mechanism runs beside the filter in "
            ".play(y, model=arm), where arm is a serial chain with one body for each time step"
        )
    missing = [
        f"{name}, the covariance of the {noise} noise" for name, x, noise in (("Q", Q, "process"), ("R", R, "measurement")) if x is None
    ]
    if missing:
        raise _core.ModelError(f"kalman: give {' and '.join(missing)}, such as {_EXAMPLE}")


class StateSpace:
    """A linear state-space model as an SKO tree; see `kalman`.

    Attributes
    ----------
    soa : OperatorSet
        Body "t3" is step 3; the base is the last step, so blocks and stacked vectors run backward in time.
    dictionary : Dictionary
    steps, n, m : int
        N, size of a state, size of a measurement.
    """

    def __init__(self, A: Any, B: Any, C: Any, Q: Any, R: Any, x0: Any, P0: Any, measurements: Any, steps: int | None):
        _require_matrices(A, Q, R)
        A = matrices(A, "A")
        C = np.eye(A.shape[-1]) if C is None else matrices(C, "C")
        Q, R = matrices(Q, "Q"), matrices(R, "R")
        self.n, self.m = A.shape[-1], C.shape[-2]
        B = np.eye(self.n) if B is None else matrices(B, "B", rows=self.n)
        y = None if measurements is None else self._series(measurements)
        self.steps = count_of_steps(steps, None if y is None else len(y), {"C": C, "R": R}, {"A": A, "B": B, "Q": Q})
        p = Q.shape[-1]
        for x, name, shape in ((A, "A", (self.n, self.n)), (B, "B", (self.n, p)), (C, "C", (self.m, self.n)),
                               (Q, "Q", (p, p)), (R, "R", (self.m, self.m))):  # fmt: skip
            if x.shape[-2:] != shape:
                raise _core.ModelError(f"{name} is {x.shape[-2:]}; with A {A.shape[-2:]}, C {C.shape[-2:]}, Q {Q.shape[-2:]} it is {shape}")
        require_covariance(Q, "Q")
        require_covariance(R, "R")
        noise = symmetric(B @ Q @ np.swapaxes(B, -1, -2))
        self.x0 = np.zeros(self.n) if x0 is None else _core.real_array(x0, "x0").reshape(-1)
        if self.x0.shape != (self.n,) or not np.isfinite(self.x0).all():
            raise _core.ModelError(f"x0 is {self.n} finite numbers, not an array {np.shape(x0)}")
        self.P0 = stationary(A, noise) if P0 is None else matrices(P0, "P0")
        if self.P0.shape != (self.n, self.n):
            raise _core.ModelError(f"P0 is ({self.n}, {self.n}), not {self.P0.shape}")
        require_covariance(self.P0, "P0")
        last = self.steps - 1
        self._A, self._C, self._R = over_time(A, last), over_time(C, self.steps), over_time(symmetric(R), self.steps)
        self._M = np.concatenate([symmetric(self.P0)[None], over_time(noise, last)])
        self._measurements = y
        self._trees: dict[bytes, OperatorSet] = {}
        self.dictionary = Dictionary()

    @property
    def soa(self) -> OperatorSet:
        """The operators of all measurements, or of those that are not missing in the measurements given."""
        seen = np.ones((self.steps, self.m), bool) if self._measurements is None else np.isfinite(self._measurements)
        return self._operators(seen)

    def _operators(self, seen: np.ndarray) -> OperatorSet:
        """Return the operators of the tree with the measured rows of H; the last one built is cached."""
        key = seen.tobytes()
        if key not in self._trees:
            last = self.steps - 1
            times = range(last, -1, -1)
            tree = sko_model(
                range(-1, last),
                [None, *(self._A[t] for t in times[1:])],
                [self._C[t][seen[t]] for t in times],
                [self._M[t] for t in times],
                [self._R[t][np.ix_(seen[t], seen[t])] for t in times],
                names=[f"t{t}" for t in times],
                name="state space",
            )
            self._trees = {key: tree}
        return self._trees[key]

    # ------------------------------------------------------------------ stacked vectors, backward in time
    def _series(self, y: Any) -> np.ndarray:
        made = _core.real_array(y, "measurements")
        if made.ndim == 1 and self.m == 1:
            made = made[:, None]
        if made.ndim != 2 or made.shape[1] != self.m or np.isinf(made).any() or not len(made):
            raise _core.ModelError(f"measurements are ({'N'}, {self.m}) finite numbers, NaN where missing; got an array {np.shape(y)}")
        return made

    def _given(self, y: Any) -> tuple[np.ndarray, np.ndarray, OperatorSet, np.ndarray]:
        """Return y (N, m), a mask of the measured entries, the operators, and the measurements less their mean, stacked."""
        if y is None and self._measurements is None:
            raise _core.ModelError("no measurements: give them here or to kalman(...)")
        series = self._measurements if y is None else self._series(y)
        assert series is not None
        if len(series) != self.steps:
            raise _core.ModelError(f"the model has {self.steps} steps, the measurements {len(series)}")
        seen = np.isfinite(series)
        soa = self._operators(seen)
        return series, seen, soa, series[::-1][seen[::-1]] - soa.H @ (soa.phi @ self._prior())

    def _prior(self) -> np.ndarray:
        """Return x0 at the tip, stacked."""
        made = np.zeros(self.steps * self.n)
        made[-self.n :] = self.x0
        return made

    def _states(self, stacked: np.ndarray) -> np.ndarray:
        """Return a stacked vector of F or V as (N, n), forward in time."""
        return stacked.reshape(self.steps, self.n)[::-1].copy()

    def _blocks(self, operator: _core.Operator) -> np.ndarray:
        """Return the diagonal blocks of an operator of states, (N, n, n), forward in time: it is applied to n vectors. O(N)."""
        made = (operator @ np.tile(np.eye(self.n), (self.steps, 1))).reshape(self.steps, self.n, self.n)[::-1]
        return symmetric(made)

    def _measured(self, stacked: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Return a stacked vector of Θ as (N, m, ...), forward in time; NaN for missing measurements."""
        made = np.full((*seen.shape, *stacked.shape[1:]), np.nan)
        backward = made[::-1]
        backward[seen[::-1]] = stacked
        return made

    # ------------------------------------------------------------------ filter, smoother, likelihood
    @_naming_the_step
    def filter(self, y: Any = None) -> Filtered:
        """Return predicted and filtered states with covariances, innovations, gains, and the log-likelihood. O(N).

        z = ψ(K(y - mean)) + mean, filtered: z + Gε.  Raises SingularHingeError, naming the step, where the innovation's covariance
        D = CPC* + R is singular.
        """
        _, seen, soa, e = self._given(y)
        H, phi, psi, K, G, D, P, P_plus, I = soa("H phi psi K G D P P_plus I")
        mean = phi @ self._prior()
        z = psi @ (K @ e)
        innovations = (I - H @ psi @ K) @ e
        columns = np.zeros((len(e), self.m))
        columns[np.arange(len(e)), np.nonzero(seen[::-1])[1]] = 1.0
        D_blocks, G_blocks = self._measured(D @ columns, seen), (G @ columns).reshape(self.steps, self.n, self.m)[::-1].copy()
        hidden = ~seen
        D_blocks[np.broadcast_to(hidden[:, None, :], D_blocks.shape)] = np.nan
        G_blocks[np.broadcast_to(hidden[:, None, :], G_blocks.shape)] = np.nan
        return Filtered(
            predicted=self._states(mean + z),
            predicted_covariance=self._blocks(P),
            filtered=self._states(mean + z + G @ innovations),
            filtered_covariance=self._blocks(P_plus),
            innovations=self._measured(innovations, seen),
            innovation_covariance=D_blocks,
            gain=G_blocks,
            log_likelihood=self._likelihood(soa, innovations),
        )

    @_naming_the_step
    def smooth(self, y: Any = None) -> Smoothed:
        """Return the states of all steps given all measurements (fixed interval), with covariances. O(N).

        x = z + Pλ, λ = ψ*H*D⁻¹ε, covariance P - PΥP: the form of Bryson and Frazier, equal to the form of Rauch, Tung and Striebel. As one
        formula x = φMφ*H*(ℳ + J)⁻¹y; the covariance is the diagonal blocks of φ(M - MΩM)φ*. Raises as `filter`.
        """
        _, _, soa, e = self._given(y)
        H, phi, M, psi, K, D, P, Upsilon, I = soa("H phi M psi K D P Upsilon I")
        adjoint = (psi.T @ H.T @ D.inv() @ (I - H @ psi @ K)) @ e
        return Smoothed(
            states=self._states(phi @ self._prior() + psi @ (K @ e) + P @ adjoint),
            covariance=self._blocks(P - P @ Upsilon @ P),
            adjoint=self._states(adjoint),
            noise=self._states(M @ adjoint),
        )

    @_naming_the_step
    def log_likelihood(self, y: Any = None) -> float:
        """Return ln p(y) = -½(ε*D⁻¹ε + ln det(ℳ + J) + ln(2π) times the number of measurements). O(N). Raises as `filter`."""
        _, _, soa, e = self._given(y)
        return self._likelihood(soa, (soa.I - soa.H @ soa.psi @ soa.K) @ e)

    def _likelihood(self, soa: OperatorSet, innovations: np.ndarray) -> float:
        if not len(innovations):
            return 0.0
        fit = float(innovations @ (soa.D.inv() @ innovations))
        return -0.5 * (fit + float(soa.D.logdet()) + len(innovations) * float(np.log(2 * np.pi)))

    @property
    def covariance(self) -> _core.Operator:
        """ℳ + J = HφMφ*H* + J: the covariance of all measurements, Θ → Θ, as an expression."""
        H, phi, M, J = self.soa("H phi M J")
        return H @ phi @ M @ phi.T @ H.T + J

    @property
    def posterior(self) -> _core.Operator:
        """φ(M - MΩM)φ*: the covariance of all states given all measurements, V → F, as an expression; blocks off the diagonal are between
        steps. O(N) to apply."""
        phi, M, Omega = self.soa("phi M Omega")
        return phi @ (M - M @ Omega @ M) @ phi.T

    def play(self, y: Any = None, model: Any = None, tau: Any = None) -> Any:
        """Run the dictionary: filter and smoother over time beside forward dynamics of a chain, by one recursion, step by step. O(N).

        Parameters
        ----------
        y : (N, m) measurements, default: those given to `kalman`; NaN where one is missing
        model : Multibody, a serial chain of N bodies; default: equal rods in a plane, on pins with rotors
        tau : (nv,) of its hinges, N m and N; default: ones

        Returns
        -------
        KalmanPage
            A notebook shows it; `save("kalman.html")` writes a page that opens offline. Of several measurements per step the page draws the
            one selected; the recursion uses all.

        Raises
        ------
        EvaluationError
            More than 60 steps.
        ModelError
            Missing measurements; a model that is not a chain of N bodies.
        SingularHingeError
            A singular D, as in `filter`.

        Examples
        --------
        >>> from pycraft.kalman import kalman
        >>> kalman(1.0, 1.0, 1.0, 1.0, 1.0, x0=0.0, P0=1.0, measurements=[1.0, 2.0]).play()
        <filter beside 'chain of 2 rods': 22 steps of 2 times and bodies>
        """
        return _core._face["play_smoother"](self, y, model, tau)

    def sample(self, seed: int | np.random.Generator = 0) -> tuple[np.ndarray, np.ndarray]:
        """Draw states (N, n) and measurements (N, m) from the model: x = φ(noises + x0), y = Hx + v. O(N)."""
        rng = np.random.default_rng(seed)
        noise = np.einsum("tij,tj->ti", roots(self._M), rng.normal(size=(self.steps, self.n)))
        soa = self._operators(np.ones((self.steps, self.m), bool))
        x = self._states(soa.phi @ (noise[::-1].ravel() + self._prior()))
        v = np.einsum("tij,tj->ti", roots(self._R), rng.normal(size=(self.steps, self.m)))
        return x, np.einsum("tij,tj->ti", self._C, x) + v

    def __repr__(self) -> str:
        return f"<state space: {self.steps} steps, states of {self.n}, measurements of {self.m}>"
