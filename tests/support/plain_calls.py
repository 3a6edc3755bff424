"""Direct calls for tests: what each is given, and what the Python method gives."""

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core

CALLS = {name: arrays for name, (arrays, _) in _core.direct_calls().items() if not name.endswith("derivatives")}  # of one result


def warm(model):
    """The first call uses the method; its result is cached on the model."""
    model.mass_matrix()
    return model


def panda():
    return warm(pc.robots.panda())


def by_the_method(model, call, *arrays, **options):
    return getattr(type(model), call).__wrapped__(model, *arrays, **options)


def frame_first(model, call):
    return (list(model.bodies)[-1],) if "frame" in _core.direct_calls()[call][1] else ()


def given(model, call, states, seed=0):
    rng = np.random.default_rng(seed)
    q = np.array([model.random_state(int(rng.integers(1 << 30))).q for _ in range(max(states, 1))])
    if states == 0:
        q = q[:0]
    others = [rng.normal(size=(len(q), model.nv)) for _ in CALLS[call][1:]]
    arrays = [np.ascontiguousarray(q), *others]
    return [a[0].copy() for a in arrays] if states < 0 else arrays


def same(a, b):
    assert a.shape == b.shape and a.dtype == b.dtype == np.float64
    np.testing.assert_array_equal(a, b)


def taken_by_the_core(monkeypatch, model):
    """Fails where a call comes by the method."""
    monkeypatch.setattr(type(model), "_calls", lambda self: pytest.fail("by the method"))


def strided(a):
    wide = np.zeros((*a.shape[:-1], 2 * a.shape[-1]))
    wide[..., ::2] = a
    return wide[..., ::2]
