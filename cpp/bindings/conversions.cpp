#include <algorithm>
#include <cstring>
#include <limits>

#include "bindings/bindings.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

constexpr const char* complex_numbers = "is complex";
constexpr const char* no_numbers = "is not an array of numbers";

// What NumPy would turn into a double in silence: an imaginary part dropped (a complex step would come back as zero), text read as a
// number, dates counted. Null where the entries of an object array are real numbers.
const char* refused_entries(const py::array& any) {
  const char kind = any.dtype().kind();
  if (kind == 'c') return complex_numbers;
  if (std::strchr("biuf", kind)) return nullptr;
  if (kind != 'O') return no_numbers;
  for (const py::handle& item : any.attr("ravel")()) {
    if (item.is_none() || PyUnicode_Check(item.ptr()) || PyBytes_Check(item.ptr())) return no_numbers;  // None would be NaN
    if (PyComplex_Check(item.ptr())) return complex_numbers;
    if (py::hasattr(item, "dtype"))
      if (const py::array entry = py::array::ensure(item); entry && entry.dtype().kind() != 'O')
        if (const char* why = refused_entries(entry)) return why;
  }
  return nullptr;
}

// A value as an array of doubles, or null and the reason why it is none.
Array real_numbers(const py::handle& value, const char*& why) {
  why = nullptr;
  const bool plain = Py_TYPE(value.ptr()) == py::detail::npy_api::get().PyArray_Type_;  // else it may be masked
  if (py::isinstance<Array>(value) && (plain || !py::hasattr(value, "mask"))) return py::reinterpret_borrow<Array>(value);
  if (PyFloat_Check(value.ptr()) || PyLong_Check(value.ptr())) {
    const Array a = Array::ensure(value);
    if (!a) PyErr_Clear(), why = no_numbers;
    return a;
  }
  if (!plain && py::isinstance<py::array>(value) && py::hasattr(value, "mask") && py::cast<bool>(py::bool_(value.attr("mask").attr("any")()))) {
    why = "has masked entries";
    return Array();
  }
  const py::array any = py::array::ensure(value);
  if (!any) {
    PyErr_Clear();
    why = no_numbers;
    return Array();
  }
  if ((why = refused_entries(any))) return Array();
  const Array a = Array::ensure(any);
  if (!a) PyErr_Clear(), why = no_numbers;
  return a;
}

// The items of a tuple or list of so many Python floats, which are numbers without a doubt and need no array on the way; else null.
PyObject* const* plain_floats(const py::handle& value, Py_ssize_t count) {
  if ((!PyTuple_CheckExact(value.ptr()) && !PyList_CheckExact(value.ptr())) || PySequence_Fast_GET_SIZE(value.ptr()) != count) return nullptr;
  PyObject* const* const items = PySequence_Fast_ITEMS(value.ptr());
  return std::all_of(items, items + count, [](PyObject* x) { return PyFloat_CheckExact(x); }) ? items : nullptr;
}

}  // namespace

Array numbers(const py::handle& value, const char* what) {
  const char* why;
  const Array a = real_numbers(value, why);
  if (why) throw ModelError(std::string(what) + " " + why + (why == complex_numbers ? "; models take real numbers" : ""));
  return a;
}

double one_number(const py::handle& value, const char* what) {
  if (PyFloat_CheckExact(value.ptr())) return PyFloat_AS_DOUBLE(value.ptr());
  const Array a = numbers(value, what);
  if (a.ndim() != 0) throw ModelError(std::string(what) + " takes one number, not an array of " + std::to_string(a.size()));
  return *a.data();
}

int clipped(const py::handle& whole) {
  constexpr py::ssize_t most = std::numeric_limits<int>::max();
  const py::ssize_t n = PyNumber_AsSsize_t(whole.ptr(), nullptr);
  if (n == -1 && PyErr_Occurred()) throw py::error_already_set();
  return static_cast<int>(std::clamp<py::ssize_t>(n, -most, most));
}

std::vector<double> list_of_numbers(const py::handle& value, const char* what) {
  if (PyFloat_CheckExact(value.ptr())) return {PyFloat_AS_DOUBLE(value.ptr())};
  const Array a = numbers(value, what);
  if (a.ndim() > 1) throw ModelError(std::string(what) + " takes a number or a list of numbers, not an array of " + std::to_string(a.ndim()) + " dimensions");
  return {a.data(), a.data() + a.size()};
}

std::vector<double> one_state(const py::handle& given, const char* what) {
  const Array a = numbers(part_of_state(given, what), what);
  if (a.ndim() != 1) throw ModelError(std::string(what) + " is a list of numbers, one state, not " + shape_text(a));
  return {a.data(), a.data() + a.size()};
}

py::object part_of_state(const py::handle& given, const char* what) {
  if (!py::isinstance<py::array>(given) && py::hasattr(given, "q") && py::hasattr(given, "v")) return given.attr(what[0] == 'q' ? "q" : "v");
  return py::reinterpret_borrow<py::object>(given);
}

std::string shape_text(const py::array& a) {
  if (a.ndim() == 0) return "one number";
  if (a.ndim() == 1) return std::to_string(a.size());
  std::string text;
  for (py::ssize_t i = 0; i < a.ndim(); ++i) text += (i ? ", " : "an array (") + std::to_string(a.shape(i));
  return text + ")";
}

py::object of_face(const char* name) {
  const py::object face = py::module_::import("pycraft._core").attr("_face");
  if (!face.contains(name)) throw std::logic_error(std::string("nothing is attached to the core as '") + name + "'; import pycraft");
  return face[name];
}

