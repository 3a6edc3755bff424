// What is between the two ends of a step, where the method has no dense output of its own: Hermite's interpolation in q, v, v̇ on the group.
//
// Along q = q₀ exp(u) the polynomial u(t) of degree 5 has u, u̇ and ü of both ends, from v and v̇ by
//   u̇ = v + ½ [u, v] + 1/12 [u, [u, v]],     v = Σ (-1)^k [u, ...[u, u̇]]/(k+1)!
// and its v is that of q; what follows v in x is interpolated by cubic ones, from its rates. Errors of a step of size h: O(h⁶) in q, O(h⁵) in v,
// O(h⁴) in what follows. For a method of order 1, straight lines: q₀ exp(s u), O(h²).
// Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, Springer 1993, II.6, in canonical coordinates.
#pragma once

#include <algorithm>
#include <vector>

#include "simulation/equations.h"

namespace pycraft {

template <class S>
class HermiteOutput {
 public:
  using State = std::vector<S>;
  HermiteOutput(Equations<S>& equations, bool straight) : equations_(equations), straight_(straight), nq_(equations.nq()), nv_(equations.nv()), rest_(equations.rest()) {}

  // Between these ends, which stay where they are. Two evaluations, unless lines are straight.
  void set(const S& t0, const State& x0, const S& t1, const State& x1) {
    t0_ = t0, h_ = t1 - t0, x0_ = &x0, x1_ = &x1;
    for (State* x : {&u_, &u_rate_}) x->resize(nv_);
    configuration_difference(equations_.model(), x0.data(), x1.data(), u_.data());
    for (State* c : {&c3_, &c4_, &c5_}) c->assign(nv_, S(0));
    c1_ = u_, c2_.assign(nv_, S(0));
    if (straight_) return;
    State second = ends();
    for (int i = 0; i < nv_; ++i) {
      c1_[i] = h_ * v0_[i], c2_[i] = h_ * h_ * a0_[i] / S(2);
      const S D = u_[i] - c1_[i] - c2_[i], V = h_ * u_rate_[i] - c1_[i] - S(2) * c2_[i], A = h_ * h_ * second[i] - S(2) * c2_[i];
      c3_[i] = S(10) * D - S(4) * V + A / S(2), c4_[i] = S(7) * V - S(15) * D - A, c5_[i] = S(6) * D - S(3) * V + A / S(2);
    }
  }
  void at(const S& t, State& out) {
    const S s = (t - t0_) / h_;
    out.resize(x0_->size());
    for (int i = 0; i < nv_; ++i) {
      u_[i] = s * (c1_[i] + s * (c2_[i] + s * (c3_[i] + s * (c4_[i] + s * c5_[i]))));
      u_rate_[i] = (c1_[i] + s * (S(2) * c2_[i] + s * (S(3) * c3_[i] + s * (S(4) * c4_[i] + s * S(5) * c5_[i])))) / h_;
    }
    move_configuration(equations_.model(), x0_->data(), u_.data(), out.data());
    velocities_of(out.data() + nq_);
    for (int i = nq_ + (straight_ ? 0 : nv_); i < nq_ + nv_ + rest_; ++i) out[i] = follower(i, s);
  }

 private:
  // Rates at both ends, u̇ of the second in u_rate_; returns ü there.
  State ends() {
    const auto rates = [&](const S& t, const State& x, State& v, State& a, State& rest) {
      a.resize(nv_), rest.resize(rest_);
      equations_.evaluate(t, x.data(), x.data() + nq_, x.data() + nq_ + nv_, a.data(), rest.data());
      v.assign(equations_.velocities(), equations_.velocities() + nv_);
    };
    rates(t0_, *x0_, v0_, a0_, rest0_);
    rates(t0_ + h_, *x1_, v1_, a1_, rest1_);
    State second(nv_);
    const S half = S(1) / S(2), twelfth = S(1) / S(12);
    each_subhinge(equations_.model(), [&](auto row, int, int at) {
      const S *u = u_.data() + at, *v = v1_.data() + at, *a = a1_.data() + at;
      S uv[row.nv], uuv[row.nv], rv[row.nv], ua[row.nv], ruv[row.nv], urv[row.nv], uua[row.nv];
      S* const rate = u_rate_.data() + at;
      row.bracket(u, v, uv), row.bracket(u, static_cast<const S*>(uv), uuv);
      for (int i = 0; i < row.nv; ++i) rate[i] = v[i] + half * uv[i] + twelfth * uuv[i];
      row.bracket(static_cast<const S*>(rate), v, rv), row.bracket(u, a, ua);
      row.bracket(static_cast<const S*>(rate), static_cast<const S*>(uv), ruv);
      row.bracket(u, static_cast<const S*>(rv), urv), row.bracket(u, static_cast<const S*>(ua), uua);
      for (int i = 0; i < row.nv; ++i) second[at + i] = a[i] + half * (rv[i] + ua[i]) + twelfth * (ruv[i] + urv[i] + uua[i]);
    });
    return second;
  }
  void velocities_of(S* v) {
    each_subhinge(equations_.model(), [&](auto row, int, int at) {
      S term[row.nv], next[row.nv];
      for (int i = 0; i < row.nv; ++i) term[i] = v[at + i] = u_rate_[at + i];
      for (int k = 1; row.nv > 1 && k < 8; ++k) {
        row.bracket(u_.data() + at, static_cast<const S*>(term), next);
        for (int i = 0; i < row.nv; ++i) term[i] = -next[i] / S(k + 1), v[at + i] += term[i];
      }
    });
  }
  S follower(int i, const S& s) const {
    const S from = (*x0_)[i], by = (*x1_)[i] - from;
    if (straight_) return from + s * by;
    const S r0 = h_ * rest0_[i - nq_ - nv_], r1 = h_ * rest1_[i - nq_ - nv_];
    return from + s * (r0 + s * (S(3) * by - S(2) * r0 - r1 + s * (r0 + r1 - S(2) * by)));
  }

  Equations<S>& equations_;
  bool straight_;
  int nq_, nv_, rest_;
  S t0_ = S(0), h_ = S(1);
  const State *x0_ = nullptr, *x1_ = nullptr;
  State u_, u_rate_, c1_, c2_, c3_, c4_, c5_, v0_, a0_, rest0_, v1_, a1_, rest1_;
};

}  // namespace pycraft
