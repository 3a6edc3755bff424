"""Equilibria against closed forms and Lagrange's catenary, their stability, what holds a model at rest, and refusals.

What the search leaves is 1e-9 of the largest force at most, and rounding after Newton's steps: closed forms agree to 1e-11 over the
smallest eigenvalue of the stiffness, of the size of 1 here.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

import pycraft as pc
from support.mechanisms import every_kind

E = pc.effects
G = 9.81


def close(a, b, tolerance=1e-10):
    assert np.shape(a) == np.shape(b)
    assert np.abs(np.asarray(a) - b).max(initial=0) <= tolerance * (1 + np.abs(b).max(initial=0))


def chain(n):
    model = pc.chain(n)
    model.gravity = (0, -G, 0)
    return model


# ------------------------------------------------------------------ closed forms
def test_pendulum_both_ways():
    model = chain(1)
    torque = 0.3 * G / 2  # m g l/2 cos q = τ
    above, below = model.equilibrium([torque], [1.0]), model.equilibrium([torque], [-1.0])
    close(above.q, [np.arccos(0.3)])
    close(below.q, [-np.arccos(0.3)])
    close(model.equilibrium(torque, [-1.0]).q, below.q)
    assert (above.stability, below.stability) == ("unstable", "stable")
    close(below.stiffness, [[G / 2 * np.sin(np.arccos(0.3))]])
    close(below.modes[0].eigenvalue, G / 2 * np.sin(np.arccos(0.3)) * 3)  # ℳ = 1/3
    close(model.equilibrium([torque], [1.0], stable=True).q, [-np.arccos(0.3)], 1e-9)


def test_it_leaves_an_unstable_equilibrium():
    model = chain(3)
    upright = model.equilibrium(q0=[np.pi / 2, 0, 0])
    assert [mode.stability for mode in upright.modes] == ["unstable"] * 3
    hanging = model.equilibrium(q0=upright.q, stable=True)
    assert hanging.stability == "stable"
    close(model.centre_of_mass(hanging.q), [0, -1.5, 0], 1e-9)


def test_what_counts_as_balanced_follows_the_size_of_forces():
    """Grains and ships: the same pendulum, and half of the force that cannot be balanced is left at both."""
    for size in (1e-12, 1e12):
        model = pc.Multibody("pendulum")
        model.add_body("rod", mass=size, com=(0.5, 0, 0), inertia=size * np.diag([0, 1 / 12, 1 / 12]))
        model.gravity = (0, -G, 0)
        close(model.equilibrium([0.3 * size * G / 2], [-1.0]).q, [-np.arccos(0.3)])
        with pytest.raises(pc.EvaluationError, match="'rod'"):
            model.equilibrium([size * G], [-1.0])


def test_a_stiff_spring_excuses_no_other_coordinate():
    """Half a newton that nothing balances beside 10¹⁰ N/m."""
    model = pc.Multibody("two ways")
    model.add_body("a", hinge="slider", axis=(1, 0, 0), mass=1.0)
    model.add_body("b", hinge="slider", axis=(0, 1, 0), mass=1.0)
    scene = pc.Scene(model).add(E.Spring(1e10, hinges="a"), E.Wrench("b", (0, 0, 0, 0, 0.5, 0)))
    with pytest.raises(pc.EvaluationError, match="there is left .* at 'b' 0.5"):
        scene.equilibrium([0.1, 0.0])


def test_flutter():
    """Ziegler's column, a force that follows the last rod, on springs: a complex pair at a load at which real parts are positive."""
    model = chain(2)
    model.add_node("end", "body1", position=(1, 0, 0))
    found = {
        load: pc.Scene(model).add(E.Spring(1.0), E.Wrench("end", (0, 0, 0, -load, 0, 0), axes="body")).equilibrium([0.0, 0.0])
        for load in (0.5, 3.0)
    }
    assert found[0.5].stability == "stable" and all(np.isreal(mode.eigenvalue) for mode in found[0.5].modes)
    values = [mode.eigenvalue for mode in found[3.0].modes]
    assert found[3.0].stability == "unstable" and abs(np.imag(values[0])) > 1
    close(np.real(values), np.full(2, 9 / 7))  # μ² - 18/7 μ + 36/7 = 0
    expected = np.linalg.eigvals(np.linalg.solve(model.mass_matrix([0, 0]), found[3.0].stiffness))
    close(np.sort_complex(values), np.sort_complex(expected))


