// The factored forms of the articulated-inertia sweep on rigid bodies: algebra/sweeps/factored_inertia.h with columns of six.
#pragma once

#include <algorithm>
#include <vector>

#include "algebra/sweeps/factored_inertia.h"
#include "algebra/sweeps/singular_pivot.h"
#include "model/inertia_factors.h"
#include "spatial/articulated_inertia.h"

namespace pycraft {

template <class S>
class RigidFactors {
 public:
  explicit RigidFactors(const SkoStructure& tree) : tree_(tree), factors_(tree), bias_(tree.coordinates(), S(0)) {}

  void start(int k, const InertiaFactors<S>& own) {
    factors_.start(k);
    for (int c = 0; c < 6; ++c) factors_.add(k, own.weight[c], S(0), [&](int i) { return own.column[c][i]; });
  }
  // The gyroscopic force of body k as accelerations of its own columns, and what is left of it as a force.
  Vector6<S> start_bias(int k, const InertiaFactors<S>& own, const Vector3<S>& omega) { return gyroscopic_bias(own, omega, factors_.bias_row(k)); }
  // ρ <- ρ - C* a
  void add_acceleration(int k, const Vector6<S>& a) {
    S* rho = factors_.bias_row(k);
    for (int i = 0; i < 6; ++i) {
      const S* row = factors_.body_row(k, i);
      for (int c = 0; c < factors_.columns(k); ++c) rho[c] -= a[i] * row[c];
    }
  }
  ArticulatedInertia<S> inertia(int k) const {
    return symmetric([&](int i, int j) { return factors_.inertia(k, i, j); });
  }
  // Entry (i, i) of P(k), of the body whose hinge was eliminated last and has a row that is no coordinate axis.
  const S& diagonal(int i) const { return diagonal_[i]; }
  // G, D, L and pivots d of its factors LdL*, and with bias the rates that C W ρ* gives the hinge; nv_of(k) of each. False, with L and pivots
  // alone, where a pivot is not positive.
  bool eliminate(int k, Form form, const Vector6<S>* H, const S* J, const int* aligned, bool with_bias, Vector6<S>* G, S* D, S* L, S* pivots) {
    const int n = tree_.dof[k], m = factors_.columns(k);
    if (std::any_of(aligned, aligned + n, [](int axis) { return axis < 0; }))
      for (int i = 0; i < 6; ++i) diagonal_[i] = factors_.inertia(k, i, i);
    bool rotor = false;
    for (int j = 0; j < n; ++j) rotor |= !(J[j] == S(0));
    int is_hinge_row[6] = {0, 0, 0, 0, 0, 0};
    for (int j = 0; j < n; ++j) {
      S* row = factors_.hinge_row(k, j);
      std::fill_n(row, m, S(0));
      for (int i = 0; i < 6; ++i) {
        if (aligned[j] >= 0 && i != aligned[j]) continue;
        const S h = H[j][i], *body = factors_.body_row(k, i);
        for (int c = 0; c < m; ++c) row[c] += h * body[c];
      }
      if (aligned[j] >= 0 && !rotor) is_hinge_row[aligned[j]] = H[j][aligned[j]] > S(0) ? j + 1 : -(j + 1);
    }
    for (int j = 0; j < n && rotor; ++j)
      if (!(J[j] == S(0))) factors_.add_rotor(k, J[j], [j](int i) { return i == j ? S(1) : S(0); });
    factors_.eliminate(k, form, is_hinge_row, with_bias);
    hinge_rows_ = n;

    bool positive = true;
    for (int j = 0; j < n; ++j) {
      pivots[j] = factors_.weight(j) * factors_.lower(j, j) * factors_.lower(j, j);
      positive &= pivots[j] > S(0);
      for (int i = 0; i < n; ++i) L[i * n + j] = i < j ? S(0) : ratio_or_zero(factors_.lower(i, j), factors_.lower(j, j));
    }
    if (!positive) return false;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j <= i; ++j) {
        S sum = S(0);
        for (int a = 0; a <= j; ++a) sum += factors_.lower(i, a) * factors_.weight(a) * factors_.lower(j, a);
        D[i * n + j] = D[j * n + i] = sum;
      }
    for (int j = n - 1; j >= 0; --j) {
      Vector6<S> g;
      for (int i = 0; i < 6; ++i) g[i] = factors_.against(i, j);
      S bias = factors_.bias(j);
      for (int a = j + 1; a < n; ++a) {
        g = g - factors_.lower(a, j) * G[a];
        bias -= factors_.lower(a, j) * bias_[tree_.dof_offset[k] + a];
      }
      const S scale = S(1) / factors_.lower(j, j);
      G[j] = scale * g;
      bias_[tree_.dof_offset[k] + j] = scale * bias;
    }
    return true;
  }
  const S* bias(int k) const { return bias_.data() + tree_.dof_offset[k]; }
  // ---- of the body whose hinge was eliminated last
  ArticulatedInertia<S> plus(int k) const {
    return symmetric([&](int i, int j) {
      S sum = S(0);
      for (int r = tree_.dof[k]; r < factors_.pivots(); ++r) sum += factors_.U(i, r) * factors_.weight(r) * factors_.U(j, r);
      return sum;
    });
  }
  // P(3,3) + P(4,4) + P(5,5), as it was before.
  S linear_trace() const {
    S sum = S(0);
    for (int i = 3; i < 6; ++i)
      for (int r = 0; r < factors_.pivots(); ++r) {
        const S x = r < hinge_rows_ ? factors_.against(i, r) : factors_.U(i, r);
        sum += x * factors_.weight(r) * x;
      }
    return sum;
  }
  void to_parent(int k, const Pose<S>& X) {
    for (int r = tree_.dof[k]; r < factors_.pivots(); ++r) {
      Vector6<S> u;
      for (int i = 0; i < 6; ++i) u[i] = factors_.U(i, r);
      u = force_to_parent(X, u);
      factors_.add(tree_.parent[k], factors_.weight(r), factors_.bias(r), [&](int i) { return u[i]; });
    }
  }

 private:
  template <class Entry>
  static ArticulatedInertia<S> symmetric(Entry&& entry) {
    ArticulatedInertia<S> P;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        if (j >= i) P.A(i, j) = entry(i, j), P.C(i, j) = entry(i + 3, j + 3);
        P.B(i, j) = entry(i, j + 3);
      }
    return P;
  }

  const SkoStructure& tree_;
  FactoredInertia<S> factors_;
  std::vector<S> bias_;
  S diagonal_[6];
  int hinge_rows_ = 0;
};

}  // namespace pycraft
