"""Batches run several states as one pack: what goes wrong in one lane must show, whichever lane it is, and touch no other."""

import warnings

import numpy as np
import pytest

import pycraft as pc

BATCH = 8  # lanes of a pack in single precision; two packs in double


@pytest.fixture(scope="module")
def gimbal():
    """Two massless rings and a rotor on pins along z, x, z: where the second angle is 0 the outer ring feels no inertia."""
    model = pc.Multibody("gimbal")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        model.add_body("outer", None, hinge="pin", axis=(0, 0, 1))
        model.add_body("inner", "outer", hinge="pin", axis=(1, 0, 0))
        model.add_body("rotor", "inner", hinge="pin", axis=(0, 0, 1), mass=2.0, inertia=np.diag([0.4, 0.5, 0.1]))
        assert model.nv == 3
    return model


def states(seed=0):
    """Regular ones: the second angle is far from 0."""
    rng = np.random.default_rng(seed)
    Q, V, TAU = (rng.uniform(-1, 1, (BATCH, 3)) for _ in range(3))
    Q[:, 1] = rng.uniform(0.5, 1.5, BATCH)
    return Q, V, TAU


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
@pytest.mark.parametrize("precision", ["double", "single"])
def test_a_singular_lane_is_found(gimbal, form, precision):
    for lane in range(BATCH):
        Q, V, TAU = states()
        Q[lane, 1] = 0.0
        with pytest.raises(pc.SingularHingeError, match=f"'outer'(.|\n)*state {lane} of a batch of {BATCH}"):
            gimbal.forward_dynamics(Q, V, TAU, form=form, precision=precision)


@pytest.fixture(scope="module")
def askew():
    """The same gimbal on axes askew: at q₁ = 0 the outer ring's D is rounding, and positive."""
    rng = np.random.default_rng(2)
    first, second = (turn * np.linalg.det(turn) for turn in (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2)))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    model = pc.Multibody("askew gimbal")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        model.add_body("outer", None, hinge="pin", axis=axis, rotation=first)
        model.add_body("inner", "outer", hinge="pin", axis=second.T @ np.cross(axis, (1, 0, 0)), rotation=second)
        model.add_body("rotor", "inner", hinge="pin", axis=second.T @ axis, mass=2.0, inertia=np.diag([0.4, 0.5, 0.1]))
        assert model.nv == 3
    return model


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_a_lane_of_noise_is_found(askew, form):
    """A positive pivot that is rounding passes for an inertia where it is not compared in its own lane."""
    for lane in range(BATCH):
        Q, V, TAU = states()
        for angle in (0.3, -0.7, 1.1):
            Q[lane, :2] = angle, 0.0
            with pytest.raises(pc.SingularHingeError, match=f"'outer'(.|\n)*state {lane} of a batch of {BATCH}"):
                askew.forward_dynamics(Q, V, TAU, form=form)


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_other_lanes_are_as_if_alone(gimbal, form):
    """A singular lane, answered by least norm; the others bit for bit as one by one."""
    for lane in (0, 3, BATCH - 1):
        Q, V, TAU = states(lane)
        Q[lane, 1] = 0.0
        together = gimbal.forward_dynamics(Q, V, TAU, form=form, on_singular="minimum-norm")
        alone = [gimbal.forward_dynamics(*one, form=form, on_singular="minimum-norm") for one in zip(Q, V, TAU, strict=True)]
        assert np.array_equal(together, alone)
    Q, V, TAU = states(9)
    together = gimbal.forward_dynamics(Q, V, TAU, form=form)
    alone = np.array([gimbal.forward_dynamics(*one, form=form) for one in zip(Q, V, TAU, strict=True)])
    assert np.abs(together - alone).max() <= 1e-13 * np.abs(alone).max()


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_every_lane_has_its_own_numbers(form):
    """Lanes of free and ball hinges with lengths of quaternions of their own."""
    model = pc.tree([-1, 0, 1], ["free", "ball", "pin"], seed=2)
    drawn = [model.random_state(i) for i in range(BATCH + 3)]
    Q, V = np.array([s.q for s in drawn]), np.array([s.v for s in drawn])
    Q[:, :4] *= np.linspace(0.5, 3, len(Q))[:, None]
    TAU = np.random.default_rng(1).normal(size=V.shape)
    together = model.forward_dynamics(Q, V, TAU, form=form)
    alone = np.array([model.forward_dynamics(*one, form=form) for one in zip(Q, V, TAU, strict=True)])
    assert np.abs(together - alone).max() <= 1e-12 * np.abs(alone).max() and len({a.tobytes() for a in alone}) == len(alone)
