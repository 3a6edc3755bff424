"""Derivatives of dynamics by kernels, beyond what test_kernels.py asks of every call: long and branched models, whose results are written
in place; other gravities; singular models; and the call from Python on plain arrays."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.dynamics.sensitivities import DynamicsDerivatives
from support.kernel_cases import LONG, MODELS, states

EPS = np.finfo(float).eps
CALLS = ["inverse_dynamics_derivatives", "forward_dynamics_derivatives"]


@pytest.mark.parametrize("name", list(LONG))
def test_long_models(name):
    """As in test_kernels.py: rounding of n sums of up to six products, and of what is solved times the condition."""
    model = LONG[name]
    assert model.nv > 48
    Q, V, U = states(model, 2)
    condition = np.linalg.cond(model.mass_matrix(Q)).max()
    for call in CALLS:
        together = getattr(model, call)(Q, V, U)
        exact = getattr(model, call)(Q[0], V[0], U[0], precision="extended")
        for own, known in zip(together, exact, strict=True):
            bound = 40 * model.nv * EPS * (condition if call.startswith("forward") else 1)
            assert np.abs(own[0] - known).max() <= bound * np.abs(known).max()
        for b in range(2):
            for own, alone in zip(together, getattr(model, call)(Q[b], V[b], U[b]), strict=True):
                np.testing.assert_array_equal(own[b], alone)


@pytest.mark.parametrize("name", ["tree of ball", "tree of planar", "rotors", "g1"])
@pytest.mark.parametrize("call", CALLS)
def test_remainders_of_packs(name, call):
    model = MODELS[name]
    Q, V, U = states(model, 9)
    for count in (1, 3, 5, 9):
        for own, one in zip(
            getattr(model, call)(Q[:count], V[:count], U[:count]),
            getattr(model, call)(Q[count - 1], V[count - 1], U[count - 1]),
            strict=True,
        ):
            np.testing.assert_array_equal(own[count - 1], one)
    for own, other in zip(getattr(model, call)(Q[0], V, U), getattr(model, call)(Q[[0] * 9], V, U), strict=True):
        np.testing.assert_array_equal(own, other)
    assert [m.shape for m in getattr(model, call)(Q[:0], V[:0], U[:0])] == [(0, model.nv, model.nv)] * 3


def test_gravity_is_that_of_the_call():
    """∂T/∂q at rest is the derivative of the weights: zero without gravity, and linear in it."""
    model, still = pc.robots.panda(), np.zeros(7)
    q = model.random_state(3).q
    slopes = []
    for g in ((0, 0, 0), (0, 0, -9.8), (0, 0, -19.6)):
        model.gravity = g
        slopes.append(model.inverse_dynamics_derivatives(q, still, still).q)
    assert not slopes[0].any()
    np.testing.assert_allclose(slopes[2], 2 * slopes[1], rtol=0, atol=64 * EPS * np.abs(slopes[2]).max())


def test_singular_models_are_refused_as_ever():
    """A tip without mass: no kernel decides, and the general recursions name the hinge. The second call is the core's own."""
    arm = pc.Multibody("arm")
    arm.add_body("link", mass=1.0, com=(1, 0, 0))
    arm.add_body("tip", "link", axis=(1, 0, 0), position=(1, 0, 0))
    arm.take_warnings()
    zero = np.zeros((3, 2))
    for _ in range(2):
        with pytest.raises(pc.SingularHingeError, match="'tip'"):
            arm.forward_dynamics_derivatives(zero, zero, zero)
        d = arm.inverse_dynamics_derivatives(zero, zero, zero)
        np.testing.assert_array_equal(d.input, [[[1, 0], [0, 0]]] * 3)


def test_states_in_doubt_are_those_of_the_general_recursions():
    """The third pin turns a point mass that lies on its axis up to 10⁻⁶: kernels do not trust that pivot."""
    model = pc.Multibody("near")
    model.add_body("base", mass=1.0, com=(0.3, 0, 0), inertia=np.eye(3))
    model.add_body("arm", "base", axis=(0, 1, 0), position=(0.5, 0, 0), mass=0.0)
    model.add_body("ball", "arm", axis=(1, 0, 0), position=(0.4, 0, 0), mass=1.0, com=(1.0, 1e-6, 0))
    rng = np.random.default_rng(1)
    Q, V, U = rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), rng.normal(size=(5, 3))
    for own, exact in zip(
        model.forward_dynamics_derivatives(Q, V, U), model.forward_dynamics_derivatives(Q, V, U, precision="quad"), strict=True
    ):
        condition = np.linalg.cond(model.mass_matrix(Q)).max()
        assert np.abs(own - exact).max() <= 40 * 3 * EPS * condition * np.abs(exact).max()


@pytest.mark.parametrize("call", CALLS)
def test_plain_arrays_go_to_the_core(call, monkeypatch):
    model = pc.robots.panda()
    Q, V, U = states(model, 3)
    by_method = getattr(type(model), call).__wrapped__
    expected = [by_method(model, Q, V, U), by_method(model, Q[1], V[1], U[1])]
    with monkeypatch.context() as m:
        m.setattr(type(model), "_sensitivities", lambda self: pytest.fail("by the method"))
        found = [getattr(model, call)(Q, V, U), getattr(model, call)(Q[1], V[1], U[1])]
        with pytest.raises(pytest.fail.Exception):
            getattr(model, call)(list(Q[0]), V[0], U[0])
        with pytest.raises(pytest.fail.Exception):
            getattr(model, call)(Q, V, U, precision="extended")
    for own, known in zip(found, expected, strict=True):
        assert type(own) is DynamicsDerivatives
        for a, b in zip(own, known, strict=True):
            np.testing.assert_array_equal(a, b)
            assert a.flags.owndata and a.flags.writeable
    with pytest.raises(TypeError):
        getattr(model, call)(Q[0], V[0], U[0], out=np.empty((7, 7)))
    with pytest.raises(pc.ModelError, match="v"):
        getattr(model, call)(Q[0], np.full(7, np.nan), U[0])
