"""Branches of a model: removed with everything on them, copied, and merged from another model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple
from weakref import WeakSet

import numpy as np

from .. import _core
from ..arguments import pose_parts, text
from .asides import Asides
from .handles import Body, Node, Vector
from .hinge_arguments import body_name, frame_name
from .offers import Offer
from .shapes import Shape, renamed
from .with_loops import WithLoops


class Removed(NamedTuple):
    """Names of the removed items. `effects` are pairs of a scene and the name of an effect removed from it."""

    bodies: list[str]
    hinges: list[str]
    nodes: list[str]
    effects: list[tuple[Any, str]]
    loops: list[str]


class Grafting(WithLoops):
    """Edits that remove and add bodies. Each leaves the model unchanged if it is refused; operators and parts become stale."""

    _left_aside: dict[str, np.ndarray]
    _actuators: list[dict[str, Any]]
    _shapes: list[Shape]
    _offers: list[Offer]
    _added_nodes: set[str]
    _scenes: WeakSet[Any] | None = None

    def remove_body(self, name: str | Body, *, with_uses: bool = False) -> Removed:
        """Remove a body with everything outboard of it. Operators made before are stale; q and v are carried over by hinge name.

        Welded links of the model's file that are nodes of these bodies are removed with them. Nodes added by `add_node`, and loops and
        effects of scenes of this model that name one of the bodies, hinges or nodes, count as uses. Loose frames that stand on them stay,
        and report it when they are evaluated (docs/frames.md).

        Parameters
        ----------
        name : name of the body, or its handle
        with_uses : whether to remove its uses as well, nodes, loops and effects; else a body in use is refused

        Raises
        ------
        ModelError
            A body that is in use: names the uses.

        Cost: O(bodies), and the effects of the model's scenes.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(3)
        >>> eye = arm.add_node("eye", "body2")
        >>> arm.remove_body("body1")
        Traceback (most recent call last):
            ...
        pycraft.ModelError: body 'body1' is in use: node 'eye' is on 'body2'; remove_body('body1', with_uses=True) removes these along
        >>> arm.remove_body("body1", with_uses=True).bodies
        ['body1', 'body2']
        """
        name = body_name(name)
        bodies, hinges, nodes = self._branch(self._body_index(name))
        gone = {*bodies, *hinges, *nodes}
        used = [(scene, effect, names[0]) for scene in self._scenes or () for effect, names in scene._effects_on(gone).items()]
        added = [node for node in nodes if node in self._added_nodes]
        closed = [loop for loop in self._kept_loops or () if self.loops._stands_on(loop) & gone]
        if not with_uses and (added or used or closed):
            carrier = {node: self._body(self._frame_body(node))["name"] for node in added}
            uses = [f"node {node!r} is on {carrier[node]!r}" for node in added]
            uses += [f"loop {loop!r} is closed there" for loop in closed]
            uses += [f"effect {effect!r} of a scene names {what!r}" for _, effect, what in used]
            remedy = f"remove_body({name!r}, with_uses=True) removes these along"
            raise _core.ModelError(f"body {name!r} is in use: {'; '.join(uses)}; {remedy}")
        aside = Asides(self)
        for loop in closed:
            self.loops.remove(loop)
        self._remove_body(name)
        aside.put(self)
        self._added_nodes -= gone
        self._shapes = [shape for shape in self._shapes if shape.body not in gone]
        self._offers = [offer for offer in self._offers if offer.body not in gone]
        for scene, effect, _ in used:
            scene.remove(effect)
        return Removed(bodies, hinges, nodes, [(scene, effect) for scene, effect, _ in used], closed)

    def copy_subtree(
        self,
        body: str | Body,
        parent: str | Body | Node | None = None,
        *,
        prefix: str = "",
        suffix: str = "",
        rename: Callable[[str], str] | None = None,
        position: Vector | None = None,
        rotation: np.ndarray | None = None,
        placement: np.ndarray | None = None,
    ) -> Body:
        """Copy a body with everything outboard of it, to another body by a copy of its hinge.

        Bodies, hinges with their limits and rotors, nodes, loose frames that stand on them, loops among them, and the file's data on their
        coordinates are copied. So is the state: the copy has the same position and velocity relative to its parent as the original has now.

        Parameters
        ----------
        body : its name or handle
        parent : name of a body or node, a Body or Node, or None for the base
        prefix, suffix : before and after all copied names
        rename : function of a name, used in their place
        position, rotation, or placement : the pose of the copied hinge's inboard frame on the parent; default: as in the original

        Returns
        -------
        Body : the copy of the body

        Raises
        ------
        ModelError
            Names that exist already, all of them, and the remedy; an unknown parent, an invalid pose.

        Cost: O(bodies), in the core.

        Examples
        --------
        >>> import pycraft as pc
        >>> robot = pc.chain(3)
        >>> robot.copy_subtree("body1", "body0", prefix="left ", position=(0, 1, 0))
        <body 'left body1': 1 kg on hinge 'left hinge1' of 'body0'>
        >>> list(robot.bodies)
        ['body0', 'body1', 'body2', 'left body1', 'left body2']
        """
        name = body_name(body)
        rotation, position = pose_parts(f"the copy of body {name!r}", rotation, position, placement)
        placed = rotation is not None or position is not None
        called = _renaming(prefix, suffix, rename)
        self._take(self, self._body_index(name), frame_name(parent), rotation, position, placed, called)
        return Body(self, called(name))

    def merge(
        self,
        other: Any,
        parent: str | Body | Node | None = None,
        *,
        prefix: str = "",
        suffix: str = "",
        rename: Callable[[str], str] | None = None,
        position: Vector | None = None,
        rotation: np.ndarray | None = None,
        placement: np.ndarray | None = None,
    ) -> list[Body]:
        """Copy all of another model into this one, its base put on a body of this one. The other model does not change.

        Bodies, hinges with their limits and rotors, nodes (including those on its base), loose frames, loops, the file's data on its
        coordinates, and its present state are copied; its gravity is not.

        Parameters
        ----------
        other : a model, or a part of one
        parent : name of a body or node, a Body or Node, or None for the base
        prefix, suffix, rename : for its names here, as in `copy_subtree`
        position, rotation, or placement : the pose of the other model's base on the parent

        Returns
        -------
        list of Body : the bodies on the other model's base

        Raises
        ------
        ModelError
            As `copy_subtree`; also for a loose frame that a function moves, or a loop, on the other model's base if that is moved.

        Cost: O(bodies of both), in the core.

        Examples
        --------
        >>> import pycraft as pc
        >>> cart, arm = pc.Multibody("cart"), pc.chain(2)
        >>> plate = cart.add_body("plate", None, "slider", axis=(1, 0, 0), mass=3.0)
        >>> cart.merge(arm, "plate", prefix="arm/", position=(0, 0, 0.5))
        [<body 'arm/body0': 1 kg on hinge 'arm/hinge0' of 'plate'>]
        >>> cart.coordinate_names
        ['plate', 'arm/hinge0', 'arm/hinge1']
        """
        if not isinstance(other, WithLoops):
            raise _core.ModelError(f"{self.name!r} takes in a model, not {other!r:.80}")
        rotation, position = pose_parts(f"the base of {other.name!r}", rotation, position, placement)
        called = _renaming(prefix, suffix, rename)
        roots = [other._body(k)["name"] for k in roots_of(other)]
        self._take(other, -1, frame_name(parent), rotation, position, False, called)
        return [Body(self, called(root)) for root in roots]

    # ------------------------------------------------------------------ implementation
    def _used_by(self, scene: Any) -> None:
        """Register a scene that acts on the model, as long as it exists."""
        if self._scenes is None:
            self._scenes = WeakSet()
        self._scenes.add(scene)

    def _take(
        self, source: Any, root: int, parent: str, rotation: Any, position: Any, places_hinge: bool, called: Callable[[str], str]
    ) -> None:
        """Copy a branch of a model, root -1 for the whole, with everything that stands on it."""
        bodies, hinges, nodes = source._branch(root)
        frames = _frames_on(source, {*bodies, *nodes}, root < 0)
        for moved in frames if root < 0 else ():
            if not moved["on"] and moved["motion"] is not None and (parent or rotation is not None or position is not None):
                what = f"frame {moved['name']!r} is moved by a function of time, which places it on the base of {source.name!r}"
                raise _core.ModelError(f"{what}: put it on a node there first")
        new_bodies, new_hinges, new_nodes = ([_called(called, name) for name in names] for names in (bodies, hinges, nodes))
        loops = _loops_on(source, {*bodies, *hinges, *nodes}, root < 0)
        for loop in loops if parent or rotation is not None or position is not None else ():
            if "" in source.loops._stands_on(loop["name"]):
                what = f"loop {loop['name']!r} is closed at the base of {source.name!r}, which is placed elsewhere here"
                raise _core.ModelError(f"{what}: declare it on a node there first")
        made = [frame | {"name": _called(called, frame["name"])} for frame in frames]
        closed = [_renamed(loop, called) for loop in loops]
        if taken := [loop["name"] for loop in closed if loop["name"] in (self._kept_loops or ())]:
            raise _core.ModelError(
                f"{self.name!r} has loops called {', '.join(map(repr, taken))} already; give a prefix, a suffix, or rename"
            )
        loose = [] if self._kept_frames is None else self._kept_frames._core.loose_names()
        self._require_new(new_bodies, new_hinges, new_nodes, [frame["name"] for frame in made], loose)
        own, its = Asides(self), Asides(source)
        added = set(map(called, set(nodes) & getattr(source, "_added_nodes", set())))
        self._graft(source, root, parent, rotation, position, places_hinge, new_bodies, new_hinges, new_nodes)
        X = _placed(rotation, position)  # checked there
        self._added_nodes |= added
        copies = {frame["name"] for frame in frames} | {*bodies, *nodes}
        for frame in made:
            on = called(frame["on"]) if frame["on"] in copies else parent
            self.frames._add_again(frame | {"on": on} | ({} if frame["on"] else {"placement": X @ frame["placement"]}))
        for loop in closed:
            self.loops._declare(loop)
        own.put(self)
        its.add(self, dict(zip(hinges, new_hinges, strict=True)), called)
        self._shapes = [*self._shapes, *renamed(source._shapes, {*bodies, *nodes}, called)]
        self._offers = [*self._offers, *renamed(source._offers, {*bodies, *nodes}, called)]


def _frames_on(model: Any, carriers: set[str], with_base: bool) -> list[dict[str, Any]]:
    """Return loose frames that stand on these, or on one another there, each after its carrier; "" names the base."""
    found, names, kept = [], set(carriers), model._kept_frames
    for frame in [] if kept is None else kept._description():
        on_base = not frame["on"] or (frame["on"] in ("base", "world") and kept._core.number(frame["on"]) == -1)
        if on_base and with_base or frame["on"] in names:
            found.append(frame | {"on": "" if on_base else frame["on"]})
            names.add(frame["name"])
    return found


def _loops_on(model: Any, carriers: set[str], with_base: bool) -> list[dict[str, Any]]:
    """Return loops that are declared on these alone, and on the base, "", if it is among them."""
    kept = model._kept_loops
    grounds = carriers | {""} if with_base else carriers
    return [] if kept is None else [loop for loop in kept._description() if kept._stands_on(loop["name"]) <= grounds]


def _renamed(loop: dict[str, Any], called: Callable[[str], str]) -> dict[str, Any]:
    """Return a loop with renamed parts."""
    on = lambda name: called(name) if name else ""
    if "terms" in loop:
        where: dict[str, Any] = {"terms": [(on(hinge), *rest) for hinge, *rest in loop["terms"]]}
    else:
        where = {"a": on(loop["a"]), "b": on(loop["b"])}
    own = {key: part for key, part in loop.items() if key not in ("whole", "held")}  # hinges locked there are welds here
    return own | where | {"name": _called(called, loop["name"])}


def roots_of(model: Any) -> list[int]:
    """Return the numbers of the bodies on the base: in depth-first order the bodies of each branch are consecutive."""
    roots, k = [], 0
    while k < model._size:
        roots.append(k)
        k += len(model._outboard_of(k, []))
    return roots


def _renaming(prefix: str, suffix: str, rename: Callable[[str], str] | None) -> Callable[[str], str]:
    if rename is None:
        before, after = text(prefix, "a prefix of names"), text(suffix, "a suffix of names")
        return lambda name: before + name + after
    if prefix or suffix:
        raise _core.ModelError("give prefix and suffix, or rename, not both")
    if not callable(rename):
        raise _core.ModelError(f"rename is a function of a name, not {rename!r:.80}")
    return rename


def _called(rename: Callable[[str], str], name: str) -> str:
    return text(rename(name), f"the copy of {name!r}")


def _placed(rotation: Any, position: Any) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3] = X[:3, :3] if rotation is None else rotation
    X[:3, 3] = X[:3, 3] if position is None else position
    return X
