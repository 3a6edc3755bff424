"""Random sequences of edits: bodies are where they were, and the model is what one is that is built from its description."""

import copy

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pycraft as pc
from support.descriptions import KINDS, random_description
from support.edits import options_of
from support.motions import Motions

EDITS = ("reattach", "detach", "attach", "reroot", "copy", "merge", "remove")
ROUNDING = 1e-8
"""Of poses and twists after up to six edits, each of which leaves the tolerance 1e-9 that hinges are solved to."""


def outboard(model, body):
    return [name for name in model.bodies if body in _way(model, name)]


def _way(model, body):
    way = [body]
    while (parent := model.bodies[way[-1]].parent) is not None:
        way.append(parent.name)
    return way


def edit(model, what, rng, count):
    """One edit of a kind, of a body drawn at random: bodies that are to move as before, and what the model was for others."""
    body = str(rng.choice(list(model.bodies)))
    others = [name for name in model.bodies if name not in outboard(model, body)]
    parent = str(rng.choice(others)) if others and rng.integers(4) else None
    same = set(model.bodies)
    if what == "reattach":
        kind = str(rng.choice(KINDS))
        model.reattach(body, parent, kind, placement="here", velocity="impulse", **options_of(kind, rng))
        same = set() if parent or kind != "free" else same
    elif what == "detach":
        model.detach(body)
    elif what == "attach":
        model.detach(body)
        model.attach(body, parent, "free")
    elif what == "reroot":
        model.detach(_way(model, body)[-1])
        for hinge in model.hinges.values():
            hinge.rotor_inertia = np.zeros(hinge.v_slice.stop - hinge.v_slice.start)
        model.reroot(body)
    elif what == "copy":
        model.copy_subtree(body, parent, prefix=f"{count}/")
    elif what == "merge":
        model.merge(copy.copy(model.subgraph(root=body)), parent, suffix=f"/{count}")
    elif len(model.bodies) > len(outboard(model, body)):
        same -= set(model.remove_body(body).bodies)
    return same


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 2**32 - 1), st.lists(st.sampled_from(EDITS), min_size=1, max_size=6))
def test_sequences_of_edits(seed, edits):
    rng = np.random.default_rng(seed)
    bodies = int(rng.integers(1, 6))
    parents = [int(rng.integers(-1, k)) if k else -1 for k in range(bodies)]
    kinds = [str(kind) for kind in rng.choice(KINDS, bodies)]
    model = pc.Multibody.from_description(random_description(parents, kinds, seed, bool(rng.integers(2))))
    state = model.random_state(rng)
    model.q, model.v = state.q, state.v
    for count, what in enumerate(edits):
        before = Motions(model)
        letters = model.soa
        same = edit(model, what, rng, count)
        after = Motions(model)
        names = set(before.poses) & set(after.poses)
        for name in names:
            assert np.abs(before.poses[name] - after.poses[name]).max() <= ROUNDING * (1 + np.abs(before.poses[name]).max()), (what, name)
        before.assert_same(after, ROUNDING, same)
        assert after.energy_of_bodies <= before.energy * (1 + 1e-9) or what in ("copy", "merge")
        assert letters is model.soa or not letters.is_current()
        again = pc.Multibody.from_description(model.description())
        assert repr(again.description() | {"welds": 0}) == repr(model.description() | {"welds": 0})
        assert np.array_equal(again.mass_matrix(), model.mass_matrix())
        assert np.array_equal(again.bias_forces(), model.bias_forces())
