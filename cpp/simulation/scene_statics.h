// A scene at rest: what is left of all its forces once nothing accelerates, and its derivative along displacements,
//
//   g(q) = T(q, 0) - ID(q, 0, 0),    ∂g/∂q of simulation/scene_linearized.h at v = v̇ = 0.
//
// Where loops are kept their forces are left out: they are what balances g across the states on them. Effects' own states are held, and so are prescribed coordinates, where their motion has them at t: their rows are zero.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "simulation/scene_linearized.h"

namespace pycraft {

struct Statics {
  std::vector<double> q, residual;  // q with prescribed coordinates in their places
  double size = 0;                  // of the largest force of one effect that is part of the residual
  Linearization at;                 // along_u: ∂g/∂q; mass
};

// T(q, 0), effect by effect; the largest of each one's to `size`.
inline std::vector<double> forces_at_rest(CompiledScene<double>& scene, double t, const double* q, const double* own, double& size) {
  SceneForces<double>& effects = scene.effects();
  const int nv = scene.numbers().nv;
  std::vector<double> sum(nv, 0.0), one(nv);
  effects.start(t, q, nullptr, own);
  effects.place(effects.whole());
  for (const auto& e : effects.effects()) {
    if (!e->acts() || e->declared.only_in_motion) continue;
    std::fill(one.begin(), one.end(), 0.0);
    effects.act_and_keep(*e, one.data()), effects.gather_kept(*e, one.data());
    for (int j = 0; j < nv; ++j) sum[j] += one[j], size = std::max(size, std::abs(one[j]));
  }
  return sum;
}

// own: the effects' states, null: as they are at first.
inline Statics statics(CompiledScene<double>& scene, double t, const double* q, const double* own) {
  SceneLinearized equations(scene, false);
  const Multibody& model = scene.scene().model();
  const int nq = model.nq(), nv = model.nv();
  const std::vector<double> still(nv, 0.0), x = equations.initial_of_tree(t, q, still.data(), own);
  const double* const rest = x.data() + nq + nv;
  Statics found;
  found.q.assign(x.begin(), x.begin() + nq);
  const std::vector<double> no_rates(equations.own(), 0.0);
  equations.linearize(t, 1.0, found.q.data(), still.data(), rest, still.data(), no_rates.data(), found.at);
  const std::vector<double> forces = forces_at_rest(scene, t, found.q.data(), rest, found.size);
  std::vector<double> weights(nv);
  Applied<double> field{{0, 0, 0}};
  for (const auto& e : scene.effects().effects())
    if (e->declared.uniform_gravity) field.gravity = field.gravity + e->declared.gravity;
  RigidDynamics<double>(model).inverse_dynamics(found.q.data(), still.data(), nullptr, weights.data(), &field);
  for (int j = 0; j < nv; ++j) {
    found.size = std::max(found.size, std::abs(weights[j]));
    found.residual.push_back(found.at.known[j] ? 0.0 : forces[j] - weights[j]);
  }
  return found;
}

}  // namespace pycraft
