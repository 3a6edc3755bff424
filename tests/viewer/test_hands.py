"""Bodies that are held: the push is the force that it says, the user's scene stays as it is, and inverse kinematics leads."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.viewer.hands import Push, given_place
from pycraft.viewer.live_scene import LiveScene
from pycraft.viewer.session import PIECE, Session
from support.mechanisms import every_kind


@pytest.fixture
def session():
    opened = []

    def made(*arguments, **options):
        opened.append(Session(*arguments, **options))
        return opened[-1]

    yield made
    for one in opened:
        one.close()


def pendulum():
    return pc.mechanisms.double_pendulum().add(pc.effects.Damping(0.1))


def test_a_push_is_its_force(session):
    """The accelerations with it less those without are ℳ⁻¹ J*f, f the force and J the Jacobian of the place, by finite differences."""
    model = every_kind(seed=1)
    state = model.random_state(1)
    scene = pc.Scene(model).add(pc.effects.Gravity((0, 0, -9.81)))
    live = LiveScene(scene, state.q, 0.1 * state.v)
    before = live.along()["vdot"]
    body, place = list(model.bodies)[-1], np.array([0.1, -0.2, 0.3])
    at = (model.pose(body, live.q) @ [*place, 1])[:3]
    push = Push.of(live, body, place, at + [0.3, 0.2, -0.1], PIECE)
    live.pushed = push.scene
    push.act(live)
    h, J = 1e-6, np.empty((3, model.nv))
    for j in range(model.nv):
        ends = [(model.pose(body, model.integrate(live.q, sign * h * np.eye(model.nv)[j])) @ [*place, 1])[:3] for sign in (1, -1)]
        J[:, j] = (ends[0] - ends[1]) / (2 * h)
    gained = live.along()["vdot"] - before
    expected = np.linalg.solve(model.mass_matrix(live.q), J.T @ push.force)
    np.testing.assert_allclose(gained, expected, atol=1e-7 * np.abs(expected).max())  # differences of h² and eps/h
    velocity = J @ live.v
    np.testing.assert_allclose(
        push.force, push.stiffness * np.array([0.3, 0.2, -0.1]) - push.damping * velocity, atol=1e-7 * push.stiffness
    )


def test_a_push_pulls_until_it_is_let_go(session):
    """A pendulum at rest without gravity follows the pointer, comes to rest near it, and the user's scene never has the push."""
    scene = pc.Scene(pc.mechanisms.double_pendulum().model).add(pc.effects.Damping(0.5))
    one = session(scene, None, [0.0, 0.0], [0.0, 0.0])
    names = list(scene.effects)
    to = [0.3, 0.0, 1.5]
    one.do("push", body="lower", place=[1.0, 0, 0], to=to)
    reached = []
    for _ in range(1200):
        one._advance(PIECE)
        reached.append(one.live.model.pose("lower", one.live.q)[:3] @ [1, 0, 0, 1])
    assert np.linalg.norm(reached[-1] - to) < 0.02 < np.linalg.norm(reached[0] - to)
    shown = one.state()["push"]
    assert shown["at"] == pytest.approx(list(reached[-1]), abs=0.02) and shown["most"] > np.linalg.norm(shown["force"])
    assert list(scene.effects) == names and one.live.scene is scene
    balance = one.state()["energy"]
    assert balance[2] == pytest.approx(0.0, abs=1e-5)  # kinetic + potential - work, the push's work among it
    one.do("let_go")
    assert one.state()["push"] is None and one.live.acting is scene


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
def test_a_push_of_a_light_body_is_stable(session, scale):
    """The force stands still between two looks at the pointer: the spring is so soft that this makes it swing no more."""
    model = pc.Multibody("light tip")
    rod = dict(com=(0.5, 0, 0), hinge="pin", axis=(0, 0, 1))
    model.add_body("heavy", mass=100.0, inertia=np.diag([1.0, 10, 10]), **rod)
    model.add_body("light", parent="heavy", position=(1, 0, 0), mass=1e-3, inertia=1e-5 * np.eye(3), **rod)
    one = session(pc.Scene(model))
    one.do("scale", to=scale)
    one.do("push", body="light", place=[1, 0, 0], to=[1.0, 1.0, 0])
    for _ in range(120):
        one._advance(scale * PIECE)
    assert np.isfinite(one.live.v).all() and one.state()["energy"][0] < 200  # of the order of force times way


