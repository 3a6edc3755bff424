"""Runs as files: NetCDF, Parquet and CSV, and back."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..file_targets import writable_target
from ..models.multibody import Multibody
from .coordinate_units import coordinate_units
from .crossed_limits import CrossedLimit
from .events import EventStates
from .run_tables import HOLDS, columns_of, variables_of

FORMAT = "pycraft run 2"
FORMATS = ("pycraft run 1", FORMAT)
"""Those that are read. Files of the first do not say with which accelerations steps end, nor what controllers hold."""
ABOUT = ("effects", "workers", "energy", "integrator", "options", "precision")
"""Data of a run in addition to its model."""
ENDINGS = (".nc", ".parquet", ".csv")
BETWEEN = ("vdot_after", "vdot_before")
"""Columns of a Parquet file, where they differ from the accelerations at its rows: with which steps begin there, and end."""


def checked_output(path: Any) -> Path:
    """Check, before the run, that a run can be written to a path. Raises EvaluationError for an ending not in `ENDINGS`, OSError if it
    cannot be written, ImportError if a package is missing."""
    target = writable_target(path, ENDINGS, "a run")
    if target.suffix == ".parquet":
        _pyarrow()
    return target


def save(run: Any, path: str | Path) -> None:
    """Write a run by the path's ending."""
    target = checked_output(path)
    {".nc": _to_netcdf, ".parquet": _to_parquet, ".csv": _to_csv}[target.suffix](run, target)


def load_run(path: str | Path) -> Any:
    """Load a run that `Run.save` wrote to a NetCDF or Parquet file, with its model.

    It has no scene: it cannot be resumed, and between its times it has only configurations and velocities, interpolated for Parquet
    between the rows of the table, for NetCDF between the ends of steps.

    Raises
    ------
    EvaluationError
        A file of another kind.
    OSError
        The file cannot be read.
    """
    target = Path(path)
    readers = {".nc": _from_netcdf, ".parquet": _from_parquet}
    if target.suffix not in readers:
        raise _core.EvaluationError(f"{str(path)!r}: a run can be read from files that end in {' and '.join(readers)}")
    if not target.is_file():
        raise FileNotFoundError(f"there is no file {str(path)!r}")
    with target.open("rb"):  # OSError if it cannot be read at all
        pass
    try:
        return readers[target.suffix](target)
    except (ImportError, _core.EvaluationError):
        raise
    except Exception as error:  # damaged bytes may raise anything
        raise _core.EvaluationError(f"{str(path)!r} holds no run, or a damaged one ({error}); `run.save(path)` writes one") from None


# ---------------------------------------------------------------------- data besides the numbers


def _about(run: Any) -> str:
    about = {name: value for name, value in run._about.items() if name not in ("model", "stops")}
    events = {name: {key: getattr(e, key).tolist() for key in ("t", "q", "v", "states")} for name, e in run.events.items()}
    model = json.loads(json.dumps(run.model.description(), default=_plain))
    crossed = [asdict(each) for each in run.crossed_limits]
    return json.dumps(
        {
            "format": FORMAT, "model": model, "about": about, "events": events, "ended_by": run.ended_by, "statistics": run.statistics,
            "crossed_limits": crossed,
        },
        default=_plain,
    )  # fmt: skip


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else dict(value)


def _run(
    text: Any, path: Path, rows: Mapping[str, np.ndarray], steps: Mapping[str, np.ndarray] | None, along: Mapping[str, np.ndarray]
) -> Any:
    from .run import Run

    told = json.loads(text)
    if told.get("format") not in FORMATS:
        known = " or ".join(repr(each) for each in FORMATS)
        raise _core.EvaluationError(f"{str(path)!r} holds a run in the format {told.get('format')!r}; this version reads {known}")
    if missing := [name for name in ABOUT if name not in told["about"]]:
        raise ValueError(f"it lacks: {', '.join(missing)}")
    about = told["about"] | {"model": Multibody.from_description(told["model"])}
    n, nq, nv = len(rows["t"]), about["model"].nq, about["model"].nv
    widths = {"t": (n,), "q": (n, nq), "v": (n, nv)}
    events = {
        name: EventStates(*(np.asarray(e[key], float).reshape(len(e["t"]), -1) if key != "t" else np.asarray(e[key], float) for key in e))
        for name, e in told["events"].items()
    }
    shaped = {name: x.reshape(widths.get(name, (n, *x.shape[1:]))) for name, x in rows.items()}
    if steps is not None:
        ends = len(steps["t"])
        steps = {name: x.reshape((ends, *(widths[name][1:] if name in widths else x.shape[1:]))) for name, x in steps.items()}
    statistics = told["statistics"]
    if "switches" in statistics:
        statistics["switches"] = [(at, method) for at, method in statistics["switches"]]
    run = Run(about, shaped, steps=steps, events=events, ended_by=told["ended_by"], statistics=statistics)
    run.__dict__["_along"] = {
        **along,
        "forces": along["forces"].reshape(len(about["effects"]), n, nv),
        "vdot": along["vdot"].reshape(n, nv),
    }
    if "crossed_limits" in told:
        run.__dict__["crossed_limits"] = [CrossedLimit(**each) for each in told["crossed_limits"]]
    if steps is None:
        run._steps = {"t": run.t, "q": run.q, "v": run.v, "states": run.states, "work": run._work}
    return run


