"""The robots that come with the package: they load silently, and every direct call agrees with the oracle.

Tolerance: 100 N eps relative to the largest entry, N bodies, as each result is a sum handed through at most N bodies; times
the condition number of the mass matrix where one is inverted.
"""

import pickle
import warnings

import numpy as np
import pytest

import pycraft as pc
from support.oracle import reference

ROBOTS = pc.robots.names()
EPS = np.finfo(float).eps


def robot(name, **options):
    return getattr(pc.robots, name)(**options)


def close(actual, expected, tolerance):
    assert actual.shape == expected.shape
    error, size = np.abs(actual - expected).max(), np.abs(expected).max()
    assert error <= tolerance * size, f"error {error:.2e} against {size:.2e}, tolerance {tolerance:.1e}"


@pytest.mark.parametrize("name", ROBOTS)
def test_loads_without_options_and_silently(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = robot(name)
        assert model.soa.phi is not None
    assert model.name == name
    assert not model.gravity.any()  # an effect: nobody set it
    assert robot(name).description()["bodies"][0]["name"] == next(iter(model.bodies))


@pytest.mark.parametrize(
    ("name", "moving", "nv", "mass", "first_hinge"),
    [
        ("puma560", 6, 6, 23.45, "joint1"),
        ("panda", 7, 7, 16.691901, "panda_joint1"),
        ("ur5", 6, 6, 21.0489, "shoulder_pan_joint"),
        ("a1", 13, 18, 13.741, "root"),
        ("g1", 30, 35, 33.34114202, "root"),
    ],
)
def test_sizes_and_masses_are_those_of_the_table(name, moving, nv, mass, first_hinge):
    model = robot(name)
    assert (len(model.bodies), model.nv, next(iter(model.hinges))) == (moving, nv, first_hinge)
    assert sum(body.mass for body in robot(name, welds="keep").bodies.values()) == pytest.approx(mass, rel=1e-12)


def test_every_function_has_its_source_in_its_docstring():
    for name in ROBOTS:
        assert "Source:" in getattr(pc.robots, name).__doc__ and "nv " in getattr(pc.robots, name).__doc__


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ROBOTS)
def test_agrees_with_the_oracle(name, seed):
    model = robot(name)
    model.gravity = (0.3, -0.2, -9.81)
    description, state = model.description(), model.random_state(seed)
    q, v = state.q, state.v
    vdot = np.random.default_rng(seed).uniform(-1, 1, model.nv)
    rounding = 100 * len(model.bodies) * EPS
    mass_matrix = reference.mass_matrix(description, q)
    condition = np.linalg.cond(mass_matrix)
    tau = reference.inverse_dynamics(description, q, v, vdot)
    close(model.mass_matrix(q), mass_matrix, rounding)
    close(model.inverse_dynamics(q, v, vdot), tau, rounding)
    close(model.bias_forces(q, v), reference.bias_forces(description, q, v), rounding)
    close(model.forward_dynamics(q, v, tau), reference.forward_dynamics(description, q, v, tau), rounding * condition)
    close(model.forward_dynamics(q, v, tau), vdot, rounding * condition)
    close(model.mass_matrix_inverse(q), reference.mass_matrix_inverse(description, q), rounding * condition)
    energy = reference.kinetic_energy(description, q, v)
    assert float(model.kinetic_energy(q, v)) == pytest.approx(energy, rel=rounding)
    for frame in [*model.nodes][-1:] + [*model.bodies][-1:]:
        close(model.pose(frame, q), reference.node_pose(described_as_node(description, frame), frame, q), rounding)
        if frame in model.bodies or model.nodes[frame].body is not None:
            jacobian = reference.node_jacobian(described_as_node(description, frame), frame, q)
            close(model.jacobian(frame, q), jacobian, rounding)


def described_as_node(description, frame):
    """The description with a node at a body's own frame, which the oracle wants."""
    names = [body["name"] for body in description["bodies"]]
    if frame not in names:
        return description
    node = {"name": frame, "body": names.index(frame), "rotation": np.eye(3), "position": np.zeros(3)}
    return description | {"nodes": [*description["nodes"], node]}


