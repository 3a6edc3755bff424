"""Accelerations on loops by constraint embedding as a direct call, against dense equations with multipliers, augmentation in quad precision
and the operators of the embedded tree.

Tolerances: rounding times the condition of Q_d and of the reduced inertias, below 1e4 together here, of the largest acceleration.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft.dynamics.embedding import embedded_accelerations
from pycraft.models.linkages import n_four_bar
from support.closed_models import MODELS, MOVING, closed_four_bar, spatial, two_loops
from support.mechanisms import every_kind

EPS = {"single": 2.0**-23, "double": 2.0**-52, "extended": 2.0**-52, "quad": 2.0**-52}  # results are doubles


def near(found, expected, precision="double"):
    return np.abs(found - expected).max(initial=0) <= 1e4 * EPS[precision] * max(1.0, np.abs(expected).max(initial=0))


def dense(model, q, v, tau):
    """θ̈ of the equations of motion with multipliers, dense, and Q*λ."""
    zero = np.zeros(model.nv)
    bias = model.inverse_dynamics(q, v, zero)
    A = np.array([model.inverse_dynamics(q, v, e) - bias for e in np.eye(model.nv)]).T
    Q = model.loops.jacobian(q)
    whole = np.block([[A, Q.T], [Q, np.zeros((len(Q), len(Q)))]])
    x = np.linalg.lstsq(whole, np.concatenate([tau - bias, -model.loops.bias(q, v)]), rcond=1e-11)[0]
    return x[: model.nv], -(Q.T @ x[model.nv :])


def states_of(model, count=3):
    rng = np.random.default_rng(6)
    soa = model.soa.embedded()
    found = [soa.random_state(rng) for _ in range(count)]
    names = [model.coordinate_names[i] for i in soa.independent]
    return np.array([s.q for s in found]), np.array([s.v for s in found]), rng.normal(size=(count, model.nv)), names


@pytest.mark.parametrize("name", MOVING)
def test_as_by_multipliers(name):
    """One state, a batch, coordinates that are given or chosen, and the forces of loops; of dependent rows Q*λ is what is sure."""
    model = MOVING[name]()
    q, v, tau, names = states_of(model)
    for independent in (None, names):
        found = model.constrained_dynamics(q, v, tau, method="embed", independent=independent)
        for i in range(len(q)):
            expected, forces = dense(model, q[i], v[i], tau[i])
            assert near(found.vdot[i], expected) and near(model.loops.jacobian(q[i]).T @ found.multipliers[i], forces)
            augmented = model.constrained_dynamics(q[i], v[i], tau[i])
            assert near(found.vdot[i], augmented.vdot) and found.rank[i] == augmented.rank
            alone = model.constrained_dynamics(q[i], v[i], tau[i], method="embed", independent=independent)
            assert np.array_equal(alone.vdot, found.vdot[i]) and np.array_equal(alone.multipliers, found.multipliers[i])
            assert {name: own.shape for name, own in alone.by_loop.items()} == {name: own.shape for name, own in augmented.by_loop.items()}
    assert near(found.vdot, embedded_accelerations(model, q, v, tau, names))


def test_the_order_of_states_is_not_felt():
    """The values at a state do not depend on earlier requests."""
    model = two_loops()
    q, v, tau, _ = states_of(model, 4)
    forward = model.constrained_dynamics(q, v, tau, method="embed").vdot
    backward = model.constrained_dynamics(q[::-1], v[::-1], tau[::-1], method="embed").vdot
    assert np.array_equal(forward, backward[::-1])


@pytest.mark.parametrize("precision", ["single", "double", "extended", "quad"])
@pytest.mark.parametrize("make", [closed_four_bar, spatial, two_loops])
def test_precisions(make, precision):
    model, tau = make(), np.random.default_rng(7).normal(size=make().nv)
    expected = model.constrained_dynamics(model.q, model.v, tau, precision="quad")
    for refine in (0, 2, "auto"):
        found = model.constrained_dynamics(model.q, model.v, tau, method="embed", precision=precision, refine=refine)
        assert near(found.vdot, expected.vdot, precision)


@pytest.mark.parametrize("rotor_inertia", [False, True])
@pytest.mark.parametrize("heavy", [1e-3, 1.0, 1e3])
def test_every_kind_of_hinge(rotor_inertia, heavy):
    """A body on every kind of hinge, the last of them held to the ground, a slider outboard; wrenches from outside."""
    model = every_kind(rotor_inertia=rotor_inertia)
    model.q = model.random_state(11).q
    last = list(model.bodies)[-1]
    model.add_body("outboard", last, "slider", mass=heavy, com=(0.1, 0.2, 0.3), inertia=heavy * np.eye(3))
    model.add_loop(last, hinge="ball", placement=model.frame(last).pose(), name="held")
    state = model.assemble(model.q, np.random.default_rng(3).normal(size=model.nv), starts=1)
    model.q, model.v = state.q, state.v
    model.gravity = (0.5, -9.0, 2.0)
    rng = np.random.default_rng(8)
    tau, bodies = rng.normal(size=model.nv), list(model.bodies)
    wrenches = {bodies[0]: rng.normal(size=6), bodies[-1]: rng.normal(size=6)}
    for axes in ("world", "body"):
        how = {"wrenches": wrenches, "wrench_axes": axes}
        expected = model.constrained_dynamics(model.q, model.v, tau, precision="quad", **how)
        found = model.constrained_dynamics(model.q, model.v, tau, method="embed", **how)
        assert near(found.vdot, expected.vdot)
        for side in ("a", "b"):  # three independent rows: the loop's force is the only one
            assert near(getattr(found.forces["held"], side), getattr(expected.forces["held"], side))


def test_ladder():
    """IFToMM A02, forty loops in one node of one freedom: cranks of 1 kg and 1 m turn as their sum does, (n+1)/3 + n and (n+1)/2 + n."""
    n, angle = 40, 1.0
    model = n_four_bar(n)
    model.gravity = (0, -9.81, 0)
    q = np.array([angle, -angle] * n + [angle])
    expected = -9.81 * np.cos(angle) * ((n + 1) / 2 + n) / ((n + 1) / 3 + n) * np.array([1.0, -1.0] * n + [1.0])
    for independent in (None, ["crank3"], ["rod7"]):
        assert near(model.constrained_dynamics(q, np.zeros(model.nv), method="embed", independent=independent).vdot, expected)


def test_two_hundred_rows_of_one_node_are_factored_without_growth():
    """A ladder of a hundred, 0.86 rad from the line: cond Q_d is 343, and pivots that are a tenth of the largest lost all digits of it."""
    n, angle = 100, 0.8582751372901797
    model = n_four_bar(n)
    model.gravity = (0, -9.81, 0)
    signs = np.array([1.0, -1.0] * n + [1.0])
    expected = -9.81 * np.cos(angle) * ((n + 1) / 2 + n) / ((n + 1) / 3 + n) * signs
    assert near(model.constrained_dynamics(angle * signs, signs, method="embed").vdot, expected)


@pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")
def test_bodies_without_mass():
    """Of a four-bar whose crank alone has mass no tree has accelerations: embedded it is a pendulum, θ̈ = m g L/2 cos(q) / (m L²/3)."""
    model = pc.Multibody("light")
    model.add_body("crank", None, "pin", mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0, 1 / 12, 1 / 12]))
    model.add_body("rod", "crank", "pin", position=(1, 0, 0))
    model.add_body("rocker", "rod", "pin", position=(1, 0, 0))
    model.add_loop("rocker", hinge="pin", point=(1, 0, 0), name="closure")
    model.gravity = (0, -9.81, 0)
    q, v = [1.0, -1.0, 1.0 - np.pi], [2.0, -2.0, 2.0]
    with pytest.raises(pc.SingularHingeError):
        model.constrained_dynamics(q, v)
    for independent in (None, [model.coordinate_names[0]]):
        found = model.constrained_dynamics(q, v, method="embed", independent=independent)
        assert near(found.vdot, -1.5 * 9.81 * np.cos(1.0) * np.array([1.0, -1.0, 1.0]))
    model.bodies["crank"].mass, model.bodies["crank"].inertia = 0.0, np.zeros((3, 3))
    with pytest.raises(pc.SingularHingeError, match="nothing with mass moves along coordinate 'crank'"):
        model.constrained_dynamics(q, v, method="embed", independent=["crank"])


def test_without_loops_and_without_freedom():
    arm = every_kind(rotor_inertia=True)
    state = arm.random_state(5)
    tau = np.random.default_rng(5).normal(size=arm.nv)
    found = arm.constrained_dynamics(state.q, state.v, tau, method="embed")
    assert near(found.vdot, arm.forward_dynamics(state.q, state.v, tau, precision="quad")) and found.multipliers.shape == (0,)
    held = pc.chain(2)
    held.add_coupling({"hinge0": 1.0}, name="first")
    held.add_coupling({"hinge1": 1.0}, name="second")
    still = held.constrained_dynamics(tau=[1.0, 2.0], method="embed")
    assert not still.vdot.any() and still.multipliers.tolist() == [-1.0, -2.0] and still.rank == 2
    weld = pc.Multibody("weld")
    weld.add_body("a", None, "weld", mass=1.0)
    assert weld.constrained_dynamics(method="embed").vdot.shape == (0,)
    none = closed_four_bar().constrained_dynamics(np.zeros((0, 3)), np.zeros((0, 3)), method="embed")
    assert none.vdot.shape == (0, 3) and none.rank.shape == (0,) and none.forces["closure"].b.shape == (0, 6)


def test_what_cannot_be_kept_is_refused():
    """Rows that ask for different accelerations; a singular state, where multipliers that are no numbers' would be silent."""
    bars = n_four_bar(1)
    with pytest.raises(pc.EvaluationError, match="no sure accelerations on loops, .* 'loop1: along x'"):
        bars.constrained_dynamics([0, 0, 0], [1.0, 1.0, -3.0], method="embed")
    turning = bars.constrained_dynamics([0, 0, 0], [1.0, -1.0, 1.0], method="embed")
    assert near(turning.vdot, bars.constrained_dynamics([0, 0, 0], [1.0, -1.0, 1.0]).vdot, "single")


