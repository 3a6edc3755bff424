"""Computations for frames at the present state are counted, and cached results are right after every change."""

import copy
import pickle
import threading

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind

CHAIN = 6


def chain():
    arm = pc.chain(CHAIN)
    arm.q, arm.v = np.linspace(0.1, 0.6, CHAIN), np.linspace(1, 2, CHAIN)
    return arm


class Counted:
    """Return the counts of a block of statements."""

    def __init__(self, model):
        self.frames = model.frames

    def __enter__(self):
        self.before = self.frames.computed
        return self

    def __exit__(self, *error):
        self.said = {key: n - self.before[key] for key, n in self.frames.computed.items()}
        self.poses, self.velocities, self.accelerations, self.pairs = self.said.values()


def test_nothing_is_computed_before_it_is_asked_for():
    arm = chain()
    arm.add_frame("lens", on="body5")
    arm.frame("lens"), arm.frames["body3"]
    arm.q = np.zeros(CHAIN)
    assert set(arm.frames.computed.values()) == {0}


def test_a_question_costs_the_steps_between_its_frames():
    arm = chain()
    with Counted(arm) as n:
        arm.frame("body5").pose(wrt="body2")
    assert n.said == {"poses": 3, "velocities": 0, "accelerations": 0, "pairs": 1}
    with Counted(arm) as n:  # the same again
        arm.frame("body5").pose(wrt="body2")
    assert set(n.said.values()) == {0}
    with Counted(arm) as n:  # of the poses three are there
        arm.frame("body5").velocity(wrt="body1")
    assert n.said == {"poses": 1, "velocities": 4, "accelerations": 0, "pairs": 1}
    with Counted(arm) as n:  # with an acceleration its pose and velocity
        arm.frame("body5").acceleration(wrt="body1", axes="aligned")
        arm.frame("body5").pose(wrt="body1")
    assert n.said == {"poses": 0, "velocities": 0, "accelerations": 4, "pairs": 1}
    with Counted(arm) as n:  # the other way round is a pair of its own, of the same steps
        arm.frame("body1").pose(wrt="body5")
    assert n.said == {"poses": 0, "velocities": 0, "accelerations": 0, "pairs": 1}


def test_only_what_is_no_longer_current_is_computed_again():
    arm = chain()
    frame = arm.frame("body5")
    frame.acceleration(), frame.acceleration(wrt="body3"), arm.frame("body2").velocity()
    q = np.array(arm.q)
    q[2] += 0.25
    arm.q = q
    with Counted(arm) as n:  # beyond what moved
        frame.acceleration(wrt="body3")
    assert set(n.said.values()) == {0}
    with Counted(arm) as n:  # one hinge of six
        frame.acceleration()
    assert n.said == {"poses": 1, "velocities": 1, "accelerations": 1, "pairs": 1}
    v = np.array(arm.v)
    v[4] = -1
    arm.v = v
    with Counted(arm) as n:
        frame.pose(), arm.frame("body2").velocity()
    assert n.said == {"poses": 0, "velocities": 0, "accelerations": 0, "pairs": 1}  # the pair of body2, whose hinge had moved
    with Counted(arm) as n:
        frame.velocity()
    assert n.said == {"poses": 0, "velocities": 1, "accelerations": 0, "pairs": 1}
    arm.q, arm.v = np.array(arm.q), np.array(arm.v)  # the same numbers
    with Counted(arm) as n:
        frame.velocity()
    assert set(n.said.values()) == {0}
    vdot = np.zeros(CHAIN)
    arm.frames.vdot = vdot
    frame.acceleration()
    vdot[5] = 1
    arm.frames.vdot = vdot
    with Counted(arm) as n:
        frame.velocity(), frame.acceleration()
    assert n.said == {"poses": 0, "velocities": 0, "accelerations": 1, "pairs": 1}


def test_edited_frames_take_along_what_goes_over_them():
    arm = chain()
    tool = arm.add_frame("tool", on="body5", position=(1, 0, 0))
    arm.add_frame("bit", on="tool", position=(0, 0, 1)), arm.add_frame("lamp", on="tool", position=(0, 1, 0))
    questions = [("bit", "body2"), ("body2", "bit"), ("bit", "lamp"), ("body5", "body2"), ("tool", None)]

    def ask():
        return [arm.frame(a).pose(wrt=b) for a, b in questions]

    ask()
    with Counted(arm) as n:  # placed elsewhere: three ways go over it
        tool.placement = np.eye(4)
        found = ask()
    assert n.said == {"poses": 0, "velocities": 0, "accelerations": 0, "pairs": 3}
    assert all(np.array_equal(X, arm.frame(a).pose(arm.q, wrt=b)) for X, (a, b) in zip(found, questions, strict=True))
    with Counted(arm) as n:  # and attached elsewhere
        tool.attach("body2")
        found = ask()
    assert n.pairs == 3 and found[0][:3, 3].tolist() == [0, 0, 1]
    arm.frame("lamp").remove(), arm.add_frame("lamp", on="body0")
    assert np.array_equal(arm.frame("bit").pose(wrt="lamp"), arm.frame("bit").pose(arm.q, wrt="body0"))


