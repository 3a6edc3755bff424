"""Shapes of a TOML file: written and read bit for bit, also from hand-written files; shapes that no file holds are reported."""

import os
import warnings

import numpy as np
import pytest

import pycraft as pc
from pycraft.models.loaders.urdf import resolve_package
from pycraft.models.shapes import Shape

BODY = '[[bodies]]\nname = "arm"\nmass = 1\ninertia = { xx = 1, yy = 1, zz = 1 }\n\n[[nodes]]\nname = "tip"\nbody = "arm"\n\n[[shapes]]\n'


@pytest.fixture
def load(tmp_path):
    def made(text):
        (tmp_path / "model.toml").write_text(BODY + text)
        return pc.load(tmp_path / "model.toml")

    return made


def placed(rng):
    """A rotation by QR, that three angles do not give to the last bit, and a place."""
    placement, q = np.eye(4), np.linalg.qr(rng.standard_normal((3, 3)))[0]
    placement[:3, :3], placement[:3, 3] = q * np.sign(np.linalg.det(q)), rng.standard_normal(3)
    return placement


def test_every_kind_is_read_back_bit_for_bit(tmp_path):
    rng, arm = np.random.default_rng(1), pc.chain(2)
    tip = list(arm.bodies)[-1]
    arm.add_node("tip", tip, position=(1, 0, 0))
    arm._shapes = [
        Shape(tip, "box", (0.1, 0.2, 1 / 3), placed(rng), "#0072b2"),
        Shape("tip", "sphere", (0.05,), placed(rng)),
        Shape("", "cylinder", (0.1, 0.3), np.eye(4), "#ffffff"),
        Shape(tip, "capsule", (0.1, 0.3), placed(rng)),
        Shape(tip, "ellipsoid", (0.1, 0.2, 0.3), placed(rng)),
        Shape(tip, "mesh", (1.0, -1.0, 2.0), placed(rng), None, "package://parts/ball.obj", ("robots/arm.urdf", (str(tmp_path), "meshes"))),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        arm.save(tmp_path / "arm.toml")
    again = pc.load(tmp_path / "arm.toml").shapes
    assert len(again) == len(arm.shapes) == 6
    for a, b in zip(arm.shapes, again, strict=True):
        assert (a.body, a.kind, a.size, a.colour, a.file, b.triangles) == (b.body, b.kind, b.size, b.colour, b.file, None)
        assert a.placement.tobytes() == b.placement.tobytes()
    assert again[-1].beside == (os.path.abspath("robots/arm.urdf"), (str(tmp_path), os.path.abspath("meshes")))  # wherever it is read


def test_scenes_keep_them(tmp_path):
    arm = pc.chain(1)
    arm._shapes = [Shape(list(arm.bodies)[0], "box", (1.0, 2.0, 3.0), np.eye(4))]
    pc.Scene(arm).save(tmp_path / "scene.toml")
    assert [shape.size for shape in pc.load_scene(tmp_path / "scene.toml").model.shapes] == [(1.0, 2.0, 3.0)]


def test_a_mesh_is_looked_for_beside_the_file(load, tmp_path):
    (tmp_path / "wedge.obj").touch()
    (shape,) = load('kind = "mesh"\nbody = "arm"\nfile = "wedge.obj"\n').shapes
    assert shape.size == (1.0, 1.0, 1.0) and resolve_package(shape.file, *shape.beside) == tmp_path / "wedge.obj"


def test_what_no_file_holds_is_told(tmp_path):
    arm = pc.tree([-1], seed=1)
    sphere = Shape("", "sphere", (1.0,), np.eye(4))
    arm._shapes = [sphere, Shape("", "mesh", (1.0, 1.0, 1.0), np.eye(4), triangles=(np.eye(3), np.array([[0, 1, 2]])))]
    with pytest.warns(pc.ModelWarning, match=r"arm\.toml: shapes that were not written: mesh without a file of its own"):
        arm.save(tmp_path / "arm.toml")
    assert [shape.kind for shape in pc.load(tmp_path / "arm.toml").shapes] == ["sphere"]
    with pytest.warns(pc.ModelWarning, match=r"arm\.urdf: shapes that were not written: mesh without a file of its own"):
        arm.save(tmp_path / "arm.urdf")


@pytest.mark.parametrize(
    "text, words",
    [
        ('body = "arm"\nsize = [1]', "shape number 1 has no kind; there are box, sphere"),
        ('kind = "bx"\nsize = [1, 1, 1]', "did you mean 'box'"),
        ('kind = "box"\nbody = "am"\nsize = [1, 1, 1]', r"toml:12: shape number 1: no body or node is called 'am'; did you mean 'arm'"),
        ('kind = "box"\nsize = [1, 1]', "lengths of its edges: 3 in a list"),
        ('kind = "box"\nsize = [1, 0, 1]', "a list of numbers above zero"),
        ('kind = "sphere"', "a list of numbers above zero: radius"),
        ('kind = "sphere"\nsize = [1]\ncolour = "red"', 'write "#rrggbb"'),
        ('kind = "sphere"\nsize = [1]\nfile = "a.stl"', "a mesh has a file, and nothing else"),
        ('kind = "mesh"', "a mesh has a file"),
        ('kind = "mesh"\nfile = "a.stl"\nbeside = "here"', "beside is a list of paths"),
        ('kind = "sphere"\nsize = [1]\nrotation = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]', "no rotation matrix"),
        ('kind = "sphere"\nsize = [1]\nrotation = [[2, 0, 0], [0, 1, 0], [0, 0, 1]]', "no rotation matrix"),
        ('kind = "sphere"\nsize = [1]\nradius = 1', "shape number 1 has no key 'radius'"),
    ],
)  # fmt: skip
def test_bad_shapes(load, text, words):
    with pytest.raises(pc.ModelError, match=words):
        load(text)
