// elimination.h: right sides, solves and their residuals.
#pragma once

#include <algorithm>

#include "algebra/engine/elimination/elimination_assembly.h"

namespace pycraft {

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
        if (!vanishes(row[a]))
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
        if (vanishes(u)) continue;
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
      if (!vanishes(row[a]))
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
        if (vanishes(line[j])) continue;
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

// The outputs of the states in rhs_, m columns.
template <class S>
template <class T, class Blocks>
void TreeElimination<S>::gather_output(const T* x, int m, Blocks&& blocks) {
  const auto at = [&](Place p, int i) { return ((p.front < 0 ? total_ : fronts_[p.front].vector) + p.position + i) * m; };
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
}

template <class S>
template <class T, class Blocks, class Residual>
void TreeElimination<S>::solve(const T* x, T* y, int m, Blocks&& blocks, const Refinement& how, Residual&& residual) {
  const size_t size = (total_ + border_) * m;
  size_t largest = border_;
  for (const Front& f : fronts_) largest = std::max(largest, size_t(f.n));
  if (work_.size() < largest * m) work_.resize(largest * m);
  right_hand_side(x, m, blocks);
  residual_ = rhs_;
  solve_system(rhs_.data(), m);
  // One step of refinement on the system itself; further ones where they are asked for, or while the correction is large and shrinks.
  using std::abs;
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
        correction = maximum(correction, in_units(S(abs(product_[i * m + c])), i));
        solution = maximum(solution, in_units(S(abs(rhs_[i * m + c])), i));
      }
    if (step && !(correction < last / S(2))) break;
    for (size_t i = 0; i < size; ++i) rhs_[i] += product_[i];
    if (!(correction > enough * solution)) break;
    last = correction;
  }
  gather_output(x, m, blocks);
  for (size_t i = 0; i < output_.size(); ++i) y[i] = static_cast<T>(output_[i]);
}

}  // namespace pycraft
