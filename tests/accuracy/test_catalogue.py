"""The catalogue is whole, its references are right, and its runner sees what goes wrong."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pycraft.accuracy.hard_cases import stability
from pycraft.accuracy.hard_cases.case import DynamicsCase, MeasuredCase, Sample, quantile
from pycraft.accuracy.hard_cases.catalogue import SIZES, catalogue
from pycraft.accuracy.hard_cases.shared_bounds import UD_UNREFINED
from pycraft.accuracy.hard_cases.stability_markdown import markdown
from pycraft.accuracy.hard_cases.stability_table import COLUMNS, Stability
from support.multiprecision import forward_dynamics as exact_dynamics
from support.multiprecision import relative_error

WORDS = (
    """
tip 1e+03; tip 1e+06; tip 1e+09; tip 1e+12; tip 1e+15
growing tenfold; shrinking tenfold; lengths ×2; lengths ×10; alternating
the last three; inner massless; massless tip; massless bodies in a row; coaxial pin
masses 0 and 1e9; masses 0.001 and 1e+09; masses 0.001 and 1e+16; minimum-norm; gimbal at its singularity
wrist at its singularity; parallel pins at one point; turned by π; quaternions of length; 1e6 turns
1e8 rad; 1e8 m away; denormal; exponential of a small angle; derivative of the exponential
logarithm of a small angle; derivative of the logarithm; centre of mass 1000 lengths away; triangle inequality; needle
released under gravity; free tumbling: energy; free tumbling: momentum; length of the quaternion; heavy top
double pendulum over 100 s; stiff damping; simple pendulum: period
""".replace("\n", "; ")
    .strip("; ")
    .split("; ")
)
CASES = {case.name: case for case in catalogue()}


def test_the_list_is_whole():
    """Everything asked for, each by the words it was asked in."""
    assert SIZES == tuple(2**k for k in range(1, 11))
    for n in SIZES:
        assert {f"{n} rods stretched, T = ℳe₁", f"{n} rods stretched, random T", f"{n} rods curled, random T"} <= set(CASES)
    for words in WORDS:
        assert any(words in name for name in CASES), words


def test_names_are_unique_and_texts_are_there():
    every = catalogue()
    assert len({case.name for case in every}) == len(every) > 100
    for case in every:
        assert case.hard and case.quantity and case.reference and case.family


def test_bounds_reach_every_ratio():
    """Unrefined `ud` has its bounds in every heavy-tip, growing, shrinking and alternating case up to 1e12."""
    for case in CASES.values():
        if case.family == "mass ratios" and case.parameters["ratio"] <= 1e12 and case.parameters["T"] == "random":
            assert set(UD_UNREFINED) <= set(case.bounds), case.name


def test_the_condition_of_stretched_rods():
    for n in (16, 64, 256):
        sample = CASES[f"{n} rods stretched, random T"].draw(np.random.default_rng(0), 1)
        assert np.linalg.cond(sample.model.mass_matrix(sample.q[0])) == pytest.approx(4 * n**4, rel=0.1)


@pytest.mark.parametrize("name", ["10 links, tip 1e+15", "8 rods stretched, T = ℳe₁", "13 links, masses growing tenfold, lengths ×2"])
def test_quad_is_right_to_the_last_digit_of_double(name):
    """Against elimination of the mass matrix by Newton and Euler's equations in 80 digits."""
    sample = CASES[name].draw(np.random.default_rng(1), 2)
    found = sample.model.forward_dynamics(sample.q, sample.v, sample.tau, precision="quad")
    for i in range(2):
        exact = exact_dynamics(sample.model, sample.q[i], sample.v[i], sample.tau[i])
        assert relative_error(found[i], exact) <= np.finfo(float).eps


def test_samples_are_reproducible():
    for name in ("10 links, tip 1e+09", "a massless tip", "gimbal 0.01 rad from its singularity"):
        one, again = (CASES[name].draw(np.random.default_rng(5), 3) for _ in range(2))
        assert np.array_equal(one.q, again.q) and np.array_equal(one.tau, again.tau)
        assert np.array_equal(one.model.mass_matrix(one.q[0]), again.model.mass_matrix(again.q[0]))


# What goes wrong is seen ----------------------------------------------------------------------------------------------


