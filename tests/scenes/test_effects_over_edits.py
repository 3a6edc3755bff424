"""Effects of scenes over edits of the structure: what their names and numbers are of stays, or is refused by name; nothing is silent."""

import numpy as np
import pytest

import pycraft as pc

E = pc.effects

ON_A_FREE_ROOT = {
    "named": lambda: E.Damping(1.0, hinges="hinge0"),
    "by hinge": lambda: E.Damping({"hinge0": 1.0}),
    "pattern": lambda: E.QuadraticDamping(1.0, hinges="hinge?"),
    "one coordinate": lambda: E.CoulombFriction(1.0, hinges="hinge0[3]"),
    "all": lambda: E.Damping(1.0),
    "implicit": lambda: E.ImplicitDamping(1.0),
    "thermostat": lambda: E.Langevin(1.0, 1.0, 0.1),
    "heat bath": lambda: E.NoseHoover(1.0, 1.0),
    "rotors": lambda: E.RotorInertia(1.0),
    "prescribed": lambda: E.Prescribed("hinge0", [1, 0, 0, 0, 0, 0, 0]),
    "torques": lambda: E.TorqueSource(lambda t: np.full(6, t), hinges="hinge0"),
    "function": lambda: lambda t, state: np.zeros(11),
    "sampled": lambda: E.Sampled(lambda t, state: np.zeros(6), 0.1, hinges="hinge0"),
}
ELSEWHERE = {
    "springs": lambda: E.Spring(1.0),
    "stops": lambda: E.Limits(1.0),
    "gravity": lambda: E.Gravity(),
    "wrench": lambda: E.Wrench("body1", np.ones(6)),
    "node spring": lambda: E.NodeSpring("body0", None, 3.0),
    "bushing": lambda: E.Bushing("body0", "body3", np.ones(6)),
    "turned pin": lambda: E.Damping(1.0, hinges="hinge1"),
    "turned ball": lambda: E.Spring(2.0, hinges="hinge2"),
}


def flying() -> pc.Multibody:
    model = pc.tree([-1, 0, 1, 2], ["free", "pin", "ball", "pin"], seed=1)
    model.gravity = (1.0, 2.0, -9.81)
    state = model.random_state(3)
    model.q, model.v = state.q, state.v
    return model


@pytest.mark.parametrize("made", ON_A_FREE_ROOT.values(), ids=ON_A_FREE_ROOT)
def test_a_root_is_not_moved_away_from_what_acts_on_it(made):
    """The free hinge is another body's then: damping of one body would brake another, without a word."""
    model = flying()
    scene = pc.Scene(model).add(made(), name="it")
    before = repr(model.description())
    with pytest.raises(pc.ModelError, match="effect 'it' .* coordinates of (the free hinge )?'hinge0'.* 'body2'"):
        model.reroot("body2")
    assert repr(model.description()) == before
    model.reroot("body0")  # the root that it has
    scene.remove("it")
    model.reroot("body2")


@pytest.mark.parametrize("made", ELSEWHERE.values(), ids=ELSEWHERE)
def test_what_acts_elsewhere_goes_along_with_a_new_root(made):
    """The same motion seen from another body: accelerations of points are the same, and so of the hinges."""
    model = flying()
    scene = pc.Scene(model).add(made(), name="it")
    tip = model.frame("body3")

    def acceleration():
        model.frames.vdot = scene.evaluate(model.q, model.v).vdot
        return tip.acceleration()

    before = acceleration()
    model.reroot("body2")
    # Twelve digits: sums of a dozen terms of size 100 (gravity, ω² and forces over inertias), well conditioned.
    np.testing.assert_allclose(acceleration(), before, atol=1e-12 * np.abs(before).max())


