// A scene's accelerations in steps of size h, with h C + h² K of implicit damping and stiffness in D:
//
//   (ℳ + J + h C + h² K) v̇ = T(q + h v, v) - 𝒞
//
// which is (ℳ + J)(v⁺ - v)/h = T(q⁺, v⁺) - 𝒞 where forces at those coordinates are linear. The work of damping in such a step is that of its force
// at v⁺, -c v⁺ (v + v⁺)/2 a second: what the step takes from the kinetic energy, whatever h c is.
#pragma once

#include <vector>

#include "simulation/scene_equations.h"

namespace pycraft {

template <class S>
class SceneSteps : public SceneEquations<S, ImplicitEquations> {
 public:
  using SceneEquations<S, ImplicitEquations>::SceneEquations;

  void evaluate_step(const S& t, const S& h, const S* q, const S* v, const S* rest, S* vdot, S* rest_rate) override {
    struct Plainly {  // states between steps have no size
      CompiledScene<S>& scene;
      ~Plainly() { scene.set_step(S(0)); }
    } after{this->scene()};
    this->scene().set_step(h);
    this->evaluate(t, q, v, rest, vdot, rest_rate);
    if (this->works() == 0) return;
    const S* const moving = this->velocities();
    for (const auto& e : this->scene().effects().effects()) {
      if (e->worker < 0) continue;
      S off = S(0);
      for (const HingeTerm& term : e->declared.hinges) {
        const S &before = moving[term.coordinate], after = before + h * vdot[term.coordinate];
        off += S(term.damping) * (before * before - after * (before + after) / S(2));
      }
      rest_rate[this->own() + e->worker] += off / this->unit_of_work();
    }
  }
};

}  // namespace pycraft
