"""Iterative refinement: the residual by inverse dynamics, a correction by the kept factors, the correction's size as error estimate.

Errors are relative 2-norms of accelerations against 60 digits, `exact_accelerations`: the recursion of the reference body by body.

Bounds. A correction contracts what it finds by about ρ, the unrefined relative error: 10 ρ is allowed, as the error of one draw is not
the largest of all. It ends at a floor of one rounding of the sweeps, 100 eps √n on folded chains (measured: 4 eps). ρ itself, in `fast`,
is what D(k) loses, eps times the ratio of masses: at most 100 times that over the draws here, from one link to the next where the ratio
grows along the chain, with an allowance of 10 or 100 for what the others add. `ud` and `square-root` are at the floor at any ratio.
A stretched chain is another matter: the residual itself loses 1e-9 there, in every form, unless it is computed one precision up.
"""

import re

import mpmath
import numpy as np
import pytest

import pycraft as pc
from support.descriptions import body, model, random_description, random_rotation, random_subhinges, subhinge
from support.exact_accelerations import DIGITS, LINK, chain, drawn, exact_accelerations, floor, heavy_tip, largest_error, relative_error
from support.forms import FORMS
from support.formulas import EPS
from support.mechanisms import build
from support.oracle import reference

each_form = pytest.mark.parametrize("form", FORMS)


def rods(n):
    """A planar chain of uniform rods of 1 m and 1 kg, stretched at q = 0."""
    return pc.chain(n)


def test_exact_accelerations_are_the_references():
    for kinds, with_rotors in ((["free", "gimbal", "screw"], True), (["ball", "pin", "slider"], False)):
        description = random_description([-1, 0, 0], kinds, 2, with_rotors)
        multibody = build(description, 1)
        tau = np.random.default_rng(0).normal(size=multibody.nv)
        with mpmath.workdps(DIGITS):
            expected = reference.forward_dynamics(description, multibody.q * mpmath.mpf(1), multibody.v, tau)
            assert relative_error(exact_accelerations(multibody, multibody.q, multibody.v, tau), expected) < 1e-54


# ---------------------------------------------------------------------- heavy tips


CASES = {
    "tip 1e6": lambda **o: heavy_tip(1e6, **o),
    "tip 1e9": lambda **o: heavy_tip(1e9, **o),
    "tip 1e12": lambda **o: heavy_tip(1e12, **o),
    "mass x10 a link": lambda **o: chain([10.0**k for k in range(12)], [0.1] * 12, **o),
    "mass x10, length x2": lambda **o: chain([10.0**k for k in range(12)], [0.1 * 2**k for k in range(12)], **o),
    "shrinking tenfold": lambda **o: chain([10.0**-k for k in range(12)], [0.1] * 12, **o),
    "alternating 1e6": lambda **o: chain([1.0, 1e6] * 5, [0.1] * 10, **o),
}
RATIO = {"tip 1e6": 1e6, "tip 1e9": 1e9, "tip 1e12": 1e12, "mass x10 a link": 1e4, "mass x10, length x2": 4e5}
SEEDS = 4


@pytest.fixture(scope="module", params=CASES)
def case(request):
    """(name, model, draws with their exact accelerations): at speed, under gravity."""
    multibody = CASES[request.param]()
    draws = [drawn(multibody, seed) for seed in range(SEEDS)]
    return request.param, multibody, [(draw, exact_accelerations(multibody, *draw)) for draw in draws]


def errors(multibody, draws, **way):
    """The relative error of every draw; infinite where it is refused."""
    made = []
    for draw, exact in draws:
        try:
            made.append(relative_error(multibody.forward_dynamics(*draw, **way), exact))
        except ArithmeticError:
            made.append(np.inf)
    return np.array(made)


@pytest.mark.parametrize("form", ["ud", "square-root"])
def test_forms_with_factors_need_no_refinement(case, form):
    name, multibody, draws = case
    found = errors(multibody, draws, form=form)
    assert found.max() <= floor(multibody.nv), f"{name}: {found}"


@pytest.mark.parametrize("kind", ["universal", "gimbal", "ball", "planar"])
def test_heavy_tips_on_hinges_of_several_coordinates(kind):
    """Axes askew and points off the origin. `ud` is at the floor at any ratio; `square-root` may lose the root of it, rows of one hinge
    being of unlike weight."""
    for ratio in (1e6, 1e12):
        multibody = pc.Multibody.from_description(askew([kind, "pin", kind, kind], ratio))
        for seed in range(2):
            state = multibody.random_state(seed)
            tau = np.random.default_rng(seed).normal(size=multibody.nv)
            exact = multibody.forward_dynamics(state.q, state.v, tau, precision=50)
            error = lambda **way: np.linalg.norm(
                multibody.forward_dynamics(state.q, state.v, tau, **way) - exact) / np.linalg.norm(exact)  # noqa: B023 - called before the next  # fmt: skip
            assert error(form="ud") <= floor(multibody.nv)
            assert error(form="square-root") <= floor(multibody.nv) + EPS * np.sqrt(ratio)
            assert error(form="square-root", refine=1) <= floor(multibody.nv)


