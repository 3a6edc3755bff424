// elimination.h: diagonal blocks of the inverse, base to tip, and the determinant.
#pragma once

#include <algorithm>

#include "algebra/engine/elimination/elimination_assembly.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class S>
void TreeElimination<S>::selected_fronts() {
  z_offset_.assign(1, 0);
  for (const Front& f : fronts_) z_offset_.push_back(z_offset_.back() + size_t(f.n) * f.n + 2 * size_t(f.n) * border_);
  Z_.assign(z_offset_.back(), S(0));
  z_border_.assign(size_t(border_) * border_, S(0));
  for (int i = 0; i < border_; ++i) z_border_[size_t(i) * border_ + i] = S(1);
  size_t largest = border_;
  for (const Front& f : fronts_) largest = std::max(largest, size_t(f.n));
  if (work_.size() < largest * largest) work_.resize(largest * largest);
  if (border_) border_lu_.solve(z_border_.data(), border_, work_.data());
  std::vector<S> inverse, L, outer, UZ;
  for (size_t k = 0; k < fronts_.size(); ++k) {
    const Front& f = fronts_[k];
    check_interrupt();
    const int n = f.n, w = f.width() + border_, h = f.height() + border_;
    inverse.assign(size_t(n) * n, S(0));
    for (int i = 0; i < n; ++i) inverse[size_t(i) * n + i] = S(1);
    lu_[k].solve(inverse.data(), n, work_.data());
    L.assign(size_t(h) * n, S(0));
    multiply_add(A_.data() + f.over, inverse.data(), L.data(), h, n, n);
    // Z over (the parent's touched states, border) x (the parent's touched equations, border)
    outer.assign(size_t(w) * h, S(0));
    const S *zp = nullptr, *zpb = nullptr, *zbp = nullptr;
    int np = 0;
    if (f.parent >= 0) {
      np = fronts_[f.parent].n;
      zp = Z_.data() + z_offset_[f.parent];
      zpb = zp + size_t(np) * np;
      zbp = zpb + size_t(np) * border_;
    }
    for (int i = 0; i < w; ++i)
      for (int j = 0; j < h; ++j) {
        const bool pi = i < f.width(), pj = j < f.height();
        const int bi = i - f.width(), bj = j - f.height();
        outer[size_t(i) * h + j] = pi && pj ? zp[size_t(f.columns[i]) * np + f.rows[j]]
                                   : pi     ? zpb[size_t(f.columns[i]) * border_ + bj]
                                   : pj     ? zbp[size_t(bi) * np + f.rows[j]]
                                            : z_border_[size_t(bi) * border_ + bj];
      }
    UZ.assign(size_t(n) * h, S(0));
    multiply_add(A_.data() + f.across, outer.data(), UZ.data(), n, w, h);
    S* z = Z_.data() + z_offset_[k];
    std::copy(inverse.begin(), inverse.end(), z);
    multiply_add(UZ.data(), L.data(), z, n, h, n);
    S *zkb = z + size_t(n) * n, *zbk = zkb + size_t(n) * border_;
    for (int i = 0; i < n; ++i)
      for (int b = 0; b < border_; ++b) zkb[size_t(i) * border_ + b] = -UZ[size_t(i) * h + f.height() + b];
    for (int b = 0; b < border_; ++b)
      for (int j = 0; j < n; ++j) {
        S sum = S(0);
        for (int a = 0; a < h; ++a) sum += outer[size_t(f.width() + b) * h + a] * L[size_t(a) * n + j];
        zbk[size_t(b) * n + j] = -sum;
      }
  }
}

template <class S>
template <class T>
void TreeElimination<S>::selected(BlockStorage<T>& out) {
  selected_fronts();
  // Inputs and outputs are states of their own (local ends): the block is read off.
  std::fill(out.data.begin(), out.data.end(), T(0));
  for (const Realization::Term& o : r_->outputs)
    for (const Realization::Term& i : r_->inputs)
      for (int k = 0; k < tree_.bodies(); ++k) {
        const Place state = state_at_[o.column][k], equation = equation_at_[i.row][k];
        const int n = fronts_[state.front].n;
        const S* z = Z_.data() + z_offset_[state.front];
        for (int a = 0; a < out.rows[k]; ++a)
          for (int b = 0; b < out.columns[k]; ++b)
            out.at(k)[a * out.columns[k] + b] +=
                static_cast<T>(S(o.coefficient) * S(i.coefficient) * z[size_t(state.position + a) * n + equation.position + b]);
      }
}

template <class S>
S TreeElimination<S>::log_abs_determinant() const {
  Magnitude<S> all;
  for (const SmallLU<S>& lu : lu_) all.multiply(lu.determinant());
  if (border_) all.multiply(border_lu_.determinant());
  return all.log();
}

}  // namespace pycraft