@pytest.mark.parametrize("tilt", [0.0, 1e-12, 1e-9])
def test_rows_that_data_are_off_by_hold_nothing(tilt):
    """A planar loop whose closing axis is tilted by what files round: three rows ask what noise asks, and are left out by both methods."""
    bars = pc.Multibody("bars")
    for name, parent, axis in (("crank", None, (0, tilt, 1)), ("rod", "crank", (0, 0, 1)), ("rocker", "rod", (tilt, 0, 1))):
        bars.add_body(
            name,
            parent,
            "pin",
            axis=axis,
            position=(0.0 if parent is None else 1.0, 0, 0),
            mass=1.0,
            com=(0.5, 0, 0),
            inertia=0.1 * np.eye(3),
        )
    bars.add_loop("rocker", hinge="pin", axis=(0, 0, 1), point=(1, 0, 0), position=(1.2, 0, 0), name="closure")
    state = bars.assemble([1.0, -0.7, -1.5], [1.0, -0.5, 0.2], starts=1, tolerance=1e-8)
    tau = np.array([1.0, -2.0, 0.5])
    embedded, augmented = (bars.constrained_dynamics(state.q, state.v, tau, method=method) for method in ("embed", "augment"))
    assert embedded.rank == augmented.rank == 2
    assert np.abs(embedded.vdot - augmented.vdot).max() < 1e-7 * np.abs(augmented.vdot).max()  # of rows of 1e-9 nothing is known
    assert np.abs(embedded.multipliers).max() < 100 and near(
        *(bars.loops.jacobian(state.q).T @ x.multipliers for x in (embedded, augmented)), "single"
    )


