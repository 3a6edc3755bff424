"""Gradients of ln det of one state after another: after some dozens a recorded program computes them, and nothing tells."""

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind

MANY = 70
"""Calls after which a program is recorded, and some more."""
OVER = ("coordinates", "inertias", "geometry", "axes")


@pytest.mark.parametrize("over", OVER)
def test_the_bits_do_not_change_when_a_program_takes_over(over):
    model = every_kind(rotor_inertia=True)
    states = [model.random_state(seed).q for seed in range(3)]
    first = [model.log_determinant_gradient(q, over=over) for q in states]
    for _ in range(MANY):
        for q, before in zip(states, first, strict=True):
            assert np.array_equal(model.log_determinant_gradient(q, over=over), before)


@pytest.mark.parametrize("over", OVER)
def test_few_states_have_the_bits_of_many(over):
    """One state or two go through narrow vectors, more through wide ones."""
    model = every_kind(rotor_inertia=True)
    states = np.array([model.random_state(seed).q for seed in range(MANY)])
    together = model.log_determinant_gradient(states, over=over)
    for some in (1, 2, 3, 5, 9):
        assert np.array_equal(model.log_determinant_gradient(states[:some], over=over), together[:some])
    assert np.array_equal(model.log_determinant_gradient(states[0], over=over), together[0])


@pytest.mark.parametrize("over", OVER)
def test_edits_are_seen(over):
    model, other = pc.robots.panda(), pc.robots.panda()
    q = model.random_state(1).q
    for _ in range(MANY):
        before = model.log_determinant_gradient(q, over=over)
    for made in (model, other):
        made.bodies["panda_link4"].mass *= 1.5
    after = [model.log_determinant_gradient(q, over=over) for _ in range(MANY)]
    expected = other.log_determinant_gradient(q, over=over)
    assert all(np.array_equal(each, expected) for each in after) and not np.array_equal(before, expected)


def test_a_state_without_a_gradient_is_refused_as_before():
    """Two sliders, the second turned by a wrist: along one line, the first has nothing to push; singular there and nowhere else."""
    model = pc.Multibody("press")
    model.add_body("turn", axis=(0, 0, 1), mass=1.0, inertia=np.eye(3))
    model.add_body("arm", "turn", "slider", axis=(1, 0, 0))
    model.add_body("wrist", "arm", axis=(0, 0, 1), inertia=np.eye(3))
    model.add_body("tip", "wrist", "slider", axis=(0, 1, 0), mass=1.0)
    regular, singular = [0.1, 0.2, 0.3, 0.0], [0.1, 0.2, np.pi / 2, 0.0]
    texts = set()
    for _ in range(MANY):
        assert np.isfinite(model.log_determinant_gradient(regular)).all()
        with pytest.raises(pc.SingularHingeError) as refused:
            model.log_determinant_gradient(singular)
        texts.add(str(refused.value))
    assert len(texts) == 1 and "of a batch" not in texts.pop()
