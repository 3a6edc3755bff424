"""A scene: a model and the effects that act on it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..arguments import chosen, moment, one_number, text
from ..closed import Closed
from ..models.grafting import Grafting
from ..models.warning import warn
from ..models.with_operators import WithOperators
from ..other_names import Renamed
from ..state import at_state, moment_of
from .crossed_limits import warn_of_crossed_limits
from .effects import Effect, Gravity, Limits, PointMassGravity, UserEffect
from .effects.meanings import Meanings, acted_on
from .explain import plan_text
from .filed import Filed
from .measurements import Measurements
from .off_loops import warn_off_the_loops
from .run import Run
from .scene_on_loops import OnLoops
from .scene_statics import Statics
from .simulation import RunOptions, resume, simulate
from .viewed import Viewed


@dataclass(frozen=True)
class Evaluation:
    """Accelerations and forces of a scene at one state.

    Attributes
    ----------
    vdot : (nv,) rad/s² and m/s²
    forces : by effect, (nv,) generalized forces: also of gravity, the required forces of prescribed motion, inertial forces of rotors.
        Their sum is the inverse dynamics of the model without gravity at vdot.
    passes : count of each pass of the plan
    """

    vdot: np.ndarray
    forces: dict[str, np.ndarray]
    passes: dict[str, int]


class Effects(Mapping[str, Effect]):
    """The effects of a scene by name, in the order they were added."""

    def __init__(self, entries: dict[str, tuple[Effect, bool]], scene: Scene):
        self._entries, self._scene = entries, scene

    def __getitem__(self, name: str) -> Effect:
        try:
            return self._entries[name][0]
        except KeyError:
            raise KeyError(self._scene._unknown(name)) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._entries)

    def __repr__(self) -> str:
        return "{" + ", ".join(self._entries) + "}"


class Scene(Measurements, Statics, OnLoops, Filed, Viewed, Closed, Renamed):
    """A model and the effects that act on it. It starts empty: only added effects act, so not even the model's own gravity does.

    A scene without a gravity effect warns once (ModelWarning) if the model's gravity is set.

    Parameters
    ----------
    model : Multibody
    form, refine, residual, precision : options of the solution for accelerations, as in `Multibody.forward_dynamics`; precision "double",
        "extended" or "quad", of everything in a scene

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.chain(2)
    >>> scene = pc.Scene(arm).add(pc.effects.Gravity(g=(0, -9.81, 0)), pc.effects.Damping(0.1))
    >>> scene
    <scene of 'chain of 2 rods': gravity, damping>
    >>> run = scene.simulate(1.0)
    >>> energy = run.energy["kinetic"] + run.energy["potential"] - run.energy["work"].sum(axis=1)
    >>> bool(np.ptp(energy) < 1e-7)
    True
    """

    _of = "Scene"

    def __init__(self, model: Any, *, form: str = "fast", refine: Any = 0, residual: str = "same", precision: Any = "double"):
        if not isinstance(model, _core.Multibody):
            raise _core.ModelError(f"Scene takes a model, not {model!r:.80}")
        self._model: Any = model
        self._entries: dict[str, tuple[Effect, bool]] = {}
        self._meanings = Meanings()
        self._how = (form, _core.checked_refinement(refine, chosen(residual, "residual"), precision), residual, precision)
        self._built: tuple[Any, Any] | None = None
        self._last_run: Run | None = None
        self._gravity_said = self._limits_said = self._stiffness_said = False
        self._doubts_said: set[str] = set()
        self._calls()
        if isinstance(model, Grafting):
            model._used_by(self)
        if isinstance(model, WithOperators):
            model.warn()

    # ------------------------------------------------------------------ effects
    @property
    def model(self) -> Any:
        """The model."""
        return self._model

    @property
    def effects(self) -> Effects:
        """The effects by name."""
        return Effects(self._entries, self)

    def add(self, *effects: Any, name: str | None = None) -> Scene:
        """Add effects, in their order; returns the scene.

        Parameters
        ----------
        effects : effects of `pycraft.effects`, or callables (t, state) -> forces (`UserEffect`)
        name : name of a single effect; default: its kind ("damping"), with a number if that is used already ("damping_2")

        Raises
        ------
        ModelError
            Unknown names of the model, with the nearest; invalid values; a name already in use; two effects that
            claim the same coordinate. The scene is then unchanged.
        """
        if name is not None and len(effects) != 1:
            raise _core.ModelError(f"name={name!r} names one effect, but {len(effects)} were given")
        before, core = dict(self._entries), self._fresh_core()
        try:
            for given in effects:
                effect = given if isinstance(given, Effect) else _of_function(given)
                called = core.add("" if name is None else text(name, "an effect"), effect.made_for(self._model), True)
                self._entries[called] = (effect, True)
                self._meanings.keep(called, effect, self._model)
        except BaseException:
            self._entries.clear()
            self._entries.update(before)
            raise
        self._built = None
        return self

    def _effects_on(self, names: set[str]) -> dict[str, list[str]]:
        """Return effects that name one of these bodies, hinges, coordinates or nodes, each with the names."""
        found = {name: sorted(effect.named() & names) for name, (effect, _) in self._entries.items()}
        return {name: named for name, named in found.items() if named}

    def _by_coordinate(self, hinges: set[str]) -> dict[str, list[str]]:
        """Return effects with separate values for coordinates of these hinges, each with the hinges; "" means all, in order."""
        found = {name: sorted(effect.by_coordinate() & hinges, reverse=True) for name, (effect, _) in self._entries.items()}
        return {name: named for name, named in found.items() if named}

    def _acting_on(self, coordinates: set[int]) -> list[str]:
        """Return effects that act directly on one of these coordinates."""
        return [name for name, (effect, _) in self._entries.items() if acted_on(effect, self._model) & coordinates]

    def _enter(self, name: str | None, effect: Effect, on: bool) -> None:
        """Add an effect under a name, on or off."""
        called = self._fresh_core().add(name or "", effect.made_for(self._model), on)
        self._entries[called] = (effect, on)
        self._meanings.keep(called, effect, self._model)
        self._built = None

    def remove(self, *names: Any) -> Scene:
        """Remove effects, given by name or as objects; return the scene."""
        for name in [self._name(name) for name in names]:
            del self._entries[name]
            self._meanings.forget(name)
        self._built = None
        return self

    def enable(self, *names: Any) -> Scene:
        """Turn effects on, given by name or as objects. Raises ModelError if another effect that is on claims the same coordinate."""
        return self._turn(names, True)

    def disable(self, *names: Any) -> Scene:
        """Turn effects off, given by name or as objects: they stay in the scene and cost nothing."""
        return self._turn(names, False)

    def is_on(self, name: Any) -> bool:
        """Return True if an effect is on."""
        return self._entries[self._name(name)][1]

    def _turn(self, names: tuple[Any, ...], on: bool) -> Scene:
        called = [self._name(name) for name in names]
        if on:
            core = self._fresh_core()
            for name in called:
                core.set_on(name, True)
        for name in called:
            self._entries[name] = (self._entries[name][0], on)
        self._built = None
        return self

    def _name(self, of: Any) -> str:
        for name, (effect, _) in self._entries.items():
            if of is effect or (isinstance(effect, UserEffect) and of is effect.function) or (isinstance(of, str) and of == name):
                return name
        raise _core.ModelError(self._unknown(of))

    def _unknown(self, name: Any) -> str:
        from difflib import get_close_matches

        near = get_close_matches(name, list(self._entries), 1, 0.0) if isinstance(name, str) else []
        return f"the scene of {self._model.name!r} has no effect {name!r}" + (f"; did you mean {near[0]!r}?" if near else "")

    # ------------------------------------------------------------------ the core's own
    def _fresh_core(self) -> _core.SceneEffects:
        core = _core.SceneEffects(self._model)
        for name, (effect, on) in self._entries.items():
            core.add(name, effect.made_for(self._model), on)
            self._meanings.keep(name, effect, self._model)
        return core

    def _calls(self) -> _core.SceneCalls:
        """Return the compiled calls, rebuilt after changes of effects or the model."""
        now = (
            self._model._parameters,
            self._how,
            tuple((name, id(effect), effect._changes, on) for name, (effect, on) in self._entries.items()),
            self._loops_now(),
        )
        if self._built is None or self._built[0] != now:
            form, refine, residual, precision = self._how
            self._built = (now, _core.SceneCalls(self._fresh_core(), form, refine, residual, precision))
        return self._built[1]

    def _warn_of_gravity(self) -> None:
        """Warn once for each scene that the model's own gravity is set but the scene has no gravity effect."""
        if self._gravity_said or not any(self._model.gravity):
            return
        if any(isinstance(effect, (Gravity, PointMassGravity)) for effect, _ in self._entries.values()):
            return
        self._gravity_said = True
        g = ", ".join(f"{x:g}" for x in self._model.gravity)
        warn(
            f"the gravity of {self._model.name!r}, ({g}) m/s², does not act in this scene: only effects act there. Add "
            "pc.effects.Gravity(), which takes the model's gravity, or set model.gravity to zero"
        )

    def _stops(self) -> tuple[Limits, ...]:
        """Return the effects that are on and hold limits."""
        return tuple(effect for effect, on in self._entries.values() if on and isinstance(effect, Limits))

    def _warn_of_limits(self, run: Run) -> None:
        """Warn once for each scene of coordinates that left limits that no effect holds."""
        if not self._limits_said and run.crossed_limits:
            self._limits_said = True
            warn_of_crossed_limits(self._model.name, run.crossed_limits)

    # ------------------------------------------------------------------ states and runs
    def evaluate(self, q=None, v=None, t: float | None = None, *, states=None, step: float = 0.0) -> Evaluation:
        """Evaluate accelerations and forces at a state.

        Parameters
        ----------
        q, v : (nq,), (nv,), by the rule of direct calls; with an array q and no v the model is at rest, and no pass that needs
            velocities runs
        t : s; default: the time of the run's state given as q, else 0
        states : the effects' own states; default: the states of the run given as q, else the initial ones
        step : s
            Return accelerations of an implicit step of this size: implicit damping and stiffness add h C + h² K to D.

        Raises
        ------
        ModelError
            q or v of another size, not finite.
        EvaluationError
            An effect with forces that are not finite, by name, with the time; a time that is not finite.
        SingularHingeError
            As for forward dynamics.

        Warns
        -----
        ModelWarning
            A state that is off kept loops, or moves off them, with the row and the distance; none for loops with Baumgarte gains.
        """
        self._warn_of_gravity()
        resting = v is None and q is not None and not hasattr(q, "v")
        t, states = moment_of(q, t, states)
        q, v = at_state(self._model, q, v)
        own = [] if states is None else np.asarray(_core.real_array(states, "states")).tolist()
        found = self._calls().evaluate(q, None if resting else v, moment(t), own, one_number(step, "step"))
        warn_off_the_loops(self._model, [effect for effect, on in self._entries.values() if on], q, None if resting else v)
        return Evaluation(found["vdot"], found["forces"], found["passes"])

    def simulate(
        self,
        T: float,
        q=None,
        v=None,
        *,
        integrator: str = "auto",
        rtol: float = 1e-9,
        atol: float = 1e-12,
        step: float | None = None,
        max_step: float | None = None,
        t_eval=None,
        events=None,
        energy: bool = True,
        normalise: str = "never",
        progress: bool = True,
        dense: bool = True,
        output=None,
    ) -> Run:
        """Simulate the motion from a state at t = 0 to T.

        Parameters
        ----------
        T : s
        q, v : (nq,), (nv,) at t = 0, by the rule of direct calls; prescribed coordinates are their motion's
        integrator : {"auto", "dopri5", "dop853", "rosenbrock4", "rkmk4", "semi-implicit-euler", "variational2", "DOP853", "cvode", ...}
            docs/simulation.md explains the choice. "auto" equals "dopri5", bit for bit, until the motion becomes stiff, and uses
            "rosenbrock4" as long as it is; "variational2" and "variational4" are for long runs; "semi-implicit-euler" (order 1) adds
            implicit damping and stiffness to D: stable for any values, while explicit stiffness still limits the step.
        rtol, atol : tolerances on the error of one step, per component of q, v and the effects' own states
        step : s
            Size of fixed steps; for other integrators the first step, chosen automatically by default.
        max_step : s, longest controlled step; None: no limit
        t_eval : (K,) s, rising, within 0 to T; default: the end of every step
        events : a function (t, state) -> float whose zeros are located, an `Event`, a list of either, or a dictionary by name
            Functions may have SciPy's attributes `direction` and `terminal`. `Run.events` holds the states at the zeros.
        energy : bool
            True records the work of each effect, for `Run.energy`.
        normalise : {"never", "each step"}
            "each step" sets quaternions to unit length after each step.
        progress : bool
            True shows the progress of a run longer than a second, in a terminal or notebook.
        dense : bool
            True keeps the ends of all steps in addition to t_eval, for `Run.at`; without t_eval they are always kept.
        output : path of a file for the run, ending in ".nc", ".parquet" or ".csv"; checked before the run

        Raises
        ------
        EvaluationError
            Unknown names, times out of order, tolerances below the precision, an integrator unsuited to an effect or the precision
            (both are named); a step size that falls to rounding or a state that is not finite, with the time and the coordinate; an
            effect with forces that are not finite, by name, with the time; an event that returns no number.
        SingularHingeError
            As for forward dynamics, with the time.
        OSError
            An output that cannot be written.

        After an error or Ctrl-C, the attribute `run` of the exception, and `scene.last_run`, hold the run computed so far.
        """
        options = RunOptions.checked(integrator, rtol, atol, step, max_step, normalise, energy)
        return simulate(self, T, q, v, options, t_eval=t_eval, events=events, progress=bool(progress), dense=bool(dense), output=output)

    def resume(self, checkpoint, T: float, *, t_eval=None, events=None, progress: bool = True, dense: bool = True, output=None) -> Run:
        """Resume the motion from a checkpoint to T, with the checkpoint's integrator, tolerances and recorded works.

        For one-step methods the result equals an uninterrupted run bit for bit, except for "bulirsch-stoer", which remembers the best
        order, and for integrators of other packages. The first state is the checkpoint's: if the end of a run cut its last step short,
        the start of that step, which is repeated. Works continue from their former values.

        Parameters
        ----------
        checkpoint : Checkpoint, a run with one, or the path of a saved one
        T : s, later than the checkpoint
        t_eval, events, progress, dense, output : as for `simulate`; give the same events, in the same order

        Raises
        ------
        ModelError
            A checkpoint of another scene: with another model's name, other active effects, or another precision.
        EvaluationError
            As for `simulate`; a file without a checkpoint.
        """
        return resume(self, checkpoint, T, t_eval=t_eval, events=events, progress=bool(progress), dense=bool(dense), output=output)

    @property
    def last_run(self) -> Run | None:
        """The last run, even if an error or Ctrl-C ended it; None before the first."""
        return self._last_run

    def _names_on(self) -> list[str]:
        return [name for name, (_, on) in self._entries.items() if on]

    # ------------------------------------------------------------------ what it is
    def explain(self, at: str = "motion") -> str:
        """Return the plan as a table: the passes of an evaluation, the work of each, and the effects that need it.

        at : {"motion", "rest", "works"}: in motion, at rest, or in a run that records works
        """
        if at not in ("motion", "rest", "works"):
            raise _core.EvaluationError(f"at={at!r}: there are 'motion', 'rest' and 'works'")
        off = [name for name, (_, on) in self._entries.items() if not on]
        return plan_text(self._model.name, self._calls().plan(at), off, self._how)

    def __repr__(self) -> str:
        shown = [name if on else f"({name} off)" for name, (_, on) in self._entries.items()]
        return f"<scene of {self._model.name!r}: {', '.join(shown) or 'empty'}>"

    def __str__(self) -> str:
        lines = [f"scene of {self._model.name!r}"]
        entries = [(name, self._shown(effect), on) for name, (effect, on) in self._entries.items()]
        lines += [f"  {'on ' if on else 'off'} {name}: {effect!r}" for name, effect, on in entries]
        return "\n".join(lines if self._entries else [*lines, "  empty"])

    def _shown(self, effect: Effect) -> Effect:
        """Return an effect with the values taken from the model; unchanged if an edit of the model removed a name that it uses."""
        try:
            return effect.completed_for(self._model)
        except _core.ModelError:
            return effect

    # ------------------------------------------------------------------ copies
    def __reduce__(self):
        return _again, (type(self), self._model, list((name, effect, on) for name, (effect, on) in self._entries.items()), self._how), {
            "_run_options": self._run_options, "_gravity_said": self._gravity_said, "_limits_said": self._limits_said,
            "_stiffness_said": self._stiffness_said,
        }  # fmt: skip


def _of_function(given: Any) -> UserEffect:
    """Return the effect of a user's function. Raises ModelError for objects that are neither effects nor functions."""
    if isinstance(given, type) and issubclass(given, Effect):
        got = f"the class {given.__name__} (forgotten parentheses?)"
    elif isinstance(given, type):
        got = f"the class {given.__name__}; give an object of it"
    elif isinstance(given, (list, tuple)):
        got = f"a {type(given).__name__}; write add(*effects) to add each of its items"
    elif callable(given):
        return UserEffect(given)
    elif isinstance(given, str):
        got = f"the string {given!r:.80}"
    else:
        got = f"{given!r:.80}"
    raise _core.ModelError(f"add() takes an effect, such as pc.effects.Gravity(), or a function f(t, state) -> forces; got {got}")


def _again(kind: type[Scene], model: Any, entries: list[tuple[str, Effect, bool]], how: tuple[Any, ...]) -> Scene:
    form, refine, residual, precision = how
    scene = kind(model, form=form, refine=refine, residual=residual, precision=precision)
    scene._entries.update({name: (effect, on) for name, effect, on in entries})
    return scene
