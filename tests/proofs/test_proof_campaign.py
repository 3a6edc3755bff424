"""A stated part of the campaign against proofs: random true statements are proved, and of perturbed ones nothing false."""

import pytest

from campaigns import proofs


def test_some_true_statements_are_proved_and_nothing_false_is():
    tally = proofs.run(range(10))
    assert not tally.false_proofs, tally.false_proofs
    assert tally.unproved == [] and tally.proved == 10 and tally.perturbed > 10


@pytest.mark.parametrize("seed", [1048])
def test_what_was_once_proved_and_false_is_not_again(seed):
    """Diagonal blocks of B*XKA, B* leading up: what leads down without B* may lead back with it."""
    assert not proofs.run([seed]).false_proofs


@pytest.mark.parametrize("seed", [111, 173, 239, 388])
def test_traces_with_inverses_of_symmetric_operators_come_to_an_end(seed):
    assert proofs.run([seed]).unproved == []


def test_the_command_says_how_far_it_is_and_goes_on_where_it_stopped(tmp_path, capsys, monkeypatch):
    results = tmp_path / "results"
    assert proofs.main(["--seeds", "2", "--to", str(results), "--every", "0"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert "1 of 2 seeds" in said[0] and said[-1].startswith("2 of 2 true statements proved")
    with open(results, "a") as lines:
        lines.write('[2, {"tr')  # cut off
    ran = []
    monkeypatch.setattr(proofs, "tried", lambda seed, each, whole=proofs.tried: ran.append(seed) or whole(seed, each))
    assert proofs.main(["--seeds", "3", "--to", str(results)]) == 0
    assert ran == [2] and capsys.readouterr().out.startswith("3 of 3")
    results.write_text('[0, {"true": 1, "false_proofs": [[0, "D = J"]]}]\n')
    assert proofs.main(["--seeds", "1", "--to", str(results)]) == 1
    assert "FALSE, seed 0: D = J" in capsys.readouterr().out


def test_quick_statements_are_perturbed_as_often_as_asked_for(monkeypatch):
    monkeypatch.setattr(proofs, "QUICK", float("inf"))
    often, seldom = proofs.tried(0, 12).perturbed, proofs.tried(0).perturbed
    assert often > seldom > 0
    monkeypatch.setattr(proofs, "QUICK", 0.0)
    assert proofs.tried(0, 12).perturbed == seldom


@pytest.mark.slow
def test_many_true_statements_are_proved_and_nothing_false_is():
    tally = proofs.run(range(10, 110))
    assert not tally.false_proofs, tally.false_proofs
    assert tally.proved >= 0.99 * tally.true and tally.perturbed > 150
