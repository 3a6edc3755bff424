// Rates of configurations, and trajectories.
#include <chrono>

#include "bindings/direct_calls.h"
#include "bindings/python_steps.h"
#include "bindings/run_record.h"
#include "model/configuration.h"
#include "simulation/effects/damping.h"
#include "simulation/effects/gravity.h"
#include "simulation/effects/torque_source.h"
#include "simulation/integrators/integrate.h"
#include "simulation/integrators/pairing.h"
#include "simulation/integrators/runge_kutta_steps.h"
#include "simulation/scene_equations.h"

namespace pycraft {

// q̇ = N(q) v.
template <class S>
class ConfigurationRates {
 public:
  explicit ConfigurationRates(const Multibody& model) : model_(model.compiled<S>()) {}
  void rate(const S* q, const S* v, S* out) const { configuration_rate(*model_, q, v, out); }

 private:
  std::shared_ptr<const CompiledModel<S>> model_;
};

namespace {

using Integration = Batches<ConfigurationRates>;

// One state's numbers, or zeros for None.
std::vector<double> vector_of(const Multibody& mb, const py::object& given, const char* what) {
  if (given.is_none()) return std::vector<double>(mb.nv(), 0.0);
  const Array a = numbers(given, what);
  mb.check_v(a.data(), a.size(), what);
  return {a.data(), a.data() + a.size()};
}

// The model's gravity, constant forces and viscous damping: a trajectory is a run of this scene.
Scene scene_of(const std::shared_ptr<Multibody>& mb, const std::vector<double>& tau, const std::vector<double>& damping) {
  Scene scene(mb);
  scene.add("", std::make_shared<Gravity>(mb->gravity()));
  if (mb->nv() > 0) scene.add("", std::make_shared<TorqueSource>(*mb, std::nullopt, constant_in_time(tau)));
  if (!damping.empty()) scene.add("", std::make_shared<Damping>(*mb, std::nullopt, damping));
  return scene;
}

// Of equations in a wider scalar, for solvers that keep states in doubles.
template <class S>
class Narrowed : public ExplicitEquations<double> {
 public:
  Narrowed(Equations<S>& wide, const CompiledModel<double>& model) : ExplicitEquations<double>(model, 0), wide_(wide), q_(nq()), v_(nv()), vdot_(nv()) {}
  void evaluate(const double& t, const double* q, const double* v, const double*, double* vdot, double*) override {
    ++evaluations;
    at_q_ = q, at_v_ = v;
    std::copy_n(q, nq(), q_.begin()), std::copy_n(v, nv(), v_.begin());
    wide_.evaluate(S(t), q_.data(), v_.data(), nullptr, vdot_.data(), nullptr);
    for (int j = 0; j < nv(); ++j) vdot[j] = to_double(vdot_[j]);
  }
  std::string name_of(int i) const override { return wide_.name_of(i); }

