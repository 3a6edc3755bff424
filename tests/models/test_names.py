"""Names as users give them: odd ones live in every file, and those that no file holds are refused where they come in."""

import numpy as np
import pytest

import pycraft as pc
from support.saved_models import saved_and_loaded

HALF = "a\ud800"


def without(description, *path):
    """A description with the name at a place that is half a character."""
    part = description
    for key in path:
        part = part[key]
    part["name"] = HALF
    return pc.Multibody.from_description(description)


REFUSED = {
    "a model": lambda m: pc.Multibody(HALF),
    "a body": lambda m: m.add_body(HALF),
    "a hinge": lambda m: m.add_body("b", hinge_name=HALF),
    "a hinge's kind": lambda m: m.add_body("b", hinge=HALF),
    "a node": lambda m: m.add_node(HALF, "body0"),
    "a loose frame": lambda m: m.add_frame(HALF, "body0"),
    "a frame": lambda m: m.frame(HALF),
    "a loop": lambda m: m.add_loop("body1", name=HALF),
    "a coupling": lambda m: m.add_coupling({"hinge0": 1.0}, name=HALF),
    "a copy": lambda m: m.copy_subtree("body1", prefix=HALF),
    "a root": lambda m: m.subgraph(root=HALF),
    "a model described": lambda m: without(m.description()),
    "a body described": lambda m: without(m.description(), "bodies", 0),
    "a hinge described": lambda m: without(m.description(), "bodies", 0, "hinge"),
    "a node described": lambda m: without(m.description(), "nodes", 0),
}


@pytest.fixture
def arm():
    made = pc.chain(2)
    made.add_node("tip", "body1")
    return made


@pytest.mark.parametrize("what", REFUSED)
def test_half_a_character(arm, what):
    with pytest.raises(pc.ModelError, match=r"is named by a string, and 'a\\ud800' has half a surrogate pair, which no file can store"):
        REFUSED[what](arm)


def test_half_a_character_that_is_asked_for(arm):
    for named in (arm.bodies, arm.hinges, arm.nodes, arm.loops):
        assert HALF not in named
        with pytest.raises(KeyError, match="ud800"):
            named[HALF]
    for ask in (
        lambda: arm.hybrid_dynamics(prescribed=[HALF]),
        lambda: arm.soa.free([HALF]),
        lambda: arm.operational_space_inertia([HALF]),
        lambda: arm.soa.NodesV([HALF]),
        lambda: arm.solve_ik({"tip": (1, 0, 0)}, coordinates=[HALF]),
        lambda: arm.assemble(fix=[HALF]),
        lambda: arm.add_coupling({HALF: 1.0}),
    ):
        with pytest.raises(pc.ModelError, match="ud800"):
            ask()


ODD = [
    "world",
    "base",
    "a b",
    "a\nb",
    "a\rb",
    "a\"b'c",
    "<&>",
    "]]>",
    "é\u202e",
    "\U0001f600",
    "\x7f",
    "a\u2028b",
    "[0]",
    "a\\b",
    "0",
    "{x}",
]


@pytest.mark.parametrize("ending", ["toml", "urdf", pytest.param("xml", marks=pytest.mark.peers)])
@pytest.mark.parametrize("name", ODD, ids=ascii)
def test_odd_names_come_back(name, ending, tmp_path):
    if ending == "xml":
        pytest.importorskip("mujoco")
    solid = dict(mass=1.0, inertia=np.eye(3))
    model = pc.Multibody(name)
    model.add_body("first", hinge_name=name, **solid)
    model.add_body(f"{name}.", "first", **solid)
    model.add_node(name, f"{name}.", position=(1, 2, 3))
    again = saved_and_loaded(model, tmp_path / f"model.{ending}")
    assert (again.name, list(again.bodies), list(again.hinges)) == (model.name, list(model.bodies), list(model.hinges))
    assert set(again.nodes) >= {name} and np.array_equal(again.pose(name, [0.1, 0.2]), model.pose(name, [0.1, 0.2]))


def test_a_coordinate_that_is_not_there_is_told_the_others_once():
    with pytest.raises(pc.ModelError, match="called 'elbow'; there are hinge0, hinge1$"):
        pc.chain(2).solve_ik({"body1": (1, 0, 0)}, coordinates=["elbow"])
