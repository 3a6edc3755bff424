"""One rule for coordinates that are moved, or held: `hybrid_dynamics(prescribed=)`, `soa.free` and `equilibrium(hold=)`."""

import numpy as np
import pytest

import pycraft as pc


def model_with_a_locked_hinge():
    model = pc.tree([-1, 0, 1, 0], ["pin", "pin", "weld", "pin"], seed=1)
    model.gravity = (0, 0, -9.81)
    model.lock("hinge1")
    return model


def test_locked_hinges_are_held_as_they_are_prescribed():
    """They have no coordinates, and a list of all hinges may name them."""
    model = model_with_a_locked_hinge()
    names, q, zero = list(model.hinges), model.random_state(1).q, np.zeros(model.nv)
    held = model.equilibrium(q0=q, hold=names)
    # Sums of a few torques of N m: some roundings.
    np.testing.assert_allclose(held.holding, model.counterbalance(q).tau, rtol=1e-13, atol=1e-13)
    motion = model.hybrid_dynamics(q, zero, zero, zero, prescribed=names)
    assert np.array_equal(motion.tau, model.inverse_dynamics(q, zero, zero))
    in_scene = pc.Scene(model).add(pc.effects.Gravity()).equilibrium(q, hold=names)
    assert np.array_equal(held.q, q) and np.array_equal(in_scene.q, q)
    assert model.soa.free(names).H.shape[0] == 0


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("hinge1[0]", "hinge 'hinge1' has no coordinates, it is locked or a weld"),
        (["hinge*", "hinge3"], "coordinate 'hinge3' is (named|prescribed) twice, the second time as 'hinge3'"),
        ([3], "(hold|prescribed) takes names of hinges or coordinates, or a list of them, not 3"),
        (None, "(hold|prescribed) takes names of hinges or coordinates, or a list of them, not None"),
        ("elbow", "(hold|prescribed): no hinge or coordinate .* is called 'elbow'"),
    ],
)
def test_what_is_refused(names, words):
    model = model_with_a_locked_hinge()
    asks = [
        lambda: model.hybrid_dynamics(prescribed=names),
        lambda: model.equilibrium(hold=names),
        lambda: pc.Scene(model).equilibrium(hold=names),
    ]
    for ask in asks:
        with pytest.raises(pc.ModelError, match=words):
            ask()
