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
    """Return the result of a request in packs."""
    with packs_from(1):
        return np.asarray(ask(), float)


def one_by_one(ask):
    """Return its result state after state."""
    with packs_from(NEVER):
        return np.asarray(ask(), float)


def packed(bound, request="apply"):
    """Return the part that the last run of a bound expression executed in packs, as text; empty if there was none."""
    notes = [note for note in bound.plan(request).run_notes if note.startswith("packs:")]
    return notes[0] if notes else ""
