// The equations of a realization over a tree, eliminated body by body.
#pragma once

#include <cmath>

#include "matrices.h"
#include "stacking.h"

namespace pycraft::written {

// The class has functions of the same names.
inline Matrix free_solve(const Matrix& A, const Matrix& b) { return solve(A, b); }
inline Matrix free_inverse(const Matrix& A) { return inverse(A); }
inline double free_logdet(const Matrix& A) { return logdet(A); }

// T s = b, its unknowns the states of bodies, coupled to the parent p and the children c alone, and a border b, coupled to all.
// sizes[k]: the sizes of body k's states; border: those of the border's (0 where a state is of the other kind).
class TreeSystem {
 public:
  TreeSystem(const std::vector<int>& parent, Rows sizes, const std::vector<int>& border)
      : parent_(parent), children_(children_of(parent)), n_(size(parent)) {
    sizes.push_back(border);  // the border is the last
    for (const auto& s : sizes) {
      start_.push_back({0});
      for (int i : s) start_.back().push_back(start_.back().back() + i);
    }
    const auto rows = [&](int k) { return start_[k].back(); };
    for (int k = 0; k < n_; ++k) {
      const int up = parent[k] >= 0 ? rows(parent[k]) : 0;
      own_.push_back(Matrix::Zero(rows(k), rows(k)));
      up_.push_back(Matrix::Zero(up, rows(k)));
      down_.push_back(Matrix::Zero(rows(k), up));
      right_.push_back(Matrix::Zero(rows(k), rows(n_)));
      below_.push_back(Matrix::Zero(rows(n_), rows(k)));
    }
    corner_ = Matrix::Zero(rows(n_), rows(n_));
  }

  // Blocks of equation i and state j, to be added to: T(k,k), T(p,k), T(k,p), T(k,b), T(b,k), T(b,b).
  using Block = Eigen::Block<Matrix>;
  Block own(int k, int i, int j) { return view(own_[k], k, i, k, j); }
  Block up(int k, int i, int j) { return view(up_[k], parent_[k], i, k, j); }
  Block down(int k, int i, int j) { return view(down_[k], k, i, parent_[k], j); }
  Block right(int k, int i, int j) { return view(right_[k], k, i, n_, j); }
  Block below(int k, int i, int j) { return view(below_[k], n_, i, k, j); }
  Block corner(int i, int j) { return view(corner_, n_, i, n_, j); }

  Blocks vector(int columns) const {  // zeros: one block per body, the border's last
    Blocks b;
    for (const auto& s : start_) b.push_back(Matrix::Zero(s.back(), columns));
    return b;
  }
  Block part(Blocks& s, int k, int j) const {  // state j of body k; k = -1: of the border
    const int at = k < 0 ? n_ : k;
    return s[at].block(start_[at][j], 0, start_[at][j + 1] - start_[at][j], s[at].cols());
  }

  Blocks solve(const Blocks& b) {  // T⁻¹ b, refined once
    factor();
    Blocks s = sweep(b), r = times(s);
    for (int k = 0; k <= n_; ++k) r[k] = b[k] - r[k];
    r = sweep(r);
    for (int k = 0; k <= n_; ++k) s[k] += r[k];
    return s;
  }

  double logdet() {  // ln|det T| from the pivots
    factor();
    if (one_) return free_logdet(whole_);
    double sum = free_logdet(S_);
    for (const Matrix& a : A_) sum += free_logdet(a);
    return sum;
  }

  Blocks inverse() {  // the diagonal blocks Z(k,k) of T⁻¹, base to tip
    factor();
    Blocks Z(n_), right(n_), below(n_);
    if (one_) {
      const Matrix all = free_inverse(whole_);
      int at = 0;
      for (int k = 0; k < n_; at += start_[k].back(), ++k) Z[k] = all.block(at, at, start_[k].back(), start_[k].back());
      return Z;
    }
    const Matrix S = free_inverse(S_);
    for (int k = 0; k < n_; ++k) {
      const int p = parent_[k];
      const Matrix A = free_inverse(A_[k]);
      Matrix F = X_[k] * S, over = S * Y_[k] * A;
      Z[k] = A;
      if (p >= 0) {
        // N = T(p,k) A⁻¹(k), F = U(k) Z(p,b) + X(k) Z(b,b)
        const Matrix N = up_[k] * A;
        F += U_[k] * right[p];
        over += below[p] * N;
        // Z(k,k) = A⁻¹(k) + (U(k) Z(p,p) + X(k) Z(b,p)) N + F Y(k) A⁻¹(k)
        Z[k] += (U_[k] * Z[p] + X_[k] * below[p]) * N;
      }
      Z[k] += F * Y_[k] * A;
      right[k] = -F;    // Z(k,b)
      below[k] = -over;  // Z(b,k)
    }
    return Z;
  }
  Matrix block(const Blocks& Z, int k, int j, int i) const {  // block (state j, equation i) of Z(k,k)
    const auto& s = start_[k];
    return Z[k].block(s[j], s[i], s[j + 1] - s[j], s[i + 1] - s[i]);
  }