# ---------------------------------------------------------------------- NetCDF


def _to_netcdf(run: Any, path: Path) -> None:
    from scipy.io import netcdf_file

    variables = {"time": (("time",), run.t, "s"), **variables_of(run)}
    steps = run._steps
    if steps is not None and steps["t"] is not run.t:
        axes_of = {"t": (), "q": ("configuration",), "v": ("coordinate",), "states": ("state",), "work": ("worker",)}
        variables |= {f"step_{name}": (("step", *axes_of[name]), steps[name], "") for name in axes_of}
        variables |= _accelerations(run, "step")
    elif steps is not None and any(not np.array_equal(each, run.vdot) for each in run._vdot_of_steps):
        variables |= _accelerations(run, "time")
    with netcdf_file(str(path), "w", version=2) as file:
        file.about = _about(run).encode("utf-8")
        sizes: dict[str, int] = {}
        for axes, x, _ in variables.values():
            sizes |= dict(zip(axes, x.shape, strict=True))
        for axis, size in sizes.items():
            if size > 0:  # an axis of length zero would be an unlimited one
                file.createDimension(axis, size)
        for name, (axes, x, unit) in variables.items():
            if x.size:
                variable = file.createVariable(name, "d", axes)
                variable[:] = x
                if unit:
                    variable.units = unit.encode("utf-8")


def _from_netcdf(path: Path) -> Any:
    from scipy.io import netcdf_file

    with netcdf_file(str(path), "r", mmap=False) as file:
        about = file.about.decode("utf-8")
        found = {name: np.array(x[:], float) for name, x in file.variables.items()}
    n, empty = len(found["time"]), np.zeros((len(found["time"]), 0))
    rows = {"t": found["time"], **{name: found.get(name, empty) for name in ("q", "v", "states", "work")}}
    along = {name: found.get(name, empty) for name in ("vdot", "forces", "potential")} | {"kinetic": found.get("kinetic", np.zeros(n))}
    steps = None
    if "step_t" in found:
        empty = np.zeros((len(found["step_t"]), 0))
        steps = {name: found.get(f"step_{name}", empty) for name in ("t", "q", "v", "states", "work")}
    run = _run(about, path, rows, steps, along)
    if steps is not None or "step_vdot" in found:
        after = found.get("step_vdot", empty)
        run.__dict__["_vdot_of_steps"] = after, found.get("step_vdot_before", after)
    return run


def _accelerations(run: Any, axis: str) -> dict[str, tuple[tuple[str, ...], np.ndarray, str]]:
    """With which steps begin and end."""
    return dict(zip(("step_vdot", "step_vdot_before"), (((axis, "coordinate"), x, "") for x in run._vdot_of_steps), strict=True))


# ---------------------------------------------------------------------- tables


def _pyarrow() -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ImportError(f"Parquet needs pyarrow: {HOLDS}; '.nc' and '.csv' need no package") from None
    return pyarrow


def _to_parquet(run: Any, path: Path) -> None:
    pyarrow = _pyarrow()
    columns = columns_of(run)
    if run._steps is not None and run._steps["t"] is run.t:
        for start, x in zip(BETWEEN, run._vdot_of_steps, strict=True):
            if not np.array_equal(x, run.vdot):
                columns |= {f"{start}.{name}": x[:, i] for i, name in enumerate(run.model.coordinate_names)}
    table = pyarrow.table({name: np.ascontiguousarray(x) for name, x in columns.items()})
    pyarrow.parquet.write_table(table.replace_schema_metadata({"pycraft": _about(run)}), str(path))


def _from_parquet(path: Path) -> Any:
    pyarrow = _pyarrow()
    table = pyarrow.parquet.read_table(str(path))
    about = (table.schema.metadata or {})[b"pycraft"].decode("utf-8")
    columns = {name: table.column(name).to_numpy().astype(float) for name in table.column_names}
    told = json.loads(about)
    n, effects = len(columns["t"]), told["about"]["effects"]
    model = Multibody.from_description(told["model"])
    of_q, of_v = coordinate_units(model)[0], model.coordinate_names

    def those(start: str, names: list[Any]) -> np.ndarray:
        found = [columns[f"{start}.{name}"] for name in names if f"{start}.{name}" in columns]
        return np.stack(found, axis=1) if found else np.zeros((n, 0))

    states = those("state", [i for i in range(len(columns))])
    rows = {"t": columns["t"], "q": those("q", of_q), "v": those("v", of_v), "states": states, "work": those("work", effects)}
    forces = np.stack([those(f"force.{effect}", of_v) for effect in effects]) if effects else np.zeros((0, n, len(of_v)))
    along = {"vdot": those("vdot", of_v), "forces": forces, "kinetic": columns["kinetic"], "potential": those("potential", effects)}
    run = _run(about, path, rows, None, along)
    run.__dict__["_vdot_of_steps"] = tuple(x if x.shape[1] else along["vdot"] for x in (those(start, of_v) for start in BETWEEN))
    return run


def _to_csv(run: Any, path: Path) -> None:
    columns = columns_of(run)
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerow(columns)
        np.savetxt(file, np.stack(list(columns.values()), axis=1), fmt="%.17g", delimiter=",")
