"""Linear models: against differences in quad on the group, closed forms, modes, what inputs reach, and ways out."""

import re

import matplotlib as mpl
import numpy as np
import pytest
from scipy.linalg import expm

import pycraft as pc
from support.differences import difference
from support.kernel_cases import MODELS
from support.oracle import agree

mpl.use("Agg")
NAMES = ["panda", "tree of ball", "tree of free", "tree of universal", "tree of planar", "tree of screw"]
NEAR = 1e-8  # of fourth-order differences of results that are rounded to double, see support/differences.py


def at_random(model, seed=3):
    rng = np.random.default_rng(seed)
    state = model.random_state(seed)
    return state.q, state.v, rng.uniform(-1, 1, model.nv)


def directions(model):
    return np.eye(model.nv)


@pytest.mark.parametrize("name", NAMES)
def test_accelerations_against_differences(name):
    model = MODELS[name]
    q, v, tau = at_random(model)
    found, nv = model.linearize(q, v, tau), model.nv
    assert found.A.shape == (2 * nv, 2 * nv) and found.B.shape == (2 * nv, nv)
    accelerations = lambda q, v, tau: model.forward_dynamics(q, v, tau, precision="quad")
    for i, e in enumerate(directions(model)):
        agree(found.A[nv:, i], difference(lambda h, e=e: accelerations(model.integrate(q, h * e), v, tau)), NEAR)
        agree(found.A[nv:, nv + i], difference(lambda h, e=e: accelerations(q, v + h * e, tau)), NEAR)
        agree(found.B[nv:, i], difference(lambda h, e=e: accelerations(q, v, tau + h * e)), NEAR)
    agree(found.rate, np.concatenate([v, model.forward_dynamics(q, v, tau)]))
    assert not found.B[:nv].any() and np.array_equal(found.A[:nv, nv:], np.eye(nv))


@pytest.mark.parametrize("name", NAMES)
def test_displacements_are_carried_along_by_the_motion(name):
    """How fast two motions that differ by δq and δv part at first, as `difference` measures it."""
    model = MODELS[name]
    q, v, _ = at_random(model)
    found, nv = model.linearize(q, v), model.nv

    def apart(move, faster):
        def after(h):
            return model.difference(model.integrate(q, h * v), model.integrate(model.integrate(q, move), h * (v + faster)))

        return difference(after, 2.0**-8)

    for i, e in enumerate(directions(model)):
        agree(found.A[:nv, i], difference(lambda s, e=e: apart(s * e, 0 * e), 2.0**-6), 1e-7)
        agree(found.A[:nv, nv + i], difference(lambda s, e=e: apart(0 * e, s * e), 2.0**-6), 1e-7)


def test_a_top_in_free_space_precesses_by_the_bracket():
    """Euler's equations about a steady spin: the bracket of the spin in δq, and of the inertia in δv."""
    model = pc.Multibody("top")
    model.add_body("top", hinge="ball", mass=1.0, inertia=np.diag([1.0, 2.0, 3.0]))
    A = model.linearize([1, 0, 0, 0], [0, 0, 2.0]).A
    expected = np.zeros((6, 6))
    expected[0, 1], expected[1, 0] = 2.0, -2.0  # -ω × δ
    expected[:3, 3:] = np.eye(3)
    expected[3, 4], expected[4, 3] = 2.0 * (2 - 3) / 1, 2.0 * (3 - 1) / 2
    agree(A, expected)


def test_batches_are_their_states():
    model = MODELS["tree of ball"]
    states = [at_random(model, seed) for seed in range(5)]
    Q, V, tau = (np.array(x) for x in zip(*states, strict=True))
    last = list(model.bodies)[-1]
    outputs = [f"position.{last}", f"vdot.{model.coordinate_names[0]}"]
    whole = model.linearize(Q, V, tau, outputs=outputs)
    assert len(whole) == 5
    for b, state in enumerate(states):
        one = model.linearize(*state, outputs=outputs)
        for name in ("A", "B", "C", "D", "rate"):
            agree(getattr(whole[b], name), getattr(one, name), 1e-12)
        assert np.array_equal(whole[b].q, state[0])
    discrete = whole.discrete(0.01)
    agree(discrete.A[2], whole[2].discrete(0.01).A)
    empty = model.linearize(Q[:0], V[:0], tau[:0]).discrete(0.1)
    assert len(empty) == 0 and empty.A.shape == (0, 2 * model.nv, 2 * model.nv)


