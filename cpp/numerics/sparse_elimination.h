// Sparse rows eliminated one after the other, A_i = Σ_j L_ij U_j + U_i, each by those before it, with the largest of what is left of a row for its
// pivot: partial pivoting of A*. What rows do not share is not touched, so that for rows in which each shares columns with a few before it the cost is
// their number. Without allocation where the memory has been used before.
// Source: T. Davis, Direct Methods for Sparse Linear Systems, SIAM 2006, ch. 6 (up-looking elimination).
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "numerics/scalar.h"

namespace pycraft {

template <class S>
class SparseElimination {
 public:
  // Rows follow, of so many columns.
  void begin(int columns) {
    count_ = 0;
    row_of_.assign(columns, -1);
    work_.assign(columns, S(0)), there_.assign(columns, 0);
  }
  // An entry of the row that comes next; each column once.
  void entry(int column, const S& value) {
    work_[column] = value, there_[column] = 1;
    columns_.push_back(column);
  }
  // The row is eliminated. The column of its pivot: of those that are allowed (null: all) the largest entry over its column's weight; -1, and the row is
  // forgotten, where that is not above `tolerance`, by the weights too.
  int eliminate(const S* weights, const char* allowed, const S& tolerance) {
    using std::abs;
    if (static_cast<int>(rows_.size()) == count_) rows_.emplace_back();
    Row& row = rows_[count_];
    row.L.clear(), row.U.clear();
    before_.clear();
    for (const int c : columns_)
      if (row_of_[c] >= 0) before_.push_back(row_of_[c]);
    std::make_heap(before_.begin(), before_.end(), std::greater<int>());
    while (!before_.empty()) {
      std::pop_heap(before_.begin(), before_.end(), std::greater<int>());
      const int j = before_.back();
      before_.pop_back();
      const Row& earlier = rows_[j];
      const S factor = work_[earlier.pivot] / earlier.value;
      row.L.emplace_back(j, factor);
      for (const auto& [c, u] : earlier.U) {
        if (!there_[c]) {
          there_[c] = 1, work_[c] = S(0);
          columns_.push_back(c);
          if (row_of_[c] >= 0) before_.push_back(row_of_[c]), std::push_heap(before_.begin(), before_.end(), std::greater<int>());
        }
        work_[c] -= factor * u;
      }
    }
    int pivot = -1;
    S most = tolerance;
    for (const int c : columns_)
      if (row_of_[c] < 0 && (!allowed || allowed[c]))
        if (const S size = abs(work_[c]) / weights[c]; size > most) most = size, pivot = c;
    for (const int c : columns_) {
      there_[c] = 0;
      if (pivot >= 0 && row_of_[c] < 0 && c != pivot) row.U.emplace_back(c, work_[c]);
    }
    columns_.clear();
    if (pivot < 0) return -1;
    row.pivot = pivot, row.value = work_[pivot];
    row_of_[pivot] = count_++;
    return pivot;
  }

  int rows() const { return count_; }
  // x of the pivots' columns, Σ over pivots A(i,c) x(c) = b(i) of rows that were kept; b becomes L⁻¹b.
  void solve(S* b, S* x) const {
    for (int i = 0; i < count_; ++i)
      for (const auto& [j, l] : rows_[i].L) b[i] -= l * b[j];
    for (int i = count_ - 1; i >= 0; --i) {
      S sum = b[i];
      for (const auto& [c, u] : rows_[i].U)
        if (row_of_[c] >= 0) sum -= u * x[c];
      x[rows_[i].pivot] = sum / rows_[i].value;
    }
  }
  // X (columns x r), row-major, with AX = 0: the rows of columns that are no pivots are given.
  void complete(S* X, int r) const {
    for (int i = count_ - 1; i >= 0; --i) {
      S* const own = X + size_t(rows_[i].pivot) * r;
      std::fill_n(own, r, S(0));
      for (const auto& [c, u] : rows_[i].U)
        for (int a = 0; a < r; ++a) own[a] -= u * X[size_t(c) * r + a];
      for (int a = 0; a < r; ++a) own[a] /= rows_[i].value;
    }
  }
  // λ by rows, Σ_i A(i,c) λ(i) = b(c) of the pivots' columns; b is used up.
  void solve_transposed(S* b, S* lambda) const {
    for (int i = 0; i < count_; ++i) {
      lambda[i] = b[rows_[i].pivot] / rows_[i].value;
      for (const auto& [c, u] : rows_[i].U)
        if (row_of_[c] >= 0) b[c] -= u * lambda[i];
    }
    for (int i = count_ - 1; i >= 0; --i)
      for (const auto& [j, l] : rows_[i].L) lambda[j] -= l * lambda[i];
  }

 private:
  struct Row {
    int pivot = -1;
    S value = S(0);                          // there
    std::vector<std::pair<int, S>> L, U;     // by rows before it; by columns, but for the pivot
  };
  int count_ = 0;
  std::vector<Row> rows_;
  std::vector<int> row_of_;                  // of columns: whose pivot they are, -1 of none
  std::vector<S> work_;
  std::vector<char> there_;
  std::vector<int> columns_, before_;
};

}  // namespace pycraft
