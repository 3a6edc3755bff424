"""The model in Python: a multibody system built body by body, its handles, its state and the direct calls on arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from .state import State, random_state

Vector = Sequence[float] | np.ndarray

_Z = (0.0, 0.0, 1.0)
_DEFAULT_AXES: dict[str, tuple[tuple[float, float, float], ...]] = {
    "pin": (_Z,),
    "slider": (_Z,),
    "screw": (_Z,),
    "universal": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "gimbal": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "cylindrical": (_Z,),
    "planar": (_Z,),
}


_TWIST = ("rx", "ry", "rz", "x", "y", "z")


def _component(i: int | str) -> int:
    return "xyz".index(i) if isinstance(i, str) else range(3)[i]


class Body:
    """A body of a model: `.mass` (kg), `.com` (3,) in the body frame (m), `.inertia` (3, 3) about the centre of mass (kg m²).

    The values can be set; each is checked (see `Multibody.add_body`). `.hinge` is the hinge that carries the body.
    """

    def __init__(self, model: Multibody, name: str):
        self._model, self.name = model, name

    def _data(self) -> dict[str, Any]:
        return self._model._body(self._model._body_index(self.name))

    def _set(self, **changed: Any) -> None:
        data = self._data() | changed
        self._model._set_mass_properties(self._model._body_index(self.name), float(data["mass"]), data["com"], data["inertia"])

    @property
    def mass(self) -> float:
        return self._data()["mass"]

    @mass.setter
    def mass(self, value: float) -> None:
        self._set(mass=value)

    @property
    def com(self) -> np.ndarray:
        return self._data()["com"]

    @com.setter
    def com(self, value: Vector) -> None:
        self._set(com=value)

    @property
    def inertia(self) -> np.ndarray:
        return self._data()["inertia"]

    @inertia.setter
    def inertia(self, value: np.ndarray) -> None:
        self._set(inertia=value)

    @property
    def hinge(self) -> Hinge:
        return Hinge(self._model, self._data()["hinge"]["name"])

    def symbol(self, name: str, i: int | str = 0, j: int | str | None = None) -> _core.Parameter:
        """A mass property as what `diff` takes: "mass"; "com" with a component i; "inertia" with an entry (i, j), the symmetric one along.

        Components are numbers 0, 1, 2 or "x", "y", "z", in the body's axes; the inertia is about the centre of mass.
        """
        body = self._model._body_index(self.name)
        if name == "mass":
            which, text = 0, "mass"
        elif name == "com":
            which, text = 1 + _component(i), f"com.{'xyz'[_component(i)]}"
        elif name == "inertia":
            row, column = sorted((_component(i), _component(i if j is None else j)))
            which, text = 4 + row * (5 - row) // 2 + column, f"inertia.{'xyz'[row]}{'xyz'[column]}"
        else:
            raise _core.ModelError(f"body {self.name!r} has no parameter {name!r}; there are mass, com, inertia, and those of its hinge")
        return _core._inertia_parameter(self._model.soa._source, body, which, f"{self.name}.{text}")

    @property
    def parent(self) -> Body | None:
        """The body inboard, None for the base."""
        k = self._data()["parent"]
        return None if k < 0 else Body(self._model, self._model._names()[0][k])

    def __repr__(self) -> str:
        parent = self.parent
        return f"<body {self.name!r}: {self.mass:g} kg on hinge {self.hinge.name!r} of {parent.name if parent else 'the base'!r}>"


class Hinge:
    """A hinge: `.kind`, `.subhinges` (kind, axis, point, pitch of each), `.placement` (4, 4), `.q_slice`, `.v_slice`, `.rotor_inertia`.

    `.placement` is the pose of the hinge's inboard frame in the parent body's frame; `.limits` are (lower, upper) per coordinate, or None.
    """

    def __init__(self, model: Multibody, name: str):
        self._model, self.name = model, name

    def _index(self) -> int:
        return self._model._hinge_index(self.name)

    def _data(self) -> dict[str, Any]:
        return self._model._body(self._index())["hinge"]

    @property
    def kind(self) -> str:
        return self._data()["kind"]

    @property
    def subhinges(self) -> list[dict[str, Any]]:
        return self._data()["subhinges"]

    @property
    def placement(self) -> np.ndarray:
        pose = np.eye(4)
        placement = self._data()["placement"]
        pose[:3, :3], pose[:3, 3] = placement["rotation"], placement["position"]
        return pose

    @placement.setter
    def placement(self, pose: np.ndarray) -> None:
        pose = np.asarray(pose, float)
        self._model._set_placement(self._index(), pose[:3, :3], pose[:3, 3])

    @property
    def rotor_inertia(self) -> np.ndarray:
        """Inertia that a rotor adds along each coordinate, reflected through its gear (kg m² or kg): the block J(k)."""
        return self._data()["rotor_inertia"]

    @rotor_inertia.setter
    def rotor_inertia(self, value: float | Vector) -> None:
        values = np.broadcast_to(np.asarray(value, float), self.rotor_inertia.shape)
        self._model._set_rotor_inertia(self._index(), [float(x) for x in values])

    def symbol(self, name: str, component: int | str = 0, subhinge: int = 0) -> _core.Parameter:
        """A parameter of the hinge as what `diff` takes.

        "placement": the hinge's inboard frame moved by a unit twist on its own side, components "rx", "ry", "rz", "x", "y", "z" (or 0 to 5),
        radians or metres; "axis": a subhinge's axis turned about component x, y or z of the axes before it, its point held; "point": that
        axis shifted along x, y or z; "rotor_inertia": of coordinate number `component` of the hinge.
        """
        k, source = self._index(), self._model.soa._source
        if name == "rotor_inertia":
            coordinate = range(self._model.nv)[self.v_slice][int(component)]
            return _core._rotor_parameter(source, coordinate, f"{self.name}.rotor_inertia[{int(component)}]")
        if name == "placement":
            c = _TWIST.index(component) if isinstance(component, str) else int(component)
            return _core._twist_parameter(source, [(k, 0, np.eye(6)[c])], f"{self.name}.placement.{_TWIST[c]}")
        if name not in ("axis", "point"):
            raise _core.ModelError(f"hinge {self.name!r} has no parameter {name!r}; there are placement, axis, point, rotor_inertia")
        subhinges, c = self.subhinges, _component(component)
        if not 0 <= subhinge < len(subhinges):
            raise _core.ModelError(f"hinge {self.name!r} has {len(subhinges)} subhinges, none with number {subhinge}")
        turn = np.eye(3)[c]
        twist = np.r_[turn, np.cross(subhinges[subhinge]["point"], turn)] if name == "axis" else np.r_[np.zeros(3), turn]
        return _core._twist_parameter(source, [(k, subhinge, twist), (k, subhinge + 1, -twist)], f"{self.name}.{name}[{subhinge}].{'xyz'[c]}")

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray] | None:
        data = self._data()
        return (data["lower"], data["upper"]) if len(data["lower"]) else None

    @property
    def q_slice(self) -> slice:
        return self._model._slices(self._index())[0]

    @property
    def v_slice(self) -> slice:
        return self._model._slices(self._index())[1]

    @property
    def body(self) -> Body:
        return Body(self._model, self._model._names()[0][self._index()])

    def __repr__(self) -> str:
        return (
            f"<hinge {self.name!r}: {self.kind}, q[{self.q_slice.start}:{self.q_slice.stop}], v[{self.v_slice.start}:{self.v_slice.stop}]>"
        )


class Node:
    """A frame on a body, or on the base: `.body` (None for the base), `.pose` (4, 4) in the body's frame."""

    def __init__(self, model: Multibody, name: str):
        self._model, self.name = model, name

    def _data(self) -> dict[str, Any]:
        return next(node for node in self._model._nodes() if node["name"] == self.name)

    @property
    def body(self) -> Body | None:
        k = self._data()["body"]
        return None if k < 0 else Body(self._model, self._model._names()[0][k])

    @property
    def pose(self) -> np.ndarray:
        data, pose = self._data(), np.eye(4)
        pose[:3, :3], pose[:3, 3] = data["rotation"], data["position"]
        return pose

    def __repr__(self) -> str:
        return f"<node {self.name!r} on {self.body.name if self.body else 'the base'!r}>"


