"""Letters of rotors, of nodes with a star, and of loops without a model."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.on_loops import closed_models, said_of_loops
from pycraft.identities.parse import Statements


def _rotors(seed=3):
    model = pc.tree([-1, 0, 1, 1], ["pin", "ball", "universal", "free"], seed=seed, rotor_inertia=True)
    state = model.random_state(seed=1)
    model.q, model.v = state.q, state.v
    return model


def test_gyroscopic_forces_of_rotors_are_those_of_the_direct_calls():
    model = _rotors()
    b_J, C_J = (np.asarray(model.soa(name).dense()) for name in ("b_J", "C_J"))
    wanted = model.rotor_forces(model.v)
    assert np.abs(wanted).max() > 0.01 and np.abs(b_J.ravel() - wanted).max() < 1e-14
    assert np.abs(C_J + C_J.T).max() < 1e-15 and np.abs(C_J @ model.v - wanted).max() < 1e-14
    vdot = np.random.default_rng(0).normal(size=model.nv)
    values = {name: Statements(model.soa).letter(name, []) for name in ("T", "C_force")}
    tau = model.inverse_dynamics(model.q, model.v, vdot)
    bound = 1e-12 * np.abs(tau).max()  # some 100 roundings of the largest force
    assert np.abs(np.asarray(values["T"].value(vdot=vdot)).ravel() - tau).max() < bound
    assert np.abs(np.asarray(values["C_force"].dense()).ravel() - model.bias_forces(model.q, model.v)).max() < bound


def test_the_coriolis_matrix_is_the_christoffel_one_of_the_direct_call():
    model = _rotors()
    C = Statements(model.soa).read("C = ℳ").lhs
    assert np.abs(np.asarray(C.dense()) - model.coriolis_matrix(model.q, model.v)).max() < 1e-11


@pytest.mark.parametrize(
    "text",
    ["T = (ℳ+J)θ̈ + 𝒞", "Cθ̇ = 𝒞", "ℳ̇ - 2C = -(ℳ̇ - 2C)*", "ν = D⁻¹(T - b_J - Hz)", "θ̇*b_J = 0", "η̇ + Sη = m⁻¹T, S = m⁻¹Cm⁻* - ṁ*m⁻*"],
)
def test_equations_of_motion_hold_with_rotors(text):
    assert pc.check(text, _rotors(), states=2)


def test_where_rotors_gyrate_the_forces_are_not_left_out():
    for text in ("ν = D⁻¹(T - Hz)", "T = Hf + Jθ̈", "𝒞 = Hφ(Mφ*a + b)"):
        assert pc.check(text, _rotors(), states=1, search=False).verdict == "fails"
        assert pc.check(text, pc.tree([-1, 0, 1], ["pin", "slider", "pin"], seed=1, rotor_inertia=True), states=1)


def test_proofs_know_what_rotors_add():
    from pycraft.proofs import prove

    assert prove("T = (ℳ+J)θ̈ + 𝒞").hypotheses == [] and prove("Cθ̇ = 𝒞").hypotheses == [] and prove("C_J = -C_J*")
    assert prove("𝒞 = Hφ(Mφ*a + b)").hypotheses == ["J = 0"] and prove("ν = D⁻¹(T - b_J - Hz)").hypotheses == []
    with pytest.raises(pc.EvaluationError, match="not taken in proofs"):
        prove("Ṫ = 0")


@pytest.mark.parametrize(
    "text", ["B*(tool)φ*H* = 𝒥(tool)", r"\mathcal B^*(tool)\phi^*H^* = \mathcal J(tool)", "B*(0)V = 𝒥(0)θ̇", "B*('tool') = B(tool)*"]
)
def test_a_star_may_stand_before_the_name_of_a_node(text):
    model = _rotors()
    model.add_node("tool", "body2", position=(0.1, 0.2, 0.3))
    assert pc.check(text, model, states=1)


def test_a_star_before_a_bracket_multiplies():
    model = _rotors()
    assert pc.check("φ*(H*θ̇) = V", model, states=1)


@pytest.mark.parametrize(
    "text",
    [
        r"\mathcal M_r = X^*\mathcal M X",
        "ℳ_r = X_r*ℳ_gX_r",
        "H_r = X_r*H_g",
        "Q_sX_r = 0",
        "a_r = a_g + H_g*Ẋ_rθ̇_r",
        "ℳ_r > 0",
        "∂ℳ_r = ∂X_r*ℳX_r + X_r*∂ℳX_r + X_r*ℳ∂X_r",
    ],
)
def test_embedding_is_decided_on_random_closed_models(text):
    found = pc.check(text, states=5)
    assert found.verdict == "holds" and len(found.models) == 5


def test_what_is_false_of_loops_is_refuted():
    found = pc.check("ℳ_r = X_r*(ℳ + J)X_r", states=5)
    assert found.verdict == "fails" and any("first refuted on" in note for note in found.notes)
    for text in ("H_r = X_r*H", "QX_r = 1e-9 QQ*QX_r + ẊX"):
        with pytest.raises(pc.Error):
            pc.check(text, states=2)


def test_closed_models_are_closed_and_move():
    for model in closed_models(0):
        assert np.abs(model.loops.residual(model.q)).max() < 1e-9 and model.mobility(model.q).degrees_of_freedom > 0


def test_letters_of_loops_are_told_from_ones_own():
    assert said_of_loops("ℳ_r = X*ℳX") and said_of_loops("Qθ̇ = 0") and not said_of_loops("Q := φ; Q = φ") and not said_of_loops("A = φ")
    with pytest.raises(pc.ModelError, match="has no loops"):
        pc.check("ℳ_r = X*ℳX", pc.chain(3))
