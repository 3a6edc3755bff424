"""Every robot of example-robot-data against Pinocchio, fixed and floating; the full run with its table is `pycraft peers`."""

import pytest

pytest.importorskip("pinocchio")

from pycraft.peers import peers

pytestmark = pytest.mark.peers

FILES = peers.robot_files()
# What is not compared, and why: everything else must be.
REFUSED = {
    "quadrotor_base": "no degrees of freedom",
    "iris_simple": "no degrees of freedom",
    "romeo_laas_small": "an inertia is positive semidefinite",
    "tiago": "an inertia is positive semidefinite",
    "tiago_dual": "an inertia is positive semidefinite",
    "tiago_no_hand": "an inertia is positive semidefinite",
    "ur3": "has no links",
}


def test_the_list_is_whole():
    assert len(FILES) >= 60
    assert {"panda", "ur5_robot", "talos_full_v2", "g1_29dof_rev_1_0", "icub", "simple_humanoid"} <= {f.stem for f in FILES}


@pytest.mark.parametrize("root", ["fixed", "free"])
@pytest.mark.parametrize("path", FILES, ids=[f"{f.parent.parent.name}-{f.stem}" for f in FILES])
def test_robot(path, root):
    result = peers.compare(path, root, states=5, seed=1)
    if result.refused:
        assert path.stem in REFUSED and REFUSED[path.stem] in result.refused, result.refused
        return
    assert result.states == 5
    compared = set(peers.QUANTITIES) - ({"inverse", "forward dynamics"} if result.singular else set())
    assert set(result.ratio) == compared
    assert result.passed, (result.ratio, result.settled)
    assert not result.singular or path.stem.startswith("romeo"), result.singular


def test_the_table_tells_all():
    results = [peers.compare(path, "fixed", states=1) for path in FILES[:6]]
    text = peers.markdown(results, 1)
    for r in results:
        assert f"{r.robot} " in text
