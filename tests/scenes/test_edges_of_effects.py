"""States at which effects have no second derivatives, or none at all: refused by name; what has no quadratic model."""

import re

import numpy as np
import pytest

import pycraft as pc

E = pc.effects
NONE = "has no second derivatives at this state, t = 0 s"


@pytest.mark.parametrize(
    ("effects", "state", "text"),
    [
        (lambda: [E.QuadraticDamping(0.2)], ([0.1, 0.2], [0.0, 1.0]), f"'quadratic_damping' {NONE}: coordinate 'hinge0' is at rest"),
        (
            lambda: [E.Limits(9.0, lower=-1, upper=0.2)],
            ([0.1, 0.2], [0.0, 1.0]),
            f"{NONE}: coordinate 'hinge1' is just at its stop",
        ),
        (lambda: [E.Limits(9.0, 2.0, lower=-1, upper=0.1)], ([0.0, 0.2], [0.0, -0.5]), "leaves its stop just as fast"),
        (lambda: [E.Servo(1.0, target=0.5, hinges="hinge0", effort_limit=0.25)], ([0.25, 0.2], [0.0, 1.0]), "is just at its effort limit"),
        (lambda: [E.TorqueSource(1.0, "hinge1", speed_limit=2.0, speed_band=0.5)], ([0.1, 0.2], [0.0, 1.0]), "'hinge1' is just at an end"),
        (lambda: [E.Motor(0.5, 1.0, 2.0, hinges="hinge1", speed_limit=1.0)], ([0.1, 0.2], [0.0, 1.0]), "driven by nothing at a speed"),
        (
            lambda: [E.NodeSpring("here", "there", 1.0, 0.5)],
            ([0.0, 0.0], [1.0, 1.0]),
            "'node_spring' has no derivatives at this state",
        ),
        (lambda: [E.NodeDamper("here", "there", 1.0)], ([0.0, 0.0], [1.0, 1.0]), "its nodes are at one place"),
        (lambda: [E.Langevin(1.0, 0.1, 0.01)], ([0.0, 0.0], [1.0, 1.0]), "'langevin' acts by impulses"),
        (lambda: [lambda t, s: np.sqrt(s.q - 0.1)], ([0.1, 0.2], [1.0, 1.0]), "its force on coordinate 'hinge0' is "),
    ],
)
def test_edges_are_refused_by_name(effects, state, text):
    model = pc.chain(2)
    model.add_node("here", "body1", position=(0.5, 0, 0))
    model.add_node("there", "", position=(1.5, 0, 0))
    with np.errstate(invalid="ignore"), pytest.raises(pc.EvaluationError, match=re.escape(text)):
        pc.Scene(model).add(*effects()).quadratic_model(*state).contracted(np.ones(4))


def test_a_ball_half_a_turn_from_its_springs_rest():
    model = pc.tree([-1], ["ball"], seed=1)
    scene = pc.Scene(model).add(E.Spring(2.0))
    with pytest.raises(pc.EvaluationError, match=re.escape(f"{NONE}: coordinate 'hinge0[0]' is turned by half a turn")):
        scene.quadratic_model([0.0, 0.6, 0.0, 0.8])
    assert np.isfinite(scene.quadratic_model([1e-3, 0.6, 0.0, 0.8]).tensors().xx).all()


@pytest.mark.parametrize("effect", [E.NodeSpring("here", "there", 1.0, 0.5), E.NodeDamper("here", "there", 1.0)])
def test_linear_models_where_nodes_are_at_one_place(effect):
    """A force along a direction that there is none of has no derivatives on any side: it was taken for zero."""
    model = pc.chain(2)
    model.add_node("here", "body1", position=(0.5, 0, 0))
    model.add_node("there", "", position=(1.5, 0, 0))
    scene = pc.Scene(model).add(effect)
    with pytest.raises(pc.EvaluationError, match="has no derivatives at this state, t = 0 s: its nodes are at one place; move"):
        scene.linearize([0.0, 0.0], [1.0, 1.0])
    scene.linearize([0.0, 1e-6], [1.0, 1.0])
    pc.Scene(model).add(E.NodeSpring("here", "there", 1.0)).quadratic_model([0.0, 0.0])  # of length 0: linear in the way between them


@pytest.mark.parametrize(
    ("effects", "state"),
    [
        (lambda: [E.Limits(9.0, lower=-1, upper=0.2)], ([0.1, 0.1], [0.0, 1.0])),
        (lambda: [E.Servo(1.0, 0.3, hinges="hinge0", effort_limit=9, speed_limit=2.0)], ([0.0, 0.0], [0.0, 0.0])),
        (lambda: [E.TorqueSource(0.0, speed_limit=1.0)], ([0.0, 0.0], [1.0, -1.0])),
        (lambda: [E.TorqueSource(1.0, effort_limit=1.0)], ([0.0, 0.0], [1.0, -1.0])),
        (lambda: [E.Prescribed("hinge0", 0.2), E.QuadraticDamping(0.2)], ([0.0, 0.0], [0.0, -1.0])),
    ],
)
def test_beside_an_edge_there_are_second_derivatives(effects, state):
    assert np.isfinite(pc.Scene(pc.chain(2)).add(*effects()).quadratic_model(*state).contracted(np.ones(4)).xx).all()


def test_refusals():
    model = pc.chain(2)
    with pytest.raises(pc.EvaluationError, match="linearized in double precision, and this one computes in 'quad'"):
        pc.Scene(model, precision="quad").quadratic_model()
    with pytest.raises(pc.EvaluationError, match="keeps loops, which quadratic models do not support"):
        pc.mechanisms.n_four_bar().quadratic_model()
    with pytest.raises(pc.ModelError, match="inputs: no hinge or coordinate"):
        pc.Scene(model).quadratic_model(inputs="elbow")
    with pytest.raises(pc.EvaluationError, match="takes 'implicit_damping' at the end of a step: 'rkmk4' and 'euler' do not"):
        pc.Scene(model).add(E.ImplicitDamping(0.2)).quadratic_model().discrete(0.1, "semi-implicit-euler")
    with pytest.raises(pc.ModelError, match="the effects have 0 states of their own, not 1"):
        pc.Scene(model).quadratic_model(states=[1.0])
