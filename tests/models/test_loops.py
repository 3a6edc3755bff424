"""Rows of loops against differences of poses in 60 digits (tests/support/loop_oracle.py), and against hinges that are in the tree.

Tolerance: that of frames, 2000 eps of the largest entry beside 1 (tests/models/test_frames.py), times what the rows divide by: the half
cosine between axes that are to be parallel, cubed in second derivatives. The states below keep it above 0.1.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pycraft as pc
from support.loop_oracle import LoopOracle, assert_close, check_against
from support.mechanisms import every_kind

EPS = float(np.finfo(float).eps)
HINGES = ("weld", "pin", "slider", "screw", "universal", "cylindrical", "planar", "ball", "gimbal", "free")
ROWS = {"weld": 6, "pin": 5, "slider": 5, "screw": 5, "universal": 4, "cylindrical": 4, "planar": 3, "ball": 3, "gimbal": 3, "free": 0}


def rotation(rng):
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.linalg.det(Q)


def hinge_given(kind, rng):
    """Axes, point, pitch and placement of a hinge of this kind."""
    given = {"placement": np.block([[rotation(rng), rng.normal(size=(3, 1))], [np.zeros((1, 3)), 1]])}
    if kind in ("pin", "slider", "screw", "cylindrical", "planar"):
        given["axis"] = rng.normal(size=3)
    if kind == "universal":
        given["axes"] = [rng.normal(size=3), rng.normal(size=3)]
    if kind == "gimbal":
        given["axes"] = list(rotation(rng).T)
    if kind not in ("weld", "free", "planar"):
        given["point"] = rng.normal(size=3)
    if kind == "screw":
        given["pitch"] = 0.3
    return given


def opened(model, b, a, rng):
    """The pose of b in a at the model's state, moved off by a tenth: where loops are open, and axes are far from opposite."""
    X = model.frame(b).pose(wrt=a)
    X[:3, :3] = X[:3, :3] @ Rotation.from_rotvec(0.3 * rng.normal(size=3)).as_matrix()
    X[:3, 3] += 0.3 * rng.normal(size=3)
    return X


# ------------------------------------------------------------------ loops by hinges


@pytest.mark.parametrize("kind", HINGES)
@pytest.mark.parametrize("seed", [0, 1])
def test_rows_of_hinges(kind, seed):
    model, rng = every_kind(seed=seed), np.random.default_rng(seed)
    bodies = list(model.bodies)
    model.add_node("eye", bodies[-1], position=rng.normal(size=3), rotation=rotation(rng))
    a, b = [(bodies[5], "eye"), ("eye", bodies[0]), (None, bodies[8])][(seed + HINGES.index(kind)) % 3]
    given = hinge_given(kind, rng) | {"placement": opened(model, b, a, rng)}
    loop = model.add_loop(b, a, kind, **given, name="loop")
    assert len(loop.rows) == ROWS[kind]
    if ROWS[kind]:
        check_against(LoopOracle(model, b, a, kind, given), loop)


@pytest.mark.parametrize("kind", HINGES)
def test_a_hinge_of_the_tree_keeps_its_own_rows(kind):
    """A loop by the hinge that the tree has there is closed at every state, its rows ask nothing of that hinge, and 6 - n of the others."""
    model, rng = every_kind(seed=3), np.random.default_rng(7)
    given = hinge_given(kind, rng)
    body = model.add_body("last", "body5", kind, **given, mass=1.0)
    loop = model.add_loop("last", "body5", kind, **given, name="same")
    # A subhinge's row moves its body off itself by the rounding of poses; rotations by half a turn and metres enter.
    for seed in range(5):
        state = model.random_state(seed)
        if kind == "screw":
            state.q[body.hinge.q_slice] = 40.0 * (seed - 2)  # several turns
        model.q, model.v = state.q, state.v
        Q, at = loop.jacobian(), body.hinge.v_slice
        rounding = 2000 * EPS * (1 + np.abs(state.q).max())
        assert np.abs(loop.residual()).max(initial=0) < rounding
        assert np.abs(Q[:, at]).max(initial=0) < rounding and np.abs(loop.bias()).max(initial=0) < 10 * rounding
        assert not np.delete(Q, range(at.start, at.stop), axis=1).any()  # nothing else lies between the two
    assert len(loop.rows) == ROWS[kind] == 6 - (at.stop - at.start)
    alone = pc.Multibody("alone")
    alone.add_body("body", hinge="free", mass=1.0)
    X = given["placement"]
    q = np.array([*np.roll(Rotation.from_matrix(X[:3, :3]).as_quat(), 1), *X[:3, 3]])
    rows = alone.add_loop("body", hinge=kind, **given, name="rows")
    assert np.abs(rows.residual(q)).max(initial=0) < 2000 * EPS and np.linalg.matrix_rank(rows.jacobian(q)) == ROWS[kind]


