// elimination.h: factorization, solves, and what to do when a pivot is singular or digits are lost.
#pragma once

#include <algorithm>
#include <cstdint>

#include "algebra/engine/elimination/elimination_assembly.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace elimination {

// Signs and sizes from 1/2 to 1, scattered: no two near each other have a sum that vanishes, and no number divides another. (Of whole ones
// a state may come out as zero but for rounding, which is no unit for its errors.)
template <class S>
S scattered(size_t i) {
  const std::uint32_t bits = static_cast<std::uint32_t>(i + 1) * 2654435761u;
  return (bits >> 7 & 1 ? S(1) : S(-1)) / (S(1) + S(bits) / S(4294967296.0));
}

}  // namespace elimination

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
        if (update == S(0)) continue;
        const bool parent_column = j < f.width();
        if (parent_row && parent_column) {
          A_[p->matrix + size_t(f.rows[i]) * p->n + f.columns[j]] -= update;
          S& size = sizes_[p->sizes + size_t(f.rows[i]) * p->n + f.columns[j]];
          size = std::max(size, S(abs(update)));
        } else if (parent_row) {
          A_[p->across + size_t(f.rows[i]) * (p->width() + border_) + p->width() + (j - f.width())] -= update;
        } else if (parent_column) {
          A_[p->over + size_t(p->height() + (i - f.height())) * p->n + f.columns[j]] -= update;
        } else {
          const size_t at = size_t(i - f.height()) * border_ + (j - f.width());
          border_matrix_[at] -= update;
          border_sizes_[at] = std::max(border_sizes_[at], S(abs(update)));
        }
      }
    }
  }
  failed_ = -1;
  return border_ == 0 || border_lu_.factor(border_matrix_.data(), border_, border_sizes_.data());
}

// The scales of a front are free against those of its parent and of the border: chosen, root to leaves, so that the blocks that couple
// them are alike in size.
template <class S>
void TreeElimination<S>::join_scales() {
  using std::abs, std::ilogb;
  constexpr int none = std::numeric_limits<int>::min();
  unit_.resize(total_ + border_);
  row_scale_.resize(total_ + border_);
  const auto take = [&](const Equilibration& scales, size_t at, int n) {
    for (int i = 0; i < n; ++i) {
      unit_[at + i] = scales.column(i) - shift_[scales.part_of_column(i)];
      row_scale_[at + i] = scales.row(i) + shift_[scales.part_of_row(i)];
    }
  };
  if (border_) {
    shift_.assign(border_lu_.scales().parts(), 0);
    take(border_lu_.scales(), total_, border_);
  }
  for (size_t k = 0; k < fronts_.size(); ++k) {
    const Front& f = fronts_[k];
    const Equilibration& scales = lu_[k].scales();
    const int across = f.width() + border_;
    shift_.assign(scales.parts(), none), over_size_.assign(scales.parts(), none);
    const auto outside = [&](int j, const std::vector<int>& touched) {
      const int inside = static_cast<int>(touched.size());
      return j < inside ? fronts_[f.parent].vector + touched[j] : total_ + (j - inside);
    };
    for (int i = 0; i < f.n; ++i)
      for (int j = 0; j < across; ++j)
        if (const S a = abs(original_[f.across + size_t(i) * across + j]); a > S(0)) {
          int& size = shift_[scales.part_of_row(i)];
          size = std::max(size, static_cast<int>(ilogb(a)) + scales.row(i) + unit_[outside(j, f.columns)]);
        }
    for (int i = 0; i < f.height() + border_; ++i)
      for (int j = 0; j < f.n; ++j)
        if (const S a = abs(original_[f.over + size_t(i) * f.n + j]); a > S(0)) {
          int& size = over_size_[scales.part_of_column(j)];
          size = std::max(size, static_cast<int>(ilogb(a)) + row_scale_[outside(i, f.rows)] + scales.column(j));
        }
    for (size_t part = 0; part < shift_.size(); ++part) {
      const int a = shift_[part], o = over_size_[part];
      shift_[part] = a != none && o != none ? (o - a) >> 1 : o != none ? o : a != none ? -a : 0;
    }
    take(scales, f.vector, f.n);
  }
}

