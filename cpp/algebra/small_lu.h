// LU with row scaling and partial pivoting, in place, any scalar, no allocation after the first use. The pivot blocks of the tree
// elimination are of the size of a body's states (10 to 60): too small for a blocked method. (Eigen's decomposition allocates its
// permutation anew and has no test for pivots that are noise.)
#pragma once

#include <cmath>
#include <vector>

#include "spatial/scalar.h"

namespace pycraft {

template <class S>
class SmallLU {
 public:
  // Factors the n x n row-major matrix A in place; it must stay where it is. magnitude[j]: the largest number that went into column j
  // of the scaled rows, so that a pivot below 4 n eps of it is noise. False if the matrix counts as singular.
  bool factor(S* A, int n, const S* row_magnitude) {
    using std::abs;
    A_ = A;
    n_ = n;
    rows_.resize(n);
    scale_.resize(n);
    column_.assign(n, S(0));
    sign_ = 1;
    log_abs_det_ = S(0);
    for (int i = 0; i < n; ++i) {
      rows_[i] = i;
      S largest = row_magnitude[i];
      for (int j = 0; j < n; ++j) largest = std::max(largest, S(abs(A[i * n + j])));
      if (!(largest > S(0))) return false;
      scale_[i] = S(1) / largest;
      for (int j = 0; j < n; ++j) column_[j] = std::max(column_[j], S(abs(A[i * n + j]) * scale_[i]));
    }
    for (int k = 0; k < n; ++k) {
      int best = k;
      S largest = S(-1);
      for (int i = k; i < n; ++i) {
        const S candidate = abs(A[rows_[i] * n + k]) * scale_[rows_[i]];
        if (candidate > largest) largest = candidate, best = i;
      }
      if (!(largest > S(4 * n) * epsilon<S>() * column_[k])) return false;
      if (best != k) {
        std::swap(rows_[k], rows_[best]);
        sign_ = -sign_;
      }
      const S* pivot_row = A + rows_[k] * n;
      using std::log;
      log_abs_det_ += log(S(abs(pivot_row[k])));
      if (pivot_row[k] < S(0)) sign_ = -sign_;
      const S inverse = S(1) / pivot_row[k];
      for (int i = k + 1; i < n; ++i) {
        S* row = A + rows_[i] * n;
        if (row[k] == S(0)) continue;
        const S l = row[k] *= inverse;
        for (int j = k + 1; j < n; ++j) row[j] -= l * pivot_row[j];
      }
    }
    return true;
  }

  // x <- A⁻¹ x, m columns row-major; work: n * m.
  void solve(S* x, int m, S* work) const {
    for (int i = 0; i < n_; ++i) {
      S* w = work + i * m;
      std::copy_n(x + rows_[i] * m, m, w);
      const S* row = A_ + rows_[i] * n_;
      for (int k = 0; k < i; ++k)
        if (!(row[k] == S(0)))
          for (int c = 0; c < m; ++c) w[c] -= row[k] * work[k * m + c];
    }
    for (int i = n_ - 1; i >= 0; --i) {
      const S* row = A_ + rows_[i] * n_;
      S* xi = x + i * m;
      std::copy_n(work + i * m, m, xi);
      for (int k = i + 1; k < n_; ++k)
        if (!(row[k] == S(0)))
          for (int c = 0; c < m; ++c) xi[c] -= row[k] * x[k * m + c];
      for (int c = 0; c < m; ++c) xi[c] /= row[i];
    }
  }

  S log_abs_determinant() const { return log_abs_det_; }

 private:
  S* A_ = nullptr;
  int n_ = 0, sign_ = 1;
  std::vector<int> rows_;
  std::vector<S> scale_, column_;
  S log_abs_det_ = S(0);
};

}  // namespace pycraft