@pytest.mark.parametrize(
    ("kind", "axis"), [("pin", [0, 0, 1]), ("pin", [0, 0, -1]), ("cylindrical", [1, 0, 0]), ("ball", None), ("weld", None)]
)
def test_which_end_is_which_changes_nothing_that_is_spanned(kind, axis):
    model, rng = every_kind(seed=2), np.random.default_rng(3)
    X = model.frame("body9").pose(wrt="body3")  # closed at this state
    point = None if kind == "weld" else rng.normal(size=3)
    R, p = X[:3, :3], X[:3, 3]
    turned = {"axis": R @ axis} if axis else {}
    back = np.block([[R.T, -(R.T @ p)[:, None]], [np.zeros((1, 3)), 1]])
    one = model.add_loop("body9", "body3", kind, placement=X, **({"axis": axis} if axis else {}), point=point, name="one")
    other = model.add_loop("body3", "body9", kind, placement=back, **turned, point=None if point is None else R @ point + p, name="other")
    both = np.linalg.svd(model.loops.jacobian(), compute_uv=False)
    rows = len(one.rows)
    assert len(other.rows) == rows and both[rows - 1] > 1e-3 and both[rows] < 1e-13
    assert np.abs(model.loops.residual()).max() < 1e-14


def test_rows_are_zero_where_the_loop_is_closed_and_nowhere_else():
    """Axes that are opposite, half a turn off: the residual is 2 and no zero, and nothing is no number."""
    mb = pc.Multibody("flip")
    mb.add_body("flap", hinge="ball", mass=1.0)
    half_turn = [0, 1, 0, 0]  # about x
    for kind in ("pin", "cylindrical", "planar", "weld", "slider"):
        loop = mb.add_loop("flap", hinge=kind, name=kind)
        assert np.linalg.norm(loop.residual(half_turn)) == pytest.approx(2, abs=4 * EPS)
        assert np.isfinite(loop.jacobian(half_turn)).all() and np.isfinite(loop.bias(half_turn, np.ones(3))).all()
    turn = [np.cos(1.5), 0, 0, np.sin(1.5)]
    assert np.abs(mb.loops["pin"].residual(turn)).max() < EPS and np.abs(mb.loops["weld"].residual(turn)).max() == pytest.approx(
        2 * np.sin(1.5)
    )


# ------------------------------------------------------------------ what rolls, surfaces, couplings


@pytest.mark.parametrize("kind", ["wheel", "ball", "blade"])
def test_rows_of_what_rolls(kind):
    model, rng = every_kind(seed=4), np.random.default_rng(4)
    model.add_node("ground", "body2", position=rng.normal(size=3), rotation=rotation(rng))
    model.add_node("hub", "body10", position=rng.normal(size=3), rotation=rotation(rng))
    radius = {} if kind == "blade" else {"radius": 0.4}
    loop = model.add_rolling("hub", "ground", kind, **radius, name="roll")
    assert model.loops.of_positions.tolist() == ([False] if kind == "blade" else [True, False, False])
    check_against(LoopOracle(model, "hub", "ground", kind, radius), loop)


