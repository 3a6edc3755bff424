"""`pycraft run`: scenes from files and from the command line, what is written, and what is refused before a run begins."""

import os
import re
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import pycraft as pc
from pycraft.cli.commands import app

runner = CliRunner()
E = pc.effects


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def scene(here):
    made = pc.Scene(pc.chain(3, seed=1)).add(E.Gravity(), E.Damping(0.3))
    made.run_options = {"T": 0.5, "rtol": 1e-8, "every": 0.1}
    made.save(here / "scene.toml")
    return made


def run(*arguments, status=0):
    result = runner.invoke(app, ["run", *map(str, arguments)])
    assert result.exit_code == status, result.output
    return result.output


def test_a_file_to_a_file(scene):
    """As the scene itself runs, bit for bit, at the times that the file says."""
    output = run("scene.toml", "-o", "run.nc")
    assert "wrote run.nc" in output and "on  damping: Damping(coefficient=0.3)" in output and "6 states kept" in output
    found = pc.load_run("run.nc")
    assert found.t.tolist() == pytest.approx([0, 0.1, 0.2, 0.3, 0.4, 0.5], abs=1e-15) and found.effects == ["gravity", "damping"]
    again = scene.simulate(0.5, rtol=1e-8, t_eval=found.t)
    assert np.array_equal(found.q, again.q) and np.array_equal(found.v, again.v)
    assert sorted(os.listdir()) == ["run.nc", "scene.toml"]


def test_options_go_before_those_of_the_file(scene):
    run("scene.toml", "-T", "0.2", "--every", "0.15", "--integrator", "rk4", "--step", "0.01", "--save", "other.toml", "-o", "run.csv")
    rows = np.genfromtxt("run.csv", delimiter=",", names=True)
    assert rows["t"].tolist() == [0.0, 0.15, 0.2]
    saved = pc.load_scene("other.toml")
    assert saved.run_options == {"T": 0.2, "rtol": 1e-8, "every": 0.15, "integrator": "rk4", "step": 0.01}
    assert list(saved.effects) == list(scene.effects)


LOOKED_AT = [("run.html", b"<!DOCTYPE html>"), ("run.glb", b"glTF"), ("run.usda", b"#usda"), ("run.gltf", b"{")]


@pytest.mark.parametrize("name, begins", LOOKED_AT)
def test_what_is_looked_at_is_written_by_its_ending(scene, name, begins):
    pytest.importorskip("pygltflib")
    pytest.importorskip("pxr")
    assert f"wrote {name}" in run("scene.toml", "-o", name)
    with open(name, "rb") as file:
        assert file.read().startswith(begins)


def test_a_package_that_is_missing_is_said_before_the_run(scene, monkeypatch):
    monkeypatch.setitem(sys.modules, "pygltflib", None)
    monkeypatch.setattr(pc.Scene, "simulate", lambda *_, **__: pytest.fail("simulated"))
    assert "pip install 'pycraft-soa[gltf]'" in run("scene.toml", "-o", "run.glb", status=2)


def test_a_robot_with_effects(here):
    effects = ["gravity", "damping:0.1", "spring:2, rest=0.1, hinges=panda_joint[12], name=coil"]
    output = run("panda", *(word for effect in effects for word in ("--effect", effect)), "-T", "0.2", "--plot")
    lines = [line for line in output.splitlines() if not line.startswith("warning: ")]
    assert "warning: coordinates of 'panda' left their limits, and no effect of this scene holds them: panda_joint4 reached" in output
    assert lines[:4] == [
        "scene of 'panda'", "  on  gravity: Gravity(g=(0.0, 0.0, -9.81))", "  on  damping: Damping(coefficient=0.1)",
        "  on  coil: Spring(stiffness=2, rest=0.1, hinges='panda_joint[12]')",
    ]  # fmt: skip
    assert "501 states kept" in output and "wrote panda.png" in output
    assert (here / "panda.png").read_bytes().startswith(b"\x89PNG") and os.listdir() == ["panda.png"]
    assert re.search(r"kinetic \+ potential - work within \d\.\de-\d\d J", output)


def test_effects_of_the_model_s_file(here):
    output = run("panda", "--from-model", "-T", "0.1")
    assert "on  damping: Damping(coefficient=[0.003," in output and "on  torque_source: TorqueSource(" in output
    assert "the file of 'chain of 2 rods' describes no effects" in run_of_a_file(here)


def run_of_a_file(here):
    pc.chain(2).save("chain.toml")
    return run("chain.toml", "--from-model", "-T", "0.1")


def test_models_mechanisms_and_seeds(here):
    """A model's file has no effects of its own; a mechanism is a scene; a seed begins at that state."""
    pc.chain(2, seed=1).save("arm.toml")
    assert run("arm.toml", "-T", "0.1").splitlines()[1] == "  empty"
    assert "gravity: Gravity" in run("double_pendulum", "-T", "0.1")
    run("panda", "-T", "0.1", "--seed", "3", "-o", "run.nc")
    assert np.array_equal(pc.load_run("run.nc").q[0], pc.robots.panda().random_state(3).q)
    assert "damping" in run("a1", "--root", "fixed", "--effect", "Damping:1", "-T", "0.01")


