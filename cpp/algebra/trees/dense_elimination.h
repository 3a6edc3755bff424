// dense_blocks.h: articulated inertias through a hinge, plain and by factors, and whether pivots are more than rounding.
#pragma once

#include <algorithm>

#include "numerics/decisions.h"

namespace pycraft {

// D, G, P⁺ of body k. Always in doubt: blocks of any size have no cheap bound on their rounding.
template <class S>
inline Pivots DenseBlocks<S>::eliminate_hinge(int k) {
  if (form != Form::fast) return eliminate_hinge_of_factors(k);
  const int s = tree_.size[k], n = tree_.dof[k];
  const S* h = hinge_map(k);
  S *p = P.data() + at_[k].m, *plus = Pplus.data() + at_[k].m, *d = D.data() + at_[k].d, *l = L.data() + at_[k].d, *g = G.data() + at_[k].h;
  std::copy_n(p, s * s, plus);
  if (n == 0) return Pivots::sound;
  std::fill_n(g, n * s, S(0));
  multiply_add(h, p, g, n, s, s);  // HP, n x s
  std::copy_n(hinge_diagonal(k), n * n, d);
  multiply_transposed_add(g, h, d, n, s, n);
  symmetrise(d, n);
  std::copy_n(d, n * n, l);
  S* pivots = pivots_.data() + tree_.dof_offset[k];
  if (ldl_in_place(l, n, pivots) < n) return Pivots::not_positive;
  forward_substitute(l, n, g, s);              // L⁻¹HP
  add_squares(g, pivots, plus, n, s, S(-1));   // P - (L⁻¹HP)* d⁻¹ (L⁻¹HP)
  divide_by_pivots(pivots, n, g, s);
  back_substitute(l, n, g, s);                 // G* = D⁻¹HP
  return Pivots::doubtful;
}

template <class S>
inline Pivots DenseBlocks<S>::eliminate_hinge_of_factors(int k) {
  const int s = tree_.size[k], n = tree_.dof[k], m = factors_->columns(k);
  S *p = P.data() + at_[k].m, *plus = Pplus.data() + at_[k].m, *d = D.data() + at_[k].d, *l = L.data() + at_[k].d, *g = G.data() + at_[k].h;
  S* pivots = pivots_.data() + tree_.dof_offset[k];
  for (int i = 0; i < s; ++i)
    for (int j = 0; j <= i; ++j) p[i * s + j] = p[j * s + i] = factors_->inertia(k, i, j);
  for (int j = 0; j < n; ++j) {
    S* row = factors_->hinge_row(k, j);
    std::fill_n(row, m, S(0));
    for (int i = 0; i < s; ++i) {
      const S *body = factors_->body_row(k, i), h = hinge_map(k)[j * s + i];
      if (!vanishes(h))
        for (int c = 0; c < m; ++c) row[c] += h * body[c];
    }
  }
  add_factors("J", k, hinge_diagonal(k), n, [&](const S& w, auto u) { factors_->add_rotor(k, w, u); });
  none_.assign(s, 0);
  factors_->fill_up(k);
  factors_->eliminate(k, form, none_.data(), false);
  for (int j = 0; j < n; ++j) {
    pivots[j] = factors_->weight(j) * factors_->lower(j, j) * factors_->lower(j, j);
    for (int i = 0; i < n; ++i) l[i * n + j] = i < j ? S(0) : ratio_or_zero(factors_->lower(i, j), factors_->lower(j, j));
  }
  if (std::any_of(pivots, pivots + n, [](const S& pivot) { return !(pivot > S(0)); })) return Pivots::not_positive;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      S sum = S(0);
      for (int a = 0; a <= j; ++a) sum += l[i * n + a] * pivots[a] * l[j * n + a];
      d[i * n + j] = d[j * n + i] = sum;
    }
  for (int j = n - 1; j >= 0; --j)  // G* = L₁⁻* L₂*
    for (int i = 0; i < s; ++i) {
      S sum = factors_->against(i, j);
      for (int a = j + 1; a < n; ++a) sum -= factors_->lower(a, j) * g[a * s + i];
      g[j * s + i] = sum / factors_->lower(j, j);
    }
  for (int i = 0; i < s; ++i)
    for (int j = 0; j <= i; ++j) {
      S sum = S(0);
      for (int r = n; r < factors_->pivots(); ++r) sum += factors_->U(i, r) * factors_->weight(r) * factors_->U(j, r);
      plus[i * s + j] = plus[j * s + i] = sum;
    }
  return n > 0 ? Pivots::doubtful : Pivots::sound;
}

