// The Cholesky factorization of a dense symmetric matrix A (n x n, row-major), in place and without allocation, for any scalar:
// A = U* U, U upper triangular, first coordinate first; n³/3 operations.
//
// It refuses pivots that are noise, as the articulated-inertia sweep does (algebra/trees/sweeps/singular_pivot.h). Pivot k is w* A w,
// w = U₁⁻¹e_k (U₁: unit upper triangular), and the entries of A round at pivot_rounding sqrt(A(i,i) A(j,j)): its error is at most
//   pivot_rounding · (Σ |w(i)| sqrt(A(i,i)))².
// w(k) = 1, so a pivot below pivot_rounding A(k,k) stops the factorization. Others are compared with the whole bound, at one triangular solve
// each, only where they have lost half of their digits: noise as large as that takes |w| of eps^-1/4.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "numerics/decisions.h"
#include "runtime/interrupt.h"

namespace pycraft {

// A pivot that is noise: its coordinate, -1 for none.
template <class S>
struct PivotFailure {
  int coordinate = -1;
  S pivot = S(0), bound = S(0);
};
template <class S>
inline S pivot_rounding() {
  return S(8) * epsilon<S>();
}
template <class S>
inline bool in_doubt(const S& pivot, const S& entry) {
  using std::sqrt;
  return pivot < sqrt(epsilon<S>()) * entry;
}
template <class S>
inline S pivot_bound(const S& reach) {
  return pivot_rounding<S>() * reach * reach;
}

// The upper triangle of A becomes U. work: 2n numbers.
template <class S>
PivotFailure<S> cholesky_upper(S* A, int n, S* work) {
  using std::abs, std::sqrt;
  S *diagonal = work, *w = work + n;
  for (int i = 0; i < n; ++i) diagonal[i] = A[size_t(i) * n + i];
  for (int k = 0; k < n; ++k) {
    check_interrupt_at(k, n - k);
    S* row = A + size_t(k) * n;
    const S least = pivot_rounding<S>() * diagonal[k];
    if (!(row[k] > least)) return {k, row[k], least};
    const S root = sqrt(row[k]), inverse = S(1) / root;
    row[k] = root;
    for (int j = k + 1; j < n; ++j) row[j] *= inverse;
    for (int i = k + 1; i < n; ++i) {
      S* below = A + size_t(i) * n;
      const S factor = row[i];
      if (vanishes(factor)) continue;
      for (int j = i; j < n; ++j) below[j] -= factor * row[j];
    }
  }
  for (int k = 0; k < n; ++k) {
    const S root = A[size_t(k) * n + k], pivot = root * root;
    if (!in_doubt(pivot, diagonal[k])) continue;
    check_interrupt_at(k, k);
    S reach = sqrt(diagonal[k]);
    w[k] = S(1);
    for (int j = k - 1; j >= 0; --j) {  // U₁w = e_k
      const S* row = A + size_t(j) * n;
      S sum = S(0);
      for (int i = j + 1; i <= k; ++i) sum -= row[i] * w[i];
      w[j] = sum / row[j];
      reach += abs(w[j]) * sqrt(diagonal[j]);
    }
    if (const S bound = pivot_bound(reach); !(pivot > bound)) return {k, pivot, bound};
  }
  return {};
}

// x <- A⁻¹ x with U from cholesky_upper.
template <class S>
void cholesky_solve(const S* U, int n, S* x) {
  for (int k = 0; k < n; ++k) {
    const S* row = U + size_t(k) * n;
    x[k] /= row[k];
    const S xk = x[k];
    for (int j = k + 1; j < n; ++j) x[j] -= xk * row[j];
  }
  for (int k = n - 1; k >= 0; --k) {
    const S* row = U + size_t(k) * n;
    S sum = x[k];
    for (int j = k + 1; j < n; ++j) sum -= row[j] * x[j];
    x[k] = sum / row[k];
  }
}

}  // namespace pycraft
