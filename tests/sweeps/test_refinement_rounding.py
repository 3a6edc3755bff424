"""Refinement spoils nothing and tells the truth: what may be rounding of the residual is no correction, and it counts in the error.

The rounding of a residual, carried through ℳ⁻¹Hφ, is bounded along the correction itself: cpp/algebra/trees/sweeps/residual_rounding.h.
"""

import re

import numpy as np
import pytest

import pycraft as pc
from campaigns import refinement as campaign
from support.descriptions import body, model, random_rotation, subhinge
from support.formulas import EPS
from support.mechanisms import every_kind

FORMS = campaign.FORMS
each_form = pytest.mark.parametrize("form", FORMS)


# ---------------------------------------------------------------------- the campaign


def run_campaign(seeds):
    faults, better = [], 0
    for seed in seeds:
        for row, found in campaign.rows(seed):
            faults += [(fault, row) for fault in found]
            better += not row["refused"] and row["unrefined"] > 3 * max(row["refined"], 10 * EPS * row["size"])
    assert not faults, f"{len(faults)}, the first: {faults[0]}"
    return better


def test_no_value_is_spoiled_and_no_error_understated():
    """Three of each family; and refinement is of use, or leaving everything as it is would pass."""
    assert run_campaign(range(3 * len(campaign.FAMILIES))) > 50


@pytest.mark.slow
def test_no_value_is_spoiled_and_no_error_understated_in_three_hundred_cases():
    """A part of the five thousand of `make campaigns`."""
    assert run_campaign(range(300)) > 500


@pytest.mark.parametrize("seed", [807, 1073, 1647, 1808])
def test_eliminations_are_refined_to_rounding(seed):
    """(ℳ + D)⁻¹x of nearly stretched chains: corrections from a residual in double were rounding, 4 times the error of before them."""
    run_campaign([seed])
    _, multibody, q, _, tau = campaign.case(seed)
    H, phi, M, I = multibody.soa("H phi M I")
    shifted = (H @ phi @ M @ phi.T @ H.T + 0.1 * I).inv()
    exact = shifted.at(q, precision=50) @ tau
    for way in campaign.WAYS:
        assert np.linalg.norm(shifted.at(q, **way) @ tau - exact) <= 4 * EPS * np.linalg.norm(exact)


@pytest.mark.parametrize("seed", [4214, 1312, 3818])
def test_a_wide_gather_knows_the_rounding_of_poses(seed):
    """Forces gathered wider by poses and hinge maps in double: a planar hinge's own, turned, made 16 times the error that was reported, and
    corrections within it made values that were right by luck five times worse."""
    run_campaign([seed])


# ---------------------------------------------------------------------- single cases


def bus(speed, links=3, light=0.05, heavy=2000.0, seed=0):
    """A satellite bus with light links, at a speed."""
    rng = np.random.default_rng(seed)
    inertia = np.diag([0.2, 0.3, 0.4])
    made = [body("bus", -1, [subhinge("free")], heavy, [0.1, 0.2, 0.3], heavy * inertia)]
    for k in range(links):
        made.append(body(f"link{k}", k, [subhinge("pin", rng.normal(size=3))], light, [0.1, 0, 0], 0.01 * light * inertia, [0.3, 0, 0.1],
                         random_rotation(rng)))  # fmt: skip
    multibody = pc.Multibody.from_description(model(made))
    state = multibody.random_state(seed)
    v = 0.1 * state.v
    v[3:6] = speed * np.array([0.6, 0.0, 0.8])
    return multibody, state.q, v, 0.01 * rng.normal(size=multibody.nv)


@each_form
def test_a_satellite_keeps_its_digits(form):
    """Correct to 1e-15 or not, the value is as good refined as it was, and the report covers it."""
    multibody, q, v, tau = bus(7700.0)
    exact = multibody.forward_dynamics(q, v, tau, form="ud", precision=50)
    off = lambda value: np.linalg.norm(value - exact) / np.linalg.norm(exact)
    unrefined = off(multibody.forward_dynamics(q, v, tau, form=form))
    for way in campaign.WAYS:
        found = multibody.refinement(q, v, tau, form=form, **way)
        assert off(found["value"]) <= max(3 * unrefined, campaign.ROUNDINGS)
        assert off(found["value"]) <= 10 * found["error"]


