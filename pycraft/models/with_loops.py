"""A model with its loops, made when they are first asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from .handles import Body, Node, Vector
from .loop_set import Loop, Loops, Relation
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
        """Close a chain: `b` is carried by `a` on a hinge, as by `add_body` a body is by its parent. The tree and its operators stay.

        Parameters
        ----------
        b, a : names of bodies or nodes, Body, Node, or None for the base
            Of two bodies. Which is which: a hinge's axes, point and placement are given as for a body b on its parent a.
        hinge : {"weld", "pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free"}
            The motion that is permitted. A universal hinge's axes are not parallel, the middle one of a gimbal's is across the others.
        axis, axes, point, pitch, position, rotation, placement
            As for `add_body`: the pose of b in a is placement · (the hinge's motion).
        name : str
            By default "a to b".

        Returns
        -------
        Loop
            With the rows: of a pin five, named "name: about x", ..., "name: along z" in axes with z along the hinge's.

        Raises
        ------
        ModelError
            Ends on one body (a loop of a body with itself), names that are unknown or taken, a hinge that has no rows (custom: the remedy
            is a body without mass on it, in the tree), and what `add_body` raises of a hinge. The model stays as it was.

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
        """A wheel or ball that rolls without slip on the plane z = 0 of a frame, or a blade that does not move sideways.

        Parameters
        ----------
        b : body or node
            "wheel": a disc about its z, of its origin. "ball": a sphere about its origin. "blade": its z is the direction in which its
            origin does not move against `ground`.
        ground : body or node, or None for the base
        kind : {"wheel", "ball", "blade"}
        radius : metres, of wheels and balls

        Rows: of wheels and balls "contact", of positions, and two of velocities; of blades one of velocities. ModelError as for
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
            raise _core.ModelError(f"kind={kind!r} of what rolls: there are {', '.join(map(repr, kinds))}")
        if (radius is None) != (kind == "blade"):
            raise _core.ModelError(f"a {kind} {'has no radius' if kind == 'blade' else 'rolls on its radius: give radius= in metres'}")
        return self.loops.add_pair(b, ground, kinds[kind], 0.0 if radius is None else radius, None, name)

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
        """A point stays on a surface of second degree, p·A p + b·p + c = 0; on two of them it stays on a curve. One row, "across".

        Parameters
        ----------
        point : body or node, whose origin it is
        on : body or node, or None for the base: p is the point in its frame (m)
        A : (3, 3), symmetric or not; b : (3,); zeros by default
        c : float

        The residual is that polynomial: where its gradient is one along the surface, metres beside it. ModelError as for `add_loop`, and
        where A and b are zero.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> tip = arm.add_node("tip", "body1", position=(1, 0, 0))
        >>> arm.add_surface("tip", b=(0, 1, 0), c=-0.5, name="rail").residual([0, 0]).tolist()  # the line y = 0.5 in the plane of the arm
        [-0.5]
        """
        matrix = np.zeros((3, 3)) if A is None else A
        return self.loops.add_pair(point, on, "surface", 0.0, (matrix, (0.0, 0.0, 0.0) if b is None else b, c), name)

    def add_coupling(
        self,
        coordinates: Mapping[Any, Any] | Sequence[Any],
        *,
        constant: float = 0.0,
        function: Relation | None = None,
        name: str | None = None,
    ) -> Loop:
        """A relation between coordinates: constant + Σ polynomial(q_i) = 0, or any smooth one. One row.

        Parameters
        ----------
        coordinates : {coordinate: coefficients}, or a list of coordinates beside a function
            Coordinates by name, number, or hinge of one. Coefficients: a number, of q; or those of 1, q, q², ....
        constant : float
        function : function of the coordinates (n,)
            Returns (r, gradient (n,), second derivatives (n, n)); rows are then there in double precision. It is called at every state.
        name : str
            By default "coupling".

        A gear, a mimic: {"a": 1, "b": -ratio}; a rack on a pinion of radius ρ: {"rack": 1, "pinion": -ρ}; a differential:
        {"left": 1, "right": 1, "cage": -2}; a cable over pulleys: {"a": ρ_a, "b": ρ_b}.

        Raises
        ------
        ModelError
            Coordinates that are unknown, named twice, or no single number in q (of ball and free hinges); coefficients that are all zero; a
            function that cannot be called, or does not return the three.

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
