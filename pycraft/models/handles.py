"""Handles of a model's bodies, hinges and nodes: values that can be read and set, and parameters to differentiate along."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..arguments import limit_pair, pose_parts, read_only, text, whole
from ..closed import Closed
from .with_operators import WithOperators

Vector = Sequence[float] | np.ndarray

_TWIST = ("rx", "ry", "rz", "x", "y", "z")


def _component(i: int | str, names: Sequence[str] = ("x", "y", "z")) -> int:
    """Return the number of a component given by its name or number."""
    if isinstance(i, str) and i in names:
        return list(names).index(i)
    if isinstance(i, (int, np.integer)) and -len(names) <= i < len(names):
        return int(i) % len(names)
    raise _core.ModelError(f"no component is called {i!r}; there are {', '.join(names)}, or 0 to {len(names) - 1}")


def _source(model: WithOperators) -> _core.MultibodyOperators:
    """Return the model's operators in the core, which own the parameters."""
    source = model.soa._source
    assert isinstance(source, _core.MultibodyOperators)
    return source


class Body(Closed):
    """A body of a model: `.mass` (kg), `.com` (3,) in the body frame (m), `.inertia` (3, 3) about the centre of mass (kg m²).

    The values can be set; each is checked (see `Multibody.add_body`). Arrays are copied on the way in, and read-only. `.hinge` is the
    hinge that carries the body.
    """

    def __init__(self, model: WithOperators, name: str):
        self._model, self._name = model, name

    @property
    def name(self) -> str:
        """The body's name in its model."""
        return self._name

    def _data(self) -> dict[str, Any]:
        return self._model._body(self._model._body_index(self.name))

    def _set(self, **changed: Any) -> None:
        data = self._data() | changed
        self._model._set_mass_properties(self._model._body_index(self.name), data["mass"], data["com"], data["inertia"])

    @property
    def mass(self) -> float:
        return self._data()["mass"]

    @mass.setter
    def mass(self, value: float) -> None:
        self._set(mass=value)

    @property
    def com(self) -> np.ndarray:
        return read_only(self._data()["com"])

    @com.setter
    def com(self, value: Vector) -> None:
        self._set(com=value)

    @property
    def inertia(self) -> np.ndarray:
        return read_only(self._data()["inertia"])

    @inertia.setter
    def inertia(self, value: np.ndarray) -> None:
        self._set(inertia=value)

    @property
    def hinge(self) -> Hinge:
        return Hinge(self._model, self._data()["hinge"]["name"])

    def symbol(self, name: str, i: int | str = 0, j: int | str | None = None) -> _core.Parameter:
        """Return a mass property as an argument of `diff`: "mass"; "com" with a component i; "inertia" with an entry (i, j) and its mirror.

        Components are numbers 0, 1, 2 or "x", "y", "z", in the body's axes; the inertia is about the centre of mass.
        """
        body, name = self._model._body_index(self.name), text(name, "a parameter")
        if name == "mass":
            which, label = 0, "mass"
        elif name == "com":
            which, label = 1 + _component(i), f"com.{'xyz'[_component(i)]}"
        elif name == "inertia":
            row, column = sorted((_component(i), _component(i if j is None else j)))
            which, label = 4 + row * (5 - row) // 2 + column, f"inertia.{'xyz'[row]}{'xyz'[column]}"
        else:
            raise _core.ModelError(f"body {self.name!r} has no parameter {name!r}; there are mass, com, inertia, and those of its hinge")
        return _core._inertia_parameter(_source(self._model), body, which, f"{self.name}.{label}")

    @property
    def parent(self) -> Body | None:
        """The body inboard, None for the base."""
        k = self._data()["parent"]
        return None if k < 0 else Body(self._model, self._model._body(k)["name"])

    def __repr__(self) -> str:
        parent = self.parent
        return f"<body {self.name!r}: {self.mass:g} kg on hinge {self.hinge.name!r} of {parent.name if parent else 'the base'!r}>"


