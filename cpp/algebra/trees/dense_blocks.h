// Blocks of any size per body, as dense row-major matrices: the block policy of bare SKO trees, of compound and flexible bodies.
// The sweeps see the same functions as of the rigid policy (rigid/rigid_blocks.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "algebra/language/source.h"
#include "algebra/language/structure.h"
#include "algebra/language/symbol.h"
#include "algebra/trees/block_policy.h"
#include "algebra/trees/sweeps/factored_inertia.h"
#include "algebra/trees/sweeps/singular_pivot.h"
#include "numerics/small_ldl.h"
#include "numerics/small_matrix.h"
#include "runtime/errors.h"

namespace pycraft {

inline BlockCosts dense_costs(const SkoStructure& tree, int k) {
  const double s = tree.size[k], parent = tree.parent[k] < 0 ? 0 : tree.size[tree.parent[k]];
  return {2 * s * parent, 2 * s * s, 2 * parent * s * s + parent * parent * s, 0, s * s + s * parent, 0, s * s};
}

template <class S>
class DenseBlocks {
 public:
  using Scalar = S;

  explicit DenseBlocks(const SkoStructure& tree) : tree_(tree) {
    size_t e = 0, h = 0, m = 0, d = 0;
    int s_max = 0, n_max = 0;
    for (int k = 0; k < tree.bodies(); ++k) {
      const int s = tree.size[k], n = tree.dof[k], p = tree.parent[k];
      at_.push_back({e, h, m, d});
      e += p >= 0 ? static_cast<size_t>(tree.size[p]) * s : 0;
      h += static_cast<size_t>(n) * s;
      m += static_cast<size_t>(s) * s;
      d += static_cast<size_t>(n) * n;
      s_max = std::max(s_max, s);
      n_max = std::max(n_max, n);
    }
    E.resize(e);
    for (auto* x : {&H, &G}) x->resize(h);
    for (auto* x : {&M, &P, &Pplus, &R, &Y, &X}) x->resize(m);
    for (auto* x : {&J, &D, &L}) x->resize(d);
    pivots_.resize(tree.coordinates());
    work_.resize(std::max(4 * s_max * s_max + n_max * s_max, 2 * n_max));
    error_work_.resize(3 * s_max * s_max);
    uncertain_.resize(tree.bodies());  // of bodies that no sweep has come to, too: the search for a singular pivot asks all
  }

  Form form = Form::fast;
  bool keep_inertias = true, with_bias = false;  // blocks of any size always keep P and P⁺, and know no bias

  S* edge(int k) { return E.data() + at_[k].e; }
  S* hinge_map(int k) { return H.data() + at_[k].h; }
  S* mass(int k) { return M.data() + at_[k].m; }
  S* hinge_diagonal(int k) { return J.data() + at_[k].d; }
  const S* edge(int k) const { return E.data() + at_[k].e; }
  const S* hinge_map(int k) const { return H.data() + at_[k].h; }

