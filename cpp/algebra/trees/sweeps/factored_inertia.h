// The factored forms of the Riccati sweep: what is carried from body to body are columns and weights, never P itself, so that digits
// of a light part are not lost in the numbers of a heavy one.
//
//   P(k) = C W C*      columns: the body's own inertia in factors, and those of every child's P⁺, moved by E
//
// Rows of one array over these columns and, for a hinge-diagonal term J = Σ j w j*, one more column each:
//
//   A = [[H C, j], [C, 0], [ρ, 0]]
//
// are made orthogonal one after the other (A = L Q, Q W Q* = diag d, L lower triangular), the hinge's rows first:
//
//   D = L₁ d₁ L₁*,   G = L₂ L₁⁻¹,   P⁺ = U d₂ U*,  U the columns of L that belong to body rows
//
//   ud:           weighted Gram-Schmidt, L with a unit diagonal; no square roots, no pivots
//   square-root:  W = 1, Householder reflections, columns heaviest first, d = 1
//
// The row ρ carries a force -C W ρ* as accelerations of the columns (recursions/articulated_body.h); operators do without it.
// A row of the body that is a hinge's row, where J = 0, becomes exactly zero.
//
// Sources: C. L. Thornton, Triangular Covariance Factorizations for Kalman Filtering, 1976 (ud); A. J. Cox and N. J. Higham, Stability of
// Householder QR factorization for weighted least squares problems, 1998 (order of the rows). Cost: about 1000 flops a link.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <type_traits>
#include <vector>

#include "algebra/language/structure.h"
#include "numerics/arithmetic.h"
#include "numerics/orthogonalisation.h"
#include "numerics/semidefinite_factors.h"

namespace pycraft {

template <class S>
class FactoredInertia {
 public:
  // Sweeps go from the tips: a body takes room when its first child comes in, and gives it back once it has gone into its parent.
  explicit FactoredInertia(const SkoStructure& tree) : tree_(tree), at_(tree.bodies()), stride_(tree.bodies()), count_(tree.bodies()) {
    std::vector<int> capacity(tree.bodies());
    for (int k = 0; k < tree.bodies(); ++k) capacity[k] = tree.size[k] + tree.dof[k];
    for (int k = 0; k < tree.bodies(); ++k)
      if (tree.parent[k] >= 0) capacity[tree.parent[k]] += tree.size[k];
    int rows = 0, widest = 0;
    for (int k = 0; k < tree.bodies(); ++k) {
      stride_[k] = filled<S>(capacity[k]);
      rows = std::max(rows, tree.dof[k] + tree.size[k] + 1);
      widest = std::max(widest, stride_[k]);
    }
    size_t room = 0;
    std::map<size_t, std::vector<size_t>> left;  // of bodies that are through, by size
    const auto size = [&](int k) { return size_t(tree.dof[k] + tree.size[k] + 2) * stride_[k]; };
    const auto take = [&](int k) {
      std::vector<size_t>& same = left[size(k)];
      at_[k] = same.empty() ? room : same.back();
      if (same.empty())
        room += size(k);
      else
        same.pop_back();
    };
    for (int k = tree.bodies() - 1; k >= 0; --k) {
      const int p = tree.parent[k];
      if (tree.last_child[k] < 0) take(k);
      if (p >= 0 && tree.last_child[p] == k) take(p);
      left[size(k)].push_back(at_[k]);
    }
    A_.resize(room);
    L_.resize(size_t(rows) * rows), d_.resize(rows), zeros_.assign(rows, S(0)), rows_.resize(rows), position_.resize(rows), source_.resize(rows);
    weighted_.resize(widest), sorted_.resize(widest), order_.resize(widest);
  }

  size_t scalars() const { return A_.size() + L_.size() + d_.size() + weighted_.size() + sorted_.size(); }

