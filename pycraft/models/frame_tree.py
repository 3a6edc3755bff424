"""Frames: any frame of a model relative to any other, expressed in any third, and loose frames that are added, moved and removed at run
time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from .. import _core
from ..arguments import name_of, pose_parts, switch, text
from ..closed import Closed
from ..operators.frame_operators import relative_jacobian
from ..state import at_state
from .coordinates import coordinate_numbers
from .handles import Body, Node, Vector

Motion = Callable[[float], Any]
"""A function of time: the pose (4, 4) of a frame on its carrier, or (pose, twist), or (pose, twist, acceleration)."""

AXES = ("body", "aligned", "world")
KINDS = ("spatial", "classical")


class Frame(Closed):
    """A frame of a model, by its name: `.kind`, `.on`, and its pose, velocity, acceleration and Jacobians relative to any other.

    Arguments common to all of these:

    wrt : the reference frame: a name, Frame, Body or Node, or None for the base
    axes : "body" | "aligned" | "world" | a frame
        The axes of the frame itself; of `wrt`; of `wrt`, for the point of the frame at the origin of `wrt`; of a third frame.
        Except for "world", the linear part belongs to the frame's origin. A frame with one of these names is given as `Frame`.
    q, v, vdot : as in direct calls, one state or a batch (B, ...), or a `State`
        Without any, the model's present state: `model.q`, `model.v`, `model.frames.vdot`. Beside an array q, omitted ones are zero.
    t : a number, or (B,)
        The time of frames that a function moves; default: `model.frames.t`.
    precision : "single" | "double" | "extended" | "quad"

    At the present state results are cached until they are no longer current (docs/frames.md); at given states nothing is cached. Cost: the
    hinges between the two frames. Raises ModelError for an unknown frame (with the nearest name), a frame of another model, or one that has
    lost its carrier; EvaluationError for unknown axes and kinds.

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.chain(2)
    >>> arm.q, arm.v = [0, 0], [1, 2]
    >>> arm.frame("body1").velocity(wrt="body0")[[2, 4]].tolist()
    [2.0, 0.0]
    """

    def __init__(self, frames: Frames, name: str):
        self._frames, self._name = frames, name

    @property
    def name(self) -> str:
        """The frame's name in its model; "base" for the base."""
        return self._name or "base"

    @property
    def _model(self) -> Any:
        return self._frames._model

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Frame) and self._model is other._model and self._name == other._name

    def __hash__(self) -> int:
        return hash((id(self._model), self._name))

    @property
    def kind(self) -> str:
        """ "base", "body", "node", "fixed" (loose, at a pose), or "moved" (loose, by a function of time)."""
        if self._frames._core.is_loose(self._name):
            return "moved" if self._name in self._frames._motions else "fixed"
        number = self._frames._core.number(self._name)
        return "base" if number < 0 else "body" if number < self._model._size else "node"

    @property
    def on(self) -> Frame | None:
        """The frame that carries it: for a body its parent, for the base None."""
        return None if self.kind == "base" else Frame(self._frames, self._frames._core.carrier(self._name))

    # ------------------------------------------------------------------ loose frames
    @property
    def placement(self) -> np.ndarray:
        """The pose (4, 4) of a loose frame on its carrier, at the present time if it is moved. Setting it makes the frame fixed."""
        if self.kind == "moved":
            return self.pose(wrt=self.on)
        return self._frames._core.placement(self._name)

    @placement.setter
    def placement(self, pose: np.ndarray) -> None:
        self._frames._core.place(self._name, *pose_parts(f"frame {self._name!r}", None, None, pose))
        self._frames._motions.pop(self._name, None)

    @property
    def motion(self) -> Motion | None:
        """The function of time that moves a loose frame, None for a fixed one. It can be set (see `add_frame`)."""
        return self._frames._motions.get(self._name)

    @motion.setter
    def motion(self, motion: Motion) -> None:
        self._frames._core.set_motion(self._name, _function(motion, self._name))
        self._frames._motions[self._name] = motion

    def attach(self, on: Any = None, *, keep_pose: bool = False) -> None:
        """Put a loose frame on another frame. Its placement, or its motion, is then relative to that frame.

        With keep_pose=True a fixed frame stays where it is at the present state, and its placement is computed. ModelError for a carrier
        that stands on this frame, and for keeping the pose of a frame that a function moves.
        """
        on = self._frames._named(on)
        if not switch(keep_pose, "keep_pose"):
            return self._frames._core.attach(self._name, on)
        if self.kind == "moved":
            raise _core.ModelError(
                f"frame {self._name!r} is moved by a function of time and keeps its motion; fix it first by its placement"
            )
        held = self.pose(wrt=on)
        self._frames._core.attach(self._name, on)
        self._frames._core.place(self._name, held[:3, :3], held[:3, 3])

    def remove(self) -> None:
        """Remove a loose frame. ModelError if others stand on it."""
        self._frames._core.remove(self._name)
        self._frames._motions.pop(self._name, None)

    # ------------------------------------------------------------------ motion
    def pose(self, q=None, *, wrt: Any = None, axes: Any = None, t: Any = None, precision: str = "double") -> np.ndarray:
        """Return X (4, 4) or (B, 4, 4): the frame's axes as columns and its origin (m), relative to `wrt`, in the axes of `wrt`.

        axes : another frame in whose axes both are expressed

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(3).frame("body2").pose([0, 0, 0], wrt="body0")[:3, 3].tolist()
        [2.0, 0.0, 0.0]
        """
        core, other = self._frames._core, self._frames._named(wrt)
        if axes is not None:
            X = self.pose(q, wrt=wrt, t=t, precision=precision).copy()
            X[..., :3, :] = Frame(self._frames, other).pose(q, wrt=axes, t=t, precision=precision)[..., :3, :3] @ X[..., :3, :]
            return X
        if self._present(q, None, None, t, precision):
            return core.pose(self._name, other)
        return core.pose_at(self._name, other, self._state(q)[0], self._time(t), precision)

    def velocity(self, q=None, v=None, *, wrt: Any = None, axes: Any = "body", t: Any = None, precision: str = "double") -> np.ndarray:
        """Return the twist V = (ω; v) relative to `wrt`, (6,) or (B, 6), rad/s and m/s: for X = pose(wrt), (X⁻¹Ẋ)^∨ in the frame's own
        axes."""
        core, other, (axes, third) = self._frames._core, self._frames._named(wrt), self._axes(axes)
        if self._present(q, v, None, t, precision):
            return core.motion(self._name, other, axes, third, None)
        q, v, _ = self._state(q, v)
        return core.velocity_at(self._name, other, axes, third, q, v, self._time(t), precision)

    def acceleration(
        self, q=None, v=None, vdot=None, *, wrt: Any = None, axes: Any = "body", kind: str = "spatial", t: Any = None,
        precision: str = "double",
    ) -> np.ndarray:  # fmt: skip
        """Return the acceleration relative to `wrt`, (6,) or (B, 6), rad/s² and m/s².

        kind : "spatial" or "classical"
            V̇, the rate of the six components of V in the frame's own axes; or (ω̇; p̈), with the acceleration of the point v̇ + ω × v.
            Both are then expressed in the requested axes. Neither depends on how `wrt` itself moves.
        """
        core, other, (axes, third) = self._frames._core, self._frames._named(wrt), self._axes(axes)
        if not isinstance(kind, str) or kind not in KINDS:
            raise _core.EvaluationError(f"kind={kind!r} of an acceleration: there are {', '.join(map(repr, KINDS))}")
        if self._present(q, v, vdot, t, precision):
            return core.motion(self._name, other, axes, third, kind)
        q, v, vdot = self._state(q, v, vdot)
        return core.acceleration_at(self._name, other, axes, third, kind, q, v, vdot, self._time(t), precision)

    def bias_acceleration(
        self, q=None, v=None, *, wrt: Any = None, axes: Any = "body", kind: str = "spatial", t: Any = None, precision: str = "double"
    ) -> np.ndarray:
        """Return the acceleration at v̇ = 0, (6,) or (B, 6): J̇v, plus terms of functions of time. In "aligned" axes J̇v is the classical
        one."""
        q, v, _ = self._state(q, v)
        return self.acceleration(q, v, np.zeros(self._model.nv), wrt=wrt, axes=axes, kind=kind, t=t, precision=precision)

    # ------------------------------------------------------------------ Jacobians
    def jacobian(
        self, q=None, *, wrt: Any = None, axes: Any = "body", coordinates: Any = None, t: Any = None, precision: str = "double"
    ) -> np.ndarray:
        """Return J (6, n) or (B, 6, n): velocity = J v, plus terms of functions of time. Coordinates that move both frames or neither give
        exact zeros.

        coordinates : names or numbers, or a list of them
            Hinges (all of their coordinates), or single coordinates, in the order of the columns; default: all of the model's.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(3).frame("body2").jacobian([0, 0, 0], wrt="body0", coordinates=["hinge1", "hinge2"])[[2, 4]].tolist()
        [[1.0, 1.0], [1.0, 0.0]]
        """
        return self._jacobian(self._state(q)[0], None, wrt, axes, coordinates, t, precision)

    def jacobian_dot(
        self, q=None, v=None, *, wrt: Any = None, axes: Any = "body", coordinates: Any = None, t: Any = None, precision: str = "double"
    ) -> np.ndarray:
        """Return J̇ (6, n) or (B, 6, n): the rate of the entries of `jacobian` along v, and t, in the same axes, which may turn."""
        q, v, _ = self._state(q, v)
        return self._jacobian(q, v, wrt, axes, coordinates, t, precision)

    def jacobian_operator(self, *, wrt: Any = None, axes: Any = "body", coordinates: Any = None) -> _core.Operator:
        """Return `jacobian` as an expression, Θ → R⁶ (or from the named coordinates): `.at(q)`, `.diff(i)`, `.dot()` for J̇, products.

        Built of the letters 𝒥 = B*φ*H* and X = φ(0,k) and of constants, so that every rule of the algebra holds for it; columns of
        coordinates that move both frames are zero to rounding. O(N). ModelError for frames that a function of time moves: operators do not
        depend on time.
        """
        axes, third = self._axes(axes)
        names = {"frame": self._name, "wrt": self._frames._named(wrt), "axes": third if axes == "other" else None}
        anchors = {role: None if name is None else self._frames._anchor(name) for role, name in names.items()}
        return relative_jacobian(self._model, anchors, axes, coordinate_numbers(self._model, coordinates))

    # ------------------------------------------------------------------ common parts
    def _jacobian(self, q, v, wrt, axes, coordinates, t, precision) -> np.ndarray:
        axes, third = self._axes(axes)
        chosen = coordinate_numbers(self._model, coordinates)
        return self._frames._core.jacobian(self._name, self._frames._named(wrt), axes, third, chosen, q, v, self._time(t), precision)

    def _present(self, q, v, vdot, t, precision) -> bool:
        return q is None and v is None and vdot is None and t is None and isinstance(precision, str) and precision == "double"

    def _state(self, q=None, v=None, vdot=None) -> tuple[Any, Any, Any]:
        if isinstance(q, (str, Frame, Body, Node)):
            seen_from = getattr(q, "name", q)
            raise _core.ModelError(f"the reference frame of {self.name!r} is given as wrt={seen_from!r}; first come states")
        if vdot is None:
            vdot = self._frames.vdot if q is None else np.zeros(self._model.nv)
        return *at_state(self._model, q, v), vdot

    def _time(self, t: Any) -> Any:
        return self._frames.t if t is None else t

    def _axes(self, axes: Any) -> tuple[str, str]:
        """Return the axes in the form that the core expects: which, and whose."""
        if isinstance(axes, str) and axes in AXES:
            return axes, ""
        if isinstance(axes, str):
            try:
                self._frames._core.number(axes)
            except _core.ModelError as error:
                known = ", ".join(map(repr, AXES))
                raise _core.EvaluationError(f"axes={axes!r}: there are {known}, and those of a frame; {error}") from None
        return "other", self._frames._named(axes)

    def __repr__(self) -> str:
        try:
            on = self.on
        except _core.ModelError:
            return f"<frame {self.name!r}: missing, or without its carrier>"
        return f"<frame {self.name!r}: {self.kind}{'' if on is None else f' on {on.name!r}'}>"


