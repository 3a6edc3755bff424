"""Frames against differences of poses in 60 digits (tests/support/frame_oracle.py), on every kind of hinge, branches and welds.

Tolerance: a way of up to eight hinges, each about a hundred roundings of numbers of the result's own size (poses within metres, rates near
1): 2000 eps of the largest entry, beside 1.
"""

import mpmath
import numpy as np
import pytest

import pycraft as pc
from support.frame_oracle import DIGITS, FrameOracle
from support.mechanisms import SHAPES, every_kind, with_hinges

EPS = float(np.finfo(float).eps)
AXES = ("body", "aligned", "world", "third")


def assert_close(got, expected, label=""):
    expected = np.array(expected, float)
    assert got.shape == expected.shape, label
    error = np.abs(got - expected).max(initial=0) / (1 + np.abs(expected).max(initial=0))
    assert error <= 2000 * EPS, f"{label}: off by {error:.1e}"


def rotation_about_z(t, lib=np):
    """The pose, twist and its rate of a frame that turns by sin t and drifts along (cos t / 4, t², t)."""
    c, s = lib.cos(lib.sin(t)), lib.sin(lib.sin(t))
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    X = np.block([[R, np.array([[lib.cos(t) / 4], [t * t], [t]])], [np.zeros((1, 3)), np.ones((1, 1))]])
    w, w_dot = np.array([0, 0, lib.cos(t)]), np.array([0, 0, -lib.sin(t)])
    p_dot, p_ddot = np.array([-lib.sin(t) / 4, 2 * t, 1]), np.array([-lib.cos(t) / 4, 2, 0])
    v = R.T @ p_dot
    return X, np.concatenate([w, v]), np.concatenate([w_dot, R.T @ p_ddot - np.cross(w, v)])


def with_loose_frames(model, t=0.3):
    """A moved frame on a body, a fixed one on it, one moved on that, one fixed on the base: and what the oracle needs of them."""
    last, first = list(model.bodies)[-1], list(model.bodies)[0]
    X = np.block([[np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]), np.array([[0.2], [0.3], [-0.1]])], [np.zeros((1, 3)), 1]])
    model.add_frame("swing", on=last, motion=rotation_about_z)
    model.add_frame("fixed", on="swing", placement=X)
    model.add_frame("upon", on="fixed", motion=rotation_about_z)
    model.add_frame("wall", placement=X)
    model.add_frame("beside", on=first, position=(0.1, 0, 0.2))
    model.frames.t = t
    exact = lambda t: rotation_about_z(t, mpmath)[0]
    shift = np.eye(4)
    shift[:3, 3] = (0.1, 0, 0.2)
    moved = {"swing": (last, exact), "fixed": ("swing", lambda t: X), "upon": ("fixed", exact), "wall": ("base", lambda t: X)}
    return moved | {"beside": (first, lambda t: shift)}


def state_of(model, seed=0):
    """q, v, vdot in which every hinge moves."""
    state = model.random_state(seed)
    return state.q, state.v, np.random.default_rng(seed).uniform(-1, 1, model.nv)


PAIRS = [
    ("upon", "wall"),
    ("upon", "swing"),
    ("base", "upon"),
    ("beside", "upon"),
    ("upon", "beside"),
    ("wall", "base"),
    ("fixed", "fixed"),
]


@pytest.mark.parametrize("seed", [0, 1])
def test_every_kind_of_hinge(seed):
    model = every_kind(seed=seed)
    moved = with_loose_frames(model)
    q, v, vdot = state_of(model, seed)
    model.q, model.v, model.frames.vdot = q, v, vdot
    oracle = FrameOracle(model, q, v, vdot, moved, 0.3)
    bodies = list(model.bodies)
    rng = np.random.default_rng(seed)
    pairs = [*PAIRS, *(tuple(str(x) for x in rng.choice([*bodies, *model.nodes, "base"], 2)) for _ in range(8))]
    with mpmath.workdps(DIGITS):
        for a, b in pairs:
            frame, (x, y) = model.frame(a), (oracle.velocity(a, b), oracle.acceleration(a, b))
            assert_close(frame.pose(wrt=b), oracle.pose(a, b), (a, b))
            for axes in ("body", "aligned", "world", bodies[3], "wall"):
                label = (a, b, axes)
                V, A = oracle.in_axes(a, b, axes, x), oracle.in_axes(a, b, axes, y)
                assert_close(frame.velocity(wrt=b, axes=axes), V, label)
                assert_close(frame.acceleration(wrt=b, axes=axes), A, label)
                classical = np.concatenate([A[:3], A[3:] + np.cross(V[:3], V[3:])])
                assert_close(frame.acceleration(wrt=b, axes=axes, kind="classical"), classical, label)
                assert_close(frame.velocity(q, v, wrt=b, axes=axes), V, label)
                assert_close(frame.acceleration(q, v, vdot, wrt=b, axes=axes), A, label)


