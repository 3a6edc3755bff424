"""Hybrid dynamics and terms on the diagonal of D, as scenes ask for them: against dense computations, and the calls at their extremes."""

import numpy as np
import pytest

import pycraft as pc
from support.descriptions import KINDS
from support.kernel_cases import MODELS
from support.mechanisms import SEQUENCES, every_kind, massless_inner_bodies, rotors_on_some, with_hinges
from support.oracle import ROUNDING, agree
from support.rotors import crossed
from support.scenes import hybrid_dynamics, prescribing, some_subhinges, subhinges

FORMS = ["fast", "ud", "square-root"]
WAYS = [dict(form=form) for form in FORMS] + [
    dict(refine=1),
    dict(refine=2, residual="gather"),
    dict(refine="auto", residual="wider"),
    dict(form="ud", refine=1),
    dict(precision="extended"),
    dict(precision="quad", form="square-root"),
]


def scene_of(model, tau, effects=(), **how):
    """The model's own gravity, forces tau, and more."""
    scene = pc.Scene(model, **how).add(pc.effects.Gravity(model.gravity), *effects)
    return scene.add(pc.effects.TorqueSource(tau)) if model.nv else scene


def check(model, prescribed, seed=0, **how):
    rng = np.random.default_rng(seed)
    state = model.random_state(seed + 5)
    tau, given = rng.uniform(-1, 1, (2, model.nv))
    found = scene_of(model, tau, [prescribing(model, prescribed, given)], **how).evaluate(state.q, state.v)
    vdot, forces, condition = hybrid_dynamics(model, state.q, state.v, tau, given, prescribed)
    agree(found.vdot, vdot, ROUNDING * condition)
    needed = np.zeros(model.nv)
    needed[prescribed] = (forces - tau)[prescribed]
    agree(found.forces["prescribed"], needed, ROUNDING * condition)


@pytest.mark.parametrize("kind", [k for k in [*KINDS, *SEQUENCES] if k != "weld"])
@pytest.mark.parametrize("shape", ["chain", "tree", "forest"])
def test_every_kind_of_hinge(kind, shape):
    model = with_hinges(kind, shape)
    for seed in range(4):
        check(model, some_subhinges(model, np.random.default_rng(seed)), seed)
    for _, _, numbers in subhinges(model):  # each alone
        check(model, numbers)


@pytest.mark.parametrize("how", WAYS, ids=str)
def test_every_form_and_precision(how):
    for seed, rotors in enumerate((False, True)):
        model = every_kind(rotor_inertia=rotors)
        check(model, some_subhinges(model, np.random.default_rng(seed)), seed, **how)


@pytest.mark.parametrize("how", WAYS[:5], ids=str)
def test_hinges_with_rotors_and_bodies_without_mass(how):
    for make in (massless_inner_bodies, rotors_on_some):
        model = pc.Multibody.from_description(make())
        for seed in range(5):
            check(model, some_subhinges(model, np.random.default_rng(seed)), seed, **how)


def test_a_hinge_without_inertia_may_be_prescribed():
    model = pc.Multibody("tip")
    model.add_body("a", mass=1.0, com=(1, 0, 0))
    model.add_body("b", "a", mass=0.0, position=(1, 0, 0))
    model.take_warnings()
    scene = pc.Scene(model)
    with pytest.raises(pc.SingularHingeError, match="'b'"):
        scene.evaluate([0.1, 0.2], [0.3, 0.4])
    found = scene.add(pc.effects.Prescribed("b", lambda t: (0.0, 0.0, 3.0))).evaluate([0.1, 0.2], [0.3, 0.4])
    assert found.vdot.tolist() == [0.0, 3.0] and found.forces["prescribed"].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("name", [name for name, model in MODELS.items() if model.nv])
def test_nothing_prescribed_is_forward_dynamics_and_all_is_inverse(name):
    """Bit for bit; with kernels and without."""
    model = MODELS[name]
    state = model.random_state(2)
    tau, given = np.random.default_rng(3).uniform(-1, 1, (2, model.nv))
    for how in (dict(), dict(form="ud"), dict(precision="quad")):
        found = scene_of(model, tau, **how).evaluate(state.q, state.v)
        assert np.array_equal(found.vdot, model.forward_dynamics(state.q, state.v, tau, **how))
        scene = pc.Scene(model, **how).add(pc.effects.Gravity(model.gravity), prescribing(model, range(model.nv), given))
        found = scene.evaluate(state.q, state.v)
        assert np.array_equal(found.vdot, given)
        precision = {k: x for k, x in how.items() if k == "precision"}
        assert np.array_equal(found.forces["prescribed"], model.inverse_dynamics(state.q, state.v, given, **precision))