def test_what_has_no_end_is_given_up(monkeypatch):
    model = chain(2)
    model.add_node("end", "body1", position=(1, 0, 0))
    column = pc.Scene(model).add(E.Spring(1.0), E.Wrench("end", (0, 0, 0, -3, 0, 0), axes="body"))
    with pytest.raises(pc.EvaluationError, match="no stable equilibrium .*unstable along hinge1"):
        column.equilibrium([0.0, 0.0], stable=True)
    monkeypatch.setattr("pycraft.dynamics.equilibrium.STEPS", 2)
    with pytest.raises(pc.EvaluationError, match="in 2 steps"):
        model.equilibrium(q0=[0.5, 0.0], stable=True)


def test_pendulum_with_spring():
    model = chain(1)
    for k in (5.0, 40.0):  # stiffer than gravity: one equilibrium
        found = pc.Scene(model).add(E.Gravity(g=(0, -G, 0)), E.Spring(k)).equilibrium([0.0])
        close(found.q, [brentq(lambda q, k=k: k * q + G / 2 * np.cos(q), -2.0, 0.0, xtol=1e-15)])
        close(found.stiffness, [[k - G / 2 * np.sin(found.q[0])]])
        assert found.stability == "stable"
    for start in (-4.0, 4.0):  # softer: several
        found = pc.Scene(model).add(E.Gravity(g=(0, -G, 0)), E.Spring(0.5)).equilibrium([start], stable=True)
        close(0.5 * found.q + G / 2 * np.cos(found.q), [0.0])
        assert 0.5 - G / 2 * np.sin(found.q[0]) > 0


def test_boom_with_counterweight():
    """A boom that turns about a pin: a counterweight balances it at every angle where masses times arms agree, else nowhere but upright."""

    def boom(counterweight):
        model = pc.Multibody("boom")
        model.add_body("boom", mass=10.0, com=(2.0, 0, 0), inertia=np.diag([0, 13.0, 13.0]))
        model.add_body("weight", parent="boom", hinge="slider", axis=(1, 0, 0), position=(-1, 0, 0), mass=counterweight)
        model.gravity = (0, -G, 0)
        return model

    even = boom(20.0)
    for angle in (-1.0, 0.4):
        found = even.equilibrium(q0=[angle, 0.0], hold="weight")
        close(found.q, [angle, 0.0])
        assert found.stability == "indifferent" and found.modes[0].coordinates == ("boom",)
        close(found.holding, [0.0, 20.0 * G * np.sin(angle)])
    off = boom(25.0).equilibrium(q0=[0.2, 0.0], hold="weight", stable=True)
    close(np.abs(np.sin(off.q[0])), 1.0, 1e-9)  # the weight hangs below
    assert off.q[0] > 0 and off.stability == "stable"
    close(boom(25.0).counterbalance([0.0, 0.0]).tau, [(10 * 2 - 25) * G, 0.0])


def catenary(n, span):
    """Angles of n equal links of a chain between two points of one height: tan of link i is (weight to its right)/(horizontal force)."""
    rows = np.arange(n) - (n - 1) / 2
    angles = lambda horizontal: np.arctan(rows / horizontal)
    horizontal = brentq(lambda h: np.cos(angles(h)).sum() - span, 1e-3 * n, 1e4 * n, xtol=1e-14, rtol=1e-14)
    return angles(horizontal), horizontal * G


