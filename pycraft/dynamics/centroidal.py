"""Direct calls about the centre of mass of a model, or of a part of one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from ..state import at_state
from .direct_calls import cached
from .sensitivities import SensitivityCalls
from .threads import over_threads


class CentroidalMomentum(NamedTuple):
    """Momentum about the centre of mass in world axes, angular first.

    value (6,): h = matrix @ v, its linear part the mass times the velocity of the centre of mass; matrix (6, nv); matrix_dot (6, nv): the
    rate of the matrix along v, so that ḣ = matrix @ v̇ + matrix_dot @ v; dq (6, nv): ∂h/∂q at v. Leading batch axes as in the arguments.
    """

    value: np.ndarray
    matrix: np.ndarray
    matrix_dot: np.ndarray
    dq: np.ndarray


class CentroidalCalls(SensitivityCalls):
    """Centre of mass, composite inertia and centroidal momentum: O(N), all bodies about the centre of mass from the start.

    Each raises ModelError if no body has mass. Rotors, which turn with their hinges, do not contribute.
    """

    mass: float

    def _centroidal(self) -> _core.Centroidal:
        return cached(self, "_about_mass_centre", _core.Centroidal)

    def _sums(self, q, v, precision: str) -> np.ndarray:
        q, v = at_state(self, q, v)
        return self._centroidal().sums(q, v, precision)

    @over_threads
    def centre_of_mass(self, q=None, *, precision: str = "double", threads: int = 1) -> np.ndarray:
        """Return the centre of mass of all bodies in the world, (3,) or (B, 3), in metres.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).centre_of_mass([0, 0]).tolist()
        [1.0, 0.0, 0.0]
        """
        return self._sums(q, None, precision)[..., :3]

    @over_threads
    def centre_of_mass_frame(self, q=None, *, precision: str = "double", threads: int = 1) -> np.ndarray:
        """Return the pose (4, 4) or (B, 4, 4) of the frame at the centre of mass with the world's axes, the frame of `composite_inertia`
        and `centroidal_momentum`."""
        centre = self._sums(q, None, precision)[..., :3]
        pose = np.zeros((*centre.shape[:-1], 4, 4))
        pose[..., range(4), range(4)] = 1
        pose[..., :3, 3] = centre
        return pose

    @over_threads
    def centre_of_mass_velocity(self, q=None, v=None, *, precision: str = "double", threads: int = 1) -> np.ndarray:
        """Return the velocity of the centre of mass in world axes, (3,) or (B, 3), in m/s.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).centre_of_mass_velocity([0, 0], [1, 0]).tolist()
        [0.0, 1.0, 0.0]
        """
        return self._sums(q, v, precision)[..., 3:6]

    @over_threads
    def centre_of_mass_jacobian(self, q=None, *, precision: str = "double", threads: int = 1) -> np.ndarray:
        """Return ∂ċ/∂v in world axes, (3, nv) or (B, 3, nv); along coordinates also ∂c/∂q.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).centre_of_mass_jacobian([0, 0]).tolist()
        [[0.0, 0.0], [1.0, 0.25], [0.0, 0.0]]
        """
        q, _ = at_state(self, q)
        return self._columns(q, np.zeros(self.nv), precision)[..., 0, 3:, :] / self.mass

    @over_threads
    def composite_inertia(self, q=None, *, precision: str = "double", threads: int = 1) -> np.ndarray:
        """Return the spatial inertia (6, 6) or (B, 6, 6) of all bodies as one rigid body, in the frame at the centre of mass: block
        diagonal, the rotational inertia and the mass.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).composite_inertia([0, 0]).diagonal().round(3).tolist()  # a rod of 2 kg and 2 m
        [0.0, 0.667, 0.667, 2.0, 2.0, 2.0]
        """
        sums = self._sums(q, None, precision)
        inertia = np.zeros((*sums.shape[:-1], 6, 6))
        inertia[..., :3, :3] = sums[..., 6:15].reshape(*sums.shape[:-1], 3, 3)
        inertia[..., range(3, 6), range(3, 6)] = self.mass
        return inertia

    @over_threads
    def centroidal_momentum(self, q=None, v=None, *, precision: str = "double", threads: int = 1) -> CentroidalMomentum:
        """Return the momentum about the centre of mass, its matrix, the rate of the matrix, and the derivative by q: see
        `CentroidalMomentum`.

        Examples
        --------
        >>> import pycraft as pc
        >>> h = pc.chain(2).centroidal_momentum([0, 0], [1, 0])
        >>> h.value.round(3).tolist()  # two rods as one about its middle, and 2 kg at 1 m/s
        [0.0, 0.0, 0.667, 0.0, 2.0, 0.0]
        """
        q, v = at_state(self, q, v)
        columns = self._columns(q, v, precision)
        return CentroidalMomentum(
            self._sums(q, v, precision)[..., 15:], columns[..., 0, :, :], columns[..., 1, :, :], columns[..., 2, :, :]
        )

    def _columns(self, q, v, precision: str) -> np.ndarray:
        return self._centroidal().columns(q, v, precision)
