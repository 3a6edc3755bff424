"""Models whose rotors have v ×* (J v), and that term by hand."""

import numpy as np

import pycraft as pc
from support.oracle import reference


def ball():
    """One body on a ball, as in a gimballed wheel; its three rotors differ."""
    model = pc.Multibody("ball")
    model.add_body("body", None, "ball", mass=1.0, inertia=np.diag([1.0, 2.0, 2.5]))
    model.hinges["body"].rotor_inertia = [0.2, 0.85, 1.5]
    return model


def hull():
    """A floating body with added masses that differ along its axes, and an arm on it."""
    model = pc.Multibody("hull")
    model.add_body("hull", None, "free", mass=2.0, com=(0.1, 0.0, -0.05), inertia=np.diag([0.4, 0.7, 0.9]))
    model.add_body("arm", "hull", "ball", position=(0.3, 0.1, 0.0), mass=0.5, com=(0.0, 0.2, 0.1), inertia=0.05 * np.eye(3))
    model.hinges["hull"].rotor_inertia = [0.3, 0.1, 0.5, 1.0, 2.0, 0.5]
    model.hinges["arm"].rotor_inertia = [0.02, 0.3, 0.1]
    return model


def rotors_of(model):
    return np.concatenate([np.zeros(0), *[hinge.rotor_inertia for hinge in model.hinges.values()]])


def crossed(model, v):
    """v ×* (nv, nv) by subhinges: ω̃ of balls, crf of free ones."""
    out, at = np.zeros((model.nv, model.nv)), 0
    for hinge in model.hinges.values():
        for subhinge in hinge.subhinges:
            size = {"ball": 3, "free": 6}.get(subhinge["kind"], 1)
            here = slice(at, at + size)
            if size > 1:
                out[here, here] = (reference.skew if size == 3 else reference.crf)(v[here])
            at += size
    return out


def gyroscopic(model, v):
    return crossed(model, v) @ (rotors_of(model) * v)
