// Rates of configurations, and trajectories.
#include <chrono>

#include "bindings/direct_calls.h"
#include "model/configuration.h"
#include "simulation/effects/damping.h"
#include "simulation/effects/gravity.h"
#include "simulation/effects/torque_source.h"
#include "simulation/integrators/integrate.h"
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

template <class S>
py::dict trajectory(const std::shared_ptr<Multibody>& mb, const std::vector<double>& q, const std::vector<double>& v, const std::vector<double>& times,
                    const std::vector<double>& tau, const std::vector<double>& damping, const IntegratorOptions& options, const Solving& how) {
  const int nq = mb->nq(), nv = mb->nv();
  const auto wide = [](const std::vector<double>& x) { return std::vector<S>(x.begin(), x.end()); };
  const std::vector<S> q0 = wide(q), v0 = wide(v);
  const auto count = static_cast<py::ssize_t>(times.size());
  py::array_t<double> all_q({count, py::ssize_t(nq)}), all_v({count, py::ssize_t(nv)});
  double *to_q = all_q.mutable_data(), *to_v = all_v.mutable_data();
  IntegrationCost cost;
  double seconds;
  {
    const ModelInUse use(*mb);
    ReleasedGil release;
    check_integration(times, options, to_double(epsilon<S>()));
    CompiledScene<S> scene(scene_of(mb, tau, damping), how);
    SceneEquations<S> equations(scene, false);
    const auto start = std::chrono::steady_clock::now();
    cost = integrate<S>(equations, equations.initial(S(times.front()), q0.data(), v0.data(), nullptr), times, options, [&](const S&, const std::vector<S>& x) {
      for (int j = 0; j < nq; ++j) *to_q++ = to_double(x[j]);
      for (int j = 0; j < nv; ++j) *to_v++ = to_double(x[nq + j]);
    });
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
                            Precision precision, Form form, const py::object& refine) {
        const Multibody& mb = d.model();
        const Solving how{form, refinement(refine, "same", precision), OnSingular::raise};
        const IntegratorOptions options{integrator_from_name(integrator), rtol, atol, step, normalise};
        const Array q0 = numbers(q, "q"), v0 = numbers(v, "v");
        mb.check_q(q0.data(), q0.size());
        mb.check_v(v0.data(), v0.size(), "v");
        const std::vector<double> from_q(q0.data(), q0.data() + q0.size()), from_v(v0.data(), v0.data() + v0.size());
        const std::vector<double> force = vector_of(mb, tau, "tau"), friction = damping.is_none() ? std::vector<double>() : vector_of(mb, damping, "damping");
        const auto at = [&]<class S>(S) { return trajectory<S>(d.shared_model(), from_q, from_v, times, force, friction, options, how); };
        switch (precision) {
          case Precision::double_: return at(double());
          case Precision::extended: return at(Extended());
          case Precision::quad: return at(Quad());
          default: break;
        }
        throw EvaluationError("trajectories are computed in precision 'double', 'extended' or 'quad', not '" + std::string(precision_name(precision)) + "'");
      }, py::arg("q"), py::arg("v"), py::arg("times"), py::arg("tau"), py::arg("damping"), py::arg("integrator"), py::arg("rtol"), py::arg("atol"),
           py::arg("step"), py::arg("normalise"), py::arg("precision"), py::arg("form"), py::arg("refine"));
  m.def("integrators", [](bool scenes) {
    std::vector<std::string> names;
    if (scenes)
      for (const Integrator i : scene_integrators) names.push_back(integrator_name(i));
    else
      for (const Integrator i : integrators) names.push_back(integrator_name(i));
    return names;
  }, py::arg("scenes") = false, "The integrators of trajectories, or of scenes: those and what takes steps by effects that act implicitly.");
}

}  // namespace pycraft
