// Conjugate gradients for A x = b, A symmetric positive definite and known by its products alone, preconditioned by its diagonal d (Jacobi).
//
// Residuals are measured in the preconditioner's norm, ‖r‖² = Σ r(i)²/d(i). A run ends when the residual carried along falls below
// 4 eps ‖b‖, has not fallen for 10n + 20 iterations, or the direction has no curvature. The residual carried along parts from the true one
// by rounding, so b - A x is then computed and the run starts again from it, as long as that at least halves it; 100n + 100 iterations
// at most in all: rounding makes it take many more than the n of exact arithmetic. The best x is kept. Each iteration costs one product
// with A and six vector operations.
//
// A small residual says nothing where the condition of A passes 1/eps. The quotients p* A p / Σ d(i) p(i)² of the directions lie between
// the eigenvalues of D^-1/2 A D^-1/2, and the ratio of the largest to the smallest is its condition as far as they reach.
//
// Source: M. R. Hestenes, E. Stiefel, Methods of conjugate gradients for solving linear systems, J. Res. Nat. Bur. Standards 49, 1952.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "numerics/scalar.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class S>
class ConjugateGradients {
 public:
  int iterations = 0;
  S residual = S(0);   // ‖b - A x‖/‖b‖ of the last solution
  S condition = S(1);  // of D^-1/2 A D^-1/2, from below

  // apply(x, y): y = A x. x is overwritten; what was in it does not matter.
  template <class Apply>
  void solve(int n, const S* d, const S* b, S* x, Apply apply) {
    for (auto* v : {&r_, &z_, &p_, &product_, &best_}) v->resize(n);
    iterations = 0;
    largest_ = smallest_ = S(0);
    condition = S(1);
    std::fill_n(x, n, S(0));
    std::copy_n(b, n, r_.data());
    const S size = length(r_, d), target = S(4) * epsilon<S>() * size;
    residual = S(0);
    if (size == S(0)) return;
    std::fill_n(best_.data(), n, S(0));
    S smallest = size;
    for (;;) {
      run(n, d, x, target, apply);
      apply(x, product_.data());
      for (int i = 0; i < n; ++i) r_[i] = b[i] - product_[i];
      const S now = length(r_, d);
      const bool halved = now <= smallest / S(2);
      if (now < smallest) {
        smallest = now;
        std::copy_n(x, n, best_.data());
      }
      if (!halved || now <= target || iterations >= most(n)) break;
    }
    std::copy_n(best_.data(), n, x);
    residual = smallest / size;
    condition = smallest_ > S(0) ? S(largest_ / smallest_) : S(1) / epsilon<S>();
  }

  static int most(int n) { return 100 * n + 100; }
  static size_t numbers(int n) { return size_t(5) * n; }

 private:
  static S length(const std::vector<S>& r, const S* d) {
    using std::sqrt;
    S sum = S(0);
    for (size_t i = 0; i < r.size(); ++i) sum += r[i] * r[i] / d[i];
    return sqrt(sum);
  }
  // From x and its residual r_ on, until r_ is below the target or nothing is gained any more.
  template <class Apply>
  void run(int n, const S* d, S* x, const S& target, Apply apply) {
    const int patience = 10 * n + 20;
    S rz = S(0);
    for (int i = 0; i < n; ++i) {
      p_[i] = z_[i] = r_[i] / d[i];
      rz += r_[i] * z_[i];
    }
    S lowest = rz;
    for (int waited = 0; waited < patience && iterations < most(n); ++waited) {
      check_interrupt();
      apply(p_.data(), product_.data());
      S curvature = S(0), scale = S(0);
      for (int i = 0; i < n; ++i) curvature += p_[i] * product_[i], scale += d[i] * p_[i] * p_[i];
      note_quotient(curvature, scale);
      if (!(curvature > S(0))) return;
      ++iterations;
      const S step = rz / curvature;
      S next = S(0);
      for (int i = 0; i < n; ++i) {
        x[i] += step * p_[i];
        r_[i] -= step * product_[i];
        z_[i] = r_[i] / d[i];
        next += r_[i] * z_[i];
      }
      if (!(next > target * target)) return;
      if (next < lowest) lowest = next, waited = -1;
      const S turn = next / rz;
      for (int i = 0; i < n; ++i) p_[i] = z_[i] + turn * p_[i];
      rz = next;
    }
  }

  void note_quotient(const S& curvature, const S& scale) {
    if (!(scale > S(0))) return;
    const S quotient = maximum(S(curvature / scale), S(0));
    smallest_ = largest_ == S(0) || quotient < smallest_ ? quotient : smallest_;
    largest_ = maximum(largest_, quotient);
  }

  std::vector<S> r_, z_, p_, product_, best_;
  S largest_ = S(0), smallest_ = S(0);  // quotients of directions
};

}  // namespace pycraft