@pytest.mark.parametrize("n", [4, 16])
def test_hanging_chain(n):
    """Uniform rods between two points: the sum of moments on each is zero where tan is the weight beyond its middle over the pull."""
    span = 0.7 * n
    angles, pull = catenary(n, span)
    model = chain(n)
    end = list(model.bodies)[-1]
    model.add_node("end", end, position=(1, 0, 0))
    lift = n * G / 2  # half of the weight
    found = model.equilibrium(q0=np.r_[-0.8, 1.6 / n * np.ones(n - 1)], wrenches={"end": (0, 0, 0, pull, lift, 0)}, stable=True)
    close(np.cumsum(found.q), angles, 1e-8)
    assert found.stability == "stable"
    close(model.pose("end", found.q)[:2, 3], [span, 0.0], 1e-8)
    reaction = model.base_reaction(found.q, np.zeros(n), vdot=np.zeros(n), wrenches={"end": (0, 0, 0, pull, lift, 0)})
    close(reaction, [0, 0, 0, -pull, lift, 0], 1e-8)


def test_catenary_in_the_limit():
    """Many short links hang as a heavy rope: sag a (cosh(s/2a) - 1) with 2a sinh(s/2a) the length; the error of n links falls as 1/n²."""
    a = brentq(lambda a: 2 * a * np.sinh(0.7 / (2 * a)) - 1, 0.1, 10)
    sag = a * (np.cosh(0.7 / (2 * a)) - 1)
    errors = []
    for n in (10, 20):
        angles, _ = catenary(n, 0.7 * n)
        errors.append(abs(np.cumsum(np.sin(angles) / n).min() + sag))
    assert errors[0] < 5e-3 and 3.5 < errors[0] / errors[1] < 4.5


# ------------------------------------------------------------------ on the group, in trees
def test_ball_hangs():
    model = pc.Multibody("bob")
    model.add_body("bob", hinge="ball", mass=2.0, com=(0.1, -0.4, 0.2), inertia=np.diag([0.1, 0.2, 0.25]))
    model.gravity = (0, 0, -G)
    arm = np.linalg.norm((0.1, -0.4, 0.2))
    for seed in range(3):
        found = model.equilibrium(q0=model.random_state(seed), stable=True)
        close(model.centre_of_mass(found.q), [0, 0, -arm], 1e-9)
        assert found.stability == "indifferent" and [mode.stability for mode in found.modes] == ["indifferent", "stable", "stable"]
        turning = found.modes[0].shape  # about the vertical
        close(np.abs(turning @ (0.1, -0.4, 0.2)), np.linalg.norm(turning) * arm, 1e-9)
    hanging = np.sort(np.linalg.eigvalsh(found.stiffness))
    close(hanging, [0, 2 * G * arm, 2 * G * arm])


@pytest.mark.parametrize("seed", range(3))
def test_every_kind(seed):
    """Beside a configuration that is held: nothing accelerates at what is found, by forward dynamics."""
    model = every_kind(rotor_inertia=True, seed=seed)
    model.gravity = (0.3, -1.0, -9.8)
    rng = np.random.default_rng(seed)
    held = model.random_state(seed).q
    wrenches = {name: rng.normal(size=6) for name in list(model.bodies)[::3]}
    tau = model.counterbalance(held, wrenches=wrenches).tau
    found = model.equilibrium(tau, model.integrate(held, 0.02 * rng.normal(size=model.nv)), wrenches=wrenches)
    close(model.counterbalance(found.q, wrenches=wrenches).tau, tau, 1e-8)
    pushes = sum(model.jacobian(name, found.q, axes="aligned").T @ w for name, w in wrenches.items())
    close(model.forward_dynamics(found.q, np.zeros(model.nv), tau + pushes), np.zeros(model.nv), 1e-6)


