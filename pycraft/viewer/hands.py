"""A body held in the viewer: a spring pushes it to the pointer while the scene plays, or inverse kinematics moves it there."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _core
from ..scenes.effects import Wrench
from .live_scene import LiveScene, scene_again

NAME = "push"
"""Name of the effect. It is added to a copy of the user's scene, not to the scene itself."""
SHARE = 0.3
"""Extension of the spring at which its force equals the model's weight, as a fraction of the model's reach."""
STIFFEST = 0.1
"""Largest stiffness as a fraction of m/h², with m the least effective mass at the place and h the time between two readings of the
pointer. The force is constant during h,
so an undamped spring of 4 m/h² would be unstable."""
WEIGHT = 9.81
"""Acceleration, m/s², that defines the weight with which forces are compared."""
ITERATIONS = 30


@dataclass
class Push:
    """A spring and a damper from a place on a body to a place in the world.

    Attributes
    ----------
    body : its name
    place : (3,) m, in the body's frame
    to : (3,) m, in the world
    stiffness, damping : N/m, N s/m
    force : (3,) N, present force in the world
    most : N, largest force so far
    """

    body: str
    place: np.ndarray
    to: np.ndarray
    stiffness: float
    damping: float
    effect: Wrench
    scene: Any
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    most: float = 0.0

    @classmethod
    def of(cls, live: LiveScene, body: str, place: np.ndarray, to: np.ndarray, seconds: float) -> Push:
        """Return a spring for a scene that is advanced by `seconds` of its own time per update."""
        mass = _least_mass(live, body, place)
        reach = max(1e-9, float(np.ptp(live.skeleton.poses(live.q)[:, :3, 3], axis=0).max()))
        weight = WEIGHT * float(sum(live.skeleton.masses))
        stiffness = min(weight / (SHARE * reach), STIFFEST * mass / seconds**2)
        effect = Wrench(body, np.zeros(6))
        scene = scene_again(live.scene)
        scene.add(effect, name=_free_name(scene))
        return cls(body, place, to, stiffness, 2 * np.sqrt(stiffness * mass), effect, scene)

    def act(self, live: LiveScene) -> None:
        """Set the effect to the force at the present state, as a wrench about the body's origin."""
        at, velocity = _place(live, self.body, self.place)
        self.force = self.stiffness * (self.to - at) - self.damping * velocity
        self.most = max(self.most, float(np.linalg.norm(self.force)))
        arm = at - live.model.pose(self.body, live.q)[:3, 3]
        self.effect.wrench = np.concatenate([np.cross(arm, self.force), self.force])

    def shown(self, live: LiveScene) -> dict[str, Any]:
        """Return the place, the force and the largest force so far, for the page."""
        return {"at": _place(live, self.body, self.place)[0].tolist(), "force": self.force.tolist(), "most": self.most}


def lead(live: LiveScene, body: str, place: np.ndarray, to: np.ndarray) -> str:
    """Move the scene, at rest, so that a place of a body is nearest to a place in the world; return why it is not reached, else "".

    Inverse kinematics within limits starts from the present configuration only, so that the model does not jump; free hinges stay.
    """
    model = copy.deepcopy(live.model)  # the added frame must not appear in the user's model
    name = "led"
    while name in model.frames:
        name += "_"
    X = np.eye(4)
    X[:3, 3] = place
    model.frames.add(name, body, placement=X)
    held = [hinge for hinge, kind in zip(live.skeleton.names, live.skeleton.kinds, strict=True) if kind != "free"]
    found = model.solve_ik({name: to}, live.q, coordinates=held, restarts=0, iterations=ITERATIONS, tolerance=1e-6)
    live.put(found.q, np.zeros(model.nv))
    return "" if found.reached else str(found.why)


def given_place(live: LiveScene, body: Any, place: Any, to: Any) -> tuple[str, np.ndarray, np.ndarray]:
    """Check the body and the places that `Push.of` and `lead` are given. Raises ModelError for an unknown body or an invalid place."""
    if body not in live.skeleton.bodies:
        raise _core.ModelError(f"{live.model.name!r} has no body {body!r}")
    places = [np.asarray(_core.real_array(x, what)) for x, what in ((place, "place"), (to, "to"))]
    for x, what in zip(places, ("place", "to"), strict=True):
        if x.shape != (3,) or not np.isfinite(x).all():
            raise _core.ModelError(f"{what} must be three finite numbers in m, not {x.tolist()!r:.80}")
    return str(body), places[0], places[1]


def _place(live: LiveScene, body: str, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a body's place in the world, and its velocity."""
    X = live.model.pose(body, live.q)
    twist = live.model.jacobian(body, live.q) @ live.v
    return X[:3, :3] @ place + X[:3, 3], X[:3, :3] @ (twist[3:] + np.cross(twist[:3], place))


def _least_mass(live: LiveScene, body: str, place: np.ndarray) -> float:
    """Return the least effective mass at a place of a body over all directions, kg: 1/λ, λ the largest eigenvalue of J ℳ⁻¹ J*."""
    model = live.model
    J = model.jacobian(body, live.q)
    J = J[3:] - np.cross(place, J[:3], axisb=0, axisc=0)  # velocity of the place: v + ω × place
    if not J.size or not np.abs(J).max():
        raise _core.ModelError(f"{body!r} does not move: there is nothing to push")
    mobility = J @ np.linalg.solve(model.mass_matrix(live.q), J.T)
    return float(1 / np.linalg.eigvalsh(mobility)[-1])


def _free_name(scene: Any) -> str:
    name = NAME
    while name in scene.effects:
        name += "_"
    return name
