"""Motions with closed forms, and what prescribed motion, sampled controllers and implicit steps do over time."""

import numpy as np
import pytest

import pycraft as pc

E = pc.effects
TIGHT = dict(integrator="dop853", rtol=1e-12, atol=1e-14)


def slider(mass=1.0, axis=(1, 0, 0)):
    model = pc.Multibody("block")
    model.add_body("block", hinge="slider", axis=axis, mass=mass)
    return model


def wheel(inertia=0.2):
    model = pc.Multibody("wheel")
    model.add_body("wheel", mass=1.0, inertia=np.diag([0.1, 0.1, inertia]))
    return model


def test_a_pendulum_released_horizontally():
    """IFToMM A01: period 2.367841947576 s for 1 kg at 1 m, g 9.81."""
    model = pc.Multibody("pendulum")
    model.add_body("bob", axis=(0, 1, 0), mass=1.0, com=(1, 0, 0))
    run = pc.Scene(model).add(E.Gravity()).simulate(2.367841947576, [0.0], [0.0], **TIGHT)
    assert abs(run.q[-1, 0]) < 1e-10 and abs(run.v[-1, 0]) < 1e-10


def test_a_kepler_orbit():
    """Half an ellipse from its pericentre: there at the apocentre, back after the period."""
    model = pc.Multibody("satellite")
    model.add_body("satellite", hinge="free", mass=3.0, inertia=np.eye(3))
    mu, a, e = 398600.4418, 8000.0, 0.2
    period = 2 * np.pi * np.sqrt(a**3 / mu)
    start, speed = a * (1 - e), np.sqrt(mu / a * (1 + e) / (1 - e))
    scene = pc.Scene(model).add(E.PointMassGravity(mu))
    run = scene.simulate(period, [1, 0, 0, 0, start, 0, 0], [0, 0, 0, 0, speed, 0], t_eval=[period / 2, period], **TIGHT)
    assert np.abs(run.q[:, 4:] - [[-a * (1 + e), 0, 0], [start, 0, 0]]).max() < 1e-7 * a


def test_an_oscillator_damped_and_driven():
    m, k, c, F, w = 2.0, 18.0, 0.8, 3.0, 2.5
    scene = pc.Scene(slider(m)).add(E.Spring(k), E.Damping(c), E.TorqueSource(E.Harmonic(F, w / (2 * np.pi), phase=np.pi / 2)))
    H = F / (k - m * w**2 + 1j * c * w)  # of e^{iwt}
    lam = np.roots([m, c, k])
    x0, v0 = 0.4, -0.3
    A = np.linalg.solve([[1, 1], lam], [x0 - H.real, v0 - (1j * w * H).real])
    times = np.linspace(0, 5, 11)
    exact = (A * np.exp(np.outer(times, lam))).sum(axis=1).real + (H * np.exp(1j * w * times)).real
    run = scene.simulate(5.0, [x0], [v0], t_eval=times, **TIGHT)
    assert np.abs(run.q[:, 0] - exact).max() < 1e-10
    exact = (A * lam**2 * np.exp(np.outer(times, lam))).sum(axis=1).real - w**2 * (H * np.exp(1j * w * times)).real
    assert np.abs(run.vdot[:, 0] - exact).max() < 1e-9


def test_a_block_that_slides_down_a_slope():
    """Dry friction of μ m g cos θ, smoothed at 1e-4 m/s: the terminal acceleration, except at the start."""
    theta, mu, g = 0.6, 0.3, 9.81
    model = slider(2.0, (np.cos(theta), 0, -np.sin(theta)))
    friction = mu * 2.0 * g * np.cos(theta)
    run = pc.Scene(model).add(E.Gravity(), E.CoulombFriction(friction, smoothing=1e-4)).simulate(1.0, [0.0], [0.0], rtol=1e-10)
    a = g * (np.sin(theta) - mu * np.cos(theta))
    assert run.q[-1, 0] == pytest.approx(a / 2, rel=1e-3) and run.vdot[-1, 0] == pytest.approx(a, rel=1e-9)
    stuck = pc.Scene(model).add(E.Gravity(), E.CoulombFriction(2.0 * g, smoothing=1e-4)).simulate(1.0, [0.0], [0.0])
    creep = 1e-4 * np.arctanh(np.sin(theta))  # the speed at which friction holds
    assert stuck.v[-1, 0] == pytest.approx(creep, rel=1e-6)


def test_a_body_that_the_air_brakes():
    v0, c, m = 10.0, 0.3, 2.0
    run = pc.Scene(slider(m)).add(E.QuadraticDamping(c)).simulate(3.0, [0.0], [v0], **TIGHT)
    assert run.v[-1, 0] == pytest.approx(v0 / (1 + c * v0 * 3 / m), rel=1e-11)
    assert run.q[-1, 0] == pytest.approx(m / c * np.log(1 + c * v0 * 3 / m), rel=1e-11)


