"""Loops by hinges of any subhinges: against the same hinge in the tree, hinges of a kind, and differences.

Tolerances: rows are of numbers of size 1, by poses of some metres: 2000 eps as of other rows (test_loops.py). Differences over 1e-6 leave
1e-12 of third derivatives and eps/1e-6 of rounding: 1e-8 with room.
"""

import pickle

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind
from support.saved_models import saved_and_loaded

EPS = float(np.finfo(float).eps)
STEP = 1e-6
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def pin(axis, point=(0, 0, 0)):
    return {"kind": "pin", "axis": axis, "point": point}


def slider(axis):
    return {"kind": "slider", "axis": axis}


SCREW = {"kind": "screw", "axis": (0, 1, 0.2), "point": (0.3, 0, 0), "pitch": 0.2}
HINGES = {
    "one pin": [pin((1, 2, 3))],
    "arm of a slider": [pin(Z), slider(X), pin(Z)],
    "skew screw": [pin((1, 2, 3), (0.1, 0.2, 0.3)), slider((1, 0, 1)), SCREW],
    "ball on a rail": [{"kind": "ball", "point": (0.1, 0, 0.2)}, slider((1, 1, 0))],
    "oblique gimbal": [pin(X), pin((1, 4, 0)), pin((0, 1, 4))],
    "five freedoms": [pin(Z), pin(X, (0, 0.5, 0)), slider((0, 1, 1)), pin(Y, (0.2, 0, 0.4)), slider(X)],
}  # fmt: skip
FREEDOMS = {"ball on a rail": 4} | {name: len(hinge) for name, hinge in HINGES.items() if name != "ball on a rail"}


def rotation(rng):
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.linalg.det(Q)


def placement(rng):
    return np.block([[rotation(rng), rng.normal(size=(3, 1))], [np.zeros((1, 3)), 1]])


def pose(q):
    from scipy.spatial.transform import Rotation

    return np.array([*np.roll(Rotation.from_matrix(q[:3, :3]).as_quat(), 1), *q[:3, 3]])


def held_by(name, seed=1):
    """Return a body that is free except for a loop by this hinge, and one on that hinge in the tree, each with the same mass."""
    rng = np.random.default_rng(seed)
    at, com, inertia = placement(rng), rng.normal(size=3), np.diag([2.0, 3.0, 4.0])
    by_loop, in_tree = pc.Multibody("by a loop"), pc.Multibody("in the tree")
    by_loop.add_body("body", hinge="free", mass=1.5, com=com, inertia=inertia)
    in_tree.add_body("body", hinge="custom", subhinges=HINGES[name], placement=at, mass=1.5, com=com, inertia=inertia)
    by_loop.add_loop("body", hinge="custom", subhinges=HINGES[name], placement=at, name="held")
    by_loop.gravity = in_tree.gravity = (1.0, -2.0, -9.0)
    state = in_tree.random_state(seed)
    in_tree.q, in_tree.v = state.q, state.v
    by_loop.q = pose(in_tree.frame("body").pose())
    twist = in_tree.jacobian("body", in_tree.q) @ in_tree.v
    by_loop.v = twist
    return by_loop, in_tree


@pytest.mark.parametrize("name", HINGES)
def test_a_hinge_of_the_tree_keeps_its_own_rows(name):
    """At every state the loop is closed, its rows ask nothing of that hinge, and as many as they are less its freedoms of others."""
    model, rng = every_kind(seed=3), np.random.default_rng(7)
    at = placement(rng)
    body = model.add_body("last", "body5", "custom", subhinges=HINGES[name], placement=at, mass=1.0)
    loop = model.add_loop("last", "body5", "custom", subhinges=HINGES[name], placement=at, name="same")
    assert loop.kind == "custom" and [row.split(": ")[1] for row in loop.rows] == [
        f"{by} {axis}" for by in ("about", "along") for axis in "xyz"
    ]
    for seed in range(4):
        state = model.random_state(seed)
        own = body.hinge.v_slice
        for precision, rounding in (("double", 2000 * EPS), ("quad", 64 * EPS)):  # quad is rounded to double
            Q = loop.jacobian(state, precision=precision)
            assert np.abs(loop.residual(state, precision=precision)).max() < rounding
            assert np.abs(Q[:, own]).max() < rounding and np.abs(loop.bias(state, precision=precision)).max() < 10 * rounding
            assert not np.delete(Q, range(own.start, own.stop), axis=1).any()


