"""Runs for other engines: what is in the files is the run, read back by other means than those that wrote it."""

import json
import struct
import sys

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind

SINGLE = 2.0**-23  # of a number's size, in single precision


def arm():
    """Two bodies, one with a box and one without a shape, in gravity along -z."""
    model = pc.Multibody("two links")
    rod = dict(mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0.01, 0.1, 0.1]))
    model.add_body("upper", hinge="pin", axis=(0, 1, 0), **rod)
    model.add_body("lower arm", parent="upper", hinge="ball", position=(1, 0, 0), **rod)
    model.gravity = (0, 0, -9.81)
    return model


@pytest.fixture(scope="module")
def run():
    model = arm()
    state = model.random_state(3)
    return pc.Scene(model).add(pc.effects.Gravity()).simulate(1.0, state.q, 3 * state.v, progress=False)


def parsed(path):
    """The document of a binary file and its numbers, by the specification's layout alone."""
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    document = json.loads(data[20 : 20 + size])
    chunk, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert kind == b"BIN\0" and chunk >= document["buffers"][0]["byteLength"]
    blob = data[28 + size : 28 + size + chunk]

    def numbers(i):
        accessor = document["accessors"][i]
        view = document["bufferViews"][accessor["bufferView"]]
        assert accessor["componentType"] == 5126
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return np.frombuffer(blob, "<f4", width * accessor["count"], start).reshape(accessor["count"], width).astype(float)

    return document, numbers


