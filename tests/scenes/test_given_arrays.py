"""Effects, functions of time, models, hinges and bodies copy their inputs, and their arrays are read-only."""

import copy
import pickle
from dataclasses import fields

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import pycraft as pc
from pycraft.scenes.file_format import IN_TIME, KINDS
from support.copies import alike, arrays_in, disturbed, lists_for_arrays

E = pc.effects
TIMES, TWO = np.array([0.0, 1.0, 3.0]), np.array([0.5, 0.7])
BOTH = ["hinge0", "hinge1"]
BOXES = np.array([np.eye(4)] * 2)

GIVEN = {
    "Bushing": dict(node_a=None, node_b="body1", stiffness=np.diag([1.0, 2, 3, 4, 5, 6]), damping=np.full(6, 0.1), rest=np.eye(4)),
    "CoulombFriction": dict(level=TWO, smoothing=0.1, hinges=BOTH),
    "Damping": dict(coefficient={"hinge0": np.array([0.3]), "hinge1": 0.4}),
    "Fixman": dict(temperature=1.0),
    "FluidDrag": dict(density=1.0, wind=np.array([0.1, 0.2, 0.3]), bodies=["body0", "body1"], sizes=np.full((2, 3), 0.4), placements=BOXES),
    "Gravity": dict(g=np.array([0.1, 0.2, -9.0])),
    "GravityCompensation": dict(share=TWO, bodies=["body0", "body1"], points=np.ones((2, 3)), g=np.array([0, -9.0, 0])),
    "GravityGradient": dict(mu=3.0, position=np.array([4.0, 0, 1]), bodies=["body1"]),
    "ImplicitDamping": dict(coefficient=TWO, hinges=BOTH),
    "ImplicitSpring": dict(stiffness=TWO, rest=np.array([0.1, 0.2]), hinges=BOTH),
    "Langevin": dict(temperature=1.0, friction=TWO, period=0.1, hinges=BOTH),
    "Limits": dict(stiffness=TWO, lower=np.array([-0.1, -0.2]), upper=np.array([0.1, 0.2]), hinges=BOTH, restitution=(TWO, 2 * TWO)),
    "Motor": dict(command=TWO, stall_torque=TWO, no_load_speed=TWO, gear_ratio=TWO, rotor_inertia=TWO, effort_limit=TWO, speed_limit=TWO),
    "NodeDamper": dict(node_a="body0", node_b="body1", coefficient=0.3),
    "NodeSpring": dict(node_a="body0", node_b="body1", stiffness=0.3, length=0.1),
    "NoseHoover": dict(temperature=1.0, time_constant=0.5, hinges=BOTH),
    "PointMassGravity": dict(mu=3.0, position=np.array([4.0, 0, 1]), bodies=["body1"]),
    "Prescribed": dict(hinge=["hinge1"], motion=CubicSpline(TIMES, TIMES**2)),
    "QuadraticDamping": dict(coefficient=TWO, hinges=BOTH),
    "RotorInertia": dict(inertia=TWO, hinges=BOTH, gear_ratio=TWO),
    "Servo": dict(stiffness=TWO, damping=TWO, target=E.Table(TIMES, np.outer(TIMES, TWO)), hinges=BOTH, effort_limit=TWO, speed_limit=TWO),
    "Spring": dict(stiffness=TWO, rest=TWO, hinges=BOTH),
    "TorqueSource": dict(torque=TWO, hinges=BOTH, effort_limit=TWO, speed_limit=2 * TWO),
    "Wrench": dict(node="body1", wrench=np.arange(6.0)),
    "Table": dict(times=TIMES, values=TIMES**2),
    "Spline": dict(times=TIMES, values=TIMES**2),
    "Harmonic": dict(amplitude=TWO, frequency=TWO, phase=TWO, offset=TWO),
}
NO_ARRAYS = {"node", "node_a", "node_b", "loops"}  # fields that may be anything, and are no numbers


def made(name, given):
    return (KINDS.get(name) or IN_TIME[name])(**given)