def askew(kinds, ratio):
    """A chain of links of 0.1 m on random hinges, the last link heavier."""
    rng = np.random.default_rng(len(kinds[0]))
    made = []
    for k, kind in enumerate(kinds):
        m = ratio if k == len(kinds) - 1 else 1.0
        steps = [{**s, "point": 0.1 * s["point"]} for s in random_subhinges(kind, rng)]
        made.append(body(f"link{k}", k - 1, steps, m, [0.01, 0.005, 0.05], 0.01 * m * LINK, [0.02, 0.01, 0.1], random_rotation(rng)))
    return model(made, (0, 0, -9.81))


def test_fast_loses_what_the_masses_differ_by(case):
    """eps times the ratio, within 100: a bound that says when to refine; and not nothing, or the case would be no test of refinement."""
    name, multibody, draws = case
    ratio = RATIO.get(name, 1e6)
    found = errors(multibody, draws)
    assert found.max() <= 100 * EPS * ratio, f"{name}: {found}"
    if ratio >= 1e6 and name in RATIO:
        assert found.max() > 10 * EPS


@pytest.mark.parametrize("residual", ["same", "wider"])
def test_each_correction_contracts_by_the_unrefined_error(case, residual):
    name, multibody, draws = case
    unrefined = errors(multibody, draws)
    for refine in (1, 2):
        found = errors(multibody, draws, refine=refine, residual=residual)
        bound = np.maximum(unrefined * (10 * unrefined.max()) ** refine, floor(multibody.nv))  # one draw's error may be small by luck
        assert (found <= bound).all(), f"{name}, {refine} corrections: {found} of {unrefined}, bounds {bound}"
    assert errors(multibody, draws, refine="auto", residual=residual).max() <= floor(multibody.nv)


@each_form
def test_refinement_never_makes_it_worse(case, form):
    name, multibody, draws = case
    unrefined = errors(multibody, draws, form=form)
    for refine in (1, "auto"):
        found = errors(multibody, draws, form=form, refine=refine)
        assert (found <= np.maximum(unrefined, floor(multibody.nv))).all(), f"{name}: {found} of {unrefined}"


@pytest.mark.parametrize("folded", [True, False], ids=["folded", "straight"])
def test_a_hundred_links(folded):
    """Against 50 digits of the core, which are mpmath's on ten links."""
    short = heavy_tip(1e9)
    draw = drawn(short, 0)
    assert relative_error(short.forward_dynamics(*draw, precision=50), exact_accelerations(short, *draw)) <= EPS
    multibody = heavy_tip(1e9, 100) if folded else heavy_tip(1e9, 100, gravity=(0, 0, 0))
    q, v, tau = drawn(multibody, 1)
    q, v = q * folded, v * folded  # straight, forces of 1e9 that cancel would be another case: the next one
    exact = multibody.forward_dynamics(q, v, tau, precision=50)
    error = lambda **way: np.linalg.norm(multibody.forward_dynamics(q, v, tau, **way) - exact) / np.linalg.norm(exact)
    assert 1e-12 < error() < 1e-5
    assert error(refine=1) <= floor(100) and error(form="ud") <= floor(100)
    assert error(form="square-root") <= 10 * floor(100) and error(form="square-root", refine=1) <= floor(100)


@pytest.mark.parametrize("n", [50, 100])
def test_a_stretched_chain_needs_a_wider_residual(n):
    """T = ℳe₁: the residual in double is no better than the answer; one precision up it is 300 times better at least."""
    multibody = rods(n)
    q, zero, first = np.zeros(n), np.zeros(n), np.eye(n)[0]
    tau = multibody.inverse_dynamics(q, zero, first, precision="quad")
    exact = multibody.forward_dynamics(q, zero, tau, precision=50)
    error = lambda **way: np.linalg.norm(multibody.forward_dynamics(q, zero, tau, **way) - exact)
    for form in FORMS:
        unrefined, same, wider = error(form=form), error(form=form, refine=2), error(form=form, refine=2, residual="wider")
        assert 1e-12 < unrefined < 1e-7 and wider <= max(unrefined / 300, floor(n))
        assert same > wider


def test_quad_refined_once_has_the_digits_of_quad():
    """A correction at every precision, the residual two rungs up included."""
    multibody = heavy_tip(1e12)
    q, _, x = drawn(multibody, 3)
    exact = exact_accelerations(heavy_tip(1e12, gravity=(0, 0, 0)), q, 0 * x, x)
    H, phi, M = multibody.soa("H phi M")
    inverse = (H @ phi @ M @ phi.T @ H.T).inv()
    with mpmath.workdps(DIGITS):
        for precision, eps in (("extended", 2.0**-63), ("quad", 2.0**-112)):
            value = lambda **way: inverse.at(q, precision=precision, **way).dense(dtype=object) @ x  # noqa: B023 - called before the next
            assert relative_error(value(refine=1), exact) <= floor(10, eps)
            assert relative_error(value(refine=1, residual="wider"), exact) <= floor(10, eps)
            assert relative_error(value(), exact) > 10 * floor(10, eps)


