"""A scene as a list of effects by name, what it compiles to, and what it says of what makes no sense."""

import copy
import pickle
import threading
from fnmatch import fnmatchcase

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pycraft as pc
from pycraft import _core
from support.mechanisms import every_kind

E = pc.effects
GRAVITY = (0, 0, -9.81)


@pytest.fixture
def arm():
    made = pc.Multibody("arm")
    rod = dict(mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0.01, 0.1, 0.1]))
    made.add_body("upper", hinge_name="left_shoulder", axis=(0, 1, 0), limits=(-1, 1), **rod)
    made.add_body("lower", "upper", "universal", hinge_name="left_elbow", position=(1, 0, 0), **rod)
    made.add_body("hand", "lower", "ball", hinge_name="wrist", position=(1, 0, 0), **rod)
    made.add_node("tip", "hand", position=(1, 0, 0))
    made.add_node("mark", None, position=(0, 0, 1))
    return made


# Names, and what acts on what -----------------------------------------------------------------------------------------


def test_a_scene_starts_empty(arm):
    """The model's own gravity does not act."""
    arm.gravity = GRAVITY
    state = arm.random_state(1)
    found = pc.Scene(arm).evaluate(state.q, state.v)
    arm.gravity = (0, 0, 0)
    assert np.array_equal(found.vdot, arm.forward_dynamics(state.q, state.v)) and found.forces == {}
    assert found.passes == {"accelerations": 1} and repr(pc.Scene(arm)) == "<scene of 'arm': empty>"


@pytest.mark.parametrize(
    ("hinges", "coordinates"),
    [
        (None, range(6)),
        ("left_shoulder", [0]),
        (["left_elbow"], [1, 2]),
        (["left_elbow[1]", "left_shoulder"], [2, 0]),
        ("left_*", [0, 1, 2]),
        ("*_?lbow", [1, 2]),
        (["wrist[[]2]"], [5]),
        ("[lw]*", range(6)),
        ("[a-l]*", [0, 1, 2]),
        ("[!l]*", [3, 4, 5]),
        ("[!a-l]rist", [3, 4, 5]),
        ("wrist[[][0-1][]]", [3, 4]),
        (["left_shoulder", "left_*"], [0, 1, 2]),
        ([], []),
    ],
)
def test_names_lists_and_patterns(arm, hinges, coordinates):
    state = arm.random_state(1)
    found = pc.Scene(arm).add(E.Damping(1.0, hinges=hinges)).evaluate(state.q, state.v).forces["damping"]
    assert np.array_equal(found, np.where(np.isin(np.arange(6), list(coordinates)), -state.v, 0))


LETTERS = "abcé]-!"


@settings(max_examples=300, deadline=None)
@given(
    names=st.lists(st.text(LETTERS, min_size=1, max_size=4), min_size=1, max_size=5, unique=True),
    pattern=st.text(LETTERS + "?*[", min_size=1, max_size=8),
)
def test_patterns_are_those_of_a_shell(names, pattern):
    """As Python's fnmatch has them, ranges and sets of what is not to be there among them; a name is itself before it is a pattern."""
    model = pc.Multibody("names")
    for name in names:
        model.add_body(name, mass=1.0, inertia=np.eye(3))
    fitting = [i for i, name in enumerate(names) if name == pattern] or [i for i, name in enumerate(names) if fnmatchcase(name, pattern)]
    if fitting:
        assert _core.coordinates_named(model, [pattern], "an effect") == fitting
    else:
        with pytest.raises(pc.ModelError):
            _core.coordinates_named(model, [pattern], "an effect")


def test_handles_and_dictionaries(arm):
    state = arm.random_state(1)
    scene = pc.Scene(arm).add(E.Damping({"left_elbow": 2.0, "wrist": [1, 2, 3]}), E.Damping(1.0, hinges=arm.hinges["left_shoulder"]))
    forces = scene.evaluate(state.q, state.v).forces
    assert forces["damping"] == pytest.approx(-np.array([0, 2, 2, 1, 2, 3]) * state.v)
    assert forces["damping_2"] == pytest.approx(-np.array([1, 0, 0, 0, 0, 0]) * state.v)
    values_in_the_order_of_names = E.Damping([5.0, 7.0], hinges=["left_elbow[0]", "left_shoulder"])
    assert pc.Scene(arm).add(values_in_the_order_of_names).evaluate(state.q, state.v).forces["damping"][:2] == pytest.approx(
        [-7, -5] * state.v[:2]
    )