def test_functions_of_time_are_called_when_their_time_has_come():
    arm, called = chain(), []

    def motion(t):
        called.append(t)
        X = np.eye(4)
        X[2, 3] = t
        return X, np.array([0, 0, 0, 0, 0, 1.0])

    lens = arm.add_frame("lens", on="body5", motion=motion)
    assert called == []
    arm.frame("body5").pose(), arm.frame("body2").velocity(wrt="body5")
    assert called == []
    lens.pose(), lens.velocity(), lens.pose(wrt="body2")
    assert called == [0.0]
    arm.q = np.zeros(CHAIN)
    lens.pose()
    assert called == [0.0]
    arm.frames.t = 0.5
    assert lens.pose(wrt="body5")[2, 3] == 0.5 and called == [0.0, 0.5]
    lens.motion = motion
    lens.pose()
    assert called == [0.0, 0.5, 0.5]
    arm.frame("lens").pose(arm.q, t=[1.0, 2.0])  # at given times: once each
    assert called[3:] == [1.0, 2.0]


def test_what_is_kept_is_what_is_computed_anew():
    """A hundred changes of all kinds, one after the other, some questions between them: always the numbers of a model that kept nothing."""
    model = every_kind(seed=1)
    rng = np.random.default_rng(1)
    turn = lambda t: (np.block([[pc_rotation(t), np.zeros((3, 1))], [np.zeros((1, 3)), 1]]), np.array([0, 0, 1.0, 0, 0, 0]), np.zeros(6))
    model.add_frame("a", on="body3", position=(0.1, 0, 0))
    model.add_frame("b", on="a", motion=turn)
    model.add_frame("c", on="body8")
    places = ["body0", "body5", "body10", "base", None]
    names = ["a", "b", "c", "base", *list(model.bodies)[::2], *model.nodes]

    def change():
        kind = rng.integers(8)
        if kind == 0:
            q = np.array(model.q)
            at = range(model.nq)[model.hinges[str(rng.choice(list(model.hinges)))].q_slice]
            q[at] += rng.uniform(0, 0.1, len(at))
            model.q = q
        elif kind == 1:
            model.v = rng.uniform(-1, 1, model.nv)
        elif kind == 2:
            model.frames.vdot = rng.uniform(-1, 1, model.nv)
        elif kind == 3:
            model.frames.t = rng.uniform()
        elif kind == 4:
            model.frame("a").attach(places[rng.integers(5)])
        elif kind == 5:
            model.frame("c").attach(str(rng.choice(["a", "b", "body6"])), keep_pose=bool(rng.integers(2)))
        elif kind == 6:
            X = np.eye(4)
            X[:3, 3] = rng.uniform(-1, 1, 3)
            model.frame("a").placement = X
        else:
            hinge = model.hinges[str(rng.choice(list(model.hinges)))]
            X = hinge.placement.copy()
            X[:3, 3] += 0.01
            hinge.placement = X

    for _ in range(100):
        change()
        fresh = copy.copy(model)
        fresh.frames.t, fresh.frames.vdot = model.frames.t, model.frames.vdot
        for _ in range(4):
            a, b = (str(x) for x in rng.choice(names, 2))
            for call in ("pose", "velocity", "acceleration")[: 1 + rng.integers(3)]:
                assert np.array_equal(getattr(model.frame(a), call)(wrt=b), getattr(fresh.frame(a), call)(wrt=b)), (a, b, call)


def pc_rotation(t):
    return np.array([[np.cos(t), -np.sin(t), 0], [np.sin(t), np.cos(t), 0], [0, 0, 1]])


def test_accelerations_are_carried_over_by_hinge_name():
    arm = chain()
    arm.frames.vdot = np.arange(1.0, 7)
    arm.add_body("arm2", parent="body0", mass=1.0, inertia=np.eye(3))
    hinges, carried = list(arm.hinges), arm.frames.vdot
    assert {hinge: x for hinge, x in zip(hinges, carried, strict=True)} == {f"hinge{k}": k + 1.0 for k in range(6)} | {"arm2": 0.0}
    arm.remove_body("body4")
    assert dict(zip(arm.hinges, arm.frames.vdot, strict=True)) == {"hinge0": 1, "hinge1": 2, "hinge2": 3, "hinge3": 4, "arm2": 0}
    whole = arm.frame("body3").acceleration()
    assert np.array_equal(whole, arm.frame("body3").acceleration(arm.q, arm.v, arm.frames.vdot))


