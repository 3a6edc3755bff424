"""Derivatives of the direct calls: arrays in, arrays out. `Operator.diff` gives the same quantities as expressions.

Derivatives by q are along coordinates, and on ball and free hinges along quasi-velocities (as v is given). In third-order arrays the
derivative index is last. Every call takes one state or a leading batch axis, and a precision.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..arguments import chosen, text
from ..state import at_state
from .by_realization import checked_forces, motion_state, output
from .direct_calls import cached
from .operational_space import OperationalSpaceCalls
from .prepared import direct, direct_of
from .threads import over_threads


class DynamicsDerivatives(NamedTuple):
    """Derivatives of inverse dynamics (by q, v and v̇) or of forward dynamics (by q, v and τ), each (nv, nv) or (B, nv, nv)."""

    q: np.ndarray
    v: np.ndarray
    input: np.ndarray


class Momentum(NamedTuple):
    """Momentum about the world's origin in world axes: h = matrix @ v, (6,); matrix (6, nv); dq = ∂h/∂q at v, (6, nv)."""

    value: np.ndarray
    matrix: np.ndarray
    dq: np.ndarray


class SensitivityCalls(OperationalSpaceCalls):
    """Derivatives of inverse and forward dynamics, of the mass matrix, of energy, momentum and Jacobians; the inertial regressor."""

    def _sensitivities(self) -> _core.Sensitivities:
        self._calls()  # contiguous arrays bypass it from the second call on
        return cached(self, "_derivatives", _core.Sensitivities)

    @direct_of(DynamicsDerivatives)
    @over_threads
    def inverse_dynamics_derivatives(
        self, q=None, v=None, vdot=None, *, precision: str = "double", threads: int = 1
    ) -> DynamicsDerivatives:
        """Return ∂T/∂q, ∂T/∂v and ∂T/∂v̇ = ℳ + J of T = inverse_dynamics(q, v, v̇), gravity included. Cost O(N · depth)."""
        q, v = at_state(self, q, v)
        vdot = np.zeros(self.nv) if vdot is None else vdot
        return DynamicsDerivatives(*self._sensitivities().inverse_dynamics(q, v, vdot, precision))

    @direct_of(DynamicsDerivatives)
    @over_threads
    def forward_dynamics_derivatives(
        self,
        q=None,
        v=None,
        tau=None,
        *,
        form: str = "fast",
        refine: int | str = 0,
        residual: str = "same",
        precision: str = "double",
        threads: int = 1,
    ) -> DynamicsDerivatives:
        """Return ∂v̇/∂q, ∂v̇/∂v and ∂v̇/∂τ = (ℳ + J)⁻¹ of v̇ = forward_dynamics(q, v, τ). Raises the same errors.

        In the form "fast": by the sweeps of forward dynamics on one column per coordinate, O(N²); if these are unreliable, at other
        precisions and with refinement, -(ℳ + J)⁻¹ ∂T/∂q and -(ℳ + J)⁻¹ ∂T/∂v at v̇, where forces of heavy bodies hide a light body's. The
        forms "ud" and "square-root" keep the digits that v̇ keeps: the sweep of "ud" is differentiated, four directions at a time, also in
        O(N²), at about N times the cost of one; refinement then acts only on (ℳ + J)⁻¹. If the sweep has no derivative (P⁺ is singular at
        this very configuration, not beside it) the first method is used with the form's inverse.

        The free root's travel enters ∂v̇/∂v only in its own linear accelerations.
        """
        q, v = at_state(self, q, v)
        tau = np.zeros(self.nv) if tau is None else tau
        return DynamicsDerivatives(
            *self._sensitivities().forward_dynamics(q, v, tau, form, refine, chosen(residual, "residual"), precision)
        )

    @over_threads
    def mass_matrix_derivative(self, q=None, *, precision: str = "double", threads: int = 1, out=None) -> np.ndarray:
        """Return ∂ℳ/∂q, (nv, nv, nv) or (B, nv, nv, nv): entry (i, j, k) is ∂ℳ(i,j)/∂q_k. Cost O(N · depth²) beside the zeros."""
        q, _ = at_state(self, q)
        return self._sensitivities().third_order(False, q, precision, out)

    @over_threads
    def christoffel(self, q=None, *, precision: str = "double", threads: int = 1, out=None) -> np.ndarray:
        """Return the Christoffel symbols of the first kind Γ (nv, nv, nv): Σ_jk Γ(i,j,k) v_j v_k is the Coriolis force, Σ_k Γ(i,j,k) v_k =
        C(i,j).

        Γ(i,j,k) = ½(∂_kℳ(i,j) + ∂_jℳ(i,k) - ∂_iℳ(j,k)), plus the brackets of the quasi-velocities on ball and free hinges (Koszul).
        Γ(i,j,k) - Γ(i,k,j) is the term of the bracket: zero for coordinates. Rotors, with constant inertias, contribute only brackets.
        """
        q, _ = at_state(self, q)
        return self._sensitivities().third_order(True, q, precision, out)

    @direct
    @over_threads
    def coriolis_matrix(
        self, q=None, v=None, *, form: str = "christoffel", precision: str | int = "double", threads: int = 1, out=None
    ) -> np.ndarray:
        """Return C (nv, nv) with C v the Coriolis and gyroscopic forces (without gravity) and ℳ̇ - 2C skew. Cost O(N · depth).

        Rotors of balls and free hinges, with momentum Jv, add S with S_ij = (Jv)·[e_i, e_j] to the second, and to the first
        ½(J ad_v - ad_v*J + S): Christoffel's of ℳ + J.

        form="christoffel": C = Hφ(M𝒥̇ + ½(𝓑 + V̄M + MṼ)𝒥) = Γ v, the one for which also ∂(Cv)/∂v = 2C on hinges of one coordinate each;
        "skew": C = Hφ(M𝒥̇ + 𝓑𝒥), 𝒥 = φ*H*, also skew-consistent, but not Christoffel's.
        """
        q, v, form = *at_state(self, q, v), chosen(form, "form")
        if form == "skew" and str(precision).isdigit():  # with that many digits, as operators are
            return self._coriolis_operator(q, v, precision, out)
        return self._sensitivities().coriolis_matrix(q, v, form, precision, out)

    def _coriolis_operator(self, q: Any, v: Any, precision: str | int, out: Any) -> np.ndarray:
        H, phi, M, turning, H_dot, cross = self.soa("H phi M Delta_theta_dot H_dot momentum_cross")  # type: ignore[attr-defined]  # the model's
        J = phi.T @ H.T
        J_dot = phi.T @ (turning.T @ self.soa.phi_tilde.T @ H.T + H_dot.T)  # type: ignore[attr-defined]  # the model's
        C = H @ phi @ (M @ J_dot + cross @ J)
        q, v, *_ = motion_state(self, q, v, np.zeros(self.nv))  # one of them may be shared by the batch
        found = C.at(q, v, precision=precision).dense() + self._rotor_coriolis(v, False)
        result = output(out, found.shape)
        result[...] = found
        return result

    def rotor_forces(self, v=None) -> np.ndarray:
        """Return v ×* (J v) of rotors on balls and free hinges, (nv,) or (B, nv): their forces at zero acceleration
        (docs/conventions.md)."""
        v = at_state(self, None, v)[1]
        if not self.has_rotor_inertia:  # type: ignore[attr-defined]  # the model's
            return np.zeros(np.shape(v))
        J = np.concatenate([np.zeros(0), *map(_without_spheres, self.hinges.values())])  # type: ignore[attr-defined]  # the model's
        return self.rotor_regressor(v, np.zeros(self.nv)) @ J

    def _rotor_coriolis(self, v: np.ndarray, christoffel: bool) -> np.ndarray:
        """Return the rotors' part of C at velocities (..., nv), (..., nv, nv)."""
        return self._sensitivities().rotor_coriolis(_states(v), christoffel).reshape(*v.shape, self.nv)

    @over_threads
    def kinetic_energy_derivatives(self, q=None, v=None, *, precision: str = "double", threads: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """Return ∂KE/∂q and ∂KE/∂v = (ℳ + J) v, each (nv,) or (B, nv). Cost O(N)."""
        q, v = at_state(self, q, v)
        return self._sensitivities().kinetic_energy(q, v, precision)

    @over_threads
    def hamiltonian_dynamics(
        self, q=None, p=None, tau=None, *, precision: str = "double", threads: int = 1
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return v and ṗ of the Hamiltonian form, with generalized momenta p = (ℳ + J) v under the forces tau, gravity included. O(N).

        Default: p of the state's v.

        ṗ = T + Ḣp - HV̄p with the bodies' momenta p = φMV: no derivative of ℳ is formed. Each (nv,) or (B, nv). SingularHingeError
        as in forward dynamics.
        """
        q, v = at_state(self, q)
        if p is None:
            MM, J = self.soa("MM J")  # type: ignore[attr-defined]  # the model's
            q, v, *_ = motion_state(self, q, v, np.zeros(self.nv))
            p = (MM + J).at(q, precision=precision) @ v
        tau = np.zeros(self.nv) if tau is None else tau
        return self._sensitivities().hamiltonian(q, p, tau, precision)

    @over_threads
    def innovations(self, q=None, v=None, tau=None, *, precision: str = "double", threads: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """Return the innovations velocity ξ = [I+HφK]*v and innovations ε = [I-HψK](τ - 𝒞), each (nv,) or (B, nv): decoupled coordinates.

        2 KE = ξ*Dξ, and likewise (τ-𝒞)*(ℳ+J)⁻¹(τ-𝒞) = ε*D⁻¹ε, twice the acceleration energy; both are sums over hinges. O(N).
        """
        q, v, tau, _ = motion_state(self, *at_state(self, q, v), np.zeros(self.nv) if tau is None else tau)
        H, phi, K, psi, I = self.soa("H phi K psi I")  # type: ignore[attr-defined]  # the model's
        forces = tau - self.bias_forces(q, v, precision=precision)
        whole, inverse = (I + H @ phi @ K).T, I - H @ psi @ K
        return whole.at(q, precision=precision) @ v, inverse.at(q, precision=precision) @ forces

    def diagonalised_dynamics(self, q=None, v=None, tau=None, *, precision: str = "double") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return η, S and m⁻¹τ' of η̇ + Sη = m⁻¹τ', m = [I+HφK]D^½, η = m*v, S skew, τ' = τ without gravity: (nv,), (nv, nv), (nv,).

        2 KE = η*η; S does no work. For a batch with a leading axis (B, ...). Cost O(N) for η and m⁻¹τ', O(N²) for S.
        """
        q, v, tau, _ = motion_state(self, *at_state(self, q, v), np.zeros(self.nv) if tau is None else tau)
        H, phi, K, psi, M, D, I = self.soa("H phi K psi M D I")  # type: ignore[attr-defined]  # the model's
        cross, V_bar, V_tilde = self.soa("momentum_cross V_bar V_tilde")  # type: ignore[attr-defined]  # the model's
        root = D.sqrt()
        m, inverse = (I + H @ phi @ K) @ root, root.inv() @ (I - H @ psi @ K)
        J = phi.T @ H.T
        C = H @ phi @ (M @ J.dot() + 0.5 * (cross + V_bar @ M + M @ V_tilde) @ J)
        S = inverse @ C @ inverse.T - m.dot().T @ inverse.T
        rest = np.zeros(self.nv)
        forces = tau - self.bias_forces(q, rest, precision=precision)
        bound = {"precision": precision}
        turned, scaled = S.at(q, v, **bound).dense(), inverse.at(q, v, **bound)
        rotors = self._rotor_coriolis(v, True)
        if rotors.any():
            dense = scaled.dense()
            turned = turned + dense @ rotors @ np.swapaxes(dense, -1, -2)
        return m.T.at(q, v, **bound) @ v, turned, scaled @ forces

    @over_threads
    def momentum(self, q=None, v=None, *, precision: str = "double", threads: int = 1) -> Momentum:
        """Return the momentum of all bodies about the world's origin, its matrix and its derivative. Cost O(N)."""
        q, v = at_state(self, q, v)
        matrix, dq = self._sensitivities().momentum(q, v, precision)
        return Momentum(np.einsum("...ij,...j->...i", matrix, np.asarray(v, float)), matrix, dq)

    @over_threads
    def jacobian_dot(self, frame: str, q=None, v=None, *, precision: str = "double", threads: int = 1) -> np.ndarray:
        """Return the time derivative (6, nv) or (B, 6, nv) of `jacobian(frame, q)` along v, in the same axes. Cost O(N)."""
        q, v = at_state(self, q, v)
        return self._sensitivities().jacobian_rate(text(frame, "a frame"), q, v, precision)

    @over_threads
    def jacobian_derivative(self, frame: str, q=None, *, precision: str = "double", threads: int = 1) -> np.ndarray:
        """Return the kinematic Hessian ∂𝒥/∂q of `jacobian(frame, q)` in its own axes, (6, nv, nv) or (B, 6, nv, nv). Cost O(N + depth²)."""
        q, _ = at_state(self, q)
        return self._sensitivities().jacobian_derivative(text(frame, "a frame"), q, precision)

    @over_threads
    def inertial_regressor(self, q=None, v=None, vdot=None, *, precision: str = "double", threads: int = 1) -> np.ndarray:
        """Return Y (nv, 10 n) or (B, nv, 10 n) with inverse_dynamics = Y π + Y_J J, gravity included, Y_J of the rotors. Cost O(N · depth).

        π holds ten parameters per body, in the bodies' order (`inertial_parameters`): mass, mass times centre of mass (3), rotational
        inertia
        about the body's origin (xx, xy, xz, yy, yz, zz).
        """
        q, v = at_state(self, q, v)
        vdot = np.zeros(self.nv) if vdot is None else vdot
        return self._sensitivities().inertial_regressor(q, v, vdot, precision)

    def rotor_regressor(self, v=None, vdot=None) -> np.ndarray:
        """Return Y_J (nv, nv) or (B, nv, nv) with inverse_dynamics = Y π + Y_J J, J (nv,) the rotor inertias: J v̇ + v ×* (J v).

        On hinges of one coordinate each it is diag(v̇); on balls and free hinges v ×* (J v) is added (docs/conventions.md).

        Examples
        --------
        >>> import pycraft as pc
        >>> gyroscope = pc.tree([-1], ["ball"])
        >>> gyroscope.rotor_regressor(v=[1.0, 2.0, 0.0]) @ [0.0, 0.0, 1.0]  # ω × Jω without a turn of the third rotor
        array([0., 0., 0.])
        >>> gyroscope.rotor_regressor(v=[1.0, 2.0, 0.0]) @ [1.0, 3.0, 0.0]  # (0, 0, (J₂ - J₁) ω₁ω₂)
        array([0., 0., 4.])
        """
        v = at_state(self, None, v)[1]
        vdot = np.zeros(self.nv) if vdot is None else vdot
        arrays = np.broadcast_arrays(*(checked_forces(self, x, name) for x, name in ((v, "v"), (vdot, "vdot"))))
        rows = [_states(x) for x in arrays]
        return self._sensitivities().rotor_regressor(*rows).reshape(*arrays[0].shape, self.nv)

    def inertial_parameters(self) -> np.ndarray:
        """Return π (10 n,) of the regressor, from the bodies' present mass properties."""
        rows = []
        for body in self.bodies.values():  # type: ignore[attr-defined]  # the model's
            c, mass = body.com, body.mass
            about_origin = body.inertia + mass * (c @ c * np.eye(3) - np.outer(c, c))
            rows.append(np.r_[mass, mass * c, about_origin[np.triu_indices(3)]])
        return np.concatenate(rows) if rows else np.zeros(0)

    def log_determinant_gradient(self, q=None, over: str = "coordinates", *, precision: str = "double") -> np.ndarray:
        """Return the gradient of ln det(ℳ + J) in three sweeps, O(N) for every `over`.

        "coordinates" (nv,); "inertias" (n, 10), by the regressor's parameters: tr(Υ∂M); "geometry" (n, 6), by a twist at each hinge's
        placement: 2 tr(P⁺WΔ), W = blockdiag(E*ΥE); "axes" (nv, 6), by the rows of H in the body's axes, poses held: 2(I - P⁺W)G.
        """
        q, _ = at_state(self, q)
        return self._sensitivities().log_determinant(chosen(over, "over"), q, precision)


def _states(x: np.ndarray) -> np.ndarray:
    """Return x (..., n) as (B, n)."""
    return np.ascontiguousarray(x, float).reshape(int(np.prod(x.shape[:-1])), x.shape[-1])


def _without_spheres(hinge: Any) -> np.ndarray:
    """Return the rotor inertias of a hinge minus the first rotor's in all three rotations of a ball or free subhinge, which do not enter v
    ×*."""
    J, at = np.array(hinge.rotor_inertia), 0
    for size in (_core.subhinge_kinds[subhinge["kind"]].nv for subhinge in hinge.subhinges):
        if size > 1:
            J[at : at + 3] -= J[at]
        at += size
    return J
