// Factors of a positive semidefinite matrix, of whatever rank.
#pragma once

#include <algorithm>
#include <cmath>

#include "numerics/scalar.h"

namespace pycraft {

// A = Σ w u u* of a positive semidefinite matrix (n x n), the largest diagonal entry first: u (n columns, as rows of U), w. A diagonal entry
// that has cancelled to `rounding` of its own first value is zero: the numbers given say no more. False where what is left then is
// not zero to the digits of a double, which is where A has a negative eigenvalue.
template <class S>
inline bool semidefinite_factors(const S* given, int n, const S& rounding, S* U, S* w, S* A) {
  using std::abs, std::sqrt;
  const S given_rounding = maximum(rounding, S(S(8 * n) * S(epsilon<double>())));
  std::copy_n(given, n * n, A);
  std::fill_n(w, n, S(0));
  std::fill_n(U, n * n, S(0));
  for (int r = 0; r < n; ++r) {
    int pivot = -1;
    for (int i = 0; i < n; ++i)
      if (A[i * n + i] > rounding * given[i * n + i] && (pivot < 0 || A[i * n + i] > A[pivot * n + pivot])) pivot = i;
    if (pivot < 0) break;
    w[r] = A[pivot * n + pivot];
    S* u = U + r * n;
    for (int i = 0; i < n; ++i) u[i] = A[i * n + pivot] / w[r];
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) A[i * n + j] -= w[r] * u[i] * u[j];
    for (int i = 0; i < n; ++i) A[i * n + pivot] = A[pivot * n + i] = S(0);
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      if (!(abs(A[i * n + j]) <= given_rounding * sqrt(given[i * n + i]) * sqrt(given[j * n + j]))) return false;
  return true;
}

}  // namespace pycraft
