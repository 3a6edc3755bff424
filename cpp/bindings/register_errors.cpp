// Errors: one common base, pycraft.Error, and the fitting built-in beside it.
#include "runtime/errors.h"

#include "bindings/bindings.h"

namespace pycraft {

namespace {

// A Python exception class with two bases.
py::object make(py::module_& m, const char* name, const py::object& base, PyObject* builtin, const char* doc) {
  const py::object type = py::reinterpret_steal<py::object>(
      PyErr_NewExceptionWithDoc((std::string("pycraft.") + name).c_str(), doc, py::make_tuple(base, py::handle(builtin)).ptr(), nullptr));
  if (!type) throw py::error_already_set();
  m.attr(name) = type;
  return type;
}

}  // namespace

void register_errors(py::module_& m) {
  static py::object error, space, model, evaluation, hinge, refinement, singular, stale;
  error = py::reinterpret_steal<py::object>(PyErr_NewExceptionWithDoc("pycraft.Error", "Base of every error that pycraft raises.", PyExc_Exception, nullptr));
  m.attr("Error") = error;
  space = make(m, "SpaceError", error, PyExc_TypeError, "Operators whose spaces do not meet.");
  model = make(m, "ModelError", error, PyExc_ValueError, "A model, a size or a number that makes no sense.");
  evaluation = make(m, "EvaluationError", error, PyExc_ValueError, "A value that cannot be computed as asked.");
  hinge = make(m, "SingularHingeError", error, PyExc_ArithmeticError, "D(k) is singular at the rounding bound of the form in use.");
  refinement = make(m, "RefinementError", error, PyExc_ArithmeticError, "Iterative refinement that does not contract.");
  singular = make(m, "SingularOperatorError", error, PyExc_ArithmeticError, "An inverse that does not exist numerically.");
  stale = make(m, "StaleOperatorError", error, PyExc_RuntimeError, "An operator made before its model's structure changed.");
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const SpaceError& e) {
      PyErr_SetString(space.ptr(), e.what());
    } catch (const ModelError& e) {
      PyErr_SetString(model.ptr(), e.what());
    } catch (const EvaluationError& e) {
      PyErr_SetString(evaluation.ptr(), e.what());
    } catch (const SingularHingeError& e) {
      PyErr_SetString(hinge.ptr(), e.what());
    } catch (const RefinementError& e) {
      PyErr_SetString(refinement.ptr(), e.what());
    } catch (const SingularOperatorError& e) {
      PyErr_SetString(singular.ptr(), e.what());
    } catch (const StaleOperatorError& e) {
      PyErr_SetString(stale.ptr(), e.what());
    } catch (const Error& e) {
      PyErr_SetString(error.ptr(), e.what());
    }
  });
}

}  // namespace pycraft