 private:
  Equations<S>& wide_;
  std::vector<S> q_, v_, vdot_;
};

// States at the times asked for, written where they go.
template <class S>
struct Samples : Watcher<S> {
  Samples(double* q, double* v, int nq, int nv) : to_q(q), to_v(v), nq(nq), nv(nv) {}
  void sample(const S&, const std::vector<S>& x) override {
    for (int j = 0; j < nq; ++j) *to_q++ = to_double(x[j]);
    for (int j = 0; j < nv; ++j) *to_v++ = to_double(x[nq + j]);
  }
  bool stiff(const S& t, const std::vector<S>& x, const S& step, const S& last) override { return examine && examine(t, x, step, last); }
  double *to_q, *to_v;
  int nq, nv;
  std::function<bool(const S&, const std::vector<S>&, const S&, const S&)> examine;  // whether the motion is stiff, told of where it is
};

// What a trajectory is of.
struct Motion {
  std::shared_ptr<Multibody> model;
  std::vector<double> q, v, times, tau, damping;
  IntegratorOptions options;
  Solving how;
  py::object stiff;                     // called once when the motion becomes stiff
  py::object foreign, right_hand_side;  // a solver from outside of the core, accelerations of a user's own; None: no such
};

template <class S>
void run_along(const Motion& m, Equations<S>& equations, Stepper<S>& stepper, bool end_at_times, Watcher<S>& out, RunEnd<S>& end) {
  std::vector<S> x(m.q.begin(), m.q.end());
  x.insert(x.end(), m.v.begin(), m.v.end());
  integrate<S>(equations, stepper, std::move(x), RunPlan<S>{m.times, end_at_times, {}, nullptr}, m.options, out, end);
}

template <class S>
IntegrationCost run_motion(const Motion& m, double* q, double* v) {
  const Multibody& mb = *m.model;
  Samples<double> doubles(q, v, mb.nq(), mb.nv());
  RunEnd<double> end;
  const auto numbers = mb.compiled<double>();
  if (!m.right_hand_side.is_none()) {
    const auto equations = python_equations(*numbers, m.right_hand_side, mb.structure().coordinate_names);
    const auto stepper = m.foreign.is_none() ? runge_kutta_steps<double>(*equations, m.options) : python_steps(*equations, m.foreign, m.options);
    run_along<double>(m, *equations, *stepper, m.foreign.is_none(), doubles, end);
    return end.cost;
  }
  CompiledScene<S> scene(scene_of(m.model, m.tau, m.damping), m.how);
  if (!m.foreign.is_none()) {
    SceneEquations<S> wide(scene, false);
    Narrowed<S> equations(wide, *numbers);
    const auto stepper = python_steps(equations, m.foreign, m.options);
    run_along<double>(m, equations, *stepper, false, doubles, end);
    return end.cost;
  }
  Samples<S> samples(q, v, mb.nq(), mb.nv());
  if (!m.stiff.is_none())
    samples.examine = [&](const S& t, const std::vector<S>& x, const S& step, const S& last) {
      const std::optional<Stiffness> found = stiffness_at(scene, m.options.integrator, t, x, step, last);
      if (!found) return false;
      const py::gil_scoped_acquire gil;
      m.stiff(as_dict(*found));
      return true;
    };
  const Paired<S> pair = paired(scene, false, m.options);
  RunEnd<S> end_of_wide;
  run_along<S>(m, *pair.equations, *pair.stepper, true, samples, end_of_wide);
  return end_of_wide.cost;
}

template <class S>
py::dict trajectory(const Motion& m) {
  const Multibody& mb = *m.model;
  const auto count = static_cast<py::ssize_t>(m.times.size());
  py::array_t<double> all_q({count, py::ssize_t(mb.nq())}), all_v({count, py::ssize_t(mb.nv())});
  double *to_q = all_q.mutable_data(), *to_v = all_v.mutable_data();
  IntegrationCost cost;
  double seconds;
  {
    const ModelInUse use(mb);
    ReleasedGil release;
    check_integration(m.times, m.options, m.foreign.is_none() ? to_double(epsilon<S>()) : 0.0);
    const auto start = std::chrono::steady_clock::now();
    cost = run_motion<S>(m, to_q, to_v);
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  py::dict d;
  d["q"] = all_q, d["v"] = all_v;
  d["evaluations"] = cost.evaluations, d["steps"] = cost.steps, d["rejected"] = cost.rejected, d["seconds"] = seconds;
  return d;
}

}  // namespace

void register_integration(py::module_& m) {
  py::class_<Integration> integration(m, "Integration", "Rates of configurations and trajectories of one model.");
  unpicklable(integration)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("configuration_rate", [](Integration& d, const py::object& q, const py::object& v, Precision precision, const py::object& out) {
        Arguments given(d.model(), {{"q", q}, {"v", v}});
        return run(d, precision, given, out, {d.model().nq()}, [](auto& w, auto in, auto* y) { w.rate(in[0], in[1], y); });
      }, py::arg("q"), py::arg("v"), py::arg("precision"), py::arg("out"))
      .def("trajectory", [](Integration& d, const py::object& q, const py::object& v, const std::vector<double>& times, const py::object& tau,
                            const py::object& damping, const std::string& integrator, double rtol, double atol, double step, bool normalise,
                            Precision precision, Form form, const py::object& refine, const py::object& foreign, const py::object& right_hand_side,
                            const py::object& stiff) {
        const Multibody& mb = d.model();
        const Array q0 = numbers(q, "q"), v0 = numbers(v, "v");
        mb.check_q(q0.data(), q0.size());
        mb.check_v(v0.data(), v0.size(), "v");
        IntegratorOptions options{Integrator::dopri5, rtol, atol, step, normalise};
        if (foreign.is_none()) options.integrator = integrator_from_name(integrator);
        const Motion motion{d.shared_model(), {q0.data(), q0.data() + q0.size()}, {v0.data(), v0.data() + v0.size()}, times, vector_of(mb, tau, "tau"),
                            damping.is_none() ? std::vector<double>() : vector_of(mb, damping, "damping"), options, Solving{form, refinement(refine, "same", precision), OnSingular::raise}, stiff, foreign, right_hand_side};
        switch (precision) {
          case Precision::double_: return trajectory<double>(motion);
          case Precision::extended: return trajectory<Extended>(motion);
          case Precision::quad: return trajectory<Quad>(motion);
          default: break;
        }
        throw EvaluationError("trajectories are computed in precision 'double', 'extended' or 'quad', not '" + std::string(precision_name(precision)) + "'");
      }, py::arg("q"), py::arg("v"), py::arg("times"), py::arg("tau"), py::arg("damping"), py::arg("integrator"), py::arg("rtol"), py::arg("atol"),
           py::arg("step"), py::arg("normalise"), py::arg("precision"), py::arg("form"), py::arg("refine"), py::arg("foreign") = py::none(), py::arg("right_hand_side") = py::none(), py::arg("stiff") = py::none());
  m.def("integrators", [] {
    std::vector<std::string> names;
    for (const IntegratorRecord& r : integrator_records) names.push_back(r.name);
    return names;
  }, "The names of the core's integrators.");
  m.def("retired_integrator", &retired_integrator, py::arg("name"), "What to take in place of an integrator that there was once; empty: there was none of that name.");
}

}  // namespace pycraft
