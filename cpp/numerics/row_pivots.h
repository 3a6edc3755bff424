// LU with partial pivoting of a dense matrix whose rows have units: pivots are the largest of their column beside the sizes of their rows, which
// are given. In place, any scalar, no allocation after the first use.
//
// Rows in an order in which complete pivoting took them, and columns in that of their pivots, stay where they are at the state of that order, and
// entries do not grow there. (SmallLU prefers equations that are matched, or a state's own, as long as they are a tenth of the largest: over the
// two hundred rows of a ladder that is a growth without bound.)
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "numerics/decisions.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class S>
class RowPivotLU {
 public:
  // Factors the n x n row-major matrix A in place; it must stay where it is. False where a pivot is the rounding of its column.
  bool factor(S* A, int n, const S* row_sizes) {
    using std::abs;
    A_ = A, n_ = n;
    rows_.resize(n), column_.assign(n, S(0)), work_.resize(n);
    std::iota(rows_.begin(), rows_.end(), 0);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) column_[j] = maximum(column_[j], S(abs(A[size_t(i) * n + j]) / row_sizes[i]));
    for (int k = 0; k < n; ++k) {
      check_interrupt_at(k, n);
      int best = k;
      S largest = S(-1);
      for (int i = k; i < n; ++i)
        if (const S size = abs(at(i, k)) / row_sizes[rows_[i]]; size > largest) largest = size, best = i;
      if (!(largest > S(4 * n) * epsilon<S>() * column_[k])) return false;
      std::swap(rows_[k], rows_[best]);
      const S* pivot_row = A + size_t(rows_[k]) * n;
      const S inverse = S(1) / pivot_row[k];
      for (int i = k + 1; i < n; ++i) {
        S* row = A + size_t(rows_[i]) * n;
        if (vanishes(row[k])) continue;
        const S l = row[k] *= inverse;
        for (int j = k + 1; j < n; ++j) row[j] -= l * pivot_row[j];
      }
    }
    return true;
  }
  // x <- A⁻¹ x, m columns row-major; work: n * m.
  void solve(S* x, int m, S* work) const {
    for (int i = 0; i < n_; ++i) {
      check_interrupt_at(i, n_);
      S* w = work + size_t(i) * m;
      std::copy_n(x + size_t(rows_[i]) * m, m, w);
      subtract(i, 0, i, work, w, m);
    }
    for (int i = n_ - 1; i >= 0; --i) {
      check_interrupt_at(i, n_);
      S* xi = x + size_t(i) * m;
      std::copy_n(work + size_t(i) * m, m, xi);
      subtract(i, i + 1, n_, x, xi, m);
      for (int c = 0; c < m; ++c) xi[c] /= at(i, i);
    }
  }
  // x <- A⁻* x: U* first, then L*.
  void solve_transposed(S* x) {
    for (int k = 0; k < n_; ++k) {
      work_[k] = x[k];
      for (int i = 0; i < k; ++i) work_[k] -= at(i, k) * work_[i];
      work_[k] /= at(k, k);
    }
    for (int k = n_ - 1; k >= 0; --k) {
      for (int i = k + 1; i < n_; ++i) work_[k] -= at(i, k) * work_[i];
      x[rows_[k]] = work_[k];
    }
  }

 private:
  const S& at(int i, int j) const { return A_[size_t(rows_[i]) * n_ + j]; }
  // w -= Σ_k a(i,k) from(k), k from `first` to `end` - 1.
  void subtract(int i, int first, int end, const S* from, S* w, int m) const {
    for (int k = first; k < end; ++k)
      if (const S& a = at(i, k); !vanishes(a))
        for (int c = 0; c < m; ++c) w[c] -= a * from[size_t(k) * m + c];
  }

  S* A_ = nullptr;
  int n_ = 0;
  std::vector<int> rows_;
  std::vector<S> column_, work_;
};

}  // namespace pycraft
