"""What planning asks of a model: a neutral configuration, limits, configurations at which frames are where they are wanted."""

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
        """The configuration with all coordinates zero and quaternions (1, 0, 0, 0): (nq,), or (batch, nq).

        Every hinge's outboard frame is then its inboard one. Limits are not looked at (`clamped` moves a configuration inside), as of the
        configuration of that name in Pinocchio.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(1, "ball").neutral().tolist()
        [1.0, 0.0, 0.0, 0.0]
        """
        if batch is None:
            return self.zero_q()
        if not 0 <= whole(batch, "batch") <= LARGEST:
            raise _core.ModelError(f"batch: a number of states, from 0 to {LARGEST}, not {batch}")
        return np.tile(self.zero_q(), (batch, 1))

    def distance_to_limits(self, q=None) -> LimitDistances:
        """How far every coordinate is from its limits, rad or m: negative outside, inf where there is none. O(N).

        q : (nq,) or (B, nq), or a State; the present configuration where left out. Balls and free hinges have no limits.

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
        """The nearest configuration within limits, (nq,) or (B, nq): every coordinate outside is at its limit, exactly.

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
        """A configuration at which frames are where targets want them: inverse kinematics, within limits.

        Damped Gauss-Newton steps on the group with exact Jacobians, limits as bounds of every step. From q0 first; where that ends in a
        local minimum, from random configurations within limits, each descent to its end. What is reached is reached to the tolerance;
        what is not is the best of all descents, carried on until it is stationary, and `why` says what stands in the way. Loops of the
        model are to be closed as targets are to be reached, to the same tolerance (their rows of positions, each of weight 1).

        Parameters
        ----------
        targets : dictionary from frames to targets, or a list of such pairs (a frame may come twice)
            Frames are bodies, nodes and loose frames, by name or handle. A target is an array, a pose (4, 4), an orientation (3, 3) or a
            position (3,) in the world, or a dictionary:

            pose, position, orientation   each with an optional leading batch axis
            axis, along                   instead: an axis (3,) of the frame, and the direction that it is to have in `wrt`
            wrt                           the frame in which all this is given, which may move; the base where left out
            directions                    of "rx", "ry", "rz", "x", "y", "z" those that matter; all where left out
            axes                          whose directions: "aligned" (of `wrt`), "target", or a third frame's
            weight                        of what is made small, 1/rad and 1/m: a number or a pair; 1 where left out
            tolerance                     of this target
        q0 : (nq,) or (B, nq), or a State
            Where the search begins, moved inside limits; the present configuration where left out.
        centre_of_mass : position (3,) or (B, 3), or a dictionary with position, wrt, directions, weight, tolerance
        posture : (nq,) or (B, nq)
            What to be near to, in the null space of the targets: among configurations that reach them, a nearest one (a local minimum of
            |`difference(q, posture)`|, free hinges left out, which have no posture).
        coordinates : names or numbers of hinges and coordinates that may move; all where left out
        limits : bool
            Whether limits hold.
        tolerance : rad and m, or a pair (rad, m)
        iterations : of one descent; as many again, and as many of Newton's, until what is not reached is stationary
        restarts : from how many random configurations, where that is needed
        seed : of these
        unreached : {"answer", "raise"}
            What to do where a target is not reached: a solution that says so, or an EvaluationError with the same words.

        Returns
        -------
        pycraft.kinematics.Solution : q (nq,), reached, why, errors by target, coordinates at limits by name; of a batch q (B, nq) and so on

        Raises
        ------
        ModelError
            Unknown frames (with the nearest name), matrices that are no rotations, numbers that are not finite, sizes that do not fit,
            part of a ball or free subhinge among the coordinates: names the target.

        Cost: O(N + nv² m) an iteration, m rows of targets; batches share the work of the interpreter.

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
