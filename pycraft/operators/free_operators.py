"""The operators of free coordinates with others prescribed (hybrid dynamics)."""

from __future__ import annotations

from collections.abc import Sequence

from .. import _core
from .operator_set import OperatorSet, some_of


class FreeOperators(OperatorSet):
    """The operators of free coordinates, and the motion due to the prescribed ones with the free ones following."""

    def __init__(self, whole: OperatorSet, held: Sequence[bool]):
        super().__init__(_core._some_coordinates(whole._source, [not one for one in held]), whole._model)
        self._whole, self._held_ones, self._of_prescribed = whole, list(held), some_of(whole, held)

    def __reduce__(self):
        return FreeOperators, (self._whole, self._held_ones)

    @property
    def of_prescribed(self) -> OperatorSet:
        """The operators of the prescribed coordinates."""
        return self._of_prescribed

    @property
    def Y(self) -> _core.Operator:
        """``Y = (I - Ω_f M) φ* = ψ_f* - Ω_f P_f``, V → V: motions of all bodies by motions at hinges, the free ones feeling no force."""
        return self.psi.T - self.Omega @ self.P

    @property
    def Schur_complement(self) -> _core.Operator:
        """``ℳ_pp + J_p - ℳ_pf (ℳ_ff + J_f)⁻¹ ℳ_fp``, Θ_p → Θ_p: the inertia felt at prescribed coordinates, the free ones following.

        ``H_p Y*MY H_p*`` if hinges have no rotor inertia.
        """
        H_p, H_f, whole = self.of_prescribed.H, self.H, self._whole
        inertia = whole.phi @ whole.M @ whole.phi.T
        coupled = H_f @ inertia @ H_p.T
        return H_p @ inertia @ H_p.T + self.of_prescribed.J - coupled.T @ (H_f @ inertia @ H_f.T + self.J).inv() @ coupled

    def generalized_Jacobian(self, names: str | Sequence[str]) -> _core.Operator:
        """Return ``B* Y H_p*``, Θ_p → NodesV: motions of these nodes by velocities of the prescribed coordinates, the free ones following.

        If only a free-flying base is not prescribed, this is the generalized Jacobian of space robots: momentum stays zero.
        """
        return self._whole.B(names).T @ self.Y @ self.of_prescribed.H.T