def test_effects_in_one_line():
    """Lists, texts, dictionaries and functions of time, as in a file."""
    from pycraft.scenes.effect_text import add_from_text

    scene = pc.Scene(pc.robots.panda())
    texts = {
        "gravity:[0, 0, -1.62]": E.Gravity([0, 0, -1.62]),
        'wrench:panda_link7,[0,0,0,0,0,1], "body"': E.Wrench("panda_link7", [0, 0, 0, 0, 0, 1], "body"),
        "damping:{panda_joint1 = 1, panda_joint2 = 2}": E.Damping({"panda_joint1": 1, "panda_joint2": 2}),
        "torque_source:{in_time='Harmonic', amplitude=1, frequency=2},panda_joint3": E.TorqueSource(E.Harmonic(1, 2), "panda_joint3"),
        "RotorInertia:0.1,gear_ratio=2": E.RotorInertia(0.1, gear_ratio=2),
        "node_spring:node_b=panda_link7,stiffness=3": E.NodeSpring(None, "panda_link7", 3),
    }
    for text in texts:
        add_from_text(scene, text, text)
    assert list(map(repr, scene.effects.values())) == list(map(repr, texts.values()))


@pytest.mark.parametrize(
    ("effect", "text"),
    [
        ("dampnig:0.1", "--effect dampnig:0.1: no effect is called 'dampnig'; did you mean 'damping'?"),
        ("damping", "--effect damping: effect 'damping' (Damping) needs coefficient; write coefficient = ..."),
        ("damping:much", "--effect damping:much, coefficient: effect 'damping': damping: coefficient is not an array of numbers"),
        ("damping:1,2,3", "--effect damping:1,2,3: damping has only 2 parameters, coefficient, hinges; remove '3'"),
        ("damping:coefficient=1,panda_joint1", "'panda_joint1' has no name but follows a named parameter; write hinges=panda_joint1"),
        ("damping:1,coefficient=2", "--effect damping:1,coefficient=2: coefficient is given twice"),
        ("damping:1,hinge=x", "effect 'damping' (Damping) has no key 'hinge'; did you mean 'hinges'?"),
        ("spring:1,hinges=panda_jiont4", "spring: no hinge or coordinate of 'panda' is called 'panda_jiont4'; did you mean 'panda_joint4'"),
        ("sampled:1", "effect 'sampled' calls a Python function, which a file cannot hold"),
    ],
)
def test_effects_that_are_refused(effect, text):
    output = run("panda", "--effect", effect, "-T", "1", status=2)
    assert text in " ".join(output.split()) and output.startswith("error: ") and "Traceback" not in output


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["nowhere.toml", "-T", "1"], "nowhere.toml: cannot be read: No such file"),
        (["panda"], "how long? give -T SECONDS, or a scene's file T in its table [run]"),
        (["panda", "-T", "1", "--every", "0"], "--every 0: a positive number of seconds"),
        (["panda", "-T", "1", "--every", "1e-12"], "--every 1e-12: 1e+12 states are more than memory holds"),
        (["panda", "-T", "1", "--seed", "-1"], "--seed -1: a whole number, 0 or more"),
        (["scene.toml", "--root", "free"], "--root belongs to models; a scene has its model with it"),
        (["pendulum", "--mimic", "lock"], "--mimic belongs to models; a scene has its model with it"),
        (["panda", "-T", "1", "-o", "run.txt"], "output 'run.txt': a run is written to a file that ends in .nc, .parquet, .csv"),
        (["panda", "-T", "1", "-o", "none/run.nc"], "--output none/run.nc: there is no folder none; make it first"),
        (["panda", "-T", "1", "--save", "none/scene.toml"], "--save none/scene.toml: there is no folder none; make it first"),
    ],
)
def test_refused_before_the_run(scene, arguments, text, monkeypatch):
    monkeypatch.setattr(pc.Scene, "simulate", lambda *_, **__: pytest.fail("it ran"))
    output = run(*arguments, status=2)
    assert text in " ".join(output.split()) and output.startswith("error: ")
    assert os.listdir() == ["scene.toml"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["-T", "-1"], "T=-1: a run lasts a positive number of seconds"),
        (["-T", "1", "--integrator", "rk5"], "no integrator is called 'rk5'"),
        (["-T", "1", "--integrator", "rk4"], "step"),
    ],
)
def test_refused_by_the_scene(arguments, text):
    assert text in run("panda", *arguments, "-o", "run.nc", status=2) and os.listdir() == []


def test_what_was_computed_before_an_error_is_written(here):
    """A pendulum whose stiff spring stops an integrator by steps of one size."""
    output = run("pendulum", "--effect", "torque_source:1e150", "-T", "1000", "--every", "0.01", "-o", "run.nc", status=2)
    assert "wrote run.nc up to" in output and "error: " in output
    found = pc.load_run("run.nc")
    assert 0 < len(found) and np.isfinite(found.q).all() and found.t[-1] < 1000
