"""Shapes through files and back: every kind, seen and colliding, meshes by reference, colours; what a format does not hold is named."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pycraft as pc
from pycraft.models.loaders.named_robots import example_robots
from pycraft.models.loaders.urdf import resolve_package
from pycraft.models.shapes import Shape
from support.saved_models import loaded

SIZES = {"box": (0.1, 0.2, 0.3), "sphere": (0.1,), "cylinder": (0.1, 0.5), "capsule": (0.05, 0.4), "ellipsoid": (0.1, 0.2, 0.3)}
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def placed(seed):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.random(random_state=seed).as_matrix(), np.random.default_rng(seed).normal(size=3)
    return X


@pytest.fixture
def arm(tmp_path):
    """Pins off their bodies' origins, a node, a base; a shape of every kind on each, seen and colliding."""
    arm = pc.Multibody("arm")
    arm.add_body("upper", axis=(0, 1, 0), point=(0.3, 0, 0), position=(0, 0, 1), mass=2, com=(0.1, 0, 0), inertia=np.diag([0.1, 0.2, 0.25]))
    arm.add_body("lower", "upper", hinge="slider", axis=(1, 0, 1), position=(1, 0, 0), mass=1, inertia=np.diag([0.1, 0.2, 0.25]))
    arm.add_node("tip", "lower", position=(0, 0.2, 0), rotation=placed(9)[:3, :3])
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "wedge.obj").write_text(TETRAHEDRON)
    beside = (str(tmp_path / "arm.urdf"), ())
    shapes = []
    for k, body in enumerate(("", "upper", "lower", "tip")):
        for i, (kind, size) in enumerate(SIZES.items()):
            purpose = ("visual", "collision")[(i + k) % 2]
            shapes.append(Shape(body, kind, size, placed(10 * k + i), "#ff8000" if purpose == "visual" else None, purpose=purpose))
        shapes.append(Shape(body, "mesh", (2.0, 1.0, 0.5), placed(k), "#0072b2", "meshes/wedge.obj", beside))
    arm._shapes = shapes
    return arm


def in_world(model, shape):
    return (model.pose(shape.body, model.zero_q()) if shape.body else np.eye(4)) @ shape.placement


def matched(model, again, keep):
    """Each shape of a model that a format holds, with the one of the loaded model that is at its place, of its kind and purpose."""
    for shape in filter(keep, model._shapes):
        X = in_world(model, shape)
        same = [other for other in again._shapes if (other.kind, other.purpose) == (shape.kind, shape.purpose)]
        near = min(
            same, key=lambda other: np.abs(in_world(again, other) - X).max() + np.abs(in_world(again, other)[:3, 3] - X[:3, 3]).max()
        )
        yield shape, near, X, in_world(again, near)


def test_urdf(arm, tmp_path):
    with pytest.warns(pc.ModelWarning, match=r"again\.urdf: shapes that were not written: 4 × ellipsoid \(URDF has none\)"):
        arm.save(tmp_path / "again.urdf")
    again = loaded(tmp_path / "again.urdf")
    assert len(again._shapes) == len(arm._shapes) - 4
    for shape, other, X, Y in matched(arm, again, lambda shape: shape.kind != "ellipsoid"):
        assert np.abs(X - Y).max() < 1e-14 and other.size == shape.size
        assert other.colour == shape.colour or shape.purpose == "collision"
        if shape.kind == "mesh":
            assert other.file == "meshes/wedge.obj" and resolve_package(other.file, *other.beside).samefile(
                tmp_path / "meshes" / "wedge.obj"
            )