// The unit of a state at a body becomes the size that it takes in a solution.
template <class S>
void TreeElimination<S>::take_units(const S* solution) {
  using std::abs, std::ilogb, std::ldexp;
  for (size_t j = 0; j < r_->states.size(); ++j)
    for (size_t k = 0; k < state_at_[j].size(); ++k) {
      const Place p = state_at_[j][k];
      const size_t first = (p.front < 0 ? total_ : fronts_[p.front].vector) + p.position;
      const size_t end = first + (r_->states[j].belongs_to_bodies() ? r_->states[j].body_size(static_cast<int>(k)) : r_->states[j].dimension());
      S largest = S(0);
      for (size_t i = first; i < end; ++i) largest = std::max(largest, S(ldexp(S(abs(solution[i])), -unit_[i])));
      if (!(largest > S(0))) continue;
      const int size = static_cast<int>(ilogb(largest));
      for (size_t i = first; i < end; ++i) unit_[i] += size;
    }
}

template <class S>
template <class F>
void TreeElimination<S>::of_one_kind(int state, F&& visit) const {
  const Space& space = r_->states[state];
  for (size_t k = 0; k < state_at_[state].size(); ++k) {
    const Place p = state_at_[state][k];
    const size_t first = (p.front < 0 ? total_ : fronts_[p.front].vector) + p.position;
    const int n = space.belongs_to_bodies() ? space.body_size(static_cast<int>(k)) : space.dimension();
    for (int i = 0; i < n; ++i) visit(first + i);
  }
}

// A solution of natural size in all states, for scattered numbers on the right side; then the same once more from the product with it.
template <class S>
S TreeElimination<S>::lost() {
  using std::abs, std::ldexp;
  join_scales();
  const size_t size = total_ + border_;
  constexpr int furthest = std::numeric_limits<S>::max_exponent / 2;
  size_t largest = border_;
  for (const Front& f : fronts_) largest = std::max(largest, size_t(f.n));
  if (work_.size() < largest) work_.resize(largest);
  residual_.resize(size);
  for (size_t i = 0; i < size; ++i)
    residual_[i] = ldexp(elimination::scattered<S>(i), std::clamp(-row_scale_[i], -furthest, furthest));
  solve_system(residual_.data(), 1);
  take_units(residual_.data());
  rhs_.assign(size, S(0));
  subtract_product(residual_.data(), rhs_.data(), 1);
  for (S& b : rhs_) b = -b;
  solve_system(rhs_.data(), 1);
  S error = S(0);
  for (size_t i = 0; i < size; ++i) {
    const S e = ldexp(S(abs(S(rhs_[i] - residual_[i]))), -unit_[i]);
    if (!(e <= error)) error = e;
  }
  return error;
}