// add(w, u) for the factors of M(k) or J(k); whether they leave out what may be rounding.
template <class S>
template <class Add>
inline bool DenseBlocks<S>::add_factors(const char* letter, int k, const S* A, int n, Add&& add) {
  factor_work_.resize(std::max(factor_work_.size(), size_t(2 * n + 1) * n));
  S *U = factor_work_.data(), *w = U + n * n;
  if (!semidefinite_factors(A, n, S(S(8 * n) * epsilon<S>()), U, w, w + n))
    throw EvaluationError(std::string(letter) + " of body '" + tree_.body_names[k] +
                          "' is not positive semidefinite, so it has no factors: form=\"fast\" needs none");
  for (int r = 0; r < n; ++r)
    if (!(w[r] == S(0))) add(w[r], [u = U + r * n](int i) { return u[i]; });
  return std::any_of(w + n, w + n + n * n, [](const S& x) { return !(x == S(0)); });
}

template <class S>
inline void DenseBlocks<S>::start_error(int k) {
  const int s = tree_.size[k];
  S* x = X.data() + at_[k].m;
  std::fill_n(x, s * s, S(0));
  // What factors of M(k) took for rounding, in units of the bound.
  const S left = form != Form::fast && uncertain_[k] ? S(S(8 * s) * epsilon<S>() / rounding_bound<S>(form)) : S(0);
  for (int i = 0; i < s; ++i) x[i * s + i] = P[at_[k].m + i * s + i] + left * mass(k)[i * s + i];
}

template <class S>
inline void DenseBlocks<S>::check_pivots(int k) {
  const int s = tree_.size[k], n = tree_.dof[k];
  S* x = work_.data();
  for (int j = 0; j < n; ++j) {
    x[j] = hinge_diagonal(k)[j * n + j];
    for (int a = 0; a < s; ++a)
      for (int b = 0; b < s; ++b) x[j] += hinge_map(k)[j * s + a] * X[at_[k].m + a * s + b] * hinge_map(k)[j * s + b];
  }
  require_pivots(tree_, k, L.data() + at_[k].d, pivots_.data() + tree_.dof_offset[k], x, form);
  for (int j = 0; j < n; ++j) {
    x[j] = hinge_diagonal(k)[j * n + j];
    for (int a = 0; a < s; ++a) x[j] += hinge_map(k)[j * s + a] * hinge_map(k)[j * s + a] * P[at_[k].m + a * s + a];
  }
  require_gain(tree_, k, L.data() + at_[k].d, pivots_.data() + tree_.dof_offset[k], x, form);
}

// X⁺(k)
template <class S>
inline const S* DenseBlocks<S>::error_left(int k) {
  const int s = tree_.size[k];
  S *bar = error_work_.data(), *t = bar + s * s, *plus = t + s * s;
  std::fill_n(bar, 3 * s * s, S(0));
  for (int i = 0; i < s; ++i) bar[i * s + i] = S(1), plus[i * s + i] = P[at_[k].m + i * s + i];
  transposed_multiply_add(gain(k), hinge_map(k), bar, s, tree_.dof[k], s, S(-1));
  multiply_add(bar, X.data() + at_[k].m, t, s, s, s);
  multiply_transposed_add(t, bar, plus, s, s, s);
  for (int j = 0; j < tree_.dof[k]; ++j) {
    const S *h = hinge_map(k) + j * s, *g = gain(k) + j * s;
    S square = hinge_diagonal(k)[j * tree_.dof[k] + j];
    for (int a = 0; a < s; ++a) square += h[a] * h[a] * P[at_[k].m + a * s + a];
    for (int a = 0; a < s; ++a)
      for (int b = 0; b < s; ++b) plus[a * s + b] += square * g[a] * g[b];
  }
  return plus;
}

}  // namespace pycraft
