"""Batches of expressions with and without packs: what is recorded and done again at all states, against the states one by one."""

from contextlib import contextmanager

import numpy as np

from pycraft import _core

NEVER = 2**31 - 1


@contextmanager
def packs_from(states):
    """Batches of so many states or more are recorded, whatever that takes; others are not."""
    before = _core.record_from(states)
    try:
        yield
    finally:
        _core.record_from(before)


def in_packs(ask):
    """What a request gives in packs."""
    with packs_from(1):
        return np.asarray(ask(), float)


def one_by_one(ask):
    """What it gives state after state."""
    with packs_from(NEVER):
        return np.asarray(ask(), float)


def packed(bound, request="apply"):
    """What the last run of a bound expression did in packs, as text; empty where it did nothing so."""
    notes = [note for note in bound.plan(request).run_notes if note.startswith("packs:")]
    return notes[0] if notes else ""
