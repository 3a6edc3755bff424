// The Python module: a table of contents.
#include "bindings/bindings.h"

namespace {

void check_signals() {
  pybind11::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  m.doc() = "The compiled core of pycraft: operators, planner, engine and model. Use it through the package pycraft.";
  pycraft::set_interrupt_check(&check_signals);
  pycraft::register_errors(m);
  pycraft::register_spaces(m);
  pycraft::register_multibody(m);
  pycraft::register_sources(m);
  pycraft::register_operators(m);
  pycraft::register_constants(m);
  pycraft::register_pickling(m);
  pycraft::register_scalars(m);
  pycraft::register_plans(m);
  pycraft::register_dynamics(m);
  pycraft::register_theorems(m);
  pycraft::register_bench(m);
}
