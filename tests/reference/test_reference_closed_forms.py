"""The oracle against equations of motion in closed form, typed from textbooks or derived by hand in the docstrings."""

import numpy as np
from numpy import cos, sin

from support.descriptions import body, model, random_inertia, rotate, subhinge
from support.oracle import agree, reference

X, Y, Z = np.eye(3)
GRAVITY = 9.81


def test_planar_double_pendulum():
    """Murray, Li and Sastry, *A Mathematical Introduction to Robotic Manipulation*, 1994, the planar two-link example.

    With link lengths l, distances r of the centres of mass, α = I₁ + m₁r₁² + I₂ + m₂(l₁² + r₂²), β = m₂l₁r₂, δ = I₂ + m₂r₂²:
    ℳ = [[α + 2βc₂, δ + βc₂], [δ + βc₂, δ]], C = [[−βs₂θ̇₂, −βs₂(θ̇₁ + θ̇₂)], [βs₂θ̇₁, 0]]; gravity along −y.
    """
    (m1, m2), l1, (r1, r2), (I1, I2) = (2.0, 1.3), 0.8, (0.35, 0.45), (0.11, 0.07)
    arm = model(
        [
            body("upper", -1, [subhinge("pin", Z)], m1, r1 * X, np.diag([0.05, 0.09, I1])),
            body("lower", 0, [subhinge("pin", Z)], m2, r2 * X, np.diag([0.03, 0.06, I2]), position=l1 * X),
        ],
        gravity=-GRAVITY * Y,
    )
    q, v, vdot = np.array([0.7, -1.1]), np.array([1.9, -0.6]), np.array([-2.3, 0.4])
    alpha, beta, delta = I1 + m1 * r1**2 + I2 + m2 * (l1**2 + r2**2), m2 * l1 * r2, I2 + m2 * r2**2
    mass_matrix = np.array([[alpha + 2 * beta * cos(q[1]), delta + beta * cos(q[1])], [delta + beta * cos(q[1]), delta]])
    C = beta * sin(q[1]) * np.array([[-v[1], -v[0] - v[1]], [v[0], 0]])
    lower = m2 * r2 * GRAVITY * cos(q[0] + q[1])
    weight = np.array([(m1 * r1 + m2 * l1) * GRAVITY * cos(q[0]) + lower, lower])
    agree(reference.mass_matrix(arm, q), mass_matrix)
    agree(reference.bias_forces(arm, q, v), C @ v + weight)
    agree(reference.inverse_dynamics(arm, q, v, vdot), mass_matrix @ vdot + C @ v + weight)
    tau = np.array([3.0, -1.0])
    agree(reference.forward_dynamics(arm, q, v, tau), np.linalg.solve(mass_matrix, tau - C @ v - weight))
    height = m1 * r1 * sin(q[0]) + m2 * (l1 * sin(q[0]) + r2 * sin(q[0] + q[1]))
    agree(reference.potential_energy(arm, q), GRAVITY * height)
    agree(reference.kinetic_energy(arm, q, v), 0.5 * v @ mass_matrix @ v)
    # D(1) = det ℳ / D(2), the articulated inertia about the shoulder: D(2) is the last pivot of ℳ
    agree(np.diag(reference.operators(arm, q).D), [np.linalg.det(mass_matrix) / delta, delta])


def test_rotors_add_to_the_diagonal():
    """A rotor inertia is the hinge-diagonal J: ℳ + J in the equations of motion, ½θ̇*Jθ̇ in the energy, nothing in 𝒞."""

    def arm(rotor):
        pin = [subhinge("pin", Z)]
        return model([body(f"link{k}", k - 1, pin, 1.0, 0.5 * X, position=k * X, rotor=[rotor[k]]) for k in (0, 1)])

    q, v, rotor = np.array([0.2, 0.9]), np.array([1.0, -2.0]), np.array([0.3, 0.7])
    agree(reference.mass_matrix(arm(rotor), q), reference.mass_matrix(arm([0, 0]), q) + np.diag(rotor))
    agree(reference.operators(arm(rotor), q).mass_matrix, reference.mass_matrix(arm([0, 0]), q))
    agree(reference.bias_forces(arm(rotor), q, v), reference.bias_forces(arm([0, 0]), q, v))
    energy = reference.kinetic_energy(arm([0, 0]), q, v) + 0.5 * v @ (rotor * v)
    agree(reference.kinetic_energy(arm(rotor), q, v), energy)