class Spoiled:
    """A model whose forward dynamics, except the reference, goes through `spoil`."""

    def __init__(self, model, spoil):
        self._model, self._spoil = model, spoil

    def __getattr__(self, name):
        return getattr(self._model, name)

    def forward_dynamics(self, q, v, tau, *, precision="double", **options):
        if precision == "quad":
            return self._model.forward_dynamics(q, v, tau, precision=precision)
        return self._spoil(lambda: self._model.forward_dynamics(q, v, tau, precision=precision, **options))


def spoiled(name, spoil):
    case = CASES[name]

    def draw(rng, count):
        sample = case.draw(rng, count)
        return Sample(Spoiled(sample.model, spoil), sample.q, sample.v, sample.tau)

    return stability.run(
        8, cases=[replace(case, draw=draw, floor=False, bounds=tuple(b for b in case.bounds if "floor" not in b.formula))], peers=False
    )


def nan_in_the_last(value):
    value = np.array(value)
    value[-1] = np.nan
    return value


def test_a_wrong_value_fails():
    results = spoiled("10 links after 1e6 turns", lambda call: call() * (1 + 1e-11))
    assert not results and all("worst ≤ 1e-12" in row["failed"] for row in results.failures)


def test_a_nan_and_a_wild_value_fail():
    for spoil in (lambda call: nan_in_the_last(call()), lambda call: 10 * call()):
        results = spoiled("10 links, tip 1e+03", spoil)
        assert not results and all("wild values in silence" in row["failed"] for row in results if row["precision"] == "double")


def test_a_refusal_that_must_not_be_fails():
    def refuse(call):
        raise stability._core.SingularHingeError("hinge 'hinge0' feels nothing")

    results = spoiled("an inner massless link", refuse)
    assert all("must be solved" in row["failed"] for row in results if row["precision"] == "double")


def test_a_value_that_must_be_refused_fails():
    def answer(call):
        try:
            return call()
        except stability._core.SingularHingeError:
            return np.zeros((1, 3))

    results = spoiled("a massless tip", answer)
    assert not results and all("must be refused" in row["failed"] for row in results)


def test_the_wrong_hinge_fails():
    def blame(call):
        try:
            return call()
        except stability._core.SingularHingeError:
            raise stability._core.SingularHingeError("hinge 'first' of body 'first'") from None

    results = spoiled("a massless tip", blame)
    assert all("must name hinge 'last'" in row["failed"] for row in results)


def test_relative_errors():
    exact = np.array([[3.0, 4.0], [0.0, 0.0], [1e-200, 0.0], [np.nan, 1.0]])
    value = np.array([[3.0, 4.0 + 5e-9], [0.0, 1e-3], [1e-200, 1e-209], [0.0, 1.0]])
    errors = stability.relative(value, exact)
    assert errors[:3] == pytest.approx([1e-9, 1e-3, 1e-9], rel=1e-6) and np.isinf(errors[3])
    assert np.isinf(stability.relative(np.array([[np.nan, 0.0]]), np.ones((1, 2))))


def test_quantiles_are_observed_values():
    errors = np.array([3.0, 1.0, 2.0, np.nan])
    assert quantile(errors[:3], 0.5) == 2.0 and quantile(errors[:3], 0.95) == 3.0 and np.isinf(quantile(errors, 1.0))


# Tables ---------------------------------------------------------------------------------------------------------------


def test_tables(tmp_path):
    chosen = [CASES["a massless tip"], CASES["10 links, tip 1e+03"]]
    results = stability.run(4, cases=chosen, peers=False)
    assert isinstance(results, Stability) and all(tuple(row) == COLUMNS for row in results)
    text = markdown(results)
    assert "Every bound holds." in text and "hinge 'last'" in text and text.count("\n| a massless tip |") >= 2
    for row in results:
        assert f" {row['method']} |" in text and row["case"] in text
    data = json.loads(results.to_json(tmp_path / "table.json"))
    assert data["seeds"] == 4 and len(data["rows"]) == len(results)
    results.to_csv(tmp_path / "table.csv")
    assert (tmp_path / "table.csv").read_text().startswith("family,case,")
    broken = Stability([{**results[0], "passed": False, "failed": "worst ≤ 1e-12"}], results.about)
    assert not broken and "## Bounds that do not hold" in markdown(broken)


def test_progress_tells_each_case():
    told = []
    stability.run(2, cases=[CASES["a massless tip"]], peers=False, progress=told.append)
    assert told == ["a massless tip"]


def test_every_case_has_a_kind():
    assert all(isinstance(case, (DynamicsCase, MeasuredCase)) for case in CASES.values())
