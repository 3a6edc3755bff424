"""Bodies on other hinges: pose and twist stay, whatever the hinge was and will be; what is not possible is refused with what is missing."""

import copy

import numpy as np
import pytest

import pycraft as pc
from pycraft.models.hinge_arguments import hinge_arguments
from pycraft.models.hinge_fit import OneHinge
from support.descriptions import KINDS, random_description
from support.edits import options_of, refused
from support.mechanisms import every_kind
from support.motions import Motions

BOUND = 1e-9
"""Of poses and twists after a hinge was solved for: the tolerance that is asked for by default."""


def alone(kind, options, state):
    """The pose and the Jacobian of a hinge's body at a random state of the hinge, and that state."""
    model = pc.Multibody("alone", welds="keep")
    model.add_body("b", None, kind, mass=1.0, inertia=np.eye(3), **options)
    at = model.random_state(state)
    return model.pose("b", at.q), model.jacobian("b", at.q), at


def branched(kind, seed):
    """Two branches; body3 on a hinge of a kind, with body4 outboard of it; body2 on the other branch."""
    model = pc.Multibody.from_description(random_description([-1, 0, 0, 1, 3], ["free", "pin", "universal", kind, "ball"], seed))
    state = model.random_state(seed)
    model.q, model.v = state.q, state.v
    return model


@pytest.mark.parametrize("new", KINDS)
@pytest.mark.parametrize("old", KINDS)
def test_every_kind_to_every_kind_elsewhere(old, new):
    """Onto a body of the other branch; the body, at rest relative to it except for an old free hinge's motion, keeps pose and twist."""
    seed = 11 * KINDS.index(old) + KINDS.index(new)
    rng = np.random.default_rng(seed)
    model, options = branched(old, seed), options_of(new, rng)
    X, J, at = alone(new, options, seed)
    relative = J @ at.v  # the twist against body2 that the new hinge can have
    if old == "free":
        twist = model.frame("body3").velocity(wrt="body1"), model.frame("body3").velocity(wrt="body2")
        v = np.array(model.v)
        v[model.hinges["hinge3"].v_slice] += relative - twist[1]
        model.v = v
    else:  # nothing moves against anything
        model.v = np.r_[model.v[:6], np.zeros(model.nv - 6)]
    placement = model.frame("body3").pose(wrt="body2") @ np.linalg.inv(X)
    before, hinge4 = Motions(model), model.q[model.hinges["hinge4"].q_slice].copy()
    done = model.reattach("body3", "body2", new, placement=placement, **options)
    Motions(model).assert_same(before, BOUND)
    assert model.bodies["body3"].parent.name == "body2" and model.hinges["hinge3"].kind == new and done.impulse is None
    assert np.array_equal(model.q[model.hinges["hinge4"].q_slice], hinge4) and list(model.bodies)[-2:] == ["body3", "body4"]
    assert np.abs(done.pose_error).max() <= BOUND and np.abs(done.velocity_error).max() <= BOUND * 10
    hinge = model.hinges["hinge3"]
    assert np.array_equal(done.q, model.q[hinge.q_slice]) and np.array_equal(done.v, model.v[hinge.v_slice])


@pytest.mark.parametrize("kind", KINDS)
def test_detached_and_attached_again(kind):
    """On the base by a free hinge, and back on the parent that it had by the hinge that it had: the state is what it was."""
    model = branched(kind, 60 + KINDS.index(kind))
    old, before = copy.copy(model), Motions(model)
    hinge, placement = model.hinges["hinge3"].subhinges, model.hinges["hinge3"].placement
    assert model.detach("body3", hinge_name="flight").body.hinge.name == "flight"
    after = Motions(model)
    after.assert_same(before, 1e-12)
    assert model.bodies["body3"].parent is None and model.hinges["flight"].kind == "free"
    assert np.isclose(after.energy, before.energy, rtol=1e-12) and np.allclose(after.momentum, before.momentum, rtol=1e-11, atol=1e-12)
    guess = old.q[old.hinges["hinge3"].q_slice]
    model.attach("body3", "body1", "custom", subhinges=hinge, placement=placement, hinge_name="hinge3", q=guess)
    Motions(model).assert_same(before, BOUND)
    assert list(model.hinges) == list(old.hinges)
    assert np.allclose(model.q, old.q, rtol=0, atol=1e-8) and np.allclose(model.v, old.v, rtol=0, atol=1e-8)