# On and off -----------------------------------------------------------------------------------------------------------


def test_added_removed_enabled_disabled(arm):
    damping = E.Damping(0.1)
    scene = pc.Scene(arm).add(E.Gravity(), damping, E.Damping(0.2), E.Damping(0.3, hinges="wrist"))
    assert list(scene.effects) == ["gravity", "damping", "damping_2", "damping_3"] and scene.effects["damping"] is damping
    assert repr(scene.disable("damping_2")) == "<scene of 'arm': gravity, damping, (damping_2 off), damping_3>"
    assert "  off damping_2: Damping(coefficient=0.2)" in str(scene) and "  on  damping_3: Damping(coefficient=0.3, hinges='wrist')" in str(
        scene
    )
    assert not scene.is_on("damping_2") and scene.is_on(damping)
    scene.remove(damping, "damping_3").enable("damping_2").add(E.Damping(0.4), name="brake")
    assert repr(scene) == "<scene of 'arm': gravity, damping_2, brake>" and "brake" in scene.effects and len(scene.effects) == 3
    for call, text in (
        (lambda: scene.remove("brak"), "the scene of 'arm' has no effect 'brak'; did you mean 'brake'"),
        (lambda: scene.enable("gravty"), "no effect 'gravty'; did you mean 'gravity'"),
        (lambda: scene.add(E.Gravity(), name="brake"), "has an effect 'brake' already; give another name"),
        (lambda: scene.add(E.Gravity(), E.Gravity(), name="both"), "name='both' names one effect, but 2 were given"),
        (lambda: pc.Scene(3), "Scene takes a model, not 3"),
    ):
        with pytest.raises(pc.ModelError, match=text):
            call()
    with pytest.raises(KeyError, match="did you mean 'brake'"):
        scene.effects["break"]


def test_what_is_off_does_nothing(arm):
    state = arm.random_state(2)
    scene = pc.Scene(arm).add(
        E.Gravity(), E.Damping(0.3), E.Wrench("tip", np.ones(6)), E.RotorInertia(1.0), E.Prescribed("left_elbow", [0.1, 0.2])
    )
    scene.disable(*list(scene.effects)[1:])
    found = scene.evaluate(state.q, state.v)
    alone = pc.Scene(arm).add(E.Gravity()).evaluate(state.q, state.v)
    assert (
        np.array_equal(found.vdot, alone.vdot)
        and found.passes == alone.passes == {"accelerations": 1}
        and list(found.forces) == ["gravity"]
    )
    assert "off, and in no pass: damping, wrench, rotor_inertia, prescribed" in scene.explain()
    again = scene.enable("damping").evaluate(state.q, state.v)
    assert np.array_equal(again.vdot, pc.Scene(arm).add(E.Gravity(), E.Damping(0.3)).evaluate(state.q, state.v).vdot)


def test_fields_can_be_set(arm):
    """A scene takes the change at its next call, and refuses what makes no sense."""
    scene, state = pc.Scene(arm).add(E.Damping(0.1)), arm.random_state(0)
    scene.effects["damping"].coefficient = 0.7
    assert scene.evaluate(state.q, state.v).forces["damping"] == pytest.approx(-0.7 * state.v)
    scene.effects["damping"].hinges = "elbow"
    with pytest.raises(pc.ModelError, match="'elbow'; did you mean 'left_elbow'"):
        scene.evaluate(state.q, state.v)
    with pytest.raises(pc.ModelError, match="takes no 'coeficient'; did you mean 'coefficient'"):
        scene.effects["damping"].coeficient = 1.0


def test_a_coordinate_is_prescribed_once(arm):
    scene = pc.Scene(arm).add(E.Prescribed("left_elbow", [0.1, 0.2]))
    text = r"effects 'prescribed' and '{}' both prescribe coordinate 'left_elbow\[1\]' of 'arm'; disable or remove one"
    with pytest.raises(pc.ModelError, match=text.format("prescribed_2")):
        scene.add(E.Prescribed("left_elbow[1]", 0.3))
    scene.disable("prescribed").add(E.Prescribed("left_elbow[1]", 0.3), name="other")
    with pytest.raises(pc.ModelError, match=text.format("prescribed").replace("'prescribed' and", "'other' and")):
        scene.enable("prescribed")
    assert not scene.is_on("prescribed")
    scene.disable("other").enable("prescribed")
    assert scene.evaluate(arm.zero_q()).vdot[1:3].tolist() == [0, 0]