@each_form
@pytest.mark.parametrize("residual", ["same", "gather", "wider"])
def test_what_coasts_or_stands_still_is_an_answer(residual, form):
    """Accelerations of zero: nothing overflows, nothing is refused, and no report of digits where there is none."""
    coasting, q, v, tau = bus(7500.0, links=0)
    v[:3] = 0
    standing = every_kind()
    q0, zero = standing.q, np.zeros(standing.nv)
    held = standing.bias_forces(q0, zero)
    for multibody, draw, size in ((coasting, (q, v, 0 * tau), 7500.0**2), (standing, (q0, zero, held), 1e3)):
        for refine in (1, "auto"):
            found = multibody.refinement(*draw, form=form, refine=refine, residual=residual)
            assert np.abs(found["value"]).max() <= 1e4 * EPS * size
            left = np.linalg.norm(found["value"] - multibody.forward_dynamics(*draw, form="ud", precision=50))
            assert not left or left <= 10 * found["error"] * np.linalg.norm(found["value"])


def test_a_report_without_a_correction_is_none():
    multibody, *draw = bus(1.0)
    assert multibody.refinement(*draw, refine=0)["error"] is None
    assert multibody.refinement(*draw, refine=1)["error"] > 0


def test_nothing_is_applied_below_the_floor():
    """At 7.7 km/s the residual in double says less than `ud` knows: the value is the unrefined one to the last bit, or a better one."""
    multibody, q, v, tau = bus(7700.0)
    exact = multibody.forward_dynamics(q, v, tau, form="ud", precision=50)
    plain, refined = (multibody.forward_dynamics(q, v, tau, form="ud", refine=refine) for refine in (0, 1))
    assert np.array_equal(plain, refined) or np.linalg.norm(refined - exact) <= np.linalg.norm(plain - exact)


# ---------------------------------------------------------------------- forces gathered in a wider precision


@pytest.mark.parametrize(("n", "bound"), [(100, 5e-12), (300, 2e-10)])
def test_a_wide_gather_is_enough_for_a_stretched_chain(n, bound):
    """T = ℳe₁: only forces count, and no correction in double helps."""
    rods, zero = pc.chain(n), np.zeros(n)
    tau = rods.inverse_dynamics(zero, zero, np.eye(n)[0], precision="quad")
    exact = rods.forward_dynamics(zero, zero, tau, form="ud", precision=50)
    off = lambda value: np.linalg.norm(value - exact) / np.linalg.norm(exact)
    H, phi, M, J = rods.soa("H phi M J")
    inverse = (H @ phi @ M @ phi.T @ H.T + J).inv()
    for form in FORMS:
        plain = off(rods.forward_dynamics(zero, zero, tau, form=form))
        assert plain > 100 * bound
        found = rods.refinement(zero, zero, tau, form=form, refine=1, residual="gather")
        assert off(found["value"]) <= bound and off(found["value"]) <= 10 * found["error"]
        assert off(rods.forward_dynamics(zero, zero, tau, form=form, refine=1)) > 10 * bound
        for way in (dict(refine=1), dict(refine="auto")):
            assert off(inverse.at(zero, form=form, residual="gather", **way) @ tau) <= bound
    # Columns of ℳ⁻¹ are right to rounding; their product with τ rounds again, at |ℳ⁻¹||τ|, and is no better than the unrefined answer.
    columns = inverse.at(zero, form="ud", precision="quad").dense()
    found = rods.mass_matrix_inverse(zero, refine=1, residual="gather")
    assert np.linalg.norm(found - columns) <= 4 * EPS * np.linalg.norm(columns)  # an error that small is not corrected


