"""The semidefinite program of identification where the log and the prior weigh very differently, and bodies that have nothing."""

import numpy as np
import pytest

import pycraft as pc


def log(model, count=150, seed=0):
    rng = np.random.default_rng(seed)
    q = np.array([model.random_state(rng).q for _ in range(count)])
    v, vdot = rng.uniform(-2, 2, (2, count, model.nv))
    return q, v, vdot, model.inverse_dynamics(q, v, vdot)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("seed", range(4))
def test_they_are_found_where_the_log_says_nearly_all(noise, seed):
    pytest.importorskip("clarabel")
    model = pc.tree([-1, 0], ["free", "ball"], seed=seed)
    *state, tau = log(model)
    model.bodies["body1"].mass *= 1.3  # rotors that forces do not tell from bodies come out negative
    found = model.identify(*state, tau + noise * np.random.default_rng(1).normal(size=tau.shape), rotors=True, viscous=True)
    assert found.consistent and found.by == "clarabel" and found.residuals.std() < 1.01 * noise + 1e-9


def test_a_base_without_mass_stays_without():
    part = pc.tree([-1, 0, 1, 0], ["free", "pin", "ball", "pin"], seed=1).subgraph(root="body1", base="moving")
    found = part.identify(*log(part))
    assert found.consistent and found.by == "least squares" and not found.parameters[:10].any()
