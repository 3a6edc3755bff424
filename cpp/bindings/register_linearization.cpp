// A scene linearized at a state, and at rest, for Python.
#include <cmath>
#include <vector>

#include "bindings/bindings.h"
#include "model/checks.h"
#include "simulation/scene_calls.h"
#include "simulation/scene_linearized.h"
#include "simulation/scene_statics.h"

namespace pycraft {

namespace {

py::array_t<double> matrix(const Eigen::MatrixXd& A) {
  py::array_t<double> out(std::vector<py::ssize_t>{A.rows(), A.cols()});
  for (Eigen::Index i = 0; i < A.rows(); ++i)
    for (Eigen::Index j = 0; j < A.cols(); ++j) out.mutable_at(i, j) = A(i, j);
  return out;
}

void check(const SceneCalls& calls, const Array& q, double t) {
  if (calls.precision() != Precision::double_)
    throw EvaluationError("a scene is linearized in double precision, and this one computes in '" + std::string(precision_name(calls.precision())) + "': take precision='double'");
  if (!std::isfinite(t)) throw EvaluationError("t is " + short_number(t) + "; a time is a finite number of seconds");
  calls.scene().model().check_q(q.data(), q.size());
}

// The effects' own states where they are given; null: as they are at first.
const double* own_states(const std::vector<double>& states, int own) {
  if (!states.empty() && static_cast<int>(states.size()) != own)
    throw ModelError("the effects have " + std::to_string(own) + " states of their own, not " + std::to_string(states.size()));
  return states.empty() ? nullptr : states.data();
}

py::dict at_rest(SceneCalls& calls, const Array& q, double t, const std::vector<double>& states) {
  check(calls, q, t);
  Statics found;
  {
    const ModelInUse use(calls.scene().model());
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      if constexpr (std::is_same_v<S, double>) found = statics(scene, t, q.data(), own_states(states, scene.effects().own()));
    });
  }
  py::dict out;
  out["q"] = to_numpy(found.q), out["residual"] = to_numpy(found.residual), out["size"] = found.size;
  const auto nv = static_cast<Eigen::Index>(found.residual.size());
  out["along_q"] = matrix(found.at.along_u.topRows(nv)), out["mass"] = matrix(found.at.mass.topLeftCorner(nv, nv));
  out["known"] = std::vector<bool>(found.at.known.begin(), found.at.known.end());
  return out;
}

py::dict linearized(SceneCalls& calls, const Array& q, const Array& v, double t, const std::vector<double>& states) {
  check(calls, q, t);
  const Multibody& model = calls.scene().model();
  model.check_v(v.data(), v.size(), "v");
  Linearization at;
  std::vector<double> rates, x, forces(model.nv(), 0.0);
  {
    const ModelInUse use(model);
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      if constexpr (std::is_same_v<S, double>) {
        for (const auto& e : scene.effects().effects())
          if (e->declared.impulse_period > 0) throw EvaluationError("effect '" + e->name + "' acts by impulses between steps, which no linear model has: disable it, or take Damping in its place");
        SceneLinearized equations(scene, false);
        x = equations.initial(t, q.data(), v.data(), own_states(states, equations.own()));
        const double *at_q = x.data(), *at_v = at_q + model.nq(), *rest = at_v + model.nv();
        rates.resize(model.nv() + equations.own());
        equations.evaluate(t, at_q, at_v, rest, rates.data(), rates.data() + model.nv());
        for (const auto& e : scene.effects().effects())
          if (e->declared.loops) scene.loops()->add_forces(e->number, forces.data());
        equations.linearize(t, 1.0, at_q, at_v, rest, rates.data(), rates.data() + model.nv(), at);
      }
    });
  }
  py::dict out;
  out["mass"] = matrix(at.mass), out["along_q"] = matrix(at.along_u), out["along_rest"] = matrix(at.along_z);
  out["q"] = to_numpy(std::vector<double>(x.begin(), x.begin() + model.nq())), out["v"] = to_numpy(std::vector<double>(x.begin() + model.nq(), x.begin() + model.nq() + model.nv()));
  out["forces"] = to_numpy(forces);
  out["rates"] = py::array_t<double>(static_cast<py::ssize_t>(rates.size()), rates.data());
  out["known"] = std::vector<bool>(at.known.begin(), at.known.end());
  return out;
}

}  // namespace

void register_linearization(py::module_& m) {
  m.def("scene_linearized", &linearized, py::arg("calls"), py::arg("q"), py::arg("v"), py::arg("t"), py::arg("states"),
        "At a state, of A ż = g with z = (v, effects' own states): A, the derivatives of g along displacements and along z, ż, which coordinates are prescribed, and what "
        "is not in g, the forces of loops; q and v are on these.");
  m.def("scene_at_rest", &at_rest, py::arg("calls"), py::arg("q"), py::arg("t"), py::arg("states"),
        "At a configuration at rest: what is left of all forces, its derivative along displacements, ℳ + J, and which coordinates are prescribed.");
}

}  // namespace pycraft
