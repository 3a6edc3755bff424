"""Runs as tables and data sets: names, units, and conversion to other packages."""

from __future__ import annotations

from typing import Any

import numpy as np

from .coordinate_units import POWER, coordinate_units

HOLDS = "pip install 'pycraft-soa[data]'"


def columns_of(run: Any) -> dict[str, np.ndarray]:
    """Return all data of a run by column, (K,) each: "t", "q.shoulder", "v.shoulder", "vdot.shoulder", "force.gravity.shoulder", "state.0",
    and for runs that recorded works "kinetic", "potential.gravity" and "work.damping"."""
    (of_q, _, _), of_v = coordinate_units(run._unedited_model()), run.model.coordinate_names

    def by_name(start: str, names: Any, x: np.ndarray) -> dict[str, np.ndarray]:
        return {f"{start}.{name}": x[:, i] for i, name in enumerate(names)}

    columns = {"t": run.t} | by_name("q", of_q, run.q) | by_name("v", of_v, run.v) | by_name("vdot", of_v, run.vdot)
    columns |= by_name("state", range(run.states.shape[1]), run.states)
    for effect, forces in run.forces.items():
        columns |= by_name(f"force.{effect}", of_v, forces)
    columns["kinetic"] = run._along["kinetic"]
    columns |= by_name("potential", run.effects, run._along["potential"])
    return columns | (by_name("work", run.workers, run._work) if run._about["energy"] else {})


def to_dataframe(run: Any) -> Any:
    """Return a pandas DataFrame with the columns of `columns_of`, by time."""
    try:
        import pandas
    except ImportError:
        raise ImportError(f"to_dataframe() needs pandas: {HOLDS}; save('run.csv') needs no package") from None
    columns = columns_of(run)
    return pandas.DataFrame(columns, index=pandas.Index(columns.pop("t"), name="t"))


def variables_of(run: Any) -> dict[str, tuple[tuple[str, ...], np.ndarray, str]]:
    """Return arrays of a run by name, each with the names of its axes and its unit."""
    energies = ("kinetic", "potential")
    units = {"q": "rad, m or 1", "v": "rad/s or m/s", "vdot": "rad/s^2 or m/s^2", "forces": "N m or N"} | dict.fromkeys(energies, "J")
    axes = {
        "q": ("time", "configuration"), "v": ("time", "coordinate"), "states": ("time", "state"), "vdot": ("time", "coordinate"),
        "forces": ("effect", "time", "coordinate"), "kinetic": ("time",), "potential": ("time", "effect"), "work": ("time", "worker"),
    }  # fmt: skip
    arrays = {"q": run.q, "v": run.v, "states": run.states, **run._along, "work": run._work}
    return {name: (axes[name], arrays[name], units.get(name, "J" if name == "work" else "")) for name in axes}


def to_xarray(run: Any) -> Any:
    """Return an xarray Dataset: the variables of `variables_of` over named coordinates, with momentum."""
    try:
        import xarray
    except ImportError:
        raise ImportError(f"to_xarray() needs xarray: {HOLDS}; save('run.nc') and save('run.csv') need no package") from None
    names, q_units, v_units = coordinate_units(run._unedited_model())
    data: dict[str, Any] = {name: (axes, x, {"units": unit} if unit else {}) for name, (axes, x, unit) in variables_of(run).items()}
    momentum = (("about", "time", "component"), np.stack(list(run.momentum.values())), {"units": "N m s, N s"})
    coordinates = {
        "time": ("time", run.t, {"units": "s"}), "configuration": names, "coordinate": list(run.model.coordinate_names),
        "effect": run.effects, "worker": run.workers if run._work.shape[1] else [], "about": list(run.momentum),
        "component": ["nx", "ny", "nz", "px", "py", "pz"], "configuration_unit": ("configuration", q_units),
        "coordinate_unit": ("coordinate", v_units), "force_unit": ("coordinate", [POWER[unit] for unit in v_units]),
    }  # fmt: skip
    counted = {f"statistics_{name}": value for name, value in run.statistics.items() if isinstance(value, (int, float))}
    about = {"model": run.model.name, "integrator": run._about["integrator"], **counted}
    return xarray.Dataset(data | {"momentum": momentum}, coordinates, about)
