"""Effects that take their values from the model: gravity, and stiffness by the inertia at a coordinate."""

import copy
import json
import pickle
import warnings

import numpy as np
import pytest

import pycraft as pc
from pycraft.models.warning import ModelWarning

E = pc.effects
MOON = (0.0, 0.0, -1.62)
QUIET = {"progress": False}


def pendulum(gravity=None):
    """A rod of 2 kg on a pin across the plane, the mass 0.5 m out, horizontal at q = 0."""
    rod = pc.Multibody("rod")
    rod.add_body("rod", axis=(0, 1, 0), mass=2.0, com=(0.5, 0, 0))
    if gravity is not None:
        rod.gravity = gravity
    return rod


@pytest.mark.parametrize("own, acts", [(None, 9.81), (MOON, 1.62), ((0.0, 0.0, 0.0), 9.81)])
def test_gravity_is_the_model_s_own_where_it_is_set(own, acts):
    scene = pc.Scene(pendulum(own)).add(E.Gravity())
    assert scene.evaluate([0.0], [0.0]).vdot[0] == pytest.approx(acts / 0.5, rel=4e-16)  # g l/l², a product and a quotient
    assert f"Gravity(g=(0.0, 0.0, {-acts}))" in str(scene)


def test_a_gravity_that_is_given_is_taken_whatever_the_model_s():
    scene = pc.Scene(pendulum(MOON)).add(E.Gravity((0, 0, -9.81)))
    assert scene.evaluate([0.0], [0.0]).vdot[0] == pytest.approx(9.81 / 0.5, rel=4e-16)


def test_the_model_s_gravity_may_change_after_the_effect_was_added():
    rod = pendulum()
    scene = pc.Scene(rod).add(E.Gravity())
    before = scene.evaluate([0.0], [0.0]).vdot[0]
    rod.gravity = MOON
    assert scene.evaluate([0.0], [0.0]).vdot[0] == pytest.approx(before * 1.62 / 9.81, rel=1e-15)
    rod.gravity = (0, 0, 0)
    assert scene.evaluate([0.0], [0.0]).vdot[0] == before


def test_one_effect_in_scenes_of_two_models():
    gravity = E.Gravity()
    on_the_moon, on_earth = (pc.Scene(pendulum(g)).add(gravity) for g in (MOON, None))
    assert on_the_moon.evaluate([0.0], [0.0]).vdot[0] == pytest.approx(3.24, rel=4e-16)
    assert on_earth.evaluate([0.0], [0.0]).vdot[0] == pytest.approx(19.62, rel=4e-16)


def test_direct_calls_and_the_scene_agree_on_the_moon():
    arm = pc.robots.ur5()
    arm.gravity = MOON
    state = arm.random_state(seed=3)
    there = pc.Scene(arm).add(E.Gravity()).evaluate(state.q, state.v).vdot
    assert np.abs(there - arm.forward_dynamics(state.q, state.v, np.zeros(6))).max() <= 1e-12 * np.abs(there).max()


