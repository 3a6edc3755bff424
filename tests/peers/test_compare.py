"""`pc.compare`: what differs between two models of one robot is said, and what is left in common coordinates is rounding."""

import copy
from importlib.resources import files

import numpy as np
import pytest

import pycraft as pc

PANDA = files("pycraft.models") / "robots" / "panda.urdf"
EVERY_KIND = ["free", "pin", "ball", "slider", "planar", "universal", "gimbal", "cylindrical", "custom", "screw"]


def tree(kinds, **options):
    model = pc.tree([-1, *range(len(kinds) - 1)], kinds, seed=3, **options)
    model.gravity = (1.0, 2.0, -9.0)
    return model


def kinds_said(report):
    return [d.kind for d in report.differences]


def test_a_file_beside_its_model():
    report = pc.compare(pc.robots.panda(), PANDA)
    assert report and report.worst == 0 and not report.differences
    assert "No difference found." in repr(report) and "the same robot" in repr(report)


def test_a_toml_file_beside_its_model(tmp_path):
    """It says itself that the root flies."""
    robot = pc.robots.a1()
    robot.save(tmp_path / "a1.toml")
    assert pc.compare(robot, tmp_path / "a1.toml").worst == 0


def test_other_orders_are_converted():
    model, other = (pc.Multibody("two arms") for _ in range(2))
    for name in "ab":
        model.add_body(name, mass=1.0 + (name == "a"), com=(0, 0.1, 0.2), inertia=np.eye(3), hinge_name=name)
    for name in "ba":
        other.add_body(name, mass=1.0 + (name == "a"), com=(0, 0.1, 0.2), inertia=np.eye(3), hinge_name=name)
    for arm in (model, other):
        arm.hinges["a"].rotor_inertia, arm.hinges["b"].rotor_inertia = 0.1, 0.7
    report = pc.compare(model, other)
    assert report and kinds_said(report) == ["order"] and "first comes a here, b there" in repr(report)
    assert report.as_they_are["mass matrix"] > 1e-3 > 1e-14 > report.worst


CHANGES = {
    "gravity": (lambda m: setattr(m, "gravity", (0, 0, -1.6)), True),
    "rotor inertia": (lambda m: setattr(m.hinges["hinge1"], "rotor_inertia", 0.25), True),
    "mass": (lambda m: setattr(m.bodies["body2"], "mass", 9.0), False),
    "centre of mass": (lambda m: setattr(m.bodies["body2"], "com", m.bodies["body2"].com + [0, 0, 1e-3]), False),
    "inertia": (lambda m: setattr(m.bodies["body1"], "inertia", 1.001 * m.bodies["body1"].inertia), False),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_was_changed_is_said(change):
    """Gravity and rotor inertia are effects: said, and made the same. Masses and inertias make another robot."""
    model = tree(["pin", "slider", "ball", "planar"])
    other = copy.deepcopy(model)
    edit, same_after_that = CHANGES[change]
    edit(other)
    report = pc.compare(model, other)
    assert change in kinds_said(report) and all(d.physical for d in report.differences)
    assert bool(report) == same_after_that and max(report.as_they_are.values()) > 1e-5
    assert ("NOT the same robot" in repr(report)) == (not same_after_that)


def test_a_placement_that_differs_moves_all_that_is_outboard():
    model = tree(["pin", "slider", "ball"])
    other = copy.deepcopy(model)
    X = other.hinges["hinge1"].placement.copy()
    X[:3, 3] += [0, 0.01, 0]
    other.hinges["hinge1"].placement = X
    report = pc.compare(model, other)
    assert not report and {"geometry", "body frame"} & set(kinds_said(report))
    assert any("body1" in d.text for d in report.differences)


def test_what_cannot_be_compared():
    model = tree(["pin", "slider"])
    with pytest.raises(pc.ModelError, match="hinges hinge2 are in one of"):
        pc.compare(model, tree(["pin", "slider", "pin"]))
    with pytest.raises(pc.ModelError, match="hinge 'hinge1' is a slider in .* and a pin in the other"):
        pc.compare(model, tree(["pin", "pin"]))
    with pytest.raises(pc.ModelError, match="compare takes a pinocchio.Model, a mujoco.MjModel, .* not ndarray"):
        pc.compare(model, np.eye(3))
    with pytest.raises(pc.ModelError, match="the first model of compare must be a Multibody, not int"):
        pc.compare(3, model)


@pytest.mark.peers
@pytest.mark.parametrize("rotors", [False, True])
def test_every_hinge_in_pinocchio(rotors):
    from pycraft.interop import export

    model = tree(EVERY_KIND, rotor_inertia=rotors)
    made = export.to_pinocchio(model)
    report = pc.compare(model, made)
    assert repr(report) == repr(pc.compare(model, made.model))
    assert report and {d.kind for d in report.differences} - {"rotor inertia"} == {"quaternion", "free joints", "body frame"}
    left_out = [d.text for d in report.differences if d.kind == "rotor inertia"]
    assert bool(left_out) == rotors and all("left out of what is compared" in text for text in left_out)
    assert report.in_common["mass matrix"] < 2e-14 and report.in_common["inverse dynamics"] < 2e-14 < report.as_they_are["mass matrix"]


@pytest.mark.peers
def test_pinocchios_own_conventions():
    """Planar joints with velocities in the body's axes, continuous joints by cosine and sine, joints by the alphabet."""
    import pinocchio as pin

    model, peer = pc.Multibody("cart"), pin.Model()
    joint = peer.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "base")
    peer.appendBodyToJoint(joint, pin.Inertia(3.0, np.array([0.1, 0.2, 0.0]), np.diag([1.0, 2.0, 2.5])), pin.SE3.Identity())
    joint = peer.addJoint(joint, pin.JointModelRUBZ(), pin.SE3(np.eye(3), np.array([0.5, 0, 0])), "wheel")
    peer.appendBodyToJoint(joint, pin.Inertia(1.0, np.array([0.0, 0.1, 0.0]), np.diag([0.1, 0.2, 0.25])), pin.SE3.Identity())
    model.add_body("cart", hinge="planar", hinge_name="base", axis=(0, 0, 1), mass=3.0, com=(0.1, 0.2, 0), inertia=np.diag([1, 2, 2.5]))
    model.add_body(
        "rim",
        "cart",
        hinge_name="wheel",
        axis=(0, 0, 1),
        position=(0.5, 0, 0),
        mass=1.0,
        com=(0, 0.1, 0),
        inertia=np.diag([0.1, 0.2, 0.25]),
    )
    report = pc.compare(model, peer)
    assert report and report.worst < 2e-14 and kinds_said(report) == ["joint", "joint", "gravity"], report


