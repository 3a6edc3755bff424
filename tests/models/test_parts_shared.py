"""Data that parts share with the whole, their lifetime, and refusals."""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind, random_tree, uniform_batch
from support.oracle import ROUNDING, agree
from support.parts import alone


def robot():
    """Two legs and an arm on a torso that floats, and a body beside it on the base."""
    mb = pc.tree([-1, 0, 1, 0, 3, 0, -1], ["free", "pin", "ball", "pin", "universal", "gimbal", "pin"], seed=5)
    mb.gravity = (0.1, 0.2, -9.8)
    state = mb.random_state(1)
    mb.q, mb.v = state.q, state.v
    return mb


# ---------------------------------------------------------------------- state


def test_a_state_is_shared_without_a_copy():
    mb = robot()
    leg = mb.subgraph(root="body1")
    assert np.shares_memory(leg.q, mb.q) and np.shares_memory(leg.v, mb.v)
    knee = leg.subgraph(root="body2")
    assert np.shares_memory(knee.q, mb.q)
    Q, V = uniform_batch(mb, 5)
    assert np.shares_memory(leg.q_of(Q), Q) and np.shares_memory(leg.v_of(V), V)
    with pytest.raises(ValueError, match="read-only"):
        leg.q[0] = 1


@pytest.mark.parametrize("options", [{"root": "body0"}, {"root": "body0", "without": "body1"}, {"bodies": ["body0", "body3"]}], ids=str)
def test_a_state_set_on_either_is_on_both(options):
    mb = robot()
    part = mb.subgraph(**options)
    first = mb.random_state(2)
    mb.q, mb.v = first.q, first.v
    assert np.array_equal(part.q, mb.q[part.q_index]) and np.array_equal(part.v, mb.v[part.v_index])
    velocity = part.soa.velocity.dense()
    assert np.array_equal(velocity, alone_at(mb, part).soa.velocity.dense())
    q, v = part.random_state(3).q, part.random_state(3).v
    part.q, part.v = q, v
    assert np.array_equal(mb.q[part.q_index], q) and np.array_equal(mb.v[part.v_index], v)
    others = np.setdiff1d(np.arange(mb.nq), part.q_index)
    assert np.array_equal(mb.q[others], first.q[others]) and np.array_equal(part.q, q)
    assert np.array_equal(part.mass_matrix(), part.mass_matrix(q)) and not np.array_equal(part.soa.velocity.dense(), velocity)
    assert np.array_equal(part.soa.velocity.dense(), alone_at(mb, part).soa.velocity.dense())


def alone_at(model, part):
    other = alone(model, list(part.bodies))
    other.q, other.v = part.q, part.v
    return other


def test_the_motion_of_a_base_may_be_given():
    mb = robot()
    hand = mb.subgraph(root="body5", base="moving")
    followed = np.array(hand.q)
    mb.q = mb.random_state(8).q
    assert not np.array_equal(hand.q[:7], followed[:7])
    given = hand.random_state(4)
    hand.q, hand.v = given.q, given.v
    assert np.array_equal(hand.q, given.q) and np.array_equal(hand.v, given.v)
    assert np.array_equal(mb.q[hand.q_index], given.q[7:])
    mb.q = mb.random_state(9).q
    assert np.array_equal(hand.q[:7], given.q[:7])  # stays given
    hand.follow_base()
    assert np.allclose(hand.q, hand.q_of(), rtol=0, atol=1e-14) and not np.array_equal(hand.q[:7], given.q[:7])


def test_a_moving_base_follows_a_placement_inboard_of_it():
    mb = robot()
    hand = mb.subgraph(root="body5", base="moving")
    before = np.array(hand.q)
    pose = mb.hinges["hinge0"].placement.copy()
    pose[:3, 3] += (1, 2, 3)
    mb.hinges["hinge0"].placement = pose
    assert np.allclose(hand.q[:7], hand.q_of()[:7], rtol=0, atol=1e-14) and not np.array_equal(hand.q, before)


# ---------------------------------------------------------------------- parameters


