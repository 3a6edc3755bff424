// Factors of a matrix of whatever rank, A Π = Q R by Householder reflections, and what they solve. Without allocation where the memory has been
// used before. Sources: G. Golub, C. Van Loan, Matrix Computations, 2013 (5.4: column pivoting; complete orthogonal decomposition; 5.5.7: minimum
// norm).
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "numerics/decisions.h"
#include "numerics/scalar.h"
#include "numerics/weighted_gram_schmidt.h"

namespace pycraft {

// A (rows x columns), column by column, of each the rows from `top` to `bottom`: it becomes the reflections, under the diagonal, and R over it.
template <class S>
struct Reflections {
  int rows = 0, columns = 0, rank = 0;
  std::vector<S> A, diagonal, beta;
  std::vector<int> order;            // Π: which column of A stands at each place of R
  std::vector<int> top, bottom;
  std::vector<size_t> start;

  void resize(int n, int m) {
    top.assign(m, 0), bottom.assign(m, n);
    reserve(n);
  }
  // Tops and bottoms that grow from column to column are given.
  void reserve(int n) {
    rows = n, columns = static_cast<int>(top.size());
    start.resize(columns);
    size_t size = 0;
    for (int j = 0; j < columns; size += bottom[j] - top[j], ++j) start[j] = size;
    A.assign(size, S(0));
    order.resize(columns);
    for (int j = 0; j < columns; ++j) order[j] = j;
  }
  S& at(int i, int j) { return A[start[j] + (i - top[j])]; }
  const S& at(int i, int j) const { return A[start[j] + (i - top[j])]; }

  // Pivoting: the column of which most is left comes next. Without it the order may be tried, and a recording has no guard of it. Ends where none has more than `tolerance` left, or the next one has not: at the rank.
  void factor(bool pivoting, const S& tolerance) {
    using std::sqrt;
    diagonal.assign(columns, S(0)), beta.assign(columns, S(0));
    for (rank = 0; rank < std::min(rows, columns) && rank < bottom[rank]; ++rank) {
      const int k = rank;
      int best = k;
      S most = square(k, k);
      for (int j = k + 1; j < columns && pivoting; ++j)
        if (const S other = square(j, k); soft(other) > soft(most)) best = j, most = other;
      const S length = sqrt(most);
      if (pivoting ? !(length > tolerance) : !(soft(length) > soft(tolerance))) return;
      if (best != k) {
        std::swap_ranges(&at(top[k], k), &at(top[k], k) + rows, &at(top[best], best));
        std::swap(order[k], order[best]);
      }
      diagonal[k] = where_less(S(0), at(k, k), S(-length), length);
      at(k, k) -= diagonal[k];
      const S size = square(k, k);
      beta[k] = size > S(0) ? S(S(2) / size) : S(0);
      for (int j = k + 1; j < columns && top[j] <= k; ++j) reflect(k, &at(k, j));
    }
  }
  void to_q(S* x) const {            // x <- Q* x
    for (int k = 0; k < rank; ++k) reflect(k, x + k);
  }
  void from_q(S* x) const {          // x <- Q x
    for (int k = rank - 1; k >= 0; --k) reflect(k, x + k);
  }
  // x <- R₁₁⁻¹ x, x <- R₁₁⁻* x: of the first `rank` columns.
  void solve(S* x) const {
    for (int j = rank - 1; j >= 0; --j) {
      x[j] /= diagonal[j];
      for (int i = top[j]; i < j; ++i) x[i] -= at(i, j) * x[j];
    }
  }
  void solve_transposed(S* x) const {
    for (int j = 0; j < rank; ++j) {
      for (int i = top[j]; i < j; ++i) x[j] -= at(i, j) * x[i];
      x[j] /= diagonal[j];
    }
  }
  // R, i <= j
  S upper(int i, int j) const { return i == j ? diagonal[i] : at(i, j); }

