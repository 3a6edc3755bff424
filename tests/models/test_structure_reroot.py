"""The same motion seen from another base body: nothing that moves knows which body is the first."""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc
from support.descriptions import KINDS, random_description
from support.edits import refused
from support.mechanisms import SEQUENCES
from support.motions import Motions

ROUNDING = 1e-12
"""Of poses and twists over some ten hinges whose frames were inverted: some thousand roundings of numbers near ten."""
OF_ONE_COORDINATE = ("pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "custom")
TREE = [-1, 0, 1, 0, 2, 1, -1, 4]


def flying(kind, seed, rotors=False):
    """A free root, hinges of a kind on the way from it, branches on every body of the way, and a second root; at a random state."""
    kinds = ["free", kind, kind, "pin", "ball", "universal", "gimbal", kind]
    model = pc.Multibody.from_description(random_description(TREE, kinds, seed, rotors))
    model.hinges["hinge0"].rotor_inertia = np.zeros(6)
    if rotors:  # the same about all axes of a ball, none along those of a free hinge
        for hinge in model.hinges.values():
            if hinge.kind == "ball" or any(s["kind"] == "ball" for s in hinge.subhinges):
                hinge.rotor_inertia = np.full(hinge.v_slice.stop - hinge.v_slice.start, 0.4)
            if hinge.kind == "free":
                hinge.rotor_inertia = np.zeros(6)
    state = model.random_state(seed)
    model.q, model.v = state.q, state.v
    return model


@pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES.values()], ids=str)
def test_motion_momentum_and_energy_are_the_same(kind):
    model = flying(kind, 20, rotors=True)
    names, nodes = set(model.bodies), {name: model.pose(name) for name in model.nodes}
    before, masses = Motions(model), {name: body.mass for name, body in model.bodies.items()}
    root = model.reroot("body7")
    after = Motions(model)
    assert root.name == "body7" and root.parent is None and root.hinge.name == "hinge0" and root.hinge.kind == "free"
    assert list(model.bodies)[0] in ("body7", "body6") and set(model.bodies) == names
    parents = {name: body.parent and body.parent.name for name, body in model.bodies.items()}
    assert parents == {"body7": None, "body4": "body7", "body2": "body4", "body1": "body2", "body0": "body1", "body3": "body0",
                       "body5": "body1", "body6": None}  # fmt: skip
    after.assert_same(before, ROUNDING)
    assert after.energy == pytest.approx(before.energy, rel=1e-11)
    assert np.abs(after.momentum - before.momentum).max() <= 1e-11 * np.abs(before.momentum).max()
    assert {name: body.mass for name, body in model.bodies.items()} == masses
    for name, pose in nodes.items():
        assert np.abs(model.pose(name) - pose).max() < 1e-11


@pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES.values()], ids=str)
def test_there_and_back(kind):
    """The old root again: structure, parameters and state are what they were."""
    model = flying(kind, 40)
    old = copy.copy(model)
    model.reroot("body7")
    assert not np.array_equal(model.q, old.q)
    model.reroot("body0")
    assert set(model.hinges) == set(old.hinges)
    for name, hinge in old.hinges.items():
        again = model.hinges[name]
        assert again.body.name == hinge.body.name and np.abs(again.placement - hinge.placement).max() < 1e-13
        for one, other in zip(again.subhinges, hinge.subhinges, strict=True):
            assert one["kind"] == other["kind"] and one["pitch"] == other["pitch"]
            if one["kind"] in ("pin", "slider", "screw"):
                assert np.abs(one["axis"] - other["axis"]).max() < 1e-13
            assert np.abs(one["point"] - other["point"]).max() < 1e-13
        q, was = model.q[again.q_slice], old.q[hinge.q_slice]
        if hinge.kind == "free":  # as a unit quaternion of either sign; here its scalar part is positive
            q, was = (np.r_[x[:4] / np.linalg.norm(x[:4]) * np.sign(x[0]), x[4:]] for x in (q, was))
        assert np.allclose(q, was, rtol=0, atol=1e-11), name
        assert np.allclose(model.v[again.v_slice], old.v[hinge.v_slice], rtol=0, atol=1e-11), name
    Motions(model).assert_same(Motions(old), ROUNDING)


