"""Refined forward dynamics by kernels (cpp/kernels/refined_dynamics.h): residual, correction and its rounding, on every kind of hinge.
Errors are relative 2-norms against quad precision, which loses nothing here.

What is left of them is some roundings of the sweeps, their signs at random: eps √n and a few. Rounding of poses is in every value alike,
as no residual sees it."""

import numpy as np
import pytest

import pycraft as pc
from support.kernel_cases import MODELS, STATES, errors, heavy, states

EPS = np.finfo(float).eps
WAYS = {
    "one": {"refine": 1},
    "auto": {"refine": "auto"},
    "gather": {"refine": 1, "residual": "gather"},
    "gather, auto": {"refine": "auto", "residual": "gather"},
}
GRAVITY = (0.4, -1.0, -9.0)


@pytest.fixture(params=[name for name, model in MODELS.items() if model.nv])
def model(request):
    model = MODELS[request.param]
    model.gravity = GRAVITY
    return model


@pytest.mark.parametrize("way", WAYS)
def test_a_batch_is_its_states(model, way):
    Q, V, U = states(model)
    for count in (STATES, 3):
        together = model.forward_dynamics(Q[:count], V[:count], U[:count], **WAYS[way])
        for b in range(count):
            np.testing.assert_array_equal(together[b], model.forward_dynamics(Q[b], V[b], U[b], **WAYS[way]))


@pytest.mark.parametrize("way", WAYS)
def test_nothing_is_spoiled(model, way):
    given = states(model)
    floor = 32 * EPS * np.sqrt(model.nv)
    assert (errors(model, given, **WAYS[way]) <= np.maximum(3 * errors(model, given), floor)).all()


def rotors(model):
    for name in model.hinges:
        model.hinges[name].rotor_inertia = 0.01
    return model


BRANCHED = [-1, 0, 1, 1, 3, 4]
CORRECTED = {
    "pins": lambda: heavy(pc.tree(range(-1, 11), ["pin"] * 12, seed=1), 3e4),
    "pins with rotors": lambda: heavy(rotors(pc.tree(range(-1, 11), ["pin"] * 12, seed=1)), 3e4),
    "screws": lambda: heavy(pc.tree(range(-1, 9), ["screw"] * 10, seed=1), 3e4),
    "screws and pins with rotors": lambda: heavy(rotors(pc.tree(range(-1, 9), ["screw", "pin"] * 5, seed=1)), 3e4),
    "pins and sliders": lambda: heavy(pc.tree(range(-1, 11), ["pin", "slider"] * 6, seed=1), 3e4),
    "gimbals, branched": lambda: heavy(pc.tree(BRANCHED, ["pin", "gimbal", "screw", "gimbal", "pin", "gimbal"], seed=3), 1e5),
    "planar, branched": lambda: heavy(pc.tree(BRANCHED, ["pin", "planar", "screw", "planar", "pin", "planar"], seed=3), 1e6),
    "balls, branched": lambda: heavy(pc.tree(BRANCHED, ["pin", "ball", "screw", "ball", "pin", "ball"], seed=3), 1e4),
    "free, branched": lambda: heavy(pc.tree(BRANCHED, ["pin", "free", "screw", "free", "pin", "free"], seed=3), 1e3),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", CORRECTED)
def test_what_heavy_tips_lose_is_corrected(name, way):
    """Refinement restores the digits that the plain form has lost, in most states to rounding; in others corrections may be rounding."""
    model = CORRECTED[name]()
    given = states(model)
    lost, left = errors(model, given), errors(model, given, **WAYS[way])
    assert lost.max() > 8e-15
    rounding = 4 * EPS * np.sqrt(model.nv)
    assert np.median(left) <= rounding and (left <= np.maximum(lost, rounding)).all()


@pytest.mark.parametrize("name", CORRECTED)
def test_a_report_is_of_what_a_call_gives(name):
    model = CORRECTED[name]()
    given = Q, V, U = states(model)
    exact = model.forward_dynamics(*given, precision="quad")
    for way in WAYS.values():
        called = model.forward_dynamics(*given, **way)
        for b in range(STATES):
            report = model.refinement(Q[b], V[b], U[b], **way)
            np.testing.assert_array_equal(report["value"], called[b])
            assert np.linalg.norm(called[b] - exact[b]) <= 10 * report["error"] * np.linalg.norm(exact[b])


@pytest.mark.parametrize("way", WAYS)
def test_travel_changes_no_bit_of_a_joint(way):
    """A base that travels: nothing of its velocity is in a residual."""
    model = pc.robots.g1()
    model.gravity = GRAVITY
    Q, V, U = states(model)
    fast = V.copy()
    fast[:, 3:6] += 7.7e3
    still, moving = (model.forward_dynamics(Q, v, U, **WAYS[way]) for v in (V, fast))
    np.testing.assert_array_equal(still[:, 6:], moving[:, 6:])
    np.testing.assert_array_equal(still[:, :3], moving[:, :3])


def test_a_wide_gather_goes_below_the_floor_of_a_double():
    """A stretched chain of rods with the forces of ℳe₁: only forces count there. On bodies of hinges at any place, which links take up."""
    for model in (pc.chain(60), pc.chain(40)):
        q = v = np.zeros(model.nv)
        tau = model.inverse_dynamics(q, v, np.eye(model.nv)[0], precision="quad")
        given = [x[None] for x in (q, v, tau)]
        plain, gathered = (errors(model, given, **WAYS[way])[0] for way in ("auto", "gather, auto"))
        assert gathered < plain / 50


@pytest.mark.parametrize("ratio", [1e2, 1e6])
def test_general_recursions_agree(model, ratio):
    """`on_singular="minimum-norm"` takes them. Roundings of one state are a matter of chance: the largest of all states are compared."""
    model = heavy(model, ratio)
    given = states(model)
    floor = 32 * EPS * np.sqrt(model.nv)
    for way in WAYS.values():
        own, general = errors(model, given, **way), errors(model, given, on_singular="minimum-norm", **way)
        assert own.max() <= max(4 * general.max(), floor)


def test_what_does_not_contract_is_refused():
    """Kernels leave in doubt what refinement refuses; a batch names the state."""
    model = heavy(MODELS["chain of 30"], 1e16)
    Q, V, U = states(model)
    refused = []
    for b in range(STATES):
        try:
            model.forward_dynamics(Q[b], V[b], U[b], refine=1)
        except ArithmeticError as error:
            refused.append((b, str(error)))
    assert refused
    with pytest.raises(ArithmeticError, match=f"state {refused[0][0]}"):
        model.forward_dynamics(Q, V, U, refine=1)


def test_corrections_of_a_few_roundings_are_left_out():
    """A long chain: twelve roundings of the solution may all be the residual's, and the value keeps every bit."""
    model = pc.chain(100, seed=1)
    given = states(model)
    np.testing.assert_array_equal(model.forward_dynamics(*given, refine=1), model.forward_dynamics(*given))
