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
