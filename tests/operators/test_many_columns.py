"""ℳ⁻¹X by kernels over many columns (cpp/kernels/body_columns.h), against quad precision for every kind of hinge; `operator @ array` by the
type's own slot against the way that takes anything. The other sweeps over many columns: test_sweeps_of_columns.py."""

import os
import subprocess
import sys

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.kernel_cases import states
from support.many_columns import COLUMNS, TREES, along_axes, columns_of, inverse_of

EPS = np.finfo(float).eps


def bound(model):
    """Of rounding, beside the largest entry of a column: as of the mass matrix's inverse, see tests/dynamics/test_kernels.py."""
    return 40 * model.nv * EPS * np.linalg.cond(model.mass_matrix(model.q)) if model.nv else 0.0


def assert_near(X, exact, within):
    assert X.shape == exact.shape
    assert np.all(np.abs(X - exact).max(axis=0, initial=0) <= within * np.abs(exact).max(axis=0, initial=0))


@pytest.fixture(params=list(TREES))
def model(request):
    model = TREES[request.param]
    model.q = states(model, 1)[0][0]
    return model


def test_quad_precision_agrees(model):
    inverse, X = inverse_of(model), columns_of(model)
    few = X[:, :5]
    exact, within = inverse.at(precision="quad") @ few, bound(model)
    assert_near(inverse @ few, exact, within)
    for form in ("ud", "square-root"):
        assert_near(inverse.at(model.q, form=form) @ few, exact, within)


def test_a_column_has_the_same_bits_among_any_number(model):
    inverse, X = inverse_of(model), columns_of(model)
    whole = inverse @ X
    for columns in (0, 1, 2, 3, 4, 5, 7, 8, 9, 63, 64):
        np.testing.assert_array_equal(
            inverse @ np.ascontiguousarray(X[:, -columns:] if columns else X[:, :0]), whole[:, COLUMNS - columns :]
        )
    for c in (0, 63, 64):
        np.testing.assert_array_equal(inverse @ np.ascontiguousarray(X[:, c]), whole[:, c])


def test_a_batch_is_its_states(model):
    Q, X = states(model, 3)[0], columns_of(model)[:, :6]
    inverse = inverse_of(model)
    together = inverse.at(Q) @ np.broadcast_to(X, (3, *X.shape))
    for q, one in zip(Q, together, strict=True):
        np.testing.assert_array_equal(inverse.at(q) @ X, one)


KEPT = """
import sys
sys.path.insert(0, {folder!r})
import numpy as np
from support.kernel_cases import states
from support.many_columns import TREES, columns_of, inverse_of
kept = {{}}
for name, model in TREES.items():
    model.q = states(model, 1)[0][0]
    kept[name] = inverse_of(model) @ columns_of(model)
np.savez({file!r}, **kept)
"""


def test_instruction_sets_agree(tmp_path):
    """To the bit those that fuse a product with the sum it goes into, all but the baseline of x86-64; those two to rounding."""
    kept = {}
    for name in _core.instruction_sets():
        file = tmp_path / f"{name}.npz"
        text = KEPT.format(folder=os.path.dirname(os.path.dirname(__file__)), file=str(file))
        done = subprocess.run(
            [sys.executable, "-c", text], env={**os.environ, "PYCRAFT_ISA": name}, capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, done.stderr
        kept[name] = dict(np.load(file))
    baseline, *others = kept.values()
    for other in others:
        for name, X in other.items():
            np.testing.assert_array_equal(X, others[0][name])
            assert_near(X, baseline[name], 2 * bound(TREES[name]))


def test_numbers_beyond_range_are_refused():
    model = TREES["along axes"]
    inverse, X = inverse_of(model), columns_of(model)
    X[3, 7] = np.inf
    with pytest.raises(pc.EvaluationError, match="no finite number"):
        inverse @ X
    X[3, 7] = 1e308
    with pytest.raises(pc.EvaluationError, match="beyond the range"):
        (1e10 * inverse) @ X


def test_what_is_no_plain_array_gives_the_same():
    model = TREES["along axes"]
    inverse, X = inverse_of(model), columns_of(model)
    Y = inverse @ X
    for given in (X.tolist(), np.asfortranarray(X), X.astype(">f8"), X[::1], np.ma.masked_array(X)):
        np.testing.assert_array_equal(inverse @ given, Y)
    np.testing.assert_array_equal(inverse @ np.repeat(X, 2, axis=1)[:, ::2], Y)
    np.testing.assert_array_equal(inverse.__matmul__(X), Y)
    np.testing.assert_array_equal(X.T @ inverse, (inverse.T @ X).T)
    ones = np.ones(model.nv, int)
    np.testing.assert_array_equal(inverse @ ones, inverse @ ones.astype(float))
    assert not np.shares_memory(inverse @ X, X)
    fixed = X.copy()
    fixed.flags.writeable = False
    np.testing.assert_array_equal(inverse @ fixed, Y)


@pytest.mark.parametrize("shape", [(), (3,), (10, 2, 2), (11, 1), (0,)])
def test_another_shape_is_refused(shape):
    inverse = inverse_of(TREES["along axes"])
    with pytest.raises(pc.EvaluationError, match=r"it takes an array of shape \(10,\) or \(10, m\), not"):
        inverse @ np.ones(shape)


def test_what_is_no_array_is_not_ours():
    inverse = inverse_of(TREES["along axes"])

    class Other:
        def __rmatmul__(self, left):
            return "reflected"

    assert inverse @ Other() == "reflected"
    for stranger in (None, "X", 3.0):
        with pytest.raises(TypeError):
            inverse @ stranger
        with pytest.raises(TypeError):
            stranger @ inverse


def test_an_edit_between_two_products_is_seen():
    model = along_axes()
    model.q = states(model, 1)[0][0]
    inverse, x = inverse_of(model), np.ones(model.nv)
    before = inverse @ x
    model.bodies["body9"].mass = 7.0
    after = inverse @ x
    np.testing.assert_array_equal(after, inverse_of(model) @ x)
    assert np.abs(after - before).max() > 1e-3 * np.abs(before).max()
    model.hinges[next(iter(model.hinges))].rotor_inertia = 0.5
    np.testing.assert_array_equal(inverse @ x, inverse_of(model) @ x)
