"""Edit an existing structure: attach and detach bodies, move them to other hinges, and change the root."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number, text
from .asides import Asides
from .handles import Body, Node, Vector
from .hinge_arguments import body_name, frame_name, hinge_arguments
from .hinge_fit import HingeFit, OneHinge, fitted
from .impulses import Impulse, impulse_into, twists_of
from .locking import Locking


@dataclass(frozen=True)
class Reattachment:
    """A body on its new hinge.

    Attributes
    ----------
    body : Body
    q, v : coordinates and velocities of the new hinge
    pose_error, velocity_error : (6,) remainders of the body's pose and twist, in its axes, angular first: rad and m, rad/s and m/s. With an
        impulse the velocity error is the velocity that the impulse removed.
    impulse : Impulse, or None if velocities were kept
    """

    body: Body
    q: np.ndarray
    v: np.ndarray
    pose_error: np.ndarray
    velocity_error: np.ndarray
    impulse: Impulse | None = None


class Structure(Locking):
    """Edits that move bodies to other hinges. Each leaves the model unchanged if it is refused, and makes operators and parts stale."""

    _left_aside: dict[str, np.ndarray]
    _actuators: list[dict[str, Any]]

    def reattach(
        self,
        body: str | Body,
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
        placement: np.ndarray | str | None = None,
        rotor_inertia: float | Vector | None = None,
        limits: tuple[float | Vector, float | Vector] | None = None,
        hinge_name: str | None = None,
        q: Vector | None = None,
        velocity: str = "keep",
        tolerance: float = 1e-9,
    ) -> Reattachment:
        """Move a body, with everything outboard of it, to another hinge of another body, or of the same, at its present pose and velocity.

        The coordinates of the new hinge are solved for the body's pose, and its velocities for its twist; pose and twist of all other
        bodies do not change. Momentum and kinetic energy do not change, except for the rotors of the removed hinge.

        Parameters
        ----------
        body : its name or handle
        parent : name of a body or node, a Body or Node, or None for the base
        hinge, axis, axes, point, pitch, subhinges, position, rotation, rotor_inertia, limits : the new hinge, as in `add_body`
        placement : (4, 4), or "here"
            "here": the hinge's inboard frame is placed so that the body is at the coordinates q, default zero.
        hinge_name : default: the name of the present hinge
        q : (n,) guess for the coordinates of the new hinge: of several solutions the one that the iteration reaches from q, with angles of
            pins by whole turns nearest to q. Default: zero, or the nearest limit.
        velocity : {"keep", "impulse"}
            "keep": refuse a twist that the hinge does not permit. "impulse": the hinge catches the body, a plastic impact that changes all
            velocities at once. Momentum is conserved along every motion of the new structure, kinetic energy falls by the loss of
            `Reattachment.impulse`, ½ δ*Mδ; a rotor of the new hinge is at rest before.
        tolerance : of the error of pose and twist, rad and rad/s; in metres and m/s times 1 + the distance, or speed

        Returns
        -------
        Reattachment

        Raises
        ------
        ModelError
            A body moved outboard of itself, names that are duplicate or unknown, an invalid hinge; a coupling of the removed hinge; a pose
            or a twist that the hinge cannot produce, with the remainder and the remedy. The model is unchanged.
        SingularHingeError
            For an impulse, as forward dynamics.

        Cost: the hinges between the two bodies, and O(bodies) at the next use of the model (docs/structure.md); an impulse O(bodies).

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(3)
        >>> arm.q, arm.v = [0, 0.5, 0], [0, 0, 1]
        >>> done = arm.reattach("body2", "body0", "planar", position=(1, 0, 0))
        >>> done.q.round(3).tolist(), done.v.round(3).tolist()
        ([0.878, 0.479, 0.5], [0.0, 0.0, 1.0])
        """
        name, onto = body_name(body), frame_name(parent)
        number = self._body_index(name)
        was = self._body(number)["hinge"]["name"]
        if onto and number in self._path_between(-1, self._frame_body(onto)):
            where = "is on the body itself" if self._frame_body(onto) == number else "is outboard of it"
            raise _core.ModelError(f"body {name!r} cannot be attached to {onto!r}, which {where}")
        called = was if hinge_name is None else text(hinge_name, "a hinge")
        if not isinstance(velocity, str) or velocity not in ("keep", "impulse"):
            raise _core.ModelError(f"velocity={velocity!r}: there are 'keep' and 'impulse'")
        here = isinstance(placement, str)
        if here and (placement != "here" or position is not None or rotation is not None):
            raise _core.ModelError(f"hinge {called!r}: placement is a pose (4, 4), or 'here' without position and rotation")
        pose: Any = None if here else placement
        given = hinge_arguments(
            f"hinge {called!r}", hinge, axis=axis, axes=axes, point=point, pitch=pitch, subhinges=subhinges, position=position,
            rotation=rotation, placement=pose, rotor_inertia=rotor_inertia, limits=limits,
        )  # fmt: skip
        self._require_uncoupled(was)
        allowed = one_number(tolerance, "tolerance")
        if not 0 <= allowed < np.inf:
            raise _core.ModelError(f"tolerance={allowed:g}: it is a finite number, not negative")
        fit = self._fit(name, onto, called, given, here, q, allowed, velocity)
        impulse = self._caught(name, onto, called, given, fit) if velocity == "impulse" else None
        aside = Asides(self)
        self._rehang(name, onto, hinge_name=called, q=fit.q.tolist(), v=fit.v.tolist(), **given)
        if impulse is not None:
            self.v = impulse.v
        aside.put(self, changed=[was, called])
        self._set_accelerations({called: np.zeros(len(fit.v))})
        v = np.array(self.v[self._slices(self._hinge_index(called))[1]])
        return Reattachment(Body(self, name), fit.q, v, fit.pose_error, fit.velocity_error, impulse)

    def attach(self, body: str | Body, parent: str | Body | Node, hinge: str = "weld", **options: Any) -> Reattachment:
        """Join a freely floating body to another: `reattach` by a hinge at its present place, by default a weld.

        The inverse of `detach`. A body floats freely if it is on the base by a free hinge; of several bodies that float together `reroot`
        makes another one the first.

        Parameters
        ----------
        body, parent, hinge, options : as in `reattach`, except that placement is "here" unless a pose is given

        Raises
        ------
        ModelError
            A body that is not free, with the remedy; errors of `reattach`, including twists that differ: velocity="impulse" catches the
            body.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> tool = arm.add_body("tool", None, "free", mass=1.0, inertia=np.eye(3))
        >>> arm.q = [0, 0, 1, 0, 0, 0, 2, 0, 0]
        >>> arm.v = [1, 0, 0, 0, 0, 0, 0, 0]
        >>> hit = arm.attach("tool", "body1", velocity="impulse")
        >>> arm.nv, round(hit.impulse.energy_before, 3), round(hit.impulse.energy_after, 3)
        (2, 1.333, 0.764)
        """
        name = body_name(body)
        data = self._body(self._body_index(name))
        if data["parent"] >= 0 or data["hinge"]["kind"] != "free":
            on = "the base" if data["parent"] < 0 else repr(self._body(data["parent"])["name"])
            remedy = f"detach({name!r}) first, reroot({name!r}) where it is carried by a free body, or reattach it"
            kind = data["hinge"]["kind"]
            raise _core.ModelError(f"body {name!r} is not free to be attached: it is attached to {on} by a {kind}; {remedy}")
        if all(options.get(pose) is None for pose in ("position", "rotation", "placement")):
            options["placement"] = "here"
        return self.reattach(name, parent, hinge, **options)

    def detach(self, body: str | Body, hinge_name: str | None = None) -> Reattachment:
        """Release a body, with everything outboard of it, onto a free hinge on the base, at its present pose and velocity.

        body : its name or handle; hinge_name : of the free hinge, default: the name of the body's hinge. Momentum and energy are conserved
        except for the rotors of the hinge. Cost and errors as in `reattach`.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.q, arm.v = [0, 0], [1, 0]
        >>> arm.detach("body1").v.tolist(), arm.nv
        ([0.0, 0.0, 1.0, 0.0, 1.0, 0.0], 7)
        """
        return self.reattach(body, None, "free", hinge_name=hinge_name)

    def reroot(self, body: str | Body) -> Body:
        """Make a body the first of a freely floating tree: the same motion, seen from another base body.

        The free hinge moves to the body and has its pose and twist; hinges on the path from the old root are reversed, so that inboard
        becomes outboard. The order of their subhinges and their axes are reversed: coordinates, velocities, limits, forces and rotors keep
        their values. For balls and free subhinges on the path, quaternions and positions are inverted, and velocities belong to the
        other body, in its axes. All poses, velocities, energies and momenta are the same, to rounding, and so are accelerations in
        `frames.vdot`. A reversed planar hinge is pin, slider, slider, a custom hinge. Masses, names, frames and nodes of bodies stay, and
        couplings stay on their coordinates.

        Raises
        ------
        ModelError
            A root that is not on a free hinge (detach it first); locked hinges on the path; rotors that would act about other axes: of the
            free hinge itself, and of a ball or free hinge on the path with different rotors about different axes; an effect of a scene that
            acts on the coordinates of the free hinge, alone or among all, or that reads coordinates of hinges on the path one by one, or
            all in their order. The model is unchanged.

        Cost: the hinges on the path, and O(bodies) at the next use of the model.

        Examples
        --------
        >>> import pycraft as pc
        >>> robot = pc.tree([-1, 0, 1], ["free", "pin", "ball"], seed=1)
        >>> before = robot.kinetic_energy(robot.random_state(0))
        >>> robot.q, robot.v = robot.random_state(0).q, robot.random_state(0).v
        >>> robot.reroot("body2"), list(robot.hinges)
        (<body 'body2': 2.15089 kg on hinge 'hinge0' of 'the base'>, ['hinge0', 'hinge2', 'hinge1'])
        >>> bool(np.isclose(robot.kinetic_energy(), before))
        True
        """
        name, frames = body_name(body), self._kept_frames
        way = {self._body(k)["hinge"]["name"] for k in self._path_between(-1, self._body_index(name))}
        if locked := ", ".join(repr(hinge) for hinge in self.locked if hinge in way):
            raise _core.ModelError(
                f"between the root and body {name!r} there are locked hinges, {locked}: unlock them before they are turned"
            )
        self._require_whole(way, name)
        rates = np.zeros(self.nv) if frames is None else np.array(frames.vdot)
        first = self.frame(name).acceleration() if rates.any() else np.zeros(6)
        aside = Asides(self)
        turned = dict(self._reroot(name, rates.tolist()))
        aside.put(self, turned=turned)
        if self._kept_loops is not None:
            self._kept_loops._turned({hinge: len(v) for hinge, v in turned.items() if self._kind_of(hinge) != "cylindrical"})
        if turned:
            self._set_accelerations({self._body(self._body_index(name))["hinge"]["name"]: first, **turned})
        return Body(self, name)

    # ------------------------------------------------------------------ implementation
    def _fit(
        self, name: str, onto: str, called: str, given: dict[str, Any], here: bool, guess: Any, tolerance: float, velocity: str
    ) -> HingeFit:
        """Return the new hinge's coordinates and velocities; with placement "here", also its placement."""
        hinge, X = OneHinge(name, called, given), np.eye(4)
        X[:3, :3], X[:3, 3], V = self._relative_motion(name, onto)
        near = hinge.guess() if guess is None else _core.real_array(guess, f"q of hinge {called!r}")
        hinge.check_q(near)
        if here:
            placed = X @ np.linalg.inv(hinge.pose(name, near))
            given["rotation"], given["position"] = placed[:3, :3], placed[:3, 3]
            hinge = OneHinge(name, called, given)
        fit = fitted(hinge, X, V, near, tolerance)
        far = _beyond(fit.pose_error, tolerance, X[:3, 3])
        fast = velocity == "keep" and _beyond(fit.velocity_error, tolerance, V)
        if far or fast:
            remedies = ['another placement, or placement="here"'] * far + ['velocity="impulse" to have the hinge catch it'] * fast
            cannot = "be where it is" if far else "move as it moves"
            on = f"hinge {called!r} ({given['hinge']}) of {repr(onto) if onto else 'the base'}"
            pose, twist = _off(fit.pose_error, "rad", "m"), _off(fit.velocity_error, "rad/s", "m/s")
            raise _core.ModelError(
                f"body {name!r} cannot {cannot} on {on}: the nearest that was found is off by {pose}, and its twist by {twist}"
                f" (in the body's axes); give {'; '.join(remedies)}"
            )
        return fit

    def _caught(self, name: str, onto: str, called: str, given: dict[str, Any], fit: HingeFit) -> Impulse:
        """Return the impulse by which a body's new hinge catches it, computed on a copy. The rotor of the new hinge is at rest before."""
        from .multibody import Multibody

        twists = dict(zip(self._names()[0], twists_of(self).reshape(-1, 6), strict=True))
        trial = Multibody(self.name, welds="keep")
        trial._graft(self, -1, "", None, None, False, *self._branch(-1))
        trial._rehang(name, onto, hinge_name=called, q=fit.q.tolist(), v=[0.0] * len(fit.v), **given)
        trial.take_warnings()  # the model itself issues them
        return impulse_into(trial, np.array([twists[other] for other in trial._names()[0]]).ravel())

    def _require_whole(self, way: set[str], body: str) -> None:
        """Refuse effects that read coordinates one by one: reversed hinges change theirs, the free hinge changes its body."""
        if len(way) < 2:
            return
        sizes = {hinge: self._slices(self._hinge_index(hinge))[1] for hinge in way}
        apart = {hinge for hinge, v in sizes.items() if v.stop - v.start > 1 and self._kind_of(hinge) != "cylindrical"} | {""}
        for scene in self._scenes or ():
            for effect, hinges in scene._by_coordinate(apart).items():
                what = f"coordinates of {hinges[0]!r} one by one" if hinges[0] else "all coordinates one by one, in their order"
                raise _core.ModelError(
                    f"effect {effect!r} of a scene takes {what}, which are others when {body!r} is the root: remove it, and add it anew"
                )
        root = self._body(self._path_between(-1, self._body_index(body))[0])
        free = self._slices(self._hinge_index(root["hinge"]["name"]))[1]
        for scene in self._scenes or ():
            for effect in scene._acting_on(set(range(free.start, free.stop))):
                raise _core.ModelError(
                    f"effect {effect!r} of a scene acts on the coordinates of the free hinge {root['hinge']['name']!r}, which are those of"
                    f" {root['name']!r}, and would be those of {body!r}: remove it, and add it anew"
                )

    def _set_accelerations(self, by_hinge: Mapping[str, Any]) -> None:
        """Set present accelerations of replaced hinges, if any are stored."""
        if self._kept_frames is None:
            return
        vdot = np.array(self._kept_frames.vdot)
        if not vdot.any() and not any(np.any(values) for values in by_hinge.values()):
            return
        for hinge, values in by_hinge.items():
            vdot[self._slices(self._hinge_index(hinge))[1]] = values
        self._kept_frames.vdot = vdot


def _beyond(error: np.ndarray, tolerance: float, sizes: np.ndarray) -> bool:
    """Check whether an angular part, or a linear part over its scale, exceeds the tolerance or is not a number."""
    return not (np.linalg.norm(error[:3]) <= tolerance and np.linalg.norm(error[3:]) <= tolerance * (1 + np.linalg.norm(sizes)))


def _off(error: np.ndarray, angular: str, linear: str) -> str:
    """Return the remainder in words: "0.3 rad about (0, 0, 1) and 0.1 m along (1, 0, 0)"."""
    parts = []
    for half, unit, way in ((error[:3], angular, "about"), (error[3:], linear, "along")):
        size = float(np.linalg.norm(half))
        axis = ", ".join(f"{x:.3g}" for x in half / size + 0.0) if size else ""
        parts.append(f"{size:.3g} {unit} {way} ({axis})" if size > 1e-12 else f"0 {unit}")
    return " and ".join(parts)