@pytest.mark.parametrize("wrench_axes", ["world", "body"])
def test_stiffness_is_the_derivative(wrench_axes):
    model = every_kind()
    model.gravity = (0.3, -1.0, -9.8)
    wrenches = {list(model.bodies)[-1]: np.arange(1.0, 7)}
    options = {"wrenches": wrenches, "wrench_axes": wrench_axes}
    tau = model.counterbalance(model.q, **options).tau
    found = model.equilibrium(tau, model.q, **options)
    for i in range(model.nv):
        e = 1e-5 * np.eye(model.nv)[i]
        ahead, back = (model.counterbalance(model.integrate(found.q, side * e), **options).tau for side in (1, -1))
        close(found.stiffness[:, i], (ahead - back) / 2e-5, 1e-7)


def test_moves_along_the_group_are_differentiated_exactly():
    from pycraft.dynamics.equilibrium import _Search
    from pycraft.dynamics.statics import _at_rest

    model = pc.tree([-1, 0, 0], ["free", "ball", "pin"], seed=3)
    model.gravity = (0.3, -1.0, -9.8)
    none = ([], True, np.zeros((0, 6)))
    q0 = model.random_state(1).q
    search = _Search(model, lambda q: _at_rest(model, q, np.zeros(model.nv), *none, 0.0), q0, np.arange(model.nv), False)
    x = 0.6 * np.random.default_rng(4).normal(size=model.nv)
    slope = search.slope(x)
    for i in range(model.nv):
        e = 1e-5 * np.eye(model.nv)[i]
        close(slope[:, i], (search.left(x + e) - search.left(x - e)) / 2e-5, 1e-7)


# ------------------------------------------------------------------ scenes
def test_scene_of_many_effects():
    model = every_kind(rotor_inertia=True)
    last = list(model.bodies)[-1]
    scene = pc.Scene(model).add(
        E.Gravity(), E.Wrench(last, (1, 2, 3, 4, 5, 6)), E.NodeSpring(None, last, 3.0), E.Damping(0.1), E.CoulombFriction(0.3, 0.01)
    )
    held = model.random_state(2).q
    whole = lambda q: sum(scene.evaluate(q).forces.values())  # T - ID at rest, as rotors take none of it
    scene.add(E.TorqueSource((-whole(held)).tolist()))
    found = scene.equilibrium(model.integrate(held, 0.02 * np.random.default_rng(1).normal(size=model.nv)))
    close(scene.evaluate(found.q).vdot, np.zeros(model.nv), 1e-6)
    stiffness = np.zeros((model.nv, model.nv))
    for i in range(model.nv):
        e = 1e-5 * np.eye(model.nv)[i]
        stiffness[:, i] = -(whole(model.integrate(found.q, e)) - whole(model.integrate(found.q, -e))) / 2e-5
    close(found.stiffness, stiffness, 1e-6)


def test_scene_is_the_model():
    model = chain(3)
    scene = pc.Scene(model).add(E.Gravity(g=(0, -G, 0)), E.TorqueSource([3.0, 1.0, 0.2]))
    own, of_scene = model.equilibrium([3.0, 1.0, 0.2], [-1.0, 0.1, 0.1]), scene.equilibrium([-1.0, 0.1, 0.1])
    close(of_scene.q, own.q)
    close(of_scene.stiffness, own.stiffness)
    assert own.stability == of_scene.stability == "stable"


def test_prescribed_coordinates_are_where_they_are_told():
    model = chain(2)
    scene = pc.Scene(model).add(E.Gravity(g=(0, -G, 0)), E.Prescribed("hinge0", E.Harmonic(0.5, 0.25)))
    found = scene.equilibrium([0.0, -1.0], t=1.0)
    close(found.q, [0.5, -np.pi / 2 - 0.5])
    assert found.stability == "stable" and found.modes[0].coordinates == ("hinge1",)


