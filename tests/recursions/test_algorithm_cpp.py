"""algorithm() in C++: compiled without pycraft and without a warning, it computes what the plan computes.

Numbers are compared within the running bounds of `formulas`.
"""

import re
import subprocess

import numpy as np
import pytest

from support.block_trees import TREES, letters_on
from support.eigen import eigen_headers
from support.formulas import letters_of, norm
from support.mechanisms import random_tree
from support.random_formulas import draw, seeded
from support.spellings import EVERYTHING, letters_and_constants
from support.written_programs import (
    DERIVATIVES,
    MECHANICS,
    dense_expressions,
    logdet_bound,
    scalars,
)

PRINT = """
template <class T>
void print(const T& result) {
  Eigen::MatrixXd y(1, 1);
  if constexpr (std::is_same_v<T, double>) y(0, 0) = result;
  else y = result;
  for (int i = 0; i < y.rows(); ++i)
    for (int j = 0; j < y.cols(); ++j) std::cout << y(i, j) << ' ';
  std::cout << std::endl;
}
int main() {
  std::cout.precision(17);
"""


def run_cpp(algorithms, folder):
    """The results of several algorithms at x = 1, compiled as one file; lists of numbers."""
    headers = eigen_headers()
    if headers is None:
        pytest.skip("Eigen's headers are not here")
    text, calls = "", []
    for i, written in enumerate(algorithms):
        source = written.cpp(with_data=True, name=f"a{i}")
        assert set(re.findall(r"#include <(.*?)>", source)) == {
            *("Eigen/Dense", "algorithm", "cmath", "functional", "iostream", "limits", "stdexcept", "vector")
        }
        assert '#include "' not in source and "pycraft" not in source
        call = re.search(r"a\d+::run\((.*)\)( <<|\))", source).group(0).removesuffix(" <<")
        text += source
        calls.append(f"  print({call});")
    (folder / "written.cpp").write_text(text + PRINT + "\n".join(calls) + "\n}\n", encoding="utf-8")
    program = folder / "written"
    command = ["g++", "-std=c++17", "-O0", "-Wall", "-Wextra", "-DNO_MAIN", "-isystem", str(headers), "-o", str(program)]
    made = subprocess.run([*command, str(folder / "written.cpp")], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr[:4000]
    assert "warning" not in made.stderr, made.stderr[:4000]
    shown = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout
    return [np.array(line.split(), float) for line in shown.splitlines()]


def cpp_cases(o, c, names):
    """(algorithm, expected, bound) of spellings, applied and reduced."""
    for name in names:
        formula = EVERYTHING[name](o, c)
        op, value = formula.op, formula.value
        x = np.ones(len(value[0]))
        yield op.algorithm("cpp"), value @ x, formula.bound * np.sqrt(len(x))
        if op.domain == op.codomain:
            yield op.algorithm("cpp", "trace"), [np.trace(value)], formula.bound * len(value)
            yield op.algorithm("cpp", "diagonal"), np.diag(value), formula.bound
            yield op.algorithm("cpp", "dense"), value.ravel(), formula.bound
            if np.linalg.cond(value) < 1e12:
                yield op.algorithm("cpp", "logdet"), [np.linalg.slogdet(value)[1]], logdet_bound(formula)


GROUPS = {
    "kernels and sweeps": ["ℳ with J", "ℳ⁻¹ as typed", "(I+HφK)⁻¹", "φψφ*-like", "𝒥", "D^-½HψM^½", "blockdiag ψMψ*", "blockdiag φ*Wφ"],
    "eliminations": ["shifted", "nested shifts", "φMφ* and loads", "compliance by hand", "blockdiag of a shifted inverse"],
    "borders and nodes": ["rank two", "Schur complement", "Woodbury by hand", "Λ", "(ℳ+𝒥*𝒥)⁻¹", "siblings", "E X E*"],
}


def assert_cpp(cases, folder):
    cases = list(cases)
    for (written, expected, bound), got in zip(cases, run_cpp([case[0] for case in cases], folder), strict=True):
        off = np.abs(got - np.asarray(expected)).max(initial=0.0)
        assert off <= bound, f"{written.title}: off by {off:.2e}, bound {bound:.2e}"


@pytest.mark.slow
@pytest.mark.parametrize("group", GROUPS)
def test_cpp_of_spellings(group, tmp_path):
    assert_cpp(cpp_cases(*letters_and_constants(True), GROUPS[group]), tmp_path)


@pytest.mark.slow
def test_cpp_of_mechanics_scalars_and_dense_steps(tmp_path):
    o, _ = letters_and_constants(True)
    cases = []
    for make in MECHANICS.values():
        vector = make(o.soa)
        expected = vector.value()
        cases.append((vector.algorithm("cpp"), expected, 1e-12 * (1 + norm(expected))))
    for scalar in scalars(o):
        cases.append((scalar.algorithm("cpp"), [float(scalar)], 1e-12 * (1 + abs(float(scalar)))))
    for name in ("∂ℳ⁻¹", "∂D^½", "∂b", "V̄̇", "ḃ"):
        op = DERIVATIVES[name](o, 7)
        expected = op @ np.ones(op.shape[1])
        cases.append((op.algorithm("cpp"), expected, 1e-9 * (1 + norm(expected))))
    for formula in dense_expressions().values():
        x = np.ones(formula.op.shape[1])
        cases.append((formula.op.algorithm("cpp"), formula.value @ x, formula.bound * np.sqrt(len(x))))
    assert_cpp(cases, tmp_path)


@pytest.mark.slow
def test_cpp_of_random_expressions(tmp_path):
    cases = []
    for seed in range(24):
        rng = np.random.default_rng(7000 + seed)
        if seed % 2:
            letters = letters_of(random_tree(rng, int(rng.integers(1, 6))))
        else:
            letters = letters_on(str(rng.choice(list(TREES))), bool(rng.integers(2)), seed)
        domain, codomain = (str(s) for s in rng.choice(list("TVF"), 2))
        formula = draw(seeded(rng), letters, domain, codomain, 3)
        x = np.ones(formula.op.shape[1])
        cases.append((formula.op.algorithm("cpp"), formula.value @ x, formula.bound * np.sqrt(max(1, len(x)))))
    assert_cpp(cases, tmp_path)
