"""A stated part of the campaign against proofs: random true statements are proved, and of perturbed ones nothing false."""

import pytest
from campaigns import proofs


def test_some_true_statements_are_proved_and_nothing_false_is():
    tally = proofs.run(0, 10, proofs.Tally())
    assert not tally.false_proofs, tally.false_proofs
    assert tally.unproved == [] and tally.proved == 10 and tally.perturbed > 10


@pytest.mark.parametrize("seed", [1048])
def test_what_was_once_proved_and_false_is_not_again(seed):
    """Diagonal blocks of B*XKA, B* leading up: what leads down without B* may lead back with it."""
    assert not proofs.run(seed, 1, proofs.Tally()).false_proofs


@pytest.mark.parametrize("seed", [111, 173, 239, 388])
def test_traces_with_inverses_of_symmetric_operators_come_to_an_end(seed):
    assert proofs.run(seed, 1, proofs.Tally()).unproved == []


@pytest.mark.slow
def test_many_true_statements_are_proved_and_nothing_false_is():
    tally = proofs.run(10, 240, proofs.Tally())
    assert not tally.false_proofs, tally.false_proofs
    assert tally.proved >= 0.99 * tally.true and tally.perturbed > 400
