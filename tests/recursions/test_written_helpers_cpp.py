"""Support code of written C++ programs: headers that compile alone, and compute the same as the Python ones."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from pycraft.recursions import copied_parts
from pycraft.recursions.runtime import cross_products, matrices, stacking
from support.eigen import eigen_headers
from support.tree_systems import ROWS, SIZES, TREES, built, entries_of, random, well_posed

RUNTIME = Path(matrices.__file__).parent


def compiled(text, folder, standard="c++17", program=None):
    """Compiled without a warning, as a program or for its syntax alone."""
    headers = eigen_headers()
    if headers is None:
        pytest.skip("Eigen's headers are not here")
    (folder / "written.cpp").write_text(text, encoding="utf-8")
    made = ["-O0", "-o", str(program)] if program else ["-fsyntax-only"]
    command = ["g++", f"-std={standard}", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-isystem", str(headers), "-I", str(RUNTIME), *made]
    run = subprocess.run([*command, str(folder / "written.cpp")], capture_output=True, text=True)
    assert run.returncode == 0 and not run.stderr, run.stderr[:4000]


@pytest.mark.parametrize("header", ["letters", *copied_parts.TOPICS])
def test_a_header_compiles_by_itself_without_a_warning(header, tmp_path):
    compiled(f'#include "{header}.h"\n', tmp_path)


@pytest.mark.slow
def test_the_headers_compile_as_the_language_of_the_core(tmp_path):
    compiled("".join(f'#include "{topic}.h"\n' for topic in copied_parts.TOPICS), tmp_path, "c++20")


@pytest.mark.slow
def test_a_part_in_cpp_comes_with_all_that_it_uses(tmp_path):
    text = "".join(f"#include <{header}>\n" for header in sorted(copied_parts.cpp_includes()))
    for part in copied_parts.cpp_parts():
        inside = copied_parts.cpp_letters() + "".join(copied_parts.copied(copied_parts.cpp_parts(), part.names[:1]))
        text += f"namespace only_{part.names[0]} {{\n{inside}}}\n"
    compiled(text, tmp_path)


def literal(value):
    """An argument in C++."""
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, np.ndarray) and value.dtype == float:
        return f"matrix({value.shape[0]}, {value.shape[1]}, {{{', '.join(repr(float(x)) for x in value.ravel())}}})"
    if len(value) and isinstance(value[0], int | np.integer):
        return f"std::vector<int>{{{', '.join(map(str, value))}}}"
    kind = "Blocks" if len(value) and getattr(value[0], "dtype", "int") == "float64" else "Rows"
    inner = (literal(x) if len(x) or kind == "Blocks" else "std::vector<int>{}" for x in value)
    return f"{kind}{{{', '.join(inner)}}}"


def numbers(value):
    """A result as a flat list."""
    if isinstance(value, list):
        return [x for block in value for x in numbers(block)]
    return np.ravel(value).tolist()


SHOWN = """
#include <iostream>
using namespace pycraft::written;
void show(double x) { std::cout << x << ' '; }
void show(const Matrix& A) { for (int i = 0; i < A.rows(); ++i) for (int j = 0; j < A.cols(); ++j) show(A(i, j)); }
void show(const Blocks& blocks) { for (const auto& B : blocks) show(B); }
void show(const Rows& rows) { for (const auto& r : rows) for (int i : r) show(double(i)); }
int main() {
  std::cout.precision(17);
"""


def calls():
    """(function, arguments) of every function that both languages have, degenerate sizes included."""
    for n in SIZES:
        A = well_posed(n)
        yield from ((matrices.solve, [A, random(n, m)]) for m in (0, 2))
        yield from ((f, [A]) for f in (matrices.inverse, matrices.symmetric, matrices.lower_half, matrices.diagonal, matrices.trace))
        yield from ((f, [A]) for f in (matrices.norm, matrices.logdet))
        yield from ((matrices.root, [B]) for B in (A @ A.T, np.ones((n, n))))
    yield from ((matrices.square_root, [x]) for x in (2.0, -1e-30))
    yield stacking.ranges, [[2, 0, 3]]
    for rows in ([np.array(r, int) for r in of_bodies] for of_bodies in ROWS.values() if of_bodies):
        x = random(sum(map(len, rows)), 2)
        yield stacking.cut, [x, rows]
        yield stacking.stack, [stacking.cut(x, rows), rows, 2]
        yield stacking.assembled, [[random(len(r), len(r)) for r in rows], rows, rows]
    yield cross_products.skew, [random(3, 1)]
    yield from ((f, [random(6, 1)]) for f in (cross_products.crm, cross_products.crf, cross_products.cross_of_momentum))


@pytest.mark.slow
def test_cpp_computes_what_python_computes(tmp_path):
    lines, expected = [], []
    for function, arguments in calls():
        lines.append(f"show({function.__name__}({', '.join(map(literal, arguments))}));")
        flat = [arguments[0][:, 0]] if function is cross_products.skew else arguments
        expected.append(numbers(function(*flat)))
    singular = [("own", (0, 0, 0), np.eye(1)), ("up", (1, 0, 0), np.eye(1)), ("down", (1, 0, 0), np.eye(1))]
    cases = [(*tree, entries_of(*tree, 6.0)) for tree in TREES.values()] + [([-1, 0], [[1], [1]], [0], singular)]
    for at, (parent, sizes, border, entries) in enumerate(cases):
        system = built(parent, sizes, border, entries)[0]
        b = [x + 1 for x in system.vector(2)]
        lists = literal(parent) if parent else "{}", literal(sizes) if sizes else "{}", literal(border)
        lines.append(f"TreeSystem T{at}({', '.join(lists)});")
        lines += [f"T{at}.{place}({', '.join(map(str, i))}) += {literal(value)};" for place, i, value in entries if value.size]
        lines += [f"Blocks b{at} = T{at}.vector(2);", f"for (auto& x : b{at}) x.array() += 1;"]
        lines.append(f"show(T{at}.solve(b{at})); show(T{at}.logdet()); show(T{at}.inverse());")
        expected.append([*numbers(system.solve(b)), system.logdet(), *numbers(system.inverse())])
    text = "".join(f'#include "{topic}.h"\n' for topic in copied_parts.TOPICS) + SHOWN
    text += "\n".join(f"  {line}{' std::cout << std::endl;' if 'show' in line else ''}" for line in lines) + "\n}\n"
    compiled(text, tmp_path, program=tmp_path / "written")
    shown = subprocess.run([str(tmp_path / "written")], capture_output=True, text=True, check=True).stdout.split("\n")[:-1]
    for line, values in zip(shown, expected, strict=True):
        assert np.allclose(np.array(line.split(), float), values, rtol=1e-12, atol=1e-13)
