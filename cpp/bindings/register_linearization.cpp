// A scene linearized at a state, and at rest, for Python.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bindings/bindings.h"
#include "model/checks.h"
#include "simulation/scene_calls.h"
#include "simulation/scene_curvature.h"
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

// between: of a stage between the ends of a step, where controllers take no samples.
py::dict linearized(SceneCalls& calls, const Array& q, const Array& v, double t, const std::vector<double>& states, bool between) {
  check(calls, q, t);
  const Multibody& model = calls.scene().model();
  model.check_v(v.data(), v.size(), "v");
  std::vector<std::string> implicit;
  Linearization at;
  std::vector<double> rates, x, forces(model.nv(), 0.0);
  {
    const ModelInUse use(model);
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      if constexpr (std::is_same_v<S, double>) {
        for (const auto& e : scene.effects().effects())
          if (e->declared.impulse_period > 0) throw EvaluationError("effect '" + e->name + "' acts by impulses between steps, which no linear model has: disable it, or take Damping in its place");
        for (const auto& e : scene.effects().effects())
          if (std::any_of(e->declared.hinges.begin(), e->declared.hinges.end(), [](const HingeTerm& term) { return term.damping != 0 || term.stiffness != 0; })) implicit.push_back(e->name);
        SceneLinearized equations(scene, false);
        const double* const own = own_states(states, equations.own());
        x = between ? equations.initial_between(t, q.data(), v.data(), own) : equations.initial(t, q.data(), v.data(), own);
        const double *at_q = x.data(), *at_v = at_q + model.nq(), *rest = at_v + model.nv();
        refuse_edges(scene, 1, t, at_q, at_v, rest);
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
  out["own"] = to_numpy(std::vector<double>(x.begin() + model.nq() + model.nv(), x.end()));
  out["implicit"] = implicit;
  out["rates"] = py::array_t<double>(static_cast<py::ssize_t>(rates.size()), rates.data());
  out["known"] = std::vector<bool>(at.known.begin(), at.known.end());
  return out;
}

// At a state as `linearized` returned it.
py::tuple curvature(SceneCalls& calls, const Array& q, const Array& v, double t, const std::vector<double>& own, const Array& vdot, const Array& mu) {
  check(calls, q, t);
  const Multibody& model = calls.scene().model();
  const py::ssize_t nv = model.nv(), states = static_cast<py::ssize_t>(own.size()), count = mu.ndim() == 2 ? mu.shape(0) : 0, n = 2 * nv + states;
  if (v.size() != nv || vdot.size() != nv || mu.ndim() != 2 || mu.shape(1) != nv + states)
    throw ModelError("scene_curvature: v and vdot (" + std::to_string(nv) + ",), mu (m, " + std::to_string(nv + states) + ") are expected");
  py::array_t<double> forces(std::vector<py::ssize_t>{count, n, n}), motion(std::vector<py::ssize_t>{count, Curvature<double>::blocks, nv, nv});
  {
    const ModelInUse use(model);
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      if constexpr (std::is_same_v<S, double>) {
        if (scene.effects().own() != states) throw ModelError("scene_curvature: the effects have " + std::to_string(scene.effects().own()) + " states of their own");
        refuse_edges(scene, 2, t, q.data(), v.data(), own.data());
        SceneCurvature at(scene);
        at.forces(t, q.data(), v.data(), own.data(), mu.data(), static_cast<int>(count), forces.mutable_data());
        at.motion(q.data(), v.data(), vdot.data(), mu.data(), static_cast<int>(count), motion.mutable_data());
      }
    });
  }
  return py::make_tuple(forces, motion);
}

}  // namespace

void register_linearization(py::module_& m) {
  m.def("scene_linearized", &linearized, py::arg("calls"), py::arg("q"), py::arg("v"), py::arg("t"), py::arg("states"), py::arg("between") = false,
        "At a state, of A ż = g with z = (v, effects' own states): A, the derivatives of g along displacements and along z, ż, which coordinates are prescribed, and what "
        "is not in g, the forces of loops; q and v are on these, own the effects' states there, and implicit names effects that steps may take implicitly.");
  m.def("scene_curvature", &curvature, py::arg("calls"), py::arg("q"), py::arg("v"), py::arg("t"), py::arg("own"), py::arg("vdot"), py::arg("mu"),
        "Second derivatives at a state, contracted with mu (m, nv + own): of the effects' forces and rates along (displacements, v, own), (m, n, n), and of inverse dynamics as "
        "Curvature has them, (m, 4, nv, nv).");
  m.def("scene_at_rest", &at_rest, py::arg("calls"), py::arg("q"), py::arg("t"), py::arg("states"),
        "At a configuration at rest: what is left of all forces, its derivative along displacements, ℳ + J, and which coordinates are prescribed.");
}

}  // namespace pycraft