@pytest.mark.parametrize("name", ["panda", "tree of ball", "tree of free"])
def test_outputs_against_differences(name):
    model = MODELS[name]
    q, v, tau = at_random(model)
    body, coordinate = list(model.bodies)[-1], model.coordinate_names[-1]
    wanted = [f"position.{body}", f"velocity.{body}", f"rotation.{body}", f"q.{coordinate}", f"v.{coordinate}", f"vdot.{coordinate}"]
    found, nv = model.linearize(q, v, tau, outputs=wanted), model.nv
    assert found.outputs[:3] == tuple(f"position.{body}.{axis}" for axis in "xyz") and len(found.outputs) == 15
    twist = lambda q, v: model.jacobian(body, q, precision="quad") @ v
    R = model.pose(body, q)[:3, :3]
    for i, e in enumerate(directions(model)):
        moved = lambda h, e=e: model.integrate(q, h * e)
        agree(found.C[:3, i], difference(lambda h, to=moved: model.pose(body, to(h))[:3, 3]), NEAR)
        agree(found.C[3:9, i], difference(lambda h, to=moved: twist(to(h), v)), NEAR)
        agree(found.C[3:9, nv + i], difference(lambda h, e=e: twist(q, v + h * e)), NEAR)
        turned = difference(lambda h, to=moved: R.T @ model.pose(body, to(h))[:3, :3])
        agree(found.C[9:12, i], [turned[2, 1], turned[0, 2], turned[1, 0]], NEAR)
    agree(found.C[-1], model.linearize(q, v, tau).A[-1])
    agree(found.D[-1], model.linearize(q, v, tau).B[-1])
    assert not found.D[:-1].any() and found.C[12, nv - 1] == 1.0 and found.C[13, -1] == 1.0


def test_inputs_and_selections():
    model = MODELS["panda"]
    q, v, tau = at_random(model)
    whole = model.linearize(q, v, tau)
    some = model.linearize(q, v, tau, inputs=["panda_joint[23]", "panda_joint7"])
    assert some.inputs == ("tau.panda_joint2", "tau.panda_joint3", "tau.panda_joint7")
    assert np.array_equal(some.B, whole.B[:, [1, 2, 6]]) and np.array_equal(whole.select(inputs=some.inputs).B, some.B)
    picked = whole.select(outputs=["v.panda_joint1", "q.panda_joint4"])
    assert np.array_equal(picked.C, whole.C[[7, 3]]) and picked.outputs == ("v.panda_joint1", "q.panda_joint4")
    assert model.linearize(q, v, tau, inputs=[]).B.shape == (14, 0)
    assert whole.units["q.panda_joint1"] == "rad" and whole.units["v.panda_joint1"] == "rad/s"


def test_discrete_models():
    """Inputs held over a step: the exponential of [[A, B], [0, 0]] h."""
    model = pc.chain(3)
    model.gravity = (9.81, 0, 0)
    found, h = model.linearize([0.1, 0.2, 0.3], [0.4, 0.5, 0.6]), 0.02
    block = np.zeros((9, 9))
    block[:6, :6], block[:6, 6:] = found.A * h, found.B * h
    exact = expm(block)
    discrete = model.linearize([0.1, 0.2, 0.3], [0.4, 0.5, 0.6], dt=h)
    agree(discrete.A, exact[:6, :6])
    agree(discrete.B, exact[:6, 6:])
    assert discrete.dt == h and "step 0.02 s" in repr(discrete)
    continuous, sampled = (sorted(m.modes()[i]["natural"] for i in range(len(m.modes()))) for m in (found, discrete))
    assert np.allclose(continuous, sampled, rtol=1e-9)
    agree(found.discrete(h, "euler").A, np.eye(6) + h * found.A)


# Modes ----------------------------------------------------------------------------------------------------------------


def masses_on_springs(n, k=3.0, m=0.5):
    """n masses in a row between n springs, the first on a wall: natural frequencies 2√(k/m) sin((2j-1)π/(2(2n+1)))."""
    model = pc.tree([i - 1 for i in range(n)], ["slider"] * n, seed=0)
    made = pc.Multibody("masses")
    for i in range(n):
        made.add_body(f"m{i}", f"m{i - 1}" if i else None, "slider", axis=(1, 0, 0), mass=m)
    assert model.nv == made.nv == n
    return pc.Scene(made).add(pc.effects.Spring(k)), np.sqrt(k / m) * 2 * np.sin((2 * np.arange(1, n + 1) - 1) * np.pi / (2 * (2 * n + 1)))