def test_a_motor_runs_up():
    """1 - exp(-t/τ) of the speed without load, τ = (I + n²J) ω₀/(n² τ₀)."""
    n, stall, fastest, rotor, load = 5.0, 0.4, 300.0, 2e-3, 0.2
    scene = pc.Scene(wheel(load)).add(E.Motor(0.5, stall, fastest, gear_ratio=n, rotor_inertia=rotor))
    tau = (load + n**2 * rotor) * fastest / (n**2 * stall)
    run = scene.simulate(2 * tau, [0.0], [0.0], **TIGHT)
    assert np.abs(run.v[:, 0] - 0.5 * fastest / n * (1 - np.exp(-run.t / tau))).max() < 1e-9
    assert run.energy["kinetic"][-1] == pytest.approx((load + n**2 * rotor) * run.v[-1, 0] ** 2 / 2)


def test_a_speed_limit_is_not_exceeded():
    run = pc.Scene(wheel()).add(E.TorqueSource(3.0, speed_limit=2.0)).simulate(3.0, [0.0], [0.0])
    assert 1.99 < run.v[-1, 0] < 2.0 + 1e-9


def test_a_gravity_gradient_pendulum():
    """Small pitch about the vertical, ω² = 3 μ/r³ (I₁ - I₃)/I₂, of a body whose centre is held: the torque alone."""
    inertia = np.array([5.0, 4.0, 1.0])
    model = pc.Multibody("boom")
    model.add_body("boom", hinge="ball", mass=1.0, inertia=np.diag(inertia))
    mu, r = 1000.0, 20.0
    scene = pc.Scene(model).add(E.GravityGradient(mu, (0, 0, -r)))
    w = np.sqrt(3 * mu / r**3 * (inertia[0] - inertia[2]) / inertia[1])
    small = 1e-4
    run = scene.simulate(2 * np.pi / w, [np.cos(small / 2), 0, np.sin(small / 2), 0], [0, 0, 0], t_eval=[np.pi / w, 2 * np.pi / w], **TIGHT)
    assert run.q[:, 2] == pytest.approx([-small / 2, small / 2], rel=1e-6)


def test_a_bushing_is_an_oscillator_in_six_directions():
    model = pc.Multibody("mount")
    model.add_body("engine", hinge="free", mass=4.0, inertia=np.diag([1.0, 2.0, 3.0]))
    K = np.array([3.0, 5.0, 7.0, 40.0, 50.0, 60.0])
    scene = pc.Scene(model).add(E.Bushing(None, "engine", K))
    small = 1e-5
    for j, inertia in enumerate([1.0, 2.0, 3.0, 4.0, 4.0, 4.0]):
        w = np.sqrt(K[j] / inertia)
        q, v = model.integrate([1, 0, 0, 0, 0, 0, 0], small * np.eye(6)[j]), np.zeros(6)
        run = scene.simulate(np.pi / w, q, v, t_eval=[np.pi / w], **TIGHT)
        moved = model.difference(np.array([1.0, 0, 0, 0, 0, 0, 0]), run.q[0])
        assert np.abs(moved + small * np.eye(6)[j]).max() < 1e-9 * small + 1e-13


# Stops ----------------------------------------------------------------------------------------------------------------


def test_a_stop_gives_back_what_it_stored():
    """Without dissipation the speed, with it less: about 1 - 2/3 a v."""
    for a, back in ((0.0, 1.0), (0.1, 1 - 0.2 / 3)):
        scene = pc.Scene(slider()).add(E.Limits(1e4, a, upper=0.5))
        run = scene.simulate(1.2, [0.0], [1.0], rtol=1e-10)
        assert run.v[-1, 0] == pytest.approx(-back, abs=1e-6 if a == 0 else 0.01) and run.q.max() < 0.52
        lost = run.energy["work"][-1, 0]
        assert lost == pytest.approx(run.energy["kinetic"][-1] - 0.5, abs=1e-7)