  // ---- columns of P(k)
  void start(int k) { count_[k] = 0; }
  // A column with its weight; element i of it is u(i).
  template <class Column>
  void add(int k, const S& weight, const S& rho, Column&& u) {
    const int n = tree_.dof[k], s = tree_.size[k], stride = stride_[k];
    S* A = A_.data() + at_[k] + count_[k]++;
    for (int i = 0; i < s; ++i) A[(n + i) * stride] = u(i);
    A[(n + s) * stride] = rho;
    A[(n + s + 1) * stride] = weight;
  }
  int columns(int k) const { return count_[k]; }
  const S* body_row(int k, int i) const { return A_.data() + at_[k] + size_t(tree_.dof[k] + i) * stride_[k]; }
  S* bias_row(int k) { return A_.data() + at_[k] + size_t(tree_.dof[k] + tree_.size[k]) * stride_[k]; }
  S* hinge_row(int k, int j) { return A_.data() + at_[k] + size_t(j) * stride_[k]; }
  const S* weights(int k) const { return A_.data() + at_[k] + size_t(tree_.dof[k] + tree_.size[k] + 1) * stride_[k]; }
  // Entry (i, j) of P(k), before the hinge is eliminated.
  S inertia(int k, int i, int j) const {
    const S *a = body_row(k, i), *b = body_row(k, j), *w = weights(k);
    S sum = S(0);
    for (int c = 0; c < count_[k]; ++c) sum += w[c] * a[c] * b[c];
    return sum;
  }
  // Columns from columns(k) to whole fours become zero in all rows: before rows are worked on, and again after more were added.
  void fill_up(int k) {
    S* A = A_.data() + at_[k];
    const int rows = tree_.dof[k] + tree_.size[k] + 2, m = count_[k], end = filled<S>(m);
    for (int row = 0; m < end && row < rows; ++row, A += stride_[k])
      for (int c = end - columns_at_once<S>; c < end; ++c)
        if (c >= m) A[c] = S(0);
  }
  // Room for more columns of body k: its first row from there on, the next ones stride(k) apart, ρ and the weights last.
  S* more(int k, int columns) {
    S* at = A_.data() + at_[k] + size_t(tree_.dof[k]) * stride_[k] + count_[k];
    count_[k] += columns;
    return at;
  }
  int stride(int k) const { return stride_[k]; }
  size_t widest() const { return weighted_.size(); }

  // ---- the hinge: the caller fills hinge_row(k, j) with H C over columns(k), then adds the factors of J
  template <class Column>
  void add_rotor(int k, const S& weight, Column&& u) {
    const int n = tree_.dof[k], s = tree_.size[k], stride = stride_[k];
    S* A = A_.data() + at_[k] + count_[k]++;
    for (int j = 0; j < n; ++j) A[j * stride] = u(j);
    for (int i = 0; i <= s; ++i) A[(n + i) * stride] = S(0);
    A[(n + s + 1) * stride] = weight;
  }
  // Rows are filled up. is_hinge_row[i]: ±(j + 1) where row i of the body is ± the hinge's row j and J = 0, else 0. bias: the row ρ is in use.
  void eliminate(int k, Form form, const int* is_hinge_row, bool bias) {
    const int n = tree_.dof[k], s = tree_.size[k], m = count_[k], stride = stride_[k];
    S *A = A_.data() + at_[k], *w = A + (n + s + 1) * stride;
    int count = 0;
    for (int j = 0; j < n; ++j) rows_[count++] = j;
    for (int i = 0; i < s; ++i) {
      position_[i] = is_hinge_row[i] ? -1 : count;
      source_[i] = is_hinge_row[i];
      if (!is_hinge_row[i]) rows_[count++] = n + i;
    }
    pivots_ = count;
    if (bias) rows_[count++] = n + s;
    if constexpr (!is_pack<S>) {  // reflections take the heaviest column first, whichever that is
      if (form == Form::square_root) {
        heaviest_first(A, stride, n + s + 1, m, w);
        householder_lower(A, stride, rows_.data(), count, pivots_, m, L_.data());
        std::fill_n(d_.data(), pivots_, S(1));
      }
    }
    if (form == Form::ud) weighted_gram_schmidt(A, stride, rows_.data(), count, pivots_, m, w, weighted_.data(), L_.data(), d_.data());
    bias_at_ = bias ? pivots_ : -1;
  }

