"""Models whose operators are applied to many columns at once: models of the kernels of direct calls, and pins along coordinate axes."""

import numpy as np

import pycraft as pc
from pycraft.peers.timed_models import chain_of_machines

from .kernel_cases import MODELS

COLUMNS = 65


def along_axes():
    """Pins along coordinate axes and against them, frames turned about them and otherwise, in a tree that branches twice at a body."""
    model = pc.Multibody("along axes")
    rng = np.random.default_rng(2)
    for k, parent in enumerate([None, 0, 1, 1, 3, 1, 5, 0, None, 8]):
        axis = np.zeros(3)
        axis[k % 3] = -1 if k % 2 else 1
        turned = np.linalg.qr(rng.normal(size=(3, 3)))[0] if k in (2, 5, 6) else np.eye(3)
        turned *= np.linalg.det(turned)
        model.add_body(
            f"body{k}", None if parent is None else f"body{parent}", axis=axis, position=rng.uniform(-1, 1, 3), rotation=turned,
            mass=1 + 0.1 * k, com=rng.uniform(-0.2, 0.2, 3), inertia=np.diag([0.3, 0.4, 0.5]),
        )  # fmt: skip
    return model


TREES = {**MODELS, "along axes": along_axes(), "chain of machines": chain_of_machines(12), "nothing": pc.Multibody("nothing")}


def with_rotors():
    """A tree of three branches at one body and a hinge of three coordinates, rotors on some."""
    model = pc.tree([-1, 0, 0, 0, 2, 2], ["pin", "ball", "pin", "screw", "pin", "slider"], seed=8, name="with rotors")
    for name, inertia in zip(list(model.hinges)[::2], (0.3, 1.1, 0.2), strict=False):
        model.hinges[name].rotor_inertia = inertia
    return model


TREES["with rotors"] = with_rotors()


def inverse_of(model):
    H, phi, M, J = model.soa("H phi M J")
    return (H @ phi @ M @ phi.T @ H.T + J).inv()


def sweeps_of(model):
    """Further operators applied to many columns."""
    H, phi, psi, M, J = model.soa("H phi psi M J")
    MM = H @ phi @ M @ phi.T @ H.T
    return {"ℳ": MM, "ℳ + J": MM + J, "φ": phi, "φ*": phi.T, "ψ": psi, "ψ*": psi.T}


def columns_of(model, rows=None):
    return np.random.default_rng(11).uniform(-1, 1, (model.nv if rows is None else rows, COLUMNS))