def test_a_wide_gather_knows_every_term():
    """Velocities, gravity, rotors, branches, every hinge: no digit is lost by it."""
    for rotor in (False, True):
        multibody = every_kind(rotor)
        tau = np.random.default_rng(3).normal(size=multibody.nv)
        exact = multibody.forward_dynamics(multibody.q, multibody.v, tau, form="ud", precision=50)
        for precision, eps in (("single", 2.0**-23), ("double", EPS), ("extended", EPS)):
            errors = []
            for way in (dict(), dict(refine=2, residual="gather"), dict(refine=2, residual="wider")):
                got = multibody.forward_dynamics(multibody.q, multibody.v, tau, precision=precision, **way)
                errors.append(np.linalg.norm(got - exact) / np.linalg.norm(exact))
            assert errors[1] <= max(3 * errors[0], 10 * eps) and errors[2] <= max(3 * errors[0], 10 * eps)


def test_what_is_wider_than_anything_is_refused():
    rods = pc.chain(2)
    with pytest.raises(pc.EvaluationError, match="'gather': nothing is wider than 100 digits"):
        rods.forward_dynamics([0, 0], [0, 0], [1, 0], refine=1, residual="gather", precision=100)


# ---------------------------------------------------------------------- ℳ⁻¹𝒥*


@pytest.mark.parametrize("rotor", [False, True])
def test_accelerations_of_forces_at_a_node_never_gather_by_phi(rotor):
    """ℳ⁻¹𝒥* is planned as [I-HψK]*D⁻¹HψB, and 𝒥ℳ⁻¹ as its transpose: digits that φ would lose beside [I-HψK] are kept."""
    multibody = every_kind(rotor) if rotor else pc.chain(60)
    q = multibody.q
    soa = multibody.soa
    H, phi, M, J = soa("H phi M J")
    inverse = (H @ phi @ M @ phi.T @ H.T + J).inv()
    jacobian = soa.Jacobian([list(multibody.bodies)[-1]])
    forward, transposed = inverse @ jacobian.T, jacobian @ inverse
    exact = np.asarray(forward.at(q, form="ud", precision="quad").dense(dtype=object), float)
    size = np.linalg.norm(exact)
    for form in FORMS:
        assert np.linalg.norm(forward.at(q, form=form).dense() - exact) <= 20 * EPS * np.sqrt(multibody.nv) * size
        assert np.linalg.norm(transposed.at(q, form=form).dense().T - exact) <= 20 * EPS * np.sqrt(multibody.nv) * size
    for op in (forward, transposed):
        steps = str(op.explain()).split("\n", 3)[-1]
        assert "ψ (tip to base)" in steps and not re.search("(?<!E_)φ", steps), steps


# ---------------------------------------------------------------------- factored forms and what has no digit


def bob(share, seed):
    """A point at the end of a thin rod, askew, on a ball hinge on a carriage: inertia `share` of mc² about the rod's own axis."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    inertia = share * (np.outer(axis, axis) + 0.5 * (np.eye(3) - np.outer(axis, axis)))
    made = [body("carriage", -1, [subhinge("free")], 1.0, [0.1, 0.2, 0.0], np.eye(3)),
            body("bob", 0, [subhinge("ball")], 1.0, axis, (inertia + inertia.T) / 2, rng.normal(size=3))]  # fmt: skip
    return pc.Multibody.from_description(model(made, (0, 0, -9.81)))


@pytest.mark.parametrize("form", FORMS)
def test_a_bob_on_a_ball_is_right_or_refused(form):
    """D has its digits when G has none left: what the carriage's motion makes of the bob's spin is judged too."""
    answers = {}
    for decade in range(2, 28, 2):
        for seed in range(6):
            multibody = bob(10.0**-decade, seed)
            state = multibody.random_state(seed)
            for tau in (np.zeros(multibody.nv), np.random.default_rng(seed).normal(size=multibody.nv)):
                try:
                    got = multibody.forward_dynamics(state.q, 0 * state.v, tau, form=form)
                except pc.SingularHingeError:
                    continue
                exact = multibody.forward_dynamics(state.q, 0 * state.v, tau, form="ud", precision=50)
                assert np.linalg.norm(got - exact) <= 0.5 * np.linalg.norm(exact), (decade, seed)
                answers[decade] = answers.get(decade, 0) + 1
    assert all(answers.get(decade) == 12 for decade in (range(2, 10, 2) if form == "fast" else range(2, 13, 2)))
