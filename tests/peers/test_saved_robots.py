"""Every robot of example-robot-data through our files: TOML bit for bit, URDF to rounding."""

import numpy as np
import pytest

import pycraft as pc

pytest.importorskip("pinocchio")

from pycraft.peers import peers
from support.saved_models import loaded, lost, saved_and_loaded

pytestmark = pytest.mark.peers

FILES = peers.robot_files()


@pytest.mark.parametrize("path", FILES, ids=[f"{f.parent.parent.name}-{f.stem}" for f in FILES])
def test_robot(path, tmp_path):
    try:
        robot = loaded(path, root="free", mimic="lock")
    except pc.ModelError:
        pytest.skip("not read: tests/peers/test_peers.py says why")
    assert lost(robot, tmp_path / "robot.toml") == []
    again = saved_and_loaded(robot, tmp_path / "robot.urdf")
    assert again.coordinate_names == robot.coordinate_names
    q = robot.random_state(0).q
    ours, theirs = robot.mass_matrix(q), again.mass_matrix(q)
    assert np.abs(ours - theirs).max() <= 1e-13 * robot.nv * np.abs(ours).max()
