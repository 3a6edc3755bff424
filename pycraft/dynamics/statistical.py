"""Statistical dynamics: velocities in equilibrium, and the Fixman potential that compensates the effect of constraints on
configurations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core
from ..arguments import LARGEST, clipped, seed_of, thermal_energy
from ..state import at_state


class StatisticalCalls:
    """Velocities drawn in thermal equilibrium, the Fixman potential and its torque."""

    nv: int
    log_determinant_gradient: Callable[..., Any]

    def equipartition(
        self, q=None, temperature: float = 1.0, *, count: int | None = None, rng: Any = None, boltzmann: float = 1.0,
        precision: str = "double",
    ) -> np.ndarray:  # fmt: skip
        """Draw velocities from exp(-KE/kT), rotor inertia included: θ̇ = √(kT) [I - HψK]* D^(-*/2) n, n unit normal. O(N) per draw.

        D^½ is a factor with D^½ D^(*/2) = D.

        Each of the innovations D^½[I + HφK]*θ̇ has the energy ½kT; covariances are kT (ℳ + J)⁻¹.

        Parameters
        ----------
        q : (nq,), or (B, nq) for a draw at each of them
        temperature : in units of energy over `boltzmann`
        count : number of draws at one state, (count, nv); None: one, (nv,)
        rng : numpy Generator or a seed; default: a fresh one
        boltzmann : k, J/K; 1 if temperatures are energies

        Raises
        ------
        SingularHingeError
            A hinge that feels no inertia.
        EvaluationError
            A temperature that is negative or not finite.
        ModelError
            q of the wrong size or not finite; an invalid seed.

        Source: innovations factorization of ℳ⁻¹ [Jain 2011]; A. Jain, I.-H. Park, N. Vaidehi, Equipartition principle for internal
        coordinate molecular dynamics, J. Chem. Theory Comput. 8 (2012).

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(3)
        >>> v = arm.equipartition([0.1, 0.2, 0.3], 2.0, count=4000, rng=1)
        >>> round(float(arm.kinetic_energy([0.1, 0.2, 0.3], v).mean()), 1)  # three times ½ kT
        3.0
        """
        model: Any = self
        size = np.sqrt(thermal_energy(temperature, boltzmann, _core.EvaluationError))
        draws = np.random.default_rng() if rng is None else seed_of(rng)
        q = at_state(model, q)[0]
        q = np.asarray(_core.real_array(getattr(q, "q", q), "q"), float)
        H, K, psi, D, I = model.soa("H K psi D I")
        factor = (I - H @ psi @ K).T @ D.sqrt().inv().T
        if q.ndim == 2:
            if count is not None:
                raise _core.EvaluationError("count needs one state; a batch of states has one draw at each")
            n = draws.standard_normal((len(q), self.nv))
            return size * np.asarray(factor.at(q, precision=precision) @ n).reshape(len(q), self.nv)
        many = 1 if count is None else clipped(count, "count")
        if not 0 <= many <= LARGEST:
            raise _core.EvaluationError(f"count={count!r}: the number of draws, up to {LARGEST}")
        n = draws.standard_normal((self.nv, many))
        found = size * np.asarray(factor.at(q, precision=precision) @ n).reshape(self.nv, many).T
        return found[0] if count is None else found

    def fixman_potential(self, q=None, temperature: float = 1.0, *, boltzmann: float = 1.0, precision: str = "double") -> Any:
        """Return ½ kT ln det(ℳ + J), J, up to a constant: a number or (B,). O(N).

        A system with constraints for bonds has configurations with the density √det ℳ exp(-U/kT) in its coordinates, one with stiff springs
        exp(-U/kT). With this potential added to U the constrained system has the second density.

        Source: M. Fixman, Classical statistical mechanics of constraints, Proc. Nat. Acad. Sci. USA 71 (1974).
        """
        model: Any = self
        soa, kT = model.soa, thermal_energy(temperature, boltzmann, _core.EvaluationError)
        q = at_state(model, q)[0]
        value = 0.5 * kT * np.asarray(soa.D.logdet().at(getattr(q, "q", q), precision=precision), float)  # the determinant of ℳ + J
        return float(value) if value.ndim == 0 else value

    def fixman_torque(self, q=None, temperature: float = 1.0, *, boltzmann: float = 1.0, precision: str = "double") -> np.ndarray:
        """Return -∂/∂θ of `fixman_potential`, (nv,) or (B, nv), N m and N: -½ kT ∂ln det(ℳ + J). O(N)."""
        return -0.5 * thermal_energy(temperature, boltzmann, _core.EvaluationError) * self.log_determinant_gradient(q, precision=precision)
