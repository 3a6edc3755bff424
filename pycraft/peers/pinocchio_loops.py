"""Pinocchio's forward dynamics with loops, as a call for timing: `constraintDynamics` with coincident points."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from .. import _core
from ..interop.export import to_pinocchio
from ..interop.packages import required

Point = tuple[str, Any]
"""A body's name and a point on it (3,), in its frame (m)."""


class PinocchioLoops:
    """A model in Pinocchio with pairs of points of two bodies held together. MissingPackageError if it is not installed.

    Parameters
    ----------
    model : a tree; its own loops are ignored
    together : pairs of points, each of a body's name and (3,) in its frame (m)
    accuracy : of its proximal iterations, which redundant rows need
    """

    def __init__(self, model: Any, together: Iterable[tuple[Point, Point]], accuracy: float = 1e-10):
        pin = self._pin = required("pinocchio", "peers", "comparison with Pinocchio needs")
        self._twin = to_pinocchio(model)
        joints = dict(zip(model.bodies, self._twin.bodies, strict=True))
        self._rows, self._data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
        for pair in together:
            ends: list[Any] = []
            for body, point in pair:
                joint, X = joints[body]
                ends += [joint, X * pin.SE3(np.eye(3), np.asarray(point, float))]
            ball = pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, self._twin.model, *ends, pin.ReferenceFrame.LOCAL)
            self._rows.append(ball)
            self._data.append(ball.createData())
        self._work = self._twin.model.createData()
        pin.initConstraintDynamics(self._twin.model, self._work, self._rows, self._data)
        self._settings = pin.ProximalSettings(accuracy, 1e-8, 10)

    @classmethod
    def of_balls(cls, model: Any, accuracy: float = 1e-10) -> PinocchioLoops:
        """Build it with the loops of a model, each a ball between two bodies. ModelError names any other loop."""
        together: list[tuple[Point, Point]] = []
        for loop in model.loops._description():
            if loop["kind"] != "ball" or not {loop["a"], loop["b"]} <= set(model.bodies):
                raise _core.ModelError(f"loop {loop['name']!r} is no ball between two bodies")
            given = {key: part for key, part in loop.items() if part is not None}
            point, turned = given.get("point", np.zeros(3)), given.get("rotation", np.eye(3))
            together.append(((loop["b"], point), (loop["a"], given.get("position", np.zeros(3)) + turned @ point)))
        return cls(model, together, accuracy)

    def call(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> Callable[[], np.ndarray]:
        """Return accelerations at a state, in Pinocchio's order: nothing is converted while a clock runs."""
        of = self._twin.of_v
        place, rate, force = self._twin.q(q), np.ascontiguousarray(v[of]), np.ascontiguousarray(tau[of])
        given = self._twin.model, self._work, place, rate, force, self._rows, self._data, self._settings
        return lambda: self._pin.constraintDynamics(*given)

    def ours(self, vdot: np.ndarray) -> np.ndarray:
        """Return accelerations in our order."""
        return vdot[np.argsort(self._twin.of_v)]
