"""Residuals of targets and their Jacobians, against 60 digits: see `support.frame_oracle` for poses of a model moved by 10⁻¹².

Tolerance: residuals and Jacobians are a few dozen operations on poses that the core has to some 10 eps a body; the largest numbers here are
near 10, half a turn's factor θ / sin θ excepted, which multiplies rounding by itself and is allowed for.
"""

import mpmath
import numpy as np
import pytest

import pycraft as pc
from pycraft.kinematics.frame_targets import rows_of
from pycraft.kinematics.rotation_vectors import rates_of_rotation_vectors, rotation_vectors, skew
from support.frame_oracle import DIGITS, STEP, FrameOracle, inverse

AGREE = 1e-12


@pytest.fixture(scope="module")
def model():
    """Hinges of all sorts in branches, with nodes and a loose frame."""
    made = pc.tree([-1, 0, 1, 1, 3, 0], ["ball", "screw", "pin", "universal", "cylindrical", "free"], seed=8, name="sorts")
    made.add_node("hand", "body4", position=(0.3, -0.2, 0.1), rotation=turn((0.3, 0.5, -0.7)))
    made.add_node("eye", "body2", position=(0.1, 0.2, -0.3), rotation=turn((-1, 0.2, 0.4)))
    state = made.random_state(3)
    made.q = state.q
    return made


def turn(phi):
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(phi).as_matrix()


def logarithm(R):
    """φ in 60 digits, of a matrix that is a rotation to rounding, neither none nor half a turn; of the rotation that is nearest to it."""
    for _ in range(3):
        R = R @ (3 * np.eye(3) - R.T @ R) / 2
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    size = mpmath.sqrt(vector @ vector)
    return vector / size * mpmath.atan2(size, R[0, 0] + R[1, 1] + R[2, 2] - 1)


def poses(oracle, frame, wrt, then):
    X = oracle.pose(frame, wrt, 0, then)
    return X[:3, :3], X[:3, 3]


def agree(rows, model, exact, scale=1.0):
    """`exact`: of the oracle and a way the residuals in 60 digits."""
    q = np.array(model.q)
    r, J = rows.evaluate(q[None], np.zeros(1, int))
    oracle = FrameOracle(model, q)
    with mpmath.workdps(DIGITS):
        still = exact(oracle, np.zeros(model.nv))
        columns = [(exact(oracle, e) - exact(oracle, -e)) / (2 * STEP) for e in np.eye(model.nv)]
        expected = np.array(np.array(columns).T, float)
        assert np.abs(r[0] - np.array(still, float)).max() < AGREE * scale
    assert np.abs(J[0] - expected).max() < AGREE * scale
    assert np.abs(expected).max() > 0.1


TURNS = {"small": 1e-5, "short": 0.09, "middle": 1.3, "long": 3.0, "nearly half": np.pi - 1e-3}


@pytest.mark.parametrize("wrt", [None, "eye"])
@pytest.mark.parametrize("axes", ["aligned", "target", "body1", "hand"])
@pytest.mark.parametrize("size", TURNS)
def test_of_poses(model, wrt, axes, size):
    X = model.frame("hand").pose(wrt=wrt)
    target = np.eye(4)
    way = np.array([0.48, -0.6, 0.64])
    target[:3, :3], target[:3, 3] = X[:3, :3] @ turn(-way * TURNS[size]), X[:3, 3] + [0.2, -0.4, 0.1]
    directions = ["rx", "rz", "y", "z"]
    (rows,), _ = rows_of(model, {"hand": dict(pose=target, wrt=wrt, axes=axes, directions=directions)}, None, 1e-9)
    assert rows.names == ("hand.rx", "hand.rz", "hand.y", "hand.z")

    def exact(oracle, then):
        R, p = poses(oracle, "hand", wrt or "base", then)
        U = target[:3, :3] * oracle.one
        x = np.concatenate([U @ logarithm(U.T @ R), p - target[:3, 3]])
        C = {"aligned": np.eye(3), "target": U}.get(axes)
        C = poses(oracle, axes, wrt or "base", then)[0] if C is None else C
        return np.concatenate([C.T @ x[:3], C.T @ x[3:]])[[0, 2, 4, 5]]

    agree(rows, model, exact, 10 if size == "nearly half" else 1)