def test_a_hinge_of_another_kind_is_another_hinge():
    """Damping of a pin would brake the flight of what was detached; where the pin is back, so is the damping."""
    model = flying()
    scene = pc.Scene(model).add(E.Damping(0.3, hinges="hinge3"), E.Spring(1.0))
    before = scene.evaluate(model.q, model.v).vdot
    model.detach("body3")
    words = "effect 'damping' of the scene acts on hinge 'hinge3', which was a hinge of pin; .* the free hinge of body 'body3': remove it"
    for ask in (scene.evaluate, lambda: scene.simulate(0.1, progress=False), scene.linearize):
        with pytest.raises(pc.ModelError, match=words):
            ask()
    model.attach("body3", "body2", "pin", axis=(0, 0, 1), velocity="impulse")
    assert scene.evaluate(model.q, model.v).vdot.shape == before.shape
    model.reattach("body3", "body2", "slider", axis=(1, 0, 0), placement="here", velocity="impulse")
    with pytest.raises(pc.ModelError, match="which was a hinge of pin; since an edit of 'tree of 4' that is a hinge of slider"):
        scene.evaluate()
    damping = scene.effects["damping"]
    scene.remove("damping").add(damping)  # meant of the slider
    assert scene.evaluate(model.q, model.v).forces["damping"].any()
    model.reattach("body3", "body2", "pin", placement="here", velocity="impulse")
    damping.coefficient = 0.4  # set anew: as the model is now
    assert scene.evaluate(model.q, model.v).forces["damping"].any()


@pytest.mark.parametrize(
    "made",
    [
        lambda: E.Damping([1.0, 2.0, 3.0, 4.0]),
        lambda: E.Damping(np.arange(4.0), hinges="hinge*"),
        lambda: E.Servo(1.0, target=[0.1, 0.2, 0.3, 0.4]),
        lambda: E.TorqueSource(lambda t: [t, 0, 0, 1]),
        lambda: E.TorqueSource(pc.effects.Table([0.0, 1.0], np.ones((2, 4)))),
    ],
    ids=["list", "pattern", "servo", "function", "table"],
)
def test_numbers_one_by_one_are_not_given_to_other_coordinates(made):
    """Hung elsewhere, a body and its coordinates come later in the order, and there are as many."""
    star = pc.tree([-1, 0, 0, 0], "pin", seed=1)
    effect = made()
    scene = pc.Scene(star).add(effect, name="it")
    star.reattach("body1", "body3", "pin", placement="here")
    assert star.coordinate_names == ["hinge0", "hinge2", "hinge3", "hinge1"]
    words = (
        "effect 'it' .* for the coordinates hinge0, hinge1, hinge2, hinge3; .* hinge0, hinge2, hinge3, hinge1: remove it, and add it again"
    )
    for _ in range(2):
        with pytest.raises(pc.ModelError, match=words):
            scene.evaluate()
    scene.remove("it").add(effect, name="it")
    scene.evaluate()


def test_what_is_of_all_or_of_a_pattern_is_of_those_that_there_are():
    star = pc.tree([-1, 0, 0, 0], "pin", seed=1)
    scene = pc.Scene(star).add(E.Damping(0.5), E.Spring(2.0, hinges="hinge*"), E.Damping(0.1, hinges=["hinge1", "hinge2"]))
    star.add_body("more", "body3", "pin", mass=1.0, inertia=np.eye(3), hinge_name="hinge9")
    star.reattach("body1", "body3", "pin", placement="here")
    v = np.arange(1.0, 6.0)
    forces = scene.evaluate(np.ones(5), v).forces
    assert np.array_equal(forces["damping"], -0.5 * v)
    assert np.array_equal(forces["spring"], np.full(5, -2.0))
    assert {star.coordinate_names[j] for j in np.flatnonzero(forces["damping_2"])} == {"hinge1", "hinge2"}
    star.lock("hinge2")
    with pytest.raises(pc.ModelError, match="unlock it where it was locked"):
        scene.evaluate()
    star.unlock("hinge2")
    scene.evaluate()