def test_kernels_and_recursions_agree():
    """The same scene by both: in the plain form kernels take it, in quad precision nothing does."""
    for name in ("panda", "g1", "tree of ball", "tree of free", "tree of screw", "tree of planar"):
        model = MODELS[name]
        state, rng = model.random_state(4), np.random.default_rng(5)
        chosen = some_subhinges(model, rng)
        tau, given = rng.uniform(-1, 1, (2, model.nv))
        effects = [prescribing(model, chosen, given)]
        plain, quad = (scene_of(model, tau, effects, precision=p).evaluate(state.q, state.v) for p in ("double", "quad"))
        assert (
            "by kernels" in scene_of(model, tau, effects).explain()
            and "by recursions" in scene_of(model, tau, effects, precision="quad").explain()
        )
        agree(plain.vdot, quad.vdot, 1e-11)
        agree(plain.forces["prescribed"], quad.forces["prescribed"], 1e-11)


# Terms on the diagonal of D -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", WAYS, ids=str)
def test_rotors_that_a_scene_adds(how):
    """ℳ + J with J on every coordinate, of balls and free hinges too; in addition to the model's own."""
    for rotors in (False, True):
        model, rng = every_kind(rotor_inertia=rotors), np.random.default_rng(1)
        state, (tau, zero) = model.random_state(3), rng.uniform(-1, 1, (2, model.nv))
        inertia, ratio = rng.uniform(0.1, 2, model.nv), rng.uniform(-3, 3, model.nv)
        scene = scene_of(model, tau, [pc.effects.RotorInertia(inertia, gear_ratio=ratio)], **how)
        found = scene.evaluate(state.q, state.v)
        gyroscopic = crossed(model, state.v) @ (inertia * ratio**2 * state.v)
        vdot, _, condition = hybrid_dynamics(model, state.q, state.v, tau - gyroscopic, zero, [], inertia * ratio**2)
        agree(found.vdot, vdot, ROUNDING * condition)
        agree(found.forces["rotor_inertia"], -inertia * ratio**2 * vdot - gyroscopic, ROUNDING * condition)


def test_rotors_by_kernels_are_a_models_own():
    """The same bits, whether the model has them or the scene."""
    model = pc.tree([-1, 0, 1, 0], ["pin", "slider", "pin", "screw"], seed=6)
    state, tau = model.random_state(1), np.array([0.3, -0.2, 0.5, 0.1])
    found = scene_of(model, tau, [pc.effects.RotorInertia([0.7, 0.1, 0.4, 0.2])]).evaluate(state.q, state.v)
    for hinge, inertia in zip(model.hinges.values(), (0.7, 0.1, 0.4, 0.2), strict=True):
        hinge.rotor_inertia = inertia
    assert np.array_equal(found.vdot, model.forward_dynamics(state.q, state.v, tau))


@pytest.mark.parametrize("how", WAYS[:6], ids=str)
def test_a_step_that_is_taken_implicitly(how):
    """(ℳ + J + hC + h²K) v̇ = T - C v - K (q + h v - rest), and without a step C and K are forces alone."""
    model, rng = with_hinges("screw", "tree"), np.random.default_rng(2)
    state, (tau, zero) = model.random_state(1), rng.uniform(-1, 1, (2, model.nv))
    C, K, rest = rng.uniform(0, 2, (3, model.nv))
    effects = [pc.effects.ImplicitDamping(C), pc.effects.ImplicitSpring(K, rest), pc.effects.RotorInertia(0.3)]
    scene = scene_of(model, tau, effects, **how)
    for h in (0.0, 0.05, 0.4, 0.0):
        pull = -C * state.v - K * (state.q + h * state.v - rest)
        vdot, _, condition = hybrid_dynamics(model, state.q, state.v, tau + pull, zero, [], 0.3 + h * C + h * h * K)
        found = scene.evaluate(state.q, state.v, step=h)
        agree(found.vdot, vdot, ROUNDING * condition)
        agree(sum(found.forces.values()), model.inverse_dynamics(state.q, state.v, vdot) + (found.forces["gravity"]), ROUNDING * condition)


def test_prescribed_coordinates_beside_implicit_ones():
    model = with_hinges("pin", "tree")
    state, rng = model.random_state(1), np.random.default_rng(3)
    tau, given = rng.uniform(-1, 1, (2, model.nv))
    scene = scene_of(model, tau, [prescribing(model, [1, 3], given), pc.effects.ImplicitDamping(2.0)])
    h, free = 0.2, np.isin(np.arange(model.nv), [1, 3], invert=True)
    vdot, forces, condition = hybrid_dynamics(model, state.q, state.v, tau - 2 * state.v, given, [1, 3], np.where(free, h * 2.0, 0))
    found = scene.evaluate(state.q, state.v, step=h)
    agree(found.vdot, vdot, ROUNDING * condition)
    agree(found.forces["prescribed"][~free], (forces - tau + 2 * state.v)[~free], ROUNDING * condition)
