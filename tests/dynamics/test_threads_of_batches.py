"""`threads=`: the states of a batch shared out over threads, with the bits, the shapes and the errors of one."""

import threading

import numpy as np
import pytest

import pycraft as pc

CALLS = {
    "forward_dynamics": ("q", "v", "u"),
    "inverse_dynamics": ("q", "v", "u"),
    "bias_forces": ("q", "v"),
    "mass_matrix": ("q",),
    "mass_matrix_inverse": ("q",),
    "jacobian": ("frame", "q"),
    "pose": ("frame", "q"),
    "kinetic_energy": ("q", "v"),
    "potential_energy": ("q",),
    "inverse_dynamics_derivatives": ("q", "v", "u"),
    "forward_dynamics_derivatives": ("q", "v", "u"),
    "mass_matrix_derivative": ("q",),
    "christoffel": ("q",),
    "coriolis_matrix": ("q", "v"),
    "operational_space_compliance": ("frame", "q"),
    "kinetic_energy_derivatives": ("q", "v"),
    "hamiltonian_dynamics": ("q", "v", "u"),
    "innovations": ("q", "v", "u"),
    "momentum": ("q", "v"),
    "jacobian_dot": ("frame", "q", "v"),
    "jacobian_derivative": ("frame", "q"),
    "inertial_regressor": ("q", "v", "u"),
}
WITH_OUT = [
    "forward_dynamics",
    "inverse_dynamics",
    "bias_forces",
    "mass_matrix",
    "mass_matrix_inverse",
    "jacobian",
    "mass_matrix_derivative",
    "coriolis_matrix",
    "operational_space_compliance",
]


def arm():
    model = pc.tree([-1, 0, 1, 1], ["screw", "ball", "pin", "slider"], seed=3)
    model.gravity = (0.3, -9.0, 1.0)
    return model


def given(model, names, states):
    rng = np.random.default_rng(2)
    drawn = [model.random_state(seed) for seed in range(states)]
    arrays = {"q": np.array([s.q for s in drawn]), "v": np.array([s.v for s in drawn]), "u": rng.normal(size=(states, model.nv))}
    return [arrays.get(name, "body2") for name in names]


def assert_same(a, b):
    for x, y in zip(a, b, strict=True) if isinstance(a, tuple) else [(a, b)]:
        np.testing.assert_array_equal(x, y)


@pytest.mark.parametrize("call", CALLS)
def test_the_bits_of_one_thread(call):
    model = arm()
    for states in (133, 16, 1, 0):
        arrays = given(model, CALLS[call], states)
        if states == 0:
            arrays = [a if isinstance(a, str) else np.empty((0, n)) for a, n in zip(arrays, _widths(model, CALLS[call]), strict=True)]
        wanted = getattr(model, call)(*arrays)
        found = getattr(model, call)(*arrays, threads=3)
        assert type(found) is type(wanted)
        assert_same(found, wanted)


def _widths(model, names):
    return [{"q": model.nq}.get(name, model.nv) for name in names]


@pytest.mark.parametrize("call", WITH_OUT)
def test_out(call):
    model = arm()
    arrays = given(model, CALLS[call], 70)
    wanted = getattr(model, call)(*arrays)
    out = np.full_like(wanted, np.nan)
    assert getattr(model, call)(*arrays, threads=2, out=out) is out
    np.testing.assert_array_equal(out, wanted)


def test_out_in_the_memory_of_an_argument():
    model = arm()
    q, v, tau = given(model, CALLS["forward_dynamics"], 100)
    wanted = model.forward_dynamics(q, v, tau)
    np.testing.assert_array_equal(model.forward_dynamics(q, v, tau, threads=4, out=tau), wanted)


def test_every_kind_of_argument():
    model = arm()
    q, v, tau = given(model, CALLS["forward_dynamics"], 90)
    wanted = model.forward_dynamics(q, v[0], tau, form="ud", precision="extended")
    np.testing.assert_array_equal(model.forward_dynamics(q.tolist(), v[0], tau=tau, form="ud", precision="extended", threads=2), wanted)
    np.testing.assert_array_equal(model.forward_dynamics(tau=tau, v=v[0], q=q, form="ud", precision="extended", threads=2), wanted)
    state = model.random_state(1)
    np.testing.assert_array_equal(model.forward_dynamics(state, None, tau, threads=2), model.forward_dynamics(state, None, tau))
    np.testing.assert_array_equal(model.mass_matrix(threads=2), model.mass_matrix())


def test_states_are_shared_out(monkeypatch):
    """In other threads, in parts of whole packs."""
    model, seen = arm(), []
    ordinary = type(model)._calls
    monkeypatch.setattr(type(model), "_calls", lambda self: seen.append(threading.get_ident()) or ordinary(self))
    model.bias_forces(*given(model, CALLS["bias_forces"], 160), threads=2)
    assert len(seen) == 5 and threading.get_ident() not in seen  # parts of 32


def test_errors_name_the_state_among_all():
    model = arm()
    q, v, tau = given(model, CALLS["forward_dynamics"], 200)
    v[150, 2] = np.nan
    with pytest.raises(pc.ModelError) as one:
        model.forward_dynamics(q, v, tau)
    with pytest.raises(pc.ModelError) as several:
        model.forward_dynamics(q, v, tau, threads=4)
    assert str(several.value) == str(one.value)
    with pytest.raises(pc.ModelError, match="out="):
        model.forward_dynamics(q, q * 0 if q.shape == v.shape else np.zeros_like(v), tau, threads=4, out=np.empty((200, 3)))
    with pytest.raises(TypeError):
        model.forward_dynamics(q, v, tau, tau, threads=4)


@pytest.mark.parametrize("threads", [0, -1, 2.0, True, None, "2", 5000])
def test_how_many_threads(threads):
    with pytest.raises(pc.EvaluationError, match="threads="):
        arm().mass_matrix(np.zeros((4, 7)), threads=threads)
