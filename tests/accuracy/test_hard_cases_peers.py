"""Hard cases beside the installed packages: `fast` is within twice the best of them, and what they do not say is said here."""

import numpy as np
import pytest

from pycraft.accuracy.hard_cases import stability
from pycraft.accuracy.hard_cases.case import DynamicsCase
from pycraft.accuracy.hard_cases.catalogue import catalogue
from pycraft.accuracy.hard_cases.shared_bounds import WITHIN_PEERS

pytestmark = pytest.mark.peers

SEEDS, SIZES = 200, (2, 16, 64)
COMPARED = [case for case in catalogue(SIZES) if isinstance(case, DynamicsCase) and set(WITHIN_PEERS) & set(case.bounds)]


def test_most_cases_are_compared():
    assert len(COMPARED) > 50


@pytest.mark.parametrize("case", COMPARED, ids=lambda case: case.name.replace(" ", "-"))
def test_fast_is_within_twice_the_best(case):
    results = stability.run(SEEDS, cases=[case])
    assert sum(row["peer"] for row in results) >= 2
    row = results.of(case.name, "fast")
    assert "2 × the best peer" in row["bound"] or row["refused"] == SEEDS
    assert row["passed"], (row["failed"], [(r["method"], r["median"], r["p95"]) for r in results])


def test_a_massless_tip_is_refused_here_alone():
    case = next(case for case in catalogue(SIZES) if case.name == "a massless tip")
    results = stability.run(20, cases=[case])
    assert all(row["refused"] == 20 and "hinge 'last'" in row["text"] for row in results if not row["peer"])
    theirs = next(row for row in results if row["method"].startswith("Pinocchio"))
    assert theirs["refused"] == 0 and "returns" in theirs["text"]


def test_world_axes_lose_digits_far_away():
    case = next(case for case in catalogue(SIZES) if case.name == "arm on a base 1e8 m away")
    results = stability.run(20, cases=[case])
    assert results.of(case.name, "fast")["worst"] < 1e-13
    assert next(row for row in results if row["method"].startswith("MuJoCo"))["median"] > 1e-11
    assert np.isfinite([row["worst"] for row in results]).all()