# ------------------------------------------------------------------ limits, held coordinates, batches, degenerate models
def test_limits():
    model = chain(2)
    model.hinges["hinge0"].limits = (-1.0, 1.0)
    with pytest.raises(pc.EvaluationError, match="'hinge0' .*is at its limit"):
        model.equilibrium(q0=[-0.5, -0.5], limits=True)
    assert model.equilibrium(q0=[-0.5, -0.5], stable=True).q[0] < -1.0
    model.hinges["hinge0"].limits = (-2.0, 1.0)
    found = model.equilibrium(q0=[-0.5, -0.5], limits=True)
    close(found.q, [-np.pi / 2, 0.0])
    close(model.equilibrium(q0=[-3.0, 0.1], limits=True).q, [-np.pi / 2, 0.0])  # from outside of them
    model.hinges["hinge0"].limits = (0.3, 0.3)
    locked = model.equilibrium(q0=[0.0, -1.0], limits=True)
    close(locked.q, [0.3, -np.pi / 2 - 0.3])
    close(locked.holding, [G * 1.5 * np.cos(0.3), 0.0])
    ball = pc.tree([-1, 0], ["ball", "pin"], seed=2)  # a ball has none
    ball.gravity = (0, 0, -G)
    ball.hinges["hinge1"].limits = (-10.0, 10.0)
    assert ball.equilibrium(limits=True, stable=True).stability == "indifferent"


def test_held_coordinates():
    model = chain(2)
    found = model.equilibrium(q0=[0.3, -1.0], hold=["hinge0"])
    close(found.q, [0.3, -np.pi / 2 - 0.3])
    close(found.holding, [G * 1.5 * np.cos(0.3), 0.0])
    whole = model.equilibrium(q0=[0.3, -1.0], hold=["hinge*"])
    close(whole.holding, model.counterbalance([0.3, -1.0]).tau)
    assert whole.stability == "stable" and whole.modes == ()


def test_batches():
    model = chain(2)
    q0 = np.array([[-1.4, 0.1], [-1.6, 0.0], [-1.5, 0.1]])
    tau = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.5]])
    found = model.equilibrium(tau, q0)
    for one, q, force in zip(found, q0, tau, strict=True):
        close(one.q, model.equilibrium(force, q).q)
    assert len(model.equilibrium(tau, q0[0])) == 3 and len(model.equilibrium(tau[0], q0)) == 3
    assert model.equilibrium(q0=np.zeros((0, 2))) == []
    scene = pc.Scene(model).add(E.Gravity(g=(0, -G, 0)))
    close(scene.equilibrium(q0)[1].q, scene.equilibrium(q0[1]).q)
    assert scene.equilibrium(q0[:0]) == []
    balance = model.counterbalance(q0, actuated="hinge0")
    close(balance.tau[1], model.counterbalance(q0[1], actuated="hinge0").tau)
    assert model.counterbalance(q0[:0]).tau.shape == (0, 2)


def test_degenerate_models():
    welded = pc.Multibody("welded", welds="keep")
    welded.add_body("post", hinge="weld", mass=1.0)
    for model in (pc.Multibody(), welded):
        found = model.equilibrium()
        assert found.q.shape == found.holding.shape == (0,) and found.stability == "stable"
        assert model.counterbalance().unbalanced == ()
    floating = pc.tree([-1], ["free"], seed=1)
    assert floating.equilibrium().stability == "indifferent"  # nothing acts
    floating.gravity = (0, 0, -G)
    lift = np.array([0, 0, floating.mass * G])
    carried = floating.equilibrium(
        wrenches={"body0": np.r_[np.cross(floating.centre_of_mass() - floating.pose("body0")[:3, 3], lift), lift]}
    )
    close(carried.q, floating.q)
    assert carried.stability == "indifferent"
    floating.gravity = (0, 0, 0)  # three forces that balance to rounding: 0.1 + 0.2 - 0.3 is not zero
    pulled = pc.Scene(floating).add(*(E.Wrench("body0", (0, 0, 0, x, 0, 0)) for x in (0.1, 0.2, -0.3))).equilibrium()
    assert pulled.stability == "indifferent" and 0 < np.abs(pulled.residual).max() < 1e-15
    massless = pc.Multibody("feather")
    massless.add_body("feather")
    assert pc.Scene(massless).add(E.Spring(2.0, 0.4)).equilibrium([0.1]).q == pytest.approx([0.4])