def test_parameters_are_those_of_the_whole():
    mb = robot()
    leg, whole = mb.subgraph(root="body1"), mb.subgraph()
    knee = leg.subgraph(root="body2")
    made = leg.soa.MM
    q = leg.random_state(0).q
    before = leg.mass_matrix(q), knee.mass_matrix(knee.q_of(q))
    mb.bodies["body2"].mass = 7.5
    assert leg.bodies["body2"].mass == knee.bodies["body2"].mass == whole.bodies["body2"].mass == 7.5
    knee.bodies["body2"].com = (0.5, 0.6, 0.7)
    leg.hinges["hinge2"].placement = np.diag([1.0, -1, -1, 1])
    leg.hinges["hinge1"].rotor_inertia = 0.4
    leg.hinges["hinge1"].limits = (-1, 1)
    knee.gravity = (1, 2, 3)
    assert np.array_equal(mb.bodies["body2"].com, (0.5, 0.6, 0.7)) and np.array_equal(mb.gravity, (1, 2, 3))
    assert mb.hinges["hinge1"].limits == whole.hinges["hinge1"].limits == (-1, 1)
    for part, at, old in [(leg, q, before[0]), (knee, knee.q_of(q), before[1])]:
        other = alone(mb, list(part.bodies))
        assert np.array_equal(part.mass_matrix(at), other.mass_matrix(at)) and not np.array_equal(part.mass_matrix(at), old)
        assert np.array_equal(part.bias_forces(at), other.bias_forces(at))
    assert np.array_equal(made.at(q).dense(), alone(mb, list(leg.bodies)).soa.MM.at(q).dense())


def test_an_edit_of_a_part_is_checked_like_one_of_the_whole():
    mb = robot()
    leg = mb.subgraph(root="body1")
    with pytest.raises(pc.ModelError, match="body1"):
        leg.bodies["body1"].mass = -1.0
    assert leg.bodies["body1"].mass == mb.bodies["body1"].mass > 0
    moving = mb.subgraph(root="body1", base="moving")
    with pytest.raises(pc.ModelError, match="no parameters of its own"):
        moving.moving_base.mass = 1.0


def test_nodes_come_to_all_that_have_the_body():
    mb = robot()
    leg, arm, flying = mb.subgraph(root="body1"), mb.subgraph(root="body5"), mb.subgraph(root="body1", base="moving")
    operator = leg.soa.phi
    mb.add_node("toe", "body2", position=(0, 0, 1))
    leg.add_node("heel", "body2", position=(0, 1, 0))
    assert {"toe", "heel"} <= set(mb.nodes) & set(leg.nodes) & set(flying.nodes) and not {"toe", "heel"} & set(arm.nodes)
    assert np.array_equal(leg.jacobian("toe"), alone_at(mb, leg).jacobian("toe"))
    assert operator.dense().shape  # no operator is stale
    with pytest.raises(pc.ModelError, match="put node 'x' on 'body0' there"):
        leg.add_node("x", None)
    with pytest.raises(pc.ModelError, match="body5"):
        leg.add_node("x", "body5")
    mb.add_body("shoe", "body2", hinge="weld", mass=3.0)
    assert "shoe" in leg.nodes and leg.bodies["body2"].mass == mb.bodies["body2"].mass
    assert np.array_equal(leg.mass_matrix(), alone_at(mb, leg).mass_matrix())


def test_structure_that_changes_ends_a_part():
    mb = robot()
    leg, knee = mb.subgraph(root="body1"), mb.subgraph(root="body1").subgraph(root="body2")
    operator, direct = leg.soa.MM, leg.mass_matrix
    direct()
    mb.add_body("tool", "body5", mass=1.0, inertia=np.eye(3))
    uses = [
        lambda: leg.q, lambda: leg.nv, lambda: direct(), lambda: leg.soa, lambda: operator.dense(), lambda: leg.bodies["body1"].mass,
        lambda: knee.forward_dynamics(), lambda: list(leg.hinges), lambda: leg.subgraph(), lambda: leg.centre_of_mass(),
        lambda: copy.copy(leg), lambda: leg.random_state(), lambda: leg.q_index,
    ]  # fmt: skip
    for use in uses:
        with pytest.raises(pc.StaleOperatorError, match="body 'tool' was added"):
            use()
    assert "has changed since" in repr(leg)
    again = mb.subgraph(root="body1")
    assert np.array_equal(again.mass_matrix(), alone_at(mb, again).mass_matrix())
    mb.remove_body("tool")
    with pytest.raises(pc.StaleOperatorError, match="'tool' was removed"):
        again.mass_matrix()


@pytest.mark.parametrize("edit", ["add", "remove"])
def test_structure_is_edited_on_the_whole(edit):
    leg = robot().subgraph(root="body1")
    with pytest.raises(pc.ModelError, match="is a part of 'tree of 7'.*there, and take the part anew"):
        leg.add_body("more", "body2") if edit == "add" else leg.remove_body("body2")
    assert leg.mass_matrix().shape == (leg.nv, leg.nv)


def test_nothing_is_edited_while_a_part_is_evaluated():
    mb = robot()
    leg = mb.subgraph(root="body1")
    refused = []

    def apply(x):
        for edit in (
            lambda: setattr(mb, "gravity", (0, 0, 1)),
            lambda: mb.remove_body("body5"),
            lambda: setattr(leg.bodies["body1"], "mass", 2.0),
        ):
            with pytest.raises(pc.ModelError, match="is being evaluated"):
                edit()
            refused.append(edit)
        return x

    outside = pc._core.external(apply, apply, leg.soa.Theta, leg.soa.Theta, "L")
    (outside @ leg.soa.MM) @ np.ones(leg.nv)
    assert len(refused) == 3
    mb.gravity = (0, 0, 1)


