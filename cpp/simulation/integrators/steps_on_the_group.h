// Steps of fixed size that move configurations on the model's group; what follows q and v in a state is moved as numbers.
#pragma once

#include <algorithm>
#include <vector>

#include "simulation/equations.h"

namespace pycraft {

// The inverse of the exponential's differential on the group, to the order that a method of order 4 needs: along u, a body velocity v is
//   u̇ = v + ½ [u, v] + 1/12 [u, [u, v]],
// [,] the bracket of each subhinge's group.
template <class S>
void exponential_coordinates_rate(const CompiledModel<S>& model, const S* u, const S* v, S* rate) {
  const S half = S(1) / S(2), twelfth = S(1) / S(12);
  each_subhinge(model, [&](auto row, int, int at) {
    S once[row.nv], twice[row.nv];
    row.bracket(u + at, v + at, once);
    row.bracket(u + at, static_cast<const S*>(once), twice);
    for (int i = 0; i < row.nv; ++i) rate[at + i] = v[at + i] + half * once[i] + twelfth * twice[i];
  });
}

// Runge-Kutta-Munthe-Kaas: the classical method of order 4 in exponential coordinates u about the step's first configuration, q = q₀ exp(u).
template <class S>
class MuntheKaas4 {
 public:
  using State = std::vector<S>;
  using Needs = ExplicitEquations<S>;
  explicit MuntheKaas4(const Needs& equations) : q_(equations.nq()), rest_(equations.nv() + equations.rest()), rate_(rest_.size()), sum_(rest_.size()) {
    for (State* x : {&u_, &u_rate_, &u_sum_}) x->resize(equations.nv());
  }

  void do_step(Needs& equations, State& x, const S& t, const S& h) {
    const CompiledModel<S>& model = equations.model();
    const size_t n = equations.nv(), m = rest_.size();
    S *q = x.data(), *v = x.data() + equations.nq();  // v, then what else there is
    const S part[] = {S(0), h / S(2), h / S(2), h}, weight[] = {h / S(6), h / S(3), h / S(3), h / S(6)};
    for (int stage = 0; stage < 4; ++stage) {
      if (stage == 0) {
        equations.evaluate(t, q, v, v + n, rate_.data(), rate_.data() + n);
        std::copy_n(equations.velocities(), n, u_rate_.data());
      } else {
        for (size_t i = 0; i < n; ++i) u_[i] = part[stage] * u_rate_[i];
        for (size_t i = 0; i < m; ++i) rest_[i] = v[i] + part[stage] * rate_[i];
        move_configuration(model, q, u_.data(), q_.data());
        equations.evaluate(t + part[stage], q_.data(), rest_.data(), rest_.data() + n, rate_.data(), rate_.data() + n);
        exponential_coordinates_rate(model, u_.data(), equations.velocities(), u_rate_.data());
      }
      for (size_t i = 0; i < n; ++i) u_sum_[i] = (stage ? u_sum_[i] : S(0)) + weight[stage] * u_rate_[i];
      for (size_t i = 0; i < m; ++i) sum_[i] = (stage ? sum_[i] : S(0)) + weight[stage] * rate_[i];
    }
    move_configuration(model, q, u_sum_.data(), q);
    for (size_t i = 0; i < m; ++i) v[i] += sum_[i];
  }

 private:
  State q_, rest_, rate_, sum_, u_, u_rate_, u_sum_;
};

// v⁺ = v + h v̇, q⁺ = q exp(h v⁺), v̇ that of a step of size h: (ℳ + J + h C + h² K) v̇ = T(q + h v, v), C and K of implicit damping and stiffness.
// Source: D. Baraff, A. Witkin, Large steps in cloth simulation, SIGGRAPH 1998, with D of the articulated bodies in place of their matrix.
template <class S>
class SemiImplicitEuler {
 public:
  using State = std::vector<S>;
  using Needs = ImplicitEquations<S>;
  explicit SemiImplicitEuler(const Needs& equations) : rate_(equations.nv() + equations.rest()), u_(equations.nv()) {}

  void do_step(Needs& equations, State& x, const S& t, const S& h) {
    const size_t n = equations.nv();
    S *q = x.data(), *v = x.data() + equations.nq();
    equations.evaluate_step(t, h, q, v, v + n, rate_.data(), rate_.data() + n);
    for (size_t i = 0; i < rate_.size(); ++i) v[i] += h * rate_[i];
    for (size_t i = 0; i < n; ++i) u_[i] = h * v[i];
    move_configuration(equations.model(), q, u_.data(), q);
  }

 private:
  State rate_, u_;
};

}  // namespace pycraft
