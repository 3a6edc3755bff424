#include "bindings/plain_products.h"

#include <limits>
#include <typeinfo>

#include "algebra/engine/evaluate.h"
#include "bindings/plain_arrays.h"
#include "operators/multibody_operators.h"

namespace pycraft {

namespace {

PyTypeObject* operators = nullptr;

// Letting the GIL go costs more than a small run takes. It may stay only where nothing that a run waits for asks for it: another thread that
// computes a robot's numbers looks for signals at every 256th body (runtime/interrupt.h).
constexpr double most_bodies = 64, most_operations = 2e4;
bool keeps_gil(const Plan& plan, int columns) {
  if (plan.precision != Precision::double_ || plan.flops() * columns > most_operations) return false;
  for (const Context& c : plan.contexts) {
    const SkoSource& source = *c.source;
    if (typeid(source) != typeid(MultibodyOperators) || double(source.structure().bodies()) * columns > most_bodies) return false;
  }
  return true;
}

// Null, and no error, where the case is not a plain one.
PyObject* plain_product(const Expression& e, const Plain& x) {
  if (e.floating() || x.axes > 2 || x.lengths[0] != e.domain().dimension()) return nullptr;
  const auto pool = prepare(e, Request::apply);
  const Plan& plan = pool->plan();
  if (plan.batched || !plan.vectors.empty() || (x.axes == 2 && (x.lengths[1] == 0 || x.lengths[1] > std::numeric_limits<int>::max()))) return nullptr;
  Inputs inputs;
  inputs.x = x.data;
  inputs.columns = x.axes == 2 ? static_cast<int>(x.lengths[1]) : 1;
  py::ssize_t shape[2] = {plan.codomain.dimension(), inputs.columns};
  const py::object out = py::reinterpret_steal<py::object>(new_array(x.axes, shape));
  if (!out) throw py::error_already_set();
  Result result;
  result.into = reinterpret_cast<double*>(py::detail::array_proxy(out.ptr())->data);
  bool current;
  if (keeps_gil(plan, inputs.columns)) {
    current = pool->run(inputs, false, result);
  } else {
    const ReleasedGil release;
    current = pool->run(inputs, false, result);
  }
  return current ? out.inc_ref().ptr() : nullptr;
}

PyObject* product(PyObject* a, PyObject* b) {
  if (Py_TYPE(a) == operators)
    if (const auto x = plain(b)) {
      try {
        const auto* const e = static_cast<const Expression*>(reinterpret_cast<py::detail::instance*>(a)->get_value_and_holder().value_ptr());
        if (PyObject* const y = e ? plain_product(*e, *x) : nullptr) return y;
      } catch (py::error_already_set& error) {  // a signal
        error.restore();
        return nullptr;
      } catch (const std::exception&) {  // said again below, in full
      }
    }
  static PyObject *const left = PyUnicode_InternFromString("__matmul__"), *const right = PyUnicode_InternFromString("__rmatmul__");
  return PyObject_TypeCheck(a, operators) ? PyObject_CallMethodOneArg(a, left, b) : PyObject_CallMethodOneArg(b, right, a);
}

}  // namespace

void take_plain_products(const py::object& type) {
  operators = reinterpret_cast<PyTypeObject*>(type.ptr());
  operators->tp_as_number->nb_matrix_multiply = &product;
}

}  // namespace pycraft
