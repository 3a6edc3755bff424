"""Models handed to Pinocchio, MuJoCo and Drake: their forward dynamics on our coordinates agree with ours on benign models."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.interop import export
from support.rotors import gyroscopic

pytestmark = pytest.mark.peers

INSTALLED = export.installed()
KINDS = ("pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free", "custom")
# Benign: masses, lengths and axes drawn between 0.5 and 3, at most 8 bodies; cond(ℳ) stays below 1e5, and each side may lose it.
AGREE = 1e-10


def compare(model, name, states=5):
    peer = INSTALLED[name](model)
    rng = np.random.default_rng(1)
    for _ in range(states):
        state, tau = model.random_state(rng), rng.normal(size=model.nv)
        left_out = gyroscopic(model, state.v) if name == "Pinocchio" else 0.0  # which has no v ×* (J v) of rotors
        expected = model.forward_dynamics(state.q, state.v, tau + left_out, precision="quad")
        error = np.linalg.norm(peer.forward_dynamics(state.q, state.v, tau) - expected) / np.linalg.norm(expected)
        assert error < AGREE, f"{peer.name}: {error:.1e}"


def test_the_extra_peers_has_two():
    assert {"Pinocchio", "MuJoCo"} <= set(INSTALLED)


@pytest.mark.parametrize("rotors", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_every_hinge_in_pinocchio(kind, rotors):
    kinds = ["pin", kind, "pin", kind, "slider"]
    model = pc.tree([-1, 0, 1, 1, 3], kinds, seed=2, rotor_inertia=rotors)
    model.gravity = (0.3, -1.2, -9.81)
    compare(model, "Pinocchio")


@pytest.mark.parametrize("kind", KINDS)
def test_every_hinge_of_mujoco(kind):
    base = ["free", "pin"] if kind == "free" else [kind, "pin"]
    model = pc.tree([-1, 0, 1, 1, 3], [*base, "pin" if kind == "free" else kind, "slider", "pin"], seed=3)
    model.gravity = (0.3, -1.2, -9.81)
    if kind == "screw":
        with pytest.raises(export.PeerRefusal, match="no screw: hinge 'hinge0'"):
            INSTALLED["MuJoCo"](model)
    else:
        compare(model, "MuJoCo")


@pytest.mark.parametrize("name", INSTALLED)
@pytest.mark.parametrize("kinds", [["pin"] * 5, ["pin", "slider", "screw", "pin", "slider"]], ids=["pins", "mixed"])
def test_one_coordinate_hinges_everywhere(name, kinds):
    kinds = ["pin" if name == "MuJoCo" and kind == "screw" else kind for kind in kinds]
    model = pc.tree([-1, 0, 0, 1, 2], kinds, seed=5, rotor_inertia=True)
    model.gravity = (0.3, -1.2, -9.81)
    compare(model, name)


@pytest.mark.parametrize("name", ["Pinocchio", "MuJoCo"])
def test_kept_welds(name):
    model = pc.tree([-1, 0, 1, 2], ["pin", "weld", "pin", "weld"], seed=6, welds="keep")
    compare(model, name)


@pytest.mark.parametrize("name", INSTALLED)
@pytest.mark.parametrize("robot", ["panda", "ur5", "a1"])
def test_robots_go_over(robot, name):
    model = getattr(pc.robots, robot)()
    if name == "Drake" and robot == "a1":
        pytest.skip("its base is free")
    compare(model, name, 2)


def test_refusals_are_kept_as_text():
    massless = pc.Multibody("massless tip")
    massless.add_body("a", mass=1.0, inertia=np.eye(3))
    massless.add_body("b", "a", position=(1, 0, 0))
    with pytest.raises(export.PeerRefusal, match="mjMINVAL"):
        INSTALLED["MuJoCo"](massless)
    floating = pc.tree([-1, 0], ["pin", "free"], seed=0)
    with pytest.raises(export.PeerRefusal, match="free joints on the base alone: hinge 'hinge1'"):
        INSTALLED["MuJoCo"](floating)
    uneven = pc.tree([-1], ["ball"], seed=0, rotor_inertia=True)
    with pytest.raises(export.PeerRefusal, match="one armature for all coordinates of ball hinge 'hinge0'"):
        INSTALLED["MuJoCo"](uneven)


def test_the_compiler_of_mujoco_changes_no_number():
    """Flat, thin and tiny bodies keep their masses and inertias: nothing balanced, bounded or taken from geometry."""
    import mujoco

    model = pc.Multibody("odd bodies")
    model.add_body("flat", mass=1e-9, com=(0.1, 0, 0), inertia=np.diag([1e-10, 2e-10, 3e-10]))
    model.add_body("heavy", "flat", "ball", position=(1 / 3, 0, 0), mass=1e12, com=(0.1, 1 / 7, 0), inertia=np.diag([1 / 3, 2 / 3, 1.0]))
    compiled = mujoco.MjModel.from_xml_string(export.to_mjcf(model))
    assert list(compiled.body_mass[1:]) == [1e-9, 1e12]
    assert list(compiled.body_inertia[2]) in ([1 / 3, 2 / 3, 1.0], [1.0, 2 / 3, 1 / 3])
    assert list(compiled.body_pos[2]) == [1 / 3, 0, 0] and list(compiled.body_ipos[2]) == [0.1, 1 / 7, 0]
