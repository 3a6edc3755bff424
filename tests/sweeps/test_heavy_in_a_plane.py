"""Heavy loads on pins about one axis: `ud` and `square-root` keep their digits at every ratio, without a wider precision.

Three pins let a load go in their plane; across it nothing does. So all of it is felt across the plane, next to a light link in it, and what
mixes the two costs digits by the ratio of masses. The bound is as in the hard cases, 100 eps √N: some hundred roundings, whose sum grows
with the root of their number. That no wider residual is formed is asked of the kernels (cpp/tests/test_factored_kernels.cpp) and timed by
`pycraft bench`.
"""

import numpy as np
import pytest

import pycraft as pc
from campaigns import faint
from support.formulas import EPS

FACTORED = ("ud", "square-root")
RATIOS = (1.0, 1e4, 1e8, 1e10, 1e12, 1e16)
each_form = pytest.mark.parametrize("form", FACTORED)


def off_plane(k, heavy):
    """Mass properties of link k, its centre off the plane of the pins and its principal axes askew."""
    rng = np.random.default_rng(k)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    inertia = heavy * axes @ np.diag([0.08, 0.1, 0.12]) @ axes.T
    return dict(mass=heavy, com=(0.5, 0.1, 0.2), inertia=(inertia + inertia.T) / 2)


def load(ratio, n=8, *, heavy=None, axis=(0, 0, 1), tip="pin", tip_axis=None, parents=None, rotor=0.0):
    """A chain (or tree) of pins about one axis, under a gravity that has a part along it; link `heavy`, the last, is the load."""
    arm = pc.Multibody("load")
    heavy = n - 1 if heavy is None else heavy
    for k in range(n):
        parent = k - 1 if parents is None else parents[k]
        last = k == n - 1
        kind = tip if last else "pin"
        options = {"axis": axis if not last or tip_axis is None else tip_axis} if kind == "pin" else {}
        if rotor:
            options["rotor_inertia"] = rotor
        arm.add_body(
            f"link{k}", None if parent < 0 else f"link{parent}", kind, position=(1.0, 0.2, 0.3) if k else (0, 0, 0),
            **off_plane(k, ratio if k == heavy else 1.0), **options,
        )  # fmt: skip
    arm.gravity = (3.0, -9.81, 4.0)
    return arm


def rods(ratio, n=8, *, inertia=True):
    """`pc.chain` with the last rod heavier, with its inertia or in its mass alone."""
    arm = pc.chain(n)
    last = arm.bodies[f"body{n - 1}"]
    last.mass = ratio
    if inertia:
        last.inertia = ratio * np.asarray(last.inertia)
    arm.gravity = (3.0, -9.81, 4.0)
    return arm


MODELS = {
    "rods": rods,
    "4 rods": lambda ratio: rods(ratio, 4),
    "20 rods": lambda ratio: rods(ratio, 20),
    "mass alone": lambda ratio: rods(ratio, inertia=False),
    "off the plane": load,
    "about x": lambda ratio: load(ratio, axis=(1, 0, 0)),
    "about -y": lambda ratio: load(ratio, axis=(0, -1, 0)),
    "about a line askew": lambda ratio: load(ratio, axis=(0.6, 0, 0.8)),
    "in the middle": lambda ratio: load(ratio, heavy=5),
    "load on a pin of its own": lambda ratio: load(ratio, tip_axis=(0.48, 0.6, 0.64)),
    "tree": lambda ratio: load(ratio, parents=[-1, 0, 1, 2, 2, 4, 1, 5]),
}


def errors(arm, form, seeds=3):
    for seed in range(seeds):
        state, tau = arm.random_state(seed), np.random.default_rng(seed).normal(size=arm.nv)
        exact = faint.exact(arm, state.q, state.v, tau)
        yield faint.off(arm.forward_dynamics(state.q, state.v, tau, form=form), exact)


@each_form
@pytest.mark.parametrize("name", MODELS)
def test_no_digit_is_lost_at_any_ratio(name, form):
    for ratio in RATIOS:
        arm = MODELS[name](ratio)
        worst = max(errors(arm, form))
        assert worst <= 100 * EPS * np.sqrt(arm.nv), (ratio, worst)


@each_form
def test_batches_have_the_bits_of_single_states(form):
    """Nothing is left to the path of one state, whose bits these would be: packs and single states differ by nothing else."""
    arm = load(1e12)
    states = [arm.random_state(k) for k in range(9)]
    Q, V = np.array([s.q for s in states]), np.array([s.v for s in states])
    one_by_one = np.array([arm.forward_dynamics(q, v, v, form=form) for q, v in zip(Q, V, strict=True)])
    assert np.array_equal(arm.forward_dynamics(Q, V, V, form=form), one_by_one)


@pytest.mark.parametrize("rotor", [5e-324, 1e-300, 1e-3, 0.3, 30.0, 1e60])
@pytest.mark.parametrize("ratio", [1e8, 1e12, 1e16])
def test_rotors_cost_no_digit(ratio, rotor):
    """A rotor J keeps the share J/D of its hinge's row: `ud` scales the row by it, and takes no difference of two rows."""
    arm = load(ratio, rotor=rotor)
    assert max(errors(arm, "ud")) <= 100 * EPS * np.sqrt(arm.nv)


@each_form
@pytest.mark.parametrize("what", [dict(tip="ball"), dict(tip="free"), dict(rotor=0.3)], ids=["ball", "free", "rotors"])
@pytest.mark.parametrize("ratio", [1e8, 1e12, 1e16])
def test_what_mixes_the_plane_with_what_lies_across_keeps_six_digits(ratio, what, form):
    """A load that turns any way, and rotors, whose share of a row `square-root` rounds: doubts remain, and wrong answers do not."""
    assert max(errors(load(ratio, **what), form)) <= 1e-6


def test_one_refinement_that_finds_nothing_but_rounding_changes_no_bit():
    """The kernels drop corrections that may be rounding, as the report of the general recursions does."""
    arm = rods(1e3)
    for seed in range(6):
        state, tau = arm.random_state(seed), np.random.default_rng(seed).normal(size=arm.nv)
        plain = arm.forward_dynamics(state.q, state.v, tau)
        refined = arm.forward_dynamics(state.q, state.v, tau, refine=1)
        exact = faint.exact(arm, state.q, state.v, tau)
        assert faint.off(refined, exact) <= max(faint.off(plain, exact), 64 * EPS)
