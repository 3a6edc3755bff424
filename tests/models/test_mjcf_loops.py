"""Loops written as equality constraints of MJCF: against MuJoCo's own rows of the file, and read back.

Rows of a loop come back in other axes: their lengths are compared, and Q*Q. Rounding: rotations go through quaternions and tree sums, as in
test_mjcf_equalities.py; 1e-12 of entries near one.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft.interop import mujoco as conventions

pytestmark = pytest.mark.peers
AGREE = 1e-12


def arm():
    """Pins, sliders, a ball and a free body, with a node turned and moved."""
    model = pc.tree([-1, 0, 1, 2, -1], ["pin", "slider", "pin", "ball", "free"], seed=5)
    model.add_node("eye", list(model.bodies)[3], position=(0.1, -0.2, 0.3), rotation=turned())
    return model


def turned():
    rng = np.random.default_rng(3)
    R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return R * np.linalg.det(R)


def with_loop(kind):
    model = arm()
    bodies = list(model.bodies)
    placement = np.eye(4)
    placement[:3, :3], placement[:3, 3] = turned().T, (0.3, 0.2, -0.1)
    if kind == "ball":
        model.add_loop("eye", bodies[4], "ball", point=(0.2, 0.1, 0.4), placement=placement, name="loop")
    elif kind == "gimbal on the base":
        model.add_loop("eye", None, "gimbal", axes=list(np.eye(3)), placement=placement, name="loop")
    elif kind == "weld":
        model.add_loop("eye", bodies[4], "weld", placement=placement, name="loop")
    elif kind == "weld of nodes":
        model.add_node("loop: a", bodies[4], position=(0, 1, 0))
        model.add_loop("eye", "loop: a", "weld", name="loop")
    elif kind == "gear":
        model.add_coupling({0: [0.1, 2.0], 1: [0.2, -3.0, 0.4, 0.1, -0.2]}, constant=0.3, name="loop")
    elif kind == "gear the other way round":
        model.add_coupling({0: [0.0, 2.0, 1.0], 1: -4.0}, name="loop")
    else:
        model.add_coupling({1: 2.0}, constant=-0.3, name="loop")
    return model


KINDS = ["ball", "gimbal on the base", "weld", "weld of nodes", "gear", "gear the other way round", "one joint"]


@pytest.mark.parametrize("kind", KINDS)
def test_rows_come_back(tmp_path, kind, recwarn):
    pytest.importorskip("mujoco")
    model, path = with_loop(kind), tmp_path / "model.xml"
    model.save(path)
    assert not [w for w in recwarn if "does not hold" in str(w.message) and "placement of free" not in str(w.message)]
    again = pc.load(path)
    assert list(again.loops) == ["loop"] and len(again.loops.rows) == len(model.loops.rows)
    for seed in range(3):
        ours = model.random_state(seed)
        theirs = conventions.from_mujoco(again, *conventions.to_mujoco(model, ours.q, ours.v))
        r, Q = model.loops.residual(ours.q), model.loops.jacobian(ours.q)
        R, A = again.loops.residual(theirs[0]), again.loops.jacobian(theirs[0])
        scale = 1.0
        if "gear" in kind or kind == "one joint":  # written as solved for one coordinate
            scale = -r[0] / R[0] if abs(r[0] + R[0]) < abs(r[0] - R[0]) else r[0] / R[0]
        if kind.startswith("weld"):  # their place is read back as the body's, not the site's: rotations are the same where it is open
            r, R = r[:3], R[:3]
        assert abs(np.linalg.norm(r) - abs(scale) * np.linalg.norm(R)) < AGREE * (1 + np.linalg.norm(r))
        lengths = [
            np.sort(np.linalg.norm(rows[: len(r)], axis=0)[: model.nv - 6]) for rows in (Q, scale * A)
        ]  # the free body's are in other axes
        assert np.abs(lengths[0] - lengths[1]).max() < AGREE * (1 + np.abs(Q).max())


@pytest.mark.parametrize("kind", ["weld", "weld of nodes", "ball"])
def test_the_same_states_are_closed(tmp_path, kind):
    pytest.importorskip("mujoco")
    model, path = with_loop(kind), tmp_path / "model.xml"
    model.save(path)
    again, closed = pc.load(path), model.assemble(seed=1)
    q, v = conventions.from_mujoco(again, *conventions.to_mujoco(model, closed.q, model.random_state(0).v))
    assert np.abs(again.loops.residual(q)).max() < AGREE


@pytest.mark.parametrize("kind", KINDS)
def test_mujoco_reads_the_same_constraint(tmp_path, kind):
    mujoco = pytest.importorskip("mujoco")
    model, path = with_loop(kind), tmp_path / "model.xml"
    model.save(path)
    m = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(m)
    for seed in range(3):
        state = model.random_state(seed)
        data.qpos[:], data.qvel[:] = conventions.to_mujoco(model, state.q, state.v)
        mujoco.mj_forward(m, data)
        r, theirs = model.loops.residual(state.q), data.efc_pos[: len(model.loops.rows)]
        if kind.startswith("weld"):
            r, theirs = r[3:], theirs[:3]  # turns by another measure
        if kind in KINDS[4:]:
            slope = {"gear": 2.0, "gear the other way round": -4.0, "one joint": 2.0}[kind]
            assert abs(theirs[0] - r[0] / slope) < AGREE * (1 + abs(r[0]))
        else:
            assert abs(np.linalg.norm(theirs) - np.linalg.norm(r)) < AGREE * (1 + np.linalg.norm(r))


def test_what_mjcf_has_no_place_for_is_named(tmp_path):
    model = arm()
    bodies = list(model.bodies)
    model.add_loop("eye", bodies[4], "pin", name="hinge")
    model.add_coupling({0: [0, 1, 1.0], 1: [0, 1, 2.0]}, name="curved")
    model.add_coupling({0: 1.0, 1: 1.0, 2: 1.0}, name="differential")
    model.add_coupling([0], function=lambda q: (q[0], [1.0], [[0.0]]), name="cam")
    model.add_coupling({0: 1.0, 1: [0, 0, 0, 0, 0, 1.0]}, name="fifth degree")
    said = r"does not hold .*loop 'hinge' \(pin\), coupling 'curved', coupling 'differential', coupling 'cam', coupling 'fifth degree'"
    with pytest.warns(pc.ModelWarning, match=said):
        model.save(tmp_path / "model.xml")
    assert "<equality>" not in (tmp_path / "model.xml").read_text()
