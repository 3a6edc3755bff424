"""Bare trees of blocks of mixed sizes, without mechanics, beside the dense oracle.

Blocks are drawn with ‖E(p,k)‖ near one, M and J well inside the positive definite matrices.
"""

import numpy as np

import pycraft as pc
from support.formulas import Letters
from support.oracle import reference
from support.spellings import spd

TREES = {
    "chain": [-1, 0, 1, 2, 3],
    "star": [-1, 0, 0, 0, 0],
    "tree": [-1, 0, 0, 1, 1, 2, 4],
    "forest": [-1, -1, 0, 1, 1, -1, 5],
    "one": [-1],
    "deep branch": [-1, 0, 1, 1, 3, 3, 0, 6],
}


def random_blocks(parents, rng, with_J, sizes=(3, 6, 9), zero_dof=True):
    """Blocks E, H, M, J of random sizes and numbers of coordinates; some bodies have no coordinate where `zero_dof`."""
    size = [int(rng.choice(sizes)) for _ in parents]
    dof = [int(rng.integers(0 if zero_dof and k else 1, min(s, 6) + 1)) for k, s in enumerate(size)]
    E = [rng.normal(size=(size[p], s)) / np.sqrt(s) if p >= 0 else None for p, s in zip(parents, size, strict=True)]
    H = [rng.normal(size=(n, s)) for n, s in zip(dof, size, strict=True)]
    J = [spd(rng, n) for n in dof] if with_J else None
    return parents, E, H, [spd(rng, s) for s in size], J


def letters_on(shape, with_J, seed=0):
    """The letters of one random tree."""
    blocks = random_blocks(TREES[shape], np.random.default_rng([seed, list(TREES).index(shape)]), with_J)
    return Letters(pc.sko_model(*blocks), reference.sko_operators(*blocks))
