"""`pycraft view`: what is shown, what it says, and how it ends."""

import os
import re
import signal
import subprocess
import sys
from urllib.request import urlopen

import pytest
from typer.testing import CliRunner

import pycraft as pc
from pycraft.cli.commands import app
from pycraft.viewer import View

runner = CliRunner()


@pytest.fixture
def shown(monkeypatch):
    """The event that the command would wait for."""
    seen = []
    monkeypatch.setattr(View, "wait", lambda view: seen.append((view, view.session.setup(), view.session.live.q.tolist())))
    monkeypatch.setattr("webbrowser.open", lambda address: seen.append(address))
    return seen


def test_a_robot_with_effects(shown):
    result = runner.invoke(app, ["view", "panda", "--effect", "gravity", "--effect", "damping:0.5", "--seed", "3"])
    assert result.exit_code == 0, result.output
    address, (view, setup, q) = shown
    assert address == view.address and f"panda at {address} (this machine only); Ctrl-C ends it" in result.output
    assert [effect["name"] for effect in setup["effects"]] == ["gravity", "damping"]
    assert q == pc.robots.panda().random_state(3).q.tolist() and repr(view).endswith("closed>")


def test_a_file_beside_another(shown, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pc.mechanisms.double_pendulum().save("scene.toml")
    result = runner.invoke(app, ["view", "scene.toml", "--beside", "double_pendulum", "--no-browser"])
    assert result.exit_code == 0, result.output
    ((view, setup, _),) = shown
    assert setup["ghost_name"] == "beside"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing.toml"], "nothing.toml: cannot be read: No such file"),
        (["panda", "--effect", "wind"], "wind"),
        (["panda", "--port", "70000"], "port=70000"),
        (["panda", "--seed", "-1"], "--seed -1"),
    ],
)
def test_refusals(shown, arguments, words):
    result = runner.invoke(app, ["view", *arguments])
    assert result.exit_code == 2 and words in result.output and not shown


def test_it_is_served_until_it_is_interrupted():
    command = [sys.executable, "-m", "pycraft.cli", "view", "double_pendulum", "--no-browser"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, "COLUMNS": "200"})
    try:
        said = process.stderr.readline()
        address = re.search(r"http://127.0.0.1:\d+/", said)[0]
        assert b"double pendulum" in urlopen(address, timeout=20).read()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 0 and process.stderr.read() == ""
    finally:
        process.kill()
        process.wait()
        process.stderr.close()
