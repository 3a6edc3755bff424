"""The model in Python: a multibody system built body by body, and its state."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..arguments import pose_parts, text
from ..closed import Closed
from ..dynamics.integration import IntegrationCalls
from ..other_names import Renamed
from ..state import State, at_state, random_state
from .beside import Beside
from .coalescing import Coalescing
from .handles import Body, Hinge, Named, Node, Vector
from .hinge_arguments import frame_name, hinge_arguments
from .offers import Offer
from .parts import Parts
from .pictures import Pictures
from .planning import Planning
from .shapes import Shape
from .structure import Structure
from .with_loops import WithLoops


class Multibody(Closed, Renamed, IntegrationCalls, Pictures, Parts, Planning, Structure, Coalescing, WithLoops, Beside):
    """A tree of bodies on hinges, with nodes, a state (`q`, `v`) and gravity (zero until it is set).

    Build one body by body, or load it (`pycraft.load`). Bodies are kept depth first, children in the order they were added, and
    generalized coordinates follow the bodies. SI units and radians; spatial quantities angular first, in body axes.

    Parameters
    ----------
    name : str
    welds : {"lump", "keep"}
        "lump": a body on a weld becomes part of the body that moves it and a node with its name; "keep": it stays a body with no
        coordinates (zero rows in H). Both give the same mass matrix.
    strict : bool
        Raise an error instead of a warning for an inertia that violates the triangle inequality.

    Examples
    --------
    >>> import pycraft as pc
    >>> mb = pc.Multibody("double pendulum")
    >>> upper = mb.add_body("upper", mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0, 1 / 12, 1 / 12]))
    >>> lower = mb.add_body("lower", parent="upper", position=(1, 0, 0), mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0, 1 / 12, 1 / 12]))
    >>> mb.nv, mb.coordinate_names
    (2, ['upper', 'lower'])
    """

    _of = "Multibody"

    def __init__(self, name: str = "multibody", *, welds: str = "lump", strict: bool = False):
        if not isinstance(welds, str) or welds not in ("lump", "keep"):
            raise _core.ModelError(f"welds={welds!r}: there are 'lump' and 'keep'")
        super().__init__(text(name, "a model"), welds == "keep", strict)
        self._begin_beside()
        self._added_nodes: set[str] = set()

    # ------------------------------------------------------------------ structure
    def add_body(
        self,
        name: str,
        parent: str | Body | Node | None = None,
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
        mass: float = 0.0,
        com: Vector | None = None,
        inertia: np.ndarray | None = None,
        rotor_inertia: float | Vector | None = None,
        limits: tuple[float | Vector, float | Vector] | None = None,
        hinge_name: str | None = None,
    ) -> Body:
        """Add a body on a hinge.

        Parameters
        ----------
        name : str
        parent : name of a body or node, a Body or Node, or None for the base
        hinge : {"weld", "pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free", "custom"}
        axis, axes : (3,) or a list of them
            Directions in the hinge's frame; z by default (x, y for a universal, x, y, z for a gimbal hinge). A planar hinge's axis is
            its normal.
        point : (3,)
            The point that the axes go through; the frame's origin by default.
        pitch : float
            For a screw, metres per radian.
        subhinges : list of dicts with "kind", "axis", "point", "pitch"
            Only for a custom hinge: any sequence of pin, slider, screw, ball, free.
        position, rotation, or placement : (3,), (3, 3), (4, 4)
            Pose of the hinge's inboard frame in the parent's frame. It must be a rotation; one accurate to six digits
            is rounded to the nearest.
        mass, com, inertia : kg, (3,) m in the body frame, (3, 3) kg m² about the centre of mass in the body's axes
        rotor_inertia : float or (n,)
            Reflected inertia of rotors along the hinge's coordinates: the hinge-diagonal term J.
        limits : (lower, upper)
            One of each per subhinge, -inf and inf for none. Used for random states; nothing enforces them.
        hinge_name : str
            Default: the body's name.

        Raises
        ------
        ModelError
            A duplicate or unknown name, an axis of zero length, an invalid pose, a negative or non-finite mass, an inertia that is not
            symmetric positive semidefinite, limits in the wrong order: the error names body or hinge and value, and the model is unchanged.
        """
        name = text(name, "a body")
        self._check_not_a_frame(name, "body")
        given = hinge_arguments(
            f"body {name!r}", hinge, axis=axis, axes=axes, point=point, pitch=pitch, subhinges=subhinges, position=position,
            rotation=rotation, placement=placement, rotor_inertia=rotor_inertia, limits=limits,
        )  # fmt: skip
        called = "" if hinge_name is None else text(hinge_name, "a hinge")
        self._add_body(name=name, parent=frame_name(parent), hinge_name=called, mass=mass, com=com, inertia=inertia, **given)
        return Body(self, name)

    def add_node(
        self,
        name: str,
        body: str | Body | Node | None = None,
        *,
        position: Vector | None = None,
        rotation: np.ndarray | None = None,
        placement: np.ndarray | None = None,
    ) -> Node:
        """Add a frame on a body, on a node, or on the base (None), at a pose given as for `add_body`. It invalidates no operator."""
        self._check_not_a_frame(name, "node")
        rotation, position = pose_parts(f"node {name!r}", rotation, position, placement)
        self._add_node(text(name, "a node"), frame_name(body), rotation, position)
        self._of_whole()._added_nodes.add(name)
        return Node(self, name)

    @property
    def bodies(self) -> Mapping[str, Body]:
        """The bodies by name, in the model's order."""
        return Named(lambda: self._names()[0], lambda name: Body(self, name), self._body_index)

    @property
    def hinges(self) -> Mapping[str, Hinge]:
        """The hinges by name, in the bodies' order."""
        return Named(lambda: self._names()[1], lambda name: Hinge(self, name), self._hinge_index)

    @property
    def nodes(self) -> Mapping[str, Node]:
        """The nodes by name: welded links, and frames that were added."""
        return Named(lambda: [node["name"] for node in self._nodes()], lambda name: Node(self, name), self._node)

    # ------------------------------------------------------------------ state
    def random_state(self, seed: int | np.random.Generator = 0) -> State:
        """Return a random state: angles within ±π and travels within ±1 m (or the limits if there are any), uniform rotations, v in ±1."""
        return random_state(self, seed)

    # ------------------------------------------------------------------ certified values
    def certify(self, q=None, v=None, tau=None, **options: Any) -> Any:
        """Return forward dynamics with its measured error, the effect of rounding q, v and tau, condition, floor of refinement, places
        where digits are lost, and the cost of the next rung: a `pycraft.accuracy.certificates.certificate.Certificate`.

        Parameters
        ----------
        q, v, tau : (nq,), (nv,), (nv,), by the rule of `forward_dynamics`
        form, refine, residual, precision : of the certified value, as in `forward_dynamics`
        seed : int
            For the signs of the perturbations of q, v and tau, 0 or above.
        seconds : float
            Spent on each timing, default 0.02.

        Raises the errors of `forward_dynamics`, and ModelError for a model without coordinates. Cost: a dozen evaluations in quad
        precision, O(N); the floor, up to 400 coordinates, O(N²).
        """
        return _core._face["certify_dynamics"](self, *at_state(self, q, v), tau, **options)

    # ------------------------------------------------------------------ generated code
    def compile(self, call: str, *, frame: str | None = None) -> Any:
        """Generate straight-line C++ for a direct call of this model, compile it with the system's compiler, and load it.

        Its constants (frames, inertias, gravity) are folded in at their present values: later edits have no effect. Libraries are cached in
        a folder of the user (`PYCRAFT_CACHE`), so that the same model is compiled once.

        Parameters
        ----------
        call : {"forward_dynamics", "inverse_dynamics", "bias_forces", "mass_matrix", "mass_matrix_inverse", "constrained_dynamics",
            "jacobian", "pose"}
        frame : str, optional
            For Jacobians and poses: a body or node by its name.

        Returns
        -------
        callable
            Its arguments are q, v, tau for forward dynamics and for the accelerations of constrained dynamics, on the present loops; q, v,
            vdot for inverse dynamics; q, v for bias forces; q for the others; each with out=, for one state or with a leading batch axis.
            It handles contiguous float64 arrays; others, and states with pivots that may be rounding or with results that are not finite,
            go through the ordinary call with its errors. Attributes: source, library, operations. Results agree with the call to its own
            rounding; on loops they are substituted into the rows and the equations of motion, as in the call, which takes over if the rank
            of the rows differs from the rank beside the model's own state.

        Raises
        ------
        EvaluationError
            No C++ compiler (the variable CXX names one), an unknown call, a model with too many operations.
        ModelError
            An unknown body or node; hinges that no kernel supports (a rotor on a ball or free hinge); loops that cannot be assembled beside
            the model's state, and loops of a screw or of a function.

        Cost: seconds for the compiler, once; then a third to a half of the ordinary call's time.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> arm = pc.chain(2)
        >>> accelerations = arm.compile("forward_dynamics")
        >>> accelerations(np.zeros(2), np.zeros(2), np.array([1.0, 0.0])).round(3).tolist()
        [1.714, -4.286]
        """
        return _core._face["compile_call"](self, call, frame)

    # ------------------------------------------------------------------ files
    def save(self, path: str | os.PathLike[str], *, state: bool = True) -> None:
        """Write the model to a file: TOML, which people can read and edit and `pycraft.load` reads back bit for bit, URDF or MJCF.

        Parameters
        ----------
        path : path of the file, ending in ".toml", ".urdf", or ".xml" or ".mjcf" for MJCF
            An existing file is replaced.
        state : bool
            Whether to write nonzero q and v to a TOML or MJCF file.

        Raises
        ------
        ModelError
            Another ending, a file that cannot be written; features that URDF or MJCF lack: hinges and bodies by name, and the remedy.

        Warns
        -----
        ModelWarning
            For anything that the format cannot hold: gravity and a state (URDF), some loops (MJCF), some shapes (ellipsoids in URDF, meshes
            that MuJoCo does not read in MJCF, meshes without a file of their own in URDF and TOML). No format holds loose frames, couplings
            by functions, and the data that unlock hinges and split bodies.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.robots.panda().save("panda.toml")  # doctest: +SKIP
        """
        from .writers import save

        save(self, path, state)

    # ------------------------------------------------------------------ copies
    def description(self) -> dict[str, Any]:
        """Return the whole model as plain data: bodies, hinges, nodes, gravity, state (see `pycraft.reference` for the schema), loose
        frames, loops, and the data that unlock hinges and split bodies."""
        return describe(self)

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> Multibody:
        """Return the model that `description()` describes. A body with no subhinges stays a body if welds are kept; parents are indices."""
        try:
            return cls._described(description)
        except (KeyError, IndexError, TypeError) as error:
            if isinstance(error, _core.Error):
                raise
            what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise _core.ModelError(f"not a model's description: {what}; `description()` of a model shows what one has") from None

    @classmethod
    def _described(cls, data: Mapping[str, Any]) -> Multibody:
        if not isinstance(data, Mapping):
            raise _core.ModelError(f"a description is a dictionary, as description() gives it, not {data!r:.80}")
        keeps = data.get("welds") == "keep" or any(not body["hinge"]["subhinges"] for body in data["bodies"])
        model = cls(data.get("name", "multibody"), welds="keep" if keeps else "lump", strict=bool(data.get("strict", False)))
        names = [body["name"] for body in data["bodies"]]

        def frame(number: int) -> str:
            if not -1 <= number < len(names):
                raise _core.ModelError(f"a description of {len(names)} bodies refers to number {number}; -1 is the base")
            return names[number] if number >= 0 else ""

        for body in data["bodies"]:
            hinge = body["hinge"]
            model._add_body(
                text(body["name"], "a body"), frame(body["parent"]), hinge.get("kind", "custom"), text(hinge["name"], "a hinge"),
                [], None, 0.0,
                [dict(s) for s in hinge["subhinges"]], hinge["placement"]["rotation"], hinge["placement"]["position"],
                body["mass"], body["com"], body["inertia"], hinge.get("rotor_inertia"), hinge.get("lower"), hinge.get("upper"),
            )  # fmt: skip
        for node in data.get("nodes", []):
            model._add_node(text(node["name"], "a node"), frame(node["body"]), node["rotation"], node["position"])
        for loose in data.get("frames", []):
            model.frames._add_again(loose)
        for loop in data.get("loops", []):
            model.loops._declare(loop)
        model._hinges_before, model._bodies_before = dict(data.get("locked", {})), dict(data.get("coalesced", {}))
        model.gravity = data.get("gravity", (0, 0, 0))
        if "q" in data:
            model.q, model.v = data["q"], data["v"]
        return model

    def __reduce__(self):
        return _again, self._told()

    def __copy__(self) -> Multibody:
        return _again(*self._told())

    def __deepcopy__(self, memo) -> Multibody:
        memo[id(self)] = copy = _again(*self._told())
        return copy

    def _told(self) -> tuple[Any, ...]:
        frames = self._kept_frames
        moment = None if frames is None else (frames.t, np.array(frames.vdot))
        beside = self._left_aside, self._actuators, self._added_nodes, moment, self._shapes, self._offers, self._not_read
        return self.description(), *beside

    def __repr__(self) -> str:
        if self._whole is None:
            return f"<multibody {self.name!r}: {self._size} bodies, {self.nv} degrees of freedom>"
        try:
            return f"<part {self.name!r} of {self._whole.name!r}: {self._size} bodies, {self.nv} degrees of freedom>"
        except _core.StaleOperatorError:
            return f"<part {self.name!r} of {self._whole.name!r}, which has changed since>"