def test_the_classical_acceleration_is_that_of_the_point():
    """p̈ in the axes of what it is seen from, by a second difference of positions."""
    model = every_kind(seed=2)
    q, v, vdot = state_of(model, 2)
    oracle = FrameOracle(model, q, v, vdot)
    a, b = list(model.bodies)[-1], list(model.bodies)[2]
    with mpmath.workdps(DIGITS):
        h = mpmath.mpf(10) ** -12
        point = [oracle.pose(a, b, t)[:3, 3] for t in (h, 0, -h)]
        second = (point[0] - 2 * point[1] + point[2]) / h**2
    assert_close(model.frame(a).acceleration(q, v, vdot, wrt=b, axes="aligned", kind="classical")[3:], second)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", ["weld", "universal", "ball", "free", "planar", "screw-ball-pin"])
def test_jacobians_and_their_rates(kind, shape):
    """All columns of a pair on different branches, in all axes; a moved frame among them."""
    model = with_hinges(kind, shape)
    moved = with_loose_frames(model)
    q, v, _ = state_of(model)
    oracle = FrameOracle(model, q, v, None, moved, 0.3)
    bodies = list(model.bodies)
    for a, b in [("upon", bodies[1]), (bodies[2], bodies[-1])]:
        frame, third = model.frame(a), model.frame(bodies[0])
        for axes in AXES:
            whose = third if axes == "third" else axes
            J, rate = frame.jacobian(q, wrt=b, axes=whose), frame.jacobian_dot(q, v, wrt=b, axes=whose)
            assert J.shape == rate.shape == (6, model.nv)
            with mpmath.workdps(DIGITS):
                for i in range(0, model.nv, 2):
                    name = third.name if axes == "third" else axes
                    assert_close(J[:, i], oracle.in_axes(a, b, name, oracle.jacobian(a, b, i)), (a, b, axes, i))
                    assert_close(rate[:, i], oracle.jacobian_dot(a, b, i, name), (a, b, axes, i, "rate"))


def test_velocities_are_jacobians_times_v_and_accelerations_their_rates():
    """Without moved frames V = Jv, and Jv̇ + J̇v is the spatial acceleration in body and world axes, the classical one in aligned."""
    model = every_kind(seed=3)
    q, v, vdot = state_of(model, 3)
    names = [*model.bodies, *model.nodes]
    for a, b in zip(names, names[::-1], strict=True):
        frame = model.frame(a)
        for axes, kind in (("body", "spatial"), ("world", "spatial"), ("aligned", "classical")):
            J, rate = frame.jacobian(q, wrt=b, axes=axes), frame.jacobian_dot(q, v, wrt=b, axes=axes)
            assert_close(frame.velocity(q, v, wrt=b, axes=axes), J @ v)
            assert_close(frame.acceleration(q, v, vdot, wrt=b, axes=axes, kind=kind), J @ vdot + rate @ v)
            assert_close(frame.bias_acceleration(q, v, wrt=b, axes=axes, kind=kind), rate @ v)


def test_against_the_direct_calls():
    model = every_kind(seed=4)
    q, v, _ = state_of(model, 4)
    for name in [*model.bodies, *model.nodes]:
        assert_close(model.frame(name).pose(q), model.pose(name, q))
        assert_close(model.frame(name).jacobian(q), model.jacobian(name, q))
        assert_close(model.frame(name).jacobian_dot(q, v), model.jacobian_dot(name, q, v))
        assert_close(model.frame(name).jacobian(q, wrt="body4", axes="world"), model.jacobian(name, q, axes="world", relative_to="body4"))