# What it compiles to --------------------------------------------------------------------------------------------------


def passes(arm, *effects, rest=False):
    state = arm.random_state(1)
    found = pc.Scene(arm).add(*effects).evaluate(state.q, None if rest else state.v).passes
    assert all(times == 1 for times in found.values())
    return list(found)


def test_a_pass_is_there_for_an_effect_alone(arm):
    assert passes(arm) == passes(arm, E.Gravity(), E.RotorInertia(0.1)) == ["accelerations"]
    assert passes(arm, E.Damping(0.1)) == ["damping", "accelerations"]
    assert passes(arm, E.Wrench("tip", np.ones(6), axes="body")) == ["wrench", "accelerations"]
    assert passes(arm, E.Wrench("tip", np.ones(6), axes="hand")) == ["wrench", "accelerations"]  # the axes of its own body
    assert passes(arm, E.Wrench("tip", np.ones(6))) == ["poses", "wrench", "accelerations"]
    assert passes(arm, E.NodeDamper("tip", "mark", 0.1)) == ["poses", "twists", "node_damper", "accelerations"]
    assert passes(arm, E.NodeSpring("tip", "mark", 0.1)) == ["poses", "node_spring", "accelerations"]
    assert passes(arm, E.Prescribed("wrist", [1, 0, 0, 0])) == ["prescribed", "accelerations"]


def test_at_rest_nothing_needs_velocities(arm):
    everything = [
        E.Gravity(),
        E.Damping(0.1),
        E.QuadraticDamping(0.1),
        E.CoulombFriction(0.1),
        E.NodeDamper("tip", "mark", 0.1),
        E.ImplicitDamping(0.1),
    ]
    assert passes(arm, *everything, rest=True) == ["poses", "accelerations"]
    assert passes(arm, E.Bushing("tip", "mark", 1.0, 1.0), rest=True) == ["poses", "bushing", "accelerations"]
    scene, state = pc.Scene(arm).add(*everything, E.Bushing("tip", "mark", 1.0, 1.0), E.Servo(1.0, 1.0)), arm.random_state(3)
    assert np.array_equal(scene.evaluate(state.q).vdot, scene.evaluate(state.q, np.zeros(arm.nv)).vdot)
    assert "twists" not in scene.explain("rest") and "twists" in scene.explain()


def test_poses_of_those_who_are_read_and_no_others():
    """Along their ways to the base: of a tree of two arms the bodies of one."""
    two = pc.tree([-1, 0, 1, -1, 3, 4], ["pin"] * 6, seed=1)
    scene = pc.Scene(two).add(E.Wrench("body1", np.ones(6)))
    assert "poses          2 bodies" in scene.explain()
    scene.add(E.NodeSpring("body4", None, 1.0), name="spring")
    assert "poses          4 bodies" in scene.explain() and "wrench, spring" in scene.explain()
    works = scene.explain("works")
    assert "twists         2 bodies" in works and "twists" not in scene.explain()


def test_an_actuator_on_one_hinge_touches_one_hinge(arm):
    assert "motor          forces on 1 coordinate " in pc.Scene(arm).add(E.Motor(1.0, 1.0, 1.0, hinges="left_shoulder")).explain()


def test_a_run_counts_its_passes(arm):
    scene = pc.Scene(arm).add(E.Gravity(), E.Damping(0.1), E.Wrench("tip", np.ones(6)), E.Spring(1.0)).disable("spring")
    run = scene.simulate(0.1, integrator="rk4", step=0.01)
    assert run.statistics["evaluations"] == 40
    assert run.statistics["passes"] == {"poses": 40, "twists": 40, "damping": 40, "wrench": 40, "accelerations": 40}
    # Without works, also once at the start, where the stability of fixed steps is checked.
    plain = scene.simulate(0.1, integrator="rk4", step=0.01, energy=False)
    assert plain.statistics["passes"] == {"poses": 41, "damping": 41, "wrench": 41, "accelerations": 41}


def test_the_plan_in_words(arm):
    scene = pc.Scene(arm, form="ud").add(E.Gravity(), E.Prescribed("left_elbow", [0.1, 0.2]), E.Wrench("tip", np.ones(6)))
    assert scene.explain() == (
        "an evaluation of the scene of 'arm', form ud, refine 0, precision double\n"
        "  pass           what                            because of\n"
        "  poses          3 bodies                        wrench\n"
        "  wrench         wrenches on 1 body              wrench\n"
        "  prescribed     accelerations of 2 coordinates  prescribed\n"
        "  accelerations  hybrid dynamics, by recursions  gravity, prescribed"
    )
    with pytest.raises(pc.EvaluationError, match="at='flight': there are 'motion', 'rest' and 'works'"):
        scene.explain("flight")


