"""A few seeds of the campaign of statements against the dense oracle; the whole: `python tests/campaigns/statements.py --seeds 2000`."""

import pytest

from campaigns import statements


def test_a_few_seeds():
    models = [statements.model_of(seed) for seed in (1, 2)]
    judged = 0
    for seed in range(12):
        n, complaints = statements.run(seed, models)
        judged += n
        assert not complaints, complaints
    assert judged >= 4


@pytest.mark.slow
def test_more_seeds():
    found = [statements.run(seed) for seed in range(1000, 1150)]
    assert not [c for _, complaints in found for c in complaints] and sum(n for n, _ in found) > 75