 private:
  Block view(Matrix& T, int row_body, int i, int column_body, int j) {
    const auto &r = start_[row_body], &c = start_[column_body];
    return T.block(r[i], c[j], r[i + 1] - r[i], c[j + 1] - c[j]);
  }

  // Eliminates from the leaves to the root; all at once where a pivot is singular, or nearly.
  void factor() {
    if (factored_) return;
    factored_ = true;
    A_ = U_ = X_ = Y_ = Blocks(n_);
    S_ = corner_;
    for (int k = n_ - 1; k >= 0; --k) {
      // A(k) = T(k,k) - Σ_c T(k,c) U(c), U(k) = A⁻¹(k) T(k,p)
      // X(k) = A⁻¹(k) (T(k,b) - Σ_c T(k,c) X(c)), Y(k) = T(b,k) - Σ_c Y(c) U(c)
      A_[k] = own_[k], X_[k] = right_[k], Y_[k] = below_[k];
      for (int c : children_[k]) {
        A_[k] -= up_[c] * U_[c];
        X_[k] -= up_[c] * X_[c];
        Y_[k] -= Y_[c] * U_[c];
      }
      U_[k] = free_solve(A_[k], down_[k]);
      X_[k] = free_solve(A_[k], X_[k]);
    }
    // S = T(b,b) - Σ_k Y(k) X(k)
    for (int k = 0; k < n_; ++k) S_ -= Y_[k] * X_[k];
    Blocks known = vector(1);
    double lost = 0;
    for (Matrix& s : known)
      for (int i = 0; i < s.rows(); ++i) s(i, 0) = i % 3 == 1 ? -1 : 1;
    const Blocks found = sweep(times(known));
    for (int k = 0; k <= n_; ++k)
      for (int i = 0; i < known[k].rows(); ++i) {
        const double error = std::abs(found[k](i, 0) - known[k](i, 0));
        if (!(error <= lost)) lost = error;
      }
    if (!(lost < 1e-9)) {
      one_ = true;
      whole_ = dense();
    }
  }

  Blocks sweep(const Blocks& b) const {  // T⁻¹ b by the factors
    Blocks t(n_), s = b;
    if (one_) {
      Matrix all(whole_.rows(), b[n_].cols());
      int at = 0;
      for (const Matrix& x : b) all.middleRows(at, x.rows()) = x, at += static_cast<int>(x.rows());
      all = free_solve(whole_, all);
      at = 0;
      for (Matrix& x : s) x = Matrix(all.middleRows(at, x.rows())), at += static_cast<int>(x.rows());
      return s;
    }
    for (int k = n_ - 1; k >= 0; --k) {
      // t(k) = A⁻¹(k) r(k), r(k) = b(k) - Σ_c T(k,c) t(c)
      Matrix r = b[k];
      for (int c : children_[k]) r -= up_[c] * t[c];
      t[k] = free_solve(A_[k], r);
      s[n_] -= Y_[k] * t[k];
    }
    s[n_] = free_solve(S_, s[n_]);
    for (int k = 0; k < n_; ++k) {
      // s(k) = t(k) - X(k) s(b) - U(k) s(p)
      s[k] = t[k] - X_[k] * s[n_];
      if (parent_[k] >= 0) s[k] -= U_[k] * s[parent_[k]];
    }
    return s;
  }

  Blocks times(const Blocks& s) const {  // T s
    Blocks b;
    for (int k = 0; k < n_; ++k) b.push_back(own_[k] * s[k] + right_[k] * s[n_]);
    b.push_back(corner_ * s[n_]);
    for (int k = 0; k < n_; ++k) {
      b[n_] += below_[k] * s[k];
      const int p = parent_[k];
      if (p < 0) continue;
      b[k] += down_[k] * s[p];
      b[p] += up_[k] * s[k];
    }
    return b;
  }

  Matrix dense() const {  // T as one matrix, the border last
    std::vector<int> at = {0};
    for (const auto& s : start_) at.push_back(at.back() + s.back());
    Matrix T = Matrix::Zero(at.back(), at.back());
    const auto set = [&](int i, int j, const Matrix& block) { T.block(at[i], at[j], block.rows(), block.cols()) = block; };
    for (int k = 0; k < n_; ++k) {
      set(k, k, own_[k]), set(k, n_, right_[k]), set(n_, k, below_[k]);
      if (parent_[k] >= 0) set(parent_[k], k, up_[k]), set(k, parent_[k], down_[k]);
    }
    set(n_, n_, corner_);
    return T;
  }

  std::vector<int> parent_;
  Rows children_, start_;
  int n_;
  Blocks own_, up_, down_, right_, below_, A_, U_, X_, Y_;
  Matrix corner_, S_, whole_;
  bool factored_ = false, one_ = false;
};

}  // namespace pycraft::written
