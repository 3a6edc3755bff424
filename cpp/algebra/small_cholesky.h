// Cholesky factors of small symmetric matrices in place, for any scalar and without allocation: D(k) is 1x1 to 6x6.
// Row-major lower triangle, A = L L*. (Eigen's decompositions cost seconds of compile time per scalar and size, and allocate.)
#pragma once

#include <cmath>

namespace pycraft {

// Overwrites the lower triangle of A (n x n) with L. pivots[i] receives the square of L(i,i); stops at the first that is not
// positive and returns its index, else n.
template <class S>
inline int cholesky_in_place(S* A, int n, S* pivots) {
  using std::sqrt;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) {
      S sum = A[i * n + j];
      for (int k = 0; k < j; ++k) sum -= A[i * n + k] * A[j * n + k];
      A[i * n + j] = sum / A[j * n + j];
    }
    S pivot = A[i * n + i];
    for (int k = 0; k < i; ++k) pivot -= A[i * n + k] * A[i * n + k];
    pivots[i] = pivot;
    if (!(pivot > S(0))) return i;
    A[i * n + i] = sqrt(pivot);
  }
  return n;
}

// x <- L⁻¹ x for m columns (row-major).
template <class S>
inline void forward_substitute(const S* L, int n, S* x, int m) {
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < i; ++k)
      for (int c = 0; c < m; ++c) x[i * m + c] -= L[i * n + k] * x[k * m + c];
    for (int c = 0; c < m; ++c) x[i * m + c] /= L[i * n + i];
  }
}

// x <- L⁻* x.
template <class S>
inline void back_substitute(const S* L, int n, S* x, int m) {
  for (int i = n - 1; i >= 0; --i) {
    for (int k = i + 1; k < n; ++k)
      for (int c = 0; c < m; ++c) x[i * m + c] -= L[k * n + i] * x[k * m + c];
    for (int c = 0; c < m; ++c) x[i * m + c] /= L[i * n + i];
  }
}

}  // namespace pycraft
