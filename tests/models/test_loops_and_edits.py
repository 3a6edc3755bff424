"""Loops when the structure changes: what they stand on is in use; copies of bodies and merged models bring copies of them."""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc


def closed():
    """Two legs of two rods: a pin between the tips, a gear between the hips, a ball of one knee on the base."""
    model = pc.Multibody("legs")
    rod = dict(mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0.0, 0.1, 0.1]))
    trunk = model.add_body("trunk", None, "slider", axis=(1, 0, 0), mass=2.0)
    for side in "lr":
        model.add_body(f"{side} thigh", trunk, "pin", position=(0, 1.0 if side == "l" else -1.0, 0), **rod)
        model.add_body(f"{side} shin", f"{side} thigh", "pin", position=(1, 0, 0), **rod)
        model.add_node(f"{side} foot", f"{side} shin", position=(1, 0, 0))
    model.add_loop("r foot", "l foot", "pin", name="feet")
    model.add_coupling({"l thigh": 1.0, "r thigh": -2.0}, name="gear")
    model.add_loop("l shin", hinge="ball", position=(0.3, 0.2, 0.1), name="ground")
    model.q, model.v = [0.1, 0.2, 0.3, 0.4, 0.5], [1, 2, 3, 4, 5]
    return model


def rows(model, *names):
    """Residuals and what coordinates' velocities make of the rows: of loops that are copied they are the same numbers."""
    return np.concatenate([np.r_[model.loops[n].residual(), model.loops[n].jacobian() @ model.v, model.loops[n].bias()] for n in names])


def test_a_body_that_a_loop_is_closed_at_is_in_use():
    model = closed()
    with pytest.raises(pc.ModelError, match=r"'r thigh' is in use: .*loop 'feet' is closed there; loop 'gear' is closed there"):
        model.remove_body("r thigh")
    assert list(model.loops) == ["feet", "gear", "ground"] and len(model.bodies) == 5
    removed = model.remove_body("r thigh", with_uses=True)
    assert removed.loops == ["feet", "gear"] and list(model.loops) == ["ground"]
    assert rows(model, "ground").shape == (9,)


def test_loops_among_copied_bodies_are_copied():
    model = closed()
    model.copy_subtree("trunk", prefix="twin ")
    assert list(model.loops) == ["feet", "gear", "ground", "twin feet", "twin gear"]  # not the one on the base
    # The same sums of the same numbers, but that the tree may be walked in another order: some roundings of lengths and rates up to 10.
    np.testing.assert_allclose(rows(model, "twin feet", "twin gear"), rows(model, "feet", "gear"), atol=100 * 10 * 2.2e-16)
    model.copy_subtree("l thigh", "trunk", suffix=" again")
    assert len(model.loops) == 5


def test_a_name_that_a_loop_has_is_refused_and_nothing_is_copied():
    model = closed()
    model.add_coupling({"l shin": 1.0, "r shin": -1.0}, name="twin gear")
    with pytest.raises(pc.ModelError, match="loops called 'twin gear' already; give a prefix"):
        model.copy_subtree("trunk", prefix="twin ")
    assert len(model.bodies) == 5 and len(model.loops) == 4


def test_merged_models_bring_their_loops():
    other, model = closed(), pc.chain(2)
    with pytest.raises(pc.ModelError, match="loop 'ground' is closed at the base of 'legs', which is placed elsewhere here"):
        model.merge(other, "body1")
    assert len(model.bodies) == 2 and not len(model.loops)
    model.merge(other, prefix="his ")
    assert list(model.loops) == ["his feet", "his gear", "his ground"]
    bound = 100 * 10 * 2.2e-16
    np.testing.assert_allclose(rows(model, *model.loops), rows(other, *other.loops), atol=bound)
    other.loops["ground"].remove()
    mounted = pc.chain(2)
    mounted.merge(other, "body1", position=(1, 2, 3))
    np.testing.assert_allclose(rows(mounted, "feet", "gear"), rows(other, "feet", "gear"), atol=bound)