def test_a_mesh_is_referred_to_from_another_folder(arm, tmp_path):
    (tmp_path / "deep" / "er").mkdir(parents=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        arm.save(tmp_path / "deep" / "er" / "arm.urdf")
    mesh = next(shape for shape in loaded(tmp_path / "deep" / "er" / "arm.urdf").shapes if shape.kind == "mesh")
    assert mesh.file == "../../meshes/wedge.obj" and resolve_package(mesh.file, *mesh.beside).exists()
    arm._shapes = [
        Shape("upper", "mesh", (1.0, 1.0, 1.0), np.eye(4), None, name)
        for name in ("model://robot/a.stl", "package://robot/b.stl", "gone.stl")
    ]
    arm.save(tmp_path / "packages.urdf")
    assert [shape.file for shape in loaded(tmp_path / "packages.urdf").shapes] == [
        "package://robot/a.stl",
        "package://robot/b.stl",
        "gone.stl",
    ]


@pytest.mark.peers
def test_mjcf(arm, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    arm.save(tmp_path / "again.xml")
    again = loaded(tmp_path / "again.xml")
    m = mujoco.MjModel.from_xml_path(str(tmp_path / "again.xml"))
    assert m.ngeom == len(arm._shapes) == len(again._shapes) and m.nmesh == 1
    q = arm.random_state(1).q
    assert np.abs(again.mass_matrix(q) - arm.mass_matrix(q)).max() < 1e-13  # geoms have no mass
    for shape, other, X, Y in matched(arm, again, lambda shape: shape.kind != "mesh"):
        assert np.abs(X - Y).max() < 1e-7 and np.allclose(
            other.size, shape.size, rtol=1e-14
        )  # colours and frames of geoms are doubles, axes are eigenvectors
        assert other.colour == shape.colour or shape.purpose == "collision"
    for shape in (shape for shape in arm._shapes if shape.kind == "mesh"):
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * shape.size
        X = in_world(arm, shape)
        expected = corners @ X[:3, :3].T + X[:3, 3]
        found = []
        for other in (
            other for other in again.shapes if other.kind == "mesh" and other.body == (shape.body if shape.body != "tip" else "lower")
        ):
            Y = in_world(again, other)
            found.append(other.triangles[0] @ Y[:3, :3].T + Y[:3, 3])
        assert min(np.abs(np.sort(one, axis=0) - np.sort(expected, axis=0)).max() for one in found) < 1e-5  # MuJoCo keeps floats


@pytest.mark.peers
def test_mjcf_names_what_mujoco_does_not_read(arm, tmp_path):
    pytest.importorskip("mujoco")
    (tmp_path / "skin.dae").touch()
    beside = (str(tmp_path / "arm.urdf"), ())
    arm._shapes = [Shape("upper", "mesh", (1.0, 1.0, 1.0), np.eye(4), None, name, beside) for name in ("skin.dae", "gone.stl")]
    with pytest.warns(
        pc.ModelWarning, match=r"not written: mesh 'skin.dae' \(MuJoCo reads .stl, .obj, .msh\), mesh 'gone.stl' \(its file is not found\)"
    ):
        arm.save(tmp_path / "again.xml")
    assert not loaded(tmp_path / "again.xml")._shapes


@pytest.mark.peers
def test_mjcf_takes_binary_stl_alone(arm, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    record = np.zeros(4, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")]))
    record["corners"] = corners[np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])]
    (tmp_path / "binary.stl").write_bytes(b" " * 80 + (4).to_bytes(4, "little") + record.tobytes())
    (tmp_path / "words.stl").write_text(
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n" * 3
    )
    beside = (str(tmp_path / "arm.urdf"), ())
    arm._shapes = [Shape("upper", "mesh", (1.0, 1.0, 1.0), np.eye(4), None, name, beside) for name in ("binary.stl", "words.stl")]
    with pytest.warns(
        pc.ModelWarning, match=r"not written: mesh 'words.stl' \(MuJoCo reads binary STL files of at most 200000 triangles\)"
    ):
        arm.save(tmp_path / "again.xml")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "again.xml")).nmesh == 1


@pytest.mark.peers
def test_meshes_of_an_mjcf_file_go_into_another(arm, tmp_path):
    pytest.importorskip("mujoco")
    arm.save(tmp_path / "one.xml")
    one = loaded(tmp_path / "one.xml")
    one.save(tmp_path / "two.xml")
    two = loaded(tmp_path / "two.xml")
    assert len(two._shapes) == len(one._shapes)
    corners = [
        [
            np.sort(shape.triangles[0] @ X[:3, :3].T + X[:3, 3], axis=0)
            for shape in model.shapes
            if shape.kind == "mesh"
            for X in [in_world(model, shape)]
        ]
        for model in (one, two)
    ]
    assert len(corners[0]) == 4
    assert all(min(np.abs(a - b).max() for b in corners[1]) < 1e-5 for a in corners[0])


@pytest.mark.peers
@pytest.mark.parametrize("name", ["talos_reduced", "ur5_robot", "anymal"])
def test_published_robots_keep_their_meshes(tmp_path, name):
    if name not in example_robots():
        pytest.skip("example-robot-data is not installed")
    robot = loaded(example_robots()[name])
    robot.save(tmp_path / "robot.urdf")
    again = pc.load(tmp_path / "robot.urdf", root="fixed", package_dirs=[example_robots()[name].parents[3]])
    assert len(again.shapes) == len(robot.shapes) > 0 and len(again.collision_shapes) == len(robot.collision_shapes)
    for shape, other in zip(sorted(robot.shapes, key=key_of), sorted(again.shapes, key=key_of), strict=True):
        assert other.file == shape.file and np.abs(in_world(robot, shape) - in_world(again, other)).max() < 1e-14


def key_of(shape):
    return (shape.body, shape.kind, shape.file, shape.placement[:3, 3].round(9).tolist())


@pytest.mark.peers
def test_what_an_mjcf_file_says_beside_a_model_goes_back(tmp_path):
    """Weights that are held, a fluid, the control at rest, what is not read: through MJCF where it has them, through TOML bit for bit."""
    pytest.importorskip("mujoco")
    text = """<mujoco><option density="3" viscosity=".2" wind="1 2 3"/><worldbody><body name="a" gravcomp=".7"><joint name="j"/>
    <geom type="box" size=".1 .2 .3" pos=".1 0 0"/></body><body name="b" pos="3 0 0"><joint name="k"/><geom size=".1"/></body></worldbody>
    <tendon><fixed name="t" stiffness="1"><joint joint="j" coef="1"/></fixed></tendon>
    <actuator><motor name="m" joint="j" ctrllimited="true" ctrlrange="1 2"/></actuator></mujoco>"""
    (tmp_path / "one.xml").write_text(text)
    one = loaded(tmp_path / "one.xml")
    one.save(tmp_path / "one.toml")
    toml = loaded(tmp_path / "one.toml")
    assert toml.not_read == one.not_read and toml.actuators == one.actuators
    assert [repr(offer) for offer in toml.offers] == [repr(offer) for offer in one.offers] and len(one.offers) == 3
    one.save(tmp_path / "two.xml")
    two = loaded(tmp_path / "two.xml")
    for a, b in zip(pc.effects.from_model(one)[1:3], pc.effects.from_model(two)[1:3], strict=True):
        for (key, x), y in zip(a.parameters().items(), b.parameters().values(), strict=True):
            assert list(x) == list(y) if key == "bodies" else np.allclose(x, y, rtol=1e-12, atol=1e-12)