# Prescribed motion ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "integrator", [dict(), dict(integrator="bulirsch-stoer"), dict(integrator="rkmk4", step=0.005), dict(integrator="rk4", step=0.005)]
)
def test_prescribed_coordinates_are_where_their_motion_says(integrator):
    """At every time given out, to the bit; and the rest of the arm moves as if driven by the force that was found."""
    arm = pc.chain(3, seed=4)
    motion = E.Harmonic(0.4, 0.6, phase=0.3, offset=0.2)
    scene = pc.Scene(arm).add(E.Gravity(), E.Prescribed("hinge1", motion))
    run = scene.simulate(1.0, [0.3, 9.0, -0.2], [0.1, 9.0, 0.2], t_eval=np.linspace(0, 1, 11), **integrator)
    w = 2 * np.pi * 0.6
    assert np.abs(run.q[:, 1] - (0.2 + 0.4 * np.sin(w * run.t + 0.3))).max() < 1e-15
    assert np.abs(run.v[:, 1] - 0.4 * w * np.cos(w * run.t + 0.3)).max() < 1e-15
    assert np.abs(run.vdot[:, 1] + 0.4 * w**2 * np.sin(w * run.t + 0.3)).max() < 1e-14
    force = E.Spline(run.t, run.forces["prescribed"], ends="not-a-knot")
    driven = pc.Scene(arm).add(E.Gravity(), E.TorqueSource(force)).simulate(1.0, run.q[0], run.v[0], t_eval=[0.1])
    assert np.abs(driven.q[0] - run.q[1]).max() < 1e-5


def test_motions_of_every_sort():
    """Constants hold, tables and splines pass through their points, functions are differentiated, SciPy's splines taken over."""
    from scipy.interpolate import CubicSpline

    arm = pc.chain(2)
    times, values = np.linspace(0, 2, 9), np.sin(np.linspace(0, 2, 9))
    held = pc.Scene(arm).add(E.Gravity((0, -9.81, 0)), E.Prescribed("hinge0", 0.7)).simulate(0.5, [0.7, 0.1], [0.0, 0.0])
    assert (held.q[:, 0] == 0.7).all() and not held.v[:, 0].any() and np.abs(held.forces["prescribed"][:, 0]).min() > 1
    motions = {
        "function": lambda t: np.sin(t),
        "with derivatives": lambda t: (np.sin(t), np.cos(t), -np.sin(t)),
        "spline of SciPy's": CubicSpline(np.linspace(0, 2, 90), np.sin(np.linspace(0, 2, 90))),
        "spline": E.Spline(np.linspace(0, 2, 90), np.sin(np.linspace(0, 2, 90)), ends="not-a-knot"),
        "harmonic": E.Harmonic(1.0, 1 / (2 * np.pi)),
    }
    for name, motion in motions.items():
        run = pc.Scene(arm).add(E.Prescribed("hinge0", motion)).simulate(1.0, [0.0, 0.2], [1.0, 0.0], t_eval=[0.5, 1.0])
        error = {"function": 1e-9, "spline": 1e-4, "spline of SciPy's": 1e-4}.get(name, 1e-15)
        assert np.abs(run.q[:, 0] - np.sin(run.t)).max() <= error and np.abs(run.vdot[:, 0] + np.sin(run.t)).max() <= 1e3 * error, name
    table = E.Table(times, values)
    assert all(table(t)[0] == pytest.approx(x) for t, x in zip(times, values, strict=True)) and table(-5.0)[0] == values[0]
    assert table(0.125)[0] == pytest.approx(values[:2].mean()) and table(7.0)[0] == values[-1]


@pytest.mark.parametrize("kind", ["ball", "free"])
def test_a_hinge_of_several_coordinates_follows_a_curve(kind):
    """A quaternion of any length, and a position: the velocities are the body's, by differences of its poses."""
    model = pc.tree([-1, 0], [kind, "pin"], seed=2)

    def curve(t):
        quaternion = [2 + np.sin(t), 0.5 * np.cos(2 * t), t, 0.3]
        return np.array(quaternion + ([t**2, np.sin(3 * t), 1.0] if kind == "free" else []))

    hinge = next(iter(model.hinges))
    run = pc.Scene(model).add(E.Prescribed(hinge, curve), E.Gravity()).simulate(0.8, t_eval=[0.4, 0.8], rtol=1e-11, atol=1e-13)
    n, h = model.hinges[hinge].v_slice.stop, 1e-3
    for t, v, vdot in zip(run.t, run.v, run.vdot, strict=True):

        def pose(s):
            q = np.concatenate([curve(s), [0.0]])
            return model.pose("body0", q)

        def velocity(s):
            step = (pose(s - 2 * h) - 8 * pose(s - h) + 8 * pose(s + h) - pose(s + 2 * h)) / (12 * h)
            w = pose(s)[:3, :3].T @ step[:3, :3]
            return np.concatenate([[w[2, 1], w[0, 2], w[1, 0]], pose(s)[:3, :3].T @ step[:3, 3]])

        J = model.jacobian("body0", np.concatenate([curve(t), [0.0]]))[:, :n]
        assert np.abs(J @ v[:n] - velocity(t)).max() < 1e-9
        rate = (velocity(t - 2 * h) - 8 * velocity(t - h) + 8 * velocity(t + h) - velocity(t + 2 * h)) / (12 * h)
        assert np.abs(J @ vdot[:n] - rate).max() < 1e-6


# Controllers ----------------------------------------------------------------------------------------------------------