Vector3<double> to_vector3(const py::handle& value, const char* what) {
  if (PyObject* const* const items = plain_floats(value, 3))
    return {PyFloat_AS_DOUBLE(items[0]), PyFloat_AS_DOUBLE(items[1]), PyFloat_AS_DOUBLE(items[2])};
  const Array a = numbers(value, what);
  if (a.ndim() != 1 || a.size() != 3) throw ModelError(std::string(what) + " takes 3 numbers, not " + shape_text(a));
  return {a.data()[0], a.data()[1], a.data()[2]};
}

Matrix3<double> to_matrix3(const py::handle& value, const char* what) {
  const Array a = numbers(value, what);
  if (a.ndim() != 2 || a.shape(0) != 3 || a.shape(1) != 3) throw ModelError(std::string(what) + " takes a 3 x 3 matrix, not " + shape_text(a));
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

namespace {

// A whole number in hexadecimal digits: its decimal ones Python writes up to a limit only.
std::string digits_of(const py::handle& whole) { return py::str(py::module_::import("builtins").attr("hex")(whole)).cast<std::string>(); }

py::object whole_number(const std::string& digits) { return py::module_::import("builtins").attr("int")(digits); }

}  // namespace

Coefficient to_coefficient(const py::handle& value) {
  if (PyFloat_Check(value.ptr())) return PyFloat_AS_DOUBLE(value.ptr());
  if (PyLong_Check(value.ptr()) || (PyIndex_Check(value.ptr()) && !py::isinstance<py::array>(value))) {
    const py::object whole = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
    if (!whole) throw py::error_already_set();
    int overflow = 0;
    const long long small = PyLong_AsLongLongAndOverflow(whole.ptr(), &overflow);
    if (!overflow && std::abs(small) <= (1LL << 53)) return static_cast<double>(small);
    return Coefficient::ratio(digits_of(whole), "1");
  }
  if (py::hasattr(value, "as_integer_ratio")) {
    py::tuple ratio;
    try {
      ratio = value.attr("as_integer_ratio")();
    } catch (py::error_already_set&) {
      throw EvaluationError("a coefficient " + std::string(py::str(value)) + " is no number to reckon with");
    }
    return Coefficient::ratio(digits_of(ratio[0]), digits_of(ratio[1]));
  }
  const char* why;
  const Array a = real_numbers(value, why);
  if (!why && a.ndim() != 0) why = "is not one number";
  if (why) throw py::type_error("a coefficient is one real number; this " + std::string(why) + ": " + std::string(py::repr(value)));
  const py::object one = py::isinstance<py::array>(value) ? value.attr("item")() : py::none();  // a wider one with all its digits
  return one.is_none() || py::isinstance<py::array>(one) ? Coefficient(*a.data()) : to_coefficient(one);
}

py::object to_number(const Coefficient& c) {
  if (c.is_double()) return py::float_(c.nearest());
  const auto [above, below] = c.as_ratio();
  return py::module_::import("fractions").attr("Fraction")(whole_number(above), whole_number(below));
}

ArrayOfRun::ArrayOfRun(std::vector<py::ssize_t> shape, bool of_objects) : shape_(std::move(shape)) {
  if (of_objects) return;
  py::array_t<double> a(shape_);
  result.into = a.mutable_data();
  array_ = std::move(a);
}

py::object ArrayOfRun::array() const {
  py::ssize_t entries = 1;
  for (py::ssize_t n : shape_) entries *= n;
  const py::ssize_t given = py::ssize_t(result.rows) * result.columns * (result.batch >= 0 ? result.batch : 1);
  if (entries != given)  // never memory that nothing was written to
    throw std::logic_error("a run gave " + std::to_string(given) + " numbers where " + std::to_string(entries) + " were asked for");
  if (array_) return array_;
  py::list parts;
  for (const auto& e : result.expansions) parts.append(py::cast(e));
  return of_face("exact_numbers")(parts, py::cast(shape_));
}

Array real_array(const py::object& x) {
  const char* why;
  const Array a = real_numbers(x, why);
  if (why == complex_numbers) throw py::type_error("operators act on real arrays; apply them to the real and imaginary parts");
  if (why) throw py::type_error(std::string("an operator is applied to an array of numbers; this ") + why);
  return a;
}

constexpr int most_steps = 1000;  // what has not converged by then does not

Refinement refinement(const py::object& refine, const std::string& residual, Precision precision) {
  Refinement r;
  r.residual = residual_precision_from_name(residual);
  if (py::isinstance<py::str>(refine) && py::cast<std::string>(refine) == "auto") {
    r.steps = Refinement::automatic;
  } else {
    const bool whole = PyIndex_Check(refine.ptr()) && !py::isinstance<py::bool_>(refine) && !py::isinstance<py::array>(refine);
    r.steps = whole ? clipped(refine) : -1;
    if (r.steps < 0 || r.steps > most_steps)
      throw EvaluationError("refine=" + py::cast<std::string>(py::repr(refine)) + ": a number of corrections, 0, 1, 2, ..., " + std::to_string(most_steps) + ", or 'auto'");
  }
  if (r.residual != ResidualPrecision::same && r.steps != 0 && precision == Precision::digits100)
    throw EvaluationError("residual '" + residual + "': nothing is wider than 100 digits; there is residual 'same'");
  return r;
}

int thread_count(const py::object& threads) {
  if (PyLong_CheckExact(threads.ptr()) && PyLong_AsLong(threads.ptr()) == 1) return 1;
  PyErr_Clear();  // a number beyond what a long holds
  return of_face("thread_count")(threads).cast<int>();
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
