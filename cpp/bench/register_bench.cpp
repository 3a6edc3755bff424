// What `pycraft bench` times in the core, without Python in the loop: an expression applied, a direct call over a set of states.
#include <string>

#include "algebra/engine/evaluate.h"
#include "bench/timing.h"
#include "bindings/bindings.h"
#include "dynamics/methods.h"
#include "dynamics/packed_dynamics.h"
#include "dynamics/rigid_dynamics.h"
#include "dynamics/sensitivities.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

int states_of(const Array& q) {
  if (q.ndim() != 2 || q.shape(0) == 0) throw EvaluationError("a time takes at least one state: q of shape (states, nq)");
  return static_cast<int>(q.shape(0));
}


py::dict result(const Timing& t) {
  py::dict d;
  d["minimum"] = t.minimum;
  d["median"] = t.median;
  d["calls"] = t.calls;
  return d;
}

py::dict time_apply(const Expression& e, const Array& x, double seconds, bool rules) {
  Inputs inputs;
  inputs.x = x.data();
  inputs.columns = x.ndim() == 2 ? static_cast<int>(x.shape(1)) : 1;
  const auto pool = prepare(e, Request::apply, rules);
  Result r;
  Timing t;
  {
    ReleasedGil release;
    t = time_calls([&] { pool->run(inputs, false, r); }, seconds);
  }
  return result(t);
}

// One forward dynamics per state in rotation, in every way there is.
py::dict time_forward(const std::shared_ptr<Multibody>& model, const Array& q, const Array& v, const Array& u, double seconds, Form form, const py::object& refine,
                      const std::string& residual, Precision precision) {
  const Solving how{form, refinement(refine, residual, precision), OnSingular::raise};
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  const double *Q = q.data(), *V = v.data(), *U = u.data();
  Timing t;
  {
    ReleasedGil release;
    at_precision(precision, [&]<class S>(S) {
      RigidDynamics<S> w(*model);
      std::vector<S> out(nv);
      int k = 0;
      t = time_calls([&] {
        w.forward_dynamics(Q + size_t(k) * nq, V + size_t(k) * nv, U + size_t(k) * nv, out.data(), how);
        k = (k + 1) % K;
      }, seconds);
    });
  }
  return result(t);
}

// The same by another method.
py::dict time_method(const std::shared_ptr<Multibody>& model, const std::string& method, const Array& q, const Array& v, const Array& u, double seconds,
                     Precision precision) {
  const Method by = method_from_name(method);
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  Timing t;
  {
    ReleasedGil release;
    at_precision(precision, [&]<class S>(S) {
      DynamicsMethods<S> w(*model);
      std::vector<S> Q, V, U, out(nv);
      convert(q.data(), size_t(K) * nq, Q), convert(v.data(), size_t(K) * nv, V), convert(u.data(), size_t(K) * nv, U);
      int k = 0;
      t = time_calls([&] {
        w.forward_dynamics(by, Q.data() + size_t(k) * nq, V.data() + size_t(k) * nv, U.data() + size_t(k) * nv, out.data());
        k = (k + 1) % K;
      }, seconds);
    });
  }
  return result(t);
}

// Forward dynamics of a batch in packs, seconds per state; the number of states is a multiple of a pack's width.
py::dict time_packs(const std::shared_ptr<Multibody>& model, const Array& q, const Array& v, const Array& u, double seconds, Form form, Precision precision) {
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  const double *Q = q.data(), *V = v.data(), *U = u.data();
  std::vector<double> out(size_t(K) * nv);
  Timing t;
  const auto run = [&]<class T>(T) {
    constexpr int width = PackedDynamics<T>::width;
    if (K % width) throw EvaluationError("packs take a multiple of " + std::to_string(width) + " states");
    PackedDynamics<T> w(*model);
    t = time_calls([&] {
      for (int b = 0; b < K; b += width)
        if (!w.forward_dynamics(Q + size_t(b) * nq, nq, V + size_t(b) * nv, nv, U + size_t(b) * nv, nv, out.data() + size_t(b) * nv, form))
          throw EvaluationError("a hinge of '" + model->name() + "' is in doubt: not a case for packs");
    }, seconds);
  };
  {
    ReleasedGil release;
    if (precision == Precision::single)
      run(Single());
    else
      run(double());
  }
  t.minimum /= K, t.median /= K;
  return result(t);
}

