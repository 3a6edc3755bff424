"""Sweeps in folders: read back to the bit, larger than what is held at once, stopped, killed and gone on with."""

import json
import os
import signal
import subprocess
import sys
import time
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

import pycraft as pc
from pycraft.ensembles import folder as folders
from support import sweeps

pytest.importorskip("pyarrow")


def everything(result):
    return {name: result[name] for name in [*result.samples, *result]}


def test_what_is_read_is_what_was_found(tmp_path):
    scene = pc.mechanisms.double_pendulum()
    samples = pc.samples.states(scene.model, 9) | {"effects.gravity.g[1]": np.linspace(-9, -10, 9)}
    times = [0.0, 0.1, 0.2]
    held = pc.sweep(scene, samples, 0.2, t_eval=times, progress=False)
    kept = pc.sweep(scene, samples, 0.2, t_eval=times, output=tmp_path / "out", progress=False)
    read = pc.load_sweep(tmp_path / "out")
    for result in (kept, read):
        assert all(np.array_equal(everything(held)[name], values) for name, values in everything(result).items())
        assert result.finished.all() and list(result) == list(held)


def test_truths_texts_and_failures_come_back(tmp_path):
    def kinds(x, label):
        if x == 2:
            raise ValueError("two is not liked")
        return {"odd": bool(x % 2), "name": f"{label}{x:g}"}

    samples = {"x": [1, 2, 3], "label": ["a", "b", "c"]}
    pc.sweep(kinds, samples, output=tmp_path / "out", progress=False).close()
    read = pc.load_sweep(tmp_path / "out")
    assert read["odd"].tolist() == [True, None, True] and read["name"].tolist() == ["a1", None, "c3"] and read["label"] == ["a", "b", "c"]
    assert [(f.sample, f.inputs, f.reason) for f in read.failures] == [(1, {"x": 2.0, "label": "b"}, "ValueError: two is not liked")]


def test_parts_hold_so_many_rows_and_no_more(tmp_path, monkeypatch):
    """A column of all runs is read part by part; what is in the journal belongs to it."""
    monkeypatch.setattr(folders, "ROWS", 10)
    result = pc.sweep(sweeps.square, {"x": np.arange(100.0)}, output=tmp_path / "out", workers=1, progress=False)
    parts = list((tmp_path / "out" / "parts").glob("*.parquet"))
    assert len(parts) > 1 and result["square"].tolist() == [i * i for i in range(100)] and result["powers"].shape == (100, 3)
    monkeypatch.setattr(folders, "NUMBERS", 16)  # four numbers a row: parts of four
    assert result._store._rows_of_a_part() == 4


def test_a_sweep_goes_on_where_it_was_stopped(tmp_path):
    (tmp_path / "ran.txt").touch()

    def stop(x, folder):
        if x == 20:
            raise KeyboardInterrupt
        return sweeps.slow_square(x, folder)

    stop.__module__, stop.__qualname__ = sweeps.slow_square.__module__, sweeps.slow_square.__qualname__  # as if it were the same
    samples = {"x": list(range(30)), "folder": [str(tmp_path)] * 30}
    with pytest.raises(KeyboardInterrupt) as stopped:
        pc.sweep(stop, samples, output=tmp_path / "out", workers=1, progress=False)
    before = stopped.value.result.finished.copy()
    stopped.value.result.close()
    assert 0 < before.sum() < 30
    (tmp_path / "ran.txt").write_text("")
    result = pc.sweep(sweeps.slow_square, samples, output=tmp_path / "out", progress=False)
    again = {int(float(x)) for x in (tmp_path / "ran.txt").read_text().split()}
    assert again == set(np.flatnonzero(~before)) and result["value"].tolist() == [x * x for x in range(30)]
    assert pc.sweep(sweeps.slow_square, samples, output=tmp_path / "out", progress=False).finished.all()  # nothing is left, nothing runs


@pytest.mark.parametrize("on", ["threads", "processes"])
def test_a_process_that_is_killed_loses_no_finished_run(tmp_path, on):
    """The whole of it, without warning: what it had written down as finished is there, and is not run again."""
    count, script = 400, Path(sweeps.__file__)
    (tmp_path / "ran.txt").touch()
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(script.parents[1]), *sys.path])}
    process = subprocess.Popen([sys.executable, str(script), str(tmp_path), str(count), on], env=environment, start_new_session=True)
    try:
        deadline = time.monotonic() + 60
        while len((tmp_path / "ran.txt").read_text().split()) < 60 and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.02)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    left = pc.load_sweep(tmp_path / "out")
    before = left.finished.copy()
    assert 0 < before.sum() < count
    assert np.array_equal(left["value"][before], np.flatnonzero(before) ** 2.0)
    left.close()
    (tmp_path / "ran.txt").write_text("")
    result = pc.sweep(
        sweeps.slow_square, {"x": list(range(count)), "folder": [str(tmp_path)] * count}, output=tmp_path / "out", workers=8, progress=False
    )
    again = [int(float(x)) for x in (tmp_path / "ran.txt").read_text().split()]
    assert sorted(again) == np.flatnonzero(~before).tolist() and result["value"].tolist() == [x * x for x in range(count)]


