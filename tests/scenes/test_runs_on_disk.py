"""Runs as data sets and files: names and units, there and back, and paths that cannot be written."""

import builtins
import csv
import json
import pickle
import warnings

import numpy as np
import pytest
from scipy.interpolate import PPoly

import pycraft as pc
from support.runs import CASES

E = pc.effects


@pytest.fixture(scope="module")
def run():
    class Lag:
        states = (0.1,)

        def __call__(self, t, state):
            return {"boom": 0.1 * state.states[0]}

        def rates(self, t, state):
            return -state.states

    return CASES["damped"]().add(Lag()).simulate(0.5, events={"turn": lambda t, s: s.v[-1]})


def test_xarray(run):
    pytest.importorskip("xarray", reason="extra [data]")
    data = run.to_xarray()
    assert data.sizes["time"] == len(run) and data.attrs["model"] == "spinning" and data["time"].attrs["units"] == "s"
    assert np.array_equal(data["v"].sel(coordinate="boom"), run.v[:, -1])
    assert (
        np.array_equal(data["q"].sel(configuration="hub[4]"), run.q[:, 4]) and data["configuration_unit"].sel(configuration="hub[4]") == "m"
    )
    assert np.array_equal(data["forces"].sel(effect="damping"), run.forces["damping"])
    assert np.array_equal(data["work"].sel(worker="torque_source"), run.energy["work"][:, 1])
    assert np.array_equal(data["momentum"].sel(about="com"), run.momentum["com"])
    assert data["coordinate_unit"].values.tolist() == ["rad"] * 3 + ["m"] * 3 + ["rad"] * 3 + ["m"] and data["force_unit"].values[-1] == "N"


def test_pandas(run):
    pytest.importorskip("pandas", reason="extra [data]")
    data = run.to_dataframe()
    assert data.index.name == "t" and np.array_equal(data.index, run.t) and np.array_equal(data["q.boom"], run.q[:, -1])
    assert np.array_equal(data["force.gravity.hub[5]"], run.forces["gravity"][:, 5]) and np.array_equal(data["state.0"], run.states[:, 0])


def same(run, again):
    for name in ("t", "q", "v", "states", "vdot"):
        assert np.array_equal(getattr(run, name), getattr(again, name)), name
    assert run.effects == again.effects and run.workers == again.workers and run.ended_by == again.ended_by
    assert all(np.array_equal(run.forces[name], again.forces[name]) for name in run.effects)
    assert all(np.array_equal(run.energy[name], again.energy[name]) for name in run.energy)
    assert run.statistics == again.statistics
    assert all(
        np.array_equal(a.t, b.t) and np.array_equal(a.q, b.q) for a, b in zip(run.events.values(), again.events.values(), strict=True)
    )
    masses = [[body["mass"] for body in one.model.description()["bodies"]] for one in (run, again)]
    assert masses[0] == masses[1]
    assert np.array_equal(run.momentum["origin"], again.momentum["origin"])


@pytest.mark.parametrize("ending", ["nc", "parquet"])
def test_there_and_back(run, ending, tmp_path):
    if ending == "parquet":
        pytest.importorskip("pyarrow", reason="extra [data]")
    run.save(tmp_path / f"run.{ending}")
    again = pc.load_run(tmp_path / f"run.{ending}")
    same(run, again)
    assert np.abs(again.at(0.2).q - run.at(0.2).q).max() < 1e-6
    with pytest.raises(pc.EvaluationError, match="has no checkpoint; save the checkpoint of the original run"):
        again.checkpoint()


def test_of_times_asked_for(tmp_path):
    """NetCDF holds the ends of steps beside them, to look between."""
    scene = CASES["spinning"]()
    run = scene.simulate(0.5, t_eval=[0.1, 0.5])
    run.save(tmp_path / "run.nc")
    again = pc.load_run(tmp_path / "run.nc")
    same(run, again)
    assert np.abs(again.at(0.3).q - run.at(0.3).q).max() < 1e-6


@pytest.mark.parametrize("ending", ["nc", "parquet"])
def test_small_runs(ending, tmp_path):
    """No effects, no works, no coordinates."""
    if ending == "parquet":
        pytest.importorskip("pyarrow", reason="extra [data]")
    welded = pc.Multibody("welded", welds="keep")
    welded.add_body("a", hinge="weld", mass=1.0)
    for scene in (pc.Scene(pc.chain(2)), pc.Scene(welded)):
        run = scene.simulate(0.1, integrator="rk4", step=0.05)
        run.save(tmp_path / f"run.{ending}")
        same(run, pc.load_run(tmp_path / f"run.{ending}"))


def test_netcdf_is_read_by_others(run, tmp_path):
    xarray = pytest.importorskip("xarray", reason="extra [data]")
    run.save(tmp_path / "run.nc")
    data = xarray.open_dataset(tmp_path / "run.nc", engine="scipy")
    assert (
        np.array_equal(data["q"], run.q) and data["time"].attrs["units"] == "s" and data["forces"].dims == ("effect", "time", "coordinate")
    )


