// elimination.h: factorization, and what to do when a pivot is singular or digits are lost.
#pragma once

#include <algorithm>

#include "algebra/engine/elimination/elimination_accuracy.h"
#include "algebra/engine/elimination/elimination_assembly.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class S>
bool TreeElimination<S>::eliminate() {
  using std::abs;
  for (int k = static_cast<int>(fronts_.size()) - 1; k >= 0; --k) {
    const Front& f = fronts_[k];
    const int across = f.width() + border_;
    S *U = A_.data() + f.across, *over = A_.data() + f.over;
    failed_ = k;
    check_interrupt();
    if (!lu_[k].factor(A_.data() + f.matrix, f.n, sizes_.data() + f.sizes)) return false;
    work_.resize(std::max(work_.size(), size_t(f.n) * std::max(across, 1)));
    lu_[k].solve(U, across, work_.data());
    // Schur complement in the parent and the border
    for (int i = 0; i < f.height() + border_; ++i) {
      check_interrupt_at(i, f.n);
      const bool parent_row = i < f.height();
      const Front* p = f.parent >= 0 ? &fronts_[f.parent] : nullptr;
      for (int j = 0; j < across; ++j) {
        S update = S(0);
        for (int a = 0; a < f.n; ++a) update += over[size_t(i) * f.n + a] * U[size_t(a) * across + j];
        if (vanishes(update)) continue;
        const bool parent_column = j < f.width();
        if (parent_row && parent_column) {
          A_[p->matrix + size_t(f.rows[i]) * p->n + f.columns[j]] -= update;
          Soft<S>& size = sizes_[p->sizes + size_t(f.rows[i]) * p->n + f.columns[j]];
          size = maximum(size, Soft<S>(abs(soft(update))));
        } else if (parent_row) {
          A_[p->across + size_t(f.rows[i]) * (p->width() + border_) + p->width() + (j - f.width())] -= update;
        } else if (parent_column) {
          A_[p->over + size_t(p->height() + (i - f.height())) * p->n + f.columns[j]] -= update;
        } else {
          const size_t at = size_t(i - f.height()) * border_ + (j - f.width());
          border_matrix_[at] -= update;
          border_sizes_[at] = maximum(border_sizes_[at], Soft<S>(abs(soft(update))));
        }
      }
    }
  }
  failed_ = -1;
  return border_ == 0 || border_lu_.factor(border_matrix_.data(), border_, border_sizes_.data());
}

template <class S>
void TreeElimination<S>::coarsen() {
  std::vector<char> odd(fronts_.size(), 0);
  for (size_t f = 0; f < fronts_.size(); ++f) {
    odd[f] = fronts_[f].parent >= 0 && !odd[fronts_[f].parent];
    if (odd[f]) merged_with_parent_[fronts_[f].bodies[0]] = 1;
  }
  lay_out(false);
}

template <class S>
template <class Blocks, class Values>
bool TreeElimination<S>::factor(Blocks&& blocks, Values&& values, S tolerated) {
  const auto widest = [&] {
    int n = 0;
    for (const Front& f : fronts_) n = std::max(n, f.n);
    return n;
  };
  std::string where;  // made where it is needed: a state allocates nothing
  if (dense_ || std::find(merged_with_parent_.begin(), merged_with_parent_.end(), 1) != merged_with_parent_.end()) {
    std::fill(merged_with_parent_.begin(), merged_with_parent_.end(), 0);  // what the last state asked for is no business of this one
    lay_out(false);
  }
  dense_ = false;
  note_.clear();
  // In quad and wider, half of the digits are more than any double has: a model too large for one front makes do with them.
  using std::sqrt;
  const bool large = static_cast<int>(total_) + border_ > elimination::largest_dense, wide = std::numeric_limits<S>::digits >= std::numeric_limits<Quad>::digits;
  const S half = large && wide ? maximum(tolerated, S(sqrt(epsilon<S>()))) : tolerated;
  for (int attempt = 0; attempt < elimination::merges; ++attempt) {
    assemble(blocks, values);
    if (eliminate()) {
      growth_ = lost();
      const bool solved = (is_recorded<S> && elimination::for_source()) || natural_sides_are_solved(half);
      if (growth_ <= tolerated && solved) return true;
      off_tape(growth_);
      where = "elimination body by body loses " + (growth_ <= tolerated ? "all" : elimination::digits(growth_)) + " digits";
      if (growth_ <= half && solved) {
        note_ = "digits: " + where;
        return true;
      }
      // One front, or one per root: nothing is left to merge.
      if (std::all_of(fronts_.begin(), fronts_.end(), [](const Front& f) { return f.parent < 0; }) || 2 * widest() > elimination::largest_merged_front) break;
      coarsen();
      continue;
    }
    off_tape(growth_);
    if (failed_ < 0) {
      where = "the pivot block of the low-rank border is singular";
      break;
    }
    const Front& f = fronts_[failed_];
    where = "the pivot block of body '" + tree_.body_names[f.bodies[0]] + "' is singular";
    if (f.parent < 0 || f.n + fronts_[f.parent].n > elimination::largest_merged_front) break;
    merged_with_parent_[f.bodies[0]] = 1;
    lay_out(false);
  }
  if (large) {
    note_ = where + ", and with " + std::to_string(total_) + " states the operator is too large for a dense factorization";
    return false;
  }
  lay_out(true);
  assemble(blocks, values);
  if (!eliminate()) throw SingularOperatorError(where + ", and so is the operator as a whole: it has no inverse at this state");
  growth_ = lost();
  if (!(growth_ < S(1e-2))) throw SingularOperatorError("the operator is singular to working precision at this state (" + where +
                                                         "); a wider precision (.at(precision=\"quad\")) may decide");
  dense_ = true;
  note_ = "dense: " + where + "; eliminated as one block of " + std::to_string(total_) + " states";
  return true;
}

}  // namespace pycraft
