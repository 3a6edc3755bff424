"""Solid chains whose masses differ by many powers of ten, their accelerations in 60 digits, and how far others are from these."""

import mpmath
import numpy as np

import pycraft as pc
from support.descriptions import body, model, subhinge
from support.formulas import EPS
from support.oracle import reference

DIGITS = 60
LINK = np.array([[0.2, 0.01, 0], [0.01, 0.18, 0.01], [0, 0.01, 0.08]])  # about the centre of mass, of unit mass and length


def chain(masses, lengths, rotor=0.0, gravity=(0, 0, -9.81)):
    """Solid links on pins along y, x and z in turn, the next pin near the far end."""
    made = []
    for k, (m, length) in enumerate(zip(masses, lengths, strict=True)):
        start = lengths[k - 1] * np.array([0.2, 0.1, 1.0]) if k else np.zeros(3)
        centre, inertia = length * np.array([0.1, 0.05, 0.5]), m * length**2 * LINK
        axis = np.eye(3)[(1, 0, 2)[k % 3]]
        made.append(body(f"link{k}", k - 1, [subhinge("pin", axis)], m, centre, inertia, start, rotor=[rotor] if rotor else None))
    return pc.Multibody.from_description(model(made, gravity))


def heavy_tip(ratio, n=10, **options):
    return chain([1.0] * (n - 1) + [ratio], [0.1] * n, **options)


def drawn(multibody, seed, moving=True):
    """q folded anyhow, v and forces of one random state."""
    rng = np.random.default_rng([7, seed])
    n = multibody.nv
    return rng.uniform(-3, 3, n), rng.normal(size=n) * moving, rng.normal(size=n)


def exact_accelerations(multibody, q, v, tau):
    """θ̈ in 60 digits: the formulas of `reference.forward_dynamics_vectors`, one body at a time."""
    with mpmath.workdps(DIGITS):
        o = reference.operators(multibody.description(), q * mpmath.mpf(1), v)
        bodies, E = range(len(o.parents)), {k: o.E[o.states[p], o.states[k]] for k, p in enumerate(o.parents) if p >= 0}
        P, D_inverse, G = ([x[s] for s in where] for x, where in (
            (o.articulated.P, [(s, s) for s in o.states]), (o.articulated.D_inverse, [(t, t) for t in o.coordinates]),
            (o.articulated.G, list(zip(o.states, o.coordinates, strict=True)))))  # fmt: skip
        H, M = ([x[s] for s in where] for x, where in (
            (o.H, list(zip(o.coordinates, o.states, strict=True))), (o.M, [(s, s) for s in o.states])))  # fmt: skip
        V, a, alpha = [None] * len(bodies), [None] * len(bodies), [None] * len(bodies)
        for k in bodies:
            relative = H[k].T @ o.v[o.coordinates[k]]
            V[k] = relative + (E[k].T @ V[o.parents[k]] if k in E else 0)
            a[k] = reference.crm(V[k]) @ relative + o.a_gravity[o.states[k]]
            a[k] = a[k] + o.H_dot[o.coordinates[k], o.states[k]].T @ o.v[o.coordinates[k]]
        z = [reference.crf(V[k]) @ M[k] @ V[k] for k in bodies]  # b, and then ψ(KT + Pa + b)
        epsilon, vdot = [None] * len(bodies), [None] * len(bodies)
        for k in reversed(bodies):
            z[k] = z[k] + P[k] @ a[k]
            epsilon[k] = (tau - o.b_J)[o.coordinates[k]] - H[k] @ z[k]
            if k in E:
                z[o.parents[k]] = z[o.parents[k]] + E[k] @ (z[k] + G[k] @ epsilon[k])
        for k in bodies:
            inboard = E[k].T @ alpha[o.parents[k]] if k in E else 0 * V[k]
            vdot[k] = D_inverse[k] @ epsilon[k] - G[k].T @ inboard
            alpha[k] = inboard + H[k].T @ vdot[k] + a[k]
        return np.concatenate([np.zeros(0), *vdot])


def relative_error(got, exact):
    """‖got − exact‖ / ‖exact‖, as a double."""
    with mpmath.workdps(DIGITS):
        off = np.asarray(got, object) - exact
        return float(mpmath.sqrt((off @ off) / (exact @ exact)))


def largest_error(got, exact):
    """The same in the largest entry, in which corrections are measured."""
    with mpmath.workdps(DIGITS):
        return float(max(abs(x) for x in np.asarray(got, object) - exact) / max(abs(x) for x in exact))


def floor(n, eps=EPS):
    """Return the error that no correction removes on a folded chain of n links."""
    return 100 * eps * np.sqrt(n)
