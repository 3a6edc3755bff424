// elimination.h: how many digits a solve loses, by solves whose solutions are known, in the units that states take there.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "algebra/engine/elimination/elimination_assembly.h"

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
        if (const Soft<S> a = abs(soft(original_[f.across + size_t(i) * across + j])); a > Soft<S>(0)) {
          int& size = shift_[scales.part_of_row(i)];
          size = std::max(size, static_cast<int>(ilogb(a)) + scales.row(i) + unit_[outside(j, f.columns)]);
        }
    for (int i = 0; i < f.height() + border_; ++i)
      for (int j = 0; j < f.n; ++j)
        if (const Soft<S> a = abs(soft(original_[f.over + size_t(i) * f.n + j])); a > Soft<S>(0)) {
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

// x in the unit of state i. Recorded units are what they are at each state, no powers of two.
template <class S>
S TreeElimination<S>::in_units(const S& x, size_t i) const {
  using std::ldexp;
  if constexpr (is_recorded<S>)
    return x * natural_[i];
  else
    return ldexp(x, -unit_[i]);
}

// The unit of a state at a body becomes the size that it takes in a solution.
template <class S>
void TreeElimination<S>::take_units(const S* solution) {
  using std::abs, std::ilogb, std::ldexp;
  if constexpr (is_recorded<S>) {
    natural_.clear();
    for (int unit : unit_) natural_.push_back(ldexp(S(1), -unit));
  }
  for (size_t j = 0; j < r_->states.size(); ++j)
    for (size_t k = 0; k < state_at_[j].size(); ++k) {
      const Place p = state_at_[j][k];
      const size_t first = (p.front < 0 ? total_ : fronts_[p.front].vector) + p.position;
      const size_t end = first + (r_->states[j].belongs_to_bodies() ? r_->states[j].body_size(static_cast<int>(k)) : r_->states[j].dimension());
      if constexpr (is_recorded<S>) {
        S largest = S(0);
        for (size_t i = first; i < end; ++i) largest = maximum(largest, in_units(S(abs(solution[i])), i));
        if (!(soft(largest) > Soft<S>(0))) continue;
        const S inverse = S(1) / largest;
        for (size_t i = first; i < end; ++i) natural_[i] *= inverse;
      } else {
        constexpr int none = std::numeric_limits<int>::min();
        int size = none;  // in exponents: units may be further apart than numbers can be
        for (size_t i = first; i < end; ++i)
          if (const S a = abs(solution[i]); a > S(0) && a <= std::numeric_limits<S>::max()) size = std::max(size, static_cast<int>(ilogb(a)) - unit_[i]);
        if (size == none) continue;
        for (size_t i = first; i < end; ++i) unit_[i] += size;
      }
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
    const S e = in_units(S(abs(S(rhs_[i] - residual_[i]))), i);
    error = larger_or_odd(error, e);
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
  const auto largest = [](S& target, const S& entry, const S& x) { target = maximum(target, S(abs(entry * x))); };
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
      for (int c = 0; c < m; ++c) most = maximum(most, S(abs(solution_[i * m + c])));
    });
    of_one_kind(static_cast<int>(j), [&](size_t i) { std::fill_n(solution_.begin() + i * m, m, most); });
  }
  backward_.assign(size * m, S(0));
  over_products(solution_.data(), backward_.data(), m, largest);
  for (size_t i = 0; i < size * m; ++i)
    if (const S r = abs(residual_[i]); r > tolerated * probe_[i] && r > S(1000) * epsilon<S>() * backward_[i]) return false;
  return true;
}

}  // namespace pycraft
