"""Inequalities proved: sums of congruences of what is positive; nothing is proved that is not so."""

import pytest

import pycraft as pc
from pycraft.proofs import prove

PROVED = {
    "ℳ > 0": [], "ℳ + J ≥ ℳ": [], "M ≥ 0": [], "0 < D": [], "P ≥ P⁺": [], "Ω ≥ 0": [], "J ≥ 0": [], "inv(MM + J) > 0": [], "ℳ ≤ ℳ": [],
    "blockdiag(φMφ*) > 0": [], "tr ℳ > 0": [], "θ̇*ℳθ̇ ≥ 0": [], "x ∈ Θ; x*(ℳ + J)x ≥ x*ℳx": [],
    "C : Θ → Θ; C*ℳC ≥ 0": [], "ℳ - [I+HφK]D[I+HφK]* ≥ 0": ["J = 0"], "HψMψ*H* > 0": [],
}  # fmt: skip


@pytest.mark.parametrize("text", PROVED)
def test_what_is_a_sum_of_congruences_is_proved(text):
    proof = prove(text)
    assert proof and proof.recheck() and proof.hypotheses == PROVED[text], repr(proof)
    assert "congruence" in str(proof) or "difference is 0" in str(proof)


@pytest.mark.parametrize("text", ["P > P⁺", "M > P", "Ω > 0", "ℳ < 0", "ℳ > ℳ", "J > 0", "D ≥ ℳ", "C : Θ → Θ; C*ℳC > 0", "ℳ ≥ J"])
def test_what_is_false_is_not_proved(text):
    proof = prove(text)
    assert not proof and "no proof found" in str(proof)


def test_numbers_that_are_no_traces_are_refused_by_name():
    with pytest.raises(pc.EvaluationError, match="inequalities of operators and of traces"):
        prove("ln det ℳ > 0")
