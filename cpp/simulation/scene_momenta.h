// Momenta of a scene and the forces that change them: π = (ℳ + J) v, J with the rotors that effects bring, ∂KE/∂θ + T of all effects, and
// (ℳ + J)⁻¹ by the scene's form. Cost O(N).
#pragma once

#include <vector>

#include "dynamics/hybrid_dynamics.h"
#include "recursions/momenta.h"
#include "simulation/scene_equations.h"

namespace pycraft {

template <class S>
class SceneMomenta : public SceneEquations<S, VariationalEquations> {
 public:
  SceneMomenta(CompiledScene<S>& scene, bool works)
      : SceneEquations<S, VariationalEquations>(scene, works), momenta_(scene.numbers()), J_(scene.numbers().rotor_inertia), sum_(scene.numbers().nv) {
    Vector3<double> gravity{0, 0, 0};
    for (const auto& e : scene.effects().effects()) {
      if (e->declared.uniform_gravity) gravity = gravity + e->declared.gravity;
      for (const HingeTerm& term : e->declared.hinges) J_[term.coordinate] += S(term.inertia);
    }
    gravity_ = cast<S>(gravity);
    solver_ = std::make_unique<HybridDynamics<S>>(scene.scene().model(), hinge_terms(scene.scene()), scene.how(), Vector3<double>{0, 0, 0});
  }

  void momentum(const S* q, const S* v, S* pi) override { momenta_.momentum(q, v, J_.data(), pi); }
  void momentum_and_forces(const S& t, const S* q, const S* v, const S* rest, S* pi, S* forces, S* rest_rate) override {
    momenta_.momentum_and_forces(q, v, J_.data(), gravity_, pi, forces);
    SceneForces<S>& effects = this->scene().effects();
    effects.generalized_forces(t, q, v, rest, sum_.data());
    for (size_t j = 0; j < sum_.size(); ++j) forces[j] += sum_[j];
    if (this->own() > 0) effects.rates(rest_rate);
  }
  void solve(const S* q, const S* r, S* x) override {
    if ((++this->solutions & 63) == 0) check_interrupt();
    solver_->run(q, nullptr, r, nullptr, x);
  }

 private:
  Momenta<S> momenta_;
  std::vector<S> J_, sum_;
  Vector3<S> gravity_;
  std::unique_ptr<HybridDynamics<S>> solver_;
};

}  // namespace pycraft
