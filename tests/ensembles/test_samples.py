"""Samples: grids, draws, Sobol sequences, states; what is refused."""

import numpy as np
import pytest
from scipy import stats

import pycraft as pc
from pycraft.ensembles.samples import Samples


def test_a_grid_has_every_combination_once():
    made = pc.samples.grid({"a": [1, 2, 3], "b": [10, 20], "c": ["x", "y"]})
    rows = {(made.row(i)["a"], made.row(i)["b"], made.row(i)["c"]) for i in range(made.count)}
    assert made.count == 12 == len(rows)
    assert [made.row(i)["c"] for i in range(3)] == ["x", "y", "x"]


def test_draws_follow_their_distributions():
    """Means and quantiles of n draws within five standard errors."""
    n = 20000
    made = pc.samples.random(n, {"u": (2.0, 4.0), "n": stats.norm(5.0, 2.0), "c": [1.0, 3.0, 8.0]}, seed=3)
    assert abs(made["u"].mean() - 3) < 5 * (2 / 12**0.5) / n**0.5 and made["u"].min() >= 2 and made["u"].max() <= 4
    assert abs(made["n"].mean() - 5) < 5 * 2 / n**0.5 and abs(np.mean(made["n"] < 7) - stats.norm.cdf(1)) < 5 * 0.37 / n**0.5
    assert set(made["c"]) == {1.0, 3.0, 8.0} and abs(np.mean(made["c"] == 8) - 1 / 3) < 5 * 0.48 / n**0.5
    again = pc.samples.random(n, {"u": (2.0, 4.0), "n": stats.norm(5.0, 2.0), "c": [1.0, 3.0, 8.0]}, seed=3)
    assert all(np.array_equal(made[name], again[name]) for name in made)
    assert not np.array_equal(made["u"], pc.samples.random(n, {"u": (2.0, 4.0)}, seed=4)["u"])


def test_sobol_fills_a_box_more_evenly_than_draws():
    """Every dyadic interval of length 1/n has one point in each coordinate; a mean of a smooth function is nearer than that of draws."""
    n = 256
    made = pc.samples.sobol(n, {"a": (0.0, 1.0), "b": (0.0, 1.0)}, seed=1)
    for name in made:
        assert np.array_equal(np.sort((made[name] * n).astype(int)), np.arange(n))
    exact = (1 - np.cos(1)) ** 2
    drawn = pc.samples.random(n, {"a": (0.0, 1.0), "b": (0.0, 1.0)}, seed=1)
    far, near = (abs(np.mean(np.sin(x["a"]) * np.sin(x["b"])) - exact) for x in (drawn, made))
    assert near < far / 5


def test_states_are_those_of_the_model():
    model = pc.Multibody("flies")
    model.add_body("body", hinge="free", mass=1.0, inertia=np.eye(3))
    made = pc.samples.states(model, 5, seed=2)
    assert made["q"].shape == (5, 7) and made["v"].shape == (5, 6)
    generator = np.random.default_rng(2)
    for i in range(5):
        state = model.random_state(generator)
        assert np.array_equal(made["q"][i], state.q) and np.array_equal(made["v"][i], state.v)


def test_two_together():
    both = pc.samples.grid({"a": [1, 2]}) | {"b": [3, 4]}
    assert both.row(1) == {"a": 2.0, "b": 4.0} and repr(both) == "<2 samples of a, b>"
    with pytest.raises(pc.ModelError, match="a occurs in both sets of samples"):
        both | {"a": [1, 2]}


@pytest.mark.parametrize(
    "call, text",
    [
        (lambda: Samples({}), "samples must map names to values"),
        (lambda: Samples({"a": [1], "b": [1, 2]}), "every name needs the same number of values; got 1 of a, 2 of b"),
        (lambda: Samples({"a": []}), "samples of 'a': at least one value is needed"),
        (lambda: Samples({"a": 3}), "samples of 'a' must be a list, not 3"),
        (lambda: pc.samples.random(0, {"a": (0, 1)}), "count=0: at least one sample is needed"),
        (
            lambda: pc.samples.random(3, {"a": (1, 0)}),
            r"range of 'a': give \(low, high\), two finite numbers with low <= high, not \(1, 0\)",
        ),
        (lambda: pc.samples.random(3, {"a": "x"}), "range of 'a': .*a frozen distribution of scipy.stats, not 'x'"),
        (lambda: pc.samples.random(3, {"a": (0, np.inf)}), "two finite numbers"),
        (lambda: pc.samples.sobol(4, {"a": (0, 1)}, seed=-1), "seed must be a whole number from 0 on"),
    ],
)
def test_what_makes_no_sense_is_refused(call, text):
    with pytest.raises(pc.ModelError, match=text):
        call()
