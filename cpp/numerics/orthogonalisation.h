// Rows that are made orthogonal one after the other, A = L Q with L lower triangular:
//
//   weighted Gram-Schmidt, Q W Q* = diag d, L with a unit diagonal: no square roots, no pivots
//   Householder reflections, Q Q* = 1
//
// Sources: C. L. Thornton, Triangular Covariance Factorizations for Kalman Filtering, 1976; A. J. Cox and N. J. Higham, Stability of
// Householder QR factorization for weighted least squares problems, 1998 (order of the rows).
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "numerics/decisions.h"

namespace pycraft {

// Σ x y in four sums, of entries 0, 4, 8, ..., of 1, 5, 9, ..., and so on: in any scalar, however many are taken at a time.
template <class S>
inline S dot_product(const S* x, const S* y, int n) {
  S a = S(0), b = S(0), c = S(0), d = S(0);
  int i = 0;
  for (; i + 4 <= n; i += 4) {
    a += x[i] * y[i];
    b += x[i + 1] * y[i + 1];
    c += x[i + 2] * y[i + 2];
    d += x[i + 3] * y[i + 3];
  }
  if (i < n) a += x[i] * y[i];
  if (i + 1 < n) b += x[i + 1] * y[i + 1];
  if (i + 2 < n) c += x[i + 2] * y[i + 2];
  return (a + b) + (c + d);
}

// How many columns are taken at a time: rows of machine numbers are filled up with zeros to whole fours.
template <class S>
inline constexpr int columns_at_once = std::is_same_v<S, double> || std::is_same_v<S, Single> ? 4 : 1;
template <class S>
inline constexpr int filled(int columns) {
  return (columns + columns_at_once<S> - 1) / columns_at_once<S> * columns_at_once<S>;
}
// f(c) for columns 0, ..., m - 1, in whole fours.
template <class S, class F>
inline void for_columns(int m, F f) {
  for (int c = 0; c < m; c += columns_at_once<S>)
    for (int i = c; i < c + columns_at_once<S>; ++i) f(i);
}
// Σ x y over rows that are filled up.
template <class S>
inline S product_of_rows(const S* x, const S* y, int m) {
  if constexpr (columns_at_once<S> == 1) return dot_product(x, y, m);
  S a = S(0), b = S(0), c = S(0), d = S(0);
  for (int i = 0; i < m; i += 4) {
    a += x[i] * y[i];
    b += x[i + 1] * y[i + 1];
    c += x[i + 2] * y[i + 2];
    d += x[i + 3] * y[i + 3];
  }
  return (a + b) + (c + d);
}

// Rows A (given by their numbers) of m columns, filled up: the first `pivots` are made orthogonal in the weights w, the others relieved of
// them. L: rows x pivots, unit lower; d: their weighted squares. A row of weight zero takes nothing from the others.
template <class S>
[[gnu::always_inline]] inline void orthogonalise(S* __restrict A, int stride, const int* rows, int count, int pivots, int m, const S* __restrict w,
                                                 S* __restrict weighted, S* __restrict L, S* __restrict d) {
  for (int r = 0; r < pivots; ++r) {
    const S* __restrict a = A + rows[r] * stride;
    for_columns<S>(m, [&](int c) { weighted[c] = w[c] * a[c]; });
    const S square = product_of_rows(weighted, a, m);
    d[r] = square;
    for (int s = 0; s < r; ++s) L[s * pivots + r] = S(0);
    L[r * pivots + r] = S(1);
    for (int s = r + 1; s < count; ++s) {
      S* __restrict b = A + rows[s] * stride;
      const S f = ratio_or_zero(product_of_rows(weighted, b, m), square);
      L[s * pivots + r] = f;
      for_columns<S>(m, [&](int c) { b[c] -= f * a[c]; });
    }
  }
}

// Four doubles at a time where the processor can; the same bits.
#if defined(__x86_64__) && defined(__GNUC__)
template <class S>
[[gnu::target("avx2")]] void orthogonalise_by_fours(S* A, int stride, const int* rows, int count, int pivots, int m, const S* w, S* weighted, S* L, S* d) {
  orthogonalise(A, stride, rows, count, pivots, m, w, weighted, L, d);
}
inline bool has_fours() {
  static const bool has = __builtin_cpu_supports("avx2");
  return has;
}
#endif

template <class S>
inline void weighted_gram_schmidt(S* A, int stride, const int* rows, int count, int pivots, int m, const S* w, S* weighted, S* L, S* d) {
#if defined(__x86_64__) && defined(__GNUC__)
  if constexpr (columns_at_once<S> > 1)
    if (has_fours()) return orthogonalise_by_fours(A, stride, rows, count, pivots, m, w, weighted, L, d);
#endif
  orthogonalise(A, stride, rows, count, pivots, m, w, weighted, L, d);
}

// The same with weights that are in the columns already, by reflections: A = L Q, Q* Q = 1.
template <class S>
inline void householder_lower(S* A, int stride, const int* rows, int count, int pivots, int m, S* L) {
  using std::sqrt;
  std::fill_n(L, count * pivots, S(0));
  for (int r = 0; r < std::min(pivots, m); ++r) {
    S* v = A + rows[r] * stride;
    const S square = dot_product(v + r, v + r, m - r), norm = sqrt(square), head = v[r];
    if (square > S(0)) {
      v[r] = where_less(head, S(0), S(head - norm), S(head + norm));
      const S beta = S(2) / dot_product(v + r, v + r, m - r);
      for (int s = r + 1; s < count; ++s) {
        S* b = A + rows[s] * stride;
        const S f = beta * dot_product(v + r, b + r, m - r);
        for (int c = r; c < m; ++c) b[c] -= f * v[c];
      }
    }
    L[r * pivots + r] = where_less(head, S(0), norm, S(-norm));
    for (int s = r + 1; s < count; ++s) L[s * pivots + r] = A[rows[s] * stride + r];
  }
}

}  // namespace pycraft