@pytest.mark.parametrize("name", HINGES)
def test_a_body_moves_as_on_the_hinge(name):
    """Rank, accelerations, and energy of a scene, by both methods: equal to the body on the hinge in the tree."""
    by_loop, in_tree = held_by(name)
    assert np.abs(by_loop.loops.residual()).max() < 1e-14
    assert by_loop.mobility().degrees_of_freedom == FREEDOMS[name] and not by_loop.mobility().singular
    expected = in_tree.forward_dynamics(in_tree.q, in_tree.v, np.zeros(in_tree.nv))
    J = in_tree.jacobian("body", in_tree.q)
    moved = [in_tree.integrate(in_tree.q, t * in_tree.v) for t in (STEP, -STEP)]
    J_dot = (in_tree.jacobian("body", moved[0]) - in_tree.jacobian("body", moved[1])) / (2 * STEP)
    found = by_loop.constrained_dynamics(by_loop.q, by_loop.v)
    assert found.rank == 6 - FREEDOMS[name]
    assert np.allclose(found.vdot, J @ expected + J_dot @ in_tree.v, rtol=1e-7, atol=1e-7)
    tree = pc.Scene(in_tree).add(pc.effects.Gravity((1.0, -2.0, -9.0))).simulate(0.3, rtol=1e-10, atol=1e-10, progress=False)
    in_tree.q = tree.q[-1]
    for method in ("augment", "embed"):
        scene = pc.Scene(by_loop).add(pc.effects.Gravity((1.0, -2.0, -9.0)), pc.effects.Loop(method=method))
        run = scene.simulate(0.3, rtol=1e-10, atol=1e-10, progress=False)
        by_loop_end = run.q[-1]
        other = pc.Multibody("there")
        other.add_body("body", hinge="free", mass=1.0)
        other.q = by_loop_end
        assert np.abs(other.frame("body").pose() - in_tree.frame("body").pose()).max() < 1e-8, method


@pytest.mark.parametrize(
    ("kind", "subhinges"),
    [("pin", [pin(Z)]), ("slider", [slider(Z)]), ("universal", [pin(X), pin(Y)]), ("planar", [slider(X), slider(Y), pin(Z)]), ("weld", [])],
)
def test_rows_span_those_of_a_kind(kind, subhinges):
    model = every_kind(seed=2)
    at = model.frame("body9").pose(wrt="body3")
    one = model.add_loop("body9", "body3", kind, placement=at, name="one")
    model.add_loop("body9", "body3", "custom", subhinges=subhinges, placement=at, name="other")
    values = np.linalg.svd(model.loops.jacobian(), compute_uv=False)
    assert values[len(one.rows) - 1] > 1e-3 and values[len(one.rows)] < 1e-13


@pytest.mark.parametrize("name", HINGES)
def test_rows_off_the_loop(name):
    """Q*r is the gradient of |r|²/2, Q depends on 6 - n rows exactly, Q̇θ̇ is its rate; also in quad."""
    model, _ = held_by(name)
    rng = np.random.default_rng(4)
    rows = model.loops["held"]
    for width in (0.01, 0.1 if name == "oblique gimbal" else 0.3):  # where it reaches
        q, v = model.integrate(model.q, width * rng.normal(size=6)), rng.normal(size=6)
        Q = rows.jacobian(q)
        assert np.linalg.svd(Q, compute_uv=False)[6 - FREEDOMS[name] :].max(initial=0) < 1e-13
        halves = np.array([[np.sum(rows.residual(model.integrate(q, t * e)) ** 2) / 2 for t in (STEP, -STEP)] for e in np.eye(6)])
        assert np.abs(Q.T @ rows.residual(q) - (halves[:, 0] - halves[:, 1]) / (2 * STEP)).max() < 1e-8
        there, back = (rows.jacobian(model.integrate(q, t * v)) @ v for t in (STEP, -STEP))
        assert np.abs(rows.bias(q, v) - (there - back) / (2 * STEP)).max() < 1e-7
        assert np.abs(rows.bias(q, v) - rows.bias(q, v, precision="quad")).max() < 1e-10
        exact = model.soa.Q.diff(2).at(q).dense()
        step = STEP * np.eye(6)[2]
        assert (
            np.abs(exact - (rows.jacobian(model.integrate(q, step)) - rows.jacobian(model.integrate(q, -step))) / (2 * STEP)).max() < 1e-7
        )
    assert rows.residual(model.integrate(model.q, np.full(6, 0.2))).any()