def test_files_copies_sweeps_and_pages_know_it():
    scene = pc.Scene(pendulum(MOON)).add(E.Gravity())
    expected = scene.evaluate([0.0], [0.0]).vdot[0]
    data = json.loads(json.dumps(scene.to_dict()))
    assert "g" not in data["effects"][0]
    for again in (pc.Scene.from_dict(data), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert again.evaluate([0.0], [0.0]).vdot[0] == expected
    result = pc.sweep(scene, {"effects.gravity.g[2]": [-1.0, -2.0]}, T=0.1, progress=False)
    assert abs(result["end.q"][1, 0]) > abs(result["end.q"][0, 0]) > 0
    from pycraft.viewer.effect_fields import set_field, shown_fields

    assert shown_fields(scene.effects["gravity"], scene.model) == [{"name": "g", "value": list(MOON)}]
    set_field(scene, "gravity", "g", [0, 0, -5.0])
    assert scene.effects["gravity"].g == [0, 0, -5.0]


def test_a_gravity_that_does_not_act_is_said_once():
    scene = pc.Scene(pendulum(MOON)).add(E.Damping(0.1))
    with pytest.warns(
        ModelWarning, match=r"the gravity of 'rod', \(0, 0, -1.62\) m/s², does not act in this scene.*pc.effects.Gravity\(\)"
    ):
        scene.simulate(0.1, **QUIET)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene.simulate(0.1, **QUIET)
        scene.evaluate([0.0], [0.0])
        copy.deepcopy(scene).simulate(0.1, **QUIET)
        pc.Scene(pendulum()).simulate(0.1, **QUIET)  # no gravity is set
        pc.Scene(pendulum(MOON)).add(E.Gravity()).disable("gravity").simulate(0.1, **QUIET)  # turned off on purpose
        pc.Scene(pendulum(MOON)).add(E.PointMassGravity(4e14, position=(0, 0, -6.4e6))).simulate(0.1, **QUIET)


def test_a_sweep_says_it_once_and_not_by_each_worker():
    scene = pc.Scene(pendulum(MOON)).add(E.Damping(0.1))
    with pytest.warns(ModelWarning, match="does not act") as said:
        pc.sweep(scene, {"v.rod": [0.1, 0.2, 0.3]}, T=0.1, progress=False)
    assert len(said) == 1


def stiffness_of(effect, model):
    return np.asarray(effect.completed_for(model).stiffness)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_stiffness_follows_the_inertia_at_each_coordinate(scale):
    """ω² (ℳ + J)_jj at q = 0: of a rod of 2 kg at 0.5 m that is 0.5 kg m², of any size and mass."""
    rod = pc.Multibody("rod")
    rod.add_body("rod", axis=(0, 1, 0), mass=2.0 * scale, com=(0.5 * scale, 0, 0), limits=(-1, 1), rotor_inertia=0.25 * scale**3)
    inertia = 0.75 * scale**3
    assert stiffness_of(E.Servo(), rod) == pytest.approx([400 * inertia], rel=1e-15)
    assert np.asarray(E.Servo().completed_for(rod).damping) == pytest.approx([40 * inertia], rel=1e-15)  # critical: 2ω
    assert stiffness_of(E.Limits(), rod) == pytest.approx([22500 * inertia], rel=1e-15)


def test_the_default_servo_is_critically_damped_and_holds():
    run = pc.Scene(pendulum()).add(E.Servo(target=0.3)).simulate(2.0, [0.0], [0.0], **QUIET)
    assert run.q[:, 0].max() <= 0.3 + 1e-9  # never beyond the target
    assert run.q[-1, 0] == pytest.approx(0.3, abs=1e-9)


def test_servos_with_a_stiffness_have_no_damping_unless_it_is_given():
    rod = pendulum()
    assert E.Servo(50.0).completed_for(rod).damping == 0.0
    assert E.Servo(50.0, 3.0).completed_for(rod).damping == 3.0
    given = E.Servo(damping=3.0).completed_for(rod)
    assert given.damping == 3.0 and np.asarray(given.stiffness) == pytest.approx([200.0])


def test_default_stops_hold_a_fall_within_millimetres():
    rod = pc.Multibody("rod")
    rod.add_body("rod", axis=(0, 1, 0), mass=2.0, com=(0.5, 0, 0), limits=(-0.5, 0.5))
    run = pc.Scene(rod).add(E.Gravity(), E.Limits()).simulate(2.0, [0.0], [0.0], **QUIET)
    fastest = np.abs(run.v).max()
    assert 0.5 < run.q.max() < 0.5 + 1.01 * fastest / 150 + 9.81 / 0.5 / 150**2
    assert not run.crossed_limits


def test_a_coordinate_that_moves_nothing_is_named():
    bare = pc.Multibody("bare")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bare.add_body("ghost", axis=(0, 0, 1), limits=(-1, 1))
    for effect in (E.Servo(), E.Limits()):
        with pytest.raises(pc.ModelError, match="coordinate 'ghost' of 'bare' moves no mass at q = 0"):
            pc.Scene(bare).add(effect)


def test_arguments_that_do_not_fit_are_named_with_an_example():
    with pytest.raises(pc.ModelError, match=r"Damping needs coefficient, for example pc\.effects\.Damping\(0\.1\)"):
        E.Damping()
    with pytest.raises(pc.ModelError, match="Damping has no argument 'coeficient'; did you mean 'coefficient'"):
        E.Damping(coeficient=1.0)
    with pytest.raises(pc.ModelError, match="Gravity takes g: 2 arguments were given"):
        E.Gravity(1, 2)
    with pytest.raises(pc.ModelError, match="Spring: stiffness is given twice"):
        E.Spring(1.0, stiffness=2.0)
    with pytest.raises(pc.ModelError, match=r"Table needs values, for example pc\.effects\.Table"):
        E.Table([0.0, 1.0])


@pytest.mark.parametrize(
    "kind", [getattr(E, name) for name in E.__all__ if hasattr(getattr(E, name), "_example")], ids=lambda kind: kind.__name__
)
def test_every_example_of_an_error_is_a_call_that_works(kind):
    if kind._example:
        made = eval(kind._example.partition(" for ")[0], {"pc": pc})
        assert type(made) is kind
    else:
        assert kind.__name__ in ("Effect", "FluidDrag", "Gravity", "GravityCompensation", "Loop")  # which need no argument


@pytest.mark.parametrize(
    "given, got",
    [
        (E.Gravity, r"the class Gravity \(forgotten parentheses\?\)"),
        (dict, "the class dict; give an object of it"),
        ("gravity", "the string 'gravity'"),
        ([E.Gravity()], r"a list; write add\(\*effects\)"),
        (None, "None"),
        (3, "3"),
    ],
)
def test_what_is_no_effect_is_refused_when_it_is_added(given, got):
    scene = pc.Scene(pendulum())
    with pytest.raises(
        pc.ModelError, match=r"add\(\) takes an effect, such as pc.effects.Gravity\(\), or a function f\(t, state\) -> forces; got " + got
    ):
        scene.add(E.Damping(0.1), given)
    assert not scene.effects  # as it was