def test_every_effect_and_every_field_that_may_be_an_array_is_here():
    assert set(KINDS) | set(IN_TIME) == set(GIVEN) | {"Loop"}
    for name, given in GIVEN.items():
        open_fields = {field.name for field in fields(KINDS.get(name) or IN_TIME[name]) if field.type == "Any"} - NO_ARRAYS
        missing = open_fields - set(given) - ({"hinges"} if "hinges" not in given else set())
        assert not missing - {"dissipation"}, name  # of two fields that say the same


@pytest.mark.parametrize("form", ["arrays", "lists"])
@pytest.mark.parametrize("name", GIVEN)
def test_numbers_that_the_user_changes_later(name, form):
    """Neither what an effect shows nor what it computes, saves and copies follows arrays that it was given, or lists."""
    given = copy.deepcopy(GIVEN[name])
    if form == "lists":
        given = {key: value if callable(value) else lists_for_arrays(value) for key, value in given.items()}
    effect, before = made(name, given), made(name, copy.deepcopy(given))
    says = said(effect)
    assert disturbed(given) or not arrays_in(given)
    assert alike(vars(effect), vars(before)) and says == said(before) == said(effect) == said(copy.deepcopy(effect))
    assert says == said(pickle.loads(pickle.dumps(effect)))


def said(effect):
    """Return its results, and its saved data, in bytes."""
    if not isinstance(effect, E.Effect):
        return effect(0.4).tobytes(), repr(effect.to_dict())
    model = pc.chain(2, seed=1)
    scene = pc.Scene(model).add(effect)
    found = scene.evaluate([0.3, -0.4], [0.5, 0.6], 0.4, step=0.1)
    data = None if callable(getattr(effect, "motion", None)) and not isinstance(effect.motion, pc.effects.Table) else repr(effect.to_dict())
    return found.vdot.tobytes(), data


@pytest.mark.parametrize("name", GIVEN)
def test_what_is_given_out_cannot_be_written(name):
    effect = made(name, GIVEN[name])
    for each in (effect, copy.deepcopy(effect), pickle.loads(pickle.dumps(effect))):
        for field in fields(each):
            value = getattr(each, field.name)
            for array in arrays_in(value):
                with pytest.raises(ValueError, match="read-only"):
                    array[...] = 0.0
            for each_value in (value, *(value if isinstance(value, (list, tuple)) else ())):
                refuses_changes(each_value)


def refuses_changes(value):
    """Every way to change a list, mapping or set in its place."""
    kind = next((kind for kind in (list, dict, set) if isinstance(value, kind)), None)
    one = {list: [1.0], dict: {"a": 1.0}}
    calls = {
        list: [("__setitem__", 0, 1.0), ("__delitem__", 0), ("__iadd__", [1.0]), ("__imul__", 2), ("append", 1.0), ("extend", [1.0]),
               ("insert", 0, 1.0), ("pop",), ("remove", 1.0), ("clear",), ("sort",), ("reverse",)],
        dict: [("__setitem__", "a", 1.0), ("__delitem__", "a"), ("__ior__", {}), ("clear",), ("pop", "a"), ("popitem",),
               ("setdefault", "a", 1.0), ("update", {})],
    }  # fmt: skip
    assert kind is not set
    if kind is None:
        return
    changing = {name for name in dir(kind) if changes_in_place(kind, name, one[kind])}
    assert changing <= {call[0] for call in calls[kind]}
    for name, *arguments in calls[kind]:
        with pytest.raises(TypeError, match="set the field that holds it anew"):
            getattr(value, name)(*arguments)


def changes_in_place(kind, name, one):
    """Check for methods of a list or dictionary that change it, with some arguments."""
    for arguments in ((), (0,), ("a",), (one,), (0, 2.0), ("a", 2.0), ("b", 2.0), (2,), (1.0,), ({"b": 1.0},)):
        thing = kind([3.0, 1.0]) if kind is list else kind(one)
        before = repr(thing)
        try:
            if name not in ("__init__", "__class__"):
                getattr(thing, name)(*arguments)
        except (TypeError, KeyError, IndexError, ValueError, AttributeError):
            continue
        if repr(thing) != before:
            return True
    return False


