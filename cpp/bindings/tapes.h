// A tape (lanes/tape.h) as arrays for Python, where source is written of it (pycraft/compiled).
#pragma once

#include "bindings/bindings.h"
#include "lanes/tape.h"

namespace pycraft {

// The code of every operation; its three operands, for an input the entry and the index of its array; its number; the operation of every result;
// guards, each a condition and whether it holds; the operations that must be finite.
inline py::tuple plain_tape(const kernels::Tape& tape) {
  const auto n = static_cast<py::ssize_t>(tape.operations.size());
  py::array_t<int> taken({n, py::ssize_t(3)});
  py::array_t<double> number(n);
  py::list what, guards, results, finite;
  const std::vector<py::str> names(std::begin(kernels::names_of_operations), std::end(kernels::names_of_operations));
  for (py::ssize_t i = 0; i < n; ++i) {
    const kernels::Operation& o = tape.operations[i];
    what.append(names[static_cast<size_t>(o.does)]);
    taken.mutable_at(i, 0) = o.first, taken.mutable_at(i, 1) = o.second, taken.mutable_at(i, 2) = o.third, number.mutable_at(i) = o.number;
  }
  for (const kernels::TapedResult& r : tape.results) results.append(r.from);
  for (const kernels::Guard& g : tape.guards) guards.append(py::make_tuple(g.truth, g.holds));
  for (const int i : tape.finite) finite.append(i);
  return py::make_tuple(what, taken, number, results, guards, finite);
}

}  // namespace pycraft