  // ---- results of the last elimination, n its hinge's coordinates
  int pivots() const { return pivots_; }
  // D = L₁ d L₁*
  S lower(int i, int j) const { return L_[i * pivots_ + j]; }
  S weight(int j) const { return d_[j]; }
  // Row i of the body against hinge row j: L₂.
  S against(int i, int j) const {
    if (position_[i] >= 0) return lower(position_[i], j);
    const int row = std::abs(source_[i]) - 1;
    return j > row ? S(0) : source_[i] > 0 ? lower(row, j) : S(-lower(row, j));
  }
  // P⁺ = U d U*: column r = n, ..., pivots() - 1, of weight(r).
  S U(int i, int r) const { return position_[i] >= 0 ? lower(position_[i], r) : S(0); }
  // Row i of U from column r on.
  const S* U_row(int i, int r) const { return position_[i] >= 0 ? L_.data() + position_[i] * pivots_ + r : zeros_.data(); }
  const S* bias_row_left(int r) const { return bias_at_ >= 0 ? L_.data() + bias_at_ * pivots_ + r : zeros_.data(); }
  const S* weights_left(int r) const { return d_.data() + r; }
  // ρ against row r, of the hinge or of the body.
  S bias(int r) const { return bias_at_ >= 0 ? lower(bias_at_, r) : S(0); }

 private:
  // The columns scaled by the square roots of their weights, in the order of their size.
  void heaviest_first(S* A, int stride, int rows, int m, const S* w) {
    using std::abs, std::sqrt;
    for (int c = 0; c < m; ++c) {
      const S root = sqrt(w[c]);
      S size = S(0);
      for (int i = 0; i < rows; ++i) {
        S& a = A[i * stride + c];
        a *= root;
        if (i + 1 < rows) size = maximum(size, S(abs(a)));
      }
      weighted_[c] = size;
      order_[c] = c;
    }
    if constexpr (is_recorded<S>) return sort_columns(A, stride, rows, m);
    std::sort(order_.begin(), order_.begin() + m, [&](int a, int b) { return weighted_[a] > weighted_[b] || (weighted_[a] == weighted_[b] && a < b); });
    for (int i = 0; i < rows; ++i) {
      for (int c = 0; c < m; ++c) sorted_[c] = A[i * stride + order_[c]];
      std::copy_n(sorted_.data(), m, A + i * stride);
    }
  }

  // Whichever order it comes to: neighbours trade places where the second is the larger.
  void sort_columns(S* A, int stride, int rows, int m) {
    for (int last = m - 1; last > 0; --last)
      for (int c = 0; c < last; ++c) {
        const S size = weighted_[c], next = weighted_[c + 1];
        const auto trade = [&](S& a, S& b) {
          const S first = where_less(size, next, b, a);
          b = where_less(size, next, a, b), a = first;
        };
        trade(weighted_[c], weighted_[c + 1]);
        for (int i = 0; i < rows; ++i) trade(A[i * stride + c], A[i * stride + c + 1]);
      }
  }

  const SkoStructure& tree_;
  std::vector<size_t> at_;                                              // of each body's rows: hinge, body, ρ, weights
  std::vector<int> stride_, count_, order_, rows_, position_, source_;  // position: of a body row among the rows of L
  std::vector<S> A_, L_, d_, zeros_, weighted_, sorted_;
  int pivots_ = 0, bias_at_ = -1;
};

#define PYCRAFT_EXTERN(S) extern template class FactoredInertia<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
