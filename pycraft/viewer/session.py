"""Requests and actions of the viewer's pages: a scene that plays, a ghost beside it, and the data shown of both."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number
from ..models.limits import coordinate_limits
from ..scenes.coordinate_units import coordinate_units
from ..view.figure_data import figure_data, number_text
from ..view.shares import share_values
from .effect_fields import set_field, shown_fields
from .extras import Extras
from .hands import Push, given_place, lead
from .inspection import LETTERS, blocks_of, body_numbers
from .live_scene import LiveScene, without

PIECE = 1 / 60
"""Time, s, between two readings of the clock while the scene plays."""
LATE = 0.1
"""Largest delay, s, that is caught up: a scene that cannot keep up plays slower."""
UNSEEN = 10.0
"""Time, s, without a request after which the scene stops playing."""
SCALES = (1e-3, 1e3)
DIRECTIONS = ("from above", "side", "front", "back", "top")
"""Directions of view: VIEWS of `web/figure.js`."""
SEEN_STATES = 8
"""Number of random states that the first view includes, with the present and the neutral state."""


class Session:
    """A scene in the viewer. A lock serializes all calls: the pages' threads and the playing thread share the session.

    Parameters
    ----------
    scene : Scene
    beside : Scene, optional
        A second scene, drawn as a ghost, which plays along: from the same state, if its coordinates are the same.
    """

    def __init__(self, scene: Any, beside: Any = None, q: Any = None, v: Any = None):
        self.live = LiveScene(scene, q, v)
        self._beside = None if beside is None else LiveScene(beside)
        self.ghost: LiveScene | None = None
        self.ghost_name = ""
        self.lock = threading.RLock()
        self.playing, self.scale, self.rate, self.message = False, 1.0, 0.0, ""
        self._edits, self._asked, self._seeds = 0, time.monotonic(), 0
        self.extras = Extras()
        self.camera: dict[str, Any] | None = None
        self._push: Push | None = None
        self._ended = threading.Event()
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._play, name="pycraft viewer", daemon=True)
        if self._beside is not None:
            self._set_ghost("beside")
        self._thread.start()

    # ------------------------------------------------------------------ data for the pages
    def setup(self) -> dict[str, Any]:
        """Return the data that do not change with time: the figure, the coordinates, effects with their parameters, letters."""
        with self.lock:
            live, model = self.live, self.live.model
            states = np.array([live.q, model.zero_q(), *self._random_states()])
            ghost = self.ghost
            other = None if ghost is None else figure_data(ghost.skeleton, np.array([ghost.q]))
            names = list(live.scene.effects)
            return {
                "edits": self._edits, "figure": figure_data(live.skeleton, states), "ghost": other, "coordinates": self._coordinates(),
                "effects": [{"name": name, "kind": type(live.scene.effects[name]).__name__, "on": live.scene.is_on(name),
                             "fields": shown_fields(live.scene.effects[name], live.model)} for name in names],
                "ghosts": [*(["beside"] if self._beside is not None else []), *(f"without {name}" for name in names)],
                "ghost_name": self.ghost_name, "extras": self.extras.shown(live.skeleton), "camera": self.camera,
                "letters": list(LETTERS), "loops": list(model.loops),
            }  # fmt: skip

    def _random_states(self) -> list[np.ndarray]:
        """Return the configurations that the first view includes; loose bodies keep their present place in all of them."""
        live, model = self.live, self.live.model
        drawn = [np.array(model.random_state(seed).q) for seed in range(SEEN_STATES)]
        roots = [hinge.q_slice for hinge in model.hinges.values() if hinge.kind == "free"]
        for q in drawn:
            for root in roots:
                q[root] = live.q[root]
        return drawn

    def _coordinates(self) -> list[dict[str, Any]]:
        model = self.live.model
        limits, units = coordinate_limits(model), coordinate_units(model)[2]
        reach = float(max(figure_data(self.live.skeleton, model.zero_q())["half"]))
        owners = {j: k for k, hinge in enumerate(model.hinges.values()) for j in range(hinge.v_slice.start, hinge.v_slice.stop)}
        rows = []
        for j, name in enumerate(model.coordinate_names):
            wide = np.pi if units[j] == "rad" else 2 * reach
            low, high = limits.lower[j], limits.upper[j]
            bounded = bool(np.isfinite(low) and np.isfinite(high))
            rows.append({
                "name": name, "unit": units[j], "body": owners[j], "bounded": bounded,
                "lower": float(low) if np.isfinite(low) else None, "upper": float(high) if np.isfinite(high) else None,
                "low": float(low if np.isfinite(low) else min(-wide, high)), "high": float(high if np.isfinite(high) else max(wide, low)),
            })  # fmt: skip
        return rows

    def state(self, arrows: tuple[str, ...] = (), shade: str = "") -> dict[str, Any]:
        """Return the changing data: time, coordinates, poses, energies; on request arrows "velocity" and "force", colours "shares"."""
        with self.lock:
            self._asked = time.monotonic()
            live, ghost = self.live, self.ghost
            found = live.along()
            kinetic, potential = float(found["kinetic"]), float(np.sum(found["potential"]))
            drawn, missing = _arrows(live, arrows)
            shaded, why = _shade(live, shade)
            return _finite({
                "edits": self._edits, "t": live.t, "playing": self.playing, "scale": self.scale, "rate": self.rate, "message": self.message,
                "u": live.u.tolist(), "v": live.v.tolist(), "vdot": found["vdot"].tolist(), "poses": number_text(live.poses()),
                "ghost": None if ghost is None else number_text(ghost.poses()),
                "energy": [kinetic, potential, kinetic + potential - live.work],
                "arrows": drawn, "missing": missing + why, "shade": shaded,
                "push": None if self._push is None else self._push.shown(live),
            })  # fmt: skip

    def body(self, name: str) -> dict[str, Any]:
        """Return the values of one body: M, P, D, its pose, velocity and frames."""
        with self.lock:
            return _finite(body_numbers(self.live, name))

    def blocks(self, letter: str) -> dict[str, Any]:
        """Return the magnitudes of an operator's blocks."""
        with self.lock:
            return _finite(blocks_of(self.live, letter))

    # ------------------------------------------------------------------ actions
    def do(self, action: str, **given: Any) -> None:
        """Do one action by name, with its arguments. Invalid actions raise ModelError or EvaluationError, with the remedy."""
        actions: dict[str, Callable[..., None]] = {
            "play": self._start, "pause": self.pause, "step": self._step, "reset": self._reset, "neutral": self._neutral,
            "random": self._random, "rest": self._rest, "move": self._move, "scale": self._set_scale, "effect": self._turn,
            "parameter": self._set, "ghost": self._set_ghost, "push": self._push_to, "let_go": self._let_go, "lead": self._lead,
        }  # fmt: skip
        if action not in actions:
            raise _core.EvaluationError(f"the viewer has no action {action!r}; choose from {', '.join(actions)}")
        with self.lock:
            self.message = ""
            try:
                actions[action](**given)
            except TypeError as error:
                raise _core.EvaluationError(f"{action}: {error}") from None

    def _start(self) -> None:
        self.playing, self._asked = True, time.monotonic()
        self._wake.set()

    def pause(self) -> None:
        """Stop playing."""
        self.playing, self.rate = False, 0.0

    def _step(self) -> None:
        self.pause()
        self._advance(self.scale / 30)

    def _reset(self) -> None:
        self.live.reset()
        self._ghost_follows()

    def _neutral(self) -> None:
        self._at_rest(self.live.model.neutral())

    def _random(self) -> None:
        self._seeds += 1
        self._at_rest(self.live.model.random_state(self._seeds).q)

    def _rest(self) -> None:
        self._at_rest(self.live.q)

    def _at_rest(self, q: Any) -> None:
        self.live.rest_at(q)
        self._ghost_follows()

    def _move(self, coordinate: Any, to: Any) -> None:
        j, value = int(one_number(coordinate, "coordinate")), one_number(to, "to")
        if not 0 <= j < self.live.model.nv or not np.isfinite(value):
            raise _core.EvaluationError(
                f"move: coordinate {coordinate} to {to}: the model has {self.live.model.nv} coordinates, which take finite values"
            )
        self.live.move(j, value)
        self._ghost_follows()

    def _push_to(self, body: Any, place: Any, to: Any) -> None:
        """Attach a spring from a place of a body to a place in the world until it is released; it acts while the scene plays."""
        name, at, goal = given_place(self.live, body, place, to)
        if self._push is None or self._push.body != name or not np.array_equal(self._push.place, at):
            self._let_go()
            self._push = Push.of(self.live, name, at, goal, self.scale * PIECE)
            self.live.pushed = self._push.scene
        self._push.to = goal
        self._push.act(self.live)

    def _let_go(self) -> None:
        self._push = self.live.pushed = None

    def _lead(self, body: Any, place: Any, to: Any) -> None:
        """Move a place of a body to a place in the world by inverse kinematics, at rest."""
        self.message = lead(self.live, *given_place(self.live, body, place, to))
        self._ghost_follows()

    def look(self, direction: Any, follow: Any, zoom: Any) -> None:
        """Set the direction, the followed body and the zoom of the pages' cameras, until a user moves them."""
        with self.lock:
            bodies = self.live.skeleton.bodies
            if direction not in DIRECTIONS:
                raise _core.EvaluationError(f"direction={direction!r:.60}: choose from {', '.join(map(repr, DIRECTIONS))}")
            called = getattr(follow, "name", follow)
            if called not in (None, "robot", *bodies):
                raise _core.ModelError(f"follow takes 'robot', a body of {self.live.model.name!r} or None, not {called!r:.60}")
            near = one_number(zoom, "zoom")
            if not 0 < near < np.inf:
                raise _core.EvaluationError(f"zoom={near:g}: give a positive number; the initial zoom is 1")
            followed = "" if called is None else "robot" if called == "robot" else str(bodies.index(called))
            self.camera = {"direction": direction, "follow": followed, "zoom": near, "count": self._edits}
            self._edits += 1

    def draw(self, extra: dict[str, Any] | None, name: str = "") -> None:
        """Add a drawing of the user's code to the picture; None removes the drawing of this name, or all."""
        with self.lock:
            self.extras.set(self.live, extra, name)
            self._edits += 1

    def _set_scale(self, to: Any) -> None:
        value = one_number(to, "scale")
        if not SCALES[0] <= value <= SCALES[1]:
            raise _core.EvaluationError(f"scale={value:g}: give seconds of the scene per second, from {SCALES[0]:g} to {SCALES[1]:g}")
        self.scale = value

    def _turn(self, name: Any, on: Any) -> None:
        self._let_go()
        scene = self.live.scene
        if on:
            scene.enable(name)
        else:
            scene.disable(name)
        self._edits += 1
        if self.ghost is not None and self.ghost_name != "beside":
            self._set_ghost(self.ghost_name)

    def _set(self, effect: Any, field: Any, value: Any) -> None:
        self._let_go()
        set_field(self.live.scene, effect, field, value)
        self._edits += 1

    def _set_ghost(self, name: Any) -> None:
        if name == "beside" and self._beside is not None:
            self.ghost = self._beside
        elif isinstance(name, str) and name.startswith("without "):
            self.ghost = LiveScene(without(self.live.scene, name.removeprefix("without ")), self.live.q, self.live.v)
        elif not name:
            self.ghost = None
        else:
            raise _core.ModelError(f"no ghost is called {name!r}; choose 'without EFFECT', or 'beside' if a second scene was given")
        self.ghost_name = name if self.ghost is not None else ""
        self._edits += 1
        self._ghost_follows()

    def _ghost_follows(self) -> None:
        if self.ghost is not None:
            self.ghost.put_as(self.live)

    # ------------------------------------------------------------------ time
    def _advance(self, seconds: float) -> None:
        if self._push is not None:
            self._push.act(self.live)
        self.live.advance(seconds)
        if self.ghost is not None:
            self.ghost.advance(seconds)

    def _play(self) -> None:
        last = time.monotonic()
        while not self._ended.is_set():
            if not self.playing:
                self._wake.wait()
                self._wake.clear()
                last = time.monotonic()
                continue
            time.sleep(PIECE)
            now = time.monotonic()
            with self.lock:
                if self.playing:
                    self._go_on(now - last)
            last = now

    def _go_on(self, elapsed: float) -> None:
        if time.monotonic() - self._asked > UNSEEN:
            self.pause()
            self.message = f"paused: no page has asked for {UNSEEN:g} s"
            return
        seconds = min(elapsed, LATE) * self.scale
        try:
            self._advance(seconds)
        except Exception as error:  # shown in the page: nobody catches errors of a thread
            self.pause()
            self.message = f"stopped at {self.live.t:.4g} s: {error}"
            return
        self.rate = 0.8 * (self.rate or self.scale) + 0.2 * seconds / max(elapsed, 1e-9)

    def close(self) -> None:
        """Stop the playing thread."""
        self._ended.set()
        self._wake.set()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=5)


def _arrows(live: LiveScene, kinds: tuple[str, ...]) -> tuple[dict[str, Any], list[str]]:
    """Return arrows of these kinds, and why others are missing, such as hinge forces in scenes with loops."""
    made, drawn, missing = {"velocity": live.velocities, "force": live.forces}, {}, []
    for kind in kinds:
        try:
            drawn.update({kind: made[kind]()} if kind in made else {})
        except _core.Error as error:
            missing.append(f"no arrows of {kind}: {error}")
    return drawn, missing


def _shade(live: LiveScene, name: str) -> tuple[dict[str, Any] | None, list[str]]:
    """Return the bodies' values that are shown as colours, with their meaning, and why there are none."""
    if name != "shares":
        return None, []
    try:
        values = share_values(live.model, live.q)
    except _core.Error as error:
        return None, [f"no shares: {error}"]
    high = float(values.max(initial=0.0)) or 1.0
    label = f"degrees of freedom by body, tr Υ(k)M(k): {values.sum():.4g} of N = {live.model.nv}"
    return {"values": values.tolist(), "low": 0.0, "high": high, "label": label}, []


def _finite(value: Any) -> Any:
    """Return plain data for JSON, with None for infinities, which JSON lacks."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
