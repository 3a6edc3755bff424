#include "simulation/stiffness.h"

#include <algorithm>
#include <cmath>

#include "simulation/decay.h"
#include "simulation/scene_linearized.h"

namespace pycraft {

Stiffness stiffness_of(CompiledScene<double>& scene, double t, const std::vector<double>& x, double step) {
  SceneLinearized equations(scene, false);
  const int nq = equations.nq(), nv = equations.nv(), own = equations.own();
  const std::vector<double> state(x.begin(), x.begin() + nq + nv + own);
  DecayFinder finder(equations);
  const Decay& decay = finder.fastest(t, state, step);
  Stiffness found{t, step, 0, 0, "", ""};
  if (!decay.holds(std::abs(step))) return found;
  found.rate = decay.real;
  Eigen::Index most = 0;
  decay.z.head(nv).cwiseAbs().maxCoeff(&most);
  found.coordinate = scene.scene().model().structure().coordinate_names[static_cast<size_t>(most)];
  // Whose forces change most along it, by differences of a hundred-thousandth of the decay's own scale: |v| changes by no more than that of the state.
  const auto& effects = scene.effects().effects();
  double fastest = 1e-9;
  for (int i = 0; i < nv; ++i) fastest = std::max(fastest, std::abs(state[nq + i]));
  const double by = 1e-5 * fastest / std::max(decay.z.head(nv).cwiseAbs().maxCoeff(), 1e-300);
  std::vector<double> moved = state, along(nv), vdot(nv), before(effects.size() * nv), after(before.size());
  for (int i = 0; i < nv; ++i) along[i] = by * decay.displacement[i];
  move_configuration(scene.numbers(), state.data(), along.data(), moved.data());
  for (int i = 0; i < nv + own; ++i) moved[nq + i] += by * decay.z[i];
  const auto forces = [&](const std::vector<double>& at, std::vector<double>& rows) {
    scene.accelerations_and_forces(t, at.data(), at.data() + nq, at.data() + nq + nv, vdot.data(), rows.data());
  };
  forces(state, before), forces(moved, after);
  double share = 0;
  for (const auto& e : effects) {
    double power = 0;  // against the motion along it
    for (int i = 0; i < nv; ++i) power -= (after[size_t(e->number) * nv + i] - before[size_t(e->number) * nv + i]) * decay.z[i];
    if (power > share) share = power, found.effect = e->name;
  }
  return found;
}

}  // namespace pycraft
