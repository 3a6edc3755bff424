"""Scenes to data and TOML files and back, bit for bit; every effect that is data; what a file gets wrong, with its line."""

import copy
import json
import pickle
import re
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest

import pycraft as pc
from pycraft.scenes.file_format import KINDS
from support.mechanisms import every_kind

E = pc.effects
HAND = "panda_link7"

EVERY = {
    "Bushing": lambda: E.Bushing(None, HAND, np.diag([1.0, 2, 3, 4, 5, 6]), [0.1] * 6, rest=np.eye(4)),
    "CoulombFriction": lambda: E.CoulombFriction({"panda_joint1": 0.3, "panda_joint2": 0.1}, 0.02),
    "Damping": lambda: E.Damping([0.1, 0.2], hinges=["panda_joint1", "panda_joint3"]),
    "Fixman": lambda: E.Fixman(300.0, boltzmann=1.4e-23),
    "FluidDrag": lambda: E.FluidDrag(1000.0, 1e-3, (0.1, 0, 0), [HAND, "panda_link2"], [[0.1, 0.2, 0.3]] * 2, [np.eye(4)] * 2),
    "Gravity": lambda: E.Gravity(g=(0.1, -0.0, -9.81)),
    "GravityCompensation": lambda: E.GravityCompensation([1.0, 0.5], [HAND, "panda_link2"], [[0.1, 0, 0], [0, 0, 0.2]], (0, 0, -9.8)),
    "GravityGradient": lambda: E.GravityGradient(3.0, position=(4.0, 0, 0), bodies="panda_link[1-4]"),
    "ImplicitDamping": lambda: E.ImplicitDamping(0.4),
    "ImplicitSpring": lambda: E.ImplicitSpring(2.0, rest=0.1),
    "Langevin": lambda: E.Langevin(0.7, {"panda_joint1": 0.3}, 0.02, seed=2**53 - 1),
    "Limits": lambda: E.Limits(50.0, 0.2, lower=-0.1, upper=0.1, hinges="panda_joint1"),
    "Motor": lambda: E.Motor(E.Harmonic(0.5, 2.0), 5.0, 10.0, gear_ratio=50.0, rotor_inertia=1e-5, effort_limit=3.0),
    "NodeDamper": lambda: E.NodeDamper("panda_link3", HAND, 0.7),
    "NodeSpring": lambda: E.NodeSpring(HAND, None, 3.0, 0.2),
    "NoseHoover": lambda: E.NoseHoover(0.7, 0.2, chain=4, hinges="panda_joint[1-4]"),
    "PointMassGravity": lambda: E.PointMassGravity(2.0, (3, 0, 0)),
    "Prescribed": lambda: E.Prescribed("panda_joint5", E.Spline([0, 1, 2], [0.0, 1 / 3, 0.1], ends="natural")),
    "QuadraticDamping": lambda: E.QuadraticDamping(0.3),
    "RotorInertia": lambda: E.RotorInertia(1e-4, gear_ratio=[100.0] * 7),
    "Servo": lambda: E.Servo(20.0, 1.0, target=E.Table([0.0, 1.0], np.array([[0.0, 1], [1, 2]])), hinges=["panda_joint1", "panda_joint2"]),
    "Spring": lambda: E.Spring(1 / 3, rest=0.1, hinges="panda_joint[12]"),
    "TorqueSource": lambda: E.TorqueSource(0.2, effort_limit=np.inf, speed_limit=2.0),
    "Wrench": lambda: E.Wrench(HAND, E.Table([0.0, 2.0], np.arange(12.0).reshape(2, 6)), axes="body"),
}


@pytest.fixture
def arm():
    return pc.robots.panda()


def same_numbers(one, other, seed=1):
    """Check that two scenes give the same results at a state, bit for bit."""
    state = one.model.random_state(seed)
    a, b = (scene.evaluate(state.q, state.v, 0.7, step=0.01) for scene in (one, other))
    assert np.array_equal(a.vdot, b.vdot) and a.passes == b.passes and list(a.forces) == list(b.forces)
    assert all(np.array_equal(a.forces[name], b.forces[name]) for name in a.forces)
    assert {name: one.is_on(name) for name in one.effects} == {name: other.is_on(name) for name in other.effects}
    assert one._how == other._how and one.run_options == other.run_options
    assert np.array_equal(one.model.q, other.model.q) and np.array_equal(one.model.v, other.model.v)