def test_a_sampled_controller_is_called_at_its_times_and_holds():
    """The forces between samples are held from the last one; the call sees the state at the sample; steps end there."""
    called = []

    def control(t, state):
        called.append((t, state.q.copy(), state.v.copy()))
        return -3.0 * state.q - 1.0 * state.v

    scene = pc.Scene(slider()).add(E.Sampled(control, 0.1))
    run = scene.simulate(0.5, [1.0], [0.0], rtol=1e-11, atol=1e-13)
    assert [t for t, _, _ in called] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    x, v = 1.0, 0.0
    for t, q, speed in called:
        assert q[0] == pytest.approx(x, abs=1e-11) and speed[0] == pytest.approx(v, abs=1e-11)
        a = -3 * x - v
        at = (run.t > t + 1e-9) & (run.t < t + 0.1 - 1e-9)
        assert np.abs(run.forces["sampled"][at, 0] - a).max(initial=0) < 1e-10
        x, v = x + 0.1 * v + 0.005 * a, v + 0.1 * a


@pytest.mark.parametrize(
    "options", [dict(integrator="rk4", step=0.03), dict(integrator="rkmk4", step=0.03), dict(integrator="bulirsch-stoer"), dict()]
)
def test_samples_in_every_integrator(options):
    scene = pc.Scene(slider()).add(E.Sampled(lambda t, s: [1.0 if t < 0.199 else -1.0], 0.1))
    run = scene.simulate(0.4, [0.0], [0.0], t_eval=[0.15, 0.2, 0.4], **options)
    assert run.v[:, 0] == pytest.approx([0.15, 0.2, 0.0], abs=1e-12)
    assert run.states[:, 0].tolist() == [1.0, -1.0, -1.0]


def test_effects_with_states_of_their_own():
    """A lag of the first order: ẏ = (u - y)/T, its output the force."""

    class Lag:
        states = [0.0]

        def __call__(self, t, state):
            return [state.states[0]]

        def rates(self, t, state):
            return (2.0 - state.states) / 0.3

    run = pc.Scene(slider()).add(Lag()).simulate(1.0, [0.0], [0.0], **TIGHT)
    y = 2 * (1 - np.exp(-run.t / 0.3))
    assert np.abs(run.states[:, 0] - y).max() < 1e-10 and np.abs(run.vdot[:, 0] - y).max() < 1e-10
    assert np.abs(run.v[:, 0] - (2 * run.t - 0.3 * y)).max() < 1e-10


# Implicit steps -------------------------------------------------------------------------------------------------------


def test_implicit_steps_are_stable_for_any_stiffness():
    """Where explicit ones leave all bounds; and with small ones they come to the motion itself."""
    arm = pc.chain(3, seed=2)
    state = arm.random_state(1)
    explicit = pc.Scene(arm).add(E.Gravity(), E.Damping(1e5), E.Spring(1e7))
    with pytest.raises(pc.EvaluationError, match="no longer finite"):
        explicit.simulate(5.0, state.q, state.v, integrator="rk4", step=0.01)
    stiff = pc.Scene(arm).add(E.Gravity(), E.ImplicitDamping(1e5), E.ImplicitSpring(1e7))
    run = stiff.simulate(5.0, state.q, state.v, integrator="semi-implicit-euler", step=0.01)
    assert np.abs(run.q[-1]).max() < 1e-4 and np.isfinite(run.v).all()
    assert np.abs(run.q[-1] - run.forces["gravity"][-1] / 1e7).max() < 1e-8  # where springs hold gravity


def test_the_order_of_semi_implicit_steps():
    arm = pc.chain(2, seed=2)
    scene = pc.Scene(arm).add(E.Gravity(), E.ImplicitDamping(0.3), E.ImplicitSpring(2.0))
    plain = pc.Scene(arm).add(E.Gravity(), E.Damping(0.3), E.Spring(2.0))
    exact = plain.simulate(0.5, [0.2, 0.1], [0.3, -0.2], **TIGHT).q[-1]
    error = [
        np.abs(scene.simulate(0.5, [0.2, 0.1], [0.3, -0.2], integrator="semi-implicit-euler", step=h).q[-1] - exact).max()
        for h in (1e-3, 5e-4)
    ]
    assert error[0] / error[1] == pytest.approx(2, rel=0.05) and error[1] < 1e-3


def test_an_implicit_run_leaves_no_step_behind():
    """Later effects see plain forces again."""
    arm = pc.chain(2)
    scene = pc.Scene(arm).add(E.ImplicitSpring(50.0))
    before = scene.evaluate([0.3, 0.2], [1.0, 2.0]).vdot
    scene.simulate(0.1, integrator="semi-implicit-euler", step=0.01)
    assert np.array_equal(scene.evaluate([0.3, 0.2], [1.0, 2.0]).vdot, before)
