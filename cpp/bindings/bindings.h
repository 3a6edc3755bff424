// What the registrations share. They convert and forward; mathematics lives in the core.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "algebra/engine/engine.h"
#include "algebra/language/expression.h"
#include "algebra/language/source.h"
#include "numerics/coefficient.h"
#include "spatial/pose.h"
#include "spatial/symmetric3.h"

namespace pycraft {

namespace py = pybind11;

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

void register_errors(py::module_& m);
void register_spaces(py::module_& m);
void register_sources(py::module_& m);
void register_operators(py::module_& m);
void register_constants(py::module_& m);
void register_pickling(py::module_& m);
void register_scalars(py::module_& m);
void register_plans(py::module_& m);
void register_multibody(py::module_& m);
void register_structure(py::module_& m);
void register_dynamics(py::module_& m);
void register_hybrid_dynamics(py::module_& m);
void register_direct_calls(py::module_& m);
void register_compiled(py::module_& m);
void register_calculus(py::module_& m);
void register_sensitivities(py::module_& m);
void register_frames(py::module_& m);
void register_centroidal(py::module_& m);
void register_methods(py::module_& m);
void register_integration(py::module_& m);
void register_effects(py::module_& m);
void register_scenes(py::module_& m);
void register_runs(py::module_& m);
void register_linearization(py::module_& m);
void register_theorems(py::module_& m);
void register_bench(py::module_& m);

// Classes are declared before anything is defined on them, so that signatures and stubs know every type.
void declare_types(py::module_& m);
template <class Class>
Class declared(py::module_& m, const char* name) {
  return py::reinterpret_borrow<Class>(m.attr(name));
}

// The GIL, let go while the core computes. Once the interpreter ends, other threads start nothing any more (EvaluationError) and what
// they run is stopped: no thread comes back to an interpreter that is gone.
class ReleasedGil {
 public:
  ReleasedGil();
  ~ReleasedGil();
  ReleasedGil(const ReleasedGil&) = delete;

 private:
  unsigned entered_;
  PyThreadState* state_;
};
void register_interrupts(py::module_& m);

// Pickling and copying are refused by name: what holds plans and workspaces is made anew where it is wanted. (Without it the old pickle
// protocols make an object with nothing behind it.)
template <class Class>
Class& unpicklable(Class& c) {
  c.def("__reduce__", [](const py::object& self) -> py::tuple {
    throw py::type_error("a " + std::string(py::str(py::type::of(self).attr("__name__"))) + " cannot be pickled or copied; make it anew where it is wanted");
  });
  return c;
}

// What the Python face does for the core: pycraft/face.py puts it into `_core._face` by name. The core imports nothing of the package.
py::object of_face(const char* name);

// What stands behind a symbol of an expression, as Python reads it.
struct Letter {
  Symbol symbol;
  std::vector<std::string> nodes() const;  // by name: their numbers may differ in another model
};

// ---- conversions
Vector3<double> to_vector3(const py::handle& value, const char* what);
Matrix3<double> to_matrix3(const py::handle& value, const char* what);
Symmetric3<double> to_symmetric3(const py::handle& value, const char* what);
py::array_t<double> to_numpy(const Vector3<double>& v);
py::array_t<double> to_numpy(const Matrix3<double>& A);
py::array_t<double> to_numpy(const std::vector<double>& v);

// A number in front of an operator or a scalar: whole numbers, Fraction and Decimal exactly, a float as the double that it is. What is no
// double comes back as a Fraction.
Coefficient to_coefficient(const py::handle& value);
py::object to_number(const Coefficient& c);

// A run's numbers as an array of this shape, into which the run writes; of objects, mpmath numbers that lose nothing.
class ArrayOfRun {
 public:
  explicit ArrayOfRun(std::vector<py::ssize_t> shape, bool of_objects = false);
  Result result;
  py::object array() const;  // after the run