# ---------------------------------------------------------------------- which sets


def test_paths():
    mb = robot()
    assert list(mb.path("body2", "body5").bodies) == ["body0", "body1", "body2", "body5"]
    assert list(mb.path("body5", "body2").bodies) == ["body0", "body1", "body2", "body5"]
    assert list(mb.path("body2", "body1").bodies) == ["body1", "body2"]
    assert list(mb.path("body4", "body4").bodies) == ["body4"]
    assert list(mb.path(None, "body4").bodies) == ["body0", "body3", "body4"]
    assert list(mb.path("body2", "body6").bodies) == ["body0", "body1", "body2", "body6"]  # by the base
    mb.add_node("hand", "body5")
    assert list(mb.path("hand", mb.bodies["body3"]).bodies) == ["body0", "body3", "body5"]
    with pytest.raises(pc.ModelError, match="a body at least"):
        mb.path(None, None)


def test_what_is_left_out_and_what_is_listed():
    mb = robot()
    assert list(mb.subgraph("body0", without="body1").bodies) == ["body0", "body3", "body4", "body5"]
    assert list(mb.subgraph("body0", without=["body2", mb.bodies["body5"]]).bodies) == ["body0", "body1", "body3", "body4"]
    assert list(mb.subgraph(without=["body0"]).bodies) == ["body6"]
    assert list(mb.subgraph(bodies=["body3", "body0", "body3"]).bodies) == ["body0", "body3"]
    assert list(mb.subgraph(bodies=["body6", "body0"]).bodies) == ["body0", "body6"]
    assert mb.subgraph("body3").name == "tree of 7/body3" and mb.subgraph("body3", name="leg").name == "leg"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"bodies": ["body1", "body3"]}, "between 'body1' and 'body3' there is 'body0', which is not among"),
        ({"bodies": ["body0", "body2"]}, "between 'body0' and 'body2' there is 'body1'"),
        ({"bodies": ["body2", "body4"]}, "there is 'body0', 'body1', 'body3'"),
        ({"bodies": ["body2", "body6"]}, "there is 'body0', 'body1'"),
        ({"bodies": []}, "a body at least"),
        ({"root": "body3", "without": "body3"}, "nothing is left"),
        ({"root": "body3", "without": "body1"}, "without 'body1': it is not outboard of 'body3'"),
        ({"root": "torso"}, "torso"),
        ({"bodies": ["body0", "body9"]}, "body9"),
        ({"root": "body0", "bodies": ["body0"]}, "not both"),
        ({"root": "body0", "base": "free"}, "'fixed' and 'moving'"),
        ({"root": "ground"}, "'ground' is on the base"),
        ({"root": 3}, "root"),
    ],
    ids=str,
)
def test_what_is_refused(options, words):
    mb = robot()
    mb.add_node("ground", None)
    with pytest.raises(pc.ModelError, match=words):
        mb.subgraph(**options)


def test_states_of_another_shape():
    mb = robot()
    leg = mb.subgraph(root="body1")
    with pytest.raises(pc.ModelError, match="q of 'tree of 7' takes"):
        leg.q_of(np.zeros(3))
    with pytest.raises(pc.ModelError, match="q of 'tree of 7/body1' takes"):
        leg.q = np.zeros(mb.nq)


def test_one_body_welds_and_a_loop_of_parts():
    mb = every_kind()
    for name in mb.bodies:
        one = mb.subgraph(bodies=[name])
        assert list(one.bodies) == [name] and one.nv == len(range(mb.nv)[mb.bodies[name].hinge.v_slice])
        assert np.array_equal(one.mass_matrix(), alone_at(mb, one).mass_matrix())
    for _ in range(50):  # parts that nobody holds are let go
        mb.subgraph()
    mb.gravity = (0, 0, 1)


# ---------------------------------------------------------------------- where models go


def test_copies_and_pickles_are_models_of_their_own():
    mb = robot()
    leg = mb.subgraph(root="body1")
    for other in (copy.copy(leg), copy.deepcopy(leg), pickle.loads(pickle.dumps(leg))):
        assert other.whole is None and np.array_equal(other.q, leg.q) and np.array_equal(other.mass_matrix(), leg.mass_matrix())
        other.bodies["body1"].mass = 100.0
        other.q = other.zero_q()
    assert mb.bodies["body1"].mass < 100 and not np.array_equal(leg.q, leg.zero_q())


