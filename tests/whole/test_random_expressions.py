"""A small part of the campaign against expressions (tests/campaigns/expressions.py), with seeds: no crash, no number that nobody wrote."""

import pytest

from campaigns.expressions import seed_run


@pytest.mark.parametrize("seed", range(6))
def test_random_expressions_are_what_numpy_makes_of_them(seed):
    done, faults = seed_run(seed, expressions=12)
    assert not faults, "\n".join(faults)
    assert sum(done.values()) > 40


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6, 30))
def test_more_random_expressions(seed):
    done, faults = seed_run(seed)
    assert not faults, "\n".join(faults)
    assert sum(done.values()) > 100