class Frames(Closed, Mapping):
    """The frames of a model by name: bodies, nodes, loose frames. `.t` and `.vdot` belong to the present state, `.computed` counts.

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.chain(2)
    >>> camera = arm.add_frame("camera", on="body1", position=(0.5, 0, 0))
    >>> list(arm.frames), arm.frames["camera"]
    (['body0', 'body1', 'camera'], <frame 'camera': fixed on 'body1'>)
    """

    def __init__(self, model: Any):
        self._model, self._core = model, _core.FrameTree(model)
        self._motions: dict[str, Motion] = {}

    def __reduce__(self):
        return attrgetter("frames"), (self._model,)  # a model brings its frames

    @property
    def t(self) -> float:
        """The present time (s) of frames that a function moves; initially zero."""
        return self._core.time

    @t.setter
    def t(self, time: float) -> None:
        self._core.time = time

    @property
    def vdot(self) -> np.ndarray:
        """The present accelerations (nv,), initially zero; carried over by hinge name when the structure changes."""
        return self._core.accelerations

    @vdot.setter
    def vdot(self, vdot: Vector) -> None:
        self._core.accelerations = vdot

    @property
    def computed(self) -> dict[str, int]:
        """Counts of computations at present states: "poses", "velocities", "accelerations" of single steps (a hinge, a moved frame), and
        "pairs", motions of one frame relative to another."""
        return dict(zip(("poses", "velocities", "accelerations", "pairs"), self._core.counts(), strict=True))

    def add(
        self,
        name: str,
        on: Any = None,
        *,
        position: Vector | None = None,
        rotation: np.ndarray | None = None,
        placement: np.ndarray | None = None,
        motion: Motion | None = None,
    ) -> Frame:
        """Add a loose frame: see `Multibody.add_frame`."""
        name, on = text(name, "a frame"), self._named(on)
        if motion is not None and not (position is rotation is placement is None):
            raise _core.ModelError(f"frame {name!r}: give a pose, or a motion that returns poses, not both")
        rotation, position = pose_parts(f"frame {name!r}", rotation, position, placement)
        self._core.add(name, on, rotation, position, None if motion is None else _function(motion, name))
        if motion is not None:
            self._motions[name] = motion
        return Frame(self, name)

    def remove(self, name: str | Frame) -> None:
        """Remove a loose frame. ModelError if others stand on it."""
        Frame(self, self._named(name)).remove()

    def __getitem__(self, name: Any) -> Frame:
        try:
            return self._model.frame(name)
        except _core.ModelError as error:
            raise KeyError(str(error)) from None

    def __iter__(self) -> Iterator[str]:
        return iter([*self._model._names()[0], *(node["name"] for node in self._model._nodes()), *self._core.loose_names()])

    def __len__(self) -> int:
        return self._model._size + len(self._model._nodes()) + len(self._core.loose_names())

    def __contains__(self, name: object) -> bool:
        try:
            self[name]
        except KeyError:
            return False
        return True

    def _ipython_key_completions_(self) -> Sequence[str]:
        return list(self)

    def __repr__(self) -> str:
        return f"<frames of {self._model.name!r}: {len(self)}, {len(self._core.loose_names())} of them loose>"

    # ------------------------------------------------------------------ for its frames
    def _named(self, frame: Any) -> str:
        """Return the name of a frame of this model, "" for the base. The core checks that it exists."""
        if isinstance(frame, (Frame, Body, Node)):
            if frame._model is not self._model:
                own, other = self._model.name, frame._model.name
                raise _core.ModelError(f"frame {frame.name!r} belongs to another model, {other!r}, and has no pose in {own!r}")
            return frame._name
        return name_of(frame, "a frame", "")

    def _anchor(self, name: str) -> tuple[str | None, np.ndarray]:
        """Return the body that carries a frame, None for the base, and its pose (4, 4) there."""
        X = np.eye(4)
        frame = Frame(self, name)
        while (kind := frame.kind) not in ("body", "base"):
            if kind == "moved":
                what = "is moved by a function of time, and operators do not depend on time; compute arrays instead"
                raise _core.ModelError(f"frame {frame.name!r} {what}")
            placed = frame.placement if kind == "fixed" else frame.pose(wrt=frame.on)
            X, frame = placed @ X, frame.on  # type: ignore[assignment]  # the base ends it
        return (None if kind == "base" else frame.name), X

    def _add_again(self, loose: Mapping[str, Any]) -> None:
        """Add a frame from its `_description`."""
        moved = {"motion": loose["motion"]} if loose.get("motion") is not None else {"placement": loose["placement"]}
        try:
            self.add(loose["name"], loose["on"] or None, **moved)
        except _core.ModelError as error:
            raise _core.ModelError(f"frame {loose['name']!r} is not copied: {error}; attach it to another frame, or remove it") from None

    def _description(self) -> list[dict[str, Any]]:
        """Return the loose frames as plain data, each after its carrier."""
        waiting: dict[str, dict[str, Any]] = {
            name: {"name": name, "on": self._core.on(name), "placement": self._core.placement(name), "motion": self._motions.get(name)}
            for name in self._core.loose_names()
        }
        ordered: list[dict[str, Any]] = []

        def take(name: str) -> None:
            if frame := waiting.pop(name, None):
                take(frame["on"])
                ordered.append(frame)

        for name in list(waiting):
            take(name)
        return ordered


def _function(motion: Any, name: str) -> Motion:
    if not callable(motion):
        raise _core.ModelError(f"the motion of frame {name!r} is a function of time, not {motion!r}")
    return motion
