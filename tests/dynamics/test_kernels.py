"""Kernels of direct calls (cpp/kernels): one state and packs of states give the same bits, and what other instruction sets, the general
recursions and wider precisions give to rounding, for every kind of hinge."""

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import pycraft as pc
from pycraft import reference
from support import kernel_cases
from support.kernel_cases import MODELS, STATES, calls, states

EPS = np.finfo(float).eps


@pytest.fixture(params=list(MODELS))
def model(request):
    model = MODELS[request.param]
    model.gravity = (0.4, -1.0, -9.0)
    return model


def test_a_batch_is_its_states(model):
    Q, V, U = states(model)
    for precision in ("double", "single") if model.name != "chain of 30" else ("double",):
        for count in (STATES, 3, 2, 1):
            together = calls(model, Q[:count], V[:count], U[:count], precision=precision)
            for b in range(count):
                for name, alone in calls(model, Q[b], V[b], U[b], precision=precision).items():
                    np.testing.assert_array_equal(together[name][b], alone, err_msg=f"{name}, state {b} of {count}, {precision}")


def test_wider_precisions_agree(model):
    """Forward errors: rounding of n sums of up to 6 products, times the condition of what is solved."""
    Q, V, U = states(model)
    if not model.nv:
        return
    exact, own = calls(model, Q, V, U, precision="extended"), calls(model, Q, V, U)
    condition = np.linalg.cond(exact["mass_matrix"]).max()
    size = 40 * model.nv * EPS
    for name, value in own.items():
        bound = size * (condition if name.startswith(("forward_dynamics", "mass_matrix_inverse", "operational_space")) else 1)
        assert np.abs(value - exact[name]).max() <= bound * np.abs(exact[name]).max(), name


def test_jacobians_and_poses(model):
    """Every body, and nodes off a body and off the base: a batch equals its states, and is as exact as sums of 6 products on the path."""
    turned = np.array([[0, -1, 0], [0.6, 0, -0.8], [0.8, 0, 0.6]])
    nodes = {"off a body": [None, *model.bodies][-1], "off the base": None}
    for name, body in nodes.items():
        if name not in model.nodes:
            model.add_node(name, body, position=(0.3, -0.2, 0.5), rotation=turned)
    Q = states(model)[0]
    size = 40 * max(model.nv, 1) * EPS
    for frame in (*model.bodies, *nodes):
        J, X = model.jacobian(frame, Q), model.pose(frame, Q)
        assert (J.shape, X.shape) == ((STATES, 6, model.nv), (STATES, 4, 4))
        exact = model.jacobian(frame, Q, precision="quad")
        assert np.abs(J - exact).max(initial=0) <= size * np.abs(exact).max(initial=0)
        for b in range(STATES):
            np.testing.assert_array_equal(model.jacobian(frame, Q[b]), J[b])
            np.testing.assert_array_equal(model.pose(frame, Q[b]), X[b])
    description = model.description()
    for frame in nodes:
        placed = reference.node_pose(description, frame, Q[0])
        assert np.abs(model.pose(frame, Q[0]) - placed).max() <= size * np.abs(placed).max()


def test_general_recursions_agree(model):
    """`on_singular="minimum-norm"` is not a plain case, and at regular states it changes nothing."""
    if not model.nv:
        return
    Q, V, U = states(model)
    size = 40 * model.nv * EPS * np.linalg.cond(model.mass_matrix(Q)).max()
    for call, given in (("forward_dynamics", (Q, V, U)), ("mass_matrix_inverse", (Q,))):
        general, own = getattr(model, call)(*given, on_singular="minimum-norm"), getattr(model, call)(*given)
        assert np.abs(general - own).max() <= size * np.abs(general).max()


def test_matrices_are_symmetric_to_the_bit(model):
    Q = states(model)[0]
    for matrix in (model.mass_matrix(Q), model.mass_matrix_inverse(Q)):
        np.testing.assert_array_equal(matrix, matrix.transpose(0, 2, 1))


KEPT = """
import sys
sys.path.insert(0, {folder!r})
import numpy as np
import pycraft as pc
from pycraft import reference
from support.kernel_cases import MODELS, STATES, calls, states
kept = {{}}
for model in MODELS.values():
    model.gravity = (0.4, -1.0, -9.0)
    for precision in ("double", "single"):
        for count in (1, STATES):
            try:
                of = calls(model, *states(model, count), precision=precision)
            except pc.Error as e:
                of = {{"error": np.array(str(e))}}
            kept.update({{f"{{model.name}}/{{precision}}/{{count}}/{{name}}": x for name, x in of.items()}})
np.savez({file!r}, **kept)
print(pc.instruction_set())
"""


def run_with(instruction_set, text):
    environment = {**os.environ, "PYCRAFT_ISA": instruction_set}
    return subprocess.run([sys.executable, "-c", text], env=environment, capture_output=True, text=True, timeout=300)