class Hinge(Closed):
    """A hinge: `.kind`, `.subhinges` (kind, axis, point, pitch of each), `.placement` (4, 4), `.q_slice`, `.v_slice`, `.rotor_inertia`.

    `.placement` is the pose of the hinge's inboard frame in the parent body's frame; `.limits` are (lower, upper) per coordinate, or None.
    Arrays are copied on the way in, and read-only.
    """

    def __init__(self, model: WithOperators, name: str):
        self._model, self._name = model, name

    @property
    def name(self) -> str:
        """The hinge's name in its model."""
        return self._name

    def _index(self) -> int:
        return self._model._hinge_index(self.name)

    def _data(self) -> dict[str, Any]:
        return self._model._body(self._index())["hinge"]

    @property
    def kind(self) -> str:
        return self._data()["kind"]

    @property
    def subhinges(self) -> list[dict[str, Any]]:
        parts = self._data()["subhinges"]
        return [{key: read_only(value) if isinstance(value, np.ndarray) else value for key, value in part.items()} for part in parts]

    @property
    def placement(self) -> np.ndarray:
        pose = np.eye(4)
        placement = self._data()["placement"]
        pose[:3, :3], pose[:3, 3] = placement["rotation"], placement["position"]
        return read_only(pose)

    @placement.setter
    def placement(self, pose: np.ndarray) -> None:
        rotation, position = pose_parts(f"hinge {self.name!r}", None, None, pose)
        self._model._set_placement(self._index(), rotation, position)

    @property
    def rotor_inertia(self) -> np.ndarray:
        """Inertia of a rotor along each coordinate, reflected through its gear (kg m² or kg): the block J(k)."""
        return read_only(self._data()["rotor_inertia"])

    @rotor_inertia.setter
    def rotor_inertia(self, value: float | Vector) -> None:
        self._model._set_rotor_inertia(self._index(), value)

    def symbol(self, name: str, component: int | str = 0, subhinge: int = 0) -> _core.Parameter:
        """Return a parameter of the hinge as an argument of `diff`.

        "placement": the hinge's inboard frame moved by a unit twist on its own side, components "rx", "ry", "rz", "x", "y", "z" (or 0
        to 5), radians or metres; "axis": a subhinge's axis turned about component x, y or z of the axes before it, its point held;
        "point": that axis shifted along x, y or z; "rotor_inertia": of coordinate number `component` of the hinge.
        """
        k, source, name = self._index(), _source(self._model), text(name, "a parameter")
        if name == "rotor_inertia":
            own = range(self._model.nv)[self.v_slice]
            c = _component(component, [str(j) for j in range(len(own))])
            return _core._rotor_parameter(source, own[c], f"{self.name}.rotor_inertia[{c}]")
        if name == "placement":
            c = _component(component, _TWIST)
            return _core._twist_parameter(source, [(k, 0, np.eye(6)[c])], f"{self.name}.placement.{_TWIST[c]}")
        if name not in ("axis", "point"):
            raise _core.ModelError(f"hinge {self.name!r} has no parameter {name!r}; there are placement, axis, point, rotor_inertia")
        subhinges, c = self.subhinges, _component(component)
        subhinge = whole(subhinge, f"a subhinge of hinge {self.name!r}")
        if not 0 <= subhinge < len(subhinges):
            raise _core.ModelError(f"hinge {self.name!r} has {len(subhinges)} subhinges, none with number {subhinge}")
        turn = np.eye(3)[c]
        twist = np.r_[turn, np.cross(subhinges[subhinge]["point"], turn)] if name == "axis" else np.r_[np.zeros(3), turn]
        label = f"{self.name}.{name}[{subhinge}].{'xyz'[c]}"
        return _core._twist_parameter(source, [(k, subhinge, twist), (k, subhinge + 1, -twist)], label)

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray] | None:
        data = self._data()
        return (read_only(data["lower"]), read_only(data["upper"])) if len(data["lower"]) else None

    @limits.setter
    def limits(self, limits: tuple[float | Vector, float | Vector] | None) -> None:
        lower, upper = limit_pair(f"hinge {self.name!r}", limits)
        self._model._set_limits(self._index(), () if lower is None else lower, () if upper is None else upper)

    @property
    def q_slice(self) -> slice:
        return self._model._slices(self._index())[0]

    @property
    def v_slice(self) -> slice:
        return self._model._slices(self._index())[1]

    @property
    def body(self) -> Body:
        return Body(self._model, self._model._body(self._index())["name"])

    def __repr__(self) -> str:
        return (
            f"<hinge {self.name!r}: {self.kind}, q[{self.q_slice.start}:{self.q_slice.stop}], v[{self.v_slice.start}:{self.v_slice.stop}]>"
        )


class Node(Closed):
    """A frame on a body, or on the base: `.body` (None for the base), `.pose` (4, 4) in the body's frame."""

    def __init__(self, model: WithOperators, name: str):
        self._model, self._name = model, name

    @property
    def name(self) -> str:
        """The node's name in its model."""
        return self._name

    def _data(self) -> dict[str, Any]:
        return self._model._node(self.name)

    @property
    def body(self) -> Body | None:
        k = self._data()["body"]
        return None if k < 0 else Body(self._model, self._model._body(k)["name"])

    @property
    def pose(self) -> np.ndarray:
        data, pose = self._data(), np.eye(4)
        pose[:3, :3], pose[:3, 3] = data["rotation"], data["position"]
        return read_only(pose)

    def __repr__(self) -> str:
        return f"<node {self.name!r} on {self.body.name if self.body else 'the base'!r}>"


class Named(Mapping):
    """Handles by name, in the model's order. Keys complete after `[` in IPython and notebooks."""

    def __init__(self, names: Callable[[], Sequence[str]], make: Callable[[str], Any], find: Callable[[str], Any]):
        self._names, self._make, self._find = names, make, find

    def __getitem__(self, name: object) -> Any:
        if not isinstance(name, str):
            raise KeyError(f"the key is a name, not {name!r}")
        try:
            self._find(text(name, "what is asked for"))  # its error lists the known names
        except _core.ModelError as error:
            raise KeyError(str(error)) from None
        return self._make(name)

    def __contains__(self, name: object) -> bool:
        try:
            self.__getitem__(name)
        except KeyError:
            return False
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(self._names())

    def __len__(self) -> int:
        return len(self._names())

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._names())

    def __repr__(self) -> str:
        return "{" + ", ".join(self._names()) + "}"