@pytest.mark.parametrize("name", MODELS)
def test_every_choice_gives_the_same_or_is_refused(name):
    """One coordinate after the other as independent, of nodes that have one freedom; else numbers that do not fit are named."""
    model = MODELS[name]()
    expected = model.constrained_dynamics(model.q, model.v, precision="quad").vdot
    answered = 0
    for coordinate in model.coordinate_names:
        try:
            found = model.constrained_dynamics(model.q, model.v, method="embed", independent=[coordinate])
        except pc.EvaluationError as error:
            assert coordinate in str(error) and "are no independent coordinates at this state" in str(error)
            continue
        answered += 1
        assert near(found.vdot, expected)
    assert answered == 3 or name != "four-bar"  # the others have more freedoms than one in a node


def test_refusals():
    model = closed_four_bar()
    first, second, third = model.coordinate_names

    def call(error, says, q=model.q, v=model.v, **how):
        with pytest.raises(error, match=says):
            model.constrained_dynamics(q, v, **({"method": "embed"} | how))

    call(pc.EvaluationError, "only 'fast' is available", form="ud")
    call(pc.EvaluationError, "only 'same' is available; use a wider precision", residual="wider")
    call(pc.EvaluationError, "assemble", alpha=1.0)
    call(pc.EvaluationError, "assemble", beta=1.0)
    call(pc.EvaluationError, "has no independent coordinates", method="augment", independent=[first])
    call(pc.EvaluationError, "'augment', 'embed'", method="penalty")
    call(pc.EvaluationError, "'single' to 'quad'", precision=50)
    call(pc.ModelError, "elbow", independent=["elbow"])
    call(pc.ModelError, "twice", independent=[first, first])
    call(pc.ModelError, "tau", tau=[np.nan, 0, 0])
    call(pc.ModelError, "wrench on 'crank'", wrenches={"crank": [np.nan] * 6})
    none = "are no independent coordinates at this state, as"
    call(pc.EvaluationError, f"'{first}', '{second}' {none} row 'closure: along .' holds", independent=[first, second])
    dead = model.assemble([0.0, -0.8, -1.6], fix=[first], starts=40).q
    beside = f"'{third}' {none} .* there '({first}|{second})' are"
    call(pc.EvaluationError, beside, q=dead, v=np.zeros(3), independent=[third])
    call(pc.EvaluationError, "state 1 of", q=[model.q, dead], v=np.zeros(3), independent=[third])