def test_free_body_obeys_newton_and_euler():
    """f = m(v̇ + ω×v + ω̇×c + ω×(ω×c) − R*g) at the centre of mass c, n = 𝓘ω̇ + ω×𝓘ω + c×f, all in body axes."""
    rng = np.random.default_rng(2)
    mass, c, inertia, g = 1.7, rng.normal(size=3), random_inertia(rng, 1.7), rng.normal(size=3)
    q, v, vdot = rng.normal(size=7), rng.normal(size=6), rng.normal(size=6)
    (w, u), (w_dot, u_dot) = np.split(v, 2), np.split(vdot, 2)
    field = rotate(q[:4] * [1, -1, -1, -1], g)
    f = mass * (u_dot + np.cross(w, u) + np.cross(w_dot, c) + np.cross(w, np.cross(w, c)) - field)
    n = inertia @ w_dot + np.cross(w, inertia @ w) + np.cross(c, f)
    free = model([body("body", -1, [subhinge("free")], mass, c, inertia)], g)
    agree(reference.inverse_dynamics(free, q, v, vdot), [*n, *f])
    agree(reference.operators(free, q).H, np.eye(6))
    agree(reference.forward_dynamics(free, q, 0 * v, 0 * v), [0, 0, 0, *field])  # free fall
    energy = 0.5 * (w @ inertia @ w + mass * np.sum((u + np.cross(w, c)) ** 2))
    agree(reference.kinetic_energy(free, q, v), energy)
    agree(reference.potential_energy(free, q), -mass * g @ (q[4:] + rotate(q[:4], c)))


def test_spherical_pendulum_in_angles():
    """Azimuth φ about z, then polar angle θ about y, a mass m at (0, 0, −l); the Lagrangian ½ml²(θ̇² + s²φ̇²) + mgl c gives

    ml²(s²φ̈ + 2scθ̇φ̇) = T_φ and ml²(θ̈ − scφ̇²) + mgl s = T_θ, with s = sin θ, c = cos θ.
    """
    m, l = 1.4, 0.9
    pendulum = model([body("bob", -1, [subhinge("pin", Z), subhinge("pin", Y)], m, -l * Z)], -GRAVITY * Z)
    q, (phi_dot, theta_dot), (phi_ddot, theta_ddot) = np.array([0.4, 1.1]), (1.3, -0.8), (0.5, 2.1)
    s, c = sin(q[1]), cos(q[1])
    T = [m * l**2 * (s**2 * phi_ddot + 2 * s * c * theta_dot * phi_dot), m * l**2 * (theta_ddot - s * c * phi_dot**2) + m * GRAVITY * l * s]
    agree(reference.mass_matrix(pendulum, q), m * l**2 * np.diag([s**2, 1]))
    agree(reference.inverse_dynamics(pendulum, q, [phi_dot, theta_dot], [phi_ddot, theta_ddot]), T)
    agree(reference.potential_energy(pendulum, q), -m * GRAVITY * l * c)
    # conical motion: φ̇² = g / (l c) needs no torque and keeps θ
    cone = np.sqrt(GRAVITY / (l * c))
    agree(reference.forward_dynamics(pendulum, q, np.array([cone, 0.0]), np.zeros(2)), [0, 0])


def test_spherical_pendulum_on_a_ball():
    """A ball at the point p, not the body's origin: 𝓘_p ω̇ + ω×𝓘_pω = T + r × mR*g, with r = c − p, in body axes."""
    rng = np.random.default_rng(3)
    m, p, c, inertia = 1.4, rng.normal(size=3), rng.normal(size=3), random_inertia(rng, 1.4)
    q, w, w_dot = 3 * rng.normal(size=4), rng.normal(size=3), rng.normal(size=3)
    pendulum, r = model([body("bob", -1, [subhinge("ball", point=p)], m, c, inertia)], -GRAVITY * Z), c - p
    at_ball = inertia + m * (r @ r * np.eye(3) - np.outer(r, r))
    weight = rotate(q * [1, -1, -1, -1], -m * GRAVITY * Z)
    agree(reference.mass_matrix(pendulum, q), at_ball)
    T = at_ball @ w_dot + np.cross(w, at_ball @ w) - np.cross(r, weight)
    agree(reference.inverse_dynamics(pendulum, q, w, w_dot), T)
    agree(reference.potential_energy(pendulum, q), m * GRAVITY * (p + rotate(q, r))[2])


