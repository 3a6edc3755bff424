"""Edits of a structure: hinges of every kind to move bodies to, and edits that are refused."""

import pytest

import pycraft as pc
from support.descriptions import random_subhinges


def refused(model, edit, *words, kind=pc.ModelError):
    """An edit is refused with these words, and the model, its state and its operators are as they were."""
    MM, before = model.soa.MM, repr(model.description())
    with pytest.raises(kind) as error:
        edit()
    assert repr(model.description()) == before and MM.check_current() is None
    for word in words:
        assert word in str(error.value), str(error.value)


def options_of(kind, rng):
    """A hinge of a kind as `reattach` takes it."""
    drawn = random_subhinges(kind, rng)
    if kind == "custom":
        return {"subhinges": drawn}
    first = drawn[0] if drawn else {}
    axes = {"universal": 2, "gimbal": 3}.get(kind)
    options = {"axes": [s["axis"] for s in drawn[:axes]]} if axes else {}
    if kind in ("pin", "slider", "screw", "cylindrical"):
        options["axis"] = first["axis"]
    if kind == "planar":
        options["axis"] = drawn[2]["axis"]
    if kind in ("pin", "screw", "universal", "gimbal", "cylindrical", "ball"):
        options["point"] = first["point"]
    if kind == "screw":
        options["pitch"] = first["pitch"]
    return options
