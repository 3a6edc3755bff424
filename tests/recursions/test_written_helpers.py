"""Support code of written programs (pycraft/recursions/runtime): each function against NumPy, and the copied parts."""

import ast
import builtins
import inspect
import re
import symtable
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import block_diag

from pycraft.recursions import copied_parts
from pycraft.recursions.runtime import cross_products, matrices, stacking, tree_system
from support.tree_systems import ROWS, SIZES, TREES, built, entries_of, random, well_posed

MODULES = {module.__name__.rpartition(".")[2]: module for module in (matrices, stacking, cross_products, tree_system)}
RUNTIME = Path(matrices.__file__).parent


# ---------------------------------------------------------------------- dense matrices


@pytest.mark.parametrize("columns", [0, 1, 3])
@pytest.mark.parametrize("n", SIZES)
def test_what_is_solved_gives_the_right_side_back(n, columns):
    A, b = well_posed(n), random(n, columns)
    x = matrices.solve(A, b)
    assert x.shape == (n, columns) and np.allclose(A @ x, b, atol=1e-14)
    assert matrices.inverse(A).shape == (n, n) and np.allclose(matrices.inverse(A) @ A, np.eye(n), atol=1e-14)


@pytest.mark.parametrize("n", SIZES)
def test_parts_and_numbers_of_a_matrix(n):
    A = random(n, n)
    S = matrices.symmetric(A)
    assert np.array_equal(S, S.T) and np.allclose(2 * S, A + A.T)
    L = matrices.lower_half(S)
    assert np.allclose(L + L.T, S) and not np.triu(L, 1).any()
    assert np.array_equal(matrices.diagonal(A), [[A[i, i]] for i in range(n)] if n else np.zeros((0, 1)))
    assert np.isclose(matrices.trace(A), sum(A[i, i] for i in range(n)))
    assert np.isclose(matrices.norm(random(n, 2)), np.sqrt((random(n, 2) ** 2).sum()))
    assert np.isclose(np.exp(matrices.logdet(A)), abs(np.linalg.det(A)))
    flipped = np.diag([-1.0] * (n > 0) + [1.0] * (n - 1)) @ A if n else A
    assert np.isclose(matrices.logdet(flipped), matrices.logdet(A))


def test_a_square_root_takes_rounding_for_zero():
    assert (matrices.square_root(9.0), matrices.square_root(0.0), matrices.square_root(-1e-30)) == (3.0, 0.0, 0.0)


@pytest.mark.parametrize("n", SIZES)
def test_the_root_of_a_positive_matrix_is_choleskys(n):
    A = random(n, n) @ random(n, n).T + np.eye(n)
    assert np.allclose(matrices.root(A), np.linalg.cholesky(A), atol=1e-14)


def test_the_root_of_a_singular_matrix_has_columns_of_zeros():
    F = random(5, 2)
    L = matrices.root(F @ F.T)
    assert np.allclose(L @ L.T, F @ F.T, atol=1e-15) and not np.triu(L, 1).any() and not L[:, 2:].any()
    assert not matrices.root(np.zeros((3, 3))).any()


def test_a_pivot_is_zero_within_the_rounding_of_the_largest_entry():
    """16 n ε of the largest diagonal entry, n = 2."""
    eps = np.finfo(float).eps
    for scale in (1.0, 1e8):
        for pivot, expected in ((31, 0.0), (-31, 0.0), (33, np.sqrt(33 * eps * scale))):
            assert matrices.root(np.diag([scale, pivot * eps * scale]))[1, 1] == expected
        with pytest.raises(ValueError, match="not positive semidefinite"):
            matrices.root(np.diag([scale, -33 * eps * scale]))


# ---------------------------------------------------------------------- body by body


@pytest.mark.parametrize("sizes", [[], [3], [2, 0, 3], [0, 0]])
def test_ranges_follow_each_other(sizes):
    rows = stacking.ranges(sizes)
    assert [len(r) for r in rows] == sizes and [i for r in rows for i in r] == list(range(sum(sizes)))


@pytest.mark.parametrize("columns", [0, 1, 2])
@pytest.mark.parametrize("name", ROWS)
def test_a_vector_is_cut_and_stacked(name, columns):
    rows = [np.array(r, int) for r in ROWS[name]]
    x = random(sum(map(len, rows)), columns)
    blocks = stacking.cut(x, rows)
    assert [b.shape for b in blocks] == [(len(r), columns) for r in rows]
    assert all(np.array_equal(block[i], x[row]) for block, r in zip(blocks, rows, strict=True) for i, row in enumerate(r))
    assert np.array_equal(stacking.stack(blocks, rows, columns), x)