def matrix(x, y, z, w):
    """The rotation of a unit quaternion."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_keyframes_of_gltf_are_the_run(run, tmp_path):
    pytest.importorskip("pygltflib")
    document, numbers = parsed(run.to_gltf(tmp_path / "swing.glb", fps=20, speed=2.0))
    names = [node["name"] for node in document["nodes"]]
    assert names == ["two links", "upper", "lower arm"] and document["nodes"][0]["children"] == [1, 2]
    (animation,) = document["animations"]
    turn = matrix(*document["nodes"][0]["rotation"])
    np.testing.assert_allclose(turn @ [0, 0, 1], [0, 1, 0], atol=1e-15)  # z becomes y, exact except for the root of a half
    seen = {}
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        times = numbers(sampler["input"])[:, 0]
        seen[names[channel["target"]["node"]], channel["target"]["path"]] = numbers(sampler["output"])
    np.testing.assert_allclose(times, np.arange(11) / 20, rtol=SINGLE)  # a second of the run in half a second of the film
    for body in ("upper", "lower arm"):
        poses = run.model.pose(body, run.at(2 * times.clip(0, 0.5)).q)
        np.testing.assert_allclose(seen[body, "translation"], poses[:, :3, 3], rtol=SINGLE, atol=4 * SINGLE)
        q = seen[body, "rotation"]
        np.testing.assert_allclose([matrix(*row) for row in q], poses[:, :3, :3], atol=8 * SINGLE)  # products of two rounded numbers
        assert (np.sum(q[1:] * q[:-1], axis=1) > 0).all()  # no key is on the far side of the sphere
    accessor = document["accessors"][animation["samplers"][0]["input"]]
    assert accessor["min"] == [0.0] and accessor["max"] == [pytest.approx(0.5)]


def test_triangles_of_gltf_are_the_shapes(tmp_path):
    pytest.importorskip("pygltflib")
    trimesh = pytest.importorskip("trimesh")
    model = pc.robots.panda()
    model.q = model.clamped(model.random_state(1).q)
    run = pc.Scene(model).simulate(0.1, progress=False)
    path = run.to_gltf(tmp_path / "panda.glb")
    scene = trimesh.load(path)  # another reader
    bodies = list(model.bodies)
    from pycraft.view.solids import solids

    up = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
    expected = []
    for solid in solids(model, None)[0]:
        X = np.eye(4) if solid["of"] < 0 else model.pose(bodies[solid["of"]], run.q[0])
        expected.append(np.vstack([solid["vertices"][solid["faces"]].reshape(-1, 3).T, np.ones(3 * len(solid["faces"]))]).T @ (up @ X).T)
    low, high = np.min([x[:, :3].min(axis=0) for x in expected], axis=0), np.max([x[:, :3].max(axis=0) for x in expected], axis=0)
    np.testing.assert_allclose(scene.bounds, [low, high], atol=4 * SINGLE)  # sums of four numbers of about a metre
    assert sum(len(mesh.faces) for mesh in scene.geometry.values()) == sum(len(x) // 3 for x in expected)
    document, numbers = parsed(path)
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            normals = numbers(primitive["attributes"]["NORMAL"])
            np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=4 * SINGLE)
            accessor = document["accessors"][primitive["attributes"]["POSITION"]]
            corners = numbers(primitive["attributes"]["POSITION"])
            assert accessor["min"] == corners.min(axis=0).tolist() and accessor["max"] == corners.max(axis=0).tolist()


def test_bodies_without_shapes_are_sticks(run, tmp_path):
    pytest.importorskip("pygltflib")
    document, numbers = parsed(run.to_gltf(tmp_path / "sticks.glb"))
    upper = document["meshes"][document["nodes"][1]["mesh"]]
    corners = np.concatenate([numbers(primitive["attributes"]["POSITION"]) for primitive in upper["primitives"]])
    assert corners[:, 0].min() < 0.03 and corners[:, 0].max() == pytest.approx(1.0, abs=0.05)  # from its hinge to the next
    assert np.abs(corners[:, 1:]).max() < 0.08


def test_text_is_the_same_document(run, tmp_path):
    pytest.importorskip("pygltflib")
    trimesh = pytest.importorskip("trimesh")
    text = json.loads(run.to_gltf(tmp_path / "swing.gltf").read_text())
    document, _ = parsed(run.to_gltf(tmp_path / "swing.glb"))
    assert text["buffers"][0]["uri"].startswith("data:") and text["accessors"] == document["accessors"]
    np.testing.assert_allclose(trimesh.load(tmp_path / "swing.gltf").bounds, trimesh.load(tmp_path / "swing.glb").bounds)


@pytest.mark.parametrize("ending", [".usda", ".usdc"])
def test_samples_of_usd_are_the_run(run, tmp_path, ending):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(run.to_usd(tmp_path / f"swing{ending}", fps=20)))
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetTimeCodesPerSecond() == 20 and stage.GetEndTimeCode() == pytest.approx(20)
    for body, path in (("upper", "/two_links/upper"), ("lower arm", "/two_links/lower_arm")):
        prim = stage.GetPrimAtPath(path)
        assert prim.GetDisplayName() == body
        for frame in (0, 7, 20):
            pose = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(frame)).T
            np.testing.assert_allclose(pose, run.model.pose(body, run.at(frame / 20).q), rtol=0, atol=1e-14)  # double precision
        meshes = [UsdGeom.Mesh(child) for child in prim.GetChildren()]
        assert meshes and all(len(mesh.GetFaceVertexIndicesAttr().Get()) % 3 == 0 for mesh in meshes)
        for mesh in meshes:
            points = np.array(mesh.GetPointsAttr().Get())
            np.testing.assert_array_equal(mesh.GetExtentAttr().Get(), [points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize("seed", range(2))
def test_every_kind_of_hinge_is_written(seed, tmp_path):
    pytest.importorskip("pygltflib")
    model = every_kind(seed=seed)
    state = model.random_state(seed)
    run = pc.Scene(model).simulate(0.2, state.q, 0.1 * state.v, progress=False)
    document, numbers = parsed(run.to_gltf(tmp_path / "all.glb"))
    for sampler in document["animations"][0]["samplers"]:
        assert np.isfinite(numbers(sampler["output"])).all()


def test_models_that_do_not_move_are_written(tmp_path):
    pytest.importorskip("pygltflib")
    welded = pc.Multibody("block")
    welded.add_body("block", hinge="weld", mass=1.0, inertia=np.eye(3))
    document, _ = parsed(pc.Scene(welded).simulate(0.1, progress=False).to_gltf(tmp_path / "block.glb"))
    assert document["nodes"][0]["name"] == "block"


def test_refusals(run, tmp_path, monkeypatch):
    with pytest.raises(pc.EvaluationError, match="ends in .glb, .gltf"):
        run.to_gltf(tmp_path / "swing.obj")
    with pytest.raises(pc.EvaluationError, match="ends in .usda, .usdc, .usd"):
        run.to_usd(tmp_path / "swing.glb")
    with pytest.raises(FileNotFoundError):
        run.to_gltf(tmp_path / "nowhere" / "swing.glb")
    with pytest.raises(pc.EvaluationError, match="fps"):
        run.to_gltf(tmp_path / "swing.glb", fps=0)
    monkeypatch.setitem(sys.modules, "pygltflib", None)
    with pytest.raises(pc.EvaluationError, match=r"pip install 'pycraft-soa\[gltf\]'"):
        run.to_gltf(tmp_path / "swing.glb")
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(pc.EvaluationError, match=r"pip install 'pycraft-soa\[usd\]'"):
        run.to_usd(tmp_path / "swing.usda")
    assert list(tmp_path.iterdir()) == []


def test_keys_stay_on_one_side_of_the_sphere(tmp_path):
    """Two turns of a flywheel: q and -q are one rotation, and a player that goes from one to the other turns the long way round."""
    pytest.importorskip("pygltflib")
    model = pc.Multibody("flywheel")
    model.add_body("wheel", hinge="pin", axis=(0.6, 0, 0.8), mass=1.0, inertia=np.eye(3))
    run = pc.Scene(model).simulate(2.0, [0.0], [2 * np.pi], progress=False)
    document, numbers = parsed(run.to_gltf(tmp_path / "wheel.glb", fps=20))
    (rotation,) = [
        document["animations"][0]["samplers"][channel["sampler"]]["output"]
        for channel in document["animations"][0]["channels"]
        if channel["target"]["path"] == "rotation"
    ]
    q = numbers(rotation)
    np.testing.assert_allclose(np.sum(q[1:] * q[:-1], axis=1), np.cos(np.pi / 20), atol=4 * SINGLE)  # half of the angle between two frames
    half = np.pi * np.arange(41) / 20
    expected = np.column_stack([0.6 * np.sin(half), 0 * half, 0.8 * np.sin(half), np.cos(half)])
    np.testing.assert_allclose(q * np.sign(q[0] @ expected[0]), expected, atol=1e-6)  # of a run by dopri5 at its tolerances


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_is_upright_is_upright(axis, tmp_path):
    """Gravity along any axis: glTF's y and the axis that USD names are upright."""
    pytest.importorskip("pygltflib")
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    model = pc.chain(1)
    model.gravity = -9.81 * np.eye(3)[axis]
    run = pc.Scene(model).add(pc.effects.Gravity()).simulate(0.1, progress=False)
    document, _ = parsed(run.to_gltf(tmp_path / "up.glb"))
    np.testing.assert_allclose(matrix(*document["nodes"][0]["rotation"]) @ np.eye(3)[axis], [0, 1, 0], atol=1e-15)
    stage = Usd.Stage.Open(str(run.to_usd(tmp_path / "up.usda")))
    up = "XYZ".index(UsdGeom.GetStageUpAxis(stage))
    root = np.array(UsdGeom.Xformable(stage.GetDefaultPrim()).ComputeLocalToWorldTransform(0)).T[:3, :3]
    np.testing.assert_allclose(root @ np.eye(3)[axis], np.eye(3)[up], atol=1e-15)
