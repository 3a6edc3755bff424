"""The hinges of a mechanism in sparse matrices: poses of its bodies, rows of H, q̇ of θ̇, at symbols of its coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import islice
from typing import Any

import sympy

from .. import _core
from ..proofs.rational import Rationals
from .parameters import Parameters
from .sparse import Matrix
from .sparse_spatial import Pose, composed, force_transform, rotation_of, skew, still

KINDS = _core.subhinge_kinds
"""Sizes of the kinds of subhinges by name."""


class Hinges:
    """The hinges of a tree of rigid bodies at symbols q.

    Attributes
    ----------
    field : the field of the entries: rational functions of sines and cosines, the other coordinates, velocities and parameters
    poses : of each body in its parent
    rows : rows of H, for each body those of each subhinge, in the body's frame
    steps : for each body the pose of the frame after each subhinge in the frame before it
    """

    def __init__(self, parameters: Parameters, q: Sequence[sympy.Symbol], v: Sequence[sympy.Symbol], unit: bool):
        self._parameters, self._q, self._unit = parameters, list(q), unit
        self.field = Rationals([*self._atoms(), *v, *parameters.expressions()], self._quaternions() if unit else ())
        self.poses: list[Pose] = []
        self.rows: list[list[Matrix]] = []
        self.steps: list[list[Pose]] = []
        self._kinematics()

    def _matrix(self, entries: Sequence[Sequence[Any]], columns: int | None = None) -> Matrix:
        return Matrix.of(self.field, entries, columns)

    def _subhinges(self) -> list[tuple[dict[str, Any], list[sympy.Symbol]]]:
        """Return every subhinge with its coordinates."""
        at, found = 0, []
        for body in self._parameters.bodies:
            for s in body["subhinges"]:
                found.append((s, self._q[at : at + KINDS[s["kind"]].nq]))
                at += KINDS[s["kind"]].nq
        return found

    def _quaternions(self) -> list[list[sympy.Symbol]]:
        starts = ((KINDS[s["kind"]].quaternion, q) for s, q in self._subhinges())
        return [q[at : at + 4] for at, q in starts if at is not None]

    def _atoms(self) -> list[sympy.Expr]:
        """Return the generators of the entries: sines and cosines of angles, the other coordinates."""
        atoms: list[sympy.Expr] = []
        for s, q in self._subhinges():
            if KINDS[s["kind"]].angle:
                atoms += [sympy.sin(q[0]), sympy.cos(q[0])]
            if s["kind"] != "pin":
                atoms += q
        return atoms

    def rates(self) -> Matrix:
        """Return Γ, (nq, nv): q̇ = Γ(q)θ̇. Ball: ½ q⊗(0, ω); free: the same, and R(q) on the linear velocity."""
        blocks = []
        half = sympy.Rational(1, 2)
        for s, q in self._subhinges():
            if s["kind"] in ("ball", "free"):
                w, x, y, z = (half * e for e in q[:4])
                turn = self._matrix([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
                blocks.append(turn)
                if s["kind"] == "free":
                    blocks.append(rotation_of(self.field, q[:4], self._unit))
            else:
                blocks.append(self._matrix([[1]]))
        return Matrix.diagonal(self.field, blocks)

    def _axis_and_point(self, s: dict[str, Any]) -> tuple[Matrix, Matrix]:
        return self._matrix([[x] for x in s["axis"]], 1), self._matrix([[x] for x in s["point"]], 1)

    def _step(self, s: dict[str, Any], q: Sequence[sympy.Symbol]) -> Pose:
        """Return the pose of the frame after a subhinge in the frame before it. A rotation about a: cos q I + sin q ã + (1 − cos q) aa*."""
        kind, one = s["kind"], Matrix.identity(self.field, 3)
        a, c = self._axis_and_point(s)
        if kind == "slider":
            return one, a.scaled(self.field.element(q[0]))
        if kind == "free":
            return rotation_of(self.field, q[:4], self._unit), self._matrix([[x] for x in q[4:]], 1)
        if kind == "ball":
            R = rotation_of(self.field, q, self._unit)
            return R, c - R @ c
        sine, cosine = self.field.element(sympy.sin(q[0])), self.field.element(sympy.cos(q[0]))
        R = one.scaled(cosine) + skew(a).scaled(sine) + (a @ a.T).scaled(self.field.one - cosine)
        travel = self.field.element(s["pitch"] * q[0]) if kind == "screw" else self.field.zero
        return R, c - R @ c + a.scaled(travel)

    def _rows(self, s: dict[str, Any]) -> Matrix:
        """Return the rows of H of one subhinge, in the frame after it: pin (a; c×a), slider (0; a), screw (a; c×a + pitch a), ball (e_i;
        c×e_i)."""
        a, c = self._axis_and_point(s)
        if s["kind"] == "free":
            return Matrix.identity(self.field, 6)
        axes = Matrix.identity(self.field, 3) if s["kind"] == "ball" else a
        turning = Matrix.zeros(self.field, 3, axes.columns) if s["kind"] == "slider" else axes
        moving = a if s["kind"] == "slider" else skew(c) @ axes
        if s["kind"] == "screw":
            moving = moving + a.scaled(self.field.element(s["pitch"]))
        made = Matrix.zeros(self.field, 6, axes.columns)
        made.place(slice(0, 3), slice(0, axes.columns), turning)
        made.place(slice(3, 6), slice(0, axes.columns), moving)
        return made.T

    def _kinematics(self) -> None:
        """Compute body by body: the poses of its subhinges' frames, its pose in its parent, and the rows of H in its frame."""
        placed = iter(self._subhinges())
        for body in self._parameters.bodies:
            steps = [self._step(s, q) for s, q in islice(placed, len(body["subhinges"]))]
            place = self._matrix(body["rotation"]), self._matrix([[x] for x in body["position"]], 1)
            later = [reduce(composed, steps[j + 1 :], still(self.field)) for j in range(len(steps))]
            self.rows.append([self._rows(s) @ force_transform(x) for s, x in zip(body["subhinges"], later, strict=True)])
            self.poses.append(reduce(composed, steps, place))
            self.steps.append(steps)