@pytest.mark.parametrize("name", ROWS)
def test_blocks_stand_on_the_diagonal(name):
    rows = [np.array(r, int) for r in ROWS[name]]
    columns = stacking.ranges([k % 3 for k in range(len(rows))])
    B = [random(len(r), len(c)) for r, c in zip(rows, columns, strict=True)]
    order = np.array([i for r in rows for i in r], int)
    expected = np.zeros((len(order), sum(map(len, columns))))
    expected[order] = block_diag(np.zeros((0, 0)), *B)
    assert np.array_equal(stacking.assembled(B, rows, columns), expected)


def test_blocks_are_brought_to_their_shapes():
    rows, columns = stacking.ranges([2, 0, 1]), stacking.ranges([3, 2, 1])
    none, empty, one = stacking.blocks([None, [], [5]], rows, columns)
    assert none is None and empty.shape == (0, 2) and one.shape == (1, 1) and one.dtype == float
    assert np.array_equal(stacking.blocks([list(range(6))], rows[:1], columns[:1])[0], [[0, 1, 2], [3, 4, 5]])
    assert stacking.blocks([], [], []) == []
    with pytest.raises(ValueError, match="zip"):
        stacking.blocks([None], rows, columns)


# ---------------------------------------------------------------------- cross products


def test_cross_products_are_numpys():
    V, U, h = (np.random.default_rng(i).normal(size=(6, 1)) for i in range(3))
    w, v, a, b, n, f = (x[part, 0] for x in (V, U, h) for part in (slice(3), slice(3, 6)))
    assert np.allclose(cross_products.skew(w) @ a, np.cross(w, a))
    motion = np.concatenate([np.cross(w, a), np.cross(v, a) + np.cross(w, b)])
    force = np.concatenate([np.cross(w, n) + np.cross(v, f), np.cross(w, f)])
    assert np.allclose((cross_products.crm(V) @ U)[:, 0], motion) and np.allclose((cross_products.crf(V) @ h)[:, 0], force)
    assert np.allclose((cross_products.cross_of_momentum(h) @ V)[:, 0], force)


# ---------------------------------------------------------------------- systems over a tree


def assert_is(system, T, rows, parent, tolerance=1e-12):
    """A system is what its dense matrix is: product, solution, determinant, blocks of the inverse."""
    n, inverse = len(parent), np.linalg.inv(T) if len(T) else T
    assert np.array_equal(system.dense(), T)
    b = system.vector(2)
    assert [len(x) for x in b] == [sum(len(range(*r.indices(len(T)))) for (k, _), r in rows.items() if k == m) for m in range(n + 1)]
    whole = random(len(T), 2)
    for (k, i), r in rows.items():
        system.part(b, k if k < n else -1, i)[...] = whole[r]
    assert np.allclose(np.concatenate(b), whole)
    assert np.allclose(np.concatenate(system.times(b)), T @ whole, atol=1e-13)
    assert np.allclose(np.concatenate(system.solve(b)), inverse @ whole, atol=tolerance)
    assert np.isclose(system.logdet(), np.linalg.slogdet(T)[1] if len(T) else 0.0, atol=1e-12)
    Z = system.inverse()
    assert len(Z) == n
    for k in range(n):
        for j in range(2):
            for i in range(2):
                assert np.allclose(system.block(Z, k, j, i), inverse[rows[k, j], rows[k, i]], atol=tolerance)


@pytest.mark.parametrize("name", TREES)
def test_a_system_over_a_tree_is_its_dense_matrix(name):
    parent, sizes, border = TREES[name]
    system, T, rows = built(parent, sizes, border, entries_of(parent, sizes, border, 6.0))
    assert_is(system, T, rows, parent)
    assert system.whole is None


@pytest.mark.parametrize("pivot", [0.0, 1e-14])
@pytest.mark.parametrize("border", [[0, 0], [1, 1]])
def test_a_singular_pivot_has_all_solved_at_once(pivot, border):
    parent, sizes = [-1, 0], [[1, 1], [1, 1]]
    leaf = [e for e in entries_of(parent, sizes, border) if not (e[0] == "own" and e[1][0] == 1)]
    leaf += [("own", (1, i, i), np.array([[pivot]])) for i in range(2)]
    system, T, rows = built(parent, sizes, border, leaf)
    assert_is(system, T, rows, parent, 1e-11)
    assert np.array_equal(system.whole, T)