def test_a_wheel_rolls():
    """Straight ahead the centre moves by radius times angle; a coin that spins on the spot rolls in a circle of no radius."""
    mb = pc.Multibody("coin")
    mb.add_body("coin", hinge="free", mass=1.0)
    upright = [np.sqrt(0.5), np.sqrt(0.5), 0, 0]  # its axle is the world's -y
    q = [*upright, 3.0, 1.0, 0.5]
    mb.add_rolling("coin", radius=0.5, name="coin")
    assert np.abs(mb.loops.residual(q)).max() < EPS
    Q = mb.loops.jacobian(q)
    omega = 2.0
    ahead = [0, 0, omega, -omega * 0.5, 0, 0]  # about its axle -y, towards -x
    assert np.abs(Q @ ahead).max() < 4 * EPS
    assert np.abs(Q @ [0, omega, 0, 0, 0, 0]).max() < 4 * EPS  # about the vertical, its own y
    assert np.abs(Q @ [0, 0, omega, omega * 0.5, 0, 0])[1] == pytest.approx(2 * omega * 0.5)
    with pytest.raises(pc.EvaluationError, match="wheel on 'coin' lies flat"):
        mb.loops.jacobian([1, 0, 0, 0, 0, 0, 0])


def test_rows_of_surfaces():
    model, rng = every_kind(seed=5), np.random.default_rng(5)
    given = {"A": rng.normal(size=(3, 3)), "b": rng.normal(size=3), "c": 0.7}
    loop = model.add_surface("body9", "body3", **given, name="surface")
    check_against(LoopOracle(model, "body9", "body3", "surface", given), loop)


def test_couplings():
    """Polynomials by their own derivatives, a function by what it returns, in any order of coordinates."""
    model = pc.chain(3)
    q, v = np.array([0.3, -0.7, 1.1]), np.array([0.5, 2.0, -1.5])
    model.add_coupling({"hinge2": [1.0, 2.0, 3.0, 4.0], "hinge0": -0.5}, constant=0.25, name="poly")
    x, y = q[2], q[0]
    assert_close(model.loops.residual(q), [0.25 + 1 + 2 * x + 3 * x**2 + 4 * x**3 - 0.5 * y])
    assert_close(model.loops.jacobian(q), [[-0.5, 0, 2 + 6 * x + 12 * x**2]])
    assert_close(model.loops.bias(q, v), [(6 + 24 * x) * v[2] ** 2])
    product = lambda q: (q[0] * q[1] ** 2, [q[1] ** 2, 2 * q[0] * q[1]], [[0, 2 * q[1]], [2 * q[1], 2 * q[0]]])
    cam = model.add_coupling(["hinge1", "hinge0"], function=product, name="cam")
    assert_close(cam.residual(q), [q[1] * q[0] ** 2])
    assert_close(cam.jacobian(q), [[2 * q[1] * q[0], q[0] ** 2, 0]])
    assert_close(cam.bias(q, v), [4 * q[0] * v[0] * v[1] + 2 * q[1] * v[0] ** 2])


def test_a_coupling_of_the_second_coordinate_of_a_hinge():
    """Behind a ball, whose q is longer than its v, and of a hinge of several: each has its own place in q and in v."""
    model = pc.tree([-1, 0, 1], ["ball", "planar", "pin"])
    model.add_coupling({"hinge1[1]": [0.0, 2.0, 3.0], "hinge2": -1.0}, name="second")
    state = model.random_state(4)
    x, at = state.q[5], model.loops.jacobian(state)[0]
    assert_close(model.loops.residual(state), [2 * x + 3 * x * x - state.q[7]])
    assert_close(at, [0, 0, 0, 0, 2 + 6 * x, 0, -1])
    assert_close(model.loops.bias(state), [6 * state.v[4] ** 2])


# ------------------------------------------------------------------ states, copies, edits


