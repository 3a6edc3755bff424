// Factors of small symmetric matrices in place, for any scalar and without allocation: A = L D L*, L unit lower triangular, row-major,
// D its pivots. D(k) of a hinge is 1x1 to 6x6. No square root is taken: where units change A by powers of two, L and D change by powers
// of two, and no bit of what is solved with them. (Eigen's decompositions cost seconds of compile time per scalar and size, and allocate.)
#pragma once

namespace pycraft {

// Overwrites the lower triangle of A (n x n), below the diagonal, with L; pivots: n numbers. Stops at the first pivot that is not positive
// and returns its index, else n.
template <class S>
inline int ldl_in_place(S* A, int n, S* pivots) {
  for (int i = 0; i < n; ++i) {
    S* row = A + i * n;
    for (int j = 0; j < i; ++j)  // L(i,j) D(j)
      for (int k = 0; k < j; ++k) row[j] -= row[k] * A[j * n + k];
    S pivot = row[i];
    for (int j = 0; j < i; ++j) {
      const S scaled = row[j];
      row[j] = scaled / pivots[j];
      pivot -= scaled * row[j];
    }
    pivots[i] = pivot;
    if (!(pivot > S(0))) return i;
    row[i] = S(1);
  }
  return n;
}

// x <- L⁻¹ x for m columns (row-major).
template <class S>
inline void forward_substitute(const S* L, int n, S* x, int m) {
  for (int i = 1; i < n; ++i)
    for (int k = 0; k < i; ++k)
      for (int c = 0; c < m; ++c) x[i * m + c] -= L[i * n + k] * x[k * m + c];
}

// x <- L⁻* x.
template <class S>
inline void back_substitute(const S* L, int n, S* x, int m) {
  for (int i = n - 2; i >= 0; --i)
    for (int k = i + 1; k < n; ++k)
      for (int c = 0; c < m; ++c) x[i * m + c] -= L[k * n + i] * x[k * m + c];
}

// x <- D⁻¹ x.
template <class S>
inline void divide_by_pivots(const S* pivots, int n, S* x, int m) {
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < m; ++c) x[i * m + c] /= pivots[i];
}

// x <- A⁻¹ x.
template <class S>
inline void ldl_solve(const S* L, const S* pivots, int n, S* x, int m) {
  forward_substitute(L, n, x, m);
  divide_by_pivots(pivots, n, x, m);
  back_substitute(L, n, x, m);
}

}  // namespace pycraft