def test_a_system_is_factored_once_and_refined():
    parent, sizes, border = TREES["a chain"]
    system, T, _ = built(parent, sizes, border, entries_of(parent, sizes, border, 6.0))
    system.factor()
    factors = list(system.pivots[0])
    first = system.solve(system.vector(1))
    assert all(a is b for a, b in zip(system.pivots[0], factors, strict=True)) and not np.concatenate(first).any()
    exact = system.sweep
    system.sweep = lambda b: [x * (1 + 1e-6) for x in exact(b)]  # a sweep with an error of 1e-6 is off by its square
    b = [np.ones_like(x) for x in system.vector(1)]
    assert np.allclose(np.concatenate(system.solve(b)), np.linalg.solve(T, np.ones((len(T), 1))), rtol=1e-10, atol=0)


# ---------------------------------------------------------------------- what is copied


def test_what_is_copied_is_the_source_of_what_was_tested():
    parts = copied_parts.python_parts()
    for part in parts:
        (module,) = (
            module for module in MODULES.values() if getattr(getattr(module, part.names[0], None), "__module__", "") == module.__name__
        )
        assert inspect.getsource(getattr(module, part.names[0])) == part.text
    names = [part.names[0] for part in parts]
    defined = [
        node.name
        for topic in copied_parts.TOPICS
        for node in ast.parse((RUNTIME / f"{topic}.py").read_text("utf-8")).body
        if hasattr(node, "name")
    ]
    assert names == defined and len(set(names)) == len(names) >= 20
    assert set(copied_parts.TOPICS) == set(MODULES) == {path.stem for path in RUNTIME.glob("*.py")} - {"__init__"}


def test_sources_rest_on_numpy_or_eigen_and_their_neighbours():
    for topic in copied_parts.TOPICS:
        for node in ast.parse((RUNTIME / f"{topic}.py").read_text("utf-8")).body:
            if isinstance(node, ast.Import | ast.ImportFrom):
                assert ast.unparse(node) == "import numpy as np" or (node.level == 1 and node.module in copied_parts.TOPICS)
    headers = {path.name for path in RUNTIME.glob("*.h")}
    assert headers == {"letters.h", *(f"{topic}.h" for topic in copied_parts.TOPICS)}
    for header in headers:
        assert set(re.findall(r'#include "(.*)"', (RUNTIME / header).read_text("utf-8"))) <= headers
    assert copied_parts.cpp_includes() == {"Eigen/Dense", "algorithm", "cmath", "limits", "stdexcept", "vector"}


def globals_of(table):
    """The names that a text takes from outside its functions."""
    names = {s.get_name() for s in table.get_symbols() if s.is_referenced() and (s.is_global() or table.get_type() == "module")}
    return names.union(*(globals_of(child) for child in table.get_children()))


@pytest.mark.parametrize("name", [part.names[0] for part in copied_parts.python_parts()])
def test_a_part_comes_with_all_that_it_uses_and_no_more(name):
    texts = copied_parts.copied(copied_parts.python_parts(), [name])
    module = symtable.symtable("".join(texts), "written", "exec")
    defined = {child.get_name() for child in module.get_children()}
    assert globals_of(module) - set(dir(builtins)) - {"np"} <= defined and len(defined) == len(texts)
    for other in defined - {name}:
        assert re.search(rf"(?<!\.)\b{other}\(", "".join(text for text in texts if not re.match(rf"(def|class) {other}\b", text)))


def test_parts_come_in_the_order_of_the_files_whatever_is_called_first():
    parts = copied_parts.python_parts()
    assert copied_parts.copied(parts, ["crm", "solve"]) == copied_parts.copied(parts, ["solve", "skew", "crm"])
    heads = [text.split("(")[0].split(":")[0] for text in copied_parts.copied(parts, ["TreeSystem", "crf"])]
    assert heads == ["def solve", "def inverse", "def logdet", "def skew", "def crf", "class TreeSystem"]
    assert copied_parts.copied(parts, []) == []
    with pytest.raises(KeyError, match="no such"):
        copied_parts.copied(parts, ["no such"])


def test_parts_of_a_header_end_at_blank_lines_outside_braces():
    parts = copied_parts.cpp_parts()
    assert {part.names[0] for part in copied_parts.python_parts()} - {name for part in parts for name in part.names} == {"blocks"}
    (system,) = (part for part in parts if "TreeSystem" in part.names)
    assert system.text.endswith("};\n") and "\n\n private:" in system.text
    assert "namespace" not in "".join(part.text for part in parts) and copied_parts.cpp_letters().count("using") == 3
    heads = [part.names[0] for part in parts if part.text in copied_parts.copied(parts, ["assembled"])]
    assert heads == ["size", "put", "assembled"]