# ---------------------------------------------------------------------- the estimate, and when it gives up


def test_the_correction_is_the_error(case):
    """The first correction is the unrefined error, to the share that it leaves; the last one bounds the error of the value up to
    rounding."""
    name, multibody, draws = case
    for draw, exact in draws:
        unrefined = largest_error(multibody.forward_dynamics(*draw), exact)
        found = multibody.refinement(*draw, refine=2)
        assert found["steps"] == len(found["corrections"]) <= 2  # none after one that is down to rounding
        first, last = found["corrections"][0], found["corrections"][-1]
        off = abs(first - unrefined)
        assert off <= 10 * unrefined**2 + floor(multibody.nv), f"{name}: correction {first}, error {unrefined}"
        assert largest_error(found["value"], exact) <= max(last, floor(multibody.nv))
        assert np.array_equal(found["value"], multibody.forward_dynamics(*draw, refine=2))


def test_the_correction_tells_where_refinement_is_stuck():
    """A couple on a tip 1e12 times heavier moves next to nothing: the accelerations are what cancels, and a residual in double has no
    digit more to give. The corrections stall, and their size is the error all the same; one precision up they do not. No form is spared:
    half a unit in the last place of the couples moves what they leave as far."""
    rod = dict(com=[0.5, 0, 0])
    made = [body(f"b{k}", k - 1, [subhinge("pin")], m, inertia=m * np.diag([0, 1 / 12, 1 / 12]), position=[k > 0, 0, 0], **rod)
            for k, m in enumerate([1.0] * 9 + [1e12])]  # fmt: skip
    multibody = build(model(made), 0)
    draw = multibody.q, 0 * multibody.v, np.ones(10)
    exact = exact_accelerations(multibody, *draw)
    for form in FORMS:
        found = multibody.refinement(*draw, form=form, refine="auto")
        error = largest_error(found["value"], exact)
        assert 1e-6 < error <= 10 * found["corrections"][-1], f"{form}: error {error}, corrections {found['corrections']}"
        wider = multibody.refinement(*draw, form=form, refine="auto", residual="wider")
        assert largest_error(wider["value"], exact) <= min(max(10 * wider["corrections"][-1], floor(10)), error / 300)


def test_automatic_refinement_stops_when_corrections_no_longer_shrink(case):
    _, multibody, draws = case
    for draw, exact in draws:
        found = multibody.refinement(*draw, refine="auto")
        steps, corrections = found["steps"], found["corrections"]
        assert 1 <= steps == len(corrections) <= 8
        assert all(after < before for before, after in zip(corrections[:-2], corrections[1:-1], strict=True))  # except the last
        assert corrections[-1] <= floor(multibody.nv) and relative_error(found["value"], exact) <= floor(multibody.nv)


def test_never_a_wrong_number_in_silence():
    """Tips of 1e13 to 1e17: right to the floor after automatic refinement, or refused."""
    refused, solved = 0, 0
    for exponent in (13, 14, 14.5, 15, 16, 17):
        multibody = heavy_tip(10.0**exponent)
        for seed in range(3):
            draw = drawn(multibody, seed)
            try:
                value = multibody.forward_dynamics(*draw, refine="auto")
            except (pc.RefinementError, pc.SingularHingeError):
                refused += 1
            else:
                solved += 1
                assert relative_error(value, exact_accelerations(multibody, *draw)) <= floor(10)
    assert solved >= 4 and refused >= 6


def stretched(n):
    """A stretched chain of rods with the forces of ℳe₁."""
    multibody, q = pc.chain(n), np.zeros(n)
    return multibody, (q, q, multibody.inverse_dynamics(q, q, np.eye(n)[0], precision="quad"))


@each_form
@pytest.mark.parametrize("residual", ["same", "wider"])
def test_a_correction_above_three_tenths_raises(residual, form):
    """Nothing of the answer is sure then: a stretched chain of 200 rods in single precision, whose D are regular. The message names the
    ratio, the limit, and what helps: not what is in use."""
    multibody, draw = stretched(200)
    way = dict(form=form, residual=residual, precision="single")
    for refine in (1, "auto"):
        for call in (multibody.forward_dynamics, multibody.refinement):
            with pytest.raises(pc.RefinementError) as error:
                pytest.fail(str(call(*draw, refine=refine, **way)))
            text = str(error.value)
            ratio = float(re.search(r"correction is (\S+) of the solution", text).group(1))
            assert ratio > 0.3 and "0.3" in text and "precision" in text and "chain of 200" in text, text
            assert ('"ud"' in text) == (form == "fast"), text
    assert issubclass(pc.RefinementError, ArithmeticError) and issubclass(pc.RefinementError, pc.Error)
    multibody, draw = stretched(50)  # a twentieth, on the way: refined
    assert 1e-3 < multibody.refinement(*draw, refine=1, **way)["corrections"][0] <= 0.3
    if residual == "wider":
        assert np.abs(multibody.forward_dynamics(*draw, refine="auto", **way) - np.eye(50)[0]).max() <= 2.0**-23