def test_a_kill_between_part_and_journal_counts_rows_once(tmp_path):
    """Both have the rows then."""
    samples = {"x": [1, 2, 3]}
    result = pc.sweep(sweeps.square, samples, output=tmp_path / "out", progress=False)
    result._store.add([folders.Outcome(1, {"square": 4.0, "powers": np.array([2.0, 4.0, 8.0])}, None, 0.0)])  # again, in the journal
    result.close()
    read = pc.load_sweep(tmp_path / "out")
    assert read["square"].tolist() == [1, 4, 9] and read.finished.all()


def test_another_sweep_in_the_folder_is_refused(tmp_path):
    scene = pc.mechanisms.pendulum()
    out = tmp_path / "out"
    pc.sweep(scene, {"v": [0, 1]}, 0.1, output=out, progress=False).close()
    with pytest.raises(pc.EvaluationError, match="another sweep, with other samples; give another folder, or overwrite=True"):
        pc.sweep(scene, {"v": [0, 2]}, 0.1, output=out, progress=False)
    with pytest.raises(pc.EvaluationError, match="with other options"):
        pc.sweep(scene, {"v": [0, 1]}, 0.1, rtol=1e-6, output=out, progress=False)
    scene.add(pc.effects.Damping(0.1))
    with pytest.raises(pc.EvaluationError, match="with other scene"):
        pc.sweep(scene, {"v": [0, 1]}, 0.1, output=out, progress=False)
    found = pc.sweep(scene, {"v": [0, 1, 2]}, 0.1, output=out, overwrite=True, progress=False)
    assert found["end.q"].shape == (3, 1) and len(list((out / "parts").glob("*.parquet"))) == 1


def test_two_sweeps_at_work_in_one_folder_are_refused(tmp_path):
    def inner(x):
        with pytest.raises(pc.EvaluationError, match="another sweep is writing to this folder"):
            pc.sweep(inner, {"x": [1]}, output=tmp_path / "out", progress=False)
        return x

    assert pc.sweep(inner, {"x": [1]}, output=tmp_path / "out", progress=False)["value"].tolist() == [1]


def test_folders_that_cannot_be_written(tmp_path):
    (tmp_path / "other.txt").touch()
    with pytest.raises(FileExistsError, match="a folder with other files"):
        pc.sweep(sweeps.square, {"x": [1]}, output=tmp_path, progress=False)
    with pytest.raises(FileExistsError, match="is a file"):
        pc.sweep(sweeps.square, {"x": [1]}, output=tmp_path / "other.txt", progress=False)
    with pytest.raises(OSError, match="cannot be written"):
        pc.sweep(sweeps.square, {"x": [1]}, output=tmp_path / "other.txt" / "out", progress=False)
    with pytest.raises(FileNotFoundError, match="holds no sweep"):
        pc.load_sweep(tmp_path)
    pc.sweep(sweeps.square, {"x": [1]}, output=tmp_path / "out", progress=False).close()
    about = json.loads((tmp_path / "out" / "sweep.json").read_text())
    (tmp_path / "out" / "sweep.json").write_text(json.dumps(about | {"format": "pycraft sweep 0"}))
    with pytest.raises(pc.EvaluationError, match="the format 'pycraft sweep 0'"):
        pc.load_sweep(tmp_path / "out")


def test_a_sweep_that_was_killed_while_it_began_can_begin_again(tmp_path):
    """Its folder has some of its own files and says nothing yet."""
    (tmp_path / "out" / "parts").mkdir(parents=True)
    for name in ("samples.parquet", "lock.sqlite", "sweep.json.new"):
        (tmp_path / "out" / name).write_bytes(b"half")
    (tmp_path / "out" / "lock.sqlite").write_bytes(b"")
    assert pc.sweep(sweeps.square, {"x": [2]}, output=tmp_path / "out", progress=False)["square"].tolist() == [4]


def test_samples_that_are_objects_are_known_again(tmp_path):
    samples = {"x": [Decimal("1.5"), Decimal("2.5")]}
    first = pc.sweep(sweeps.root_of, samples, output=tmp_path / "out", progress=False)
    first.close()
    assert pc.sweep(sweeps.root_of, samples, output=tmp_path / "out", progress=False).finished.all()
    with pytest.raises(pc.EvaluationError, match="with other samples"):
        pc.sweep(sweeps.root_of, {"x": [Decimal("1.5"), Decimal("3")]}, output=tmp_path / "out", progress=False)


def test_names_that_are_taken(tmp_path):
    for taken in ("x", "error", "seconds"):
        with pytest.raises(pc.EvaluationError, match=f"names a value '{taken}', a reserved name"):
            pc.sweep(lambda x, taken=taken: {taken: 1.0}, {"x": [1]}, progress=False)


def test_tables(tmp_path):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    result = pc.sweep(sweeps.square, {"x": [1.0, 2.0]}, progress=False)
    table = result.to_dataframe()
    assert list(table.columns) == ["x", "square", "powers[0]", "powers[1]", "powers[2]", "error", "seconds"]
    assert table["powers[2]"].tolist() == [1, 8] and table.index.name == "sample"
    data = result.to_xarray()
    assert data["powers"].dims[0] == "sample" and data["square"].coords["x"].values.tolist() == [1, 2]