  // ---------------------------------------------------------------- applied to vectors (m columns, row-major)
  void shift_add(int k, const S* x, S* y, int m) const { multiply_add(edge(k), x, y, tree_.size[tree_.parent[k]], tree_.size[k], m); }
  void shift_transposed_add(int k, const S* x, S* y, int m) const {
    transposed_multiply_add(edge(k), x, y, tree_.size[k], tree_.size[tree_.parent[k]], m);
  }
  // y += E (x - G H x)
  void articulated_shift_add(int k, const S* x, S* y, int m) const {
    const int s = tree_.size[k], n = tree_.dof[k];
    thread_local std::vector<S> w;
    w.assign(x, x + s * m);
    thread_local std::vector<S> hx;
    hx.assign(n * m, S(0));
    multiply_add(hinge_map(k), x, hx.data(), n, s, m);
    transposed_multiply_add(gain(k), hx.data(), w.data(), s, n, m, S(-1));
    shift_add(k, w.data(), y, m);
  }
  // y += (I - H*G*) E* x
  void articulated_shift_transposed_add(int k, const S* x, S* y, int m) const {
    const int s = tree_.size[k], n = tree_.dof[k];
    thread_local std::vector<S> w, gw;
    w.assign(s * m, S(0));
    shift_transposed_add(k, x, w.data(), m);
    gw.assign(n * m, S(0));
    multiply_add(gain(k), w.data(), gw.data(), n, s, m);
    transposed_multiply_add(hinge_map(k), gw.data(), w.data(), s, n, m, S(-1));
    for (int i = 0; i < s * m; ++i) y[i] += w[i];
  }
  void hinge(int k, const S* x, S* y, int m) const {
    std::fill_n(y, tree_.dof[k] * m, S(0));
    multiply_add(hinge_map(k), x, y, tree_.dof[k], tree_.size[k], m);
  }
  void hinge_transposed_add(int k, const S* x, S* y, int m) const { transposed_multiply_add(hinge_map(k), x, y, tree_.size[k], tree_.dof[k], m); }
  void hinge_diagonal_add(int k, const S* x, S* y, int m) const { multiply_add(J.data() + at_[k].d, x, y, tree_.dof[k], tree_.dof[k], m); }
  void inertia_in_place(int k, S* x, int m) const {
    thread_local std::vector<S> w;
    w.assign(x, x + tree_.size[k] * m);
    std::fill_n(x, tree_.size[k] * m, S(0));
    multiply_add(M.data() + at_[k].m, w.data(), x, tree_.size[k], tree_.size[k], m);
  }
  // e = x - H z,  z += G e
  void innovation(int k, const S* x, S* z, S* e, int m) const {
    std::copy_n(x, tree_.dof[k] * m, e);
    multiply_add(hinge_map(k), z, e, tree_.dof[k], tree_.size[k], m, S(-1));
    transposed_multiply_add(gain(k), e, z, tree_.size[k], tree_.dof[k], m);
  }
  // y -= G* a
  void gain_transposed_subtract(int k, const S* a, S* y, int m) const { multiply_add(gain(k), a, y, tree_.dof[k], tree_.size[k], m, S(-1)); }
  void solve_D_in_place(int k, S* x, int m) const {
    ldl_solve(L.data() + at_[k].d, pivots_.data() + tree_.dof_offset[k], tree_.dof[k], x, m);
  }
  // y = A(k) x or A(k)* x of a block-diagonal symbol
  void apply(SymbolId id, bool transposed, int k, const S* x, S* y, int m) const {
    const int s = tree_.size[k], n = tree_.dof[k];
    switch (id) {
      case SymbolId::H:
        if (transposed) {
          std::fill_n(y, s * m, S(0));
          transposed_multiply_add(hinge_map(k), x, y, s, n, m);
        } else {
          hinge(k, x, y, m);
        }
        return;
      case SymbolId::G:  // stored as G*, n rows
        std::fill_n(y, (transposed ? n : s) * m, S(0));
        if (transposed)
          multiply_add(gain(k), x, y, n, s, m);
        else
          transposed_multiply_add(gain(k), x, y, s, n, m);
        return;
      case SymbolId::J:
      case SymbolId::D:
        std::fill_n(y, n * m, S(0));
        multiply_add((id == SymbolId::J ? J : D).data() + at_[k].d, x, y, n, n, m);
        return;
      default:
        std::fill_n(y, s * m, S(0));
        multiply_add(square(id).data() + at_[k].m, x, y, s, s, m);
    }
  }
  // Block (k,k), row-major; E: block (parent, k).
  void block(SymbolId id, int k, S* out) const {
    const int s = tree_.size[k], n = tree_.dof[k];
    switch (id) {
      case SymbolId::E: std::copy_n(edge(k), tree_.size[tree_.parent[k]] * s, out); return;
      case SymbolId::H: std::copy_n(hinge_map(k), n * s, out); return;
      case SymbolId::G:
        for (int i = 0; i < s; ++i)
          for (int j = 0; j < n; ++j) out[i * n + j] = gain(k)[j * s + i];
        return;
      case SymbolId::J: std::copy_n(J.data() + at_[k].d, n * n, out); return;
      case SymbolId::D: std::copy_n(D.data() + at_[k].d, n * n, out); return;
      default: std::copy_n(square(id).data() + at_[k].m, s * s, out);
    }
  }
  // ---------------------------------------------------------------- sizes of what residuals add up (sweeps/residual_rounding.h)
  void motion_sizes(int k, const S* parent, const S* x, const S* a, S* out, int m) const {
    using std::abs;
    for (int i = 0; i < tree_.size[k] * m; ++i) out[i] = abs(a[i]);
    if (parent) carried_motion_sizes(k, parent, out, m);
    add_sizes<true>(hinge_map(k), S(1), x, out, tree_.size[k], tree_.dof[k], m);
  }
  void carried_motion_sizes(int k, const S* parent, S* out, int m) const {
    add_sizes<true>(edge(k), S(1), parent, out, tree_.size[k], tree_.size[tree_.parent[k]], m);
  }
  template <class Units>
  void inertia_sizes(int k, const S* a, const Units& u, S* out, int m) const {
    std::fill_n(out, tree_.size[k] * m, S(0));
    add_sizes<false>(M.data() + at_[k].m, S(S(2) * u.force), a, out, tree_.size[k], tree_.size[k], m);
  }
  template <class Units>
  void shifted_force_sizes(int k, const S* f, const Units& u, S* out, int m) const {
    add_sizes<false>(edge(k), u.motion, f, out, tree_.size[tree_.parent[k]], tree_.size[k], m);
  }
  template <class Units>
  void coordinate_sizes(int k, const S* f, const S* x, const Units& u, S* out, int m) const {
    std::fill_n(out, tree_.dof[k] * m, S(0));
    add_sizes<false>(hinge_map(k), u.motion, f, out, tree_.dof[k], tree_.size[k], m);
    add_sizes<false>(J.data() + at_[k].d, u.force, x, out, tree_.dof[k], tree_.dof[k], m);
  }
  // Pivots d of D(k) = L d L*.
  const S* pivots(int k) const { return pivots_.data() + tree_.dof_offset[k]; }

