"""Shapes: what the loaders read is what the file says, and the triangles of each are closed, where the shape is and as large as it is."""

import copy
import json
import os
import pickle
import re

import numpy as np
import pytest

import pycraft as pc
from pycraft.models.shapes import SIZES, Shape
from pycraft.view.figure_data import figure_data
from pycraft.view.skeleton import Skeleton
from pycraft.view.solids import MOST, ROUND, solids, triangles
from support.browser import differing, opened, pixels, until

INERTIAL = (
    '<inertial><mass value="1"/><origin xyz="0 0 0.3"/><inertia ixx="0.03" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
)
URDF = f"""<robot name="shaped"><material name="blue"><color rgba="0 0.2 1 1"/></material>
<link name="base"><visual><origin xyz="0 0 -0.1"/><geometry><cylinder radius="0.25" length="0.2"/></geometry></visual></link>
<link name="arm">{INERTIAL}
<visual><origin xyz="0 0 0.3" rpy="0 0 1"/><geometry><box size="0.1 0.15 0.6"/></geometry><material name="blue"/></visual></link>
<link name="hand">{INERTIAL}
<visual><geometry><capsule radius="0.06" length="0.3"/></geometry><material name=""><color rgba="1 0.5 0 1"/></material></visual>
<visual><origin xyz="0 0 0.45"/><geometry><mesh filename="package://parts/ball.obj" scale="0.1 0.1 0.2"/></geometry></visual></link>
<link name="tool"><visual><origin xyz="0.01 0 0"/><geometry><sphere radius="0.05"/></geometry></visual></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="elbow" type="continuous"><parent link="arm"/><child link="hand"/><origin xyz="0 0 0.6"/><axis xyz="1 0 0"/></joint>
<joint name="fix" type="fixed"><parent link="hand"/><child link="tool"/><origin xyz="0.15 0 0.3"/></joint></robot>"""
BALL = "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\n" + "\n".join(
    f"f {f}" for f in ("1 3 5", "3 2 5", "2 4 5", "4 1 5", "3 1 6", "2 3 6", "4 2 6", "1 4 6")
)


@pytest.fixture
def path(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "ball.obj").write_text(BALL)
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "shaped.urdf").write_text(URDF)
    return tmp_path / "robots" / "shaped.urdf"


@pytest.fixture
def model(path):
    with pytest.warns(pc.ModelWarning, match="effort"):
        return pc.load(path)