 private:
  std::vector<py::ssize_t> shape_;
  py::object array_;
};
bool wants_objects(const py::object& dtype);
int thread_count(const py::object& threads);                    // threads=: from 1 to 1024, else EvaluationError

// An array of real numbers. Complex numbers, text, dates and masked entries are refused: NumPy would cast them in silence.
Array real_array(const py::object& x);                           // TypeError unless real numbers
Array numbers(const py::handle& value, const char* what);       // ModelError unless real numbers
double one_number(const py::handle& value, const char* what);       // one of them
int clipped(const py::handle& whole);                           // a Python integer, the nearest that an int holds; no overflow
std::vector<double> list_of_numbers(const py::handle& value, const char* what);  // one, or a list of them
py::object part_of_state(const py::handle& given, const char* what);  // of a State its q or v, by the first letter of what; else what is given
std::vector<double> one_state(const py::handle& given, const char* what);  // q or v of one state
std::string shape_text(const py::array& a);                     // how errors call what was given: "4", "an array (1, 3)"

// What a letter is of, as Python has it, and back but for nodes.
py::tuple arguments_as_data(const Symbol& symbol);
SymbolArguments arguments_from_data(const py::tuple& data);
// A letter by its ASCII name and the data of its arguments.
Expression symbol_again(const std::shared_ptr<SkoSource>& source, const std::string& name, const py::tuple& arguments, const std::string& text);
// The symbol of this name of a source; node operators take node names, Delta a coordinate.
Expression source_symbol(const std::shared_ptr<SkoSource>& source, const std::string& name, const std::vector<std::string>& nodes, int coordinate);
// A state, or a batch, for all models that occur unbound in the operands; q None takes the model's present state.
std::shared_ptr<const Binding> make_binding(const std::vector<Expression>& operands, const py::object& q, const py::object& v,
                                            const Arithmetic& arithmetic, const py::object& threads);
// refine: a number of corrections or "auto"; residual: "same" | "gather" | "wider".
Refinement refinement(const py::object& refine, const std::string& residual, Precision precision);
// What a space and an expression are pickled as.
py::tuple space_parts(const Space& space);
Space space_from_parts(const py::tuple& parts);
// One node: (kind, payload, its parts as operators, the binding of a leaf that is no symbol).
py::tuple parts(const Expression& e);
// What an expression is pickled as: its nodes from below, parts by number, what is shared once.
py::list all_parts(const Expression& e);

}  // namespace pycraft

// Coefficients are numbers; precisions and forms are given by name; 50 and 100 are numbers of digits.
namespace pybind11::detail {
template <>
struct type_caster<pycraft::Coefficient> {
  PYBIND11_TYPE_CASTER(pycraft::Coefficient, const_name("float | fractions.Fraction"));
  bool load(handle source, bool) {
    value = pycraft::to_coefficient(source);
    return true;
  }
  static handle cast(const pycraft::Coefficient& c, return_value_policy, handle) { return pycraft::to_number(c).release(); }
};
template <>
struct type_caster<pycraft::Precision> {
  PYBIND11_TYPE_CASTER(pycraft::Precision, const_name("str | int"));
  bool load(handle source, bool) {
    value = pycraft::precision_from_name(pybind11::str(source));
    return true;
  }
  static handle cast(pycraft::Precision precision, return_value_policy, handle) {
    const char* name = pycraft::precision_name(precision);
    return precision >= pycraft::Precision::digits50 ? pybind11::int_(std::stoi(name)).release() : pybind11::str(name).release();
  }
};
template <>
struct type_caster<pycraft::Form> {
  PYBIND11_TYPE_CASTER(pycraft::Form, const_name("str"));
  bool load(handle source, bool) {
    value = pycraft::form_from_name(pybind11::str(source));
    return true;
  }
  static handle cast(pycraft::Form form, return_value_policy, handle) { return pybind11::str(pycraft::form_name(form)).release(); }
};
}  // namespace pybind11::detail