@pytest.mark.parametrize("n", [1, 2, 7])
def test_masses_on_springs(n):
    scene, frequencies = masses_on_springs(n)
    modes = scene.linearize().modes()
    assert np.allclose([2 * np.pi * row["frequency"] for row in modes], frequencies, rtol=1e-12 * n * 100)
    assert all(abs(row["damping"]) < 1e-12 for row in modes)
    damped = scene.add(pc.effects.Damping(0.02)).linearize().modes()
    assert all(0 < row["damping"] < 0.1 and row["stable"] for row in damped)
    if n > 1:  # all masses swing to one side in the slowest: displacements between them alike in sign
        shape = np.real(modes.shapes[:n, 0])
        assert (np.cumsum(shape) > 0).all() and modes[0]["moves"]


def test_modes_as_text_and_pictures(monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")
    model = pc.chain(2)
    model.gravity = (9.81, 0, 0)
    modes = model.linearize([0, 0], [0, 0]).modes()
    text = repr(modes)
    assert "natural (Hz)" in text and "hinge1" in text and len(modes) == 2
    upright = pc.chain(1)
    upright.gravity = (-9.81, 0, 0)
    falling = upright.linearize([0.0], [0.0]).modes()
    assert [row["stable"] for row in falling] == [True, False] and falling[0]["frequency"] == 0
    ax = modes.plot(0, phases=3)
    assert "Hz" in ax.get_title() and len(ax.lines) + len(ax.collections) > 3
    mpl.pyplot.close("all")
    with pytest.raises(pc.EvaluationError, match="there is no mode 5; the model has 2"):
        modes.plot(5)
    with pytest.raises(pc.ModelError, match="mode must be a whole number, not 'first'"):
        modes.plot("first")
    with pytest.raises(pc.ModelError, match="amplitude is not an array of numbers"):
        modes.plot(0, amplitude="wide")
    with pytest.raises(pc.EvaluationError, match="amplitude=nan: give the amplitude of the coordinate"):
        modes.plot(0, amplitude=np.nan)
    free = pc.tree([-1], ["free"], seed=1)
    drifting = free.linearize(free.zero_q(), np.zeros(6)).modes()
    assert len(drifting) == 12 and all(row["damping"] is None for row in drifting)


# Reach ----------------------------------------------------------------------------------------------------------------


def test_what_inputs_reach():
    acrobot = pc.chain(2)
    acrobot.gravity = (9.81, 0, 0)
    elbow = acrobot.linearize([0, 0], [0, 0], inputs=["hinge1"])
    assert elbow.controllability() and elbow.controllability().rank == 4 and elbow.controllability().margin > 1e-4
    assert not acrobot.linearize([0, 0], [0, 0], inputs=[]).controllability()
    apart = pc.Multibody("apart")
    for name in ("left", "right"):
        apart.add_body(name, axis=(0, 0, 1), mass=1.0, com=(1, 0, 0))
    reach = apart.linearize([0, 0], [0, 0], inputs=["left"]).controllability()
    assert reach.rank == 2 and not reach.complete and {key for named in reach.names for key in named} == {"q.right", "v.right"}
    assert "not: " in repr(reach) and reach.margin < 1e-12
    agree(np.abs(reach.directions[[0, 2]]).max(), 0.0)


def test_momentum_of_a_floating_robot_is_out_of_reach():
    """By its joints: at rest six momenta, and what they would move, stay; their directions are rows of the momentum matrix."""
    robot = pc.tree([-1, 0, 1, 0], ["free", "pin", "pin", "pin"], seed=3)
    state = robot.random_state(1)
    found = robot.linearize(state.q, np.zeros(robot.nv), inputs=["hinge1", "hinge2", "hinge3"])
    reach = found.controllability()
    assert reach.rank == 2 * robot.nv - 12
    rows = np.hstack([np.zeros((6, robot.nv)), robot.momentum(state.q, np.zeros(robot.nv)).matrix])
    assert np.abs(rows - rows @ reach.directions @ reach.directions.T).max() < 1e-9 * np.abs(rows).max()
    assert robot.linearize(state.q, np.zeros(robot.nv)).controllability().complete


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_units_decide_about_no_rank(scale):
    """A chain of masses and springs in other units of mass and length."""
    scene, _ = masses_on_springs(5, k=3.0 * scale, m=0.5 * scale)
    assert scene.linearize(inputs=["m4"]).controllability().rank == 10
    assert scene.linearize(inputs=["m4"], outputs=["q.m0"]).observability().rank == 10


def test_what_outputs_show():
    flying = pc.tree([-1], ["free"], seed=1)
    shown = flying.linearize(flying.zero_q(), np.zeros(6), outputs=["velocity.body0"]).observability()
    assert shown.rank == 6 and {key[:2] for named in shown.names for key in named} == {"q."}
    assert flying.linearize(flying.zero_q(), np.zeros(6), outputs=["position.body0", "rotation.body0"]).observability().complete


# Ways out -------------------------------------------------------------------------------------------------------------


def test_to_scipy_and_control():
    control = pytest.importorskip("control")
    model = pc.chain(2)
    found = model.linearize([0.3, 0.1], [0.0, 0.2], outputs=["q.hinge0", "velocity.body1"])
    for dt in (None, 0.05):
        one = found if dt is None else found.discrete(dt)
        scipy, other = one.to_scipy(), one.to_control()
        for name in "ABCD":
            assert np.array_equal(getattr(scipy, name), getattr(one, name)) and np.array_equal(getattr(other, name), getattr(one, name))
        assert scipy.dt == dt and other.dt == (dt or 0)
        assert isinstance(other, control.StateSpace) and other.state_labels == [name.replace(".", "_") for name in one.states]
        assert other.input_labels == ["tau_hinge0", "tau_hinge1"] and other.output_labels[0] == "q_hinge0"
    assert all(a is b for a, b in zip(found.to_numpy(), (found.A, found.B, found.C, found.D), strict=True))


def test_a_linear_model_is_true_but_of_no_states():
    model = pc.chain(2)
    assert model.linearize() and model.linearize(np.zeros((3, 2))) and not model.linearize(np.zeros((0, 2)))


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda m, f: m.linearize(inputs=["elbow"]), "inputs: no hinge or coordinate"),
        (lambda m, f: m.linearize(inputs=[3]), "inputs takes names, or a list of them, not 3"),
        (lambda m, f: m.linearize(outputs="hinge0"), "outputs: unknown output 'hinge0'; there are q.<name>, v.<name>"),
        (lambda m, f: m.linearize(outputs="q.elbow"), "has no q.elbow; after 'q' there are hinge0, hinge1"),
        (lambda m, f: m.linearize(outputs="vdot.elbow"), "has no vdot.elbow; after 'vdot' there are hinge0, hinge1"),
        (lambda m, f: m.linearize(outputs="position.hand"), "no node or body of 'chain of 2 rods' is called 'hand'"),
        (lambda m, f: m.linearize(outputs=["q.hinge0", "v.hinge0", "q.hinge0"]), "outputs: 'q.hinge0' is named twice"),
        (lambda m, f: f.controllability(np.nan), "tolerance=nan: the relative size below which a singular value is zero"),
        (lambda m, f: f.observability(-1.0), "tolerance=-1: the relative size below which a singular value is zero"),
        (lambda m, f: f.discrete(0), "dt=0: a step is a positive number of seconds"),
        (lambda m, f: f.discrete(1e300), "dt=1e+300: by 'zoh' 'chain of 2 rods' leaves the range of its numbers"),
        (lambda m, f: f.discrete(0.1, "exact"), "method='exact': there are 'zoh'"),
        (lambda m, f: f.discrete(0.1).discrete(0.1), "is discrete already, with a step of 0.1 s"),
        (lambda m, f: f.place("v.hinge0", of="zz"), "of='zz': there are 'states', 'inputs' and 'outputs'"),
        (lambda m, f: f.place("v.hinge0", of=None), "of=None: there are 'states', 'inputs' and 'outputs'"),
        (lambda m, f: f.select(inputs="tau.elbow"), "has no input 'tau.elbow'; there are tau.hinge0, tau.hinge1"),
        (lambda m, f: m.linearize([[0, 0]]).modes(), "modes() takes one state; this is a batch of 1: select one by its index"),
        (lambda m, f: m.linearize([[0, 0]]).to_scipy(), "to_scipy() takes one state"),
        (lambda m, f: m.linearize([0, np.nan]), "entry 0 is nan"),
    ],
)
def test_refusals(call, text):
    model = pc.chain(2)
    with pytest.raises(pc.Error, match=re.escape(text)):
        call(model, model.linearize())


def test_degenerate_models():
    nothing = pc.Multibody("nothing").linearize()
    assert nothing.A.shape == (0, 0) and nothing.modes().rows == [] and nothing.controllability().complete
    massless = pc.chain(2)
    massless.bodies["body1"].mass, massless.bodies["body1"].inertia = 0.0, np.zeros((3, 3))
    massless.take_warnings()
    with pytest.raises(pc.SingularHingeError, match="hinge1"):
        massless.linearize()
    with pytest.raises(TypeError, match="takes no index"):
        pc.chain(1).linearize()[0]