def test_a_gimbal_that_does_not_reach_every_rotation():
    """Where it reaches it asks what a ball asks; a turn beyond is no state on the loop, and assembly ends within reach."""
    model = pc.Multibody("gimbal")
    model.add_body("body", hinge="ball", mass=1.0, inertia=np.eye(3))
    axes = [Z, (0, 1, 2), Z]  # tips z by twice the angle between the first two at most, 53° of 180°
    model.add_loop("body", hinge="gimbal", axes=axes, name="cone")
    reach = 2 * np.arctan2(1, 2)
    for tilt, on in ((0.5 * reach, True), (0.98 * reach, True), (1.02 * reach, False), (np.pi / 2, False)):
        q = [np.cos(tilt / 2), np.sin(tilt / 2), 0, 0]
        off = np.abs(model.loops.residual(q)).max()
        assert (off < 1e-13) if on else (off > 0.01), tilt
        if on:
            assert not model.loops.jacobian(q).any() or np.abs(model.loops.jacobian(q)).max() < 1e-12
    found = model.assemble([np.cos(np.pi / 4), np.sin(np.pi / 4), 0, 0])
    w, x, y, z = found.q / np.linalg.norm(found.q)
    assert np.arccos(w * w - x * x - y * y + z * z) <= reach + 1e-6
    across = model.add_loop("body", hinge="gimbal", name="any")
    assert across.kind == "ball" and model.loops["cone"].kind == "custom"


def test_copies_and_files(tmp_path):
    model = every_kind(seed=8)
    model.add_loop("body9", "body3", "custom", subhinges=HINGES["skew screw"], placement=placement(np.random.default_rng(1)), name="skew")
    model.add_loop("body9", "body3", "custom", subhinges=[{"kind": "pin"}, slider(X)], name="short")
    model.add_loop("body3", "body9", "gimbal", axes=[Z, (0, 1, 2), Z], name="cone")
    for other in (
        pickle.loads(pickle.dumps(model)),
        pc.Multibody.from_description(model.description()),
        saved_and_loaded(model, tmp_path / "m.toml"),
    ):
        assert [other.loops[name].kind for name in other.loops] == ["custom"] * 3
        assert np.array_equal(other.loops.residual(), model.loops.residual()) and np.array_equal(
            other.loops.jacobian(), model.loops.jacobian()
        )
    arm = pc.chain(3)
    arm.add_loop("body2", hinge="custom", subhinges=HINGES["skew screw"], position=(1, 2, 3), name="skew")
    arm.add_loop("body2", hinge="custom", subhinges=[{"kind": "pin"}, slider(X)], name="short")
    arm.save(tmp_path / "arm.urdf")
    again = pc.load(tmp_path / "arm.urdf")
    assert [again.loops[name].kind for name in again.loops] == ["custom"] * 2
    assert np.allclose(again.loops.jacobian(arm.q), arm.loops.jacobian(arm.q), atol=1e-14)


@pytest.mark.parametrize(
    ("subhinges", "said"),
    [
        (None, "a custom hinge takes subhinges"),
        ([slider(X), slider(X)], r"of the 2 freedoms of its custom hinge only 1 move it differently"),
        ([pin(Z), pin(Z)], r"of the 2 freedoms of its custom hinge only 1"),
        ([pin(X), pin(Y), pin(Z), slider(X), slider(Y), slider(Z)], "the 6 freedoms of its custom hinge leave nothing to close"),
        ([{"kind": "free"}], "a free subhinge of its custom hinge leaves nothing to close"),
        ([{"kind": "hinge"}], "hinge"),
        ([{"axis": X}], "a subhinge says its kind"),
        ([{"kind": "pin", "axis": (0, 0, 0)}], "length 0"),
        ([{"kind": "pin", "axis": (0, 0)}], "axis"),
        ("pin", "subhinge"),
        (3, "subhinges"),
    ],
)  # fmt: skip
def test_refused(subhinges, said):
    model = pc.chain(2)
    with pytest.raises(pc.ModelError, match=said):
        model.add_loop("body1", hinge="custom", subhinges=subhinges, name="x")
    assert list(model.loops) == []
    with pytest.raises(pc.ModelError, match="subhinges belong to a hinge of kind 'custom'"):
        model.add_loop("body1", hinge="pin", subhinges=[pin(Z)])
