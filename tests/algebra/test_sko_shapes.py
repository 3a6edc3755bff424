"""Bare trees: blocks of another shape are refused by name, none is turned or reshaped into one that fits."""

import numpy as np
import pytest

import pycraft as pc

PARENTS = [-1, 0, 0]
E = [None, np.arange(6.0).reshape(2, 3), np.arange(4.0).reshape(2, 2)]
H = [np.eye(1, 2), np.eye(2, 3), np.eye(1, 2)]
M = [np.eye(2), 2 * np.eye(3), np.eye(2)]
J = [np.eye(1), np.eye(2), np.eye(1)]
NAMES = ["trunk", "twig", "leaf"]


def made(**changes):
    blocks = dict(parents=PARENTS, E=E, H=H, M=M, J=J, names=NAMES) | changes
    return pc.sko_model(**blocks)


def put(blocks, k, block):
    return [block if i == k else b for i, b in enumerate(blocks)]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (dict(E=put(E, 1, E[1].T)), r"E of body 'twig' has the shape \(3, 2\); it takes \(2, 3\), from it to its parent 'trunk'"),
        (dict(E=put(E, 1, E[1].ravel())), r"E of body 'twig' has the shape \(6,\); it takes \(2, 3\)"),
        (dict(E=put(E, 0, np.eye(2))), "E of body 'trunk': it is on the base and has none; give None"),
        (dict(E=put(E, 2, None)), r"E of body 'leaf' is missing; it takes \(2, 2\), from it to its parent 'trunk'"),
        (dict(E=E[1:]), "E of 'SKO model': 2 for 3 bodies"),
        (dict(H=put(H, 1, H[1].T)), r"H of body 'twig' has the shape \(3, 2\); it takes \(n, 3\)"),
        (dict(H=put(H, 1, np.arange(6.0))), r"H of body 'twig' has the shape \(6,\); it takes \(n, 3\)"),
        (dict(H=put(H, 0, np.eye(2, 1))), r"H of body 'trunk' has the shape \(2, 1\); it takes \(n, 2\)"),
        (dict(M=put(M, 1, np.ones((3, 2)))), r"M of body 'twig' has the shape \(3, 2\); it takes a square matrix"),
        (dict(M=put(M, 1, np.triu(np.ones((3, 3))))), "M of body 'twig' is not symmetric"),
        (dict(M=put(M, 1, np.diag([1, np.nan, 1]))), "M of body 'twig' has an entry that is not a number"),
        (dict(M=put(M, 1, 1j * M[1])), "M of body 'twig' is complex; models take real numbers"),
        (dict(M=put(M, 1, M[1].astype(str))), "M of body 'twig' is not an array of numbers"),
        (dict(J=put(J, 1, [1, 1])), r"J of body 'twig' has the shape \(2,\); it takes \(2, 2\), one row per coordinate"),
        (dict(J=put(J, 1, 1.0)), r"J of body 'twig' has the shape \(\)"),
        (dict(parents=[-1, 2, 0]), "body 1 of 'SKO model' has parent 2"),
        (dict(parents="abc"), "parents of 'SKO model' must be a list, not 'abc'"),
        (dict(parents=[-1, 0.0, 1]), "parents of 'SKO model' must be a whole number, not 0.0"),
        (dict(names=["a", "a", "b"]), "names of 'SKO model' must be 3 different strings"),
        (dict(names=["a"]), "names of 'SKO model': 1 for 3 bodies"),
        (dict(H=3), "H of 'SKO model' must be a list with one block per body"),
    ],
)  # fmt: skip
def test_blocks_that_do_not_fit(changes, says):
    with pytest.raises(pc.ModelError, match=says):
        made(**changes)


def test_blocks_that_fit():
    """Also one row of H alone, and J of one coordinate as a number."""
    soa, short = made(), made(H=put(H, 0, [1.0, 0.0]), J=put(J, 0, 1.0))
    assert soa.E.dense()[:2, 2:5].tolist() == E[1].tolist()
    assert np.array_equal(soa.D.dense(), short.D.dense()) and np.array_equal(soa.H.dense(), short.H.dense())
