// The factored forms of the articulated-inertia sweep on rigid bodies: algebra/trees/sweeps/factored_inertia.h with columns of six.
#pragma once

#include <algorithm>
#include <vector>

#include "algebra/trees/sweeps/factored_inertia.h"
#include "algebra/trees/sweeps/singular_pivot.h"
#include "model/inertia_factors.h"
#include "spatial/symmetric6.h"

namespace pycraft {

template <class S>
class RigidFactors {
 public:
  explicit RigidFactors(const SkoStructure& tree) : tree_(tree), factors_(tree), bias_(tree.coordinates(), S(0)), weighted_(factors_.widest()) {}

  void start(int k, const InertiaFactors<S>& own) {
    factors_.start(k);
    const int stride = factors_.stride(k);
    S* row = factors_.more(k, 6);
    for (int i = 0; i < 6; ++i, row += stride)
      for (int c = 0; c < 6; ++c) row[c] = own.column[c][i];
    std::fill_n(row, 6, S(0));
    std::copy_n(own.weight, 6, row + stride);
  }
  // The gyroscopic force of body k as accelerations of its own columns, and what is left of it as a force.
  Vector6<S> start_bias(int k, const InertiaFactors<S>& own, const Vector3<S>& omega) { return gyroscopic_bias(own, omega, factors_.bias_row(k)); }
  // ρ <- ρ - C* a
  void add_acceleration(int k, const Vector6<S>& a) {
    const int stride = factors_.stride(k);
    const S* __restrict row = factors_.body_row(k, 0);
    S* __restrict rho = factors_.bias_row(k);
    factors_.fill_up(k);
    for_columns<S>(factors_.columns(k), [&](int c) {
      S sum = rho[c];
      for (int i = 0; i < 6; ++i) sum -= a[i] * row[i * stride + c];
      rho[c] = sum;
    });
  }
  Symmetric6<S> inertia(int k) const {
    return symmetric6_of<S>([&](int i, int j) { return factors_.inertia(k, i, j); });
  }
  // Entry (i, i) of P(k), of the body whose hinge was eliminated last and has a row that is no coordinate axis.
  const S& diagonal(int i) const { return diagonal_[i]; }
  // G, D, L and pivots d of its factors LdL*, and with bias the rates that C W ρ* gives the hinge; nv_of(k) of each. False, with L and pivots
  // alone, where a pivot is not positive.
  bool eliminate(int k, Form form, const Vector6<S>* H, const S* J, const int* aligned, bool with_bias, Vector6<S>* G, S* D, S* L, S* pivots) {
    const int n = tree_.dof[k], m = factors_.columns(k), stride = factors_.stride(k);
    const S* __restrict body = factors_.body_row(k, 0);
    if (!with_bias) factors_.fill_up(k);  // else accelerations were added
    if (std::any_of(aligned, aligned + n, [](int axis) { return axis < 0; })) {
      const S* __restrict weight = factors_.weights(k);
      S* __restrict square = weighted_.data();
      for (int i = 0; i < 6; ++i) {
        for_columns<S>(m, [&](int c) { square[c] = weight[c] * body[i * stride + c]; });
        diagonal_[i] = product_of_rows(square, body + i * stride, m);
      }
    }
    bool rotor = false;
    for (int j = 0; j < n; ++j) rotor |= !(J[j] == S(0));
    int is_hinge_row[6] = {0, 0, 0, 0, 0, 0};
    for (int j = 0; j < n; ++j) {
      S* __restrict row = factors_.hinge_row(k, j);
      if (const int i = aligned[j]; i >= 0) {
        const S h = H[j][i];
        for_columns<S>(m, [&](int c) { row[c] = h * body[i * stride + c]; });
      } else {
        const Vector6<S> h = H[j];
        for_columns<S>(m, [&](int c) {
          S sum = h[0] * body[c];
          for (int i = 1; i < 6; ++i) sum += h[i] * body[i * stride + c];
          row[c] = sum;
        });
      }
      if (aligned[j] >= 0 && !rotor) is_hinge_row[aligned[j]] = H[j][aligned[j]] > S(0) ? j + 1 : -(j + 1);
    }
    for (int j = 0; j < n && rotor; ++j)
      if (!(J[j] == S(0))) factors_.add_rotor(k, J[j], [j](int i) { return i == j ? S(1) : S(0); });
    if (rotor) factors_.fill_up(k);
    factors_.eliminate(k, form, is_hinge_row, with_bias);
    hinge_rows_ = n;

    bool positive = true;
    for (int j = 0; j < n; ++j) {
      pivots[j] = factors_.weight(j) * factors_.lower(j, j) * factors_.lower(j, j);
      positive &= pivots[j] > S(0);
      for (int i = 0; i < n; ++i) L[i * n + j] = i < j ? S(0) : ratio_or_zero(factors_.lower(i, j), factors_.lower(j, j));
    }
    if (positive) read_gains(k, G, D);
    return positive;
  }
  const S* bias(int k) const { return bias_.data() + tree_.dof_offset[k]; }
  // ---- of the body whose hinge was eliminated last
  Symmetric6<S> plus(int k) const {
    return symmetric6_of<S>([&](int i, int j) {
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
    const int first = tree_.dof[k], columns = factors_.pivots() - first, p = tree_.parent[k], stride = factors_.stride(p);
    const S *__restrict u[6], *__restrict bias = factors_.bias_row_left(first), *__restrict weight = factors_.weights_left(first);
    for (int i = 0; i < 6; ++i) u[i] = factors_.U_row(i, first);
    S* __restrict to = factors_.more(p, columns);
    for (int c = 0; c < columns; ++c) {
      const Vector6<S> carried = shifted(X, Vector6<S>{{u[0][c], u[1][c], u[2][c]}, {u[3][c], u[4][c], u[5][c]}});
      for (int i = 0; i < 6; ++i) to[i * stride + c] = carried[i];
      to[6 * stride + c] = bias[c];
      to[7 * stride + c] = weight[c];
    }
  }

  // ---- for neighbours of another kind (algebra/trees/mixed_blocks.h): f(weight, u) of every column of P⁺, and one that comes in
  template <class F>
  void carried_columns(int k, F&& f) const {
    for (int r = tree_.dof[k]; r < factors_.pivots(); ++r) f(factors_.weight(r), [&](int i) { return factors_.U(i, r); });
  }
  template <class Column>
  void take_column(int p, const S& weight, Column&& u) {
    factors_.add(p, weight, S(0), u);
  }

 private:
  // A call: a loop over so few columns is slower with the compiler's vectors than without (forward dynamics in form "ud" by 6 %).
  [[gnu::noinline]] static Vector6<S> shifted(const Pose<S>& X, const Vector6<S>& column) { return force_to_parent(X, column); }
  // D = L_D d L_D*, G and the bias' rates by the triangle on top of the factors.
  void read_gains(int k, Vector6<S>* G, S* D) {
    const int n = tree_.dof[k];
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
  }

  const SkoStructure& tree_;
  FactoredInertia<S> factors_;
  std::vector<S> bias_, weighted_;
  S diagonal_[6];
  int hinge_rows_ = 0;
};

#define PYCRAFT_EXTERN(S) extern template class RigidFactors<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
