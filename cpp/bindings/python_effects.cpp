#include "bindings/python_effects.h"

#include <algorithm>

#include "bindings/users_function.h"
#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

py::array_t<double> copied(const double* x, int n) {
  py::array_t<double> a(n);
  std::copy_n(x, n, a.mutable_data());
  return a;
}

// What came back, as so many numbers; `what` for errors.
void take(const py::object& given, int n, double* out, const std::string& what) {
  const Array a = numbers(given, what.c_str());
  if (a.size() != n || a.ndim() > 1) throw ModelError(what + " gives " + shape_text(a) + (a.ndim() != 1 ? "" : a.size() == 1 ? " number" : " numbers") + " where " + std::to_string(n) + (n == 1 ? " is" : " are") + " expected");
  std::copy_n(a.data(), n, out);
}

template <class S>
class BoundPythonEffect : public BoundEffect<S> {
 public:
  explicit BoundPythonEffect(const PythonEffect& of)
      : calls_(of.calls()), kind_(of.kind()), q_(calls_.nq), v_(calls_.nv), own_(calls_.states), given_(std::max({calls_.nv, calls_.states, static_cast<int>(calls_.coordinates.size())})) {}

  void forces(const At<S>& at, const Forces<S>& out) override {
    const size_t n = calls_.coordinates.size();
    if (calls_.sample) {  // what it holds
      for (size_t i = 0; i < n; ++i) out.generalized[calls_.coordinates[i]] += at.own[calls_.states + i];
      return;
    }
    ask(at, calls_.forces, true, calls_.nv, "forces");
    for (int j = 0; j < calls_.nv; ++j) out.generalized[j] += S(given_[j]);
  }
  void rates(const At<S>& at, S* out) override {
    ask(at, calls_.rates, true, calls_.states, "rates");
    for (int i = 0; i < calls_.states; ++i) out[i] = S(given_[i]);
  }
  void sample(const At<S>& at, S* held) override {
    const int n = static_cast<int>(calls_.coordinates.size());
    ask(at, calls_.sample, false, n, "samples");
    for (int i = 0; i < n; ++i) held[i] = S(given_[i]);
  }

 private:
  void ask(const At<S>& at, const std::shared_ptr<py::object>& call, bool own, int n, const char* what) {
    if constexpr (requires(S x) { x.d; }) throw EvaluationError("effect '" + kind_ + "' is written in Python: its forces have no exact derivatives");
    for (int i = 0; i < calls_.nq; ++i) q_[i] = to_double(at.q[i]);
    for (int i = 0; i < calls_.nv; ++i) v_[i] = to_double(at.v[i]);
    for (int i = 0; i < calls_.states; ++i) own_[i] = to_double(at.own[i]);
    const py::gil_scoped_acquire gil;
    const auto q = copied(q_.data(), calls_.nq), v = copied(v_.data(), calls_.nv);
    const py::object result = of_user("the " + std::string(what) + " function of effect '" + kind_ + "' at t = " + short_number(to_double(at.t)) + " s", [&] {
      return own ? (*call)(to_double(at.t), q, v, copied(own_.data(), calls_.states)) : (*call)(to_double(at.t), q, v);
    });
    take(result, n, given_.data(), "effect '" + kind_ + "': its " + what + " function");
  }
  PythonEffect::Calls calls_;
  std::string kind_;
  std::vector<double> q_, v_, own_, given_;
};

}  // namespace

std::shared_ptr<py::object> held_object(const py::object& object) {
  if (object.is_none()) return nullptr;
  return {new py::object(object), [](py::object* o) {
            if (!Py_IsInitialized()) return;  // gone with the interpreter
            const py::gil_scoped_acquire gil;
            delete o;
          }};
}

void PythonFunctionOfTime::at(double t, double* value, double* rate, double* second) const {
  const py::gil_scoped_acquire gil;
  const bool derivatives = rate || second;
  const py::object result = of_user(what_ + " at t = " + short_number(t) + " s", [&] { return (*call_)(t, derivatives); });
  if (!derivatives) return take(result, size_, value, what_);
  const py::tuple all(result);
  double* const to[] = {value, rate, second};
  for (size_t i = 0; i < 3; ++i)
    if (to[i]) take(all[i], size_, to[i], what_);
}

PythonEffect::PythonEffect(std::string kind, int nq, int nv, std::vector<int> coordinates, const py::object& forces, const py::object& rates, std::vector<double> states, const py::object& sample,
                           double period)
    : kind_(std::move(kind)), calls_{nq, nv, static_cast<int>(states.size()), std::move(coordinates), held_object(forces), held_object(rates), held_object(sample)}, states_(std::move(states)),
      period_(period) {}

Declaration PythonEffect::declaration() const {
  Declaration d;
  d.time = d.velocities = d.work = d.foreign = true;
  d.differentiable = false;
  d.coordinates = calls_.coordinates;
  d.states = states_;
  if (calls_.sample) d.held.assign(calls_.coordinates.size(), 0.0), d.period = period_;
  return d;
}

PYCRAFT_BIND_EFFECT(PythonEffect, BoundPythonEffect)

}  // namespace pycraft
