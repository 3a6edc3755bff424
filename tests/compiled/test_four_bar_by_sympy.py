"""The equations that SymPy writes for one four-bar, which compiled dynamics on loops is timed beside."""

import numpy as np
import pytest

from pycraft.cli.bench_loops import ladder
from pycraft.sympy_bridge import four_bar_by_sympy


@pytest.fixture(scope="module")
def states():
    rng = np.random.default_rng(3)
    angles, speeds = rng.uniform(0.4, 2.6, 20), rng.normal(size=20)
    return [np.column_stack([x, -x, x]) for x in (angles, speeds)] + [rng.normal(size=(20, 3))]


def test_they_are_the_accelerations_of_the_model(states):
    model = ladder(1)
    found = four_bar_by_sympy.accelerations(four_bar_by_sympy.library(9.81), *states)
    wanted = np.array([model.constrained_dynamics(*one).vdot for one in zip(*states, strict=True)])
    # rows are solved by their squares: eps / sin² 0.4, some tens of operations each
    np.testing.assert_allclose(found, wanted, rtol=0, atol=100 * np.finfo(float).eps / np.sin(0.4) ** 2 * np.abs(wanted).max())


def test_gravity_is_in_them(states):
    still = [states[0], np.zeros_like(states[0]), np.zeros_like(states[0])]
    found = four_bar_by_sympy.accelerations(four_bar_by_sympy.library(0.0), *still)
    assert np.abs(found).max() == 0
    # all cranks turn alike: 2/3 + 1 of inertia, 1 + 1 of weight (m and l are one)
    falling = four_bar_by_sympy.accelerations(four_bar_by_sympy.library(9.81), *still)
    np.testing.assert_allclose(falling[:, 0], -1.2 * 9.81 * np.cos(states[0][:, 0]), rtol=0, atol=1e-12)
