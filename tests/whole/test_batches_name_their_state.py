"""Every public call that takes a batch names the state with an entry that is no number. Calls are found by signature: new ones too."""

import inspect

import numpy as np
import pytest

import pycraft as pc
from pycraft.models.linkages import n_four_bar

FORCES = {"tau", "vdot", "impulse"}
LEFT_OUT = {"view", "plot"}
"""They show one state."""


def chain():
    model = pc.chain(3)
    return model, [0.1, 0.2, 0.3], [0.1, 0.2, 0.3]


def bars():
    model = n_four_bar(1)
    state = model.assemble([1.0, -1.0, 1 - np.pi], [1.0, -1.0, 1.0], starts=1)
    return model, state.q, state.v


def given_to(call, tip, q, v):
    """Arguments by their names, or nothing where the call takes no q, or what is not known here."""
    given = {}
    for name, parameter in inspect.signature(call).parameters.items():
        if name in ("q", "v"):
            given[name] = q if name == "q" else v
        elif name in FORCES:
            given[name] = np.zeros_like(v)
        elif name in ("node", "body", "frame"):
            given[name] = tip
        elif parameter.default is parameter.empty and parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            return {}
    if {"tau", "vdot"} <= set(given) and "interbody" in call.__name__:
        del given["vdot"]
    return given if "q" in given else {}


def calls_of(holder):
    for name in dir(type(holder)):
        if not name.startswith("_") and name not in LEFT_OUT and inspect.isfunction(inspect.getattr_static(type(holder), name)):
            yield name, getattr(holder, name)


@pytest.mark.parametrize("made", [chain, bars])
def test_what_is_no_number_in_a_batch_is_named_with_its_state(made):
    model, q, v = made()
    q, v, tip = np.tile(q, (3, 1)), np.tile(v, (3, 1)), list(model.bodies)[-1]
    asked = 0
    for holder in (model, model.loops, model.frame(tip)):
        for name, call in calls_of(holder):
            given = given_to(call, tip, q, v)
            try:
                assert given
                call(**given)
            except (pc.Error, AssertionError, TypeError):
                continue  # it takes no batch, or not these
            for argument in [key for key, x in given.items() if isinstance(x, np.ndarray)]:
                wrong = given[argument].copy()
                wrong[1, 0] = np.nan
                with pytest.raises(pc.Error) as caught:
                    call(**given | {argument: wrong})
                assert "(state 1 of a batch of 3)" in str(caught.value), (name, argument, str(caught.value))
                asked += 1
    assert asked > 80