def test_csv(run, tmp_path):
    run.save(tmp_path / "run.csv")
    with open(tmp_path / "run.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(run) and [float(row["v.boom"]) for row in rows] == run.v[:, -1].tolist()
    assert float(rows[-1]["work.damping"]) == run.energy["work"][-1, 0]


def test_the_output_of_a_run(tmp_path):
    scene = pc.mechanisms.pendulum()
    run = scene.simulate(0.5, output=tmp_path / "run.nc")
    same(run, pc.load_run(tmp_path / "run.nc"))
    longer = scene.resume(run, 1.0, output=str(tmp_path / "longer.csv"))
    assert (tmp_path / "longer.csv").exists() and longer.t[-1] == 1.0


def test_a_path_that_cannot_be_written_is_refused_before_the_run(tmp_path, monkeypatch):
    called = []
    scene = pc.Scene(pc.chain(1)).add(lambda t, s: called.append(t) or [0.0])
    (tmp_path / "folder.nc").mkdir()
    for output, error, text in (
        (tmp_path / "none" / "run.nc", FileNotFoundError, "there is no folder"),
        (tmp_path / "folder.nc", IsADirectoryError, "is a folder"),
        ("/proc/version.nc", OSError, "'/proc/version.nc' cannot be written"),
        (tmp_path / "run.hdf5", pc.EvaluationError, "ends in .nc, .parquet, .csv"),
    ):
        with pytest.raises(error, match=text):
            scene.simulate(0.1, [0.0], [0.0], output=output)
    assert called == [] and not (tmp_path / "none").exists()

    imported = builtins.__import__

    def without(name, *rest):
        if name.split(".")[0] in ("pyarrow", "pandas", "xarray"):
            raise ImportError(name)
        return imported(name, *rest)

    run = scene.simulate(0.1, [0.0], [0.0])
    monkeypatch.setattr(builtins, "__import__", without)
    called.clear()
    with pytest.raises(ImportError, match="Parquet needs pyarrow: pip install 'pycraft-soa.data.'; '.nc' and '.csv' need no package"):
        scene.simulate(0.1, [0.0], [0.0], output=tmp_path / "run.parquet")
    assert called == []
    with pytest.raises(ImportError, match="needs pandas: pip install 'pycraft-soa.data.'"):
        run.to_dataframe()
    with pytest.raises(ImportError, match="needs xarray: pip install 'pycraft-soa.data.'"):
        run.to_xarray()


def test_files_that_hold_no_run(tmp_path):
    from scipy.io import netcdf_file

    (tmp_path / "text.nc").write_text("no NetCDF")
    with netcdf_file(str(tmp_path / "other.nc"), "w") as file:
        file.createDimension("x", 1)
    for name in ("text.nc", "other.nc"):
        with pytest.raises(pc.EvaluationError, match=f"{name}' holds no run"):
            pc.load_run(tmp_path / name)
    with pytest.raises(pc.EvaluationError, match="a run can be read from files that end in .nc and .parquet"):
        pc.load_run("run.csv")
    with pytest.raises(FileNotFoundError, match="there is no file 'none.nc'"):
        pc.load_run("none.nc")


@pytest.mark.parametrize("ending", [".nc", ".parquet"])
def test_damaged_files_say_so(tmp_path, ending):
    """Bytes cut off anywhere, or overwritten anywhere: the run, or an error that names the file."""
    whole, file = tmp_path / f"run{ending}", tmp_path / f"damaged{ending}"
    pc.mechanisms.double_pendulum().simulate(0.2).save(whole)
    data, drawn = whole.read_bytes(), np.random.default_rng(3)
    refused = 0
    for i in range(120):
        at = int(drawn.integers(len(data)))
        file.write_bytes(data[:at] if i % 2 else data[:at] + bytes(drawn.integers(0, 256, 8, dtype=np.uint8)) + data[at + 8 :])
        try:
            pc.load_run(file)
        except pc.EvaluationError as error:
            assert f"{str(file)!r} holds no run" in str(error)
            refused += 1
    assert refused > 40


def test_names_with_quotes_and_commas_are_columns_of_csv(tmp_path):
    model = pc.Multibody("arm")
    model.add_body('the "upper", arm', axis=(0, 1, 0), mass=1.0, com=(0, 0, 1))
    pc.Scene(model).simulate(0.1, [0.2], [1.0]).save(tmp_path / "run.csv")
    with (tmp_path / "run.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    names = [f"{what}.{model.coordinate_names[0]}" for what in ("q", "v", "vdot")]
    assert '"' in names[0] and header[:4] == ["t", *names] and {len(row) for row in rows} == {len(header)}


def jumping():
    """Forces that jump where a function of time has knots, and where a controller is sampled."""
    force = PPoly(np.array([[0.0, 40.0, -10.0]]), [0.0, 0.31, 0.52, 1.0])
    scene = pc.mechanisms.double_pendulum()
    hinge = next(iter(scene.model.hinges))
    return scene.add(E.TorqueSource(force, hinges=hinge), E.Sampled(lambda t, s: -3.0 * s.v, 0.17))


BETWEEN = np.sort(np.r_[np.linspace(0, 0.9, 301), [0.3099, 0.31, 0.3101, 0.52, 0.17, 0.1699, 0.1701, 0.34]])


@pytest.mark.parametrize("how", ["nc", "parquet", "of times asked for", "pickled"])
def test_between_rows_at_knots_and_samples(how, tmp_path):
    """Without its scene a run has the accelerations of each step at its ends: Hermite's polynomials are of one piece of the motion."""
    if how == "parquet":
        pytest.importorskip("pyarrow", reason="extra [data]")
    scene = jumping()
    run = scene.simulate(0.9, [0.3, 0.2], [0.0, 0.0], t_eval=[0.1, 0.9] if how == "of times asked for" else None)
    if how == "pickled":
        again = pickle.loads(pickle.dumps(run))
    else:
        file = tmp_path / f"run.{'parquet' if how == 'parquet' else 'nc'}"
        run.save(file)
        again = pc.load_run(file)
    exact, found = run.at(BETWEEN), again.at(BETWEEN)
    assert np.abs(found.q - exact.q).max() < 1e-8 and np.abs(found.v - exact.v).max() < 1e-6
    assert np.array_equal(found.states, exact.states)


@pytest.mark.parametrize("t_eval", [None, [0.1, 0.9]])
def test_files_of_the_first_format(t_eval, tmp_path):
    """They have one acceleration at each row, or none beside the table's, and do not have the held outputs of controllers."""
    from scipy.io import netcdf_file

    run = jumping().simulate(0.9, [0.3, 0.2], [0.0, 0.0], t_eval=t_eval)
    run.save(tmp_path / "new.nc")
    with (
        netcdf_file(str(tmp_path / "new.nc"), "r", mmap=False) as new,
        netcdf_file(str(tmp_path / "old.nc"), "w", version=2) as old,
    ):
        about = json.loads(new.about)
        del about["about"]["held"]
        old.about = json.dumps(about | {"format": "pycraft run 1"}).encode()
        for axis, size in new.dimensions.items():
            old.createDimension(axis, size)
        for name, x in new.variables.items():
            if name != "step_vdot_before" and not (t_eval is None and name.startswith("step_")):
                old.createVariable(name, "d", x.dimensions)[:] = x[:]
    again = pc.load_run(tmp_path / "old.nc")
    same(run, again)
    assert np.abs(again.at(0.4).q - run.at(0.4).q).max() < 1e-4
    about["format"] = "pycraft run 3"
    with netcdf_file(str(tmp_path / "newer.nc"), "w") as newer:
        newer.about = json.dumps(about).encode()
        newer.createDimension("time", 1)
        newer.createVariable("time", "d", ("time",))[:] = 0.0
        newer.createVariable("kinetic", "d", ("time",))[:] = 0.0
    with pytest.raises(pc.EvaluationError, match="the format 'pycraft run 3'; this version reads 'pycraft run 1' or 'pycraft run 2'"):
        pc.load_run(tmp_path / "newer.nc")


@pytest.mark.parametrize("ending", ["nc", "parquet", "csv"])
def test_limits_that_are_held_and_that_are_crossed(ending, tmp_path):
    """A run of a scene with stops is written as any other, and one without them keeps what it crossed."""
    if ending == "parquet":
        pytest.importorskip("pyarrow", reason="extra [data]")
    model = pc.Multibody("ball")
    model.add_body("b", None, "slider", axis=(0, 0, 1), mass=1.0, limits=(0, np.inf))
    for stops in ([E.Limits(1e4, 0.0)], []):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pc.ModelWarning)
            run = pc.Scene(model).add(E.Gravity(), *stops).simulate(2.0, [1.0], [0.0], progress=False)
        run.save(tmp_path / f"run.{ending}")
        if ending == "csv":
            continue
        again = pc.load_run(tmp_path / f"run.{ending}")
        same(run, again)
        assert again.crossed_limits == run.crossed_limits and len(run.crossed_limits) == (not stops)


@pytest.mark.parametrize("ending", ["nc", "parquet"])
def test_a_run_that_switched(ending, tmp_path):
    if ending == "parquet":
        pytest.importorskip("pyarrow", reason="extra [data]")
    finger = pc.Multibody("finger")
    finger.add_body("f", axis=(0, 0, 1), mass=0.01, com=(0.02, 0, 0), inertia=1e-6 * np.eye(3))
    run = pc.Scene(finger).add(E.TorqueSource(0.2), E.CoulombFriction(0.5)).simulate(1.0, [0.0], [0.0], progress=False)
    run.save(tmp_path / f"run.{ending}")
    again = pc.load_run(tmp_path / f"run.{ending}")
    same(run, again)
    assert [method for _, method in again.statistics["switches"]] == ["rosenbrock4"]
