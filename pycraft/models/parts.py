"""Parts of a model: connected sets of its bodies as models of their own, which follow its parameters and share its state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..arguments import listed, text
from ..state import State, at_state
from .handles import Body, Node
from .offers import Offer
from .shapes import Shape
from .with_operators import WithOperators

if TYPE_CHECKING:
    from .multibody import Multibody

Frame = str | Body | Node


class Parts(WithOperators):
    """Subgraphs and paths of a model, and the whole of a part. One class serves both: the whole model is one of its parts."""

    _whole: Multibody | None = None
    _left_aside: dict[str, np.ndarray]
    _added_nodes: set[str]
    _actuators: list[dict[str, Any]]
    _shapes: list[Shape]
    _offers: list[Offer]
    _not_read: list[str]

    # ------------------------------------------------------------------ creation
    def subgraph(
        self,
        root: Frame | None = None,
        *,
        without: Frame | Iterable[Frame] = (),
        bodies: Iterable[Frame] | None = None,
        base: str = "fixed",
        name: str | None = None,
    ) -> Multibody:
        """Return a connected set of bodies as a model, ignoring the rest.

        It has everything that a model has: `bodies`, `hinges`, `soa`, every direct call, derivatives, scenes, parts. Its coordinates are
        those of its bodies, in the model's order. Parameters and gravity are shared with the model, whichever of the two they are set on,
        and so is the state, without a copy if the part's coordinates are consecutive. When the model's structure changes, the part is
        stale. A copy or pickle of it is an independent model.

        Parameters
        ----------
        root : body or node, by name or handle
            This body with its hinge and everything outboard of it; default: all bodies.
        without : one or several
            Bodies to exclude, with everything outboard of them.
        bodies : several
            The bodies themselves, instead of root and without. They must be connected; bodies on the model's base are connected by it.
        base : {"fixed", "moving"}
            The part's base is the frame of the body that carries its root in the model (`carrier`). "fixed": it is the world's frame, at
            rest, as for a model that was loaded alone. "moving": it is a body of the part, massless, on a free hinge, first in order; its
            coordinates are the pose, velocity and acceleration of the carrier, taken from the model's state or given.
        name : str
            Default: from the names of the model and the root.

        Raises
        ------
        ModelError
            An unknown body, a set that is empty or not connected: names the missing bodies.

        Cost: O(bodies of the model) once; a call on the part costs the same as on the same model loaded alone.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> arm = pc.chain(4)
        >>> tip = arm.subgraph(root="body2")
        >>> list(tip.bodies), tip.nv
        (['body2', 'body3'], 2)
        >>> q = np.array([0.1, 0.2, 0.3, 0.4])
        >>> bool(np.allclose(tip.mass_matrix(tip.q_of(q)), arm.mass_matrix(q)[2:, 2:]))
        True
        """
        left_out = [without] if isinstance(without, (str, Body, Node)) else listed(without, "without")
        if bodies is not None:
            if root is not None or left_out:
                raise _core.ModelError("give root and without, or bodies, not both")
            numbers = [self._body_at(body, "bodies") for body in listed([bodies] if isinstance(bodies, str) else bodies, "bodies")]
        else:
            numbers = self._outboard_of(
                -1 if root is None else self._body_at(root, "root"), [self._body_at(body, "without") for body in left_out]
            )
        return self._part_of(numbers, base, name)

    def path(self, a: Frame | None, b: Frame | None, *, base: str = "fixed", name: str | None = None) -> Multibody:
        """Return the path from a to b as a part: both bodies, all between, and their closest common ancestor, which connects them.

        a, b : bodies or nodes, by name or handle; None for the base. `base` and `name` as in `subgraph`. Bodies and coordinates are in
        the model's order, inboard before outboard, whichever of the two comes first.

        Examples
        --------
        >>> import pycraft as pc
        >>> list(pc.tree([-1, 0, 1, 0, 3], ["pin"] * 5).path("body2", "body3").bodies)
        ['body0', 'body1', 'body2', 'body3']
        """
        numbers = [-1 if end is None else self._body_at(end, "an end of a path", grounded=True) for end in (a, b)]
        named = "-".join("base" if end is None else _name(end) for end in (a, b))
        return self._part_of(self._path_between(*numbers), base, f"{self.name}/{named}" if name is None else name)

    def _body_at(self, frame: Frame, what: str, grounded: bool = False) -> int:
        number = self._frame_body(_name(frame, what))
        if number < 0 and not grounded:
            raise _core.ModelError(f"{what}: {_name(frame)!r} is on the base of {self.name!r}, which is in no part; name a body")
        return number

    def _part_of(self, numbers: Sequence[int], base: str, name: str | None) -> Multibody:
        from .multibody import Multibody

        if text(base, "the base of a part") not in ("fixed", "moving"):
            raise _core.ModelError(f"base={base!r}: there are 'fixed' and 'moving'")
        if not numbers:
            raise _core.ModelError(f"a part of {self.name!r} has a body at least; none was given")
        named = f"{self.name}/{self._body(min(numbers))['name']}" if name is None else text(name, "a part")
        part = Multibody.__new__(Multibody)
        _core.Multibody.__init__(part, self, named, numbers, base == "moving")
        part._whole = self  # type: ignore[assignment]  # a Multibody, of which this is a part of the class
        part._take_aside(self)
        return part

    def _take_aside(self, whole: Any) -> None:
        """Take over the data of the whole's file on these bodies."""
        aside: dict[str, np.ndarray] = {}
        for key, values in whole._left_aside.items():
            if key == "gravity":
                aside[key] = values
            elif key == "spring rest":
                aside[key] = np.r_[self.zero_q()[: 7 * self._moves], values[self.q_index]]
            else:
                aside[key] = np.r_[np.full(6 * self._moves, np.nan), values[self.v_index]]
        self._left_aside, self._added_nodes = aside, set()
        own = set(self.coordinate_names)
        here = {*self.bodies, *self.nodes} if whole._shapes or whole._offers else set()  # type: ignore[attr-defined]  # of a Multibody
        self._shapes = [shape for shape in whole._shapes if shape.body in here]
        self._offers, self._not_read = [offer for offer in whole._offers if offer.body in here], list(whole._not_read)
        self._actuators = [dict(actuator) for actuator in whole._actuators if actuator["coordinate"] in own]

    # ------------------------------------------------------------------ relation to the whole
    @property
    def whole(self) -> Multibody | None:
        """The whole model of a part; None for an independent model."""
        return self._whole

    @property
    def carrier(self) -> Body | None:
        """For a part: the body of the whole that carries its root; None for the base of the whole."""
        number = -1 if self._part is None else self._part["carrier"]
        return None if self._whole is None or number < 0 else Body(self._whole, self._whole._body(number)["name"])

    @property
    def moving_base(self) -> Body | None:
        """For a part with base="moving": the massless body on a free hinge that represents the carrier; else None."""
        return Body(self, self._body(0)["name"]) if self._moves else None

    @property
    def _moves(self) -> bool:
        return self._part is not None and self._part["moving_base"]

    @property
    def q_index(self) -> np.ndarray:
        """Indices in the whole's q of the coordinates of the part's bodies, without a moving base."""
        return _numbers(self._runs("q"))

    @property
    def v_index(self) -> np.ndarray:
        """Indices in the whole's v of the velocities of the part's bodies, without a moving base: rows and columns of its ℳ."""
        return _numbers(self._runs("v"))

    def _runs(self, which: str) -> list[tuple[int, int]]:
        part = self._part
        return [(0, self.nq if which == "q" else self.nv)] if part is None else part[f"{which}_runs"]

    # ------------------------------------------------------------------ states from the states of the whole
    def q_of(self, whole_q: Any = None) -> np.ndarray:
        """Return the part's coordinates from the whole's: (nq,) or (B, nq), a view if they are consecutive there, else a copy.

        whole_q : array or State of the whole; default: its present state. A moving base gets the carrier's pose.
        """
        return self.state_of(whole_q).q

    def v_of(self, whole_v: Any, whole_q: Any = None) -> np.ndarray:
        """Return the part's velocities from the whole's, as `q_of`; whole_q is used for a moving base, default: the present one."""
        return self.state_of(self._of_whole().q if whole_q is None else whole_q, whole_v).v

    def state_of(self, whole_q: Any = None, whole_v: Any = None) -> State:
        """Return the part's state from the whole's: q and v, or a State, for one state or a batch. Views if possible.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> arm = pc.chain(3)
        >>> Q = np.zeros((8, 3))
        >>> tip = arm.subgraph(root="body1").state_of(Q, Q)
        >>> tip.q.shape, np.shares_memory(tip.q, Q)
        ((8, 2), True)
        """
        q, v = self._state_of_whole(whole_q, whole_v)
        whole = self._of_whole()
        own_q = _taken(q, self._runs("q"), whole.nq, f"q of {whole.name!r}")
        own_v = _taken(v, self._runs("v"), whole.nv, f"v of {whole.name!r}")
        if not self._moves:
            return State(own_q, own_v)
        pose, velocity, _ = self._motion_of_base(q, v, None)
        return State(_after(pose, own_q), _after(velocity, own_v))

    def accelerations_of(self, whole_vdot: Any, whole_q: Any = None, whole_v: Any = None) -> np.ndarray:
        """Return the part's accelerations from the whole's: those of its bodies' coordinates, preceded by the carrier's if the base moves.

        With them `part.inverse_dynamics(part.state_of(q, v), vdot=part.accelerations_of(vdot, q, v))` for a part on a moving base gives the
        forces of the whole at these hinges due to bodies of the part, preceded by the force that carries the part.
        """
        whole = self._of_whole()
        vdot = _core.real_array(whole_vdot, "vdot")
        own = _taken(vdot, self._runs("v"), whole.nv, f"vdot of {whole.name!r}")
        if not self._moves:
            return own
        return _after(self._motion_of_base(*self._state_of_whole(whole_q, whole_v), vdot)[2], own)

    def follow_base(self) -> None:
        """Restore the carrier's motion to a moving base, after `q` or `v` was set here, which gave it a motion of its own."""
        self._follow_base()

    def _of_whole(self) -> Any:
        return self if self._whole is None else self._whole

    def _state_of_whole(self, whole_q: Any, whole_v: Any) -> tuple[np.ndarray, np.ndarray]:
        q, v = at_state(self._of_whole(), whole_q, whole_v)
        return _core.real_array(q, "q"), _core.real_array(v, "v")

    def _motion_of_base(self, q: np.ndarray, v: np.ndarray, vdot: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the carrier's pose in the coordinates of a free hinge, its velocity and acceleration in its axes."""
        carrier, whole = self.carrier, self._of_whole()
        if carrier is None:
            return np.r_[1.0, np.zeros(6)], np.zeros(6), np.zeros(6)
        pose, jacobian = whole.pose(carrier.name, q), whole.jacobian(carrier.name, q)
        placed = np.concatenate([_quaternions(pose[..., :3, :3]), pose[..., :3, 3]], axis=-1)
        velocity = np.einsum("...ij,...j->...i", jacobian, v)
        if vdot is None:
            return placed, velocity, np.zeros(6)
        rate = whole.jacobian_dot(carrier.name, q, v)
        return placed, velocity, np.einsum("...ij,...j->...i", jacobian, vdot) + np.einsum("...ij,...j->...i", rate, v)


def _name(frame: Any, what: str = "a body") -> str:
    return frame.name if isinstance(frame, (Body, Node)) else text(frame, what)


def _numbers(runs: Sequence[tuple[int, int]]) -> np.ndarray:
    return np.concatenate([np.arange(first, first + size) for first, size in runs] or [np.arange(0)])


def _taken(numbers: np.ndarray, runs: Sequence[tuple[int, int]], width: int, what: str) -> np.ndarray:
    if numbers.ndim not in (1, 2) or numbers.shape[-1] != width:
        raise _core.ModelError(f"{what} takes {width} values per state, (..., {width}), not an array of shape {numbers.shape}")
    if len(runs) == 1:
        first, size = runs[0]
        return numbers[..., first : first + size]
    return numbers[..., _numbers(runs)]


def _after(base: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Concatenate entries of a moving base and of the bodies, for one state or for the larger number of states."""
    states = np.broadcast_shapes(base.shape[:-1], own.shape[:-1])
    return np.concatenate([np.broadcast_to(x, (*states, x.shape[-1])) for x in (base, own)], axis=-1)


def _quaternions(R: np.ndarray) -> np.ndarray:
    """Return unit quaternions (..., 4), w first and not negative, from rotations (..., 3, 3), by the largest component."""
    x, y, z = R[..., 0, :], R[..., 1, :], R[..., 2, :]
    turn = (z[..., 1] - y[..., 2], x[..., 2] - z[..., 0], y[..., 0] - x[..., 1])
    xy, xz, yz = x[..., 1] + y[..., 0], x[..., 2] + z[..., 0], y[..., 2] + z[..., 1]
    a, b, c = x[..., 0], y[..., 1], z[..., 2]
    rows = [(1 + a + b + c, *turn), (turn[0], 1 + a - b - c, xy, xz), (turn[1], xy, 1 - a + b - c, yz), (turn[2], xz, yz, 1 - a - b + c)]
    all_four = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    largest = np.argmax(np.diagonal(all_four, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(all_four, largest[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0, -q, q)
