"""A coordinate that feels hardly any inertia beside others of its body: six digits (in the plain form two), or a refusal by name."""

import numpy as np
import pytest

import pycraft as pc
from campaigns import faint

FACTORED = ("ud", "square-root")


def no_bad_answer(cases):
    answers = 0
    for case in cases:
        for form, load, error, data in faint.judged(*case):
            answers += error is not None
            assert not faint.bad(form, error, data), (form, load, error, data, case)
    return answers


@pytest.mark.parametrize("kind", faint.KINDS)
def test_its_digits_or_a_refusal(kind):
    shares = 10.0 ** -np.array([9.0, 11, 14, 17, 21, 26])
    assert no_bad_answer(faint.cases([1], kinds=[kind], places=["root", "hung, beyond"], shares=shares)) > 20


@pytest.mark.slow
@pytest.mark.parametrize("kind", faint.KINDS)
def test_its_digits_or_a_refusal_at_every_share(kind):
    assert no_bad_answer(faint.cases([0], kinds=[kind])) > 750


@pytest.mark.parametrize("form", FACTORED)
@pytest.mark.parametrize("kind", ["ball", "gimbal", "free", "pins"])
def test_what_a_wider_residual_can_correct_is_answered(kind, form):
    """To I/mc² = 1e-11 nothing is refused."""
    for case in faint.cases([2], kinds=[kind], shares=[1e-9, 1e-10, 1e-11]):
        for _, load, error, data in faint.judged(*case, forms=[form]):
            assert error is not None and not faint.bad(form, error, data), (load, error, data, case)


def bob(share):
    arm = pc.Multibody("bob")
    arm.add_body("bob", None, "ball", mass=1.0, com=(0.3, -0.4, 0.5), inertia=0.5 * share * np.eye(3))
    arm.gravity = (0, 0, -9.81)
    return arm


@pytest.mark.parametrize("form", FACTORED)
def test_the_refusal_names_the_coordinate_and_what_helps(form):
    arm = bob(1e-18)
    q, none = arm.random_state(0).q, np.zeros(3)
    with pytest.raises(pc.SingularHingeError, match=r"hinge 'bob' of body 'bob' feels .*coordinate 'bob\[.*wider precision"):
        arm.forward_dynamics(q, none, none, form=form)
    quad = arm.forward_dynamics(q, none, none, form=form, precision="quad")
    assert faint.off(quad, faint.exact(arm, q, none, none)) < 1e-12


@pytest.mark.parametrize("form", FACTORED)
def test_what_no_correction_brings_closer_is_refused_for_these_forces(form):
    """Three pins in a row under a bob: where they cross is right to epsilon of its arm, and gravity has that for a lever."""
    arm = faint.thin(np.random.default_rng(0), 1e-18, "pins", "root", True, True)
    q, none = arm.random_state(0).q, np.zeros(3)
    arm.gravity = (0.3, 0.1, -9.81)
    told = r"feels too little inertia along coordinate 'pin0'.*fewer than six digits.*wider precision"
    with pytest.raises(pc.SingularHingeError, match=told):
        pytest.fail(str(arm.forward_dynamics(q, none, none, form=form)))
    quad = arm.forward_dynamics(q, none, none, form=form, precision=50)
    assert faint.off(quad, faint.exact(arm, q, none, none)) < 1e-12


@pytest.mark.parametrize("share", [1e-18, 1e-22, 1e-28])
def test_the_plain_form_returns_no_wild_number(share):
    """A moving bob whose own inertia is no share of mc²: gyroscopic terms, which cancel, were divided by it, 10¹² times too large."""
    arm = pc.Multibody("bob")
    arm.add_body("bob", None, "ball", mass=1.0, com=(0, 0, -0.7), inertia=0.49 * share * np.eye(3))
    state, wrong = arm.random_state(0), 0
    truth = faint.exact(arm, state.q, state.v, np.zeros(3))
    try:
        wrong = faint.off(arm.forward_dynamics(state.q, state.v, np.zeros(3)), truth)
    except pc.SingularHingeError as error:
        assert "too little inertia along coordinate 'bob[" in str(error)
    assert wrong < 1e-2


@pytest.mark.parametrize("form", FACTORED)
def test_what_coasts_is_an_answer(form):
    """A shaft turning about its own axis, askew: no torque, no acceleration but rounding."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        arm = faint.thin(rng, 1e-9, "pin", "root", True, True)
        found = arm.forward_dynamics(np.array([0.3]), np.array([2.0]), np.zeros(1), form=form)
        assert np.abs(found).max() <= 1e-12


@pytest.mark.parametrize("form", FACTORED)
def test_batches_say_which_state(form):
    """Packs leave such states to the path of one state, and give its bits."""
    arm = bob(1e-12)
    states = [arm.random_state(k) for k in range(9)]
    Q, none = np.array([s.q for s in states]), np.zeros((9, 3))
    one_by_one = np.array([arm.forward_dynamics(q, none[0], none[0], form=form) for q in Q])
    assert np.array_equal(arm.forward_dynamics(Q, none, none, form=form), one_by_one)
    with pytest.raises(pc.SingularHingeError, match="state 0 of a batch of 9"):
        bob(1e-18).forward_dynamics(Q, none, none, form=form)
