"""Displacements on the group of configurations: brackets, and the exponential to second order.

Ball and free subhinges turn; displacements along all others are scalars, with zero brackets.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import _core


def turning(model: Any) -> list[slice]:
    """Return the slices of v with the coordinates of ball (3) and free (6) subhinges."""
    found, at = [], 0
    for hinge in model.hinges.values():
        for subhinge in hinge.subhinges:
            n = _core.subhinge_kinds[subhinge["kind"]].nv
            if subhinge["kind"] in ("ball", "free"):
                found.append(slice(at, at + n))
            at += n
    return found


def brackets(turns: Sequence[slice], v: np.ndarray) -> np.ndarray:
    """Return ad(v) (..., nv, nv): the brackets of the twists of ball and free subhinges, at `turns`, with those in v; zero elsewhere."""
    out = np.zeros((*v.shape, v.shape[-1]))
    for of in turns:
        out[..., of, of] = _bracket(v[..., of])
    return out


def cobrackets(turns: Sequence[slice], costate: np.ndarray) -> np.ndarray:
    """Return C (..., nv, nv) with x*C y = costate*[x, y]: skew, -[[n~, f~], [f~, 0]] on free hinges, -n~ on balls."""
    out = np.zeros((*costate.shape, costate.shape[-1]))
    for of in turns:
        moment, at = _skew(costate[..., of][..., :3]), of.start
        out[..., at : at + 3, at : at + 3] = -moment
        if of.stop - at == 6:
            force = _skew(costate[..., of][..., 3:])
            out[..., at : at + 3, at + 3 : at + 6] = out[..., at + 3 : at + 6, at : at + 3] = -force
    return out


def _bracket(v: np.ndarray) -> np.ndarray:
    """Return ad(v) of one ball (..., 3, 3) or free (..., 6, 6) subhinge."""
    angular = _skew(v[..., :3])
    if v.shape[-1] == 3:
        return angular
    return np.block([[angular, np.zeros_like(angular)], [_skew(v[..., 3:]), angular]])


def _skew(x: np.ndarray) -> np.ndarray:
    out = np.zeros((*x.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i, j], out[..., j, i] = -x[..., k], x[..., k]
    return out


def displaced(model: Any, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return q exp(u) of each state of a batch, (B, nq)."""
    return np.reshape([model.integrate(*one) for one in zip(q, u, strict=True)], q.shape)


class Moved:
    """q exp(u) after displacements of q and u, as a displacement from q exp(u) at the present q and u, to second order.

        log(exp(-u) exp(δ) exp(u + η)) = Ad δ + J η + ½ [Ad δ, J η] + ½ J'(η) η,    Ad = exp(-ad u), J = φ₁(-ad u), φ₁(x) = (eˣ - 1)/x

    J is the exponential's differential in the axes after the motion, J' its derivative along η. Both are identities if nothing turns.
    Source: the Baker-Campbell-Hausdorff formula; A. Iserles and others, Lie-group methods, Acta Numerica 9 (2000).

    Attributes
    ----------
    adjoint, differential : Ad and J, (..., nv, nv)
    """

    def __init__(self, turns: Sequence[slice], u: np.ndarray):
        from scipy.linalg import expm

        self._turns, self._u = turns, u
        ones = np.broadcast_to(np.eye(u.shape[-1]), (*u.shape, u.shape[-1]))
        self.adjoint, self.differential = ones.copy(), ones.copy()
        for of in turns:
            both = expm(_beside_one(-_bracket(u[..., of])))  # exp [[A, 1], [0, 0]] = [[exp A, φ₁(A)], [0, 1]]
            n = of.stop - of.start
            self.adjoint[..., of, of], self.differential[..., of, of] = both[..., :n, :n], both[..., :n, n:]

    def curvature(self, costate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return second derivatives of costate*(the displacement above), costate (..., m, nv): along δ and η, and along η and η, (..., m,
        nv, nv)."""
        from scipy.linalg import expm

        ad, differential = self.adjoint[..., None, :, :], self.differential[..., None, :, :]
        both = 0.5 * np.swapaxes(ad, -1, -2) @ cobrackets(self._turns, costate) @ differential
        own = np.zeros_like(both)
        for of in self._turns:
            n = of.stop - of.start
            M = _beside_one(-_bracket(self._u[..., of]))
            for i in range(n):
                along = np.zeros_like(M)
                along[..., :n, :n] = -_bracket(np.eye(n)[i])
                slope = expm(np.block([[M, along], [np.zeros_like(M), M]]))[..., :n, 3 * n :]  # of φ₁, by Fréchet's derivative
                own[..., of.start + i, of] = costate[..., of] @ slope
        return both, (own + np.swapaxes(own, -1, -2)) / 2


def _beside_one(A: np.ndarray) -> np.ndarray:
    """Return [[A, 1], [0, 0]]."""
    ones = np.broadcast_to(np.eye(A.shape[-1]), A.shape)
    return np.block([[A, ones], [np.zeros_like(A), np.zeros_like(A)]])
