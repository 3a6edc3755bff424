// Arrays as CPython hands them over, past pybind11's wrappers: what direct and compiled calls take without a Python function between.
#pragma once

#include <limits>
#include <optional>

#include "bindings/bindings.h"
#include "dynamics/batches.h"

namespace pycraft {

inline PyObject* float64() {
  static PyObject* const descr = py::dtype::of<double>().release().ptr();  // NumPy's own; one for all arrays of native doubles
  return descr;
}

struct Plain {
  double* data;
  int axes;  // one at least
  const py::ssize_t* lengths;
  bool writeable;
};

// An ndarray itself, aligned, C-ordered, float64 in the machine's byte order; else nothing.
inline std::optional<Plain> plain(PyObject* given) {
  using Api = py::detail::npy_api;
  if (Py_TYPE(given) != Api::get().PyArray_Type_) return std::nullopt;
  const py::detail::PyArray_Proxy* a = py::detail::array_proxy(given);
  constexpr int wanted = Api::NPY_ARRAY_ALIGNED_ | Api::NPY_ARRAY_C_CONTIGUOUS_;
  if (a->descr != float64() || (a->flags & wanted) != wanted || a->nd < 1) return std::nullopt;
  return Plain{reinterpret_cast<double*>(a->data), a->nd, a->dimensions, (a->flags & Api::NPY_ARRAY_WRITEABLE_) != 0};
}

// An argument of `width` numbers a state. Nothing also where an int, as the core counts by, does not hold the states.
inline std::optional<Given> plain_argument(PyObject* object, const char* name, int width) {
  const auto a = plain(object);
  if (!a || a->axes > 2 || a->lengths[a->axes - 1] != width) return std::nullopt;
  const py::ssize_t states = a->axes == 2 ? a->lengths[0] : -1;
  if (states > std::numeric_limits<int>::max()) return std::nullopt;
  return Given{name, a->data, width, static_cast<int>(states)};
}

inline PyObject* new_array(int ndim, py::ssize_t* shape) {
  auto& numpy = py::detail::npy_api::get();
  Py_INCREF(float64());
  return numpy.PyArray_NewFromDescr_(numpy.PyArray_Type_, float64(), ndim, shape, nullptr, nullptr, 0, nullptr);
}

inline bool overlap(const double* a, size_t n, const double* b, size_t m) { return a < b + m && b < a + n; }

}  // namespace pycraft