@pytest.mark.parametrize("name", ROBOTS)
def test_kept_welds_give_the_same_mechanics(name):
    lumped, kept = robot(name), robot(name, welds="keep")
    assert lumped.coordinate_names == kept.coordinate_names
    lumped.gravity = kept.gravity = (0, 0, -9.81)
    state = lumped.random_state(4)
    rounding = 100 * len(kept.bodies) * EPS
    close(kept.mass_matrix(state.q), lumped.mass_matrix(state.q), rounding)
    close(kept.bias_forces(state.q, state.v), lumped.bias_forces(state.q, state.v), rounding)


def test_fixed_root_of_a_floating_robot():
    model = pc.robots.a1(root="fixed")
    assert model.nv == 12 and "root" not in model.hinges and model.nodes["trunk"].body is None
    assert pc.robots.panda(root="free").nv == 13


def test_puma_is_the_published_one():
    """The toolbox's printed inertia(qn) and gravload(qn): see docs/robots.md. Joint 3 stands at -180 degrees instead of 180."""
    puma = pc.robots.puma560()
    q = np.array([0, np.pi / 4, -np.pi, 0, np.pi / 4, 0])
    printed = [
        [3.6594, -0.4044, 0.1006, -0.0025, 0.0000, 0.0000],
        [-0.4044, 4.4137, 0.3509, 0.0000, 0.0024, 0.0000],
        [0.1006, 0.3509, 0.9378, 0.0000, 0.0015, 0.0000],
        [-0.0025, 0.0000, 0.0000, 0.1925, 0.0000, 0.0000],
        [0.0000, 0.0024, 0.0015, 0.0000, 0.1713, 0.0000],
        [0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.1941],
    ]
    np.testing.assert_allclose(puma.mass_matrix(q), printed, atol=5.1e-5)
    puma.gravity = (0, 0, -9.81)
    np.testing.assert_allclose(puma.bias_forces(q, np.zeros(6)), [0, 31.6399, 6.0351, 0, 0.0283, 0], atol=5.1e-5)
    assert puma.hinges["joint2"].rotor_inertia == pytest.approx([200e-6 * 107.815**2])


def test_limits_are_kept():
    model = pc.robots.panda()
    lower, upper = model.hinges["panda_joint4"].limits
    assert (lower[0], upper[0]) == (-3.0718, -0.0698)
    q = model.random_state(1).q[model.hinges["panda_joint4"].q_slice]
    assert lower[0] <= q[0] <= upper[0]


@pytest.mark.parametrize("name", ROBOTS)
def test_pickles(name):
    model = robot(name)
    copy = pickle.loads(pickle.dumps(model))
    state = model.random_state(2)
    assert np.array_equal(copy.mass_matrix(state.q), model.mass_matrix(state.q))
    assert list(copy.nodes) == list(model.nodes) and list(copy.hinges) == list(model.hinges)


@pytest.mark.parametrize("name", ROBOTS)
def test_shapes_show_every_body_where_it_is(name):
    """Each moving body has shapes, and its own centre of mass lies within 15 cm of one; they are drawn without another package."""
    from pycraft.view.solids import solids, triangles

    model = robot(name, welds="keep", root="fixed")
    on = {}
    for shape in model.shapes:
        vertices = triangles(shape)[0] @ shape.placement[:3, :3].T + shape.placement[:3, 3]
        on.setdefault(shape.body, []).append(vertices)
    bare = {
        "imu_link",
        "logo_link",
        "head_link",
        "pelvis_contour_link",
        "waist_roll_link",
        "panda_link8",
        "left_rubber_hand",
        "right_rubber_hand",
    }
    for body_name, body in model.bodies.items():
        if body_name in bare or body.hinge.kind == "weld":
            continue
        assert body_name in on, body_name
        if body.mass:
            gap = min(np.linalg.norm(np.maximum(0, np.maximum(v.min(0) - body.com, body.com - v.max(0)))) for v in on[body_name])
            assert gap < 0.15, (body_name, gap)
    made, missing = solids(robot(name))
    assert not missing and len(made) == len(model.shapes) > 20
    assert all(shape.colour is not None for shape in model.shapes) and not model.collision_shapes


def test_robots_are_small_files():
    from importlib.resources import files

    sizes = [file.stat().st_size for file in files("pycraft.models.robots").iterdir() if file.is_file()]
    assert sum(sizes) < 500_000