def test_columns_of_what_moves_both_or_neither_are_zero():
    model = every_kind(seed=5)
    q, v, _ = state_of(model, 5)
    bodies = list(model.bodies)
    parents = {name: model.bodies[name].parent for name in bodies}

    def carried(name):
        return [name, *(carried(parents[name].name) if parents[name] else [])]

    a, b = bodies[-1], bodies[7]
    between = set(carried(a)) ^ set(carried(b))
    still = np.ones(model.nv, bool)
    for name in between:
        still[model.bodies[name].hinge.v_slice] = False
    assert still.any() and not still.all()
    for axes in ("body", "aligned", "world", bodies[1]):
        J, rate = model.frame(a).jacobian(q, wrt=b, axes=axes), model.frame(a).jacobian_dot(q, v, wrt=b, axes=axes)
        assert not J[:, still].any() and not rate[:, still].any() and (J[:, ~still] != 0).any(axis=0).all()


def test_poses_in_the_axes_of_a_third():
    """Its rotation to the third's axes, and the way between the two origins there; of the present state, of one given, of a batch."""
    model = every_kind(seed=6)
    with_loose_frames(model)
    q, other = model.random_state(6).q, model.random_state(7).q
    for a, b, c in (
        ("upon", "body3", "beside"),
        ("body10", "wall", "body7"),
        ("body5", "base", "body10"),
        ("body2", "body9", "body2"),
        ("base", "body4", "body1"),
    ):
        of = lambda x, wrt, q: model.frame(x).pose(q, wrt=wrt, t=0.3)
        X, R, B = model.frame(a).pose(q, wrt=b, axes=c, t=0.3), of(a, c, q)[:3, :3], of(b, c, q)[:3, 3]
        assert_close(X[:3, :3], R)
        assert_close(X[:3, 3], of(a, c, q)[:3, 3] - B)
        assert np.array_equal(X[3], [0, 0, 0, 1])
        model.q, model.frames.t = q, 0.3
        assert_close(model.frame(a).pose(wrt=b, axes=c), X)
        both = model.frame(a).pose(np.array([q, other]), wrt=b, axes=model.frame(c), t=0.3)
        assert_close(both[0], X)
    assert_close(model.frame(a).pose(q, wrt=b, axes=b, t=0.3), of(a, b, q))


def test_some_coordinates():
    """Hinges by name and handle, coordinates by name and number: the columns of the whole, in the order that is asked for."""
    model = every_kind(seed=6)
    q, v, _ = state_of(model, 6)
    frame, names, several = model.frame("body10"), model.coordinate_names, next(h for h in model.hinges.values() if h.kind == "planar")
    whole, rates = frame.jacobian(q), frame.jacobian_dot(q, v)
    free = [i for i in range(model.nv) if i not in range(model.nv)[several.v_slice]]
    chosen = [names[free[-1]], several, free[0]]
    columns = [free[-1], *range(model.nv)[several.v_slice], free[0]]
    assert np.array_equal(frame.jacobian(q, coordinates=chosen), whole[:, columns])
    assert np.array_equal(frame.jacobian_dot(q, v, coordinates=chosen), rates[:, columns])
    assert np.array_equal(frame.jacobian(q, coordinates=several.name), whole[:, several.v_slice])
    assert frame.jacobian(q, coordinates=[]).shape == (6, 0)


