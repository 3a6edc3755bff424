"""Inverse dynamics and counterbalance on loops, against dense least squares of NumPy, forward dynamics on the loops, and closed forms."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.models import linkages

G = 9.81


def four_bar():
    bars = pc.chain(3)
    bars.gravity = (0, -G, 0)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    return bars


def mechanisms():
    spatial = pc.tree([-1, 0, 1, -1, 3], ["universal", "ball", "pin", "gimbal", "pin"], seed=4)
    spatial.gravity = (1.0, -2.0, -9.0)
    at = spatial.pose("body2", spatial.random_state(3).q)[:3, 3]
    spatial.add_loop("body2", hinge="ball", position=at, name="ball")
    joined = pc.tree([-1, 0, 1, -1, 3], ["universal", "ball", "pin", "gimbal", "pin"], seed=5)
    joined.gravity = (1.0, -2.0, -9.0)
    joined.q = joined.random_state(3).q
    grip = np.linalg.inv(joined.pose("body4")) @ joined.pose("body2")  # closed there
    joined.add_node("grip", "body4", position=grip[:3, 3], rotation=grip[:3, :3])
    joined.add_loop("body2", "grip", hinge="universal", axes=[(1, 0, 0), (0, 1, 0)], name="between bodies")
    joined.add_node("post", None, position=joined.pose("body1")[:3, 3])
    joined.add_loop("post", "body1", hinge="ball", name="on a post")
    hands = pc.tree([-1, 0, 1, 0, 3], ["free", "pin", "pin", "pin", "pin"], seed=7)
    hands.gravity = (0, 0, -9.0)
    hands.add_coupling({"hinge1": 1.0, "hinge3": -2.0}, name="gear")
    both = four_bar()
    both.add_coupling({"hinge0": 1.0, "hinge2": -1.0}, constant=np.pi, name="parallel")  # redundant on the loop
    return {"four-bar": four_bar(), "spatial": spatial, "joined": joined, "free, geared": hands, "redundant": both}


def state_of(model, seed):
    start = model.random_state(seed)
    if "grip" in model.nodes:
        start.q = model.integrate(model.q, 0.1 * start.v)
    if model.name == "chain of 3 rods":
        start.q = np.array([1.0, -1.0, -2.0])
    state = model.assemble(start.q, start.v, seed=seed, **({"fix": "hinge0"} if model.name == "chain of 3 rods" else {}))
    vdot = model.loops.acceleration(state.q, state.v, np.random.default_rng(seed).normal(size=model.nv))
    return state.q, state.v, vdot


def least_squares(model, q, T, driven):
    """(τ, λ) of the least |T - Sτ - Q*λ|, then of the least |τ|: by dense factors, one after the other."""
    Q = model.loops.jacobian(q)
    S = np.eye(model.nv)[:, driven]
    U, s, Vt = np.linalg.svd(Q)
    N = Vt[int((s > 1e-9 * s.max(initial=1.0)).sum()) :].T  # motions on the loops
    tau = np.linalg.lstsq(N.T @ S, N.T @ T, rcond=1e-9)[0]
    left = N @ (N.T @ (T - S @ tau))
    lam = np.linalg.lstsq(Q.T, T - S @ tau - left, rcond=1e-9)[0]
    return S @ tau, left, lam


@pytest.mark.parametrize("name", mechanisms())
@pytest.mark.parametrize("many", [0, 1, 2, 4, None])
def test_against_dense_least_squares(name, many):
    """1e-10 of the largest force: dense factors of condition up to some hundred, in double precision."""
    model = mechanisms()[name]
    for seed in range(4):
        q, v, vdot = state_of(model, seed)
        chosen = np.arange(model.nv) if many is None else np.sort(np.random.default_rng(seed).permutation(model.nv)[:many])
        names = None if many is None else [model.coordinate_names[j] for j in chosen]
        driven = np.isin(np.arange(model.nv), chosen)
        found = model.constrained_inverse_dynamics(q, v, vdot, actuated=names)
        T = model.inverse_dynamics(q, v, vdot)
        tau, left, lam = least_squares(model, q, T, driven)
        size = np.abs(T).max()
        for got, expected in ((found.tau, tau), (found.residual, left), (found.multipliers, lam)):
            np.testing.assert_allclose(got, expected, rtol=0, atol=1e-10 * size)
        assert np.array_equal(found.tau[~driven], np.zeros((~driven).sum()))
        np.testing.assert_allclose(model.loops.jacobian(q) @ found.residual, 0, atol=1e-11 * size)
        expected = {model.coordinate_names[j] for j in np.flatnonzero(np.abs(left) > 1e-7 * size)}
        assert expected <= set(found.unattained)
        assert bool(found.unattained) == bool(expected)


@pytest.mark.parametrize("name", mechanisms())
def test_forward_dynamics_gives_the_motion_back(name):
    """Under τ the model on its loops has v̇, and the same forces of loops; 1e-8: of two solutions one after the other."""
    model = mechanisms()[name]
    for seed in range(4):
        q, v, vdot = state_of(model, seed)
        found = model.constrained_inverse_dynamics(q, v, vdot)
        back = model.constrained_dynamics(q, v, found.tau)
        size = max(1.0, np.abs(vdot).max())
        np.testing.assert_allclose(back.vdot, vdot, rtol=0, atol=1e-8 * size)
        for loop in model.loops:
            for own, other in zip(found.forces[loop], back.forces[loop], strict=True):
                np.testing.assert_allclose(own, other, rtol=0, atol=1e-8 * np.abs(found.multipliers).max(initial=1.0))
            np.testing.assert_allclose(
                found.by_loop[loop], back.by_loop[loop], rtol=0, atol=1e-8 * np.abs(found.multipliers).max(initial=1.0)
            )


def test_the_four_bar_by_its_crank():
    """2 g cos 1: two cranks at half of their length and the rod on top at the whole."""
    bars = four_bar()
    q = bars.assemble([1, -1, -1], fix="hinge0").q
    right = 2 * G * np.cos(1)
    held = bars.counterbalance(q, actuated="hinge0")
    np.testing.assert_allclose(held.tau, [right, 0, 0], rtol=1e-13, atol=1e-13)
    assert held.unbalanced == ()
    np.testing.assert_allclose(held.tau[0], bars.equilibrium(q0=q, loops=True, hold="hinge0").holding[0], rtol=1e-12)
    assert bars.counterbalance(q, actuated=[]).unbalanced == ("hinge0", "hinge1", "hinge2")
    tree = bars.counterbalance(q, actuated="hinge0", loops=False)
    assert tree.unbalanced == ("hinge1", "hinge2")
    np.testing.assert_allclose(tree.tau + tree.residual, bars.inverse_dynamics(q, np.zeros(3), np.zeros(3)))
    by_two = bars.counterbalance(q, actuated=["hinge0", "hinge2"])  # both cranks turn alike: half each
    np.testing.assert_allclose(by_two.tau, [right / 2, 0, right / 2], rtol=1e-12, atol=1e-13)
    batch = bars.counterbalance(np.stack([q, q]), actuated="hinge0")
    np.testing.assert_allclose(batch.tau, [held.tau, held.tau], rtol=1e-14, atol=1e-14)


def test_as_operators():
    """With as many actuators as freedoms τ = X*T, X of the loops embedded by these; with more, τ = B*(BB*)⁻¹X*T, B = X*S."""
    bars = four_bar()
    q, v, vdot = state_of(bars, 2)
    T = bars.inverse_dynamics(q, v, vdot)
    linkage = bars.soa.embedded(["hinge0"], q=q)
    X = linkage.X_r.at(q)
    np.testing.assert_allclose(X.T @ T, bars.constrained_inverse_dynamics(q, v, vdot, actuated="hinge0").tau[:1], rtol=1e-12)
    S = pc.constant(np.eye(3)[:, [0, 2]], 2, bars.soa.Theta)
    B = linkage.X_r.T @ S
    over = B.T @ (B @ B.T).inv() @ linkage.X_r.T
    found = bars.constrained_inverse_dynamics(q, v, vdot, actuated=["hinge0", "hinge2"]).tau[[0, 2]]
    np.testing.assert_allclose(over.at(q) @ T, found, rtol=1e-11)


@pytest.mark.parametrize("name", mechanisms())
def test_derivatives_against_differences(name):
    """Along motions on the loops, central differences of step 1e-5: 1e-6 of the largest."""
    model = mechanisms()[name]
    q, v, vdot = state_of(model, 1)
    some = {"four-bar": ["hinge0", "hinge2"], "spatial": model.coordinate_names[1:], "joined": model.coordinate_names[1:6]}
    actuated = some.get(name, model.coordinate_names)  # more than freedoms, and not all: the least of several
    along = model.constrained_inverse_dynamics_derivatives(q, v, vdot, actuated=actuated)

    def at(q, v, vdot):
        return model.constrained_inverse_dynamics(q, v, vdot, actuated=actuated).tau

    h = 1e-5
    for direction in model.mobility(q).freedoms.T:
        ends = []
        for side in (h, -h):
            other = model.assemble(model.integrate(q, side * direction), v)
            accelerated = model.loops.acceleration(other.q, other.v, vdot)
            ends.append((model.difference(q, other.q), other.v - v, accelerated - vdot, at(other.q, other.v, accelerated)))
        dq, dv, dvdot, dtau = (a - b for a, b in zip(*ends, strict=True))
        expected = along.q @ dq + along.v @ dv + along.vdot @ dvdot
        np.testing.assert_allclose(dtau, expected, rtol=0, atol=2e-6 * h * max(1.0, np.abs(along.q).max(), np.abs(along.vdot).max()))
    batch = model.constrained_inverse_dynamics_derivatives(np.stack([q, q]), v, vdot, actuated=actuated)
    for one, whole in zip(along, batch, strict=True):
        np.testing.assert_allclose(whole, [one, one], rtol=1e-12, atol=1e-12)


def test_derivatives_of_too_few_actuators_are_refused():
    model = mechanisms()["free, geared"]
    q, v, vdot = state_of(model, 0)
    with pytest.raises(pc.EvaluationError, match=r"forces at 'hinge1' drive 1 of 9 freedoms.*actuate 8 more"):
        model.constrained_inverse_dynamics_derivatives(q, v, vdot, actuated="hinge1")


def test_states_off_the_loops_are_refused_by_the_row():
    bars = four_bar()
    q = np.array([1.0, -1.0, 1 - np.pi])
    with pytest.raises(pc.ModelError, match=r"is off row 'closure: along [xy]' by .*model.assemble"):
        bars.constrained_inverse_dynamics(q + [0, 0.1, 0])
    with pytest.raises(pc.ModelError, match=r"moves off row 'closure: along [xy]'"):
        bars.constrained_inverse_dynamics(q, [1.0, 1.0, 0])
    with pytest.raises(pc.ModelError, match=r"accelerates off row 'closure: along [xy]'.*loops.acceleration"):
        bars.constrained_inverse_dynamics(q, [0.0, 0, 0], [1.0, 1.0, 0])
    bars.constrained_inverse_dynamics(q, [1.0, -1.0, 1.0], [0.0, 0, 0])  # a parallelogram turns evenly
    with pytest.raises(pc.ModelError, match=r"accelerates off .*state 1 of a batch of 2"):
        bars.constrained_inverse_dynamics(q, [1.0, -1.0, 1.0], [[0.0, 0, 0], [1.0, 0, 0]])
    with pytest.raises(pc.ModelError, match=r"is off row .* \(state 1 of a batch of 2\)"):
        bars.counterbalance(np.stack([q, q + [0, 0.1, 0]]))
    with pytest.raises(pc.ModelError, match="elbow"):
        bars.constrained_inverse_dynamics(q, actuated="elbow")


def test_accelerations_on_the_loops():
    bars = four_bar()
    q, v, _ = state_of(bars, 1)
    for fix in ((), ["hinge0"], "hinge2"):
        vdot = bars.loops.acceleration(q, v, [1.0, 2.0, 3.0], fix=fix)
        assert np.abs(bars.loops.jacobian(q) @ vdot + bars.loops.bias(q, v)).max() < 1e-12
    assert bars.loops.acceleration(q, v, [1.0, 2.0, 3.0], fix="hinge0")[0] == 1.0
    batch = bars.loops.acceleration(np.stack([q, q]), v, [1.0, 2.0, 3.0], fix="hinge0")
    np.testing.assert_allclose(batch[1], bars.loops.acceleration(q, v, [1.0, 2.0, 3.0], fix="hinge0"), rtol=1e-14)
    with pytest.raises(pc.EvaluationError, match=r"keep row 'closure: along [xy]' with 'hinge0', 'hinge1' as given.*fix fewer"):
        bars.loops.acceleration(q, v, [1.0, 2.0, 3.0], fix=["hinge0", "hinge1"])
    with pytest.raises(pc.ModelError, match="vdot"):
        bars.loops.acceleration(q, v, [1.0])


def test_without_loops_it_is_inverse_dynamics():
    arm = pc.robots.ur5()
    arm.gravity = (0, 0, -G)
    state = arm.random_state(2)
    vdot = np.arange(6.0)
    found = arm.constrained_inverse_dynamics(state.q, state.v, vdot)
    np.testing.assert_allclose(found.tau, arm.inverse_dynamics(state.q, state.v, vdot), rtol=1e-13)
    assert found.unattained == () and int(found.rank) == 0 and int(found.driven) == 6


def test_wrenches_and_motors_of_a_parallel_robot():
    """A Stewart platform: six motors and six freedoms; what pushes the plate is carried by the legs, T = 0 at no other coordinate."""
    model = linkages.stewart()
    names = [name for name, hinge in model.hinges.items() if hinge.kind == "slider"]
    state = model.assemble(model.q)
    push = {list(model.bodies)[-1]: (1.0, 2.0, 0.5, 3.0, -4.0, 50.0)}
    held = model.constrained_inverse_dynamics(state.q, actuated=names, wrenches=push)
    assert held.unattained == ()
    assert model.constrained_inverse_dynamics(state.q, actuated=names[:5], wrenches=push).unattained
    back = model.constrained_dynamics(state.q, np.zeros(model.nv), held.tau, wrenches=push)
    np.testing.assert_allclose(back.vdot, 0, atol=1e-8)
