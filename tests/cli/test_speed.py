"""`pycraft bench --peers`: what it makes of a run. That figures are fast is measured, not tested."""

import json
import os
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import pycraft as pc
from pycraft.cli import bench_peers, speed_page, speed_plot
from pycraft.cli.bench import Figure
from pycraft.cli.commands import app
from pycraft.peers import speed
from pycraft.peers.clock import Time
from pycraft.peers.compiled_speed import CompiledRow

runner = CliRunner()


def row(call="forward_dynamics", model="chain of 100", nv=100, kernel=2.0, theirs=7.0, **peers):
    others = {"Pinocchio": Time(theirs, theirs), **{name: Time(t, t) for name, t in peers.items()}}
    return speed.Row(model, nv, call, Time(kernel / 2, kernel), Time(kernel, kernel + 1), others, Time(1.0, theirs - 1))


def measured():
    """A run of chains and a robot, as if it had been measured."""
    rows = [row(call, f"chain of {n}", n, n * 1e-2, n * 1e-1 + 1) for call in speed.GOALS for n in (10, 30, 100, 300)]
    rows += [row(call, "UR5", 6, 1.0, 2.6, MuJoCo=2.0) for call in speed.GOALS]
    rows.append(speed.Row("chain of 1000", 1000, "forward_dynamics", Time(9.0, 10.0), Time(10.0, 11.0)))
    batches = [speed.BatchRow("UR5", 6, Time(0.4, 0.5), Time(0.3, 0.4), (5.0, 12.0)), speed.BatchRow("A", 9, Time(1, 1), Time(1, 1))]
    compiled = [CompiledRow("UR5", 6, "forward_dynamics", 1984, 1.26, Time(0.3, 0.32), Time(0.5, 0.6), Time(0.7, 0.8), Time(1.5, 1.6))]
    compiled.append(CompiledRow("A", 9, "mass_matrix", 10, 0.5, Time(1, 1), Time(1, 1), Time(1, 1), None))
    return speed.Measured({"processor": "P", "instruction set": "avx2", "cores": "one"}, rows, batches, ["Talos: no file"], compiled)


COSTS = [Figure("ud over fast", 5.0, "x", 3.5, "note"), Figure("quad over fast", 90.0, "x", 160.0), Figure("single", 0.5, "x")]


def test_the_page_says_what_was_measured():
    text = speed_page.page(measured(), COSTS)
    assert "| UR5 | 6 | 1 | 1.6 | 1.6 ✗ | 2 | 2.6 | 2 | 1 ✗ |" in text
    assert "| chain of 300 | 300 | 3 | 30 | 10 ✓ | 4 | 31 |  | 7.75 ✓ |" in text
    assert "| chain of 1000 | 1000 | 10 |  |  | 11 |  |  |  |" in text
    assert "| forward dynamics | 3 | 4 of 5 | 1.6 to 10 | 2 |" in text
    assert "| UR5 | 6 | 0.5 | 5 ✗ | 0.4 | 12 ✓ |" in text and "| A | 9 | 1 |  | 1 |  |" in text
    assert (
        "| ud over fast | 5 | 3.5 ✗ | note |" in text and "| quad over fast | 90 | 160 ✓ |  |" in text and "| single | 0.5 |  |  |" in text
    )
    assert "| forward dynamics | 1.00 |" in text and "`mj_inverse`" in text and "Drake" not in text
    assert "| UR5 | 6 | forward dynamics | 1,984 | 1.3 | 0.32 | 0.8 | 2.5 | 1.6 | 5 | 0.6 |" in text
    assert "| A | 9 | mass matrix ℳ | 10 | 0.5 | 1 | 1 | 1 |  |  | 1 |" in text
    assert "- processor: P\n- instruction set: avx2\n" in text and "- Talos: no file" in text


def test_every_call_has_its_words():
    assert list(speed_page.CALLS) == list(speed.GOALS) == list(speed_page.COMPARED)
    assert set(speed.BATCH_GOALS) >= set(pc._core.instruction_sets())


def test_numbers_are_read_at_a_glance():
    assert [speed_page.number(x) for x in (None, 0.12345, 12.345, 999.4, 12345.6, 2.5e6)] == [
        "", "0.123", "12.3", "999", "12,346", "2.5e+06",
    ]  # fmt: skip