def test_counterbalance_of_some():
    model = chain(3)
    q = [0.2, 0.3, -0.1]
    whole, some = model.counterbalance(q), model.counterbalance(q, actuated=["hinge0", "hinge2"])
    close(whole.tau, model.inverse_dynamics(q, np.zeros(3), np.zeros(3)))
    close(some.tau, whole.tau * [1, 0, 1])
    close(some.residual, whole.tau * [0, 1, 0])
    assert some.unbalanced == ("hinge1",) and whole.unbalanced == ()
    assert model.counterbalance([-np.pi / 2, 0, 0], actuated=[]).unbalanced == ()
    pushed = model.counterbalance(q, wrenches={"body2": (0, 0, 1, 0, 5, 0)})
    close(pushed.tau, whole.tau - model.jacobian("body2", q, axes="aligned").T @ (0, 0, 1, 0, 5, 0))


def test_weights_that_are_carried_leave_rounding_alone():
    tree = pc.tree([-1, 0, 1], ["pin", "pin", "slider"], seed=3)
    tree.gravity, q, lifts = (0.1, 2, -G), tree.random_state(1).q, {}
    for name, body in tree.bodies.items():
        lift = -body.mass * np.array(tree.gravity)
        lifts[name] = np.r_[np.cross(tree.pose(name, q)[:3, :3] @ body.com, lift), lift]
    carried = tree.counterbalance(q, wrenches=lifts, actuated=[])
    assert carried.unbalanced == () and 0 < np.abs(carried.residual).max() < 1e-14


def test_refusals():
    model = pc.tree([-1, 0], ["free", "pin"], seed=1)
    model.gravity = (0, 0, -G)
    before = model.q.copy()
    with pytest.raises(pc.EvaluationError, match=r"'tree of 2': no equilibrium .* at 'hinge0\[.*hold="):
        model.equilibrium()
    with pytest.raises(pc.EvaluationError, match="no equilibrium"):
        chain(1).equilibrium([100.0], [0.0])
    with pytest.raises(pc.EvaluationError, match="no stable equilibrium .*goes on without end"):
        pc.Scene(chain(2)).add(E.TorqueSource(20.0)).equilibrium([0.0, 0.0], stable=True)
    with pytest.raises(pc.EvaluationError, match=r"no stable equilibrium .*goes on without end"):
        model.equilibrium(stable=True)
    for options, message in (
        ({"hold": "elbow"}, "elbow"),
        ({"tau": [0.0]}, "tau"),
        ({"tau": [np.nan] * 7}, "tau|finite"),
        ({"q0": [0.0]}, "q"),
        ({"q0": np.full(8, np.nan)}, "q|hinge0"),
        ({"wrenches": {"body9": np.zeros(6)}}, "body9"),
        ({"tau": np.zeros((2, 7)), "q0": np.zeros((3, 8))}, "2 and 3"),
    ):
        with pytest.raises(pc.ModelError, match=message):
            model.equilibrium(**options)
    with pytest.raises(pc.ModelError, match="elbow"):
        model.counterbalance(actuated="elbow")
    for tolerance in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(pc.EvaluationError, match="tolerance="):
            chain(1).equilibrium(q0=[-1.0], tolerance=tolerance)
        with pytest.raises(pc.EvaluationError, match="tolerance="):
            chain(1).counterbalance(tolerance=tolerance)
    with pytest.raises(pc.ModelError, match="tolerance"):
        chain(1).counterbalance(tolerance="small")
    with pytest.raises(pc.EvaluationError, match="leaves the range of numbers at 'hinge0': take other units"):
        chain(2).equilibrium(1e300, [0.1, 0.0])
    with pytest.raises(pc.EvaluationError, match="double"):
        pc.Scene(chain(1), precision="quad").equilibrium([0.0])
    assert np.array_equal(model.q, before)