def test_edits_that_keep_motions_keep_what_loops_say_of_them():
    model = closed()
    before = rows(model, "feet", "ground")
    model.reattach("l shin", "l thigh", "ball", position=(1, 0, 0))
    np.testing.assert_allclose(model.loops["feet"].residual(), before[:5], atol=1e-8)  # to the tolerance of the new hinge
    locked = closed()
    locked.v = [1, 2, 0, 4, 5]
    said = rows(locked, "feet", "gear", "ground")
    locked.lock("l shin")
    np.testing.assert_allclose(locked.loops.residual(), closed().loops.residual(), atol=1e-13)
    with_lock = [locked.loops[n].jacobian() @ locked.v for n in ("feet", "gear", "ground")]
    np.testing.assert_allclose(np.concatenate(with_lock), np.r_[said[5:10], said[16:17], said[21:24]], atol=1e-13)


def test_the_root_does_not_move_over_locked_hinges():
    robot = pc.tree([-1, 0, 1, 1], ["free", "pin", "ball", "pin"], seed=1)
    robot.lock("hinge2")
    robot.reroot("body3")  # not over it
    with pytest.raises(pc.ModelError, match=r"between the root and body 'body2' there are locked hinges, 'hinge2': unlock them"):
        robot.reroot("body2")
    assert robot.locked == ["hinge2"] and robot.bodies["body3"].parent is None
    robot.unlock()
    robot.reroot("body2")
    assert robot.bodies["body2"].parent is None


@pytest.mark.parametrize("kind", ["universal", "gimbal", "cylindrical", "planar"])
def test_couplings_follow_the_coordinates_of_hinges_that_are_turned_round(kind):
    robot = pc.tree([-1, 0, 1], ["free", kind, "pin"], seed=2)
    robot.q, robot.v = robot.random_state(1).q, robot.random_state(1).v
    robot.add_coupling({"hinge1[0]": 1.0, "hinge2": [0.5, 2.0]}, name="gear")
    robot.add_loop("body2", hinge="ball", name="ground")
    robot.add_coupling([robot.coordinate_names[-2]], function=lambda q: (np.sin(q[0]), [np.cos(q[0])], [[-np.sin(q[0])]]), name="cam")
    before = rows(robot, "gear", "cam")
    robot.reroot("body2")
    assert list(robot.loops) == ["gear", "ground", "cam"]
    np.testing.assert_array_equal(rows(robot, "gear", "cam"), before)  # the coordinates keep their numbers


def test_a_coupled_hinge_is_not_left_for_another_one_of_its_name():
    model = closed()
    before = rows(model, *model.loops)
    slide = lambda: model.reattach("r thigh", "trunk", "slider", placement="here", velocity="impulse")
    for edit in (slide, lambda: model.detach("r thigh")):
        with pytest.raises(pc.ModelError, match=r"'r thigh' is in use: its coordinates are those of coupling 'gear'; remove that first"):
            edit()
    np.testing.assert_array_equal(rows(model, *model.loops), before)
    model.loops["gear"].remove()
    slide()
    assert model.hinges["r thigh"].kind == "slider"


def copies(model, tmp_path):
    model.save(tmp_path / "model.toml")
    return copy.deepcopy(model), pickle.loads(pickle.dumps(model)), pc.load(tmp_path / "model.toml")


def test_a_coupling_holds_by_the_hinges_that_are_locked(tmp_path):
    """The row of the others alone, with the value that it had; what it was when they are unlocked, to the last bit."""
    model = closed()
    before, names, Q = rows(model, *model.loops), list(model.loops), model.loops["gear"].jacobian()
    residual = model.loops.residual()
    model.lock("r thigh", impulsive=True)
    assert list(model.loops) == names and model.nv == 4
    left = [name for name in model.coordinate_names if name != "r thigh"]
    expected = [1.0 if name == "l thigh" else 0.0 for name in left]
    np.testing.assert_array_equal(model.loops["gear"].jacobian(), [expected])
    np.testing.assert_allclose(model.loops.residual(), residual, rtol=1e-15, atol=1e-15)
    for again in copies(model, tmp_path):
        np.testing.assert_array_equal(again.loops.jacobian(), model.loops.jacobian())
        np.testing.assert_allclose(again.loops.residual(), model.loops.residual(), rtol=1e-15, atol=1e-15)
    for again in copies(model, tmp_path)[:2]:
        again.unlock()
        np.testing.assert_array_equal(again.loops["gear"].jacobian(), Q)
    model.unlock()
    model.q, model.v = closed().q, closed().v
    np.testing.assert_array_equal(rows(model, *model.loops), before)
    with pytest.raises(pc.ModelError, match=r"coupling 'gear' would have no free coordinate left, of 'l thigh', 'r thigh': lock fewer"):
        model.lock("? thigh", impulsive=True)
    assert model.locked == [] and model.nv == 5
    model.lock("l thigh", impulsive=True)
    with pytest.raises(pc.ModelError, match="coupling 'gear' would have no free coordinate left"):
        model.lock("r thigh", impulsive=True)