def test_leading_reaches_or_says_why(session):
    arm = pc.robots.panda()
    q = np.array([0, 0.3, 0, -1.5, 0, 1.8, 0])  # bent, away from limits
    one = session(pc.Scene(arm), None, q, np.zeros(7))
    names = list(arm.frames)
    body, place = "panda_link7", np.array([0.0, 0.05, 0.1])
    at = (arm.pose(body, q) @ [*place, 1])[:3]
    to = at + [0.05, 0.03, -0.1]
    one.do("lead", body=body, place=place.tolist(), to=to.tolist())
    np.testing.assert_allclose((arm.pose(body, one.live.q) @ [*place, 1])[:3], to, atol=2e-6)  # the tolerance that it is asked for
    assert one.message == "" and not one.live.v.any() and list(arm.frames) == names
    assert (arm.clamped(one.live.q) == one.live.q).all()  # within limits
    one.do("lead", body=body, place=[0, 0, 0], to=[5.0, 0, 0])
    assert one.message and np.isfinite(one.live.q).all()
    assert arm.pose(body, one.live.q)[0, 3] > 0.4  # as near as it comes


def test_a_loose_root_stays_when_a_foot_is_led(session):
    dog = pc.robots.a1()
    q = dog.clamped(dog.neutral())
    one = session(pc.Scene(dog), None, q, np.zeros(dog.nv))
    foot = list(dog.bodies)[-1]
    place = np.array([0, 0, -0.2])
    at, root = (dog.pose(foot, one.live.q) @ [*place, 1])[:3], dog.pose(next(iter(dog.bodies)), one.live.q)
    one.do("lead", body=foot, place=place.tolist(), to=(at + [0.02, 0, 0.03]).tolist())
    np.testing.assert_array_equal(dog.pose(next(iter(dog.bodies)), one.live.q), root)
    np.testing.assert_allclose((dog.pose(foot, one.live.q) @ [*place, 1])[:3], at + [0.02, 0, 0.03], atol=2e-6)


def test_loops_stay_closed_when_a_body_is_led(session):
    scene = pc.mechanisms.five_bar()
    one = session(scene)
    model = scene.model
    body = list(model.bodies)[1]
    at = model.pose(body, one.live.q)[:3, 3]
    one.do("lead", body=body, place=[0, 0, 0], to=(at + [0.02, 0.02, 0]).tolist())
    assert np.abs(model.loops.residual(one.live.q)).max() < 1e-5  # closed to the tolerance of targets


@pytest.mark.parametrize("action", ["push", "lead"])
@pytest.mark.parametrize(
    "given, words",
    [
        (dict(body="moon", place=[0, 0, 0], to=[0, 0, 0]), "has no body 'moon'"),
        (dict(body="lower", place=[0, 0], to=[0, 0, 0]), "place must be three finite numbers"),
        (dict(body="lower", place=[0, 0, 0], to=[0, 0, np.inf]), "to must be three finite numbers"),
        (dict(body="lower"), "missing 2 required"),
    ],
)
def test_refusals(session, action, given, words):
    one = session(pendulum())
    q = one.live.q.copy()
    with pytest.raises(pc.Error, match=words):
        one.do(action, **given)
    np.testing.assert_array_equal(one.live.q, q)


def test_what_cannot_move_is_not_pushed(session):
    model = pc.chain(2)
    one = session(pc.Scene(model))
    with pytest.raises(pc.ModelError, match="'body0' does not move"):
        one.do("push", body="body0", place=[0, 0, 0], to=[1, 0, 0])  # on the axis of its pin
    assert one.live.acting is one.live.scene


def test_effects_that_change_end_a_push(session):
    one = session(pendulum())
    one.do("push", body="lower", place=[1, 0, 0], to=[0, 1, 0])
    one.do("effect", name="damping", on=False)
    assert one.state()["push"] is None
    assert given_place(one.live, "lower", [1, 2, 3], [4, 5, 6])[0] == "lower"