def test_batches_and_states():
    model = every_kind(seed=6)
    model.add_loop("body10", "body3", "pin", name="pin")
    model.add_coupling({"hinge1": 2.0, "hinge2": 1.0}, name="gear")
    states = [model.random_state(i) for i in range(3)]
    q, v = np.array([s.q for s in states]), np.array([s.v for s in states])
    for b, state in enumerate(states):
        assert np.array_equal(model.loops.residual(q)[b], model.loops.residual(state))
        assert np.array_equal(model.loops.jacobian(q)[b], model.loops.jacobian(state))
        assert np.array_equal(model.loops.bias(q, v)[b], model.loops.bias(state))
        assert np.array_equal(model.loops.rates(q, v)[b], model.loops.rates(state))
        # sums of nv terms, in another order
        for precision, eps in (("single", 2.0**-23), ("double", EPS), ("extended", EPS), ("quad", EPS)):
            Q = model.loops.jacobian(state.q, precision=precision)
            size = model.nv * eps * (np.abs(Q) @ np.abs(state.v))
            assert (np.abs(model.loops.rates(state, precision=precision) - Q @ state.v) <= size).all()
    assert model.loops.rates(q[:0], v[:0]).shape == (0, 6) and not model.loops.rates(q[1], np.zeros(model.nv)).any()
    assert model.loops.jacobian(q[:0]).shape == (0, 6, model.nv) and model.loops.bias(q[:0], v[:0]).shape == (0, 6)
    model.q, model.v = q[1], v[1]
    assert np.array_equal(model.loops.bias(), model.loops.bias(states[1])) and not model.loops.bias(q[1]).any()
    assert model.loops["gear"].slice == slice(5, 6) and np.array_equal(model.loops["gear"].jacobian(), model.loops.jacobian()[5:])
    gear = model.loops["gear"]
    model.loops.remove("pin")
    assert gear.slice == slice(0, 1)  # of the rows that are left


def test_no_loops_and_no_coordinates():
    empty = pc.Multibody("nothing", welds="keep")
    assert empty.loops.residual().shape == (0,) and empty.loops.jacobian().shape == (0, 0) and empty.loops.rates().shape == (0,)
    empty.add_body("block", hinge="weld", mass=1.0, position=(1, 0, 0))
    empty.add_loop("block", hinge="ball", name="stay")
    assert (
        empty.loops.jacobian().shape == (3, 0) and empty.loops.residual().tolist() == [1, 0, 0] and empty.loops.bias().tolist() == [0, 0, 0]
    )


def test_copies_have_the_loops():
    import copy
    import pickle

    model = every_kind(seed=7)
    model.add_loop("body10", "body3", "screw", axis=[1, 2, 3], pitch=0.2, name="screw")
    model.add_surface("body9", A=np.eye(3), c=-1.0, name="sphere")
    model.add_rolling("body9", kind="ball", radius=0.3, name="roll")
    model.add_coupling({"hinge1": [0, 2.0, 1.0]}, constant=0.5, name="stop")
    for other in (
        copy.copy(model),
        copy.deepcopy(model),
        pickle.loads(pickle.dumps(model)),
        pc.Multibody.from_description(model.description()),
    ):
        assert other.loops.rows == model.loops.rows
        assert np.array_equal(other.loops.residual(), model.loops.residual()) and np.array_equal(
            other.loops.jacobian(), model.loops.jacobian()
        )


def test_loops_follow_edits_of_the_model():
    model = pc.chain(3)
    model.add_loop("body2", hinge="ball", position=(2, 0, 0), name="close")
    model.add_coupling({"hinge0": 1.0, "hinge1": -1.0}, name="gear")
    before = model.loops.jacobian([0.1, 0.2, 0.3])
    model.hinges["hinge1"].placement = np.array([[1.0, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    longer = model.loops.jacobian([0.1, 0.2, 0.3])
    assert longer[1, 0] == pytest.approx(before[1, 0] + np.cos(0.1))
    model.add_body("base plate", mass=1.0)
    assert model.loops.jacobian([0.1, 0.2, 0.3, 0.4]).shape == (4, 4)
    model.loops.remove("close")
    assert model.loops.rows == ["gear"] and list(model.loops) == ["gear"]