def product(q):
    return q[0] * q[1] - q[2], [q[1], q[0], -1.0], [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]


def test_functions_and_polynomials_with_locked_hinges():
    """The derivatives of what is left, against those of a coupling that is declared so; motion keeps it."""
    model = pc.chain(3)
    model.gravity = (0, -9.81, 0)
    model.add_coupling(["hinge0", "hinge1", "hinge2"], function=product, name="product")
    model.add_coupling({"hinge0": [0.5, 1.0, 2.0], "hinge1": [0.0, 0.0, 1.0]}, constant=-1.0, name="poly")
    model.q = [0.5, 0.7, 0.35]
    r, Q = model.loops.residual(), model.loops.jacobian()
    model.lock("hinge0")
    for one in (model, copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        np.testing.assert_allclose(one.loops.residual(), r, rtol=1e-15, atol=1e-15)
        np.testing.assert_allclose(one.loops.jacobian(), Q[:, 1:], rtol=1e-15)
        np.testing.assert_allclose(one.loops.bias(v=[2.0, 3.0]), [0.0, 2.0 * 4.0])
        one.unlock("hinge0")
        np.testing.assert_array_equal(one.loops.jacobian(), Q)
    model.loops.remove("poly")
    model.lock("hinge0")
    held = model.constrained_dynamics()
    assert abs(model.loops.jacobian() @ held.vdot).max() < 1e-12
    run = pc.Scene(model).add(pc.effects.Gravity((0, -9.81, 0)), pc.effects.Loop()).simulate(0.5, model.q, model.v, progress=False)
    assert abs(0.5 * run.q[:, 0] - run.q[:, 1]).max() < 1e-12


def test_bodies_that_a_loop_joins_are_not_made_one(tmp_path):
    model = closed()
    model.add_loop("r thigh", "trunk", "pin", position=(0, -1, 0), name="twice")
    model.add_loop("trunk", hinge="slider", axis=(1, 0, 0), name="rail")
    model.loops["gear"].remove()
    model.lock(["l thigh", "l shin", "trunk"], impulsive=True)
    for bodies, ends in ((None, "loop 'ground' .* 'l shin' and the base"), ("trunk", "loop 'rail' .* 'trunk' and the base")):
        with pytest.raises(pc.ModelError, match=f"{ends}, which would be one body; remove that first"):
            model.coalesce(bodies)
        assert model.coalesced == []
    model.loops["rail"].remove()
    with pytest.raises(pc.ModelError, match="loop 'ground' closes a chain between body 'l shin' and the base"):
        model.coalesce(["trunk", "l thigh", "l shin"])
    assert model.coalesce(["trunk", "l thigh"]) == ["trunk", "l thigh"]
    for again in copies(model, tmp_path):
        np.testing.assert_array_equal(again.loops.residual(), model.loops.residual())
    model.lock("r thigh", impulsive=True)
    with pytest.raises(pc.ModelError, match="loop 'twice' closes a chain between body 'r thigh' and the base"):
        model.coalesce("r thigh")  # the trunk is the base's already
    assert model.split() == ["l thigh", "trunk"]


def test_a_massless_leaf_that_closes_a_chain_is_not_pruned():
    """The coupler of a four-bar: welded it would hold the cranks."""
    bars = pc.chain(2)
    bars.add_body("coupler", "body1", "pin", position=(1, 0, 0))
    bars.add_body("hand", "coupler", "pin", position=(0.5, 0, 0))
    bars.add_body("driven", None, "pin", position=(5, 0, 0))
    bars.add_loop("coupler", None, "pin", point=(1, 0, 0), name="closure")
    bars.add_coupling({"driven": 1.0, "hinge0": -2.0}, name="gear")
    assert bars.prune() == ["hand"]
    assert bars.coordinate_names == ["hinge0", "hinge1", "coupler", "driven"]
    bars.loops["closure"].remove()
    assert bars.prune() == ["coupler"]
    bars.loops["gear"].remove()
    assert bars.prune() == ["driven"]