def test_here_is_where_the_body_is():
    model = branched("pin", 3)
    model.v = np.zeros(model.nv)
    before = Motions(model)
    done = model.reattach("body3", "node2", "gimbal", placement="here", q=[0.3, -0.2, 0.5])
    Motions(model).assert_same(before, 1e-12)
    assert np.array_equal(done.q, [0.3, -0.2, 0.5])
    assert model.reattach("body3", "node2", "slider", axis=(1, 0, 0), placement="here").q.tolist() == [0]
    Motions(model).assert_same(before, 1e-12)


@pytest.mark.parametrize(("turns", "guess", "expected"), [(0.5, None, 0.5), (0.5, [6.0], 0.5 + 2 * np.pi), (3.0, [-3.0], 3.0 - 2 * np.pi)])
def test_angles_are_the_nearest_by_whole_turns(turns, guess, expected):
    arm = pc.chain(2)
    arm.q = [0, turns]
    assert arm.reattach("body1", "body0", "pin", position=(1, 0, 0), q=guess).q[0] == pytest.approx(expected, abs=1e-14)


def test_screws_of_many_turns_are_found_by_their_travel():
    bolt = pc.Multibody("bolt")
    bolt.add_body("nut", None, "screw", pitch=0.01, axis=(0, 1, 2), point=(0.1, 0.2, 0), mass=1.0, inertia=np.eye(3))
    bolt.q, bolt.v = [100.0], [3.0]
    bolt.detach("nut")
    done = bolt.reattach("nut", None, "screw", pitch=0.01, axis=(0, 1, 2), point=(0.1, 0.2, 0))
    assert np.allclose(done.q, [100], rtol=1e-13) and np.allclose(done.v, [3], rtol=1e-12)


def test_limits_say_where_to_look():
    arm = pc.chain(2)
    arm.q = [0, -1.0]
    done = arm.reattach("body1", "body0", "pin", position=(1, 0, 0), limits=(4, 7))
    assert done.q[0] == pytest.approx(2 * np.pi - 1) and arm.hinges["hinge1"].limits[0] == [4]


def test_what_is_not_possible_is_refused_with_what_is_missing():
    arm = pc.chain(3)
    arm.q, arm.v = [0, 0, 0], [0, 0, 1]
    refused(arm, lambda: arm.reattach("body2", None, "pin"), "body 'body2' cannot be where it is on hinge 'hinge2' (pin) of the base",
            "2 m along (1, 0, 0)", "rad/s", 'placement="here"')  # fmt: skip
    refused(arm, lambda: arm.reattach("body2", "body0", "slider", placement="here"), "cannot move as it moves", "off by 0 rad and 0 m",
            "1 rad/s about (0, 0, 1) and 0 m/s", 'velocity="impulse"')  # fmt: skip
    refused(
        arm,
        lambda: arm.attach("body2", "body0"),
        "body 'body2' is not free to be attached: it is attached to 'body1' by a pin",
        "detach('body2')",
    )
    refused(arm, lambda: arm.reattach("body1", "body2"), "outboard of it")
    refused(arm, lambda: arm.reattach("body1", "body1"), "on the body itself")
    refused(arm, lambda: arm.reattach("body1", "nobody", "free"), "'nobody'")
    refused(arm, lambda: arm.reattach("nobody", None, "free"), "no body", "'nobody'")
    refused(arm, lambda: arm.reattach("body2", "body0", "free", hinge_name="hinge0"), "'hinge0' already")
    refused(arm, lambda: arm.reattach("body2", "body0", "hook"), "'hook'")
    refused(arm, lambda: arm.reattach("body2", "body0", "free", q=[1, 2]), "q of")
    refused(arm, lambda: arm.reattach("body2", "body0", "free", placement="there"), "'here'")
    refused(arm, lambda: arm.reattach("body2", "body0", "free", placement="here", position=(0, 0, 0)), "'here'")
    refused(arm, lambda: arm.reattach("body2", "body0", "free", velocity="zero"), "'keep' and 'impulse'")
    refused(arm, lambda: arm.reattach("body2", "body0", "free", tolerance="small"), "tolerance")
    refused(arm, lambda: arm.reattach("body2", "body0", "free", rotor_inertia=[-1]), "rotor inertia")
    refused(arm, lambda: arm.reattach(3, None, "free"), "not by 3")
    leg = arm.subgraph(root="body1")
    refused(leg, lambda: leg.detach("body2"), "is a part of")


