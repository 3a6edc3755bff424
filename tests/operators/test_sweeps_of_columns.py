"""ℳX and (ℳ + J)X by kernels over many columns (cpp/kernels/mass_matrix_of_columns.h), and φX, φ*X, ψX, ψ*X by their sweeps, for every
kind of hinge: against quad precision and against the dense operators that the oracle makes of the model's blocks."""

import os
import subprocess
import sys

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.kernel_cases import states
from support.many_columns import COLUMNS, TREES, columns_of, sweeps_of

EPS = np.finfo(float).eps


@pytest.fixture(params=list(TREES))
def model(request):
    model = TREES[request.param]
    model.q = states(model, 1)[0][0]
    return model


def bound(model, name, X):
    """Of rounding. A sweep applies one block E, H or M after another, each of at most a dozen products, whose numbers are rounded as
    often: 40 roundings a body on the way from one end to the other, each of it no more than the same sweep makes of magnitudes. Those of
    ψ depend on G, with the rounding of ℳ⁻¹, see test_many_columns.py."""
    E, H, M, J = (np.abs(letter.dense()) for letter in model.soa("E H M J"))
    sweep = np.linalg.inv(np.eye(len(E)) - E)  # exact zeros beside: E is nilpotent
    if name in ("ψ", "ψ*"):
        E_psi, cond = np.abs(model.soa.E_psi.dense()), np.linalg.cond(model.mass_matrix(model.q)) if model.nv else 1.0
        steps = np.linalg.inv(np.eye(len(E)) - E_psi) + cond * np.max(sweep, initial=0.0)
        return 40 * max(model.nv, 1) * EPS * (steps if name == "ψ" else steps.T) @ np.abs(X)
    sizes = {"φ": sweep, "φ*": sweep.T, "ℳ": H @ sweep @ M @ sweep.T @ H.T, "ℳ + J": H @ sweep @ M @ sweep.T @ H.T + J}[name]
    return 40 * max(len(model.bodies), 1) * EPS * (sizes @ np.abs(X))


def blocks_of(model):
    """E, H, M, J, G as dense arrays, made of blocks one by one."""
    return {name: getattr(model.soa, name).dense() for name in "EHMJG"}


def dense_sweep(model, name, X):
    b = blocks_of(model)
    n = len(b["E"])
    E = b["E"] @ (np.eye(n) - b["G"] @ b["H"]) if name in ("ψ", "ψ*") else b["E"]
    resolvent = np.linalg.solve(np.eye(n) - E, np.eye(n))
    if name in ("φ", "ψ"):
        return resolvent @ X
    if name in ("φ*", "ψ*"):
        return resolvent.T @ X
    mass_matrix = b["H"] @ resolvent @ b["M"] @ resolvent.T @ b["H"].T
    return (mass_matrix + (b["J"] if "J" in name else 0)) @ X


@pytest.mark.parametrize("name", ["ℳ", "ℳ + J", "φ", "φ*", "ψ", "ψ*"])
def test_quad_precision_and_dense_operators_agree(model, name):
    operator = sweeps_of(model)[name]
    X = columns_of(model, operator.shape[1])[:, :5]
    within, found = bound(model, name, X), operator @ X
    assert found.shape == (operator.shape[0], 5)
    assert np.all(np.abs(found - operator.at(precision="quad") @ X) <= within)
    assert np.all(np.abs(found - dense_sweep(model, name, X)) <= 10 * within)  # and the rounding of dense products


def test_a_column_has_the_same_bits_among_any_number(model):
    for operator in sweeps_of(model).values():
        X = columns_of(model, operator.shape[1])
        whole = operator @ X
        for columns in (0, 1, 2, 3, 4, 5, 7, 8, 9, 63, 64):
            few = np.ascontiguousarray(X[:, -columns:] if columns else X[:, :0])
            np.testing.assert_array_equal(operator @ few, whole[:, COLUMNS - columns :])
        for c in (0, 63, 64):
            np.testing.assert_array_equal(operator @ np.ascontiguousarray(X[:, c]), whole[:, c])


def test_a_batch_is_its_states(model):
    Q = states(model, 3)[0]
    for operator in sweeps_of(model).values():
        X = columns_of(model, operator.shape[1])[:, :6]
        together = operator.at(Q) @ np.broadcast_to(X, (3, *X.shape))
        for q, one in zip(Q, together, strict=True):
            np.testing.assert_array_equal(operator.at(q) @ X, one)


KEPT = """
import sys
sys.path.insert(0, {folder!r})
import numpy as np
from support.kernel_cases import states
from support.many_columns import TREES, columns_of, sweeps_of
kept = {{}}
for name, model in TREES.items():
    model.q = states(model, 1)[0][0]
    for sweep, operator in sweeps_of(model).items():
        kept[name + "|" + sweep] = operator @ columns_of(model, operator.shape[1])
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
        for key, X in other.items():
            np.testing.assert_array_equal(X, others[0][key])
            name, sweep = key.split("|")
            given = columns_of(TREES[name], sweeps_of(TREES[name])[sweep].shape[1])
            TREES[name].q = states(TREES[name], 1)[0][0]
            assert np.all(np.abs(X - baseline[key]) <= 2 * bound(TREES[name], sweep, given))


def test_what_an_operator_from_outside_changes_is_not_seen():
    """A product reads its array in place, except one that calls a function that might write to it."""
    model = TREES["along axes"]
    MM, x = sweeps_of(model)["ℳ"], np.linspace(-1, 1, model.nv)
    wanted = x + MM @ x

    def outside(given):
        x[:] = 7.0
        return given

    L = _core.external(outside, outside, model.soa.Theta, model.soa.Theta, "L")
    np.testing.assert_array_equal((L + MM) @ x, wanted)


def test_the_given_array_is_left_alone(model):
    for operator in sweeps_of(model).values():
        for X in (columns_of(model, operator.shape[1]), np.linspace(-1, 1, operator.shape[1])):
            kept = X.copy()
            first = operator @ X
            np.testing.assert_array_equal(X, kept)
            X[:] = 0.0
            np.testing.assert_array_equal(operator @ kept, first)


def test_numbers_beyond_range_are_refused():
    model = TREES["along axes"]
    for operator in sweeps_of(model).values():
        X = columns_of(model, operator.shape[1])
        X[3, 7] = np.inf
        with pytest.raises(pc.EvaluationError, match="no finite number"):
            operator @ X
