// Factors of A = X*X from X itself, so that A⁻¹ keeps the digits that the condition number of X leaves, not its square:
//
//   X = Q R,   A = R*R,   A⁻¹ = R⁻¹R⁻*,   ln det A = 2 Σ ln|R(j,j)|
//
// by Householder reflections, rows heaviest first (A. J. Cox and N. J. Higham, Stability of Householder QR factorization for weighted least
// squares problems, 1998). Scaling a column of X scales that of R. Cost 2 n r² for X of n rows and r columns.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "numerics/scalar.h"
#include "numerics/small_lu.h"

namespace pycraft {

template <class S>
class GramFactors {
 public:
  // Overwrites X (rows x columns, row-major). False where a column is, to rounding, one of the span of those before it: A is singular.
  bool factor(std::vector<S>& X, int rows, int columns) {
    using std::abs, std::sqrt;
    columns_ = columns;
    R_.assign(size_t(columns) * columns, S(0));
    determinant_ = {};
    if (rows < columns) return false;
    sort_rows(X, rows);
    for (int j = 0; j < columns; ++j) {
      S whole = S(0), below = S(0);
      for (int i = 0; i < j; ++i) {
        R_[size_t(i) * columns + j] = at(X, i, j);
        whole += at(X, i, j) * at(X, i, j);
      }
      for (int i = j; i < rows; ++i) below += at(X, i, j) * at(X, i, j);
      const S norm = sqrt(below), head = at(X, j, j);
      if (!(norm > S(16 * rows) * epsilon<S>() * S(sqrt(S(whole + below))))) return false;
      const S diagonal = head < S(0) ? norm : S(-norm);
      R_[size_t(j) * columns + j] = diagonal;
      determinant_.multiply(norm), determinant_.multiply(norm);
      at(X, j, j) = head - diagonal;
      const S beta = S(1) / (norm * abs(at(X, j, j)));  // 2 / v*v
      for (int c = j + 1; c < columns; ++c) {
        S sum = S(0);
        for (int i = j; i < rows; ++i) sum += at(X, i, j) * at(X, i, c);
        sum *= beta;
        for (int i = j; i < rows; ++i) at(X, i, c) -= sum * at(X, i, j);
      }
    }
    return true;
  }
  // x <- A⁻¹ x, m columns row-major.
  void solve(S* x, int m) const {
    const int n = columns_;
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < m; ++c) {
        for (int a = 0; a < i; ++a) x[i * m + c] -= R_[size_t(a) * n + i] * x[a * m + c];
        x[i * m + c] /= R_[size_t(i) * n + i];
      }
    for (int i = n - 1; i >= 0; --i)
      for (int c = 0; c < m; ++c) {
        for (int a = i + 1; a < n; ++a) x[i * m + c] -= R_[size_t(i) * n + a] * x[a * m + c];
        x[i * m + c] /= R_[size_t(i) * n + i];
      }
  }
  const Magnitude<S>& determinant() const { return determinant_; }  // of A

 private:
  S& at(std::vector<S>& X, int i, int j) const { return X[size_t(order_[i]) * columns_ + j]; }
  void sort_rows(const std::vector<S>& X, int rows) {
    using std::abs;
    order_.resize(rows);
    std::iota(order_.begin(), order_.end(), 0);
    std::vector<S> largest(rows, S(0)), column(columns_, S(0));
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns_; ++j) column[j] = maximum(column[j], S(abs(X[size_t(i) * columns_ + j])));
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns_; ++j)
        if (column[j] > S(0)) largest[i] = maximum(largest[i], S(abs(X[size_t(i) * columns_ + j]) / column[j]));
    std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) { return largest[a] > largest[b]; });
  }

  int columns_ = 0;
  std::vector<int> order_;
  std::vector<S> R_;
  Magnitude<S> determinant_;
};

}  // namespace pycraft