@pytest.mark.peers
def test_every_hinge_of_mujoco():
    import mujoco

    from pycraft.interop import export

    model = pc.tree([-1, 0, 1, 1, 0, 2], ["free", "pin", "ball", "slider", "planar", "universal"], seed=3)
    model.gravity = (1.0, 2.0, -9.0)
    compiled = mujoco.MjModel.from_xml_string(export.to_mjcf(model))
    report = pc.compare(model, compiled)
    assert report and kinds_said(report) == ["free joints"] and report.in_common["mass matrix"] < 2e-14 < report.as_they_are["mass matrix"]
    compiled.dof_damping[:] = 0.1
    report = pc.compare(model, compiled)
    assert not report and report.differences[-1][:2] == (
        "damping",
        f"{model.coordinate_names[0]}: 0 here, 0.1 there; " + report.differences[-1].text.split("; ", 1)[1],
    )
    compiled.dof_damping[:] = 0.0
    model.bodies["body2"].mass *= 2
    report = pc.compare(model, compiled)
    assert not report and "mass" in kinds_said(report)
    with pytest.raises(pc.ModelError, match="has no joint in MuJoCo's model"):
        pc.compare(tree(["pin", "slider"]), mujoco.MjModel.from_xml_string("<mujoco/>"))


def two_links(turn=None, axis=(0.0, 1.0, 0.0), mass=2.0):
    """A pin and a slider of the same motion, the last body's frame turned."""
    model = pc.Multibody("two links")
    turn = np.eye(3) if turn is None else turn
    inertia = np.array([[0.5, 0.02, 0.01], [0.02, 0.4, 0.03], [0.01, 0.03, 0.3]])
    model.add_body("upper", mass=1.0, axis=(0, 0, 1), com=(0.1, 0, 0.2), inertia=np.eye(3))
    model.add_body(
        "lower", "upper", axis=turn.T @ axis, position=(0.3, 0, 0.1), rotation=turn,
        mass=mass, com=turn.T @ (0.1, 0.2, 0.3), inertia=turn.T @ inertia @ turn,
    )  # fmt: skip
    return model


def test_a_frame_that_is_turned_is_a_convention():
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    report = pc.compare(two_links(), two_links(turn * np.linalg.det(turn)))
    assert report and kinds_said(report) == ["body frame"] and not report.differences[0].physical


def test_small_differences_are_differences():
    assert kinds_said(pc.compare(two_links(), two_links(mass=2.00001))) == ["mass"]
    report = pc.compare(two_links(), two_links(axis=(1e-4, 1.0, 0.0)))
    assert not report and kinds_said(report) == ["geometry"] and report.differences[0].physical


def test_the_worst_of_all_states_is_reported():
    heavier, lighter = two_links(mass=2.5), two_links()
    for seed in range(6):
        one, five = (pc.compare(lighter, heavier, states=states, seed=seed).in_common["mass matrix"] for states in (1, 5))
        assert five >= one


def test_what_they_are_is_shown_before_gravity_is_the_same():
    other = two_links()
    other.gravity = (0, 0, -9.81)
    report = pc.compare(two_links(), other)
    assert report and report.as_they_are["forward dynamics"] > 1e-3 > 1e-13 > report.in_common["forward dynamics"]


def test_forward_dynamics_may_lose_what_the_mass_matrix_is_conditioned_by():
    model = two_links(mass=2000.0)
    report = pc.compare(model, copy.deepcopy(model), states=1)
    condition = np.linalg.cond(model.mass_matrix(model.random_state(np.random.default_rng(0)).q))
    rounding = 100 * model.nv * np.finfo(float).eps
    assert condition > 2 and report.bounds["mass matrix"] == report.bounds["inverse dynamics"] == rounding
    assert report.bounds["forward dynamics"] / rounding == pytest.approx(condition, rel=1e-9)