# States, copies, threads ----------------------------------------------------------------------------------------------


def test_states_by_the_rule_of_direct_calls(arm):
    scene, state = pc.Scene(arm).add(E.Gravity(), E.Damping(0.1)), arm.random_state(4)
    arm.q, arm.v = state.q, state.v
    expected = scene.evaluate(state.q, state.v).vdot
    assert np.array_equal(scene.evaluate().vdot, expected) and np.array_equal(scene.evaluate(state).vdot, expected)
    assert np.array_equal(scene.simulate(0.01).q[0], state.q)
    for call, text in (
        (lambda: scene.evaluate(state.q[:-1], state.v), "q of 'arm' takes 7 numbers"),
        (lambda: scene.evaluate(state.q, state.v[:-1]), "v of 'arm' takes 6 numbers"),
        (lambda: scene.evaluate(state.q * np.nan, state.v), "nan"),
        (lambda: scene.evaluate(state.q, state.v, "now"), "t is not an array of numbers"),
        (lambda: scene.evaluate(state.q, state.v, states=[1.0]), "the effects have 0 states of their own, not 1"),
        (lambda: scene.simulate(1.0, state.q[:-1]), "q of 'arm' takes 7 numbers"),
    ):
        with pytest.raises(pc.ModelError, match=text):
            call()


def test_times_that_are_asked_for(arm):
    scene = pc.Scene(arm).add(E.Gravity())
    every, some = scene.simulate(0.3), scene.simulate(0.3, t_eval=[0.1, 0.25])
    assert every.t[0] == 0 and every.t[-1] == 0.3 and len(every) == every.statistics["steps"] + 1
    assert some.t.tolist() == [0.1, 0.25] and some.q.shape == (2, 7) and some.vdot.shape == (2, 6)
    assert scene.simulate(0.3, t_eval=[0.0, 0.3]).t.tolist() == [0.0, 0.3]


def test_a_run_keeps_its_scene_as_it_was(arm):
    scene = pc.Scene(arm).add(E.Gravity(), E.Damping(0.1))
    run = scene.simulate(0.1, t_eval=[0.1])
    scene.remove("damping").effects["gravity"].g = (0, 0, 0)
    assert list(run.forces) == ["gravity", "damping"] and np.abs(run.forces["gravity"]).max() > 1


def test_a_scene_sees_edits_of_its_model(arm):
    scene, state = pc.Scene(arm).add(E.Gravity(), E.PointMassGravity(1.0, (9, 0, 0))), arm.random_state(2)
    before = scene.evaluate(state.q, state.v)
    arm.bodies["hand"].mass = 5.0
    after = scene.evaluate(state.q, state.v)
    fresh = pc.Scene(arm).add(E.Gravity(), E.PointMassGravity(1.0, (9, 0, 0))).evaluate(state.q, state.v)
    assert np.array_equal(after.vdot, fresh.vdot) and not np.array_equal(after.vdot, before.vdot)
    scene.add(E.Damping(0.1, hinges="wrist"))
    with pytest.raises(pc.ModelError, match="body 'hand' is in use: node 'tip' is on 'hand'; effect 'damping' of a scene names 'wrist'"):
        arm.remove_body("hand")
    arm.detach("hand", hinge_name="flight")
    with pytest.raises(pc.ModelError, match="'wrist'"):
        scene.evaluate()
    scene.remove("damping")
    assert arm.remove_body("hand", with_uses=True).nodes == ["tip"]
    assert scene.disable("gravity").evaluate(np.zeros(3), np.zeros(3)).vdot.shape == (3,)


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))], ids=["copy", "deepcopy", "pickle"])
def test_copies(arm, again):
    arm.gravity, state = GRAVITY, arm.random_state(3)
    scene = (
        pc.Scene(arm, form="ud")
        .add(E.Gravity(), E.Damping(0.1), E.Prescribed("left_elbow", E.Spline([0, 1], [[0, 0], [1, 2]])))
        .disable("damping")
    )
    other = again(scene)
    assert repr(other) == repr(scene) and np.array_equal(
        other.evaluate(state.q, state.v, 0.3).vdot, scene.evaluate(state.q, state.v, 0.3).vdot
    )
    other.enable("damping").add(E.Spring(1.0))
    assert repr(scene) == "<scene of 'arm': gravity, (damping off), prescribed>"


