"""Planning calls of a model: a neutral configuration, limits, inverse kinematics."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import LARGEST, whole
from .limits import LimitDistances, checked_q, coordinate_limits
from .with_operators import WithOperators


class Planning(WithOperators):
    """Neutral configuration, distances to limits, inverse kinematics."""

    def neutral(self, batch: int | None = None) -> np.ndarray:
        """Return the configuration with all coordinates zero and quaternions (1, 0, 0, 0): (nq,), or (batch, nq).

        Every hinge's outboard frame then coincides with its inboard one. Limits are ignored (`clamped` moves a configuration inside), as in
        the function of that name in Pinocchio.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(1, "ball").neutral().tolist()
        [1.0, 0.0, 0.0, 0.0]
        """
        if batch is None:
            return self.zero_q()
        if not 0 <= whole(batch, "batch") <= LARGEST:
            raise _core.ModelError(f"batch must be a number of states from 0 to {LARGEST}, not {batch}")
        return np.tile(self.zero_q(), (batch, 1))

    def distance_to_limits(self, q=None) -> LimitDistances:
        """Return the distance of every coordinate from its limits, rad or m: negative outside, inf without a limit. O(N).

        q : (nq,) or (B, nq), or a State; default: the present configuration. Balls and free hinges have no limits.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.hinges["hinge1"].limits = (-1.0, 2.0)
        >>> arm.distance_to_limits([0.0, 1.5])
        <distances to limits: hinge1 upper 0.5, hinge1 lower 2.5>
        """
        q, limits = checked_q(self, q), coordinate_limits(self)
        values = np.where(limits.q_index >= 0, q[..., limits.q_index] if self.nq else np.zeros((*q.shape[:-1], 0)), 0.0)
        return LimitDistances(tuple(self.coordinate_names), values - limits.lower, limits.upper - values)

    def clamped(self, q=None) -> np.ndarray:
        """Return the nearest configuration within limits, (nq,) or (B, nq): every coordinate outside is set exactly to its limit.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.hinges["hinge1"].limits = (-1.0, 2.0)
        >>> arm.clamped([3.0, 3.0]).tolist()
        [3.0, 2.0]
        """
        q, limits = np.array(checked_q(self, q)), coordinate_limits(self)
        some = limits.q_index >= 0
        at = limits.q_index[some]
        q[..., at] = np.clip(q[..., at], limits.lower[some], limits.upper[some])
        return q

    def solve_ik(
        self,
        targets: Any = None,
        q0=None,
        *,
        centre_of_mass: Any = None,
        posture: Any = None,
        coordinates: Any = None,
        limits: bool = True,
        tolerance: Any = 1e-9,
        iterations: int = 100,
        restarts: int = 20,
        seed: int = 0,
        unreached: str = "answer",
    ) -> Any:
        """Find a configuration that brings frames to targets: inverse kinematics, within limits.

        Damped Gauss-Newton steps on the group with exact Jacobians, limits as bounds of every step. The search starts at q0; if it ends in
        a local minimum, it continues from random configurations within limits, each descent to its end. Targets are reached to the
        tolerance; otherwise the result is the best of all descents, continued until it is stationary, and `why` gives the reason. Loops of
        the model are closed like targets, to the same tolerance (their rows of positions, each of weight 1).

        Parameters
        ----------
        targets : dictionary from frames to targets, or a list of such pairs (a frame may come twice)
            Frames are bodies, nodes and loose frames, by name or handle. A target is an array, a pose (4, 4), an orientation (3, 3) or a
            position (3,) in the world, or a dictionary:

            pose, position, orientation   each with an optional leading batch axis
            axis, along                   instead: an axis (3,) of the frame, and its target direction in `wrt`
            wrt                           the reference frame of all these, which may move; default: the base
            directions                    the directions that count, of "rx", "ry", "rz", "x", "y", "z"; default: all
            axes                          the axes of the directions: "aligned" (of `wrt`), "target", or a third frame's
            weight                        weight of the residual, 1/rad and 1/m: a number or a pair; default 1
            tolerance                     tolerance of this target
        q0 : (nq,) or (B, nq), or a State
            The start of the search, moved inside limits; default: the present configuration.
        centre_of_mass : position (3,) or (B, 3), or a dictionary with position, wrt, directions, weight, tolerance
        posture : (nq,) or (B, nq)
            A posture to stay near, in the null space of the targets: among configurations that reach them, a nearest one (a local minimum
            of |`difference(q, posture)`|, ignoring free hinges, which have no posture).
        coordinates : names or numbers of hinges and coordinates that may move; default: all
        limits : bool
            Whether to enforce limits.
        tolerance : rad and m, or a pair (rad, m)
        iterations : of one descent; as many again, and as many of Newton's, until an unreached target is stationary
        restarts : number of random configurations, used if needed
        seed : of these configurations
        unreached : {"answer", "raise"}
            For unreached targets: return a solution that reports them, or raise an EvaluationError with the same words.

        Returns
        -------
        pycraft.kinematics.Solution : q (nq,), reached, why, errors by target, coordinates at limits by name; for a batch q (B, nq) and so
            on

        Raises
        ------
        ModelError
            Unknown frames (with the nearest name), invalid rotations, values that are not finite, sizes that do not match, part of a ball
            or free subhinge among the coordinates: names the target.

        Cost: O(N + nv² m) per iteration, m rows of targets; batches share the overhead of the interpreter.

        Source: Levenberg-Marquardt with damping by the square of the residual [T. Sugihara, Solvability-unconcerned inverse kinematics by
        the Levenberg-Marquardt method, IEEE Trans. Robotics 27 (2011)]; bounds by an active set.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)                                  # two rods of 1 m
        >>> tip = arm.add_node("tip", "body1", position=(1, 0, 0))
        >>> found = arm.solve_ik({"tip": (1.0, 1.0, 0.0)}, q0=[0.1, 0.1])
        >>> found.reached, arm.pose("tip", found.q)[:2, 3].round(9).tolist()
        (True, [1.0, 1.0])
        >>> arm.solve_ik({"tip": (3.0, 0.0, 0.0)}, q0=[0.1, 0.1]).why
        'tip is 1 m off: no motion lessens it along tip.x, the best of 21 descents'
        """
        return _core._face["solve_ik"](
            self, targets, q0, centre_of_mass=centre_of_mass, posture=posture, coordinates=coordinates, limits=limits, tolerance=tolerance,
            iterations=iterations, restarts=restarts, seed=seed, unreached=unreached,
        )  # fmt: skip