# There and back -------------------------------------------------------------------------------------------------------


def test_no_effect_is_forgotten():
    assert set(EVERY) == set(KINDS) - {"Loop"} and len(EVERY) == 24  # of a model with loops: test_kept_loops.py


@pytest.mark.parametrize("name", EVERY)
def test_every_effect(arm, tmp_path, name):
    """Every parameter that is not at its default reads back as it was, by file, data and JSON."""
    effect = EVERY[name]()
    scene = pc.Scene(arm).add(effect)
    scene.save(tmp_path / "scene.toml", model="panda")
    again = pc.load_scene(tmp_path / "scene.toml")
    same_numbers(scene, again)
    same_numbers(scene, pc.Scene.from_dict(json.loads(json.dumps(scene.to_dict()))))
    (read,) = again.effects.values()
    assert type(read) is type(effect) and read.to_dict() == effect.to_dict() | {}
    of_the_model = ("FluidDrag", "Gravity", "GravityCompensation", "Limits", "Servo")  # which take their values from it
    assert any(field.default is MISSING for field in fields(effect)) or name in of_the_model


def test_a_whole_scene(arm, tmp_path):
    state = arm.random_state(4)
    arm.q, arm.v = state.q, 0.1 * state.v
    scene = pc.Scene(arm, form="ud", refine=1, residual="wider", precision="double")
    for name, made in EVERY.items():
        scene.add(made(), name=f'the {name.lower()} "it" has')
    scene.add(E.Damping(0.3, hinges=arm.hinges["panda_joint6"]), E.Gravity()).disable("gravity", 'the fixman "it" has')
    scene.run_options = {"T": 2.5, "integrator": "dop853", "rtol": 1e-10, "every": 0.1}
    scene.save(tmp_path / "named.toml", model="panda")
    same_numbers(scene, pc.load_scene(tmp_path / "named.toml"))
    scene.save(tmp_path / "whole.toml")
    again = pc.load_scene(tmp_path / "whole.toml")
    same_numbers(scene, again)
    again.save(tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_text() == (tmp_path / "whole.toml").read_text()
    same_numbers(scene, copy.deepcopy(scene))
    assert pickle.loads(pickle.dumps(scene)).run_options == scene.run_options


def test_what_a_person_writes(tmp_path):
    """Effects by either name, a model by a path beside the file, nothing that is at its default."""
    pc.chain(3, seed=1).save(tmp_path / "arm.toml")
    (tmp_path / "scene.toml").write_text(
        'model = "arm.toml"  # beside this file\n\n[[effects]]\neffect = "gravity"\ng = [0, -9.81, 0]\n\n'
        '[[effects]]\neffect = "coulomb_friction"\nname = "rust"\nlevel = { hinge0 = 0.5, hinge2 = 0.1 }\non = false\n'
    )
    scene = pc.load_scene(tmp_path / "scene.toml")
    assert str(scene).splitlines()[1:] == [
        "  on  gravity: Gravity(g=[0, -9.81, 0])", "  off rust: CoulombFriction(level={'hinge0': 0.5, 'hinge2': 0.1})",
    ]  # fmt: skip
    same_numbers(
        pc.Scene(pc.chain(3, seed=1))
        .add(E.Gravity(g=(0, -9.81, 0)))
        .add(E.CoulombFriction([0.5, 0.1], hinges=["hinge0", "hinge2"]), name="rust")
        .disable("rust"),
        scene,
    )


def test_what_is_written(arm, tmp_path):
    """Defaults are left out; a table within an effect is on its line."""
    scene = (
        pc.Scene(arm)
        .add(E.Gravity(), E.Damping({"panda_joint1": 0.5}))
        .add(E.TorqueSource(E.Harmonic(1.0, 2.0)), name="hum")
        .disable("hum")
    )
    scene.save(tmp_path / "scene.toml", model="panda")
    assert (tmp_path / "scene.toml").read_text() == (
        '# A scene of PyCraft: SI units and radians. docs/scenes.md, Files, says what the keys mean.\n\nformat = 1\nmodel = "panda"\n\n'
        '[[effects]]\neffect = "Gravity"\nname = "gravity"\n\n[[effects]]\neffect = "Damping"\nname = "damping"\n'
        'coefficient = { panda_joint1 = 0.5 }\n\n[[effects]]\neffect = "TorqueSource"\nname = "hum"\non = false\n'
        'torque = { in_time = "Harmonic", amplitude = 1, frequency = 2, phase = 0, offset = 0 }\n'
    )


def test_models_are_named_or_inline(tmp_path):
    free = pc.robots.a1(root="fixed")
    scene = pc.Scene(free).add(E.Gravity())
    for model in ({"robot": "a1", "root": "fixed"}, None):
        scene.save(tmp_path / "scene.toml", model=model)
        same_numbers(scene, pc.load_scene(tmp_path / "scene.toml"))
    (tmp_path / "models").mkdir()
    free.save(tmp_path / "models" / "dog.toml", state=False)
    scene.save(tmp_path / "scene.toml", model="models/dog.toml")  # relative to the scene's file
    same_numbers(scene, pc.load_scene(tmp_path / "scene.toml"))
    assert "models/dog.toml" in (tmp_path / "scene.toml").read_text()


def test_every_kind_of_hinge_inline(tmp_path):
    model = every_kind()
    state = model.random_state(3)
    model.q, model.v = state.q, state.v
    scene = pc.Scene(model, precision="quad").add(E.Gravity(), E.Damping(0.1))
    scene.save(tmp_path / "scene.toml")
    same_numbers(scene, pc.load_scene(tmp_path / "scene.toml"))


def test_one_that_is_off_may_claim_what_another_claims(arm, tmp_path):
    scene = pc.Scene(arm).add(E.Prescribed("panda_joint1", 0.1)).disable("prescribed").add(E.Prescribed("panda_joint1", 0.2))
    scene.save(tmp_path / "scene.toml", model="panda")
    same_numbers(scene, pc.load_scene(tmp_path / "scene.toml"))


# What cannot be written -----------------------------------------------------------------------------------------------


def test_functions_are_refused_by_name(arm, tmp_path):
    scene = pc.Scene(arm).add(lambda t, state: np.zeros(7), name="push").add(E.Sampled(lambda t, state: np.zeros(7), 0.1), E.Gravity())
    scene.add(E.Prescribed("panda_joint5", np.sin), name="sway")
    text = (
        "a file cannot hold Python functions or classes, as in 'push' (UserEffect), 'sampled' (Sampled), 'sway' (Prescribed): give values "
        "over time as pc.effects.Table, Spline or Harmonic; remove the other effects before saving, and add them again after loading"
    )
    with pytest.raises(pc.ModelError, match=re.escape(text)):
        scene.save(tmp_path / "scene.toml")
    assert not (tmp_path / "scene.toml").exists()
    scene.remove("push", "sampled", "sway").save(tmp_path / "scene.toml")


@pytest.mark.parametrize(
    ("save", "text"),
    [
        (lambda s, p: s.save(p / "scene.json"), "scene.json: the file of a scene must end in .toml"),
        (lambda s, p: s.save(p / "none" / "scene.toml"), "scene.toml: cannot be written: No such file or directory"),
        (lambda s, p: s.save(3.5), "a scene is saved at the path of a file, not at 3.5"),
        (lambda s, p: s.save(p / "scene.toml", model="ur5"), "model='ur5' is not the model of this scene, 'panda': they differ"),
        (lambda s, p: s.save(p / "scene.toml", model="pandda"), "no robot of the package is called 'pandda'; did you mean 'panda'?"),
        (lambda s, p: s.save(p / "scene.toml", model=p / "none.toml"), "none.toml: cannot be read: No such file or directory"),
        (lambda s, p: s.to_dict(model={"robot": "panda", "rot": "free"}), "a reference to a model has no key 'rot'; did you mean 'root'?"),
        (
            lambda s, p: s.to_dict(model={"robot": "panda", "mimic": "lock"}),
            "mimic applies only to files; no robot of the package has a joint",
        ),
        (lambda s, p: s.to_dict(model={}), 'a scene names its model by a path, "arm.toml", or a robot of the package, "panda"'),
    ],
)
def test_refusals_of_writing(arm, tmp_path, save, text):
    with pytest.raises(pc.ModelError, match=re.escape(text)):
        save(pc.Scene(arm), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_run_options(arm):
    scene = pc.Scene(arm)
    assert scene.run_options == {}
    with pytest.raises(pc.ModelError, match="run_options has no 'rtoll'; did you mean 'rtol'"):
        scene.run_options = {"rtoll": 1}
    with pytest.raises(pc.ModelError, match="run_options must be a dictionary with some of T, integrator"):
        scene.run_options = 3
    assert scene.run_options == {}


# What a file gets wrong -----------------------------------------------------------------------------------------------

HEAD = 'model = "panda"\n'
ENTRY = f"{HEAD}[[effects]]\n"


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 1, 'the scene has no model; name one: model = "panda", model = "arm.toml", or write it as tables, [[model.bodies]]'),
        ('model = "pandda"', 1, "the model of a scene: no robot of the package is called 'pandda'; did you mean 'panda'?"),
        ('\nmodel = "arm.urdf"', 2, "the model of a scene: "),
        ("model = 3", 1, "the model of a scene: a scene names its model by a path"),
        ('[model]\nbodis = []', 2, "the model has no key 'bodis'; did you mean 'bodies'?"),
        ('[[model.bodies]]\nname = "a"\nmass = "heavy"', 3, "body 'a': mass = 'heavy'; write a finite number, in kg"),
        (HEAD + "effect = []", 2, "a scene has no key 'effect'; did you mean 'effects'?"),
        (HEAD + "effects = 3", 2, "a scene: effects = 3; write a list of tables: [[effects]]"),
        (HEAD + "format = 2", 2, "format = 2 is not read by this version of pycraft, which reads 1"),
        (HEAD + 'form = "fst"', 2, "a scene: no form of the articulated-inertia sweep is called 'fst'"),
        (HEAD + "refine = 1.5", 2, "a scene: refine=1.5"),
        (HEAD + 'precision = "half"', 2, "a scene: "),
        (HEAD + "[state.q]\npanda_joint9 = 1", 3, "q of the state: no hinge is called 'panda_joint9'; did you mean 'panda_joint7'?"),
        (HEAD + "[run]\nT = -1", 3, "the run: T = -1; it must be positive, in seconds"),
        (HEAD + "[run]\nTime = 1", 3, "the run has no key 'Time'; "),
        (HEAD + '[run]\nintegrator = "rk5"', 3, "the run: integrator = 'rk5'; did you mean 'rk4'?"),
        (ENTRY + "coefficient = 1", 2, 'effect number 1 names no effect; add its kind, such as effect = "Damping"'),
        (ENTRY + 'effect = "Dampnig"', 3, "effect number 1: no effect is called 'Dampnig'; did you mean 'Damping'?"),
        (ENTRY + 'name = "wind"\neffect = "coulomb"', 4, "effect 'wind': no effect is called 'coulomb'; did you mean 'coulomb_friction'?"),
        (ENTRY + 'effect = "Sampled"', 3, "effect number 1: effect 'Sampled' calls a Python function, which a file cannot hold; add it"),
        (ENTRY + 'effect = "Damping"', 2, "effect 'damping' (Damping) needs coefficient; write coefficient = ..."),
        (ENTRY + 'effect = "Damping"\ncoeff = 1', 4, "effect 'damping' (Damping) has no key 'coeff'; did you mean 'coefficient'?"),
        (ENTRY + 'effect = "Damping"\ncoefficient = "much"', 4, "effect 'damping': damping: coefficient is not an array of numbers"),
        (ENTRY + 'effect = "Damping"\ncoefficient = nan', 4, "effect 'damping': damping: coefficient has an entry that is nan"),
        (ENTRY + 'effect = "Damping"\non = 1\ncoefficient = 1', 4, "effect number 1: on = 1; write true or false"),
        (
            ENTRY + 'effect = "Spring"\nname = "coil"\nstiffness = 1\nhinges = "panda_jiont4"', 6,
            "effect 'coil': spring: no hinge or coordinate of 'panda' is called 'panda_jiont4'; did you mean 'panda_joint4'",
        ),
        (ENTRY + 'effect = "Limits"\nstiffness = 1\nlower = 1\nupper = 0', 5, "the lower one, 1, lies above the upper"),
        (ENTRY + 'effect = "TorqueSource"\ntorque = { in_time = "Harmonik" }', 4, "torque: in_time = 'Harmonik'; did you mean 'Harmonic'?"),
        (
            ENTRY + 'effect = "TorqueSource"\ntorque = { in_time = "Harmonic", amplitude = 1 }', 4,
            "effect 'torque_source': torque, a Harmonic, needs frequency; write frequency = ...",
        ),
        (ENTRY + 'effect = "TorqueSource"\ntorque = { in_time = "Table", times = [0], values = [1] }', 4, "at least two times"),
        (ENTRY + 'effect = "Gravity"\n[[effects]]\nname = "gravity"\neffect = "Gravity"', 5, "has an effect 'gravity' already"),
        (
            ENTRY + 'effect = "Prescribed"\nhinge = "panda_joint1"\nmotion = 1\n[[effects]]\nname = "again"\neffect = "Prescribed"\n'
            'hinge = "panda_joint1"\nmotion = 2', 7, "effects 'prescribed' and 'again' both prescribe coordinate 'panda_joint1' of 'panda'",
        ),
        (HEAD + "effects = [", 3, "not well-formed TOML"),
    ],
)  # fmt: skip
def test_errors_of_files(tmp_path, text, line, message):
    path = tmp_path / "scene.toml"
    path.write_text(text + "\n")
    with pytest.raises(pc.ModelError) as caught:
        pc.load_scene(path)
    assert str(caught.value).startswith(f"{path}:{line}: ") and message in str(caught.value)