def test_threads_share_a_scene(arm):
    scene = pc.Scene(arm).add(E.Gravity(), E.Damping(0.1), E.Wrench("tip", np.ones(6)), E.Sampled(lambda t, s: -s.v, 0.05))
    states = [arm.random_state(i) for i in range(24)]
    alone = [scene.simulate(0.2, s.q, s.v).q[-1] for s in states]
    found = [None] * len(states)

    def work(part):
        for i in part:
            found[i] = scene.simulate(0.2, states[i].q, states[i].v).q[-1]

    threads = [threading.Thread(target=work, args=(range(i, len(states), 4),)) for i in range(4)]
    [t.start() for t in threads], [t.join() for t in threads]
    assert all(np.array_equal(a, b) for a, b in zip(alone, found, strict=True))


def test_plain_data():
    assert E.Damping(np.array([0.1, 0.2]), hinges=["a", "b"]).to_dict() == {
        "effect": "Damping",
        "coefficient": [0.1, 0.2],
        "hinges": ["a", "b"],
    }
    assert E.Gravity().to_dict() == {"effect": "Gravity"}
    assert E.TorqueSource(E.Harmonic(1.0, 2.0)).to_dict()["torque"] == {
        "in_time": "Harmonic",
        "amplitude": 1.0,
        "frequency": 2.0,
        "phase": 0.0,
        "offset": 0.0,
    }
    with pytest.raises(pc.ModelError, match="is not plain data"):
        E.TorqueSource(lambda t: t).to_dict()
    assert repr(E.CoulombFriction(0.1, hinges="a*")) == "CoulombFriction(level=0.1, hinges='a*')"


# Models at the edge ---------------------------------------------------------------------------------------------------


def test_a_model_that_cannot_move():
    """Nothing to accelerate: welds alone, or no body at all."""
    for model in (pc.tree([-1, 0], ["weld", "weld"], welds="keep"), pc.tree([-1], ["weld"]), pc.Multibody("nothing")):
        scene = pc.Scene(model).add(
            E.Gravity(), E.Damping(0.1), E.Spring(1.0), E.TorqueSource(1.0), E.Limits(1.0), E.PointMassGravity(1.0, (1, 2, 9))
        )
        found = scene.evaluate(np.zeros(0), np.zeros(0))
        assert found.vdot.shape == (0,) and all(f.shape == (0,) for f in found.forces.values())
        run = scene.simulate(0.5, t_eval=[0.1, 0.5])
        assert run.q.shape == (2, 0) and run.energy["kinetic"].tolist() == [0, 0] and np.ptp(run.energy["potential"]) == 0


@pytest.mark.parametrize(
    "how", [dict(form="ud"), dict(form="square-root"), dict(refine=1), dict(precision="extended"), dict(precision="quad")], ids=str
)
def test_every_form_and_precision(how):
    model = every_kind()
    model.add_node("a", list(model.bodies)[3], position=(0.1, 0.2, 0.3))
    state, rng = model.random_state(2), np.random.default_rng(0)
    effects = [
        E.Gravity(),
        E.Damping(0.1),
        E.CoulombFriction(0.2),
        E.Spring(1.0),
        E.Wrench("a", rng.normal(size=6)),
        E.Bushing("a", None, 2.0, 0.1),
    ]
    effects += [
        E.Servo(1.0, 0.1, target=E.Harmonic(0.1, 1.0)),
        E.Limits(3.0, 0.1, -0.1, 0.1),
        E.PointMassGravity(1.0, (3, 4, 5)),
        E.GravityGradient(1.0, (3, 4, 5)),
    ]
    plain, other = (pc.Scene(model, **options).add(*effects) for options in ({}, how))
    a, b = (scene.evaluate(state.q, state.v, 0.3) for scene in (plain, other))
    assert np.abs(a.vdot - b.vdot).max() < 1e-9 * np.abs(a.vdot).max()
    for name in a.forces:
        assert np.abs(a.forces[name] - b.forces[name]).max() < 1e-12 * (1 + np.abs(a.forces[name]).max()), name
    runs = [scene.simulate(0.05, state.q, state.v, rtol=1e-11, atol=1e-13, t_eval=[0.05]) for scene in (plain, other)]
    assert np.abs(runs[0].q - runs[1].q).max() < 1e-8
