"""Edits of a model that are refused."""

import pytest

import pycraft as pc


def refused(model, edit, *words, kind=pc.ModelError):
    """An edit is refused with these words, and the model, its state and its operators are as they were."""
    MM, before = model.soa.MM, repr(model.description())
    with pytest.raises(kind) as error:
        edit()
    assert repr(model.description()) == before and MM.check_current() is None
    for word in words:
        assert word in str(error.value), str(error.value)
