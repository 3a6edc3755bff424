"""Forward dynamics of chains and trees of pins in any number of digits, by the textbook and with nothing of the package in it.

Newton and Euler's equations in world axes, body by body; the mass matrix column by column from unit accelerations; elimination.
"""

import mpmath
from mpmath import matrix, mpf

DIGITS = 80


def cross(a, b):
    return matrix([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def about(axis, angle):
    """Rotation by an angle about a unit axis (Rodrigues)."""
    c, s = mpmath.cos(angle), mpmath.sin(angle)
    x, y, z = axis
    skew = matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return mpmath.eye(3) + s * skew + (1 - c) * skew * skew


def numbers(array):
    exact = lambda row: [mpf(float(x)) for x in row]
    return matrix([exact(row) for row in array] if hasattr(array[0], "__len__") else exact(array))


def poses(description, q):
    """Rotation and origin in the world, and axis in the world, of every body on its pin."""
    out = []
    for k, body in enumerate(description["bodies"]):
        (subhinge,) = body["hinge"]["subhinges"]
        assert subhinge["kind"] == "pin" and not any(subhinge["point"])
        placement, parent = body["hinge"]["placement"], body["parent"]
        R, p = numbers(placement["rotation"]), numbers(placement["position"])
        if parent >= 0:
            R, p = out[parent][0] * R, out[parent][1] + out[parent][0] * p
        axis = numbers(subhinge["axis"])
        out.append((R * about(axis / mpmath.norm(axis), mpf(float(q[k]))), p, R * (axis / mpmath.norm(axis))))
    return out


def inverse_dynamics(description, at, v, vdot, gravity):
    zero, bodies = matrix(3, 1), description["bodies"]
    motion, forces = [], [[matrix(3, 1), matrix(3, 1)] for _ in bodies]
    for k, body in enumerate(bodies):
        parent, (_, origin, axis) = body["parent"], at[k]
        w, turn, a, start = (*motion[parent], at[parent][1]) if parent >= 0 else (zero, zero, -gravity, zero)
        arm = origin - start
        a = a + cross(turn, arm) + cross(w, cross(w, arm))
        turn = turn + axis * vdot[k] + cross(w, axis * v[k])
        motion.append((w + axis * v[k], turn, a))
    torques = [None] * len(bodies)
    for k in reversed(range(len(bodies))):
        body, (R, origin, axis), (w, turn, a) = bodies[k], at[k], motion[k]
        arm, inertia = R * numbers(body["com"]), R * numbers(body["inertia"]) * R.T
        force = mpf(float(body["mass"])) * (a + cross(turn, arm) + cross(w, cross(w, arm)))
        forces[k][0] += force
        forces[k][1] += cross(arm, force) + inertia * turn + cross(w, inertia * w)
        torques[k] = (axis.T * forces[k][1])[0]
        if body["parent"] >= 0:
            outward = forces[body["parent"]]
            outward[0] += forces[k][0]
            outward[1] += forces[k][1] + cross(origin - at[body["parent"]][1], forces[k][0])
    return torques


def forward_dynamics(model, q, v, tau):
    """Accelerations as mpmath numbers."""
    with mpmath.workdps(DIGITS):
        description, n = model.description(), model.nv
        at, v = poses(description, q), [mpf(float(x)) for x in v]
        bias = inverse_dynamics(description, at, v, [mpf(0)] * n, numbers(description["gravity"]))
        rest, still = [mpf(0)] * n, matrix(3, 1)
        mass = matrix(n, n)
        for j in range(n):
            column = inverse_dynamics(description, at, rest, [mpf(int(i == j)) for i in range(n)], still)
            for i in range(n):
                mass[i, j] = column[i]
        rotors = [r for body in description["bodies"] for r in (body["hinge"].get("rotor_inertia") or [0.0])]
        for i in range(n):
            mass[i, i] += mpf(float(rotors[i]))
        return list(mpmath.lu_solve(mass, matrix([mpf(float(t)) - b for t, b in zip(tau, bias, strict=True)])))


def relative_error(value, exact):
    with mpmath.workdps(DIGITS):
        off = mpmath.norm(matrix([mpf(float(x)) - e for x, e in zip(value, exact, strict=True)]))
        return float(off / mpmath.norm(matrix(exact)))
