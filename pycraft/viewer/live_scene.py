"""A scene with a present state, which advances in time, is moved by hand, and continues after its effects were changed."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..dynamics.integrator_names import integrator_named
from ..dynamics.interbody import forces_of_scene
from ..scenes.simulation import RunOptions, continued
from ..view.figure_data import pose_rows
from ..view.skeleton import Skeleton

OPTIONS = ("integrator", "rtol", "atol", "step")
"""Options of a scene's `run_options` used while it advances; the others apply only to whole runs."""
_INSTANT = 1e-9
"""Duration, s, of a run made only to get the initial states of effects."""
_REACH, _MOST = 0.05, 200
"""Step, rad or m, of a coordinate that loops follow, and the largest number of steps."""


class LiveScene:
    """A scene, its present time and state, and the data that the page shows.

    Coordinates u (nv,) are displacements from the neutral configuration on the configuration group: the coordinates of pins, sliders
    and screws themselves, rotation vectors of balls, twists of free hinges.

    Attributes
    ----------
    scene : Scene
    t : s
    q, v : (nq,), (nv,)
    work : J, work of all effects since the state was last set
    skeleton : Skeleton
    pushed : Scene or None
        Scene used while a body is pushed: the effects of `scene`, followed by the push.
    """

    def __init__(self, scene: Any, q: Any = None, v: Any = None):
        self.scene, self.model = scene, scene.model
        self.skeleton = Skeleton(self.model)
        self.options = self._options()
        self._first = (self.model.q if q is None else q, self.model.v if v is None else v)
        self.t = 0.0
        self.pushed: Any = None
        self.reset()

    @property
    def acting(self) -> Any:
        """The scene with the acting effects: `pushed`, or `scene`."""
        return self.scene if self.pushed is None else self.pushed

    def _options(self) -> RunOptions:
        told = {"integrator": "auto", "rtol": 1e-7, "atol": 1e-10, "step": None, **self.scene.run_options}
        integrator, rtol, atol, step = (told[name] for name in OPTIONS)
        normalise = "never" if integrator_named(integrator).foreign else "each step"  # otherwise quaternions would drift within an hour
        return RunOptions.checked(integrator, rtol, atol, step, None, normalise, energy=True)

    # ------------------------------------------------------------------ the present state
    def reset(self) -> None:
        """Return to the first state, at t = 0."""
        self.put(*self._first, t=0.0)

    def put(self, q: Any, v: Any, t: float | None = None) -> None:
        """Set the state; the effects' own states restart, and works are counted from here."""
        self.model.check_q(q)
        self.q, self.v = np.array(q, float), np.array(v, float)
        self.t = self.t if t is None else t
        self._kept: dict[str, np.ndarray] = {}
        self.work = 0.0

    def put_as(self, other: LiveScene) -> None:
        """Take the state and time of another live scene, if the models have the same coordinates."""
        if self.model.nq == other.model.nq and self.model.coordinate_names == other.model.coordinate_names:
            self.put(other.q, other.v, other.t)

    @property
    def u(self) -> np.ndarray:
        """Coordinates (nv,), rad and m, from the neutral configuration."""
        return self.model.difference(self.model.zero_q(), self.q)

    def move(self, coordinate: int, to: float) -> None:
        """Set one coordinate of `u`, at rest. With loops the other coordinates follow in small steps, to stay on the same branch.

        Raises ModelError where the loops stop the motion; the state is then the last one reached.
        """
        first = self.u[coordinate]
        count = max(1, int(np.ceil(abs(to - first) / _REACH))) if len(self.model.loops) else 1
        for value in np.linspace(first, to, min(count, _MOST) + 1)[1:]:
            u = self.u
            u[coordinate] = value
            q = self.model.integrate(self.model.zero_q(), u)
            self.put(self._on_loops(q, self._hinge_of(coordinate), starts=1), np.zeros(self.model.nv))

    def rest_at(self, q: np.ndarray) -> None:
        """Set a configuration, or one near it that closes the loops, at rest."""
        self.put(self._on_loops(q, (), starts=20), np.zeros(self.model.nv))

    def _on_loops(self, q: np.ndarray, fix: Any, starts: int) -> np.ndarray:
        return self.model.assemble(q, np.zeros(self.model.nv), fix=fix, starts=starts).q if len(self.model.loops) else q

    def _hinge_of(self, coordinate: int) -> Any:
        """Return the coordinates to hold while loops are closed: the coordinate itself, or for a rotation all of its hinge."""
        for name, hinge in self.model.hinges.items():
            if hinge.v_slice.start <= coordinate < hinge.v_slice.stop:
                turns = hinge.q_slice.stop - hinge.q_slice.start != hinge.v_slice.stop - hinge.v_slice.start
                return [name] if turns else [self.model.coordinate_names[coordinate]]
        return ()

    # ------------------------------------------------------------------ time
    def advance(self, seconds: float) -> None:
        """Advance by some seconds. If the run raises an error, the state is unchanged."""
        run = continued(self.acting, self.t, self.t + seconds, self.q, self.v, self.own_states(), self.options)
        self.t, self.q, self.v = float(run.t[-1]), run.q[-1], run.v[-1]
        self.work += float(run._work[-1].sum())
        self._keep(run.states[-1])

    # ------------------------------------------------------------------ data for the page
    def along(self) -> dict[str, np.ndarray]:
        """Return accelerations "vdot" (nv,), "forces" (effects, nv), "kinetic", "potential" (effects,) at the state."""
        found = self.acting._calls().along(*self._row())
        return {name: x[:, 0] if name == "forces" else x[0] for name, x in found.items()}

    def own_states(self) -> np.ndarray:
        """Return the effects' own states, one effect after another; the initial states of effects that have none yet."""
        counts = self.acting._calls().states
        if not sum(counts):
            return np.zeros(0)
        names = self.acting._names_on()
        if any(count and len(self._kept.get(name, ())) != count for name, count in zip(names, counts, strict=True)):
            first = continued(self.acting, self.t, self.t + _INSTANT, self.q, self.v, [], self.options).states[0]
            known, self._kept = self._kept, {}
            self._keep(first)
            self._kept.update({name: own for name, own in known.items() if len(self._kept.get(name, ())) == len(own)})
        return np.concatenate([self._kept[name] for name in names])

    def _keep(self, states: np.ndarray) -> None:
        ends = np.cumsum(self.acting._calls().states)
        self._kept.update(zip(self.acting._names_on(), np.split(states, ends[:-1]), strict=False))

    def _row(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        return np.array([self.t]), self.q[None], self.v[None], self.own_states()[None]

    def poses(self) -> np.ndarray:
        """Return the poses of the bodies, rows of [R p], (12 n,)."""
        return pose_rows(self.skeleton, self.q)

    def velocities(self) -> list[tuple[list[float], list[float]]]:
        """Return centres of mass and their velocities, m and m/s, in the world. O(N)."""
        owners, places = self.skeleton.points["mass"]
        if not self.model.nv or not len(owners):
            return []
        soa = self.model.soa
        V = ((soa.phi.T @ soa.H.T).at(self.q) @ self.v).reshape(-1, 6)[owners]
        poses = self.skeleton.poses(self.q)[owners]
        linear = np.einsum("kij,kj->ki", poses[:, :3, :3], V[:, 3:] + np.cross(V[:, :3], places))
        at = np.einsum("kij,kj->ki", poses[:, :3, :3], places) + poses[:, :3, 3]
        return list(zip(at.tolist(), linear.tolist(), strict=True))

    def forces(self) -> list[tuple[list[float], list[float]]]:
        """Return hinge points and the forces of the hinges on the bodies there, m and N, in the world. O(N)."""
        f = forces_of_scene(self.acting._calls(), self.model, *self._row(), None, "world", None, "whole")[0]
        owners, places = self.skeleton.points["joint"]
        poses = self.skeleton.poses(self.q)[owners]
        at = np.einsum("kij,kj->ki", poses[:, :3, :3], places) + poses[:, :3, 3]
        return list(zip(at.tolist(), f[:, 3:].tolist(), strict=True))


def without(scene: Any, name: str) -> Any:
    """Return a scene with one effect off. It shares the model and the effects, and so follows their changes."""
    return scene_again(scene, off=name)


def scene_again(scene: Any, off: str = "") -> Any:
    """Return another scene that shares the model and the effects, with one effect off; more effects can be added to it alone."""
    form, refine, residual, precision = scene._how
    other = type(scene)(scene.model, form=form, refine=refine, residual=residual, precision=precision)
    other.run_options = scene.run_options
    for called, effect in scene.effects.items():
        other._enter(called, effect, scene.is_on(called) and called != off)
    return other