def _again(
    description: Mapping[str, Any],
    left_aside: Mapping[str, np.ndarray],
    actuators: Sequence[dict[str, Any]] = (),
    added_nodes: Collection[str] = (),
    moment: tuple[float, np.ndarray] | None = None,
    shapes: Sequence[Shape] = (),
    offers: Sequence[Offer] = (),
    not_read: Sequence[str] = (),
) -> Multibody:
    """Return a copy of a model from its description, with the data of its file, its added nodes, and its frames' t and vdot."""
    model = Multibody.from_description(description)
    model._left_aside, model._actuators = dict(left_aside), [dict(actuator) for actuator in actuators]
    model._added_nodes, model._shapes = set(added_nodes), list(shapes)
    model._offers, model._not_read = list(offers), list(not_read)
    if moment is not None:
        model.frames.t, model.frames.vdot = moment
    return model


def describe(model: _core.Multibody) -> dict[str, Any]:
    """Return the core's model as plain data."""
    frames = getattr(model, "_kept_frames", None)
    loose = frames._description() if frames is not None else []
    loops = getattr(model, "_kept_loops", None)
    declared = loops._description() if loops is not None else []
    return (
        {
            "name": model.name,
            "gravity": model.gravity,
            "bodies": [model._body(k) for k in range(model._size)],
            "nodes": model._nodes(),
            "welds": "keep" if model.keeps_welds else "lump",
            "strict": model.strict,
            "q": np.array(model.q),
            "v": np.array(model.v),
        }
        | {name: those for name, those in (("frames", loose), ("loops", declared)) if those}
        | getattr(model, "_described_edits", dict)()
    )