@pytest.mark.parametrize("size", [1e-6, 0.3, 2.0, 3.1])
@pytest.mark.parametrize("wrt", [None, "body5"])
def test_of_axes(model, wrt, size):
    a = np.array([0.6, 0.0, 0.8])
    u = model.frame("hand").pose(wrt=wrt)[:3, :3] @ a
    across = np.cross(u, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(u, [0.0, 0.0, 1.0]))
    along = np.cos(size) * u + np.sin(size) * across
    (rows,), _ = rows_of(model, {"hand": dict(axis=5 * a, along=2 * along, wrt=wrt)}, None, 1e-9)
    E, b = rows.across[0], rows.along[0]
    assert np.abs(E @ E.T - np.eye(2)).max() < 1e-15 and np.abs(E @ b).max() < 1e-15
    r, _ = rows.evaluate(np.array(model.q)[None], np.zeros(1, int))
    assert abs(np.linalg.norm(r) - size) < 1e-14 * np.pi / np.sin(size)

    def exact(oracle, then):
        u = poses(oracle, "hand", wrt or "base", then)[0] @ (rows.axis * oracle.one)
        y = E @ u
        theta = mpmath.atan2(mpmath.sqrt(y @ y), b @ u)
        return theta / mpmath.sqrt(y @ y) * y

    agree(rows, model, exact, np.pi / (np.pi - size) ** 2)


@pytest.mark.parametrize("wrt", [None, "eye"])
def test_of_the_centre_of_mass(model, wrt):
    (rows,), _ = rows_of(model, None, dict(position=[0.1, 0.2, 0.3], wrt=wrt, directions=["x", "z"]), 1e-9)

    def exact(oracle, then):
        bodies = oracle.description["bodies"]
        weighted = [b["mass"] * (oracle.body(k, 0, then) @ np.append(b["com"], oracle.one))[:3] for k, b in enumerate(bodies)]
        c = sum(weighted) / sum(b["mass"] for b in bodies)
        X = inverse(oracle.world(wrt or "base", 0, then))
        return (X[:3, :3] @ c + X[:3, 3])[[0, 2]] - np.array([0.1, 0.3])

    agree(rows, model, exact)


def test_rates_where_series_and_closed_form_meet():
    """On both sides of θ = 0.1, at none and at half a turn, against 40 digits."""
    with mpmath.workdps(40):
        for theta in (0, 1e-9, 0.0999, 0.1001, 2.0, 3.14159, np.pi):
            phi = theta * np.array([0.36, 0.48, 0.8])
            size = mpmath.sqrt(sum(mpmath.mpf(x) ** 2 for x in phi))
            c = (1 - size / 2 * mpmath.cot(size / 2)) / size**2 if size else mpmath.mpf(1) / 12
            exact = np.eye(3) + skew(phi) / 2 + float(c) * skew(phi) @ skew(phi)
            assert np.abs(rates_of_rotation_vectors(phi[None])[0] - exact).max() < 1e-15


def test_rotation_vectors_of_all_turns():
    rng = np.random.default_rng(2)
    way = rng.normal(size=(200, 3))
    phi = way / np.linalg.norm(way, axis=1, keepdims=True) * rng.choice([1e-9, 1e-4, 1, 3, np.pi - 1e-9], (200, 1))
    assert np.abs(rotation_vectors(turn(phi)) - phi).max() < 1e-14
    assert rotation_vectors(np.zeros((0, 3, 3))).shape == (0, 3)


def test_weights_and_tolerances_are_of_angles_first(model):
    given = dict(pose=np.eye(4), directions=["rx", "y"], weight=(2, 3), tolerance=(0.1, 0.2))
    (rows,), _ = rows_of(model, {"hand": given}, None, 1e-9)
    assert rows.weights.tolist() == [2, 3] and rows.tolerance == (0.1, 0.2) and rows.angular.tolist() == [True, False]