def test_copies_and_pickles_have_the_frames():
    arm = chain()
    arm.add_frame("tool", on="body5", position=(1, 0, 0))
    arm.add_frame("bit", on="tool", position=(0, 0, 1))
    arm.add_frame("arm", on="body2")
    arm.frame("arm").attach("bit")  # after what stands on it
    for again in (copy.copy(arm), copy.deepcopy(arm), pickle.loads(pickle.dumps(arm)), pc.Multibody.from_description(arm.description())):
        assert sorted(again.frames) == sorted(arm.frames)
        assert np.array_equal(again.frame("arm").pose(wrt="body1"), arm.frame("arm").pose(wrt="body1"))
        assert again.frame("arm").on == again.frame("bit") and again.frame("arm") != arm.frame("arm")


def test_threads_ask_at_once():
    model = every_kind(seed=3)
    names = list(model.bodies)
    model.add_frame("lens", on=names[-1], motion=lambda t: (np.eye(4), np.zeros(6), np.zeros(6)))
    expected = {(a, b): model.frame(a).acceleration(model.q, model.v, np.zeros(model.nv), wrt=b) for a in names for b in names}
    wrong = []

    def ask(seed):
        rng = np.random.default_rng(seed)
        for _ in range(300):
            a, b = (str(x) for x in rng.choice(names, 2))
            if not np.array_equal(model.frame(a).acceleration(wrt=b), expected[a, b]):
                wrong.append((a, b))
            model.frame("lens").velocity(wrt=a)
            model.frames.t = rng.uniform()

    threads = [threading.Thread(target=ask, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_a_motion_may_ask_for_other_frames():
    """A frame that follows another: its function of time asks the model, at the present state, while it is asked."""
    arm = chain()
    arm.add_frame("shadow", motion=lambda t: arm.frame("body5").pose())
    arm.add_frame("upon", on="shadow", position=(0, 0, 1))
    assert np.array_equal(arm.frame("shadow").pose(), arm.frame("body5").pose())
    arm.add_frame("ouroboros", motion=lambda t: arm.frame("ouroboros").pose())
    with pytest.raises(RecursionError):
        arm.frame("ouroboros").pose()


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda model: pickle.loads(pickle.dumps(model))], ids=["copy", "deepcopy", "pickle"]
)
def test_copies_are_at_the_same_moment(copied):
    """The present state is q, v, v̇ and t: a frame that a function moves is where it is in the original."""
    arm = chain()
    arm.add_frame("turning", on="body2", motion=turning)
    arm.frames.t, arm.frames.vdot = 0.7, np.arange(1.0, 1.0 + arm.nv)
    again = copied(arm)
    for ask in (lambda m: m.frame("turning").pose(), lambda m: m.frame("turning").velocity(), lambda m: m.frame("turning").acceleration()):
        assert np.array_equal(ask(again), ask(arm))
    again.frames.t = 0.1
    assert arm.frames.t == 0.7


EDITS = {
    "reroot": lambda m: m.reroot("body2"),
    "detach what carries it": lambda m: m.detach("body2"),
    "detach what is inboard": lambda m: m.detach("body1"),
    "hang another elsewhere": lambda m: m.reattach("body4", "body0", "pin", placement="here", velocity="impulse"),
    "lock and coalesce": lambda m: (m.lock("hinge4", impulsive=True), m.coalesce()),
    "remove another": lambda m: m.remove_body("body4"),
    "copy a branch": lambda m: m.copy_subtree("body1", "body0", prefix="copied ", position=(0, 1, 0)),
}


@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_a_motion_goes_on_over_edits_of_the_structure(edit):
    """Poses stay to rounding, sums of a few numbers of size 1; velocities where no impulse changes them."""
    flying = pc.tree([-1, 0, 1, 0, 3], ["free", "pin", "ball", "pin", "pin"], seed=1)
    state = flying.random_state(0)
    flying.q, flying.v = state.q, state.v
    flying.add_frame("turning", on="body2", motion=turning)
    lens = flying.add_frame("lens", on="turning", position=(0, 0, 1))
    flying.frames.t = 0.7
    pose, on_body, rates = lens.pose(), lens.pose(wrt="body2"), lens.velocity(wrt="body2")
    edit(flying)
    assert flying.frames.t == 0.7
    np.testing.assert_allclose(lens.pose(), pose, atol=1e-14)
    np.testing.assert_allclose(lens.pose(wrt="body2"), on_body, atol=1e-15)
    np.testing.assert_allclose(lens.velocity(wrt="body2"), rates, atol=1e-15)
    flying.frames.t = 0.9
    assert not np.allclose(lens.pose(wrt="body2"), on_body, atol=1e-3)


def turning(t):
    """About z by t, and along x by sin t."""
    c, s = np.cos(t), np.sin(t)
    pose = np.array([[c, -s, 0, s], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    return pose, np.array([0, 0, 1, c * c, -s * c, 0]), np.array([0, 0, 0, -2 * c * s, s * s - c * c, 0])