def test_operators_parts_and_answers_made_before_are_stale():
    model = every_kind()
    letters, part, state = model.soa, model.subgraph(root="body1"), model.random_state(3)
    model.frame("body3").pose()
    call = model.prepare("forward_dynamics")
    model.detach("body2")
    for ask in (lambda: letters.MM, part.mass_matrix, lambda: part.q):
        with pytest.raises(pc.StaleOperatorError, match="body 'body2' was hung on the base by hinge 'hinge2'"):
            ask()
    with pytest.raises(pc.ModelError):
        call(state.q, state.v, state.v)
    fresh = copy.copy(model)
    Q = np.array([model.random_state(i).q for i in range(3)])
    assert np.array_equal(model.mass_matrix(Q), fresh.mass_matrix(Q)) and model.mass_matrix(Q[:0]).shape == (0, model.nv, model.nv)
    assert np.array_equal(model.soa.MM.dense(), fresh.soa.MM.dense())
    assert np.array_equal(model.frame("body3").pose(), fresh.frame("body3").pose())


def test_accelerations_of_the_new_hinge_are_zero_and_others_stay():
    arm = pc.chain(3)
    arm.frames.vdot = [1, 2, 3]
    arm.reattach("body2", "body0", "planar", position=(1, 0, 0))
    assert arm.frames.vdot.tolist() == [1, 2, 0, 0, 0]
    arm.frames.vdot = [1, 2, 3, 4, 5]
    arm.reattach("body1", "body0", "pin", position=(1, 0, 0))
    assert dict(zip(arm.coordinate_names, arm.frames.vdot, strict=True))["hinge1"] == 0 and arm.frames.vdot.sum() == 13


def test_what_the_file_said_of_other_hinges_stays():
    robot = pc.robots.panda()
    before = robot.left_aside
    assert before
    hinges = list(robot.hinges)
    robot.detach(list(robot.bodies)[3])
    after = robot.left_aside
    for key, values in before.items():
        if key not in ("gravity", "spring rest"):
            for k, hinge in enumerate(hinges):
                own = after[key][robot.hinges[hinge].v_slice]
                assert np.isnan(own).all() if k == 3 else np.array_equal(own, values[k : k + 1], equal_nan=True)


@pytest.mark.parametrize("rotors", [False, True], ids=["no rotors", "rotors"])
@pytest.mark.parametrize("new", KINDS)
def test_a_body_that_a_hinge_catches(new, rotors):
    """The impulse is the least change in kinetic energy that the new structure permits, by a dense solution of the oracle's letters."""
    seed = 300 + KINDS.index(new)
    rng = np.random.default_rng(seed)
    model = pc.Multibody.from_description(random_description([-1, 0, 1, -1, 3], ["free", "pin", "ball", "free", "universal"], seed, rotors))
    for hinge in ("hinge0", "hinge3"):
        model.hinges[hinge].rotor_inertia = np.zeros(6)
    state = model.random_state(seed)
    model.q, model.v = state.q, state.v
    before, rates = Motions(model), {name: model.v[h.v_slice].copy() for name, h in model.hinges.items()}
    rotor = {"rotor_inertia": 0.7} if rotors and new != "weld" else {}
    done = model.attach("body3", "body2", new, velocity="impulse", **options_of(new, rng), **rotor)
    after = Motions(model)
    o, names = after.operators, list(model.bodies)
    V = np.concatenate([before.twists[name] for name in names])
    rates["hinge3"] = np.zeros(model.hinges["hinge3"].v_slice.stop - model.hinges["hinge3"].v_slice.start)  # its rotor is at rest
    r = np.concatenate([rates[name] for name in model.hinges])
    A = o.phi.T @ o.H.T
    expected = np.linalg.solve(A.T @ o.M @ A + o.J, A.T @ o.M @ V + o.J @ r)
    # Rounding times the condition of what is solved, as of results behind an inverse.
    bound = 1e4 * np.finfo(float).eps * np.linalg.cond(A.T @ o.M @ A + o.J)
    assert np.abs(model.v - expected).max() <= bound * (1 + np.abs(expected).max())
    for name, pose in before.poses.items():
        assert np.abs(after.poses[name] - pose).max() < 1e-12
    hit = done.impulse
    size = np.abs(before.momentum).max()
    kept = slice(3, 6) if rotors else slice(0, 6)  # nothing holds them; rotors take their share of what turns
    assert np.abs(after.momentum - before.momentum)[kept].max() <= 1e-11 * size
    assert np.allclose(hit.momentum_before, before.momentum, rtol=1e-12, atol=1e-12 * size)
    assert np.allclose(hit.momentum_after, after.momentum, rtol=1e-12, atol=1e-12 * size)
    assert np.isclose(hit.energy_before, V @ o.M @ V / 2 + r @ o.J @ r / 2, rtol=1e-12) and np.isclose(
        hit.energy_after, after.energy, rtol=1e-12
    )
    assert np.isclose(hit.loss, hit.energy_before - hit.energy_after, rtol=1e-9, atol=1e-12 * hit.energy_before)
    assert hit.loss > 1e-6 * hit.energy_before or new == "free"
    assert np.array_equal(hit.v, model.v) and np.array_equal(done.v, model.v[model.hinges["hinge3"].v_slice])