def test_a_field_is_changed_by_setting_it():
    damping, given = E.Damping(np.array([0.1, 0.2])), np.array([0.3, 0.4])
    scene = pc.Scene(pc.chain(2)).add(damping)
    damping.coefficient = given
    given[0] = 9.0
    assert scene.evaluate([0, 0], [1.0, 1.0]).forces["damping"].tolist() == [-0.3, -0.4]


def test_scenes_and_their_copies_agree():
    """The reproduction: a scene computed with one array, and saved another."""
    a = np.array([0.1, 0.2])
    scene = pc.Scene(pc.chain(2)).add(E.Damping(a))
    a[0] = 5.0
    scene.add(E.Gravity())
    for each in (scene, copy.deepcopy(scene), pc.Scene.from_dict(scene.to_dict())):
        assert each.evaluate([0, 0], [1.0, 1.0]).forces["damping"].tolist() == [-0.1, -0.2]


def test_effects_of_a_users_own():
    """Its fields are fixed, its other attributes its own."""
    user = E.UserEffect(lambda t, state: -state.v, states=[0.1], rates=lambda t, state: [0.0])
    assert user.states == [0.1]
    sampled = E.Sampled(lambda t, state: [0.0], 0.1, hinges=["hinge0"])
    assert sampled.hinges == ["hinge0"]
    for value in (user.states, sampled.hinges):
        refuses_changes(value)


def test_models_hinges_and_bodies():
    com, inertia, point = np.array([0.1, 0.2, 0.3]), np.diag([1.0, 2, 2.5]), np.array([0.0, 0, 1])
    rotor, limits, gravity = np.array([0.5]), (np.array([-1.0]), np.array([2.0])), np.array([0.0, 0, -9.81])
    placement, axis = np.eye(4), np.array([0.0, 0, 1])
    model = pc.Multibody("m")
    model.add_body("b", hinge="pin", axis=axis, point=point, placement=placement, mass=2.0, com=com, inertia=inertia, rotor_inertia=rotor)
    model.hinges["b"].limits, model.gravity = limits, gravity
    model.add_node("n", "b", placement=placement)
    body, hinge = model.bodies["b"], model.hinges["b"]

    def shown():
        parts = [value for part in hinge.subhinges for value in part.values() if isinstance(value, np.ndarray)]
        return [body.com, body.inertia, hinge.placement, hinge.rotor_inertia, *hinge.limits, model.gravity, model.nodes["n"].pose, *parts]

    before = [array.copy() for array in shown()]
    assert len(before) >= 10
    for array in (com, inertia, point, placement, axis, rotor, *limits, gravity):
        array += 1.0
    for array, was in zip(shown(), before, strict=True):
        assert np.array_equal(array, was)
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


@pytest.mark.peers
def test_what_files_say_beside_a_model(tmp_path):
    path = tmp_path / "m.xml"
    path.write_text(
        '<mujoco><option density="1000"/><worldbody><body name="a" gravcomp=".5"><joint name="j" axis="0 1 0" damping=".5"/>'
        '<geom type="box" size=".1 .2 .3" mass="1"/></body></worldbody><actuator><motor joint="j"/></actuator></mujoco>'
    )
    pytest.importorskip("mujoco")
    model = pc.load(path)
    beside = [model.left_aside, model.actuators, [vars(offer) for offer in model.offers], [vars(shape) for shape in model.shapes]]
    found = arrays_in(beside)
    assert found
    assert not any(array.flags.writeable for array in found)


@pytest.mark.parametrize("piecewise", [CubicSpline(TIMES, TIMES**2), pytest.param(CubicSpline(TIMES, TIMES[:, None] ** [2, 3]), id="two")])
def test_splines_of_scipys_still_work(piecewise):
    source = E.TorqueSource(piecewise)
    assert np.array_equal(source.torque(0.3), piecewise(0.3))
    assert np.array_equal(source.torque.derivative()(0.3), piecewise.derivative()(0.3))
