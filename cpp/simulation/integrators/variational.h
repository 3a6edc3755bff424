// A variational integrator on the model's group, where free hinges are SO(3) × R³ (rotations_and_positions.h): what makes Σ L_d stationary, with L at
// the middle of the step,
//
//   L_d(q₀, q₁) = h L(q_m, v),   q₀ = q_m exp(-w),  q₁ = q_m exp(w),  v = 2w/h        (a geodesic from q₀ to q₁)
//
// so that steps are symplectic on q and the momenta π = (ℳ + J) v, and symmetric in time. With F = ∂KE/∂θ + T at (t + h/2, q_m, v), and
// ad = ad_w* on momenta, the discrete Euler-Lagrange equations, with forces by d'Alembert's principle, are
//
//   P₀ = exp(ad) π₀,   P₁ = P₀ + h F,   π₁ = exp(ad) P₁,      π(q_m, v) = S (P₀ + h F/2) + (h/2) C F
//   S = Σ ad^(2k)/(2k+1)!,   C = Σ ad^(2k+1)/(2k+2)!                                   (both from δw and δq_m, with dexp_w)
//
// The last is solved for v by v += (ℳ + J)⁻¹ (right side - π), in O(N) each time, until rounding is left. Order 2. What else the motion depends on
// is taken by the midpoint rule. Order 4 by Suzuki's composition of five steps, γh, γh, (1 - 4γ)h, γh, γh, γ = 1/(4 - 4^(1/3)).
//
// Sources: J. E. Marsden, M. West, Discrete mechanics and variational integrators, Acta Numerica 2001; N. Bou-Rabee, J. E. Marsden, Hamilton-Pontryagin
// integrators on Lie groups, Found. Comput. Math. 2009; E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, Springer 2006, II.4, VIII.6.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/checks.h"
#include "numerics/scalar.h"
#include "simulation/equations.h"
#include "simulation/integrators/integrator.h"
#include "simulation/integrators/rotations_and_positions.h"

namespace pycraft {

// out = Σ_k c(k) (ad_w*)^k p of each subhinge's group, until terms are below rounding. c(k) falls as 1/k!. Where the group commutes, c(0) p.
template <class S, class Coefficient>
void coadjoint_series(const CompiledModel<S>& model, const S* w, const S* p, Coefficient c, S* out) {
  each_subhinge(model, [&](auto row, int, int at) {
    for (int i = row.nv == 1 ? 0 : 3; i < row.nv; ++i) out[at + i] = c(0) * p[at + i];
    if constexpr (row.nv > 1) {  // a rotation
      S term[3], next[3];
      S most = S(0);
      for (int i = 0; i < 3; ++i) term[i] = p[at + i], out[at + i] = c(0) * p[at + i];
      for (int i = 0; i < 3; ++i) most = maximum(most, term[i] < S(0) ? S(-term[i]) : term[i]);
      S factorial = S(1);
      for (int k = 1; k < 80; ++k) {
        BallSubhinge::cobracket(w + at, static_cast<const S*>(term), next);
        S size = S(0);
        for (int i = 0; i < 3; ++i) term[i] = next[i], out[at + i] += c(k) * next[i], size = maximum(size, next[i] < S(0) ? S(-next[i]) : next[i]);
        factorial *= S(k);
        if (!(size > epsilon<S>() * most * factorial / S(8))) break;
      }
    }
  });
}

template <class S>
class Variational2 {
 public:
  using State = std::vector<S>;
  using Needs = VariationalEquations<S>;
  static constexpr Integrator name = Integrator::variational2;
  explicit Variational2(const Needs& equations) : n_(equations.nv()), own_(equations.rest() - equations.integrals()), q_(equations.nq()), y_(own_), y_rate_(own_), rate_(n_ + equations.rest()) {
    for (State* x : {&v_, &twist_, &w_, &p_, &P_, &F_, &pi_, &r_, &part_, &change_}) x->resize(n_);
    inverse_factorial_.push_back(S(1));
    for (int k = 1; k <= 81; ++k) inverse_factorial_.push_back(inverse_factorial_.back() / S(k));
  }

  void do_step(Needs& equations, State& x, const S& t, const S& h, Integrator named = name) {
    const CompiledModel<S>& model = equations.model();
    S *q = x.data(), *v = q + equations.nq(), *y = v + n_;
    const S half = h / S(2), middle = t + half;
    equations.momentum(q, v, p_.data());
    outward(model, q, p_.data());
    equations.evaluate(t, q, v, y, rate_.data(), rate_.data() + n_);
    accelerations_apart(model, q, v, rate_.data());
    std::copy_n(v, n_, v_.data());
    outward(model, q, v_.data());
    for (int i = 0; i < n_; ++i) v_[i] += half * rate_[i];
    for (int i = 0; i < own_; ++i) y_rate_[i] = rate_[n_ + i];
    solve_for_velocities(equations, q, y, t, h, named);
    for (int i = 0; i < n_; ++i) part_[i] = P_[i] + h * F_[i];
    coadjoint_series(model, w_.data(), part_.data(), [&](int k) { return inverse_factorial_[k]; }, p_.data());
    if (equations.integrals() > 0) equations.evaluate(middle, q_.data(), twist_.data(), y_.data(), rate_.data(), rate_.data() + n_);
    for (int i = 0; i < own_; ++i) y[i] += h * y_rate_[i];
    for (int i = own_; i < equations.rest(); ++i) y[i] += h * rate_[n_ + i];
    move_apart(model, q_.data(), w_.data(), q);
    inward(model, q, p_.data());
    equations.solve(q, p_.data(), v);
  }

