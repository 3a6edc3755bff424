"""Bodies coalesced, split and pruned: the same motion before and after, and from one to the other what was there, in any order."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pycraft as pc
from support.locked_models import EPS, KINDS, bits, coordinates, moving, size, some_of, stopped
from support.mechanisms import random_tree


def motion(model, exclude=()):
    """Poses and Jacobians of all named frames, ℳ, and what forces do, with v̇ times ℳ."""
    tau = np.random.default_rng(0).normal(size=model.nv)
    frames = [name for name in sorted([*model.bodies, *model.nodes]) if name not in exclude]
    return {
        "mass matrix": model.mass_matrix(),
        "bias": model.bias_forces(),
        "vdot": model.mass_matrix() @ model.forward_dynamics(tau=tau),
        "energy": np.array([model.kinetic_energy()]),
    } | {name: np.hstack([model.pose(name).ravel(), model.jacobian(name).ravel()]) for name in frames}


def agree(one, other, bound):
    assert one.keys() == other.keys()
    for key, value in one.items():
        assert value.shape == other[key].shape and np.abs(value - other[key]).max(initial=0) <= bound * size(value), key


def bound_of(model):
    """Rounding of products along the tree and of sums of inertias: it grows with the bodies, v̇ with the condition of ℳ."""
    mass = model.mass_matrix()
    return 200 * EPS * (1 + len(model.bodies)) * max(1.0, np.linalg.cond(mass) if mass.size else 1.0)


def welded(seed):
    """A random tree of which some hinges are locked, kept welds among them; and names of the bodies on welds."""
    model, chosen = some_of(seed)
    model.add_node("tip", list(model.bodies)[-1], position=(0.1, 0.2, 0.3))
    model.lock(chosen)
    return model, [name for name, body in model.bodies.items() if body.hinge.kind == "weld"]


@pytest.mark.parametrize("seed", range(25))
def test_the_motion_is_the_same(seed):
    model, on_welds = welded(seed)
    before, bound, names = motion(model), bound_of(model), list(model.coordinate_names)
    assert model.coalesce() == on_welds == model.coalesced
    assert all(body.hinge.kind != "weld" for body in model.bodies.values()) and model.coordinate_names == names
    agree(motion(model), before, bound)
    assert model.coalesce() == []


@pytest.mark.parametrize("seed", range(25))
def test_all_at_once_come_back_bit_for_bit(seed):
    model, on_welds = welded(seed)
    before = bits(model)
    model.coalesce()
    assert sorted(model.split()) == sorted(on_welds) and model.coalesced == []
    assert bits(model) == before


@pytest.mark.parametrize("seed", range(25))
def test_in_any_order_one_by_one(seed):
    """Each of them is a body again and the others are not, and the motion is the same at each step."""
    model, on_welds = welded(seed)
    if not on_welds:
        return
    rng = np.random.default_rng(seed)
    before, bound, structure = motion(model), 10 * bound_of(model), {name: body.parent for name, body in model.bodies.items()}
    for name in rng.permutation(on_welds):
        model.coalesce(str(name))
        agree(motion(model), before, bound)
    for name in rng.permutation(on_welds):
        assert model.split(str(name)) == [name]
        assert name in model.bodies and name not in model.coalesced
        agree(motion(model), before, bound)
    now = {name: body.parent for name, body in model.bodies.items()}
    assert {name: parent and parent.name for name, parent in now.items()} == {
        name: parent and parent.name for name, parent in structure.items()
    }


def test_of_a_chain_of_welds_any_one():
    """a into b and b into c: when a is split alone, c carries it, and b again once that is split."""
    model = pc.chain(5, seed=2)
    model.q = [0.1, 0.4, -0.3, 0.8, 0.2]
    before = bits(model)
    model.lock(["hinge1", "hinge2", "hinge3"])
    locked = bits(model)
    for order in (["body3", "body2", "body1"], ["body1", "body2", "body3"], ["body2", "body1", "body3"]):
        for name in order:
            model.coalesce(name)
        assert list(model.bodies) == ["body0", "body4"] and model.nv == 2
        model.split("body2")
        assert model.bodies["body2"].parent.name == "body0" and model.bodies["body4"].parent.name == "body2"
        assert sorted(model.coalesced) == ["body1", "body3"] and model.nodes["body3"].body.name == "body2"
        assert model.nodes["body1"].body.name == "body0"
        model.split()
        assert bits(model) == locked
    model.unlock()
    assert bits(model) == before


def test_mass_properties_in_closed_form():
    """Two points of 1 kg and 3 kg at one metre: the centre at 3/4, and 1·3/(1 + 3) kg m² about it."""
    mb = pc.Multibody("points")
    mb.add_body("one", mass=1.0)
    mb.add_body("three", parent="one", hinge="slider", axis=(1, 0, 0), mass=3.0)
    mb.q = [0.0, 1.0]
    mb.lock("three")
    mb.coalesce("three")
    one = mb.bodies["one"]
    assert (one.mass, one.com.tolist()) == (4.0, [0.75, 0.0, 0.0]) and np.allclose(one.inertia, np.diag([0, 0.75, 0.75]), rtol=0, atol=EPS)
    mb.split("three")
    assert (mb.bodies["one"].mass, mb.bodies["three"].mass, mb.bodies["one"].inertia.any()) == (1.0, 3.0, False)


def test_on_the_base_a_body_leaves_its_frames_alone():
    model = pc.tree([-1, 0, 0], ["pin", "pin", "slider"], seed=3)
    model.gravity = (0, 0, -9.81)
    model.add_node("mark", "body0", position=(0, 1, 0))
    state = model.random_state(1)
    model.q, model.v = state.q, state.v
    stopped(model, ["hinge0"])
    model.lock("hinge0")
    before, mass, whole = motion(model), model.bodies["body0"].mass, bits(model)
    total = model.mass
    model.coalesce()
    agree(motion(model), before, bound_of(model))
    assert np.isclose(total - model.mass, mass) and all(body.parent is None for body in model.bodies.values())
    assert model.nodes["mark"].body is None
    model.split("body0")
    assert bits(model) == whole


# The carrier is changed meanwhile -------------------------------------------------------------------------------------


def carrying(mass=2.0):
    mb = pc.Multibody("cart")
    mb.add_body("cart", hinge="slider", mass=5.0, com=(0.1, 0, 0), inertia=np.diag([1.0, 2.0, 2.5]))
    for name, x in (("left", -1.0), ("right", 1.0)):
        mb.add_body(name, parent="cart", position=(x, 0, 0), mass=mass, com=(0, 0.2, 0), inertia=np.diag([0.1, 0.2, 0.25]))
    mb.lock(["left", "right"])
    return mb


def test_what_was_added_to_the_carrier_stays_on_it():
    """Masses are taken off what is there: the payload that the cart took stays, whichever is split first."""
    for order in (["left", "right"], ["right", "left"]):
        model, alone = carrying(), carrying()
        for mb in (model, alone):
            if mb is model:
                mb.coalesce()
            mb.add_body("payload", parent="cart", hinge="weld", hinge_name="strap", position=(0, 0, 0.5), mass=3.0, inertia=np.eye(3))
        for name in order:
            model.split(name)
        for name in model.bodies:
            for key in ("mass", "com", "inertia"):
                assert np.allclose(getattr(model.bodies[name], key), getattr(alone.bodies[name], key), rtol=0, atol=20 * EPS), (name, key)
        assert model.bodies["left"].mass == 2.0


def test_what_remains_is_a_body():
    model = carrying()
    model.coalesce()
    model.bodies["cart"].mass = 1.0
    before = bits(model)
    with pytest.raises(pc.ModelError, match="body 'cart' without 'right': its mass is -1 kg"):
        model.split("right")
    assert bits(model) == before and model.coalesced == ["left", "right"]
    model.bodies["cart"].mass = 9.0
    model.bodies["cart"].inertia = 1e-3 * np.eye(3)
    with pytest.raises(pc.ModelError, match="body 'cart' without 'left': its inertia has the principal moment"):
        model.split("left")
    assert model.coalesced == ["left", "right"]


def test_nothing_remains_of_a_carrier_that_had_nothing():
    """A massless carrier whose numbers were set: what is left is zero, not rounding."""
    mb = pc.Multibody("cart")
    mb.add_body("cart", hinge="slider")
    mb.add_body("load", parent="cart", mass=0.3, position=(0.1, 0.7, 0.3), com=(0.1, 0.2, 0.3), inertia=np.diag([0.1, 0.2, 0.15]))
    mb.lock("load")
    mb.coalesce()
    cart = mb.bodies["cart"]
    cart.mass, cart.com = cart.mass * 2, cart.com
    cart.mass, cart.inertia = 0.3, np.nextafter(cart.inertia, 1) * (cart.inertia != 0)
    mb.split()
    assert cart.mass == 0 and not cart.inertia.any() and not cart.com.any()


def test_a_placement_that_is_set_on_the_carrier_moves_along():
    model = pc.chain(3, seed=1)
    model.lock("hinge1")
    model.coalesce()
    moved = model.hinges["hinge2"].placement.copy()
    moved[:3, 3] += (0.0, 0.5, 0.0)
    model.hinges["hinge2"].placement = moved
    pose = model.pose("body2")
    model.split()
    assert model.bodies["body2"].parent.name == "body1" and np.allclose(model.pose("body2"), pose, rtol=0, atol=4 * EPS)


def test_what_hung_on_it_and_was_removed_or_coalesced():
    model = pc.tree([-1, 0, 1, 1, 1], ["pin"] * 5, seed=2)
    model.lock("hinge1")
    model.coalesce()
    model.remove_body("body3")
    model.add_body("body3", parent="body0", mass=1.0)
    model.lock("hinge4")
    model.coalesce("body4")
    model.split("body1")
    parents = {name: body.parent and body.parent.name for name, body in model.bodies.items()}
    assert parents == {"body0": None, "body1": "body0", "body2": "body1", "body3": "body0"}
    assert model.coalesced == ["body4"] and model.nodes["body4"].body.name == "body1"  # it hung there
    model.remove_body("body1")
    assert model.coalesced == [] and model.locked == []


# What is refused, and what goes with it -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda m: m.coalesce("body1"), r"body 'body1' hangs on hinge 'hinge1' \(pin\), which moves: lock the hinge first"),
        (lambda m: m.coalesce("arm"), "no body of 'chain of 5' is called 'arm'"),
        (lambda m: m.coalesce("body2"), "'body2' is welded to body 'body1' and is a node of it; .* or split it off where it was coalesced"),
        (lambda m: m.coalesce(7), "a body is named by a string, not by 7"),
        (lambda m: m.split("body1"), "body 'body1' of 'chain of 5' is not coalesced; coalesced are body2"),
        (lambda m: m.split("arm"), "body 'arm' of 'chain of 5' is not coalesced"),
        (lambda m: m.subgraph(root="body0").coalesce(), "coalesce bodies there, and take the part anew"),
        (lambda m: m.subgraph(root="body0").split(), "split bodies there, and take the part anew"),
        (lambda m: m.subgraph(root="body0").prune(), "lock hinges there, and take the part anew"),
    ],
)  # fmt: skip
def test_what_is_refused_says_why_and_what_would_do(edit, words):
    model = pc.chain(5, seed=1)
    model.lock(["hinge2", "hinge4"])
    model.coalesce("body2")
    before = bits(model)
    with pytest.raises(pc.ModelError, match=words):
        edit(model)
    assert bits(model) == before and model.coalesced == ["body2"] and model.locked == ["hinge4"]


def test_a_hinge_that_took_the_name_meanwhile():
    model = pc.chain(3, seed=1)
    model.lock("hinge1")
    model.coalesce()
    model.add_body("other", parent="body0", hinge_name="hinge1", mass=1.0)
    before = bits(model)
    with pytest.raises(pc.ModelError, match="has a hinge called 'hinge1' already, as that of body 'body1' was"):
        model.split()
    assert bits(model) == before and model.coalesced == ["body1"]
    with pytest.raises(pc.ModelError, match="'body1' already"):
        model.add_body("body1")


def test_copies_pickles_and_parts():
    model = pc.tree([-1, 0, 1, 0], ["free", "pin", "ball", "slider"], seed=3)
    before = bits(model)
    model.lock(["hinge1", "hinge2"])
    model.coalesce()
    for other in (copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model)), copy.copy(model.subgraph(root="body0"))):
        assert other.coalesced == ["body1", "body2"] and bits(other) == bits(model)
        other.split(), other.unlock()
        assert bits(other) == before
    assert model.coalesced == ["body1", "body2"] and model.subgraph(root="body3").coalesced == []


def test_operators_and_parts_are_stale_and_new_ones_follow():
    model = pc.chain(4, seed=1)
    model.lock("hinge1")
    for edit, words in ((model.coalesce, "body 'body1' was coalesced"), (model.split, "body 'body1' was split off")):
        operator, part = model.soa.MM, model.subgraph(root="body2")
        edit()
        for ask in (operator.dense, lambda part=part: part.nv):
            with pytest.raises(pc.StaleOperatorError, match=words):
                ask()
        assert np.allclose(model.soa.MM.dense(), model.mass_matrix())


def test_frames_stay_where_they_are():
    model = pc.chain(3, seed=1)
    model.q = [0.1, 0.2, 0.3]
    model.add_frame("lens", on="body1", position=(1, 0, 0))
    pose = model.frame("lens").pose()
    model.lock("hinge1")
    model.coalesce()
    assert np.allclose(model.frame("lens").pose(), pose, rtol=0, atol=4 * EPS)
    model.split()
    assert np.allclose(model.frame("lens").pose(), pose, rtol=0, atol=4 * EPS)


# Massless leaves ------------------------------------------------------------------------------------------------------


def test_massless_leaves_are_pruned_until_there_are_none():
    model = pc.chain(2, seed=1)
    model.add_body("finger", parent="body1", position=(1, 0, 0))
    model.add_body("nail", parent="finger", hinge="ball")
    model.add_body("wheel", parent="body0", rotor_inertia=0.1)
    model.add_body("dish", parent="body0", inertia=np.eye(3))
    model.add_body("stand", parent="body0")
    model.add_body("cup", parent="stand", position=(0.3, 0, 0), mass=0.1, inertia=np.eye(3))
    model.add_node("mark", "nail", position=(0, 0, 1))
    v = np.arange(1.0, model.nv + 1)
    model.v = v
    before, pose = bits(model), model.pose("mark")
    assert model.prune() == ["finger", "nail"] == model.coalesced
    assert list(model.bodies) == ["body0", "body1", "wheel", "dish", "stand", "cup"] and model.nodes["mark"].body.name == "body1"
    assert np.allclose(model.pose("mark"), pose, rtol=0, atol=8 * EPS)
    assert np.array_equal(model.v, np.delete(v, range(2, 6))) and model.prune() == []
    assert np.isfinite(model.forward_dynamics(tau=np.ones(model.nv))).all()
    model.split(), model.unlock()
    model.v = v
    assert bits(model) == before


def test_a_model_of_nothing_is_pruned_to_nothing():
    model = pc.Multibody("nothing")
    assert model.prune() == [] and model.coalesce() == [] and model.split() == []
    model.add_body("ghost", hinge="free")
    assert model.prune() == ["ghost"] and model.nv == 0 and list(model.nodes) == ["ghost"]
    assert model.split() == ["ghost"] and model.unlock() == ["ghost"] and model.nv == 6


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_any_sequence_of_edits_ends_where_it_began(data):
    """Locked, coalesced, split and unlocked at random: the motion of what is left is a block of the first one's at every step."""
    model = random_tree(np.random.default_rng(data.draw(st.integers(0, 10**6))), data.draw(st.integers(1, 8)), kinds=KINDS)
    first = copy.copy(stopped(model, moving(model)))
    names = {name: [first.coordinate_names[j] for j in coordinates(first, [name])[0]] for name in moving(first)}
    mass, frames = first.mass_matrix(), {name: first.pose(name) for name in [*first.bodies, *first.nodes]}
    bound = 20 * bound_of(first)
    for _ in range(data.draw(st.integers(1, 8))):
        what = data.draw(st.sampled_from(["lock", "unlock", "coalesce", "split"]))
        choices = {
            "lock": moving(model),
            "unlock": model.locked,
            "coalesce": [name for name, body in model.bodies.items() if body.hinge.kind == "weld"],
            "split": model.coalesced,
        }[what]
        if choices:
            getattr(model, what)(data.draw(st.lists(st.sampled_from(choices), min_size=1, max_size=3, unique=True)))
        left = [first.coordinate_names.index(name) for name in model.coordinate_names]
        assert np.abs(model.mass_matrix() - mass[np.ix_(left, left)]).max(initial=0) <= bound * size(mass)
        assert all(np.abs(model.pose(name) - pose).max() <= bound * size(pose) for name, pose in frames.items())
    model.split()
    model.unlock()
    assert {name: [model.coordinate_names[j] for j in coordinates(model, [name])[0]] for name in moving(model)} == names
    one, other = model.description()["bodies"], {body["name"]: body for body in first.description()["bodies"]}
    for body in one:
        was = other[body["name"]]
        assert body["hinge"]["kind"] == was["hinge"]["kind"] and np.isclose(body["mass"], was["mass"], rtol=1e-13)
        for key in ("rotation", "position"):
            assert np.abs(body["hinge"]["placement"][key] - was["hinge"]["placement"][key]).max() <= bound * size(
                was["hinge"]["placement"][key]
            )
        assert np.abs(body["inertia"] - was["inertia"]).max() <= bound * 10 * size(was["inertia"])
