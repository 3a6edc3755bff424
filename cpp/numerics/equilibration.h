// Powers of two by which the rows and columns of a small matrix are compared, so that the units of its states and equations do not matter:
//
//   |a(i,j)| 2^(r(i) + c(j)) < 2 for all i, j,  and >= 1 on a matching of rows and columns
//
// The matching is one of largest product, r and c its dual variables, in the integers of the binary exponents. Source: M. Olschowka and
// A. Neumaier, A new pivoting strategy for Gaussian elimination, Linear Algebra Appl. 240 (1996); I. Duff and J. Koster, On algorithms for
// permuting large entries to the diagonal of a sparse matrix, SIAM J. Matrix Anal. Appl. 22 (2001). It starts from exponents that are zero
// on a spanning forest of the matrix's pattern: those are the same for every matrix 2^x(i) a(i,j) 2^y(j), so that what follows is too, to
// the bit. Cost: O(n nnz) at worst, about O(nnz) for the blocks of a tree elimination.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "numerics/scalar.h"

namespace pycraft {

class Equilibration {
 public:
  // Of the n x n row-major matrix of sizes |a(i,j)|. False where no matching exists: the matrix is singular by its pattern.
  template <class S>
  bool find(const S* sizes, int n) {
    using std::ilogb;
    n_ = n;
    start_.assign(1, 0);
    entries_.clear();
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j)
        if (const S& size = sizes[size_t(i) * n + j]; size > S(0)) entries_.push_back({j, static_cast<int>(ilogb(size))});
      start_.push_back(static_cast<int>(entries_.size()));
    }
    zero_on_forest();
    return match();
  }
  int row(int i) const { return row_[i]; }
  int column(int j) const { return column_[j]; }
  // The row that column j is matched with.
  int matched_row(int j) const { return row_of_[j]; }
  // Rows and columns that no entry joins have scales that are free against each other: the part that each belongs to.
  int parts() const { return parts_; }
  int part_of_row(int i) const { return row_part_[i]; }
  int part_of_column(int j) const { return column_part_[j]; }

 private:
  struct Entry {
    int column, exponent;
  };

  void zero_on_forest();   // row_, column_: exponent + row + column = 0 on a spanning forest
  bool match();            // adds the dual variables of the matching
  bool augment(int row);

  int n_ = 0, parts_ = 0;
  std::vector<int> row_, column_, row_part_, column_part_;
  std::vector<int> start_;
  std::vector<Entry> entries_;        // row after row; exponents, later costs
  std::vector<Entry> by_column_;      // `column` is the row here
  std::vector<int> column_start_, queue_;
  std::vector<int> u_, v_, row_of_, column_of_, distance_, from_;
  std::vector<char> done_;
};

}  // namespace pycraft
