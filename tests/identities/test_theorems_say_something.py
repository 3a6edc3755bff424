"""No theorem is empty: its sides are not zero where nothing is. (That each hypothesis is needed: test_hypotheses.)"""

import numpy as np

import pycraft as pc
from pycraft import _core
from pycraft.identities.checker import drawn_vectors, with_spaces
from support.mechanisms import every_kind, with_hinges

ZERO_ON_BOTH_SIDES = {"det of the innovations factor is 1"}  # ln det = 0: judged by the size of its terms


def size(theorem):
    """The larger side at the present state; 0 where an inverse is not there."""
    lhs, rhs = with_spaces(theorem.lhs, theorem.rhs)
    assert lhs != rhs, theorem.name
    rng = np.random.default_rng(0)
    vectors = drawn_vectors(rhs, rng, drawn_vectors(lhs, rng, {}))
    numbers = {name: [float(x) for x in vector] for name, vector in vectors.items()}
    try:
        return max(_core.residual(lhs, rhs, numbers, theorem.on_one_path, theorem.at_most)[1:])
    except pc.SingularOperatorError:
        return 0.0


def test_sides_are_not_zero():
    """On moving trees with gravity: a theorem whose sides vanish on all of them was never tested there."""
    sizes = {}
    for model in (every_kind(True), with_hinges("pin", "chain"), with_hinges("free", "chain")):
        model.gravity = (1.0, 2.0, -9.0)
        for theorem in model.soa.theorems():
            if not theorem.waiting:
                sizes[theorem.name] = max(sizes.get(theorem.name, 0.0), size(theorem))
    assert {name for name, largest in sizes.items() if not largest > 0} <= ZERO_ON_BOTH_SIDES and len(sizes) > 130
