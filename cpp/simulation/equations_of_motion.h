// The right-hand side ẋ of x = (q, v), with its evaluations counted, and steps of fixed size.
#pragma once

#include <cmath>
#include <vector>

#include "model/configuration.h"
#include "runtime/interrupt.h"
#include "simulation/trajectory.h"

namespace pycraft {

template <class S>
class EquationsOfMotion {
 public:
  using State = std::vector<S>;
  EquationsOfMotion(const CompiledModel<S>& model, const Accelerations<S>& accelerations, const S* tau, const S* damping)
      : model_(model), accelerations_(accelerations), tau_(tau), damping_(damping), force_(tau, tau + model.nv) {}

  void operator()(const State& x, State& rate, const S&) {
    configuration_rate(model_, x.data(), x.data() + model_.nq, rate.data());
    accelerate(x.data(), x.data() + model_.nq, rate.data() + model_.nq);
  }
  void accelerate(const S* q, const S* v, S* vdot) {
    ++evaluations;
    check_interrupt();
    if (damping_)
      for (int i = 0; i < model_.nv; ++i) force_[i] = tau_[i] - damping_[i] * v[i];
    accelerations_(q, v, force_.data(), vdot);
  }
  const CompiledModel<S>& model() const { return model_; }

  long evaluations = 0;

 private:
  const CompiledModel<S>& model_;
  const Accelerations<S>& accelerations_;
  const S *tau_, *damping_;
  State force_;
};

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
  explicit MuntheKaas4(const CompiledModel<S>& model) : q_(model.nq) {
    for (State* x : {&v_, &u_, &rate_, &acceleration_, &sum_u_, &sum_v_}) x->resize(model.nv);
  }

  void do_step(EquationsOfMotion<S>& equations, State& x, const S&, const S& h) {
    const CompiledModel<S>& model = equations.model();
    const int n = model.nv;
    S *q = x.data(), *v = x.data() + model.nq;
    const S part[] = {S(0), h / S(2), h / S(2), h}, weight[] = {h / S(6), h / S(3), h / S(3), h / S(6)};
    for (int stage = 0; stage < 4; ++stage) {
      if (stage == 0) {
        std::copy_n(v, n, rate_.data());
        equations.accelerate(q, v, acceleration_.data());
      } else {
        for (int i = 0; i < n; ++i) {
          u_[i] = part[stage] * rate_[i];
          v_[i] = v[i] + part[stage] * acceleration_[i];
        }
        move_configuration(model, q, u_.data(), q_.data());
        exponential_coordinates_rate(model, u_.data(), v_.data(), rate_.data());
        equations.accelerate(q_.data(), v_.data(), acceleration_.data());
      }
      for (int i = 0; i < n; ++i) {
        sum_u_[i] = (stage ? sum_u_[i] : S(0)) + weight[stage] * rate_[i];
        sum_v_[i] = (stage ? sum_v_[i] : S(0)) + weight[stage] * acceleration_[i];
      }
    }
    move_configuration(model, q, sum_u_.data(), q);
    for (int i = 0; i < n; ++i) v[i] += sum_v_[i];
  }

 private:
  State q_, v_, u_, rate_, acceleration_, sum_u_, sum_v_;
};

}  // namespace pycraft