// What the probe above cannot see: noise that fills a whole state, which the product with it gives back as it is. Each equation's right sides
// are as large as its largest entry, and the residuals of the solutions, corrected once as every solve is, must be rounding of the row's terms.
template <class S>
bool TreeElimination<S>::natural_sides_are_solved(S tolerated) {
  using std::abs;
  constexpr int m = 6;  // of one right side alone, noise may vanish by luck
  const size_t size = total_ + border_;
  size_t widest = border_;
  for (const Front& f : fronts_) widest = std::max(widest, size_t(f.n));
  if (work_.size() < widest * m) work_.resize(widest * m);
  const auto largest = [](S& target, const S& entry, const S& x) { target = std::max(target, S(abs(entry * x))); };
  solution_.assign(size * m, S(1));
  probe_.assign(size * m, S(0));
  over_products(solution_.data(), probe_.data(), m, largest);
  for (size_t i = 0; i < size * m; ++i) probe_[i] *= elimination::scattered<S>(i);
  solution_ = probe_;
  solve_system(solution_.data(), m);
  residual_ = probe_;
  subtract_product(solution_.data(), residual_.data(), m);
  solve_system(residual_.data(), m);
  for (size_t i = 0; i < size * m; ++i) solution_[i] += residual_[i];
  residual_ = probe_;
  subtract_product(solution_.data(), residual_.data(), m);
  for (S& b : probe_) b = abs(b);
  over_products(solution_.data(), probe_.data(), m, [](S& target, const S& entry, const S& x) { target += abs(entry * x); });
  // Rows whose own terms are noise: beside the largest of their states at any body.
  for (size_t j = 0; j < r_->states.size(); ++j) {
    S most = S(0);
    of_one_kind(static_cast<int>(j), [&](size_t i) {
      for (int c = 0; c < m; ++c) most = std::max(most, S(abs(solution_[i * m + c])));
    });
    of_one_kind(static_cast<int>(j), [&](size_t i) { std::fill_n(solution_.begin() + i * m, m, most); });
  }
  backward_.assign(size * m, S(0));
  over_products(solution_.data(), backward_.data(), m, largest);
  for (size_t i = 0; i < size * m; ++i)
    if (const S r = abs(residual_[i]); r > tolerated * probe_[i] && r > S(1000) * epsilon<S>() * backward_[i]) return false;
  return true;
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
  std::string where = "the pivot block of the low-rank border is singular";
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
      const bool solved = natural_sides_are_solved(half);
      if (growth_ <= tolerated && solved) return true;
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
    if (failed_ < 0) break;  // the border's own block
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

template <class S>
void TreeElimination<S>::solve_system(S* b, int m) {
  S* border = b + total_ * m;
  for (int k = static_cast<int>(fronts_.size()) - 1; k >= 0; --k) {
    const Front& f = fronts_[k];
    check_interrupt_at(k, m);
    S* y = b + f.vector * m;
    lu_[k].solve(y, m, work_.data());
    for (int i = 0; i < f.height() + border_; ++i) {
      S* target = i < f.height() ? b + (fronts_[f.parent].vector + f.rows[i]) * m : border + (i - f.height()) * m;
      const S* row = A_.data() + f.over + size_t(i) * f.n;
      for (int a = 0; a < f.n; ++a)
        if (!(row[a] == S(0)))
          for (int c = 0; c < m; ++c) target[c] -= row[a] * y[a * m + c];
    }
  }
  if (border_) border_lu_.solve(border, m, work_.data());
  for (size_t k = 0; k < fronts_.size(); ++k) {
    const Front& f = fronts_[k];
    check_interrupt_at(static_cast<int>(k), m);
    S* y = b + f.vector * m;
    const int across = f.width() + border_;
    const S* U = A_.data() + f.across;
    for (int j = 0; j < across; ++j) {
      const S* s = j < f.width() ? b + (fronts_[f.parent].vector + f.columns[j]) * m : border + (j - f.width()) * m;
      for (int i = 0; i < f.n; ++i) {
        const S u = U[size_t(i) * across + j];
        if (u == S(0)) continue;
        for (int c = 0; c < m; ++c) y[i * m + c] -= u * s[c];
      }
    }
  }
}

template <class S>
template <class Term>
void TreeElimination<S>::over_products(const S* s, S* r, int m, Term&& term) const {
  const S* border_s = s + total_ * m;
  S* border_r = r + total_ * m;
  const auto row_product = [&](const S* row, const S* v, int n, S* target) {
    for (int a = 0; a < n; ++a)
      if (!(row[a] == S(0)))
        for (int c = 0; c < m; ++c) term(target[c], row[a], v[a * m + c]);
  };
  for (const Front& f : fronts_) {
    const S* own = s + f.vector * m;
    const int across = f.width() + border_;
    for (int i = 0; i < f.n; ++i) {
      S* target = r + (f.vector + i) * m;
      row_product(original_.data() + f.matrix + size_t(i) * f.n, own, f.n, target);
      const S* line = original_.data() + f.across + size_t(i) * across;
      for (int j = 0; j < across; ++j) {
        if (line[j] == S(0)) continue;
        const S* v = j < f.width() ? s + (fronts_[f.parent].vector + f.columns[j]) * m : border_s + (j - f.width()) * m;
        for (int c = 0; c < m; ++c) term(target[c], line[j], v[c]);
      }
    }
    for (int i = 0; i < f.height() + border_; ++i) {
      S* target = i < f.height() ? r + (fronts_[f.parent].vector + f.rows[i]) * m : border_r + (i - f.height()) * m;
      row_product(original_.data() + f.over + size_t(i) * f.n, own, f.n, target);
    }
  }
  for (int i = 0; i < border_; ++i) row_product(border_original_.data() + size_t(i) * border_, border_s, border_, border_r + i * m);
}

template <class S>
template <class T, class Blocks>
void TreeElimination<S>::right_hand_side(const T* x, int m, Blocks&& blocks) {
  rhs_.assign((total_ + border_) * m, S(0));
  const auto at = [&](Place p, int i) { return ((p.front < 0 ? total_ : fronts_[p.front].vector) + p.position + i) * m; };
  for (const Realization::Term& t : r_->inputs) {
    if (!r_->domain.belongs_to_bodies()) {
      for (int i = 0; i < r_->domain.dimension(); ++i)
        for (int c = 0; c < m; ++c) rhs_[at(equation_at_[t.row][0], i) + c] += S(t.coefficient) * S(x[i * m + c]);
      continue;
    }
    for (int k = 0; k < tree_.bodies(); ++k) {
      const Place place = equation_at_[t.row][k];
      elimination::for_rows(r_->domain, k, [&](int local, int row) {
        if (t.right < 0) {
          for (int c = 0; c < m; ++c) rhs_[at(place, local) + c] += S(t.coefficient) * S(x[row * m + c]);
        } else {
          const auto& b = blocks(t.right);
          for (int i = 0; i < b.rows[k]; ++i) {
            const S f = S(t.coefficient) * S(b.at(k)[i * b.columns[k] + local]);
            for (int c = 0; c < m; ++c) rhs_[at(place, i) + c] += f * S(x[row * m + c]);
          }
        }
      });
    }
  }
}

template <class S>
template <class T, class Blocks, class Values>
void TreeElimination<S>::assemble_as(const TreeElimination<T>& narrow, Blocks&& blocks, Values&& values) {
  merged_with_parent_ = narrow.merged_with_parent_;
  lay_out(narrow.dense_);
  assemble(blocks, values);
}

template <class S>
template <class T, class U, class Blocks>
void TreeElimination<S>::residual(const T* x, const U* s, U* r, int m, Blocks&& blocks) {
  right_hand_side(x, m, blocks);
  convert(s, rhs_.size(), product_);
  subtract_product(product_.data(), rhs_.data(), m);
  for (size_t i = 0; i < rhs_.size(); ++i) r[i] = static_cast<U>(rhs_[i]);
}

template <class S>
template <class T, class Blocks, class Residual>
void TreeElimination<S>::solve(const T* x, T* y, int m, Blocks&& blocks, const Refinement& how, Residual&& residual) {
  const size_t size = (total_ + border_) * m;
  size_t largest = border_;
  for (const Front& f : fronts_) largest = std::max(largest, size_t(f.n));
  if (work_.size() < largest * m) work_.resize(largest * m);
  const auto at = [&](Place p, int i) { return ((p.front < 0 ? total_ : fronts_[p.front].vector) + p.position + i) * m; };
  right_hand_side(x, m, blocks);
  residual_ = rhs_;
  solve_system(rhs_.data(), m);
  // One step of refinement on the system itself; further ones where they are asked for, or while the correction is large and shrinks.
  using std::abs, std::ldexp;
  const int asked = how.steps == Refinement::automatic ? most_corrections : how.steps;
  const S enough = how.steps ? epsilon<S>() : std::min(S(S(1e6) * epsilon<S>()), S(1e-3));
  S last = S(-1);
  product_.resize(size);
  for (int step = 0; step < std::max(asked, 4); ++step) {
    residual(x, rhs_.data(), product_.data());
    solve_system(product_.data(), m);
    S correction = S(0), solution = S(0);
    for (size_t i = 0; i < total_ + border_; ++i)
      for (int c = 0; c < m; ++c) {
        correction = std::max(correction, S(ldexp(S(abs(product_[i * m + c])), -unit_[i])));
        solution = std::max(solution, S(ldexp(S(abs(rhs_[i * m + c])), -unit_[i])));
      }
    if (step && !(correction < last / S(2))) break;
    for (size_t i = 0; i < size; ++i) rhs_[i] += product_[i];
    if (!(correction > enough * solution)) break;
    last = correction;
  }
  // output
  output_.assign(size_t(r_->codomain.dimension()) * m, S(0));
  for (const Realization::Term& t : r_->outputs) {
    if (!r_->codomain.belongs_to_bodies()) {
      for (int i = 0; i < r_->codomain.dimension(); ++i)
        for (int c = 0; c < m; ++c) output_[i * m + c] += S(t.coefficient) * rhs_[at(state_at_[t.column][0], i) + c];
      continue;
    }
    for (int k = 0; k < tree_.bodies(); ++k)
      elimination::for_rows(r_->codomain, k, [&](int local, int row) {
        const auto source = [&](int i, int c) -> S {
          if (t.column >= 0) return rhs_[at(state_at_[t.column][k], i) + c];
          S value = S(0);
          elimination::for_rows(r_->domain, k, [&](int l, int xr) {
            if (l == i) value = S(x[xr * m + c]);
          });
          return value;
        };
        if (t.right < 0) {
          for (int c = 0; c < m; ++c) output_[row * m + c] += S(t.coefficient) * source(local, c);
        } else {
          const auto& b = blocks(t.right);
          for (int i = 0; i < b.columns[k]; ++i) {
            const S f = S(t.coefficient) * S(b.at(k)[local * b.columns[k] + i]);
            for (int c = 0; c < m; ++c) output_[row * m + c] += f * source(i, c);
          }
        }
      });
  }
  for (size_t i = 0; i < output_.size(); ++i) y[i] = static_cast<T>(output_[i]);
}

}  // namespace pycraft