def test_screw():
    """Upright screw of pitch h, centre of mass at distance d from its axis: (I_zz + m d² + m h²)θ̈ + mgh = T, no 𝒞 but weight."""
    m, h, d, point = 2.2, 0.15, 0.3, np.array([0.4, -0.2, 0.7])
    inertia = np.diag([0.2, 0.3, 0.4])
    nut = model([body("nut", -1, [subhinge("screw", Z, point, h)], m, point + d * X, inertia)], -GRAVITY * Z)
    expected = 0.4 + m * d**2 + m * h**2
    agree(reference.mass_matrix(nut, [0.8]), [[expected]])
    agree(reference.inverse_dynamics(nut, [0.8], [3.0], [-1.2]), [-1.2 * expected + m * GRAVITY * h])
    agree(reference.node_pose(nut, "nut", [0.8])[:3] @ [*point, 1], point + 0.8 * h * Z)


def test_cart_and_pole():
    """Slider along x with a mass M, on it a pole of mass m at length l, angle from upright: the textbook cart-pole

    ℳ = [[M + m, ml c], [ml c, ml²]], 𝒞 = (−ml s θ̇², −mgl s) for the angle turning towards +x.
    """
    M, m, l, q, v = 3.0, 0.5, 0.7, np.array([0.3, 0.6]), np.array([-1.0, 2.0])
    cart = body("cart", -1, [subhinge("slider", X)], M)
    pole = body("pole", 0, [subhinge("pin", Y)], m, l * Z)
    s, c, description = sin(q[1]), cos(q[1]), model([cart, pole], -GRAVITY * Z)
    agree(reference.mass_matrix(description, q), [[M + m, m * l * c], [m * l * c, m * l**2]])
    agree(reference.bias_forces(description, q, v), [-m * l * s * v[1] ** 2, -m * GRAVITY * l * s])


def test_polar_arm():
    """A pin about z, then a slider along x, a point mass: m(r²θ̈ + 2rṙθ̇) and m(r̈ − rθ̇²), r the slider's travel."""
    m, q, v, vdot = 1.1, np.array([0.5, 1.3]), np.array([2.0, -0.7]), np.array([0.4, 0.9])
    expected = [m * (q[1] ** 2 * vdot[0] + 2 * q[1] * v[1] * v[0]), m * (vdot[1] - q[1] * v[0] ** 2)]
    one_hinge = model([body("mass", -1, [subhinge("pin", Z), subhinge("slider", X)], m)])
    two_hinges = model([body("arm", -1, [subhinge("pin", Z)], 0.0), body("mass", 0, [subhinge("slider", X)], m)])
    agree(reference.inverse_dynamics(one_hinge, q, v, vdot), expected)
    agree(reference.inverse_dynamics(two_hinges, q, v, vdot), expected)


def test_planar_hinge():
    """Sliders x, y and a pin: ℳ of a planar body with its centre of mass at distance r from the pin, direction angle θ."""
    m, r, inertia, theta = 1.6, 0.4, 0.25, 0.9
    planar = [subhinge("slider", X), subhinge("slider", Y), subhinge("pin", Z)]
    plate = model([body("plate", -1, planar, m, r * X, np.diag([0.1, 0.2, inertia]))])
    column = m * r * np.array([-sin(theta), cos(theta)])
    expected = np.block([[m * np.eye(2), column[:, None]], [column[None], np.array([[inertia + m * r**2]])]])
    agree(reference.mass_matrix(plate, [0.7, -0.2, theta]), expected)
    agree(reference.bias_forces(plate, [0.7, -0.2, theta], [0, 0, 2.0]), [-m * r * 4 * cos(theta), -m * r * 4 * sin(theta), 0])
