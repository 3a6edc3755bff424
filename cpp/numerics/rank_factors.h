// Factors of a matrix of whatever rank, A Π = Q R by Householder reflections, and what they solve. Without allocation where the memory has been
// used before. Sources: G. Golub, C. Van Loan, Matrix Computations, 2013 (5.4: column pivoting; complete orthogonal decomposition; 5.5.7: minimum
// norm).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "numerics/scalar.h"

namespace pycraft {

// A (rows x columns), column by column: it becomes the reflections, under the diagonal, and R over it.
template <class S>
struct Reflections {
  int rows = 0, columns = 0, rank = 0;
  std::vector<S> A, diagonal, beta;
  std::vector<int> order;            // Π: which column of A stands at each place of R

  void resize(int n, int m) {
    rows = n, columns = m;
    A.assign(size_t(n) * m, S(0));
  }
  // Pivoting: the column of which most is left comes next, until none has more than `tolerance` left: the rank.
  void factor(bool pivoting, const S& tolerance) {
    using std::sqrt;
    order.resize(columns), diagonal.assign(columns, S(0)), beta.assign(columns, S(0));
    for (int j = 0; j < columns; ++j) order[j] = j;
    for (rank = 0; rank < std::min(rows, columns); ++rank) {
      const int k = rank;
      int best = k;
      S most = square(k, k);
      for (int j = k + 1; j < columns && pivoting; ++j)
        if (const S other = square(j, k); other > most) best = j, most = other;
      if (pivoting && !(sqrt(most) > tolerance)) return;
      if (best != k) {
        std::swap_ranges(column(k), column(k) + rows, column(best));
        std::swap(order[k], order[best]);
      }
      S* const v = column(k);
      const S length = sqrt(most);
      diagonal[k] = v[k] > S(0) ? S(-length) : length;
      v[k] -= diagonal[k];
      const S size = square(k, k);
      beta[k] = size > S(0) ? S(S(2) / size) : S(0);
      for (int j = k + 1; j < columns; ++j) reflect(k, column(j));
    }
  }
  void to_q(S* x) const {            // x <- Q* x
    for (int k = 0; k < rank; ++k) reflect(k, x);
  }
  void from_q(S* x) const {          // x <- Q x
    for (int k = rank - 1; k >= 0; --k) reflect(k, x);
  }
  // x <- R₁₁⁻¹ x, x <- R₁₁⁻* x: of the first `rank` columns.
  void solve(S* x) const {
    for (int i = rank - 1; i >= 0; --i) {
      for (int j = i + 1; j < rank; ++j) x[i] -= A[size_t(j) * rows + i] * x[j];
      x[i] /= diagonal[i];
    }
  }
  void solve_transposed(S* x) const {
    for (int i = 0; i < rank; ++i) {
      for (int j = 0; j < i; ++j) x[i] -= A[size_t(i) * rows + j] * x[j];
      x[i] /= diagonal[i];
    }
  }
  S* column(int j) { return A.data() + size_t(j) * rows; }
  // R, i <= j
  S upper(int i, int j) const { return i == j ? diagonal[i] : A[size_t(j) * rows + i]; }

 private:
  S square(int j, int from) const {
    S sum = S(0);
    for (int i = from; i < rows; ++i) sum += A[size_t(j) * rows + i] * A[size_t(j) * rows + i];
    return sum;
  }
  void reflect(int k, S* x) const {
    const S* const v = A.data() + size_t(k) * rows;
    S along = S(0);
    for (int i = k; i < rows; ++i) along += v[i] * x[i];
    along *= beta[k];
    for (int i = k; i < rows; ++i) x[i] -= along * v[i];
  }
};

// W*W λ = b with W = V diag(unit), V (n x m) given column by column: λ of the least 2-norm where W has dependent columns.
//
//   V Π = Q R,   R* y = b/unit in the sense of least squares, by R* = Z T:  y = T⁻¹ Z* (b/unit)      what is left is the conflict in b
//   R Π* diag(unit) λ = y of the least norm, by (R Π* diag(unit))* = Z' T':  λ = Z' T'⁻* y
//
// No product W*W is formed, whose rounding would take half of the digits of a small singular value. Cost n m².
template <class S>
class MinimumNormSystem {
 public:
  // The columns are to be written here, then factor() of the first `count` of them.
  S* columns(int n, int m) {
    V_.resize(n, m);
    return V_.A.data();
  }
  int rank() const { return V_.rank; }
  void factor(int count, const S* unit, const S& tolerance) {
    const int m = V_.columns = count;
    unit_.assign(unit, unit + m);
    V_.factor(true, tolerance);
    if (V_.rank == m) return;
    Z_.resize(m, V_.rank), scaled_.resize(m, V_.rank);
    for (int j = 0; j < V_.rank; ++j)
      for (int i = j; i < m; ++i) {
        Z_.column(j)[i] = V_.upper(j, i);
        scaled_.column(j)[i] = unit_[V_.order[i]] * V_.upper(j, i);
      }
    Z_.factor(false, S(0)), scaled_.factor(false, S(0));
  }
  // conflict (m): what of b/unit no λ can meet.
  void solve(const S* b, S* lambda, S* conflict) {
    const int m = V_.columns, r = V_.rank;
    x_.resize(m), y_.assign(m, S(0));
    std::fill_n(conflict, m, S(0));
    for (int i = 0; i < m; ++i) x_[i] = b[V_.order[i]] / unit_[V_.order[i]];
    if (r == m) {
      V_.solve_transposed(x_.data()), V_.solve(x_.data());
      for (int i = 0; i < m; ++i) lambda[V_.order[i]] = x_[i] / unit_[V_.order[i]];
      return;
    }
    Z_.to_q(x_.data());
    std::copy_n(x_.data(), r, y_.data());
    std::fill_n(x_.data(), r, S(0));
    Z_.from_q(x_.data());
    for (int i = 0; i < m; ++i) conflict[V_.order[i]] = x_[i];
    Z_.solve(y_.data()), scaled_.solve_transposed(y_.data()), scaled_.from_q(y_.data());
    for (int i = 0; i < m; ++i) lambda[V_.order[i]] = y_[i];
  }

 private:
  Reflections<S> V_, Z_, scaled_;
  std::vector<S> unit_, x_, y_;
};

}  // namespace pycraft
