"""Linkages on loops, and their dynamics by dense equations."""

import numpy as np

import pycraft as pc
from pycraft.models import linkages


def dense(model, q, v, tau, gains=(0.0, 0.0), wrench=0.0):
    """v̇ and the least λ of the dense equations: mass matrix and bias by quad sweeps, pseudo-inverse in the scale of the rows."""
    loops = model.loops
    M = model.mass_matrix(q, precision="quad")
    h = model.inverse_dynamics(q, v, np.zeros(model.nv), precision="quad")
    Q, c = loops.jacobian(q, precision="quad"), loops.bias(q, v, precision="quad")
    c = c + 2 * gains[0] * Q @ v + gains[1] ** 2 * loops.residual(q)
    C = np.linalg.cholesky(M)
    W = np.linalg.solve(C, Q.T)
    free = np.linalg.solve(M, tau - h + wrench)
    y = np.linalg.pinv(W.T, rcond=1e-9) @ -(Q @ free + c)
    lam = np.linalg.pinv(W, rcond=1e-9) @ y
    return free + np.linalg.solve(M, Q.T @ lam), lam


def close(got, expected, digits=1e-11):
    expected = np.asarray(expected)
    assert got.shape == expected.shape
    assert np.abs(got - expected).max(initial=0) <= digits * (1 + np.abs(expected).max(initial=0))


def four_bar():
    bars = pc.chain(3)
    bars.gravity = (0.3, -9.81, 0)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    return bars, bars.assemble([1.0, -1.4, -1.5], [1.0, 0, 0], fix="hinge0")


def spatial(floating):
    """Two arms of every sort of hinge that hold one body: a ball, a universal and a weld loop, a coupling, a surface."""
    mb = pc.Multibody("spatial")
    rng = np.random.default_rng(3)

    def body(name, parent, hinge, **more):
        inertia, com = np.diag(rng.uniform(1.0, 1.5, size=3)), rng.normal(size=3) / 9
        mb.add_body(name, parent, hinge=hinge, mass=rng.uniform(0.5, 2), inertia=inertia, com=com, position=rng.normal(size=3), **more)

    body("root", None, "free" if floating else "pin")
    for side in "ab":
        body(f"{side}1", "root", "ball")
        body(f"{side}2", f"{side}1", "pin", axis=(0, 0.6, 0.8))
        body(f"{side}3", f"{side}2", "cylindrical", axis=(1, 0, 0))
    body("tip", "a3", "universal", axes=[(1, 0, 0), (0, 1, 0)])
    mb.add_loop("tip", "b3", hinge="ball", point=(0.3, 0.1, 0), name="hold")
    mb.add_loop("a1", "b1", hinge="planar", name="plane")
    mb.add_coupling({"a2": 1.0, "b2": [0.0, -2.0, 0.5]}, name="gear")
    mb.add_surface("b2", b=(0.2, 1, 0), A=np.diag([1.0, 0, 2]), c=-0.4, name="rail")
    q = mb.integrate(mb.q, rng.normal(size=mb.nv) / 2)
    return mb, q, rng.normal(size=mb.nv), rng.normal(size=mb.nv)


def bricard():
    mb = linkages.bricard()
    mb.gravity = (0, -9.81, 0)
    return mb
