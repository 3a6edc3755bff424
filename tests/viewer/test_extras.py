"""Objects that code shows in the viewer: places are as given, names replace, and invalid objects are refused."""

import numpy as np
import pytest

import pycraft as pc
from support.browser import differing, opened, pixels, until


@pytest.fixture
def view():
    scene = pc.mechanisms.double_pendulum()
    scene.model.add_node("tip", "lower", position=(1, 0, 0), rotation=[[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    with scene.view(q=[1.0, 2.0]) as shown:
        yield shown


def told(view, name):
    return next(extra for extra in view.session.setup()["extras"] if extra["name"] == name)


def test_places_are_on_their_bodies(view):
    pose = np.eye(4)
    pose[:3, 3] = (0.1, 0.2, 0.3)
    view.frame("world", pose).frame("here", (0, 0, 1), on="upper", size=0.5).frame("there", (0.5, 0, 0), on="tip")
    assert told(view, "world")["of"] == -1 and told(view, "world")["at"] == [0.1, 0.2, 0.3]
    assert told(view, "here") | {"axes": None} == {
        "kind": "frame", "name": "here", "of": 0, "colour": None, "at": [0, 0, 1], "axes": None, "size": 0.5,
    }  # fmt: skip
    there = told(view, "there")
    np.testing.assert_allclose(there["at"], [1, 0.5, 0])  # along the node's x, which is the body's y
    np.testing.assert_allclose(there["axes"], [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    assert there["of"] == 1 and there["size"] == pytest.approx(0.1)  # a tenth of the way from the upper hinge to the lower
    view.label("goal", (1, 1, 0), colour="#ff0000").line("way", np.arange(9.0).reshape(3, 3), on="lower")
    assert told(view, "goal")["text"] == "goal" and told(view, "way")["points"] == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    assert view.shown() == ["world", "here", "there", "goal", "way"]


def test_names_replace_and_are_removed(view):
    edits = view.session.setup()["edits"]
    view.label("a", (0, 0, 0)).label("other text", (1, 1, 1), name="a")
    assert view.shown() == ["a"] and told(view, "a")["text"] == "other text" and view.session.setup()["edits"] == edits + 2
    with pytest.raises(pc.ModelError, match="no drawing is called 'b'; shown: 'a'"):
        view.remove("b")
    assert view.remove("a").shown() == []
    assert view.label("a", (0, 0, 0)).clear().shown() == []


@pytest.mark.parametrize(
    "kind, size", [("box", (1, 2, 3)), ("sphere", 0.5), ("cylinder", (0.2, 1)), ("capsule", (0.2, 1)), ("ellipsoid", (1, 2, 3))]
)
def test_shapes_are_triangles(view, kind, size):
    import base64

    view.shape("thing", kind, size, (1, 2, 3), colour="#00ff00")
    (solid,) = told(view, "thing")["solids"]
    vertices = np.frombuffer(base64.b64decode(solid["vertices"]), "<f4").reshape(-1, 3)
    np.testing.assert_allclose((vertices.min(axis=0) + vertices.max(axis=0)) / 2, [1, 2, 3], atol=0.06)  # of 16 sides
    assert solid["of"] == -1 and solid["colour"] == "#00ff00"


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda v: v.frame("f", np.ones((4, 4))), "a pose must be a finite array .4, 4. with a rotation"),
        (lambda v: v.frame("f", [1, 2]), "a pose must be"),
        (lambda v: v.frame("f", [1, 2, np.nan]), "must be a finite array"),
        (lambda v: v.frame("f", (0, 0, 0), on="moon"), "no body or node 'moon'"),
        (lambda v: v.frame("f", (0, 0, 0), size=-1), "size must be a positive length in m"),
        (lambda v: v.frame(7, (0, 0, 0)), "named by a string"),
        (lambda v: v.label("t", (0, 0)), r"at takes finite values in m of shape \(3,\)"),
        (lambda v: v.line("l", [1, 2, 3]), r"points takes finite values in m of shape \(n, 3\)"),
        (lambda v: v.label("t", (0, 0, 0), colour="red"), "colour must be '#rrggbb'"),
        (lambda v: v.shape("s", "cone", 1), "unknown shape 'cone'; choose from box"),
        (lambda v: v.shape("s", "box", 1), "the size of a box is lengths of its edges: 3 positive values"),
        (lambda v: v.shape("s", "sphere", -1), "positive values"),
        (lambda v: v.shape("s", "mesh", (1, 1, 1), file="nowhere.stl"), "nowhere.stl"),
    ],
)
def test_refusals(view, call, words):
    with pytest.raises(pc.Error, match=words):
        call(view)
    assert view.shown() == []


def test_they_are_seen(browser, view, tmp_path):
    with opened(browser, view.address, size=(1280, 800)) as page:
        until(page, "state !== null")
        before = pixels(page)
        view.frame("goal", (0.5, 0.5, 0)).label("tip", (1, 0, 0), on="lower").line("way", [[0, 0, 0], [1, 1, 0]], colour="#ff0000")
        view.shape("ball", "sphere", 0.2, (-0.5, -0.5, 0), colour="#00aa00")
        until(page, "figure.extras.length === 4")
        page.wait_for_timeout(100)
        after = pixels(page)
        assert differing(before, after) > 500
        x, y, _ = page.evaluate("figure.seen([-0.5, -0.5, 0])")
        assert after[int(y), int(x), 1] > 2 * after[int(y), int(x), 0]  # green
        view.clear()
        until(page, "figure.extras.length === 0")
        page.wait_for_timeout(100)
        assert differing(before, pixels(page)) == 0