def test_scenes_run_on_parts():
    mb = robot()
    leg = mb.subgraph(root="body1")
    state = leg.state_of()
    run = [
        pc.Scene(model).add(pc.effects.Gravity((0, 0, -9.81)), pc.effects.Damping(0.1)).simulate(0.1, progress=False)
        for model in (leg, alone_at(mb, leg))
    ]
    assert np.array_equal(run[0].q, run[1].q) and np.array_equal(run[0].q[0], state.q)


def test_a_base_that_moves_by_a_function_of_time():
    """A cart driven along x under a double pendulum: in a scene of the pendulum alone its base goes where the cart goes."""
    cart = pc.Multibody("cart")
    cart.add_body("cart", hinge="slider", axis=(1, 0, 0), mass=2.0, inertia=np.eye(3))
    for name, parent in (("upper", "cart"), ("lower", "upper")):
        cart.add_body(name, parent, hinge="pin", axis=(0, 1, 0), position=(0, 0, -0.5), mass=1.0, com=(0, 0, -0.3), inertia=0.1 * np.eye(3))
    pendulum = cart.subgraph(root="upper", base="moving")
    along = np.array([0.0, 0, 0, 0, 1, 0, 0])

    def base(t):
        return np.r_[1.0, np.zeros(6)] + along * np.sin(3 * t), 3 * along * np.cos(3 * t), -9 * along * np.sin(3 * t)

    def drive(t):
        return tuple(x[4:5] for x in base(t))

    start, gravity = pc.State(np.array([0, 0.3, 0.4]), np.array([3.0, 0.5, -0.2])), pc.effects.Gravity()
    options = {"t_eval": [0.5, 1.0], "rtol": 1e-11, "atol": 1e-12, "progress": False}
    runs = [
        pc.Scene(model).add(gravity, pc.effects.Prescribed(hinge, motion)).simulate(1.0, state.q, state.v, **options)
        for model, hinge, motion, state in ((cart, "cart", drive, start), (pendulum, "base", base, pendulum.state_of(start)))
    ]
    assert np.abs(runs[1].q[:, 7:] - runs[0].q[:, 1:]).max() < 1e-9 and np.abs(runs[1].q[:, 4] - runs[0].q[:, 0]).max() < 1e-15
    assert np.abs(runs[0].q[1, 1:] - start.q[1:]).max() > 0.1


def test_what_a_file_says_beside_the_model_goes_along():
    arm = pc.robots.panda()
    wrist = arm.subgraph(root="panda_link5")
    for name, values in arm.left_aside.items():
        assert np.array_equal(wrist.left_aside[name], values if name == "gravity" else values[wrist.v_index])
    flying = arm.subgraph(root="panda_link5", base="moving")
    assert all(np.isnan(values[:6]).all() for name, values in flying.left_aside.items() if name != "gravity")
    assert len(pc.effects.from_model(wrist)) == len(pc.effects.from_model(arm))


@pytest.mark.parametrize("seed", range(4))
def test_programs_and_prepared_calls_of_parts(seed):
    model = random_tree(np.random.default_rng(seed), 5, rotor_inertia=False, kinds=["pin", "slider", "screw"])
    root = list(model.bodies)[1]
    part = model.subgraph(root=root)
    state, tau = part.random_state(1), np.arange(part.nv) / 3
    assert np.array_equal(part.prepare("forward_dynamics")(state.q, state.v, tau), part.forward_dynamics(state, tau=tau))
    assert "def" in str((part.soa.MM @ pc.vector("x", part.soa.Theta)).algorithm("python"))


def test_a_part_that_its_carrier_moves_accelerates_as_in_the_whole():
    """Hybrid dynamics with the base's motion prescribed, the carrier's in the whole: the same accelerations; also in a batch."""
    robot = pc.tree([-1, 0, 1, 0, 3, 0, 5], ["free", "pin", "ball", "pin", "ball", "universal", "pin"], seed=1)
    robot.gravity = (0.5, -1.0, -9.81)
    tau = np.random.default_rng(0).uniform(-1, 1, robot.nv)
    for seed in range(3):
        state = robot.random_state(seed)
        vdot = robot.forward_dynamics(state.q, state.v, tau)
        condition = np.linalg.cond(robot.mass_matrix(state.q))
        for root in ("body1", "body3", "body6"):
            part, own = robot.subgraph(root=root, base="moving"), robot.subgraph(root=root).v_index
            at, given = part.state_of(state), part.accelerations_of(vdot, state)
            forces = np.r_[np.zeros(6), tau[own]]
            found = part.hybrid_dynamics(at.q, at.v, forces, given, ["base"])
            agree(found.vdot[6:], vdot[own], ROUNDING * condition)
            agree(found.tau, part.inverse_dynamics(at.q, at.v, given), ROUNDING * condition)
            batch = part.hybrid_dynamics(np.array([at.q] * 3), np.array([at.v] * 3), forces, given, ["base"])
            assert np.array_equal(batch.vdot, [found.vdot] * 3)
