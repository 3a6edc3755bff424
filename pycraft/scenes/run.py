"""The motion of a scene over time."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..other_names import Renamed
from .checkpoint import Checkpoint, coordinates_of
from .crossed_limits import CrossedLimit, crossed_limits, crossed_names, unheld_limits
from .events import EventStates
from .motion import Motion


class Run(Motion, Renamed):
    """States of a scene over time, and quantities computed from them.

    Attributes
    ----------
    t : (K,) s, the requested times, or the ends of all steps
    q, v : (K, nq), (K, nv)
    states : (K, n), the effects' own
    events : states at the events, by name (`EventStates`)
    ended_by : name of the event that ended the run, None if it reached its end
    statistics : evaluations of the accelerations, steps, rejected steps, seconds, linearizations (of integrators that use
        derivatives), solutions (of the equations of a step, for variational integrators), in_packs (accelerations computed together with
        other runs of a sweep), and the count of each pass; "stiffness" if stability limited the steps of an explicit method (t, step,
        rate, effect, coordinate); for "auto" "switches", (t, the method used from then on)

    Quantities computed from the states are computed on first use and cached. After an edit of the model they raise StaleOperatorError,
    because the states belong to the model before the edit.

    Examples
    --------
    >>> import pycraft as pc
    >>> run = pc.mechanisms.double_pendulum().simulate(2.0)
    >>> run.energy["kinetic"].shape == run.t.shape, run.forces["gravity"].shape == run.v.shape
    (True, True)
    >>> run.at(0.7).frame("lower").position.shape
    (3,)
    """

    _of = "Run"

    def __init__(
        self, about: Mapping[str, Any], rows: Mapping[str, np.ndarray], calls: Any = None, *, steps: Mapping[str, np.ndarray] | None = None,
        events: Mapping[str, EventStates] | None = None, ended_by: str | None = None, statistics: Mapping[str, Any] | None = None,
        checkpoint: Checkpoint | None = None,
    ):  # fmt: skip
        super().__init__(about, rows, calls)
        self._steps = None if steps is None else dict(steps)
        self.events, self.ended_by = dict(events or {}), ended_by
        self.statistics = dict(statistics or {})
        self._checkpoint = checkpoint

    @classmethod
    def of_record(
        cls, scene: Any, calls: _core.SceneCalls, record: _core.RunRecord, options: Any, events: list[Any], keep: slice | None
    ) -> Run:
        """Return the run from the core's record."""
        names, integrator, precision = scene._names_on(), options.integrator.name, scene._how[3]
        steps = record.steps
        rows = steps if keep is None else {name: x[keep] for name, x in record.samples.items()}
        about = {
            "model": scene.model, "effects": names, "workers": list(calls.workers), "energy": options.energy, "integrator": integrator,
            "options": options.told, "precision": precision, "stops": scene._stops(), "held": _core.held_states(calls),
        }  # fmt: skip
        kinds = [*record.own_events, *(event.name for event in events)]
        of, states = record.events
        happened = {}
        for name in dict.fromkeys(kinds):
            its = [kinds[i] == name for i in of]
            happened[name] = EventStates(*(states[key][its] for key in ("t", "q", "v", "states")))
        kept = record.checkpoint
        what = scene.model.name, tuple(names), coordinates_of(scene.model), precision
        checkpoint = Checkpoint(sum(kept["t"]), *what, integrator, options.told, dict(kept))
        statistics = dict(record.statistics)
        if record.stiffness is not None:
            statistics["stiffness"] = record.stiffness
        if integrator == "auto":
            statistics["switches"] = [(t, ("dopri5", "rosenbrock4")[method]) for t, method in record.switches]
        return cls(
            about, rows, calls, steps=steps if len(steps["t"]) else None, events=happened, statistics=statistics,
            ended_by=kinds[record.ended_by] if record.ended_by >= 0 else None, checkpoint=checkpoint,
        )  # fmt: skip

    # ------------------------------------------------------------------ limits
    @cached_property
    def crossed_limits(self) -> list[CrossedLimit]:
        """Coordinates that left limits of the model not held by a `Limits` effect of the scene, in the model's order.

        Each has `coordinate`, `limit`, `upper`, `first` (s) and `farthest`. Checked at the ends of all steps, or at the rows if the
        run kept no steps. Saved in the files of runs. Cost: O(K N), once.
        """
        if "stops" not in self._about:
            return []
        model, rows = self._unedited_model(), self._steps or {"t": self.t, "q": self.q}
        return crossed_limits(unheld_limits(model, self._about["stops"]), model.coordinate_names, rows["t"], rows["q"])

    # ------------------------------------------------------------------ between the rows
    def at(self, t: Any) -> Motion:
        """Return the states at one time, or at several.

        Uses the dense output of the integrator if it has one ("dopri5", order 4; "dop853", 7; "rosenbrock4", 3), else
        Hermite's interpolation in q, v, v̇ on the group between the ends of steps: errors of a step of size h are O(h⁶) in q, O(h⁵) in v
        and O(h⁴) in works and effects' own states (docs/simulation.md). A run that was pickled or read from a file uses
        Hermite's interpolation, with the accelerations at both ends of each step, and linear interpolation for works and states.

        Parameters
        ----------
        t : s, one number or (K,), within the run

        Raises
        ------
        EvaluationError
            A time outside the run; a run that kept no steps (dense=False).
        """
        times = _core.real_array(t, "t")
        if times.ndim > 1:
            raise _core.EvaluationError(f"t must be a time or a list of times in seconds, not an array {times.shape}")
        rows = self._steps
        if rows is None:
            raise _core.EvaluationError("this run kept only the times of t_eval; simulate with dense=True to interpolate between them")
        self._unedited_model()
        wanted, known = np.atleast_1d(times).astype(float), rows["t"]
        outside = wanted[~((wanted >= known[0]) & (wanted <= known[-1]))]
        if outside.size:
            raise _core.EvaluationError(f"t = {outside[0]:g} s is outside the run, which lasts from {known[0]:g} to {known[-1]:g} s")
        found = self._between(rows, wanted) if len(known) > 1 else {name: x[np.zeros(len(wanted), int)] for name, x in rows.items()}
        return Motion(self._about, found, self._calls, alone=times.ndim == 0)

    def _between(self, rows: Mapping[str, np.ndarray], times: np.ndarray) -> dict[str, np.ndarray]:
        order = np.argsort(times, kind="stable")
        steps = np.clip(np.searchsorted(rows["t"], times[order], side="left") - 1, 0, len(rows["t"]) - 2)
        if self._calls is not None:
            found = self._by_dense_output(rows, times[order], steps)
        else:
            found = self._interpolated(rows, times[order], steps)
        last = np.searchsorted(rows["t"], times[order], side="right") - 1
        jumped = (rows["t"][last] == times[order]) & (rows["t"][last - 1] == times[order]) & (last > 0)  # after an impulse
        found = {name: np.where(jumped.reshape(-1, *[1] * (x.ndim - 1)), rows[name][last], x) for name, x in found.items()}
        back = np.argsort(order, kind="stable")
        return {name: x[back] for name, x in found.items()}

    def _by_dense_output(self, rows: Mapping[str, np.ndarray], times: np.ndarray, steps: np.ndarray) -> dict[str, np.ndarray]:
        """Interpolate by the dense output of each step's method, at rising times."""
        integrator = self._about["integrator"] if ":" not in self._about["integrator"] else ""
        t, q, v, states, work = (rows[name] for name in ("t", "q", "v", "states", "work"))
        switches = self.statistics.get("switches", [])
        since = np.searchsorted([at for at, _ in switches], t[steps], side="right") - 1
        stiff = np.array([i >= 0 and switches[i][1] == "rosenbrock4" for i in since], bool)
        parts = [
            (mask, _core.scene_between(self._calls, method, t, q, v, states, work, times[mask].tolist(), steps[mask].tolist()))
            for mask, method in ((~stiff, integrator), (stiff, "rosenbrock4"))
            if mask.any()
        ]
        back = np.argsort(np.concatenate([np.flatnonzero(mask) for mask, _ in parts]))
        return {name: np.concatenate([part[name] for _, part in parts])[back] for name in parts[0][1]}

    def _interpolated(self, rows: Mapping[str, np.ndarray], times: np.ndarray, steps: np.ndarray) -> dict[str, np.ndarray]:
        t, (after, before) = rows["t"], self._vdot_of_steps
        q, v = _core.hermite_between(self.model, t, rows["q"], rows["v"], after, before, times.tolist(), steps.tolist())
        share = ((times - t[steps]) / (t[steps + 1] - t[steps]))[:, None]
        lines = {name: (1 - share) * rows[name][steps] + share * rows[name][steps + 1] for name in ("states", "work")}
        if held := self._about.get("held"):
            lines["states"][:, held] = rows["states"][steps + 1][:, held]
        return {"t": times, "q": q, "v": v, **lines}

    @cached_property
    def _vdot_of_steps(self) -> tuple[np.ndarray, np.ndarray]:
        """(K, nv) twice: with which the step begins that starts at a row, and with which the one ends that led there. They differ at knots
        of functions of time and where controllers are sampled."""
        rows = self._steps
        if rows is None or self._calls is None:
            return self.vdot, self.vdot
        self._unedited_model()
        return _core.step_accelerations(self._calls, *(rows[name] for name in ("t", "q", "v", "states")))

    def checkpoint(self) -> Checkpoint:
        """Return a checkpoint to resume the run: `scene.resume(run.checkpoint(), T)`."""
        if self._checkpoint is None:
            raise _core.EvaluationError(
                "a run read from a file has no checkpoint; save the checkpoint of the original run: run.checkpoint().save(path)"
            )
        return self._checkpoint

    # ------------------------------------------------------------------ ways out
    def to_xarray(self) -> Any:
        """Return the run as an xarray Dataset, with units. Raises ImportError if xarray is missing (extra [data])."""
        from .run_tables import to_xarray

        return to_xarray(self)

    def to_dataframe(self) -> Any:
        """Return the run as a pandas DataFrame, one row per time. Raises ImportError if pandas is missing (extra [data])."""
        from .run_tables import to_dataframe

        return to_dataframe(self)

    def save(self, path: str | Path) -> None:
        """Write the run, by the path's ending: ".nc" (NetCDF), ".parquet" or ".csv". `pycraft.load_run` reads the first two.

        A file holds every state of the run: q, v, their derivatives, energies and forces. A stiff scene takes many steps: 2 s of Talos
        against its stops are 15,880 states, 25 MB of NetCDF and 57 MB of CSV. `simulate(T, t_eval=np.linspace(0, T, 200), dense=False)`
        keeps only 200 states.

        Raises
        ------
        EvaluationError
            Another ending.
        OSError
            A path that cannot be written.
        ImportError
            Parquet without pyarrow (extra [data]).
        """
        from .runs_on_disk import save

        save(self, path)

    def plot(self, *what: str, coordinates: Any = None) -> Any:
        """Plot quantities over time, one panel above another; return Matplotlib's figure.

        Parameters
        ----------
        what : some of "q", "v", "vdot", "energy", "balance", "forces"; default: "q", "v", "energy" and "forces"
        coordinates : names of coordinates or hinges, patterns, or a list of them; None: all
        """
        from .run_plots import plot

        return plot(self, what, coordinates)

    def animate(self, output: Any = None, *, fps: float = 25.0, speed: float = 1.0, trace: str | None = None, **options: Any) -> Any:
        """Animate the run as a stick figure, with only Matplotlib: one picture per frame, for talks and papers. `to_html` writes data that
        the browser draws: many times smaller, can be turned and slowed down, and has plots.

        Parameters
        ----------
        output : path of the file, ending in ".html", ".gif" or ".mp4" (with ffmpeg)
        fps : frames per second
        speed : seconds of the run per second of the film
        trace : a body or node whose origin leaves a trace
        options : as for `Multibody.plot`: view, com, names, legend, shadow, ax

        Returns
        -------
        RunAnimation
            A notebook shows it with buttons to play it; `save` writes it. A run that kept no steps (dense=False) shows the last
            requested state before each frame.

        Raises
        ------
        EvaluationError
            Too many frames, another ending, a view that does not fit.
        ModelError
            An unknown body or node to trace.
        OSError
            An output that cannot be written, before a frame is drawn.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.mechanisms.double_pendulum().simulate(0.2).animate(trace="lower")
        <animation of 'double pendulum': 6 frames, 0 to 0.2 s>
        """
        from .run_animation import RunAnimation, checked_film

        target = None if output is None else checked_film(output)
        film = RunAnimation(self, fps, speed, trace, options)
        if target is not None:
            film.save(target)
        return film

    def to_html(
        self, output: Any = None, *what: str, fps: float = 30.0, speed: float = 1.0, trace: str | None = None, coordinates: Any = None
    ) -> Any:
        """Return the run as one self-contained page of HTML: a figure that can be turned, a time slider, and plots. It needs no network.

        The browser draws it from the bodies' poses in single precision: 64 bytes per body and frame, plus about 45 kB. The page's own
        policy forbids requests. `animate` makes pictures, films and GIFs instead.

        Parameters
        ----------
        output : path of the file, ending in ".html"
        what : plots, as for `plot`; default: "energy", or "q" for a run without recorded works
        fps : frames per second of the film
        speed : initial speed, seconds of the run per second of the film; the page offers other speeds
        trace : a body or node whose origin leaves a trace
        coordinates : coordinates of the plots, as for `plot`

        Returns
        -------
        RunPage
            A notebook shows it; `html` is the page, `save` writes it. A run that kept no steps (dense=False) shows the last requested
            state before each frame.

        Raises
        ------
        EvaluationError
            More than 100 MB of poses, another ending, unknown plots.
        ModelError
            An unknown body or node to trace.
        OSError
            An output that cannot be written.

        Examples
        --------
        >>> import pycraft as pc
        >>> page = pc.mechanisms.double_pendulum().simulate(0.2).to_html(trace="lower")
        >>> len(page.times), page.html.startswith("<!DOCTYPE html>")
        (7, True)
        """
        from .run_page import RunPage, checked_page

        target = None if output is None else checked_page(output)
        page = RunPage(self, fps, speed, trace, what, coordinates)
        if target is not None:
            page.save(target)
        return page

    def to_gltf(self, output: Any, *, fps: float = 30.0, speed: float = 1.0) -> Path:
        """Write the run as animated glTF 2.0, for Blender, three.js, Babylon.js, Windows, macOS and most engines.

        A node for each body, with the triangles of its shapes in full and keyframes of its pose in the world; bodies without shapes
        are sticks and balls. Poses are in single precision; players interpolate between frames, rotations on the sphere. The world's
        upright axis, the axis nearest to gravity, becomes glTF's y. Written by pygltflib (extra [gltf]).

        Parameters
        ----------
        output : path that ends in ".glb" (one binary file) or ".gltf" (text, with embedded data)
        fps : keyframes per second of the film
        speed : seconds of the run per second of the film

        Returns
        -------
        Path
            The file. 28 bytes per body and frame, and 72 per triangle.

        Raises
        ------
        EvaluationError
            Another ending, more than 100 MB of poses, pygltflib missing.
        OSError
            A path that cannot be written.

        Examples
        --------
        >>> import pycraft as pc
        >>> run = pc.mechanisms.double_pendulum().simulate(2.0, q=[1.0, 2.0])
        >>> run.to_gltf("swing.glb")  # doctest: +SKIP
        PosixPath('swing.glb')
        """
        from .run_gltf import to_gltf

        return to_gltf(self, output, fps, speed)

    def to_usd(self, output: Any, *, fps: float = 30.0, speed: float = 1.0) -> Path:
        """Write the run as USD, for Omniverse, Blender, Houdini, Maya and usdview.

        A transform for each body, with time samples of its pose in the world in double precision, and meshes of its shapes below it; bodies
        without shapes are sticks and balls. Lengths are in metres; the upright axis is the one nearest to gravity. Written by usd-core
        (extra [usd]).

        Parameters
        ----------
        output : path that ends in ".usda" (text), ".usdc" (binary) or ".usd"
        fps, speed : as for `to_gltf`

        Returns
        -------
        Path
            The file.

        Raises
        ------
        EvaluationError
            Another ending, more than 100 MB of poses, usd-core missing.
        OSError
            A path that cannot be written.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.mechanisms.double_pendulum().simulate(0.2).to_usd("swing.usda")  # doctest: +SKIP
        PosixPath('swing.usda')
        """
        from .run_usd import to_usd

        return to_usd(self, output, fps, speed)

    def lost_digits(self, states: int = 8, **options: Any) -> Any:
        """Show where the forward dynamics along the run loses digits, as colour on the robot over time, with the next rung and its cost.

        The tree's forward dynamics, with the generalized forces of the run's accelerations, is certified at some states: error, digits
        lost in each D(k), and the next rung that at least halves the error, with its error and its time (`Multibody.certify`).

        Parameters
        ----------
        states : number of states, 1 to 200, evenly spaced among the run's rows, including the first and the last
        options : options of `Multibody.certify`: form, refine, residual, precision (default: the run's), seed, seconds

        Returns
        -------
        LostDigits
            A notebook shows it; `save("digits.html")` writes an offline page; `t`, `hinges`, `digits`, `certificates`.

        Raises the errors of `certify`, and EvaluationError for another number of states. Cost: one certificate per state.

        Examples
        --------
        >>> import pycraft as pc
        >>> run = pc.mechanisms.double_pendulum().simulate(0.5)
        >>> lost = run.lost_digits(2)
        >>> lost.hinges, len(lost.certificates)
        (['upper', 'lower'], 2)
        """
        from .lost_digits import LostDigits

        return LostDigits(self, states, options)

    # ------------------------------------------------------------------ copies
    def __getstate__(self) -> dict[str, Any]:
        if self._calls is not None and self._steps is not None and not self._edited:
            self._vdot_of_steps  # noqa: B018 - computes and caches
        return super().__getstate__()

    def __repr__(self) -> str:
        steps = self.statistics.get("steps")
        ended = f", ended by {self.ended_by!r}" if self.ended_by else ""
        counted = "" if steps is None else f", {steps} steps"
        crossed = "" if self._edited or not self.crossed_limits else f"; beyond limits: {crossed_names(self.crossed_limits)}"
        return f"<run of {self.model.name!r}: {len(self.t)} states from {self.t[0]:g} to {self.t[-1]:g} s{counted}{ended}{crossed}>"
