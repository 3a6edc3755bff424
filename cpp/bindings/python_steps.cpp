#include "bindings/python_steps.h"

#include <algorithm>
#include <cmath>

#include "bindings/users_function.h"
#include "model/checks.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace {

py::array_t<double> array_of(const double* x, size_t n) {
  py::array_t<double> a(static_cast<py::ssize_t>(n));
  std::copy_n(x, n, a.mutable_data());
  return a;
}

class PythonSteps : public Stepper<double> {
 public:
  PythonSteps(Equations<double>& equations, const py::object& solver, const IntegratorOptions& options)
      : equations_(std::make_shared<Equations<double>*>(&equations)), options_(options) {
    const auto own = equations_;  // null once the run is over
    const py::gil_scoped_acquire gil;
    solver_ = held_object(solver);
    rates_ = held_object(py::cpp_function([own](double t, const Array& x) {
      if (!*own) throw EvaluationError("the run of these rates is over");
      State at(x.data(), x.data() + x.size()), rate(at.size());
      retelling([&] { (**own)(at, rate, t); }, [&](const Error& e) { return while_integrating(e, t); });
      return array_of(rate.data(), rate.size());
    }));
  }
  ~PythonSteps() override { *equations_ = nullptr; }

  void start(const double&, const State&, const double&, const Pace<double>* resumed) override { pace_.size = resumed ? resumed->size : options_.step; }
  void begin(const double& t, const State& x, const double& end) override {
    const py::gil_scoped_acquire gil;
    solver_->attr("begin")(*rates_, t, array_of(x.data(), x.size()), end, pace_.size != 0 ? py::object(py::float_(std::abs(pace_.size))) : py::none());
    end_ = end;
  }
  void advance(double& t, State& x) override {
    check_interrupt();
    const py::gil_scoped_acquire gil;
    const py::tuple found = solver_->attr("step")();
    const double before = t, to = py::cast<double>(found[0]);
    take(found[1], x);
    t = std::abs(to - end_) <= 4 * epsilon<double>() * std::max(std::abs(to), std::abs(end_)) ? end_ : to;
    pace_.size = t - before;
  }
  void within(const double&, const State& x, const double& t, State& out) override {
    out.resize(x.size());
    interpolate(t, out);
  }
  bool interpolate(const double& t, State& out) override {
    out.resize((*equations_)->size());
    const py::gil_scoped_acquire gil;
    take(solver_->attr("at")(t), out);
    return true;
  }

 private:
  static void take(const py::object& given, State& x) {
    const Array a = numbers(given, "x");
    if (a.size() != static_cast<py::ssize_t>(x.size())) throw EvaluationError("a solver gave " + std::to_string(a.size()) + " numbers of " + std::to_string(x.size()));
    std::copy_n(a.data(), x.size(), x.begin());
  }
  std::shared_ptr<Equations<double>*> equations_;
  std::shared_ptr<py::object> solver_, rates_;
  IntegratorOptions options_;
  double end_ = 0;
};

class PythonEquations : public ExplicitEquations<double> {
 public:
  PythonEquations(const CompiledModel<double>& model, const py::object& call, std::vector<std::string> coordinates)
      : ExplicitEquations<double>(model, 0), call_(held_object(call)), coordinates_(std::move(coordinates)) {}
  void evaluate(const double& t, const double* q, const double* v, const double*, double* vdot, double*) override {
    if ((++evaluations & 63) == 0) check_interrupt();
    at_q_ = q, at_v_ = v;
    const py::gil_scoped_acquire gil;
    const py::object given = of_user("the right-hand side at t = " + short_number(t) + " s", [&] { return (*call_)(t, array_of(q, nq()), array_of(v, nv())); });
    const Array found = numbers(given, "the right-hand side");
    if (found.size() != nv()) throw EvaluationError("the right-hand side gives " + std::to_string(found.size()) + " numbers at t = " + short_number(t) + " s; it gives the accelerations, " + std::to_string(nv()));
    std::copy_n(found.data(), nv(), vdot);
  }
  std::string name_of(int i) const override { return (i < nq() ? "coordinate " + std::to_string(i) : "the velocity of '" + coordinates_[i - nq()] + "'"); }

 private:
  std::shared_ptr<py::object> call_;
  std::vector<std::string> coordinates_;
};

}  // namespace

std::unique_ptr<Stepper<double>> python_steps(Equations<double>& equations, const py::object& solver, const IntegratorOptions& options) {
  return std::make_unique<PythonSteps>(equations, solver, options);
}

std::unique_ptr<ExplicitEquations<double>> python_equations(const CompiledModel<double>& model, const py::object& call, std::vector<std::string> coordinates) {
  const py::gil_scoped_acquire gil;
  return std::make_unique<PythonEquations>(model, call, std::move(coordinates));
}

PythonEvents::PythonEvents(const py::list& given, int nq, int nv, int own) : nq(nq), nv(nv), own(own) {
  for (const auto& one : given) {
    const py::tuple event = py::reinterpret_borrow<py::tuple>(one);
    kinds.push_back({py::cast<std::string>(event[0]), py::cast<int>(event[2]), py::cast<bool>(event[3]), false});
    calls.push_back(held_object(event[1]));
  }
}

double PythonEvents::value(int event, double t, const std::vector<double>& x) const {
  const py::gil_scoped_acquire gil;
  const std::string name = "event '" + kinds[event].name + "'", when = " at t = " + short_number(t) + " s";
  const py::object found = of_user(name + when, [&] { return (*calls[event])(t, array_of(x.data(), nq), array_of(x.data() + nq, nv), array_of(x.data() + nq + nv, own)); });
  Array number;
  try {
    number = real_array(found);
  } catch (const std::exception&) {
    PyErr_Clear();
    throw EvaluationError(name + " gives " + std::string(py::str(py::type::of(found).attr("__name__"))) + when + "; it is one number, whose zeros are looked for");
  }
  if (number.ndim() > 0)
    throw EvaluationError(name + " gives an array of shape " + std::string(py::str(py::array(number).attr("shape"))) + when + "; it is one number, whose zeros are looked for");
  if (!std::isfinite(*number.data())) throw EvaluationError(name + " is " + short_number(*number.data()) + when);
  return *number.data();
}

}  // namespace pycraft