  // ---------------------------------------------------------------- articulated inertia (sweeps/articulated_inertia.h)
  void start_articulated(int k) {
    if (form == Form::fast) {
      std::copy_n(mass(k), tree_.size[k] * tree_.size[k], P.data() + at_[k].m);
      return;
    }
    if (!factors_) factors_ = std::make_unique<FactoredInertia<S>>(tree_);
    factors_->start(k);
    uncertain_[k] = add_factors("M", k, mass(k), tree_.size[k], [&](const S& w, auto u) { factors_->add(k, w, S(0), u); });
  }
  Pivots eliminate_hinge(int k);
  void articulated_to_parent(int k) {
    const int p = tree_.parent[k], s = tree_.size[k];
    if (form == Form::fast) return congruence_add(k, Pplus.data() + at_[k].m, P.data() + at_[p].m);
    for (int r = tree_.dof[k]; r < factors_->pivots(); ++r)
      factors_->add(p, factors_->weight(r), S(0), [&](int i) {
        S sum = S(0);
        for (int a = 0; a < s; ++a) sum += edge(k)[i * s + a] * factors_->U(a, r);
        return sum;
      });
  }
  // ---------------------------------------------------------------- error bound (sweeps/singular_pivot.h)
  void start_error(int k);
  void check_pivots(int k);
  void error_to_parent(int k) { congruence_add(k, error_left(k), X.data() + at_[tree_.parent[k]].m); }

  // ---------------------------------------------------------------- for neighbours of another kind (trees/mixed_blocks.h)
  void carried(Carried what, int k, S* out) {
    const S* A = what == Carried::articulated ? Pplus.data() + at_[k].m : what == Carried::composite ? R.data() + at_[k].m : error_left(k);
    std::copy_n(A, tree_.size[k] * tree_.size[k], out);
  }
  void take(Carried what, int p, const S* A) {
    S* to = (what == Carried::articulated ? P : what == Carried::composite ? R : X).data() + at_[p].m;
    for (int i = 0; i < tree_.size[p] * tree_.size[p]; ++i) to[i] += A[i];
  }
  template <class F>
  void carried_columns(int k, F&& f) {
    for (int r = tree_.dof[k]; r < factors_->pivots(); ++r) f(factors_->weight(r), [&](int i) { return factors_->U(i, r); });
  }
  template <class Column>
  void take_column(int p, const S& weight, Column&& u) {
    factors_->add(p, weight, S(0), u);
  }
  void compliance_from(int k, const S* seen) {
    const int s = tree_.size[k];
    S *y = Y.data() + at_[k].m, *bar = error_work_.data(), *t = bar + s * s;
    std::fill_n(bar, 2 * s * s, S(0)), std::fill_n(y, s * s, S(0));
    for (int i = 0; i < s; ++i) bar[i * s + i] = S(1);
    transposed_multiply_add(gain(k), hinge_map(k), bar, s, tree_.dof[k], s, S(-1));
    multiply_add(seen, bar, t, s, s, s);
    transposed_multiply_add(bar, t, y, s, s, s);
    add_hinge_compliance(k, y);
  }