 private:
  S square(int j, int from) const {
    S sum = S(0);
    for (int i = from; i < bottom[j]; ++i) sum += at(i, j) * at(i, j);
    return sum;
  }
  void reflect(int k, S* x) const {  // x from row k on
    const S* const v = &at(k, k);
    const int n = bottom[k] - k;
    S along = S(0);
    for (int i = 0; i < n; ++i) along += v[i] * x[i];
    along *= beta[k];
    for (int i = 0; i < n; ++i) x[i] -= along * v[i];
  }
};

// W*W λ = b with W = V diag(unit), W (n x m) given column by column: λ of the least 2-norm where W has dependent columns.
//
//   V Π = Q R,   R* y = b/unit in the sense of least squares, by R* = Z T:  y = T⁻¹ Z* (b/unit)      what is left is the conflict in b
//   R Π* diag(unit) λ = y of the least norm, by (R Π* diag(unit))* = Z' T':  λ = Z' T'⁻* y
//
// No product W*W is formed, whose rounding would take half of the digits of a small singular value. Cost n m².
//
// More than `few` columns are tried in an order in which neighbours share rows, without pivoting, inside the envelope: rows in the order of the
// first column that has them, so that column j is reflected at rows from `top` to `bottom` alone. For columns in a row, each beside a few others,
// as of the loops of a ladder, the cost is m. Where a column has less than a thousand tolerances left, or rows run out, all are factored by pivoting.
// Recorded columns are always tried in an order; few of them are made orthogonal without a root (weighted_gram_schmidt.h).
template <class S>
class MinimumNormSystem {
 public:
  static constexpr int few = 32, few_recorded = 16;
  // Columns are given one after the other, each by the rows that it has: number/√size.
  void begin(int n) { n_ = n, count_ = 0; }
  void add_column() {
    if (static_cast<int>(given_.size()) == count_) given_.emplace_back();
    given_[count_++].clear();
  }
  void add_entry(int row, const S& number, const S& size) { given_[count_ - 1].push_back({row, number, size}); }
  void drop_column() { --count_; }
  int rank() const { return orthogonal_ ? count_ : V_.rank; }
  // unit_squares (m); tolerance: of columns of V
  void factor(const S* unit_squares, const S& tolerance) {
    using std::sqrt;
    const int m = count_;
    orthogonal_ = is_recorded<S> && m <= few_recorded && make_orthogonal(unit_squares, S(1000) * tolerance);
    if (orthogonal_) return;
    unit_.resize(m);
    for (int j = 0; j < m; ++j) {
      unit_[j] = sqrt(unit_squares[j]);
      for (Entry& e : given_[j]) e.number /= sqrt(e.size) * unit_[j];
    }
    if ((m > few || is_recorded<S>) && factor_in_order(S(1000) * tolerance)) return;
    V_.resize(n_, m);
    for (int j = 0; j < m; ++j)
      for (const Entry& e : given_[j]) V_.at(e.row, j) = e.number;
    V_.factor(true, tolerance);
    if (V_.rank == m) return;
    Z_.resize(m, V_.rank), scaled_.resize(m, V_.rank);
    for (int j = 0; j < V_.rank; ++j)
      for (int i = j; i < m; ++i) {
        Z_.at(i, j) = V_.upper(j, i);
        scaled_.at(i, j) = unit_[V_.order[i]] * V_.upper(j, i);
      }
    Z_.factor(false, S(0)), scaled_.factor(false, S(0));
  }
  // conflict (m): what of b/unit no λ can meet.
  void solve(const S* b, S* lambda, S* conflict) {
    const int m = count_, r = V_.rank;
    std::fill_n(conflict, m, S(0));
    if (orthogonal_) return columns_.solve(b, lambda);
    x_.resize(m), y_.assign(m, S(0));
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
  struct Entry {
    int row;
    S number, size;
  };
  bool make_orthogonal(const S* unit_squares, const S& tolerance) {
    columns_.resize(n_, count_);
    for (int j = 0; j < count_; ++j)
      for (const Entry& e : given_[j]) columns_.at(e.row, j) = e.number, columns_.size(e.row) = e.size;
    columns_.factor();
    for (int j = 0; j < count_; ++j)
      if (!(columns_.square(j) > tolerance * tolerance * unit_squares[j])) return false;
    return true;
  }
  bool factor_in_order(const S& tolerance) {
    using std::abs;
    const int m = count_;
    std::vector<int> order(m), lowest(m, n_), first(n_, m), last(n_, -1), row(n_), place(n_);
    for (int j = 0; j < m; ++j) {
      order[j] = j;
      for (const Entry& e : given_[j]) lowest[j] = std::min(lowest[j], e.row);
    }
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return lowest[a] < lowest[b]; });
    for (int j = 0; j < m; ++j)
      for (const Entry& e : given_[order[j]]) first[e.row] = std::min(first[e.row], j), last[e.row] = std::max(last[e.row], j);
    for (int i = 0; i < n_; ++i) row[i] = i;
    std::stable_sort(row.begin(), row.end(), [&](int a, int b) { return first[a] < first[b]; });
    for (int i = 0; i < n_; ++i) place[row[i]] = i;
    // Rows enter with their first column; what is reflected together reaches as far as any of it.
    V_.top.assign(m, 0), V_.bottom.assign(m, 0);
    int in = 0, reach = -1;
    for (int j = 0; j < m; ++j) {
      for (; in < n_ && first[row[in]] <= j; ++in)
        for (; reach < last[row[in]]; ++reach) V_.top[reach + 1] = j;
      if (in <= j) return false;
      V_.bottom[j] = in;
    }
    V_.reserve(n_);
    for (int j = 0; j < m; ++j)
      for (const Entry& e : given_[order[j]]) V_.at(place[e.row], j) = e.number;
    V_.order = order;
    V_.factor(false, tolerance);
    if (V_.rank < m) return false;
    return std::all_of(V_.diagonal.begin(), V_.diagonal.end(), [&](const S& d) { return abs(d) > tolerance; });  // of recorded ones from here on
  }

  int n_ = 0, count_ = 0;
  bool orthogonal_ = false;
  std::vector<std::vector<Entry>> given_;
  WeightedGramSchmidt<S> columns_;
  Reflections<S> V_, Z_, scaled_;
  std::vector<S> unit_, x_, y_;
};

}  // namespace pycraft