@pytest.mark.parametrize("kind", OF_ONE_COORDINATE)
def test_coordinates_keep_their_numbers_limits_and_rotors(kind):
    """Of hinges that are turned round, subhinges are in the other order; a cylindrical one may stay in its own."""
    model = flying(kind, 60, rotors=True)
    for name in ("hinge1", "hinge2"):
        count = len(model.hinges[name].subhinges)
        model.hinges[name].limits = -1.0 - np.arange(count), 2.0 + np.arange(count)
    old = copy.copy(model)
    model.reroot("body7")
    for name in ("hinge1", "hinge2", "hinge7"):
        hinge, was = model.hinges[name], old.hinges[name]
        order = slice(None, None, 1 if kind == "cylindrical" else -1)
        assert np.array_equal(model.q[hinge.q_slice], old.q[was.q_slice][order])
        assert np.array_equal(model.v[hinge.v_slice], old.v[was.v_slice][order])
        assert np.array_equal(hinge.rotor_inertia, was.rotor_inertia[order])
        assert hinge.kind == (kind if kind in ("universal", "gimbal", "cylindrical") or len(hinge.subhinges) == 1 else "custom")
        if was.limits is not None:
            assert all(np.array_equal(now, before[order]) for now, before in zip(hinge.limits, was.limits, strict=True))


@pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES.values()], ids=str)
def test_the_same_forces_give_the_same_accelerations(kind):
    """Gravity, and forces along coordinates that keep their numbers, act on both alike. Accelerations of all bodies, in quad precision:
    what differs is the rounding of frames to double, times what the hinges make of it."""
    model = flying(kind, 80, rotors=True)
    model.gravity = (0.3, -2.0, -9.0)
    tau = {name: np.linspace(-1, 1, h.v_slice.stop - h.v_slice.start + 2)[1:-1] + 0.3 for name, h in model.hinges.items()}
    keep = {name for name, h in model.hinges.items() if all(s["kind"] in ("pin", "slider", "screw") for s in h.subhinges)}
    way = {"hinge1", "hinge2", "hinge4", "hinge7"}

    def accelerations(model, turned):
        forces = np.zeros(model.nv)
        for name, hinge in model.hinges.items():
            if name in keep:
                reverse = turned and name in way and hinge.kind != "cylindrical"
                forces[hinge.v_slice] = tau[name][::-1] if reverse else tau[name]
        vdot = model.forward_dynamics(model.q, model.v, forces, precision="quad")
        return {name: model.frame(name).acceleration(model.q, model.v, vdot, precision="quad") for name in model.bodies}, vdot

    before, _ = accelerations(model, False)
    model.reroot("body7")
    after, _ = accelerations(model, True)
    size = max(np.abs(a).max() for a in before.values())
    for name, acceleration in before.items():
        assert np.abs(after[name] - acceleration).max() <= 1e-10 * size, name


@pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES.values()], ids=str)
def test_present_accelerations_go_along(kind):
    model = flying(kind, 100)
    model.frames.vdot = np.random.default_rng(1).normal(size=model.nv)
    before = {name: model.frame(name).acceleration() for name in model.bodies}
    model.reroot("body7")
    for name, acceleration in before.items():
        now = model.frame(name).acceleration()
        assert np.abs(now - acceleration).max() <= 1e-11 * (1 + np.abs(acceleration).max()), name


def test_the_first_body_stays_the_first():
    model = flying("pin", 1)
    MM, before = model.soa.MM, repr(model.description())
    assert model.reroot("body0").name == "body0" and model.reroot(model.bodies["body0"]).name == "body0"
    assert repr(model.description()) == before and MM.check_current() is None
    alone = pc.Multibody("stone")
    alone.add_body("stone", None, "free", mass=1.0, inertia=np.eye(3))
    assert alone.reroot("stone").parent is None


def test_old_operators_and_parts_say_so_and_new_ones_follow(tmp_path):
    model = flying("ball", 2)
    MM, part = model.soa.MM, model.subgraph(root="body4")
    model.reroot("body4")
    for ask in (MM.dense, part.mass_matrix):
        with pytest.raises(pc.StaleOperatorError, match="the root was moved to body 'body4'"):
            ask()
    again = pickle.loads(pickle.dumps(model))
    assert np.array_equal(again.mass_matrix(), model.mass_matrix()) and repr(again.description()) == repr(model.description())
    model.save(tmp_path / "rerooted.toml")
    assert repr(pc.load(tmp_path / "rerooted.toml").description()) == repr(model.description())