class _Named(Mapping):
    """Handles by name, in the model's order."""

    def __init__(self, names: Sequence[str], make: Callable[[str], Any], find: Callable[[str], Any]):
        self._names, self._make, self._find = names, make, find

    def __getitem__(self, name: str) -> Any:
        if name not in self._names:
            try:
                self._find(name)  # raises with the names there are
            except _core.ModelError as error:
                raise KeyError(str(error)) from None
            raise KeyError(name)
        return self._make(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return "{" + ", ".join(self._names) + "}"


class Multibody(_core.Multibody):
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
        A violated triangle inequality of an inertia is an error instead of a warning.

    Examples
    --------
    >>> import pycraft as pc
    >>> mb = pc.Multibody("double pendulum")
    >>> upper = mb.add_body("upper", mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0, 1 / 12, 1 / 12]))
    >>> lower = mb.add_body("lower", parent="upper", position=(1, 0, 0), mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0, 1 / 12, 1 / 12]))
    >>> mb.nv, mb.coordinate_names
    (2, ['upper', 'lower'])
    """

    def __init__(self, name: str = "multibody", *, welds: str = "lump", strict: bool = False):
        if welds not in ("lump", "keep"):
            raise _core.ModelError(f"welds={welds!r}: there are 'lump' and 'keep'")
        super().__init__(name, welds == "keep", strict)
        self._soa = None
        self._direct: _core.Dynamics | None = None

    # ------------------------------------------------------------------ structure
    def add_body(
        self,
        name: str,
        parent: str | Body | None = None,
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
        limits: tuple[Vector, Vector] | None = None,
        hinge_name: str | None = None,
    ) -> Body:
        """Add a body on a hinge.

        Parameters
        ----------
        name : str
        parent : name of a body or node, a Body, or None for the base
        hinge : {"weld", "pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free", "custom"}
        axis, axes : (3,) or a list of them
            Directions in the hinge's frame; z by default (x, y for a universal, x, y, z for a gimbal hinge). A planar hinge's axis is
            its normal.
        point : (3,)
            The point that the axes go through; the frame's origin by default.
        pitch : float
            Of a screw, metres per radian.
        subhinges : list of dicts with "kind", "axis", "point", "pitch"
            Of a custom hinge: any sequence of pin, slider, screw, ball, free.
        position, rotation, or placement : (3,), (3, 3), (4, 4)
            Pose of the hinge's inboard frame in the parent's frame.
        mass, com, inertia : kg, (3,) m in the body frame, (3, 3) kg m² about the centre of mass in the body's axes
        rotor_inertia : float or (n,)
            Reflected inertia of rotors along the hinge's coordinates: the hinge-diagonal term J.
        limits : (lower, upper)
            Kept for drawing random states; nothing enforces them.
        hinge_name : str
            The body's name by default.

        Raises
        ------
        ModelError
            A name that is taken or unknown, an axis of zero length, a negative or non-finite mass, an inertia that is not symmetric
            positive semidefinite: names body or hinge and number, and leaves the model as it was.
        """
        if isinstance(parent, Body):
            parent = parent.name
        if placement is not None:
            placement = np.asarray(placement, float)
            if placement.shape != (4, 4):
                raise _core.ModelError(f"placement of body {name!r} takes a (4, 4) pose, not an array {placement.shape}")
            rotation, position = placement[:3, :3], placement[:3, 3]
        if axis is not None and axes is not None:
            raise _core.ModelError(f"body {name!r}: give axis or axes, not both")
        directions = [axis] if axis is not None else list(axes) if axes is not None else list(_DEFAULT_AXES.get(hinge, ()))
        count = None
        if rotor_inertia is not None:
            rotor = np.atleast_1d(np.asarray(rotor_inertia, float))
            if rotor.size == 1:
                count = {
                    "pin": 1,
                    "slider": 1,
                    "screw": 1,
                    "universal": 2,
                    "cylindrical": 2,
                    "gimbal": 3,
                    "planar": 3,
                    "ball": 3,
                    "free": 6,
                }.get(hinge)
                if hinge == "custom" and subhinges is not None:
                    count = sum({"ball": 3, "free": 6}.get(s["kind"], 1) for s in subhinges)
            rotor = np.full(count, rotor[0]) if count else rotor
        lower, upper = (np.atleast_1d(np.asarray(x, float)) for x in limits) if limits is not None else ((), ())
        self._add_body(
            name, parent or "", hinge, hinge_name or "", directions, point, float(pitch),
            list(subhinges) if subhinges is not None else None,
            rotation, position, float(mass), com, inertia, [float(x) for x in rotor] if rotor_inertia is not None else [],
            [float(x) for x in lower], [float(x) for x in upper],
        )  # fmt: skip
        return Body(self, name)

    def add_node(
        self, name: str, body: str | Body | None = None, *, position: Vector | None = None, rotation: np.ndarray | None = None
    ) -> Node:
        """Add a frame on a body, on a node, or on the base (None). It invalidates no operator."""
        self._add_node(name, body.name if isinstance(body, Body) else body or "", rotation, position)
        return Node(self, name)

    @property
    def bodies(self) -> Mapping[str, Body]:
        """The bodies by name, in the model's order."""
        return _Named(self._names()[0], lambda name: Body(self, name), self._body_index)

    @property
    def hinges(self) -> Mapping[str, Hinge]:
        """The hinges by name, in the bodies' order."""
        return _Named(self._names()[1], lambda name: Hinge(self, name), self._hinge_index)

    @property
    def nodes(self) -> Mapping[str, Node]:
        """The nodes by name: welded links, and frames that were added."""
        return _Named([node["name"] for node in self._nodes()], lambda name: Node(self, name), self._node_index)

    # ------------------------------------------------------------------ state
    def random_state(self, seed: int | np.random.Generator = 0) -> State:
        """A random state: angles within ±π and travels within ±1 m (or the limits where there are), uniform rotations, v in ±1."""
        return random_state(self, seed)

    # ------------------------------------------------------------------ operators
    @property
    def soa(self):
        """The spatial operators of this model: `soa.phi`, `soa.H`, ..., or several at once: `phi, H, M = soa("phi H M")`."""
        from ..operators import OperatorSet

        if self._soa is None or not self._soa.is_current():
            self.warn()
            self._soa = OperatorSet(_core.operators_of(self), self)
        return self._soa

    def warn(self) -> None:
        """Say, once, what is legal but worth a word: violated triangle inequalities, massless bodies on hinges."""
        from .warning import warn

        for text in self.take_warnings():
            warn(text)

    # ------------------------------------------------------------------ direct calls
    def _calls(self) -> _core.Dynamics:
        if self._direct is None:
            self._direct = _core.Dynamics(self)
        return self._direct

    def forward_dynamics(self, q, v, tau, *, form: str = "fast", refine: int = 0, precision: str = "double", out=None) -> np.ndarray:
        """Accelerations (nv,) or (B, nv) under generalized forces tau, gravity included: articulated-body algorithm, O(N).

        Each argument has one state or a leading batch axis. Raises SingularHingeError where D(k) is singular at the rounding bound.
        """
        return self._calls().forward_dynamics(q, v, tau, form, refine, precision, out)

    def inverse_dynamics(self, q, v, vdot, *, precision: str = "double", out=None) -> np.ndarray:
        """Generalized forces (nv,) or (B, nv) for the accelerations vdot, gravity and rotor inertia included: Newton-Euler, O(N)."""
        return self._calls().inverse_dynamics(q, v, vdot, precision, out)

    def bias_forces(self, q, v, *, precision: str = "double", out=None) -> np.ndarray:
        """Coriolis, gyroscopic and gravity forces 𝒞 (nv,) or (B, nv): inverse dynamics at zero acceleration. O(N)."""
        return self._calls().inverse_dynamics(q, v, None, precision, out)

    def mass_matrix(self, q, *, precision: str = "double", out=None) -> np.ndarray:
        """The mass matrix of the equations of motion, HφMφ*H* + J, full symmetric (nv, nv) or (B, nv, nv): composite bodies."""
        return self._calls().mass_matrix(q, False, precision, out)

    def mass_matrix_inverse(self, q, *, precision: str = "double", out=None) -> np.ndarray:
        """The inverse of mass_matrix, full symmetric, by the innovations factors: O(N) a column."""
        return self._calls().mass_matrix(q, True, precision, out)

    def jacobian(self, frame: str, q, *, precision: str = "double", out=None) -> np.ndarray:
        """Jacobian (6, nv) or (B, 6, nv) of a body's or node's spatial velocity: its own axes, about its origin, angular first."""
        return self._calls().jacobian(frame, q, precision, out)

    def pose(self, frame: str, q) -> np.ndarray:
        """Pose (4, 4) or (B, 4, 4) of a body or node in the world."""
        return self._calls().pose(frame, q)

    def kinetic_energy(self, q, v) -> np.ndarray:
        """½ v·(ℳ + J)v, in joules. O(N)."""
        return self._calls().energy(q, v)[..., 0]

    def potential_energy(self, q) -> np.ndarray:
        """Energy in the uniform gravity field, zero with the centre of mass at the world's origin, in joules. O(N)."""
        shape = np.shape(q)[:-1] + (self.nv,)
        return self._calls().energy(q, np.zeros(shape))[..., 1]

    # ------------------------------------------------------------------ copies
    def description(self) -> dict[str, Any]:
        """The whole model as plain data: bodies with hinges, nodes, gravity, state (see `pycraft.reference` for the schema)."""
        return describe(self)

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> Multibody:
        """The model that `description()` describes. A body with no subhinges stays a body if welds are kept; parents are indices."""
        data = dict(description)
        keeps = data.get("welds") == "keep" or any(not body["hinge"]["subhinges"] for body in data["bodies"])
        model = cls(data.get("name", "multibody"), welds="keep" if keeps else "lump", strict=bool(data.get("strict", False)))
        names = [body["name"] for body in data["bodies"]]
        for body in data["bodies"]:
            hinge = body["hinge"]
            model._add_body(
                body["name"], names[body["parent"]] if body["parent"] >= 0 else "", hinge.get("kind", "custom"), hinge["name"],
                [], None, 0.0,
                [dict(s) for s in hinge["subhinges"]], np.asarray(hinge["placement"]["rotation"], float),
                np.asarray(hinge["placement"]["position"], float), float(body["mass"]), body["com"], np.asarray(body["inertia"], float),
                [float(x) for x in hinge.get("rotor_inertia", [])], [float(x) for x in hinge.get("lower", [])],
                [float(x) for x in hinge.get("upper", [])],
            )  # fmt: skip
        for node in data.get("nodes", []):
            model._add_node(node["name"], names[node["body"]] if node["body"] >= 0 else "", node["rotation"], node["position"])
        model.gravity = data.get("gravity", (0, 0, 0))
        if "q" in data:
            model.q, model.v = data["q"], data["v"]
        return model

    def __reduce__(self):
        return Multibody.from_description, (self.description(),)

    def __copy__(self) -> Multibody:
        return Multibody.from_description(self.description())

    def __deepcopy__(self, memo) -> Multibody:
        memo[id(self)] = copy = Multibody.from_description(self.description())
        return copy

    def __repr__(self) -> str:
        return f"<multibody {self.name!r}: {self._size} bodies, {self.nv} degrees of freedom>"


def describe(model: _core.Multibody) -> dict[str, Any]:
    """The core's model as plain data."""
    return {
        "name": model.name,
        "gravity": model.gravity,
        "bodies": [model._body(k) for k in range(model._size)],
        "nodes": model._nodes(),
        "welds": "keep" if model.keeps_welds else "lump",
        "strict": model.strict,
        "q": np.array(model.q),
        "v": np.array(model.v),
    }