 private:
  // v_, w_, q_, y_ at the middle, P_ and F_ there; twist_ is v_ in the model's own velocities.
  void solve_for_velocities(Needs& equations, const S* q, const S* y, const S& t, const S& h, Integrator named) {
    const CompiledModel<S>& model = equations.model();
    const S half = h / S(2);
    S before = S(-1);
    for (int iteration = 0;; ++iteration) {
      for (int i = 0; i < n_; ++i) w_[i] = half * v_[i];
      for (int i = 0; i < own_; ++i) y_[i] = y[i] + half * y_rate_[i];
      move_apart(model, q, w_.data(), q_.data());
      twist_ = v_;
      inward(model, q_.data(), twist_.data());
      equations.momentum_and_forces(t + half, q_.data(), twist_.data(), y_.data(), pi_.data(), F_.data(), y_rate_.data());
      momenta_and_forces_apart(model, q_.data(), twist_.data(), pi_.data(), F_.data());
      right_side(model, h);
      S size = S(0);
      for (int i = 0; i < n_; ++i) size += v_[i] * pi_[i], r_[i] -= pi_[i];
      inward(model, q_.data(), r_.data());
      equations.solve(q_.data(), r_.data(), change_.data());
      S off = S(0);  // twice the kinetic energy of the correction
      for (int i = 0; i < n_; ++i) off += change_[i] * r_[i];
      outward(model, q_.data(), change_.data());
      for (int i = 0; i < n_; ++i) v_[i] += change_[i];
      if (off < S(0)) off = -off;
      if (settled(off, before, size)) return;
      before = off;
      if (iteration > 100 || !std::isfinite(to_double(off))) refuse_step(equations, t, h, named);
    }
  }
  void right_side(const CompiledModel<S>& model, const S& h) {
    const S half = h / S(2);
    coadjoint_series(model, w_.data(), p_.data(), [&](int k) { return inverse_factorial_[k]; }, P_.data());
    for (int i = 0; i < n_; ++i) part_[i] = P_[i] + half * F_[i];
    coadjoint_series(model, w_.data(), part_.data(), [&](int k) { return k % 2 ? S(0) : inverse_factorial_[k + 1]; }, r_.data());
    coadjoint_series(model, w_.data(), F_.data(), [&](int k) { return k % 2 ? inverse_factorial_[k + 1] : S(0); }, part_.data());
    for (int i = 0; i < n_; ++i) r_[i] += half * part_[i];
  }
  // Nothing to correct but rounding, or rounding that no longer falls.
  static bool settled(const S& off, const S& before, const S& size) {
    const S rounding = epsilon<S>() * size;
    return off <= S(0.01) * epsilon<S>() * rounding || (before >= S(0) && off >= S(0.8) * before && off <= rounding);
  }
  [[noreturn]] void refuse_step(Needs& equations, const S& t, const S& h, Integrator named) const {
    int worst = 0;
    for (int i = 1; i < n_; ++i)
      if (!(std::abs(to_double(change_[i])) <= std::abs(to_double(change_[worst])))) worst = i;
    refuse(named, "the equations of the step of " + short_number(to_double(h)) + " s after t = " + short_number(to_double(t)) + " s are not solved by iteration, least of all " +
                      equations.name_of(equations.nq() + worst) + "; take smaller steps (step=)");
  }

  int n_, own_;
  State q_, y_, y_rate_, rate_, v_, twist_, w_, p_, P_, F_, pi_, r_, part_, change_, inverse_factorial_;
};

template <class S>
class Variational4 {
 public:
  using State = std::vector<S>;
  using Needs = VariationalEquations<S>;
  explicit Variational4(const Needs& equations) : second_(equations) {
    S root = S(1.6);  // of 4, the third
    for (int i = 0; i < 8; ++i) root -= (root - S(4) / (root * root)) / S(3);
    const S part = S(1) / (S(4) - root);
    parts_ = {part, part, S(1) - S(4) * part, part, part};
  }
  void do_step(Needs& equations, State& x, const S& t, const S& h) {
    S at = t;
    for (const S& part : parts_) {
      second_.do_step(equations, x, at, part * h, Integrator::variational4);
      at += part * h;
    }
  }

 private:
  Variational2<S> second_;
  std::vector<S> parts_;
};

}  // namespace pycraft