def test_a_plot_is_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    speed_plot.plot(measured(), tmp_path / "cost.png")
    assert (tmp_path / "cost.png").read_bytes()[:4] == b"\x89PNG"
    speed_plot.plot(speed.Measured({}), tmp_path / "empty.svg")  # a run without chains has panels, and nothing in them
    assert "<svg" in (tmp_path / "empty.svg").read_text()


def test_the_page_in_the_docs_has_the_parts_of_a_page():
    written = (Path(__file__).parents[2] / "docs" / "performance.md").read_text()
    parts = [line for line in speed_page.page(measured(), COSTS).splitlines() if line.startswith("#")]
    assert [line for line in written.splitlines() if line.startswith("#")] == parts and all(f"| {n} |" in written for n in ("UR5", "G1"))


def test_the_data_are_json():
    data = json.loads(json.dumps(measured().as_json()))
    first = data["rows"][0]
    assert first["kernel"] == {"minimum": 0.05, "median": 0.1} and first["peers"]["Pinocchio"]["median"] == 2.0
    assert first["ratio"] == 10.0 and first["goals"] == [3.0, 2.0] and first["met"] == [True, False]
    assert data["rows"][-1]["peer_kernel"] is None and data["unit"] == "microseconds"
    assert data["compiled"][0]["ratio"] == 5.0 and data["compiled"][0]["kernel"] == {"minimum": 0.3, "median": 0.32}
    assert data["compiled"][1]["peer_kernel"] is None
    assert data["exponents"]["ours"]["mass_matrix"] == pytest.approx(1.0) and data["batches"][0]["ratios"] == [5.0, 12.0]


def test_one_command_writes_all(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    asked = []
    monkeypatch.setattr(bench_peers, "other_packages", lambda leave_out: [])
    monkeypatch.setattr(
        bench_peers, "measured_apart", lambda seconds, quick, progress: asked.append((seconds, quick)) or (measured(), COSTS)
    )
    paths = {option: tmp_path / f"speed.{end}" for option, end in (("json", "json"), ("plot", "png"), ("page", "md"))}
    options = [text for option, path in paths.items() for text in (f"--{option}", str(path))]
    done = runner.invoke(app, ["bench", "--peers", "--quick", "--seconds", "0.5", *options])
    assert done.exit_code == 0 and asked == [(0.5, True)], done.output
    assert "chain of 1000" in done.output and "1.6 ✗" in done.output and "left out: Talos: no file" in done.output
    data = json.loads(paths["json"].read_text())
    assert data["accuracy"][0]["passed"] is False and len(data["rows"]) == len(measured().rows)
    assert paths["page"].read_text() == speed_page.page(measured(), COSTS) and paths["plot"].stat().st_size > 10_000
    for option, path in paths.items():
        assert f"wrote {path}" in done.output.replace("\n", ""), option


def test_a_package_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    done = runner.invoke(app, ["bench", "--peers"])
    assert done.exit_code == 2
    assert "needs the package pinocchio, which is not installed: pip install 'pycraft-soa[peers]'" in done.output.replace("\n", " ")


@pytest.mark.parametrize("options", [["--json", "x.json"], ["--plot", "x.png"], ["--page", "x.md"], ["--quick"]])
def test_files_are_of_peers(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = runner.invoke(app, ["bench", *options])
    assert done.exit_code == 2 and not list(tmp_path.iterdir())


@pytest.mark.parametrize("options", [["--json", "none/x.json"], ["--plot", "x.words"], ["--page", "."]])
def test_where_files_go_is_known_before_measuring(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(bench_peers, "measured_apart", lambda *_: pytest.fail("measured"))
    done = runner.invoke(app, ["bench", "--peers", *options])
    assert done.exit_code == 2 and options[0] in done.output


def test_a_process_that_dies_is_said(monkeypatch):
    monkeypatch.setattr(bench_peers, "_measure_and_send", print)  # it returns and has sent nothing
    environment = dict(os.environ)
    with pytest.raises(pc.EvaluationError, match="the process that measures ended with status 0 before it was done"):
        bench_peers.measured_apart(0.0, True, lambda text: None)
    assert dict(os.environ) == environment


@pytest.mark.peers
def test_an_error_of_the_process_arrives():
    pytest.importorskip("pinocchio")
    with pytest.raises(TypeError):
        bench_peers.measured_apart("long", True, lambda text: None)
