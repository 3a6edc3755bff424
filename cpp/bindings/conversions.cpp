#include <algorithm>
#include <cstring>

#include "algebra/errors.h"
#include "bindings/bindings.h"

namespace pycraft {

namespace {

// Casting complex to real would drop the imaginary part: a complex step would come back as zero.
bool is_complex(const py::handle& x) {
  if (PyFloat_Check(x.ptr()) || PyLong_Check(x.ptr())) return false;
  if (PyComplex_Check(x.ptr())) return true;
  if (py::isinstance<py::array_t<double>>(x)) return false;
  const py::array any = py::array::ensure(x);
  if (!any) PyErr_Clear();
  return any && any.dtype().kind() == 'c';
}

}  // namespace

Array numbers(const py::handle& value, const char* what) {
  if (is_complex(value)) throw ModelError(std::string(what) + " is complex; models take real numbers");
  Array a = Array::ensure(value);
  if (!a) {
    PyErr_Clear();
    throw ModelError(std::string(what) + " is not an array of numbers");
  }
  return a;
}

Vector3<double> to_vector3(const py::handle& value, const char* what) {
  const Array a = numbers(value, what);
  if (a.size() != 3) throw ModelError(std::string(what) + " takes 3 numbers, not " + std::to_string(a.size()));
  return {a.data()[0], a.data()[1], a.data()[2]};
}

Matrix3<double> to_matrix3(const py::handle& value, const char* what) {
  const Array a = numbers(value, what);
  if (a.ndim() != 2 || a.shape(0) != 3 || a.shape(1) != 3) throw ModelError(std::string(what) + " takes a 3 x 3 matrix");
  Matrix3<double> A;
  std::memcpy(A.m, a.data(), sizeof A.m);
  return A;
}

Symmetric3<double> to_symmetric3(const py::handle& value, const char* what) {
  const Matrix3<double> A = to_matrix3(value, what);
  double largest = 0;
  for (double x : A.m) largest = std::max(largest, std::abs(x));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < i; ++j)
      if (std::abs(A(i, j) - A(j, i)) > 1e-9 * largest)
        throw ModelError(std::string(what) + " is not symmetric: entries (" + std::to_string(i) + ", " + std::to_string(j) + ") and (" + std::to_string(j) +
                         ", " + std::to_string(i) + ") differ by " + std::to_string(A(i, j) - A(j, i)));
  return upper(A);
}

py::array_t<double> to_numpy(const Vector3<double>& v) {
  py::array_t<double> a(3);
  std::memcpy(a.mutable_data(), v.v, sizeof v.v);
  return a;
}
py::array_t<double> to_numpy(const Matrix3<double>& A) {
  py::array_t<double> a({3, 3});
  std::memcpy(a.mutable_data(), A.m, sizeof A.m);
  return a;
}
py::array_t<double> to_numpy(const std::vector<double>& v) {
  py::array_t<double> a(static_cast<py::ssize_t>(v.size()));
  if (!v.empty()) std::memcpy(a.mutable_data(), v.data(), v.size() * sizeof(double));
  return a;
}

py::object to_array(const Result& r, std::vector<py::ssize_t> shape) {
  py::ssize_t entries = 1;
  for (py::ssize_t n : shape) entries *= n;
  if (entries != static_cast<py::ssize_t>(r.values.size()))  // never memory that nothing was written to
    throw std::logic_error("a run gave " + std::to_string(r.values.size()) + " numbers where " + std::to_string(entries) + " were asked for");
  if (r.expansions.empty() || r.expansions.size() != r.values.size()) {
    py::array_t<double> a(shape);
    if (entries) std::memcpy(a.mutable_data(), r.values.data(), r.values.size() * sizeof(double));
    return a;
  }
  py::list parts;
  for (const auto& e : r.expansions) parts.append(py::cast(e));
  return py::module_::import("pycraft.operators").attr("exact_numbers")(parts, py::cast(shape));
}

Array real_array(const py::object& x) {
  if (is_complex(x)) throw py::type_error("operators act on real arrays; apply them to the real and imaginary parts");
  Array a = Array::ensure(x);
  if (!a) {
    PyErr_Clear();
    throw py::type_error("an operator is applied to an array of numbers, not to this");
  }
  return a;
}

constexpr int most_steps = 1000;  // what has not converged by then does not

Refinement refinement(const py::object& refine, const std::string& residual, Precision precision) {
  Refinement r;
  r.residual = residual_precision_from_name(residual);
  if (py::isinstance<py::str>(refine) && py::cast<std::string>(refine) == "auto") {
    r.steps = Refinement::automatic;
  } else {
    const bool whole = PyIndex_Check(refine.ptr()) && !py::isinstance<py::bool_>(refine);
    const py::ssize_t steps = whole ? PyNumber_AsSsize_t(refine.ptr(), nullptr) : -1;  // clipped to its range
    r.steps = static_cast<int>(std::clamp<py::ssize_t>(steps, -1, most_steps + 1));
    if (r.steps < 0 || r.steps > most_steps)
      throw EvaluationError("refine=" + py::cast<std::string>(py::repr(refine)) + ": a number of corrections, 0, 1, 2, ..., " + std::to_string(most_steps) + ", or 'auto'");
  }
  if (r.residual != ResidualPrecision::same && r.steps != 0 && precision == Precision::digits100)
    throw EvaluationError("residual '" + residual + "': nothing is wider than 100 digits; there is residual 'same'");
  return r;
}

bool wants_objects(const py::object& dtype) {
  if (dtype.is_none()) return false;
  if (dtype.is(py::handle(reinterpret_cast<PyObject*>(&PyBaseObject_Type)))) return true;
  const py::object np = py::module_::import("numpy");
  const py::object given = np.attr("dtype")(dtype);
  if (given.equal(np.attr("dtype")("object"))) return true;
  if (given.equal(np.attr("dtype")("float64"))) return false;
  throw EvaluationError("results are float64, or dtype=object for numbers that keep a wider precision");
}

}  // namespace pycraft
