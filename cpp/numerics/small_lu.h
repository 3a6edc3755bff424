// LU with partial pivoting, in place, any scalar, no allocation after the first use. Rows and columns are compared in the powers of two of
// an equilibration, so that the units of states and equations decide about no pivot; the numbers themselves are left as they are. The pivot
// blocks of the tree elimination are of the size of a body's states (10 to 60): too small for a blocked method. (Eigen's decomposition
// allocates its permutation anew and has no test for pivots that are noise.)
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "numerics/decisions.h"
#include "numerics/equilibration.h"
#include "runtime/interrupt.h"

namespace pycraft {

// |x| of a product of many factors: a mantissa and a binary exponent, so that no product leaves the range and one logarithm is taken.
template <class S>
struct Magnitude {
  S mantissa = S(1);
  std::conditional_t<is_recorded<S>, S, long> exponent{};
  void multiply(const S& factor) {
    decltype(exponent) shift{};
    mantissa = split(S(mantissa * factor), shift);
    exponent += shift;
  }
  void multiply(const Magnitude& other) {
    multiply(other.mantissa);
    exponent += other.exponent;
  }
  S log() const {
    using std::log;
    return S(log(mantissa)) + S(exponent) * S(log(S(2)));
  }
};

template <class S>
class SmallLU {
 public:
  // Factors the n x n row-major matrix A in place; it must stay where it is. sizes: the largest number that went into each entry, so that a
  // pivot below 4 n eps of them is noise; null where nothing was added up in A. False if the matrix counts as singular.
  bool factor(S* A, int n, const Soft<S>* sizes) {
    using std::abs;
    A_ = A;
    n_ = n;
    rows_.resize(n);
    determinant_ = {};
    sizes_.resize(size_t(n) * n);
    for (size_t i = 0; i < sizes_.size(); ++i) sizes_[i] = maximum(Soft<S>(abs(soft(A[i]))), sizes ? sizes[i] : Soft<S>(0));
    if (!scales_.find(sizes_.data(), n)) return false;
    for (int i = 0; i < n; ++i) rows_[i] = i;
    take_row_factors();
    if (is_recorded<S> && !sizes) take_column_sizes();
    column_.assign(n, Soft<S>(0));
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) column_[j] = maximum(column_[j], in_column(sizes_[size_t(i) * n + j], i, j));
    for (int k = 0; k < n; ++k) {
      check_interrupt_at(k, n);
      // The state's own equation, unless another one is much larger: the recursions that the equations stand for are stable as they are.
      // Else the one that the equilibration matched it with. Where units are free an entry that is rounding (a block of R that cancels)
      // looks as large as any; what is matched takes part in the determinant, and such an entry does not.
      int best = k, own = -1, matched = -1;
      Soft<S> largest = Soft<S>(-1);
      for (int i = k; i < n; ++i) {
        const Soft<S> candidate = in_column(Soft<S>(abs(soft(A[rows_[i] * n + k]))), rows_[i], k);
        if (candidate > largest) largest = candidate, best = i;
        if (rows_[i] == k) own = i;
        if (rows_[i] == scales_.matched_row(k)) matched = i;
      }
      for (int i : {matched, own})
        if (i >= 0 && in_column(Soft<S>(abs(soft(A[rows_[i] * n + k]))), rows_[i], k) > Soft<S>(0.1) * largest) best = i;
      if (!(largest > Soft<S>(4 * n) * epsilon<Soft<S>>() * column_[k])) return false;
      if (is_recorded<S> && !sizes && !still_chosen(k, best)) return false;
      std::swap(rows_[k], rows_[best]);
      const S* pivot_row = A + rows_[k] * n;
      determinant_.multiply(abs(pivot_row[k]));
      const S inverse = S(1) / pivot_row[k];
      for (int i = k + 1; i < n; ++i) {
        S* row = A + rows_[i] * n;
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
      S* w = work + i * m;
      std::copy_n(x + rows_[i] * m, m, w);
      const S* row = A_ + rows_[i] * n_;
      for (int k = 0; k < i; ++k)
        if (!vanishes(row[k]))
          for (int c = 0; c < m; ++c) w[c] -= row[k] * work[k * m + c];
    }
    for (int i = n_ - 1; i >= 0; --i) {
      check_interrupt_at(i, n_);
      const S* row = A_ + rows_[i] * n_;
      S* xi = x + i * m;
      std::copy_n(work + i * m, m, xi);
      for (int k = i + 1; k < n_; ++k)
        if (!vanishes(row[k]))
          for (int c = 0; c < m; ++c) xi[c] -= row[k] * x[k * m + c];
      for (int c = 0; c < m; ++c) xi[c] /= row[i];
    }
  }

  const Magnitude<S>& determinant() const { return determinant_; }
  const Equilibration& scales() const { return scales_; }

 private:
  // Where couplings of 1e-170 join rows (a joint at such an angle), the rows' scales differ by more than numbers can: then with the columns'
  // scales, with which no entry is above 2.
  void take_row_factors() {
    using std::abs, std::ldexp;
    constexpr int furthest = std::numeric_limits<Soft<S>>::max_exponent / 2;
    row_factor_.resize(n_);
    extreme_ = false;
    for (int i = 0; i < n_; ++i) {
      extreme_ |= abs(scales_.row(i)) > furthest;
      row_factor_[i] = ldexp(Soft<S>(1), scales_.row(i));
    }
  }
  // |a(i,j)| beside the others of its column.
  Soft<S> in_column(const Soft<S>& size, int i, int j) const {
    using std::ldexp;
    return extreme_ ? Soft<S>(ldexp(size, scales_.row(i) + scales_.column(j))) : Soft<S>(size * row_factor_[i]);
  }
  // What a recorded factorization needs of states beside its own: that what it chose in column k by the numbers of one is neither rounding nor
  // far below the others. (An elimination over a tree measures instead what it lost, elimination_accuracy.h.)
  void take_column_sizes() {
    using std::abs;
    column_sizes_.assign(n_, S(0));
    for (int i = 0; i < n_; ++i)
      for (int j = 0; j < n_; ++j) column_sizes_[j] = maximum(column_sizes_[j], S(S(row_factor_[i]) * abs(A_[i * n_ + j])));
  }
  bool still_chosen(int k, int best) const {
    using std::abs;
    const auto size = [&](int i) { return S(S(row_factor_[rows_[i]]) * abs(A_[rows_[i] * n_ + k])); };
    const S chosen = size(best);
    S largest = S(0);
    for (int i = k; i < n_; ++i)
      if (i != best) largest = maximum(largest, size(i));
    return !extreme_ && chosen > S(4 * n_) * epsilon<S>() * column_sizes_[k] && chosen > S(0.0625) * largest;
  }

  S* A_ = nullptr;
  int n_ = 0;
  std::vector<int> rows_;
  std::vector<Soft<S>> column_, sizes_, row_factor_;
  std::vector<S> column_sizes_;
  Equilibration scales_;
  bool extreme_ = false;
  Magnitude<S> determinant_;
};

}  // namespace pycraft