  // ---------------------------------------------------------------- composite inertia, compliance
  void start_composite(int k) { std::copy_n(mass(k), tree_.size[k] * tree_.size[k], R.data() + at_[k].m); }
  void composite_to_parent(int k) { congruence_add(k, R.data() + at_[k].m, R.data() + at_[tree_.parent[k]].m); }
  void compliance_from_parent(int k, int p) {
    const int s = tree_.size[k], n = tree_.dof[k];
    S *y = Y.data() + at_[k].m, *t = work_.data();
    std::fill_n(y, s * s, S(0));
    if (p >= 0) {  // τ̄* E* Υ(p) E τ̄
      const int sp = tree_.size[p];
      S *e = t + s * s, *w = e + sp * s;
      std::copy_n(edge(k), sp * s, e);                                         // E τ̄ = E - (EG)H
      std::fill_n(w, sp * s, S(0));
      for (int i = 0; i < sp; ++i)
        for (int j = 0; j < n; ++j) {
          S eg = S(0);
          for (int a = 0; a < s; ++a) eg += edge(k)[i * s + a] * gain(k)[j * s + a];
          for (int a = 0; a < s; ++a) e[i * s + a] -= eg * hinge_map(k)[j * s + a];
        }
      multiply_add(Y.data() + at_[p].m, e, w, sp, sp, s);
      transposed_multiply_add(e, w, y, s, sp, s);
    }
    add_hinge_compliance(k, y);
  }

 private:
  struct Offsets {
    size_t e, h, m, d;
  };
  const S* gain(int k) const { return G.data() + at_[k].h; }  // G*, n x s
  const S* error_left(int k);
  // y += H*D⁻¹H
  void add_hinge_compliance(int k, S* y) {
    const int s = tree_.size[k], n = tree_.dof[k];
    S* t = work_.data();
    std::copy_n(hinge_map(k), n * s, t);
    forward_substitute(L.data() + at_[k].d, n, t, s);
    add_squares(t, pivots_.data() + tree_.dof_offset[k], y, n, s, S(1));
  }
  // A (s x s) += f Σ a* a / d of the n rows a of t, symmetric.
  static void add_squares(const S* t, const S* d, S* A, int n, int s, const S& f) {
    for (int j = 0; j < n; ++j)
      for (int a = 0; a < s; ++a) {
        const S scaled = f * t[j * s + a] / d[j];
        for (int b = 0; b <= a; ++b) A[a * s + b] += scaled * t[j * s + b];
      }
    symmetrise(A, s);
  }
  // out (r x m) += u |A| |x|, A (r x n); transposed: u |A*| |x|, A (n x r)
  template <bool transposed>
  static void add_sizes(const S* A, const S& u, const S* x, S* out, int r, int n, int m) {
    using std::abs;
    for (int i = 0; i < r; ++i)
      for (int k = 0; k < n; ++k) {
        const S a = u * S(abs(transposed ? A[k * r + i] : A[i * n + k]));
        for (int c = 0; c < m; ++c) out[i * m + c] += a * S(abs(x[k * m + c]));
      }
  }
  template <class Add>
  bool add_factors(const char* letter, int k, const S* A, int n, Add&& add);
  Pivots eliminate_hinge_of_factors(int k);
  const std::vector<S>& square(SymbolId id) const {
    switch (id) {
      case SymbolId::M: return M;
      case SymbolId::P: return P;
      case SymbolId::P_plus: return Pplus;
      case SymbolId::R: return R;
      default: return Y;
    }
  }
  // A(parent) += E B E*, kept symmetric.
  void congruence_add(int k, const S* B, S* A) {
    const int s = tree_.size[k], sp = tree_.size[tree_.parent[k]];
    S* t = work_.data();
    std::fill_n(t, sp * s, S(0));
    multiply_add(edge(k), B, t, sp, s, s);
    for (int i = 0; i < sp; ++i)
      for (int j = 0; j <= i; ++j) {
        S sum = S(0);
        for (int a = 0; a < s; ++a) sum += t[i * s + a] * edge(k)[j * s + a];
        A[i * sp + j] += sum;
        if (j < i) A[j * sp + i] = A[i * sp + j];
      }
  }

  const SkoStructure& tree_;
  std::vector<Offsets> at_;
  std::vector<S> E, H, G, M, P, Pplus, R, Y, X, J, D, L, pivots_, work_, error_work_, factor_work_;
  std::vector<int> none_;
  std::unique_ptr<FactoredInertia<S>> factors_;
  std::vector<char> uncertain_;
};

}  // namespace pycraft

#include "algebra/trees/dense_elimination.h"
