"""Calls of other packages timed by `pycraft bench --peers` compute the same as ours: every call, on arms, a free base and a chain."""

import sys

import numpy as np
import pytest

pytest.importorskip("pinocchio")

import pycraft as pc
from pycraft.interop.packages import MissingPackageError
from pycraft.interop.peer import PeerRefusal
from pycraft.peers import peer_calls, speed, timed_models

pytestmark = pytest.mark.peers

MODELS = {"panda": pc.robots.panda, "g1": pc.robots.g1, "chain": lambda: timed_models.chain_of_machines(12)}
PACKAGES = {"pinocchio": peer_calls.PinocchioCalls, "mujoco": peer_calls.MuJoCoCalls, "pydrake": peer_calls.DrakeCalls}


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("package", PACKAGES)
def test_every_call_is_the_same(package, name):
    pytest.importorskip(package)
    model = MODELS[name]()
    model.gravity = (0, 0, -9.81)
    own = speed.OwnCalls(model, speed.states_of(model))
    try:
        theirs = PACKAGES[package](model).calls(own.q, own.v, own.u, own.X)
    except PeerRefusal:
        assert (package, name) == ("pydrake", "g1")
        return
    least = {
        "pinocchio": set(speed.GOALS),
        "mujoco": {"forward_dynamics", "inverse_dynamics", "mass_matrix", "mass_matrix_inverse_product"},
    }
    assert set(theirs) == least.get(package, {"forward_dynamics", "inverse_dynamics", "mass_matrix"})
    assert "operational_space_inertia_of_two" not in own.calls or name == "g1"
    for call, other in theirs.items():
        other.run()
        if call not in own.calls:
            continue
        assert speed._checked(name, call, own.run(call), other.value(), package) < 1e-10, call


def test_joints_about_coordinate_axes_are_the_fast_ones():
    twin = peer_calls.PinocchioCalls(timed_models.chain_of_machines(3)).model
    assert [joint.shortname() for joint in twin.joints[1:]] == ["JointModelRY", "JointModelRX", "JointModelRZ"]


def test_time_in_cpp():
    model = pc.robots.g1()
    states = speed.states_of(model)
    package = peer_calls.PinocchioCalls(model)
    clock, count = package.in_cpp("forward_dynamics", *states)
    assert count == peer_calls.ONE_THREAD and 0 < clock(0.001)["minimum"]
    assert package.in_cpp("mass_matrix", *states) is None
    for call in speed.GOALS:
        package.bindings(call)()


def test_what_a_package_does_not_take():
    with pytest.raises(PeerRefusal, match="its work space of 1000 coordinates takes 60 GB"):
        peer_calls.PinocchioCalls(timed_models.chain_of_machines(1000))
    with pytest.raises(PeerRefusal, match="MuJoCo has no screw"):
        peer_calls.MuJoCoCalls(pc.chain(2, "screw", seed=1))


def test_what_is_not_installed_is_said(monkeypatch):
    found = peer_calls.find_spec
    monkeypatch.setattr(peer_calls, "find_spec", lambda name: None if name in ("mujoco", "pydrake") else found(name))
    said = []
    assert peer_calls.other_packages(said.append) == [peer_calls.PinocchioCalls]
    assert said[0] == "MuJoCo: not installed: pip install 'pycraft-soa[peers]'" and said[1] == "Drake: not installed: pip install drake"
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    with pytest.raises(MissingPackageError, match="pip install 'pycraft-soa\\[peers\\]'"):
        peer_calls.other_packages(said.append)


def test_robots_of_example_robot_data():
    try:
        timed_models.robot_files()
    except pc.ModelError:
        pytest.skip("example-robot-data is not installed")
    said = []
    models = timed_models.timed_models(False, said.append)
    sizes = {name: model.nv for name, model in (next(models) for _ in range(5))}
    assert sizes == {"UR5": 6, "Panda": 7, "ANYmal": 18, "Talos": 50, "G1": 35} and not said
    assert np.allclose(timed_models.AXES @ timed_models.AXES.T, np.eye(3))