def volume(vertices, faces):
    """By the divergence theorem; positive where faces are seen anticlockwise from outside, and closed."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


# Triangles ------------------------------------------------------------------------------------------------------------

POLYGON = ROUND / (2 * np.pi) * np.sin(2 * np.pi / ROUND)  # the area of a regular polygon beside its circle's


@pytest.mark.parametrize(
    "kind, size, whole, reach, least",
    [
        ("box", (1.0, 2.0, 3.0), 6.0, (0.5, 1, 1.5), 1.0),
        ("cylinder", (0.5, 2.0), np.pi * 0.25 * 2, (0.5, 0.5, 1), POLYGON),
        ("capsule", (0.5, 2.0), np.pi * 0.25 * (2 + 4 * 0.5 / 3), (0.5, 0.5, 1.5), POLYGON * 0.97),
        ("sphere", (2.0,), 4 / 3 * np.pi * 8, (2, 2, 2), POLYGON * 0.95),
        ("ellipsoid", (1.0, 2.0, 3.0), 4 / 3 * np.pi * 6, (1, 2, 3), POLYGON * 0.95),
    ],
)
def test_primitives_are_closed_and_as_large_as_they_are(kind, size, whole, reach, least):
    vertices, faces = triangles(Shape("", kind, size, np.eye(4)))
    assert least * (1 - 1e-9) <= volume(vertices, faces) / whole <= 1 + 1e-9  # inscribed: arcs of 1/16 of a turn lose up to 5 %
    np.testing.assert_allclose(vertices.max(axis=0), reach, rtol=0.03)
    np.testing.assert_allclose(vertices.min(axis=0), -np.array(reach), rtol=0.03)
    places = {tuple(np.round(v, 9)): i for i, v in enumerate(vertices)}
    same = np.array([places[tuple(np.round(v, 9))] for v in vertices])[faces]
    edges = [tuple(face[[i, (i + 1) % 3]]) for face in same for i in range(3)]
    assert sorted(edges) == sorted((b, a) for a, b in edges)  # every edge has its two sides


def test_many_triangles_are_thinned():
    u, v = np.meshgrid(np.arange(200), np.arange(100), indexing="ij")
    a = (u + 200 * v)[:-1, :-1].ravel()
    flat = np.column_stack([u.T.ravel(), v.T.ravel(), np.zeros(20000)]) / 100
    faces = np.concatenate([np.column_stack([a, a + 1, a + 201]), np.column_stack([a, a + 201, a + 200])])
    model = pc.chain(1)
    model._shapes = [Shape("body0", "mesh", (1, 1, 1), np.eye(4), triangles=(flat, faces)), Shape("body0", "box", (1, 1, 1), np.eye(4))]
    model._shapes.append(Shape("body0", "sphere", (1,) * 3, np.eye(4)))
    thin, box, ball = solids(model)[0]
    assert 500 < len(thin["faces"]) and sum(len(solid["faces"]) for solid in (thin, box, ball)) <= MOST
    assert len(box["faces"]) == 12 and len(ball["faces"]) == len(triangles(model._shapes[2])[1])
    assert thin["faces"].max() < len(thin["vertices"]) and np.ptp(thin["vertices"], axis=0) == pytest.approx([1.99, 0.99, 0], abs=0.1)


# Loading --------------------------------------------------------------------------------------------------------------


def test_visuals_are_shapes(model):
    assert [(s.body, s.kind, s.size, s.colour) for s in model.shapes] == [
        ("base", "cylinder", (0.25, 0.2), None),
        ("arm", "box", (0.1, 0.15, 0.6), "#0033ff"),
        ("hand", "capsule", (0.06, 0.3), "#ff8000"),
        ("hand", "mesh", (0.1, 0.1, 0.2), None),
        ("tool", "sphere", (0.05,), None),
    ]
    assert {shape.kind for shape in model.shapes} <= SIZES.keys()
    box = model.shapes[1].placement
    np.testing.assert_allclose(box[:3, :3] @ [1, 0, 0], [np.cos(1), np.sin(1), 0], atol=1e-15)
    np.testing.assert_array_equal(box[:3, 3], [0, 0, 0.3])


def test_shapes_are_where_their_links_are(model):
    pytest.importorskip("trimesh")
    made, missing = solids(model)
    assert missing == [] and [solid["of"] for solid in made] == [-1, 0, 1, 1, 1]
    mesh, tool = made[3]["vertices"], made[4]["vertices"]
    np.testing.assert_allclose([mesh.min(axis=0), mesh.max(axis=0)], [[-0.1, -0.1, 0.25], [0.1, 0.1, 0.65]], atol=1e-12)
    np.testing.assert_allclose((tool.min(axis=0) + tool.max(axis=0)) / 2, [0.16, 0, 0.3], atol=1e-12)  # lumped with the hand
    data = figure_data(Skeleton(model), model.zero_q())
    low, high = np.subtract(data["centre"], data["half"]), np.add(data["centre"], data["half"])
    assert low[0] < -0.25 and low[2] < -0.2 and high[2] > 1.25 and data["unshown"] == []


def test_shapes_go_with_their_bodies(model):
    for other in (copy.copy(model), pickle.loads(pickle.dumps(model))):
        assert [repr(s) for s in other.shapes] == [repr(s) for s in model.shapes]
    assert {s.body for s in model.subgraph(root="hand").shapes} == {"hand", "tool"}
    twice = pc.Multibody("twice")
    twice.merge(model, prefix="left_")
    assert {"left_arm", "left_hand", "left_tool"} <= {s.body for s in twice.shapes}
    model.remove_body("hand")
    assert [solid["of"] for solid in solids(model)[0]] == [-1, 0]
    assert {s.body for s in model.shapes} == {"base", "arm"}
    model.add_body("hand", "arm", "pin", mass=1.0)
    assert [solid["of"] for solid in solids(model)[0]] == [-1, 0]  # another hand
    assert pc.chain(2).shapes == [] and solids(pc.chain(2)) == ([], [])


def test_what_is_wrong_is_said_and_the_rest_is_shown(path, model):
    path.with_name("bad.urdf").write_text(URDF.replace('radius="0.05"', 'radius="-1"').replace('size="0.1 0.15 0.6"', 'size="0.1"'))
    with pytest.warns(pc.ModelWarning) as said:
        bad = pc.load(path.with_name("bad.urdf"))
    words = " ".join(str(w.message) for w in said)
    assert [s.kind for s in bad.shapes] == [
        "cylinder",
        "capsule",
        "mesh",
    ] and "sizes of <sphere> must be positive; the shape is left out" in words
    pytest.importorskip("trimesh")
    (path.parents[1] / "parts" / "ball.obj").write_text("no mesh")
    made, missing = solids(model)
    assert len(made) == 4 and len(missing) == 1 and "trimesh cannot read package://parts/ball.obj" in missing[0]
    (path.parents[1] / "parts" / "ball.obj").unlink()
    assert "is not found in" in solids(model)[1][0] and "package_dirs" in solids(model)[1][0]


def test_meshes_are_read_once_and_again_when_they_changed(path, model, monkeypatch):
    trimesh = pytest.importorskip("trimesh")
    read, load = [], trimesh.load
    monkeypatch.setattr(trimesh, "load", lambda *given, **options: read.append(given) or load(*given, **options))
    first = solids(model)[0][3]["vertices"]
    for _ in range(2):
        figure_data(Skeleton(model), model.zero_q())
    assert len(read) == 1
    ball = path.parents[1] / "parts" / "ball.obj"
    ball.write_text(BALL.replace("v 0 0 1", "v 0 0 2"))
    os.utime(ball, ns=(0, ball.stat().st_mtime_ns + 1))
    assert solids(model)[0][3]["vertices"][:, 2].max() == pytest.approx(0.85) != first[:, 2].max() and len(read) == 2


def test_without_the_package_that_reads_meshes(model, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "trimesh", None)
    made, missing = solids(model)
    assert len(made) == 4 and "pip install 'pycraft-soa[meshes]'" in missing[0]
    assert missing[0] in figure_data(Skeleton(model), model.zero_q())["unshown"]


@pytest.mark.peers
def test_geoms_are_shapes(tmp_path):
    pytest.importorskip("mujoco")
    (tmp_path / "ball.obj").write_text(BALL)
    (tmp_path / "shaped.xml").write_text("""<mujoco model="shaped"><asset><mesh name="ball" file="ball.obj" scale="0.1 0.1 0.1"/>
      <material name="green" rgba="0 1 0 1"/></asset>
      <worldbody><geom type="plane" size="1 1 1"/><geom type="box" size="0.1 0.2 0.3" rgba="1 0 0 1"/>
      <body name="a"><joint name="j"/><geom type="capsule" size="0.1 0.3" pos="0 0 0.3"/><geom type="sphere" size="0.1" group="3"/>
        <geom type="box" size="1 1 1" rgba="0 0 1 0"/>
        <geom type="ellipsoid" size="0.1 0.2 0.3" material="green"/>
        <geom type="cylinder" size="0.1 0.4"/><geom type="mesh" mesh="ball" pos="0 0 1"/></body>
      </worldbody></mujoco>""")
    with pytest.warns(pc.ModelWarning):
        model = pc.load(tmp_path / "shaped.xml")
    assert [(s.body, s.kind, s.size) for s in model.shapes] == [
        ("", "box", (0.2, 0.4, 0.6)), ("a", "capsule", (0.1, 0.6)), ("a", "ellipsoid", (0.1, 0.2, 0.3)), ("a", "cylinder", (0.1, 0.8)),
        ("a", "mesh", (1.0, 1.0, 1.0)),
    ]  # fmt: skip
    assert model.shapes[0].colour == "#ff0000" and model.shapes[2].colour == "#00ff00"
    made, missing = solids(model)
    mesh = made[4]["vertices"]
    assert missing == [] and [solid["of"] for solid in made] == [-1, 0, 0, 0, 0]
    np.testing.assert_allclose([mesh.min(axis=0), mesh.max(axis=0)], [[-0.1, -0.1, 0.9], [0.1, 0.1, 1.1]], atol=1e-6)  # single precision


# In the browser -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_shapes_are_drawn_picked_and_left_out(browser, model, dark):
    with model.view() as view, opened(browser, view.address, size=(1280, 760), dark=dark) as page:
        until(page, "state !== null")
        shown, box = pixels(page), page.locator("#figure").bounding_box()
        blue = (np.abs(shown - np.array([0, 0.2, 1]) * shown.max(axis=-1, keepdims=True)).max(axis=-1) < 0.12) & (shown[..., 2] > 0.3)
        assert blue.sum() > 1000  # the arm
        x, y, _ = page.evaluate("figure.seen([0.04, 0.06, 0.2])")
        page.mouse.click(box["x"] + x, box["y"] + y)
        until(page, "document.getElementById('picked_name').textContent === 'arm'")
        page.mouse.click(box["x"] + 8, box["y"] + 60)
        until(page, "document.getElementById('picked_name').textContent === 'no body picked'")
        shown = pixels(page)
        page.uncheck("#solid")
        assert differing(shown, pixels(page)) > 5000
        page.check("#solid")
        assert differing(shown, pixels(page)) == 0
    with pc.chain(2).view() as view, opened(browser, view.address, size=(1280, 760), dark=dark) as page:
        until(page, "state !== null")
        assert not page.is_visible("#solid")


def test_pages_of_runs_have_them(model):
    page = pc.Scene(model).simulate(0.1).to_html()
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page.html, re.S).group(1))
    assert [solid["of"] for solid in data["figure"]["solids"]][:3] == [-1, 0, 1]


def test_the_floor_is_under_the_base():
    """Of what stands on its base at the base's lowest point, of what hangs below it under all, of what is loose under where it begins."""
    arm = pc.robots.panda()
    stands = np.array([0, 0.3, 0, -1.5, 0, 1.8, 0])
    data = figure_data(Skeleton(arm), np.array([stands, *(arm.random_state(seed).q for seed in range(4))]))
    base = min(solid["vertices"][:, 2].min() for solid in solids(arm)[0] if solid["of"] < 0)
    assert data["floor"] == pytest.approx(min(base, 0.0), abs=1e-6)
    pendulum = pc.mechanisms.double_pendulum().model
    hanging = figure_data(Skeleton(pendulum), np.array([[np.pi / 2, 0.0]]))
    assert hanging["floor"] <= -2.0 + 1e-6  # two rods of a metre
    dog = pc.robots.a1()
    q, risen = dog.clamped(dog.neutral()), dog.clamped(dog.neutral())
    risen[list(dog.hinges.values())[0].q_slice.stop - 1] += 1.0  # of a free hinge the position comes last
    low, high = (figure_data(Skeleton(dog), np.array([first, q]))["floor"] for first in (q, risen))
    assert high == pytest.approx(low + 1.0, abs=1e-6) and Skeleton(dog).is_loose() and not Skeleton(arm).is_loose()


def test_a_loose_robot_fills_the_first_look():
    """Random states put it metres away: they have its joints alone."""
    from pycraft.viewer.session import Session

    dog = pc.robots.a1()
    session = Session(pc.Scene(dog))
    figure = session.setup()["figure"]
    session.close()
    assert max(figure["half"]) < 3 * max(figure["near"])  # legs swing
