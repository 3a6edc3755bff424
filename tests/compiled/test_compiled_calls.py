"""Direct calls compiled for one model: what they do for every kind of hinge, and how the callable behaves."""

import re
import subprocess
import sys

import numpy as np
import pytest

import pycraft as pc
from pycraft.compiled.kernels import INPUTS, frame_graph, kernel_graph
from support import kernel_cases
from support.graphs import evaluated
from support.kernel_cases import MODELS, STATES, calls

EPS = np.finfo(float).eps
ALL = [*INPUTS, "jacobian", "pose"]


@pytest.fixture(scope="module", autouse=True)
def libraries(tmp_path_factory):
    """A folder of their own: what a test compiles, it compiles."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYCRAFT_CACHE", str(tmp_path_factory.mktemp("libraries")))
        yield


def arm():
    model = pc.tree([-1, 0, 1, 1], ["screw", "ball", "pin", "slider"], seed=3, name="arm")
    model.gravity = (0.4, -1.0, -9.0)
    return model


def given(model, call, count=STATES):
    Q, V, U = kernel_cases.states(model, count)
    return {"q": Q, "v": V, "tau": U, "vdot": U}, [{"q": Q, "v": V, "tau": U, "vdot": U}[name] for name in INPUTS.get(call, ("q",))]


def bound(model, call, Q):
    """As in test_kernels: rounding of sums of nv terms, times the condition of what is solved."""
    condition = np.linalg.cond(model.mass_matrix(Q)).max() if call in ("forward_dynamics", "mass_matrix_inverse") and model.nv else 1
    return 40 * max(model.nv, 1) * EPS * condition


@pytest.mark.parametrize("name", MODELS)
def test_graphs_are_the_calls(name):
    model = MODELS[name]
    model.gravity = (0.4, -1.0, -9.0)
    Q, V, U = kernel_cases.states(model)
    for call, wanted in calls(model, Q, V, U).items():
        if call not in INPUTS:
            continue  # not compiled
        graph, results = kernel_graph(model, call)
        found, sound = evaluated(graph, results, {"q": Q, "v": V, "tau": U, "vdot": U})
        assert sound.all() and found.shape == wanted.shape
        assert np.abs(found - wanted).max(initial=0) <= bound(model, call, Q) * np.abs(wanted).max(initial=0), call


@pytest.mark.parametrize("name", MODELS)
def test_graphs_of_frames_are_the_calls(name):
    model = MODELS[name]
    Q, _, _ = kernel_cases.states(model)
    for frame in (*list(model.bodies)[-1:], *list(model.nodes)[:1]):
        for call in ("jacobian", "pose"):
            graph, results = frame_graph(model, call, frame, 10_000)
            found, _ = evaluated(graph, results, {"q": Q})
            wanted = getattr(model, call)(frame, Q)
            assert np.abs(found - wanted).max(initial=0) <= bound(model, call, Q) * np.abs(wanted).max(initial=1), (call, frame)


@pytest.mark.slow
@pytest.mark.parametrize("call", ALL)
def test_compiled_is_the_call(call):
    """Built and run: one state, batches with and without a remainder, one state beside a batch, out=."""
    model = arm()
    frame = {"frame": "body2"} if call in ("jacobian", "pose") else {}
    compiled = model.compile(call, **frame)
    _, arrays = given(model, call, 19)
    ordinary = model.prepare(call, batch=19, **frame)(*arrays)
    size = bound(model, call, arrays[0]) * np.abs(ordinary).max()
    for count in (19, 8, 3, 1, 0):
        found = compiled(*(a[:count] for a in arrays))
        assert found.shape == (count, *compiled.shape)
        assert np.abs(found - ordinary[:count]).max(initial=0) <= size
    for b in (0, 18):
        alone = compiled(*(a[b].copy() for a in arrays))
        assert np.abs(alone - ordinary[b]).max() <= size
        out = np.full_like(alone, np.nan)
        assert compiled(*(a[b].copy() for a in arrays), out=out) is out
        np.testing.assert_array_equal(out, alone)
    beside = compiled(arrays[0], *(a[0].copy() for a in arrays[1:]))
    assert np.abs(beside[0] - ordinary[0]).max() <= size
    assert compiled.arguments == INPUTS.get(call, ("q",)) and compiled.operations > 0 and compiled.library.exists()
    assert "evaluate" in compiled.source and call in repr(compiled)


@pytest.fixture(scope="module")
def accelerations():
    return arm().compile("forward_dynamics")


def test_what_is_not_plain_is_the_ordinary_call(accelerations):
    model = arm()
    _, (q, v, tau) = given(model, "forward_dynamics", 3)
    wanted = model.forward_dynamics(q, v, tau)
    for arrays in ([a.tolist() for a in (q, v, tau)], [np.asfortranarray(a) for a in (q, v, tau)]):
        np.testing.assert_array_equal(accelerations(*arrays), wanted)
    same = tau.copy()
    np.testing.assert_allclose(accelerations(q, v, same, out=same), wanted, rtol=1e-12)  # in the memory of an argument
    np.testing.assert_array_equal(
        accelerations(model.random_state(0), None, tau[0]), model.forward_dynamics(model.random_state(0), None, tau[0])
    )


def test_errors_are_the_ordinary_ones(accelerations):
    model = arm()
    _, (q, v, tau) = given(model, "forward_dynamics", 5)
    for bad in (np.nan, np.inf):
        for i in range(3):
            arrays = [q.copy(), v.copy(), tau.copy()]
            arrays[i][3, 1] = bad
            with pytest.raises(pc.ModelError) as ordinary:
                model.forward_dynamics(*arrays)
            with pytest.raises(pc.ModelError, match=re.escape(str(ordinary.value))):
                accelerations(*arrays)
    with pytest.raises(pc.ModelError):
        accelerations(q[:, :-1].copy(), v, tau)
    with pytest.raises(pc.ModelError):
        accelerations(q, v[:2].copy(), tau)
    with pytest.raises(pc.ModelError, match="out="):
        accelerations(q, v, tau, out=np.empty(3))
    with pytest.raises(TypeError, match="takes q, v, tau"):
        accelerations(q, v)
    q[2, 1:5] = 0  # a quaternion without direction
    with pytest.raises(pc.ModelError, match="quaternion"):
        accelerations(q, v, tau)


def test_a_singular_state_is_refused_as_usual():
    """Two sliders along one line where the pin between them is straight: the pivot is left in doubt."""
    model = pc.Multibody("in line")
    model.add_body("a", hinge="slider", axis=(1, 0, 0))
    model.add_body("b", "a", axis=(0, 0, 1), rotor_inertia=1.0)
    model.add_body("c", "b", hinge="slider", axis=(1, 0, 0), mass=1.0)
    compiled, none = model.compile("forward_dynamics"), np.zeros(3)
    bent = np.array([0.0, 1.0, 0.0])
    np.testing.assert_allclose(compiled(bent, none, none + 1), model.forward_dynamics(bent, none, none + 1), rtol=1e-13)
    nearly = np.array([0.0, 1e-9, 0.0])  # what is left of the mass is 1e-18 of it, and finite
    for q in (none + 0.0, nearly, np.array([bent, nearly])):
        with pytest.raises(pc.SingularHingeError):
            compiled(q, none, none)


def test_edits_do_not_show():
    model = pc.chain(2)
    compiled = model.compile("mass_matrix")
    before = model.mass_matrix([0.1, 0.2])
    model.bodies["body1"].mass = 7.0
    np.testing.assert_allclose(compiled(np.array([0.1, 0.2])), before, rtol=1e-14)
    np.testing.assert_allclose(compiled([0.1, 0.2]), before, rtol=1e-14)  # also by the ordinary call
    assert not np.allclose(model.mass_matrix([0.1, 0.2]), before)


def test_nothing_to_compute():
    model = MODELS["welds only"]
    assert model.compile("forward_dynamics")(np.empty(0), np.empty(0), np.empty(0)).shape == (0,)
    assert model.compile("mass_matrix")(np.empty((4, 0))).shape == (4, 0, 0)


def test_what_cannot_be_compiled():
    model = arm()
    with pytest.raises(pc.EvaluationError, match="'mass_matrix'"):
        model.compile("energy")
    with pytest.raises(pc.EvaluationError, match="frame="):
        model.compile("pose")
    with pytest.raises(pc.EvaluationError, match="no frame"):
        model.compile("mass_matrix", frame="body1")
    with pytest.raises(pc.ModelError, match="nobody"):
        model.compile("pose", frame="nobody")
    heavy = pc.Multibody("flywheel")
    heavy.add_body("ball", hinge="ball", mass=1.0, inertia=np.eye(3), rotor_inertia=[1.0, 0, 0])
    with pytest.raises(pc.ModelError, match="rotor"):
        heavy.compile("forward_dynamics")
    with pytest.raises(pc.EvaluationError, match="straight-line code"):
        pc.chain(400, seed=1).compile("mass_matrix")


def test_a_library_is_built_once():
    model = pc.chain(2)
    first = model.compile("bias_forces")
    stamp = first.library.stat().st_mtime_ns
    assert model.compile("bias_forces").library.stat().st_mtime_ns == stamp
    model.bodies["body1"].mass = 3.5
    assert model.compile("bias_forces").library != first.library


@pytest.mark.parametrize(
    ("variable", "value", "message"),
    [
        ("CXX", "no-such-compiler", "CXX='no-such-compiler' is not a command"),
        ("PATH", "", "no C.. compiler is on the path"),
        ("CXX", f"{sys.executable} -c 'raise SystemExit(3)'", "failed to build the source"),
        ("PYCRAFT_CACHE", "/dev/null/folder", "set PYCRAFT_CACHE"),
    ],
)
def test_without_a_compiler_or_a_place(variable, value, message, monkeypatch, tmp_path):
    monkeypatch.setenv("PYCRAFT_CACHE", str(tmp_path))
    if variable == "PATH":
        monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setenv(variable, value)
    with pytest.raises(pc.EvaluationError, match=message):
        pc.chain(1).compile("bias_forces")


def test_the_source_builds_without_a_word(tmp_path):
    """With the warnings that a careful user turns on."""
    source = tmp_path / "source.cpp"
    source.write_text(pc.chain(2).compile("forward_dynamics").source, encoding="utf-8")
    from pycraft.compiled.build import compiler

    done = subprocess.run(
        [
            *compiler(),
            "-std=c++20",
            "-O1",
            "-Wall",
            "-Wextra",
            "-Wno-psabi",
            "-Wno-unused-function",
            "-c",
            str(source),
            "-o",
            str(tmp_path / "o"),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0 and not done.stderr, done.stderr


@pytest.mark.parametrize("call", ["pose", "jacobian"])
def test_a_path_that_is_too_long_is_refused_by_name(call):
    with pytest.raises(pc.EvaluationError, match=rf"'body19999' needs more than 400000 operations.*; {call}\(\) takes models of any size"):
        pc.chain(20000).compile(call, frame="body19999")