def test_errors_of_data(arm):
    data = pc.Scene(arm).add(E.Gravity(), E.Damping(1.0)).to_dict(model="panda")
    data["effects"][1]["coefficient"] = "much"
    with pytest.raises(pc.ModelError, match=re.escape("a scene's data, effects[1].coefficient: effect 'damping': damping: coefficient")):
        pc.Scene.from_dict(data)
    with pytest.raises(pc.ModelError, match="a scene's data: a scene is a table, not 3"):
        pc.Scene.from_dict(3)


def test_a_file_of_the_other_kind(arm, tmp_path):
    pc.Scene(arm).save(tmp_path / "scene.toml", model="panda")
    with pytest.raises(pc.ModelError, match="this is the file of a scene; pycraft.load_scene reads it"):
        pc.load(tmp_path / "scene.toml")
    arm.save(tmp_path / "arm.toml")
    with pytest.raises(pc.ModelError, match="a scene has no key 'name'"):
        pc.load_scene(tmp_path / "arm.toml")


def test_the_file_of_the_page_is_read(tmp_path):
    """docs/scenes.md shows one with all that a file may have."""
    page = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text()
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    arm = pc.Multibody("arm")
    arm.add_body("upper", hinge_name="shoulder", axis=(0, 1, 0), mass=1.0, com=(0, 0, 0.5), inertia=np.eye(3))
    arm.add_body("lower", "upper", hinge_name="elbow", axis=(0, 1, 0), position=(0, 0, 1), mass=1.0, com=(0, 0, 0.5), inertia=np.eye(3))
    arm.save(tmp_path / "arm.urdf")
    (tmp_path / "scene.toml").write_text(text)
    scene = pc.load_scene(tmp_path / "scene.toml")
    assert repr(scene) == "<scene of 'arm': gravity, (grease off), torque_source>" and scene._how[0] == "ud"
    assert scene.run_options == {"T": 10, "rtol": 1e-8} and scene.model.q.tolist() == [0.5, 0.0]
