"""A model with its loops, created on first use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..state import State
from .assembly import assembled, branches
from .handles import Body, Node, Vector
from .loop_set import Loop, Loops, Relation
from .mobility import Mobility, mobility
from .mobility_along import MobilityAlong, mobility_along
from .with_frames import WithFrames


class WithLoops(WithFrames):
    """The core's model with its operators, its frames and its loops."""

    _kept_loops: Loops | None = None

    @property
    def loops(self) -> Loops:
        """All loops by name, and their rows: residuals, Jacobian, Q̇θ̇ (docs/loops.md)."""
        if self._kept_loops is None:
            self._kept_loops = Loops(self)
        return self._kept_loops

    def add_loop(
        self,
        b: str | Body | Node | None,
        a: str | Body | Node | None = None,
        hinge: str = "pin",
        *,
        axis: Vector | None = None,
        axes: Sequence[Vector] | None = None,
        point: Vector | None = None,
        pitch: float = 0.0,
        subhinges: Sequence[Mapping[str, Any]] | None = None,
        position: Vector | None = None,
        rotation: np.ndarray | None = None,
        placement: np.ndarray | None = None,
        name: str | None = None,
    ) -> Loop:
        """Close a chain: `a` carries `b` on a hinge, as in `add_body` a parent carries a body. The tree and its operators do not change.

        Parameters
        ----------
        b, a : names of bodies or nodes, Body, Node, or None for the base
            Two different bodies. A hinge's axes, point and placement are given as for a body b on its parent a.
        hinge : {"weld", "pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free", "custom"}
            The permitted motion. A universal hinge's axes are not parallel. Custom hinges, and gimbals with a middle axis not perpendicular
            to the others, which do not reach every rotation, have six rows, of which as many as their freedoms depend on the others.
        axis, axes, point, pitch, subhinges, position, rotation, placement
            As for `add_body`: the pose of b in a is placement · (the hinge's motion).
        name : str
            Default: "a to b".

        Returns
        -------
        Loop
            With its rows: for a pin five, named "name: about x", ..., "name: along z" in axes with z along the hinge's.

        Raises
        ------
        ModelError
            Ends on one body (a loop of a body with itself), names that are unknown or duplicate, a custom hinge with redundant subhinges,
            and the errors of `add_body` for a hinge. The model is unchanged.

        Examples
        --------
        >>> import pycraft as pc
        >>> bar = pc.chain(3)  # three rods of 1 m and the ground: a four-bar linkage
        >>> bar.add_loop("body2", hinge="pin", point=(1, 0, 0), position=(0, 0, 0), name="closure")
        <loop 'closure': pin, 5 rows>
        >>> bar.loops.jacobian([0, 0, 0]).shape
        (5, 3)
        """
        given = {"axis": axis, "axes": axes, "point": point, "pitch": pitch, "subhinges": subhinges}
        return self.loops.add_hinge(b, a, hinge, given | {"position": position, "rotation": rotation, "placement": placement}, name)

    def add_rolling(
        self,
        b: str | Body | Node | None,
        ground: str | Body | Node | None = None,
        kind: str = "wheel",
        *,
        radius: float | None = None,
        name: str | None = None,
    ) -> Loop:
        """Add a wheel or ball that rolls without slip on the plane z = 0 of a frame, or a blade that does not move sideways.

        Parameters
        ----------
        b : body or node
            "wheel": a disc about its z, centred at its origin. "ball": a sphere about its origin. "blade": z is the direction in which its
            origin does not move relative to `ground`.
        ground : body or node, or None for the base
        kind : {"wheel", "ball", "blade"}
        radius : metres, for wheels and balls

        Rows: for wheels and balls "contact", of positions, and two of velocities; for blades one of velocities. ModelError as in
        `add_loop`; EvaluationError from the rows of a wheel that lies flat.

        Examples
        --------
        >>> import pycraft as pc
        >>> mb = pc.Multibody("skate")
        >>> skate = mb.add_body("skate", hinge="planar", mass=1.0)
        >>> blade = mb.add_node("blade", "skate", rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # its z is the skate's -y
        >>> mb.add_rolling("blade", kind="blade", name="edge").jacobian([0, 0, 0]).tolist()
        [[0.0, -1.0, 0.0]]
        """
        kinds = {"wheel": "wheel", "ball": "rolling ball", "blade": "blade"}
        if not isinstance(kind, str) or kind not in kinds:
            raise _core.ModelError(f"kind={kind!r} of a rolling body: there are {', '.join(map(repr, kinds))}")
        if (radius is None) != (kind == "blade"):
            raise _core.ModelError(f"a {kind} {'has no radius' if kind == 'blade' else 'rolls on its radius: give radius= in metres'}")
        return self.loops.add_pair(b, ground, kinds[kind], 0.0 if radius is None else radius, name)

    def add_surface(
        self,
        point: str | Body | Node | None,
        on: str | Body | Node | None = None,
        *,
        A: np.ndarray | None = None,
        b: Vector | None = None,
        c: float = 0.0,
        name: str | None = None,
    ) -> Loop:
        """Keep a point on a surface of second degree, p·A p + b·p + c = 0. One row, "across".

        Parameters
        ----------
        point : body or node, whose origin is the point
        on : body or node, or None for the base: p is the point in its frame (m)
        A : (3, 3), symmetric or not; b : (3,); default: zeros
        c : float

        The residual is this polynomial: if its gradient has unit length along the surface, it is the distance in metres. ModelError as in
        `add_loop`, and if A and b are zero.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> tip = arm.add_node("tip", "body1", position=(1, 0, 0))
        >>> arm.add_surface("tip", b=(0, 1, 0), c=-0.5, name="rail").residual([0, 0]).tolist()  # the line y = 0.5 in the plane of the arm
        [-0.5]
        """
        return self.loops.add_surface(point, on, A, b, c, name)

    def add_curve(
        self,
        point: str | Body | Node | None,
        on: str | Body | Node | None = None,
        *,
        curve: Any,
        parameters: Any = None,
        closed: bool = False,
        ends: str = "not-a-knot",
        name: str | None = None,
    ) -> Loop:
        """Keep a point on a curve: a bead on a wire, a pin in a bent slot. Two rows, "across 1" and "across 2".

        Parameters
        ----------
        point : body or node, whose origin is the point
        on : body or node, or None for the base: the curve is given in its frame (m)
        curve : (n, 3), a SciPy piecewise polynomial, or a function
            Points, with the cubic spline through them, with these `ends` or, if closed, periodic; a CubicSpline or PPoly of points (3,); a
            function of one number that returns a point (3,), which is fitted once, to its rounding, by polynomials. It must not have
            corners.
        parameters : (n,), ascending
            For points: default: lengths from one to the next. For a function, required: (first, last), the interval.
        closed : bool
            The curve ends where it begins; points then repeat the first one as the last. An open curve continues straight beyond its ends.
        ends : {"not-a-knot", "natural"}; for an open curve through points
            "not-a-knot": one cubic through the first two intervals, and one through the last two, as in `pycraft.Spline` and SciPy: for
            points of a smooth curve at distance h the error is O(h⁴) everywhere. "natural": without second derivatives at the ends, so
            that curvature does not jump where the curve continues straight; with an error of O(h²) near them.

        Rows: with c the nearest place of the curve and n₁, n₂ normals there, n_i·(p - c): |r| is the distance (m). n₂ is the normal of a
        plane curve's plane, and for others it turns about the curve as little as possible. Where a curve crosses itself a point continues
        along the nearest branch. ModelError as in `add_loop`, and by name and parameter for curves that jump, stand still or have corners,
        and functions that are not smooth. Cost: a distance per piece, and a search on pieces that may be nearest.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> mb = pc.Multibody("wire")
        >>> bead = mb.add_body("bead", hinge="free", mass=1.0, inertia=np.eye(3))
        >>> mb.add_curve("bead", curve=lambda s: (np.cos(s), np.sin(s), s / 5), parameters=(0, 20), name="helix").rows
        ['helix: across 1', 'helix: across 2']
        >>> float(mb.loops["helix"].residual([1, 0, 0, 0, 1.5, 0.0, 0.0]).round(3) @ [1, 0])  # half a metre off, away from the axis
        -0.5
        """
        return self.loops.add_curve(point, on, curve, parameters, closed, name, ends)

    def add_coupling(
        self,
        coordinates: Mapping[Any, Any] | Sequence[Any],
        *,
        constant: float = 0.0,
        function: Relation | None = None,
        name: str | None = None,
    ) -> Loop:
        """Add a relation between coordinates: constant + Σ polynomial(q_i) = 0, or any smooth one. One row.

        Parameters
        ----------
        coordinates : {coordinate: coefficients}, or a list of coordinates beside a function
            Coordinates by name, number, or hinge of one. Coefficients: a number, for q; or a list for 1, q, q², ....
        constant : float
        function : function of the coordinates (n,)
            Returns (r, gradient (n,), second derivatives (n, n)), and optionally third ones (n, n, n), which second derivatives of rows and
            linear models in motion need; rows are then in double precision. It is called at every state. `pycraft.Spline` is one through
            points.
        name : str
            Default: "coupling".

        A gear, a mimic: {"a": 1, "b": -ratio}; a rack on a pinion of radius ρ: {"rack": 1, "pinion": -ρ}; a differential:
        {"left": 1, "right": 1, "cage": -2}; a cable over pulleys: {"a": ρ_a, "b": ρ_b}.

        Raises
        ------
        ModelError
            Coordinates that are unknown, named twice, or not single values in q (of ball and free hinges); coefficients that are all zero;
            a function that cannot be called, or does not return the three, second derivatives symmetric to differences of 1e-4.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> arm = pc.chain(2)
        >>> follow = lambda q: (q[1] - np.sin(q[0]), [-np.cos(q[0]), 1], [[np.sin(q[0]), 0], [0, 0]])
        >>> cam = arm.add_coupling(["hinge0", "hinge1"], function=follow)
        >>> cam.residual([0.0, 0.5]).tolist(), cam.bias([np.pi / 2, 1.0], [2.0, 0.0]).tolist()
        ([0.5], [4.0])
        """
        return self.loops.add_coupling(coordinates, constant, function, name)

    # ------------------------------------------------------------------ states on the loops
    def assemble(
        self,
        q0: Any = None,
        v0: Any = None,
        *,
        fix: Any = (),
        starts: int = 20,
        seed: int | np.random.Generator = 0,
        tolerance: float = 1e-10,
    ) -> State:
        """Return a state on all loops, near q0 if possible, and velocities that keep them. The model's own state is not set.

        Parameters
        ----------
        q0, v0 : (nq,), (nv,), or a State; default: the model's present state
            The first start; further starts are at growing distances. In a batch (B, nq), (B, nv) each state is treated separately.
        fix : names or numbers of coordinates, or hinges, or a list of them
            They keep their values in q0 and v0, to the last bit. For a ball or free hinge all coordinates, or none.
        starts : int
            Number of starts, q0 the first.
        seed : int or numpy.random.Generator
        tolerance : float
            The largest residual that counts as closed, relative to the size of each row (`loops.sizes`); the result is then refined to
            rounding.

        Returns
        -------
        State
            From each start by damped least squares on the model's group, with exact Jacobians; v is the nearest to v0 with Q v = 0,
            including rows of velocities. For a batch (B, nq) and (B, nv).

        Raises
        ------
        ModelError
            No state was found: names the loops that cannot be closed alone, or not together, and the rows with their residuals. Fixed
            velocities that violate rows, by name. In a batch, the state.

        Cost: some ten evaluations of the rows and dense least squares, O(rows² nv) each, per start.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> bars = pc.chain(3)
        >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
        >>> state = bars.assemble([1.0, -1.4, -1.5], [1.0, 0, 0], fix="hinge0")
        >>> state.q.round(6).tolist(), state.v.round(6).tolist()  # a rhombus
        ([1.0, -1.0, -2.141593], [1.0, -1.0, 1.0])
        """
        return assembled(self, q0, v0, fix, starts, seed, tolerance)

    def assembly_branches(
        self,
        q0: Any = None,
        v0: Any = None,
        *,
        fix: Any = (),
        starts: int = 60,
        seed: int | np.random.Generator = 0,
        tolerance: float = 1e-10,
    ) -> list[State]:
        """Return the different states on all loops found from many starts, the nearest to q0 first; all of them, or fewer.

        Arguments as in `assemble`; angles of pins in no coupling are equal up to whole turns. ModelError as there, and if the loops leave
        degrees of freedom: fix as many coordinates.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> arm = pc.chain(2)
        >>> target = arm.add_loop("body1", hinge="ball", point=(1, 0, 0), position=(0.5, 0, 0))
        >>> [state.q.round(6).tolist() for state in arm.assembly_branches([0.5, -1.0])]  # the elbow on either side
        [[0.722734, -1.445468], [-0.722734, 1.445468]]
        """
        return branches(self, q0, v0, fix, starts, seed, tolerance)

    def mobility(self, q: Any = None, *, tolerance: float = 1e-8) -> Mobility:
        """Return the freedoms left by the loops at a state on them: degrees of freedom, redundant rows by name, distance to a singular
        state.

        Parameters
        ----------
        q : (nq,), or a State; default: the model's present state
        tolerance : float
            Singular values of Q, relative to the length of its longest row, count as zero below it.

        Raises ModelError for a q that is not on the loops, with the worst row. Cost: a pivoted factorization and singular values of Q,
        O(rows² nv), and singular values at four neighbouring states.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> bars = pc.chain(3)
        >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
        >>> square = bars.mobility([np.pi / 2, -np.pi / 2, -np.pi / 2])
        >>> square.degrees_of_freedom, square.redundant
        (1, ['closure: about x', 'closure: about y', 'closure: along z'])
        >>> bars.mobility([0, 0, np.pi]).singular  # flat: it may fold one way or the other
        True
        """
        return mobility(self, q, tolerance)

    def mobility_along(self, q: Any, *, tolerance: float = 1e-6) -> MobilityAlong:
        """Return rank and degrees of freedom at the samples of a motion, and the singular states on it, including those between samples.

        Parameters
        ----------
        q : (B, nq), or a State or Trajectory of that many states
            States on the loops, in order of the motion, such as those of `assemble`. Between two of them the path is the straight one on
            the group, by the shorter turn, projected onto the loops.
        tolerance : float
            Singular values of Q, relative to the length of its longest row, count as zero below it. At a singular state of the loops q is
            only as accurate as the root of its residuals' rounding, 1e-8, and so are values that should be zero there.

        Returns
        -------
        MobilityAlong
            Rank, degrees of freedom, singular values and distance at each sample; `singular_states`, each with its place, its state and the
            lost rows. A singular state is found where the distance has a minimum between neighbouring samples: two within one sample's
            width may be merged into one.

        Raises
        ------
        ModelError
            A sample that is not on the loops, with its number and the worst row; no state on them was found between two samples.

        Cost: singular values of Q at every sample, O(rows² nv); some sixty states on the loops for each minimum of the distance.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> bars = pc.chain(3)
        >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
        >>> crank = np.linspace(-0.5, 0.7, 10)  # a rhombus, flat at 0
        >>> motion = bars.mobility_along(np.column_stack([crank, -crank, crank - np.pi]))
        >>> motion.degrees_of_freedom.tolist()
        [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]
        >>> [(round(one.at, 6), (one.q.round(6) + 0.0).tolist()) for one in motion.singular_states]
        [(3.75, [0.0, 0.0, -3.141593])]
        """
        return mobility_along(self, q, tolerance)