def test_batches_have_the_bits_of_single_states():
    model = every_kind(seed=7)
    with_loose_frames(model)
    states = [state_of(model, seed) for seed in range(3)]
    q, v, vdot = (np.array(x) for x in zip(*states, strict=True))
    t = np.array([0.1, 0.2, 0.3])
    frame, b = model.frame("upon"), "body7"
    many = {
        "pose": frame.pose(q, wrt=b, t=t),
        "velocity": frame.velocity(q, v, wrt=b, axes="body3", t=t),
        "acceleration": frame.acceleration(q, v, vdot, wrt=b, axes="aligned", t=t),
        "jacobian": frame.jacobian(q, wrt=b, axes="world", t=t),
        "jacobian_dot": frame.jacobian_dot(q, v, wrt=b, axes="world", t=t),
        "bias": frame.bias_acceleration(q, v, wrt=b, t=t),
    }
    for i, (one, rate, second) in enumerate(states):
        assert np.array_equal(many["pose"][i], frame.pose(one, wrt=b, t=t[i]))
        assert np.array_equal(many["velocity"][i], frame.velocity(one, rate, wrt=b, axes="body3", t=t[i]))
        assert np.array_equal(many["acceleration"][i], frame.acceleration(one, rate, second, wrt=b, axes="aligned", t=t[i]))
        assert np.array_equal(many["jacobian"][i], frame.jacobian(one, wrt=b, axes="world", t=t[i]))
        assert np.array_equal(many["jacobian_dot"][i], frame.jacobian_dot(one, rate, wrt=b, axes="world", t=t[i]))
        assert np.array_equal(many["bias"][i], frame.bias_acceleration(one, rate, wrt=b, t=t[i]))
    of_times = frame.pose(q[0], wrt=b, t=t)
    assert of_times.shape == (3, 4, 4) and np.array_equal(of_times[2], frame.pose(q[0], wrt=b, t=0.3))
    assert frame.velocity(q[:0], v[:0], wrt=b).shape == (0, 6)
    with pytest.raises(pc.ModelError, match="t has 3 times for 2 states"):
        frame.pose(q[:2], wrt=b, t=t)


def test_a_state_brings_its_velocity_and_precisions_agree():
    model = every_kind(seed=8)
    state = model.random_state(8)
    frame = model.frame("body9")
    assert np.array_equal(frame.velocity(state, wrt="body2"), frame.velocity(state.q, state.v, wrt="body2"))
    for precision, eps in (("single", 1e-7), ("extended", EPS), ("quad", EPS)):
        wide = frame.acceleration(state, wrt="body2", precision=precision)
        assert np.abs(wide - frame.acceleration(state, wrt="body2")).max() <= 2000 * eps * (1 + np.abs(wide).max())
    with pytest.raises(pc.EvaluationError, match="'single' to 'quad'"):
        frame.pose(state, precision=50)


def test_far_from_the_base_what_is_near_keeps_its_digits():
    """Two frames of one arm, the whole 10⁹ m away at 7 km/s: the path between them does not include the base."""
    model = pc.Multibody("far")
    solid = dict(mass=1.0, inertia=np.eye(3))
    model.add_body("bus", hinge="free", **solid)
    model.add_body("upper", "bus", position=(1, 0, 0), **solid)
    model.add_body("lower", "upper", axis=(0, 1, 0), position=(1, 0, 0), **solid)
    q, v = np.array([1.0, 0, 0, 0, 0, 0, 0, 0.3, 0.4]), np.array([0.1, 0.2, 0.3, 0, 0, 0, 1, 2])
    far, fast = q.copy(), v.copy()
    far[4:7], fast[3:6] = 1e9, 7000
    lower = model.frame("lower")
    assert np.array_equal(lower.pose(far, wrt="bus"), lower.pose(q, wrt="bus"))
    assert np.array_equal(lower.velocity(far, fast, wrt="bus"), lower.velocity(q, v, wrt="bus"))
    assert np.array_equal(lower.acceleration(far, fast, wrt="bus"), lower.acceleration(q, v, wrt="bus"))


def test_one_body_and_none():
    one = pc.Multibody("one")
    one.add_body("wheel", mass=1.0)
    assert_close(one.frame("wheel").velocity([0.5], [2.0]), [0, 0, 2, 0, 0, 0])
    assert_close(one.frame("base").velocity([0.5], [2.0], wrt="wheel"), [0, 0, -2, 0, 0, 0])
    empty = pc.Multibody("empty")
    lens = empty.add_frame("lens", motion=rotation_about_z)
    assert np.array_equal(empty.frame(None).pose(), np.eye(4)) and lens.jacobian().shape == (6, 0)
    empty.frames.t = 0.7
    assert_close(lens.velocity(), rotation_about_z(0.7)[1])
    assert_close(empty.frame("base").acceleration(wrt="lens", axes="world"), -rotation_about_z(0.7)[2])