def test_an_impulse_without_a_jump_changes_nothing():
    arm = pc.chain(3, seed=2)
    state = arm.random_state(1)
    arm.q, arm.v = state.q, state.v
    arm.detach("body2")
    before = Motions(arm)
    hit = arm.attach("body2", "body0", "free", velocity="impulse").impulse
    Motions(arm).assert_same(before, 1e-12)
    assert abs(hit.loss) < 1e-20 and hit.energy_before == pytest.approx(hit.energy_after, rel=1e-13)


@pytest.mark.filterwarnings("ignore:body 'link':pycraft.ModelWarning")
def test_an_impulse_that_cannot_be_leaves_everything():
    """A massless body between: nothing says how it moves after."""
    arm = pc.chain(1)
    arm.add_body("link", "body0", position=(1, 0, 0))
    arm.add_body("tool", None, "free", mass=1.0, inertia=np.eye(3))
    arm.q, arm.v = arm.random_state(1).q, arm.random_state(1).v
    refused(arm, lambda: arm.attach("tool", "body0", velocity="impulse"), "'link'", kind=pc.SingularHingeError)
    arm.attach("tool", "link", velocity="impulse")  # which has the tool's mass now
    assert arm.nv == 2


def test_nothing_moves_any_more():
    """Two bodies of a model without any other hinge, welded to the base one after the other: no coordinates are left."""
    pair = pc.Multibody("pair")
    for name in ("a", "b"):
        pair.add_body(name, None, "free", mass=2.0, inertia=np.eye(3))
    pair.v = np.ones(12)
    hits = [pair.attach(name, None, velocity="impulse").impulse for name in ("a", "b")]
    assert pair.nv == pair.nq == 0 and list(pair.bodies) == ["a", "b"]
    assert hits[0].loss == hits[0].energy_before - hits[0].energy_after == pytest.approx(4.5)
    assert hits[1].energy_after == 0 and np.array_equal(hits[1].momentum_after, np.zeros(6))
    assert copy.copy(pair).nv == 0 and pair.detach("a").body.hinge.kind == "free"


def test_turns_that_are_nearest_to_a_guess():
    hinge = OneHinge("b", "h", hinge_arguments("hinge 'h'", "gimbal"))
    near = hinge.nearest_turn(np.array([7.0, -4.0, 0.1]), np.array([0.5, 2.2, 6.3]))
    assert np.allclose(near, [7 - 2 * np.pi, 2 * np.pi - 4, 2 * np.pi + 0.1], rtol=0, atol=1e-15)
    ball = OneHinge("b", "h", hinge_arguments("hinge 'h'", "ball"))
    assert ball.nearest_turn(np.array([0.6, 0, 0.8, 0]), np.array([-1.0, 0, 0, 0])).tolist() == [-0.6, 0, -0.8, 0]


def test_what_the_file_said_is_not_said_of_another_hinge_of_the_name():
    arm = pc.chain(2)
    arm._left_aside = {"damping": np.array([1.0, 2.0])}
    arm.reattach("body1", "body0", "pin", position=(1, 0, 0))
    assert np.array_equal(arm.left_aside["damping"], [1, np.nan], equal_nan=True)


@pytest.mark.parametrize("tolerance", [np.nan, -1, np.inf, -np.inf])
def test_a_tolerance_is_a_finite_number(tolerance):
    """No number and a negative one refused what was possible as off by 0, and an infinite one took what was not."""
    arm = pc.chain(3)
    refused(arm, lambda: arm.reattach("body2", "body0", "planar", tolerance=tolerance), f"tolerance={tolerance:g}: it is a finite number")
