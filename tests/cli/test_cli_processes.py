"""Commands as processes: results on stdout, everything else on stderr, every failure one line and an exit status."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

LINK = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
WARNED = LINK.replace('izz="1"', 'izz="9"')  # violates the triangle inequality
MARKUP = (
    f'<robot name="[/bold] [red]x"><link name="a[/b]"/><link name="b[/red]">{LINK}</link><link name="c">{WARNED}</link>'
    '<joint name="j[/x]" type="revolute"><parent link="a[/b]"/><child link="b[/red]"/><axis xyz="0 0 1"/><dynamics damping="1"/></joint>'
    '<joint name="[k]" type="revolute"><parent link="b[/red]"/><child link="c"/><axis xyz="1 0 0"/></joint></robot>'
)


def pycraft(*arguments, stdout=subprocess.PIPE, **environment):
    """A command in a process of its own, in an environment without colours."""
    command = [sys.executable, "-m", "pycraft.cli", *arguments]
    environment = {**os.environ, "PYTHONIOENCODING": "utf-8", "NO_COLOR": "1", **environment}
    return subprocess.run(command, stdout=stdout, stderr=subprocess.PIPE, env=environment, timeout=300, encoding="utf-8")


def refused(done, status, words):
    """One line on stderr, nothing on stdout."""
    assert done.returncode == status, (done.returncode, done.stderr[-2000:])
    assert not done.stdout
    lines = done.stderr.splitlines()
    assert len(lines) == 1 and lines[0].startswith("error: ") and words in lines[0], done.stderr


@pytest.fixture
def odd(tmp_path):
    path = tmp_path / "odd.urdf"
    path.write_text(MARKUP)
    return str(path)


def test_json_stands_alone_on_stdout(odd):
    """Warnings about the file went there too; names that look like markup ended the command."""
    done = pycraft("check", odd, "--json", "--states", "0")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["model"] == "[/bold] [red]x"
    assert "triangle inequality" in done.stderr and "joint damping" in done.stderr


def test_names_that_look_like_markup(odd):
    done = pycraft("check", odd, "--states", "0")
    assert done.returncode == 0, done.stderr
    assert "[/bold] [red]x: " in done.stdout
    assert "warning: " in done.stderr and "warning: " not in done.stdout


@pytest.mark.slow
def test_tour_of_names_that_look_like_markup(odd):
    done = pycraft("tour", odd)
    assert done.returncode == 0, done.stderr
    assert "b[/red]" in done.stdout and "j[/x]" in done.stdout


def test_an_ascii_terminal():
    done = pycraft("check", "panda", "--states", "0", "--all", PYTHONIOENCODING="ascii", LC_ALL="C")
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii() and "\\u03c6" in done.stdout  # φ, escaped and not lost


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("check panda --seed -1", "--seed -1: a whole number, 0 or more"),
        ("check panda --states -1", "--states -1: a whole number, 0 or more"),
        ("check panda --precision 7", "precision"),
        ("check panda --precision ²", "precision"),
        ("check nowhere.urdf", "nowhere.urdf: cannot be read: No such file"),
        ("stability --case nowhere", "no hard case has 'nowhere'"),
        ("nonsense", "No such command 'nonsense'; "),
        ("--nonsense", "No such option"),
        ("check", "Missing argument"),
        ("check panda --states many", "--help says what there is"),
    ],
)
def test_options(arguments, words):
    refused(pycraft(*arguments.split()), 2, words)


def test_errors_of_several_lines_are_one(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text('<robot name="r"><link name="a\nb"/><link name="c"/></robot>')
    refused(pycraft("check", str(path)), 2, "2 links have no parent")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.slow
def test_a_full_disk():
    with open("/dev/full", "w") as full:
        done = pycraft("check", "panda", "--states", "0", stdout=full)
    lines = done.stderr.splitlines()
    assert done.returncode == 2 and lines == ["error: the output: No space left on device"], done.stderr
    with open("/dev/full", "w") as full:
        refused(pycraft("--help", stdout=full), 2, "No space left on device")
    done = pycraft(
        "accuracy", "ur5", "--seconds", "0", "--method", "articulated", "--form", "fast", "--precision", "double", "--csv", "/dev/full"
    )
    assert done.returncode == 2 and done.stderr.splitlines()[-1].startswith("error: ") and "No space left" in done.stderr


def test_an_output_that_is_closed():
    command = f'"{sys.executable}" -m pycraft.cli check panda >&-'
    done = subprocess.run(command, shell=True, stderr=subprocess.PIPE, text=True, timeout=300)
    assert done.returncode == 2 and done.stderr.splitlines() == ["error: the output is closed"]


@pytest.mark.slow
def test_a_reader_that_has_seen_enough():
    code = (
        "import subprocess, sys\np = subprocess.Popen([sys.executable, '-m', 'pycraft.cli', 'check', 'panda', '--states', '0'],"
        " stdout=subprocess.PIPE, stderr=subprocess.PIPE)\np.stdout.close(); print(p.stderr.read().decode()); sys.exit(p.wait())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 1 and not done.stdout.strip()


@pytest.mark.parametrize(
    ("package", "arguments", "words"),
    [
        ("pinocchio", ["peers"], "needs the package pinocchio, which is not installed: pip install 'pycraft-soa[peers]'"),
        ("jupyterlab", ["lab"], "the lab needs the package jupyterlab, which is not installed: pip install 'pycraft-soa[lab]'"),
        ("mujoco", ["check", "{odd}.xml"], "by the package mujoco, which is not installed: pip install 'pycraft-soa[mjcf]'"),
    ],
)
def test_packages_that_are_not_there(tmp_path, package, arguments, words):
    """Hidden from the process by a finder that knows nothing of them."""
    hide = tmp_path / "sitecustomize.py"
    hide.write_text(
        f"import sys\nclass Hidden:\n    def find_spec(self, name, *_):\n        if name.split('.')[0] == {package!r}:\n"
        "            raise ModuleNotFoundError(name)\nsys.meta_path.insert(0, Hidden())\n"
    )
    model = tmp_path / "m.xml"
    model.write_text("<mujoco/>")
    given = [a.replace("{odd}.xml", str(model)) for a in arguments]
    refused(pycraft(*given, PYTHONPATH=str(tmp_path)), 2, words)


def test_what_nobody_expected_is_a_line_too(tmp_path):
    fault = tmp_path / "sitecustomize.py"
    fault.write_text(
        "import pycraft.identities.checker as c\ndef broken(*a, **k):\n    raise ZeroDivisionError('one\\ntwo')\nc.check_model = broken\n"
    )
    done = pycraft("check", "panda", PYTHONPATH=str(tmp_path))
    refused(done, 70, "unexpected ZeroDivisionError: one two; PYCRAFT_TRACEBACK=1 shows where")
    assert "Traceback" in pycraft("check", "panda", PYTHONPATH=str(tmp_path), PYCRAFT_TRACEBACK="1").stderr
