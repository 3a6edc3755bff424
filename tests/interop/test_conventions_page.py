"""docs/conventions.md: what its code converts is the same motion, seen by differences of poses and by the packages themselves."""

import re
from pathlib import Path

import numpy as np
import pytest

import pycraft as pc

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8")


def converters():
    """`to_rbdl` and `to_drake` as the page has them."""
    names = {"np": np}
    for block in re.findall(r">>> (def to_\w+\(.*\n(?:\.\.\. .*\n)+)", PAGE):
        exec(block.replace("... ", ""), names)
    return names["to_rbdl"], names["to_drake"]


@pytest.mark.parametrize("seed", range(5))
def test_the_velocities_of_rbdl_and_drake_are_rates_of_the_base(seed):
    """RBDL: v in world axes, ω in the body's; Drake: both in world axes. Central differences of the pose."""
    to_rbdl, to_drake = converters()
    robot = pc.robots.a1()
    state = robot.random_state(seed=seed)
    q, v = state.q, state.v
    h = 1e-6
    ahead, behind = (robot.pose("trunk", robot.integrate(q, s * h * v)) for s in (1, -1))
    R = robot.pose("trunk", q)[:3, :3]
    rate = (ahead - behind) / (2 * h)
    spin = rate[:3, :3] @ R.T  # ω× in world axes
    world = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    # central differences are right to h² |v|³ and to eps / h
    close = {"atol": 1e-8, "rtol": 0}
    _, of_rbdl = to_rbdl(*pc.interop.mujoco.to_mujoco(robot, q, v))
    assert np.allclose(of_rbdl[:3], rate[:3, 3], **close) and np.allclose(R @ of_rbdl[3:6], world, **close)
    _, of_drake = to_drake(q, v, R)
    assert np.allclose(of_drake[:3], world, **close) and np.allclose(of_drake[3:6], rate[:3, 3], **close)
    assert np.array_equal(of_drake[6:], v[6:]) and np.array_equal(of_rbdl[6:], v[6:])


def test_the_quaternion_of_rbdl_stands_at_the_end():
    to_rbdl, _ = converters()
    robot = pc.robots.a1()
    q = robot.random_state(seed=1).q
    q_rbdl, _ = to_rbdl(*pc.interop.mujoco.to_mujoco(robot, q, np.zeros(robot.nv)))
    assert np.array_equal(q_rbdl, [*q[4:7], *q[1:4], *q[7:], q[0]])


@pytest.mark.peers
def test_the_block_of_pinocchio(tmp_path, monkeypatch):
    pytest.importorskip("pinocchio")
    monkeypatch.chdir(tmp_path)
    Path("a1.urdf").write_text((ROOT / "pycraft" / "models" / "robots" / "a1.urdf").read_text())
    robot = pc.robots.a1()
    block = re.search(r"```python\n(import pinocchio.*?)```", PAGE, re.S).group(1)
    exec(compile(block, "conventions.md", "exec"), {"pc": pc, "np": np, "robot": robot, "q": robot.random_state(seed=2).q})


@pytest.mark.peers
def test_the_gravity_of_the_packages():
    pinocchio, mujoco = pytest.importorskip("pinocchio"), pytest.importorskip("mujoco")
    row = re.search(r"\| default gravity.*", PAGE).group(0)
    assert row.split("|")[2].strip() == "zero" and not pc.chain(1).gravity.any()
    assert row.split("|")[3].strip() == "(0, 0, -9.81)" and np.array_equal(pinocchio.Model().gravity.linear, [0, 0, -9.81])
    assert np.array_equal(mujoco.MjModel.from_xml_string("<mujoco/>").opt.gravity, [0, 0, -9.81])