def test_roots_that_cannot_move():
    arm = pc.chain(3)
    words = "body 'body0', the root that carries 'body2', hangs on the base by hinge 'hinge0' of kind 'pin'"
    refused(arm, lambda: arm.reroot("body2"), words, "detach('body0') first")
    arm.detach("body0")
    arm.reroot("body2")
    assert arm.bodies["body2"].parent is None
    arm.hinges["hinge0"].rotor_inertia = 0.1
    refused(arm, lambda: arm.reroot("body0"), "hinge 'hinge0' has rotors against the base", "zero first")
    model = flying("ball", 3)
    model.hinges["hinge2"].rotor_inertia = [0.1, 0.1, 0.2]
    refused(model, lambda: model.reroot("body7"), "hinge 'hinge2' has rotors about axes of one of its bodies (ball)", "the same value")
    model = flying("free", 4)
    model.hinges["hinge2"].rotor_inertia = 0.1
    refused(model, lambda: model.reroot("body7"), "hinge 'hinge2' has rotors about axes of one of its bodies (free)")
    refused(model, lambda: model.reroot("nobody"), "'nobody'")
    refused(model, lambda: model.reroot(3), "not by 3")
    part = model.subgraph(root="body1")
    refused(part, lambda: part.reroot("body2"), "is a part of")


def test_what_the_file_said_of_coordinates_turns_with_them():
    robot = pc.Multibody("robot")
    for k, (kind, options) in enumerate([("free", {}), ("universal", {}), ("pin", {})]):
        robot.add_body(f"b{k}", f"b{k - 1}" if k else None, kind, mass=1.0, inertia=np.eye(3), position=(1, 0, 0), **options)
    robot._left_aside = {"damping": np.r_[np.full(6, np.nan), 1.0, 2.0, 3.0]}
    robot._actuators = [{"name": "motor", "coordinate": "b1[0]"}, {"name": "none", "coordinate": None}]
    robot.reroot("b2")
    damping = dict(zip(robot.coordinate_names, robot.left_aside["damping"], strict=True))
    assert (damping["b1[0]"], damping["b1[1]"], damping["b2"]) == (2, 1, 3) and np.isnan(damping["b0[3]"])
    assert [actuator["coordinate"] for actuator in robot.actuators] == ["b1[1]", None]


@pytest.mark.parametrize("kind", ["universal", "gimbal", "planar"])
@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda n, nv: pc.effects.Spring(2.0, hinges=["hinge1[0]"]), "of 'hinge1' one by one"),
        (lambda n, nv: pc.effects.Damping({"hinge1": np.ones(n)}), "of 'hinge1' one by one"),
        (lambda n, nv: pc.effects.Damping(np.ones(n), hinges="hinge1"), "of 'hinge1' one by one"),
        (lambda n, nv: pc.effects.Damping(np.ones(nv), hinges="*"), "all coordinates one by one, in their order"),
        (lambda n, nv: pc.effects.RotorInertia(np.ones(nv)), "all coordinates one by one, in their order"),
    ],
)
def test_effects_of_single_coordinates_are_not_turned_without_a_word(kind, made, words):
    """A spring at the first axis of a universal hinge would be at the second one's afterwards."""
    several = pc.tree([-1, 0, 1], ["free", kind, "pin"], seed=1)
    v = several.hinges["hinge1"].v_slice
    effect = made(v.stop - v.start, several.nv)
    scene = pc.Scene(several).add(effect, name="it")
    refused(several, lambda: several.reroot("body2"), "effect 'it' of a scene takes", words, "'body2' is the root")
    several.reroot("body0")  # the root that it has
    scene.remove("it").add(pc.effects.Spring(2.0), pc.effects.Damping(0.3, hinges=["hinge1", "hinge2"]))
    state = several.random_state(2)
    several.q, several.v = state.q, state.v
    before = scene.evaluate(several.q, several.v)
    power = {name: forces @ several.v for name, forces in before.forces.items()}
    several.reroot("body2")
    for name, forces in scene.evaluate(several.q, several.v).forces.items():
        assert forces @ several.v == pytest.approx(power[name], rel=1e-12)
