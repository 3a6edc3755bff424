// Effects and functions of time that are written in Python: the core calls them with the GIL, and nothing else of a run does.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bindings/bindings.h"
#include "simulation/effect.h"
#include "simulation/function_of_time.h"

namespace pycraft {

// An object of Python's that any thread may let go of.
std::shared_ptr<py::object> held_object(const py::object& object);

// `what` it is, call(t, derivatives): values, or a tuple of values, rates and second derivatives, so many numbers each.
class PythonFunctionOfTime : public InDoubles {
 public:
  PythonFunctionOfTime(const py::object& call, int size, std::string what) : call_(held_object(call)), size_(size), what_(std::move(what)) {}
  using InDoubles::at;
  int size() const override { return size_; }
  bool foreign() const override { return true; }
  void at(double t, double* value, double* rate, double* second) const override;

 private:
  std::shared_ptr<py::object> call_;
  int size_;
  std::string what_;  // for errors
};

// forces(t, q, v, own): nv numbers; rates(t, q, v, own): as many as it has states; sample(t, q, v): as many as it holds, which are its forces on
// `coordinates` until the next sample.
class PythonEffect : public Effect {
 public:
  PythonEffect(std::string kind, int nq, int nv, std::vector<int> coordinates, const py::object& forces, const py::object& rates, std::vector<double> states, const py::object& sample, double period);
  std::string kind() const override { return kind_; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  struct Calls {
    int nq, nv, states;
    std::vector<int> coordinates;
    std::shared_ptr<py::object> forces, rates, sample;  // null: none
  };
  const Calls& calls() const { return calls_; }

 private:
  std::string kind_;
  Calls calls_;
  std::vector<double> states_;
  double period_;
};

}  // namespace pycraft
