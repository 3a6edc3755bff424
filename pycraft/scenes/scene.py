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
    """What a scene says of one state.

    Attributes
    ----------
    vdot : (nv,) rad/s² and m/s²
    forces : by effect, (nv,) generalized forces: gravity's too, of prescribed motion what it needs, of rotors what they take. Their sum is
        what inverse dynamics of the model without gravity gives at vdot.
    passes : how often each pass of the plan ran
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
    """A model and the effects that act on it. It starts empty: only added effects act, and not even the model's own gravity does.

    A model whose gravity is set and a scene without a gravity effect are told apart once, by a ModelWarning.

    Parameters
    ----------
    model : Multibody
    form, refine, residual, precision : how accelerations are solved for, as in `Multibody.forward_dynamics`; precision "double",
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
            raise _core.ModelError(f"a scene is of a model, not of {model!r:.80}")
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
        name : of a single one; its kind's by default ("damping"), with a number where that is taken ("damping_2")

        Raises
        ------
        ModelError
            Names of the model that are not there, with the nearest; numbers that make no sense; a name that is taken; two effects that
            claim the same coordinate. The scene is then as it was.
        """
        if name is not None and len(effects) != 1:
            raise _core.ModelError(f"name={name!r} is of one effect, not of {len(effects)}")
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
        """Effects that name one of these bodies, hinges, coordinates or nodes, each with those that it names."""
        found = {name: sorted(effect.named() & names) for name, (effect, _) in self._entries.items()}
        return {name: named for name, named in found.items() if named}

    def _by_coordinate(self, hinges: set[str]) -> dict[str, list[str]]:
        """Effects that take coordinates of one of these hinges one by one, each with those hinges; "" is all, in their order."""
        found = {name: sorted(effect.by_coordinate() & hinges, reverse=True) for name, (effect, _) in self._entries.items()}
        return {name: named for name, named in found.items() if named}

    def _acting_on(self, coordinates: set[int]) -> list[str]:
        """Effects that act on one of these coordinates as such."""
        return [name for name, (effect, _) in self._entries.items() if acted_on(effect, self._model) & coordinates]

    def _enter(self, name: str | None, effect: Effect, on: bool) -> None:
        """One effect as a file has it, on or off."""
        called = self._fresh_core().add(name or "", effect.made_for(self._model), on)
        self._entries[called] = (effect, on)
        self._meanings.keep(called, effect, self._model)
        self._built = None

    def remove(self, *names: Any) -> Scene:
        """Take effects out, by name or themselves; returns the scene."""
        for name in [self._name(name) for name in names]:
            del self._entries[name]
            self._meanings.forget(name)
        self._built = None
        return self

    def enable(self, *names: Any) -> Scene:
        """Turn effects on, by name or themselves. ModelError where another that is on claims the same coordinate."""
        return self._turn(names, True)

    def disable(self, *names: Any) -> Scene:
        """Turn effects off, by name or themselves: they stay in the scene and cost nothing."""
        return self._turn(names, False)

    def is_on(self, name: Any) -> bool:
        """Whether an effect is on."""
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
        """What computes, made anew where effects or the model have changed."""
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
        """Warn, once for each scene, that the model's own gravity is set and no effect of this scene is a gravity."""
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
        """The effects on that hold limits."""
        return tuple(effect for effect, on in self._entries.values() if on and isinstance(effect, Limits))

    def _warn_of_limits(self, run: Run) -> None:
        """Warn, once for each scene, of coordinates that left limits which no effect holds."""
        if not self._limits_said and run.crossed_limits:
            self._limits_said = True
            warn_of_crossed_limits(self._model.name, run.crossed_limits)

    # ------------------------------------------------------------------ states and runs
    def evaluate(self, q=None, v=None, t: float | None = None, *, states=None, step: float = 0.0) -> Evaluation:
        """Accelerations and forces at a state.

        Parameters
        ----------
        q, v : (nq,), (nv,), by the rule of direct calls; beside an array q without v the model is at rest, and no pass that needs
            velocities runs
        t : s; where left out that of the run's state that q is, else 0
        states : of the effects' own; where left out those of the run's state that q is, else as they are at first
        step : s
            Accelerations of an implicit step of this size: D has h C + h² K of implicit damping and stiffness in addition.

        Raises
        ------
        ModelError
            q or v of another size, not finite.
        EvaluationError
            An effect whose forces are not finite, by name, with the time; a time that is not.
        SingularHingeError
            As forward dynamics.

        Warns
        -----
        ModelWarning
            A state that is off loops which are kept, or moves off them, with the row and how far; none where gains draw it back.
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
        """The motion from a state at t = 0 to T.

        Parameters
        ----------
        T : s
        q, v : (nq,), (nv,) at t = 0, by the rule of direct calls; prescribed coordinates are their motion's
        integrator : {"auto", "dopri5", "dop853", "rosenbrock4", "rkmk4", "semi-implicit-euler", "variational2", "DOP853", "cvode", ...}
            docs/simulation.md says when to take which. "auto" is "dopri5", bit for bit, until the motion becomes stiff, and "rosenbrock4"
            as long as it is; "variational2" and "variational4" are for long runs; "semi-implicit-euler" (order 1) takes implicit damping
            and stiffness into D: stable for any, while explicit stiffness beside them bounds the step.
        rtol, atol : tolerances on the error of one step, per component of q, v and the effects' own states
        step : s
            Of one-size steps; the first step of the others, chosen if left out.
        max_step : s, no controlled step is longer; None: any
        t_eval : (K,) s, rising, from 0 to T at most; the end of every step where left out
        events : a function (t, state) -> float whose zeros are looked for, an `Event`, a list of either, or a dictionary by name
            Functions may have SciPy's attributes `direction` and `terminal`. `Run.events` has the states at the zeros.
        energy : bool
            Whether the work of each effect is kept account of, for `Run.energy`.
        normalise : {"never", "each step"}
            Whether quaternions are set to unit length after each step.
        progress : bool
            Whether a run of more than a second shows how far it is, in a terminal or notebook.
        dense : bool
            Whether the ends of all steps are kept beside the times of t_eval, for `Run.at`; without t_eval they are.
        output : path that ends in ".nc", ".parquet" or ".csv", where the run is written; refused before the run if it cannot be

        Raises
        ------
        EvaluationError
            Unknown names, times out of order, tolerances below the precision, an integrator that does not fit an effect or the precision
            (both are named); the time where the step size falls to rounding or the state is no longer finite, with the coordinate; an
            effect whose forces are not finite, by name, with the time; an event that gives no number.
        SingularHingeError
            Of forward dynamics, with the time.
        OSError
            An output that cannot be written.

        What was computed before an error or Ctrl-C is the error's attribute `run`, and `scene.last_run`.
        """
        options = RunOptions.checked(integrator, rtol, atol, step, max_step, normalise, energy)
        return simulate(self, T, q, v, options, t_eval=t_eval, events=events, progress=bool(progress), dense=bool(dense), output=output)

    def resume(self, checkpoint, T: float, *, t_eval=None, events=None, progress: bool = True, dense: bool = True, output=None) -> Run:
        """The motion goes on from a checkpoint to T, with the integrator, tolerances and accounts that it has.

        For one-step methods it is bit for bit what a run to T would have been, but for "bulirsch-stoer", which remembers what order was
        best, and for integrators of other packages. The first state is the checkpoint's: where the end of a run cut its last step short,
        the start of that step, which is taken again. Works go on from what they were.

        Parameters
        ----------
        checkpoint : Checkpoint, a run that has one, or the path of a saved one
        T : s, later than the checkpoint
        t_eval, events, progress, dense, output : as `simulate` takes them; give the same events, in the same order

        Raises
        ------
        ModelError
            A checkpoint of another scene: another model's name, other effects that are on, another precision.
        EvaluationError
            As `simulate`; a file that holds no checkpoint.
        """
        return resume(self, checkpoint, T, t_eval=t_eval, events=events, progress=bool(progress), dense=bool(dense), output=output)

    @property
    def last_run(self) -> Run | None:
        """The last run, also one that an error or Ctrl-C ended; None before the first."""
        return self._last_run

    def _names_on(self) -> list[str]:
        return [name for name, (_, on) in self._entries.items() if on]

    # ------------------------------------------------------------------ what it is
    def explain(self, at: str = "motion") -> str:
        """The plan as a table: the passes of an evaluation, what each does, and the effects that it is there for.

        at : {"motion", "rest", "works"}: of a motion, of a state at rest, of a run that keeps account of works
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
        """An effect with the values that it takes from the model; as it is where an edit of the model took what it names."""
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
    """An effect of a user's function. ModelError for what is neither an effect nor a function."""
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
