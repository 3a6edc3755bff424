"""Nodes of many rows, which are eliminated one after the other: the same accelerations and multipliers as by augmentation."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.models.linkages import n_four_bar

E = pc.effects
EPS = np.finfo(float).eps


@pytest.mark.parametrize("rungs", [1, 6, 7, 40])  # 32 rows are looked through at once
def test_both_methods_agree_on_ladders(rungs):
    model = n_four_bar(rungs)
    rng = np.random.default_rng(rungs)
    state = model.assemble([0.9, -0.9] * rungs + [0.9], rng.normal(size=model.nv))
    tau = E.TorqueSource(rng.normal(size=model.nv))
    said = [pc.Scene(model).add(E.Gravity((0, -9.81, 0)), tau, E.Loop(method=m)).evaluate(state.q, state.v) for m in ("augment", "embed")]
    condition = np.linalg.cond(model.mass_matrix(state.q)) * rungs**2
    for ours, theirs in ((said[1].vdot, said[0].vdot), (said[1].forces["loop"], said[0].forces["loop"])):
        assert np.abs(ours - theirs).max() < 1000 * EPS * condition * np.abs(theirs).max()


def test_a_thousand_rungs_by_both_methods():
    """The closed form: cranks turn as one, (n + 1)/3 + n of inertia and (n + 1)/2 + n of weight. Both lose ε n², each row some ε n."""
    n, angle, speed = 1000, 0.9, 2.0
    model, signs = n_four_bar(n), np.array([1.0, -1.0] * n + [1.0])
    model.gravity = (0, -9.81, 0)
    exact = -9.81 * np.cos(angle) * ((n + 1) / 2 + n) / ((n + 1) / 3 + n) * signs
    for method in ("augment", "embed"):
        found = model.constrained_dynamics(angle * signs, speed * signs, method=method)
        assert np.abs(found.vdot - exact).max() < EPS * n**2 * np.abs(exact[0]) and found.rank == 2 * n
        scene = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Loop(method=method))
        assert np.abs(scene.evaluate(angle * signs, speed * signs).vdot - exact).max() < EPS * n**2 * np.abs(exact[0])
        run = scene.simulate(0.02, angle * signs, speed * signs, integrator="rk4", step=0.01, progress=False, energy=False)
        assert np.abs(model.loops.residual(run.q[-1])).max() < 1e-15 * n and np.abs(run.q[-1] - run.q[-1, 0] * signs).max() < 1e-14 * n