def test_instruction_sets_agree(tmp_path):
    """To the bit those that fuse a product with the sum it goes into, all but the baseline of x86-64; those two to rounding."""
    from pycraft import _core

    there = _core.instruction_sets()
    assert there[0] == "baseline"
    kept = {}
    for name in there:
        file = tmp_path / f"{name}.npz"
        done = run_with(name, KEPT.format(folder=pathlib.Path(kernel_cases.__file__).parents[1].as_posix(), file=file.as_posix()))
        assert done.returncode == 0, done.stderr
        assert done.stdout.strip() == name
        kept[name] = dict(np.load(file))
    for name in there[2:]:
        for case, value in kept[name].items():
            np.testing.assert_array_equal(value, kept[there[1]][case], err_msg=f"{name}: {case}")
    for name in there[1:]:
        assert kept[name].keys() == kept["baseline"].keys()
        for case, value in kept[name].items():
            baseline, (model, precision, count, call) = kept["baseline"][case], case.split("/")
            if call == "error" or not value.size:
                np.testing.assert_array_equal(value, baseline, err_msg=f"{name}: {case}")
                continue
            of = MODELS[model]
            size = 80 * of.nv * np.finfo(precision).eps  # twice what each is off by, see test_wider_precisions_agree
            if call.startswith(("forward_dynamics", "mass_matrix_inverse")) and "derivatives" not in call:
                size *= np.linalg.cond(of.mass_matrix(states(of, int(count))[0])).max()
            assert np.abs(value - baseline).max() <= size * np.abs(baseline).max(), f"{name}: {case}"


REFINED = """
import sys
sys.path.insert(0, {folder!r})
import numpy as np
from support.kernel_cases import MODELS, states
model = next(m for m in MODELS.values() if m.nv > 3)
Q, V, U = states(model, 3)
kept = {{form: model.forward_dynamics(Q, V, U, form=form, refine=1) for form in ("fast", "ud", "square-root")}}
np.savez({file!r}, exact=model.forward_dynamics(Q, V, U, precision="quad"), **kept)
"""


def test_refined_calls_without_kernels(tmp_path):
    """The baseline of x86-64 has kernels for the plain calls alone; the recursions refine there, as exactly."""
    file = tmp_path / "refined.npz"
    done = run_with("baseline", REFINED.format(folder=pathlib.Path(kernel_cases.__file__).parents[1].as_posix(), file=file.as_posix()))
    assert done.returncode == 0, done.stderr
    kept = dict(np.load(file))
    exact = kept.pop("exact")
    assert len(kept) == 3
    for form, accelerations in kept.items():
        assert np.abs(accelerations - exact).max() <= 1e-12 * np.abs(exact).max(), form


def test_an_unknown_instruction_set_is_named():
    done = run_with("sse9", "import pycraft as pc; pc.instruction_set()")
    assert done.returncode != 0
    assert "PYCRAFT_ISA is 'sse9'" in done.stderr
    assert "'baseline'" in done.stderr


def arm(tilt):
    """Two links whose second axis is off the first's by a turn about x."""
    model = pc.Multibody("tilted")
    rod = dict(mass=1.3, com=(0.4, 0.1, 0.2), inertia=np.diag([0.2, 0.3, 0.4]))
    model.add_body("upper", None, axis=(0, 0, 1), **rod)
    c, s = np.cos(tilt), np.sin(tilt)
    model.add_body("lower", "upper", axis=(0, 0, 1), position=(0.3, 0.4, 0.5), rotation=np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), **rod)
    assert model.nv == 2
    return model


@pytest.mark.parametrize("tilt", [0.0, 1e-16, 1e-15, 1e-14, 1e-9, 1e-3, np.pi / 2, np.pi / 2 + 1e-9, np.pi, -np.pi / 2])
def test_axes_near_a_coordinate_axis(tilt):
    model = arm(tilt)
    for seed in range(4):
        s = model.random_state(seed)
        exact = model.inverse_dynamics(s.q, s.v, (1.0, 2.0), precision="quad")
        assert np.abs(model.inverse_dynamics(s.q, s.v, (1.0, 2.0)) - exact).max() <= 64 * EPS * np.abs(exact).max()


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-9, 0.7, np.pi / 2, np.pi, 1e3, 5.2e5, 5.3e5, 1e15, 1e30])
def test_angles_of_any_size(angle):
    """The kernels' own sine is good to 2^19; beyond, the C library's: the angle is taken as it is, whatever its size."""
    model = arm(0.3)
    for q in ((0.2, angle), (0.2, -angle)):
        exact = model.mass_matrix(q, precision="100")
        assert np.abs(model.mass_matrix(q) - exact).max() <= 64 * EPS * np.abs(exact).max()
        np.testing.assert_array_equal(model.mass_matrix([q, (0.2, 0.3), q])[2], model.mass_matrix(q))


def test_no_state_and_no_coordinate():
    for model in (pc.robots.panda(), MODELS["welds only"]):
        Q, V, U = (np.zeros((0, n)) for n in (model.nq, model.nv, model.nv))
        for name, value in calls(model, Q, V, U).items():
            matrix = (model.nv, model.nv) if "matrix" in name or "derivatives" in name else (model.nv,)
            assert value.shape == (0, *((6, 6) if name.startswith("operational_space") else matrix))


def test_kernels_follow_the_model():
    """Data of the model cached by an earlier call are not used after an edit."""
    model = arm(0.3)
    q, v = (0.3, 0.4), (0.5, 0.6)
    before = model.bias_forces(q, v)
    model.gravity = (0, 0, -9.81)
    fallen = model.bias_forces(q, v)
    model.bodies["lower"].mass = 2.6
    heavier = model.bias_forces(q, v)
    assert np.abs(fallen - before).max() > 1e-3
    assert np.abs(heavier - fallen).max() > 1e-3
    exact = model.bias_forces(q, v, precision="quad")
    assert np.abs(heavier - exact).max() <= 64 * EPS * np.abs(exact).max()
