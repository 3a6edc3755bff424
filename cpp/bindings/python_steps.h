// What Python gives to a run: steps by solvers from outside of the core, a right-hand side of one's own, and functions whose zeros are events.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/python_effects.h"
#include "simulation/events.h"
#include "simulation/integrators/stepper.h"

namespace pycraft {

// Steps by an object with begin(rates, t, x, end, first_step), step() -> (t, x) and at(t) -> x within the last step; rates(t, x) -> ẋ. Errors of
// the rates come through with the time added.
std::unique_ptr<Stepper<double>> python_steps(Equations<double>& equations, const py::object& solver, const IntegratorOptions& options);

// v̇ = call(t, q, v).
std::unique_ptr<ExplicitEquations<double>> python_equations(const CompiledModel<double>& model, const py::object& call, std::vector<std::string> coordinates);

// A list of (name, call(t, q, v, own) -> float, direction, terminal).
struct PythonEvents {
  PythonEvents(const py::list& given, int nq, int nv, int own);
  double value(int event, double t, const std::vector<double>& x) const;
  template <class S>
  EventFunctions<S> functions() const {
    const auto value_of = [this](int event, const S& t, const std::vector<S>& x) {
      std::vector<double> numbers;
      for (const S& y : x) numbers.push_back(to_double(y));
      return S(value(event, to_double(t), numbers));
    };
    return {kinds, value_of, nullptr};
  }
  std::vector<EventKind> kinds;
  std::vector<std::shared_ptr<py::object>> calls;
  int nq, nv, own;
};

}  // namespace pycraft