// One call per state in rotation; q (K, nq), v, u (K, nv).
py::dict time_dynamics(const std::shared_ptr<Multibody>& model, const std::string& call, const Array& q, const Array& v, const Array& u, double seconds) {
  RigidDynamics<double> w(*model);
  Sensitivities<double> s(*model);
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  const size_t square = size_t(nv) * nv;
  std::vector<double> out(std::max(3 * square, size_t(6) * nv));
  int k = 0;
  const auto next = [&] { k = (k + 1) % K; };
  const double *Q = q.data(), *V = v.data(), *U = u.data();
  ReleasedGil release;
  Timing t;
  const auto run = [&](auto f) {
    t = time_calls([&] { f(Q + size_t(k) * nq, V + size_t(k) * nv, U + size_t(k) * nv), next(); }, seconds);
  };
  if (call == "forward_dynamics") {
    run([&](auto a, auto b, auto c) { w.forward_dynamics(a, b, c, out.data()); });
  } else if (call == "inverse_dynamics") {
    run([&](auto a, auto b, auto c) { w.inverse_dynamics(a, b, c, out.data()); });
  } else if (call == "mass_matrix") {
    run([&](auto a, auto, auto) { w.mass_matrix(a, out.data()); });
  } else if (call == "mass_matrix_inverse") {
    run([&](auto a, auto, auto) { w.mass_matrix_inverse(a, out.data()); });
  } else if (call == "inverse_dynamics_derivatives") {
    run([&](auto a, auto b, auto c) { s.inverse_dynamics(a, b, c, out.data(), out.data() + square); });
  } else if (call == "forward_dynamics_derivatives") {  // the accelerations and their derivatives
    run([&](auto a, auto b, auto c) { s.forward_dynamics(a, b, c, Solving(), out.data(), out.data() + square, out.data() + 2 * square); });
  } else if (call == "log_determinant_gradient") {
    run([&](auto a, auto, auto) { s.log_determinant(a, out.data(), nullptr, nullptr, nullptr); });
  } else {
    throw EvaluationError("no direct call '" + call + "' to time");
  }
  py::gil_scoped_acquire acquire;
  return result(t);
}

}  // namespace

void register_bench(py::module_& m) {
  m.def("time_apply", &time_apply, py::arg("operator"), py::arg("x"), py::arg("seconds") = 0.2, py::arg("rules") = true, "Seconds per application: minimum, median, calls.");
  m.def("time_dynamics", &time_dynamics, py::arg("model"), py::arg("call"), py::arg("q"), py::arg("v"), py::arg("u"), py::arg("seconds") = 0.2,
        "Seconds per direct call over a set of states in rotation: minimum, median, calls.");
  m.def("time_forward", &time_forward, py::arg("model"), py::arg("q"), py::arg("v"), py::arg("u"), py::arg("seconds") = 0.2, py::arg("form") = Form::fast,
        py::arg("refine") = 0, py::arg("residual") = "same", py::arg("precision") = Precision::double_,
        "Seconds per forward dynamics over a set of states in rotation: minimum, median, calls.");
  m.def("time_method", &time_method, py::arg("model"), py::arg("method"), py::arg("q"), py::arg("v"), py::arg("u"), py::arg("seconds") = 0.2,
        py::arg("precision") = Precision::double_, "Seconds per forward dynamics by a method of the mass matrix: minimum, median, calls.");
  m.def("time_packs", &time_packs, py::arg("model"), py::arg("q"), py::arg("v"), py::arg("u"), py::arg("seconds") = 0.2, py::arg("form") = Form::fast,
        py::arg("precision") = Precision::double_, "Seconds per state of a batch in packs: minimum, median, calls.");
}

}  // namespace pycraft
