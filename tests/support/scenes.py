"""Scenes for tests: motions that prescribe given accelerations, dense hybrid dynamics, and the energy that a run should keep."""

import numpy as np

import pycraft as pc
from pycraft import _core
from support.oracle import reference


def subhinges(model):
    """(kind, names of its coordinates, numbers of them) of every subhinge."""
    names, at = model.coordinate_names, 0
    for body in model.description()["bodies"]:
        for one in body["hinge"]["subhinges"]:
            n = _core.subhinge_kinds[one["kind"]].nv
            yield one["kind"], names[at : at + n], list(range(at, at + n))
            at += n


def prescribing(model, chosen, accelerations):
    """An effect that gives the coordinates of these numbers, whole subhinges, these accelerations (nv,) at any state and time."""
    names, value, rate, second = [], [], [], []
    for kind, called, numbers in subhinges(model):
        if numbers[0] not in chosen:
            continue
        a = accelerations[numbers]
        names += called
        if kind in ("ball", "free"):  # from the unit quaternion at rest: ω̇ = 2 Q̈
            value += [1, 0, 0, 0, *([0] * 3 if kind == "free" else [])]
            rate += [0] * (7 if kind == "free" else 4)
            second += [0, *(a[:3] / 2), *a[3:]]
        else:
            value, rate, second = [*value, 0], [*rate, 0], [*second, a[0]]
    motion = tuple(np.array(x, float) for x in (value, rate, second))
    return pc.effects.Prescribed(names, lambda t: motion)


def some_subhinges(model, rng, share=0.5):
    """Numbers of the coordinates of some subhinges, one of them at least, not all."""
    every = [numbers for _, _, numbers in subhinges(model)]
    taken = [numbers for numbers in every if rng.random() < share] or every[:1]
    taken = taken if len(taken) < len(every) else taken[:-1]
    return [j for numbers in taken for j in numbers]


def hybrid_dynamics(model, q, v, tau, vdot, prescribed, inertia=0.0):
    """(accelerations, forces) of all coordinates: accelerations given where prescribed, forces elsewhere; dense, gravity the model's own.

    inertia : added to the diagonal of ℳ + J
    """
    description = model.description()
    M = reference.mass_matrix(description, q) + np.diag(np.broadcast_to(inertia, model.nv))
    bias = reference.bias_forces(description, q, v)
    p = np.array(sorted(prescribed), int)
    f = np.setdiff1d(np.arange(model.nv), p)
    a = np.array(vdot, float)
    a[f] = np.linalg.solve(M[np.ix_(f, f)], tau[f] - bias[f] - M[np.ix_(f, p)] @ a[p])
    T = np.array(tau, float)
    T[p] = (M @ a + bias)[p]
    return a, T, np.linalg.cond(M[np.ix_(f, f)]) if len(f) else 1.0


def balance(run):
    """The spread of kinetic + potential - Σ work, relative to the largest of what it is made of."""
    e = run.energy
    total = e["kinetic"] + e["potential"] - e["work"].sum(axis=1)
    size = max(np.abs(e["kinetic"]).max(), np.ptp(e["potential"]), np.abs(e["work"]).max(initial=0.0))
    return np.ptp(total) / size


def pushed(model, state, node, moment, force):
    """A moment and a force in the world's axes at the origin of a node, as generalized forces."""
    return model.jacobian(node, state.q, axes="aligned").T @ np.concatenate([moment, force])


def place(model, node, state):
    return np.eye(4) if node is None else model.pose(node, state.q)


def speed(model, node, state):
    return np.zeros(6) if node is None else model.jacobian(node, state.q, axes="aligned") @ state.v
