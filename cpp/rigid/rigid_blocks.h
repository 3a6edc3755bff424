// The rigid-body block policy: φ(p,k) is a rotation and a vector, M(k) ten numbers, P(k), R(k), Υ(k) twenty-one, H(k) one row of six
// per coordinate. The same functions as DenseBlocks (algebra/trees/dense_blocks.h), on flat arrays in body order; no 6x6 product anywhere.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "algebra/language/source.h"
#include "algebra/language/structure.h"
#include "algebra/language/symbol.h"
#include "algebra/trees/block_policy.h"
#include "algebra/trees/sweeps/singular_pivot.h"
#include "model/compiled_model.h"
#include "numerics/small_ldl.h"
#include "rigid/rigid_factors.h"
#include "spatial/symmetric6.h"
#include "spatial/sizes.h"
#include "spatial/wide_force.h"

namespace pycraft {

// Column c of six rows of m columns.
template <class S>
inline Vector6<S> load(const S* x, int m, int c) {
  return {{x[c], x[m + c], x[2 * m + c]}, {x[3 * m + c], x[4 * m + c], x[5 * m + c]}};
}
template <class S>
inline void store(const Vector6<S>& v, S* y, int m, int c) {
  for (int i = 0; i < 6; ++i) y[i * m + c] = v[i];
}
template <class S>
inline void add_to(const Vector6<S>& v, S* y, int m, int c) {
  for (int i = 0; i < 6; ++i) y[i * m + c] += v[i];
}

// A rotation of a vector 15, φ 45, a rigid inertia 45, φ A φ* of a symmetric A 250.
inline BlockCosts rigid_costs(const SkoStructure& tree, int k) {
  const bool carried = tree.parent[k] >= 0;
  return {carried ? 45.0 : 0.0, 45, carried ? 250.0 : 0.0, 60, 22, 30, 21};
}

template <class S>
class RigidBlocks {
 public:
  using Scalar = S;

  explicit RigidBlocks(const SkoStructure& tree) : tree_(tree) {
    const size_t n = tree.bodies(), N = tree.coordinates();
    pose.resize(n);
    inertia.resize(n);
    for (auto* x : {&P, &Pplus, &R, &Y}) x->resize(n);
    for (auto* x : {&H, &G, &W}) x->resize(N);
    J.resize(N);
    pivots_.resize(N);
    aligned.assign(N, -1);
    mass_.resize(n), rotational_.resize(n), reach_.resize(n), lever_.resize(n), error_.resize(n), growth_.resize(n);
    for (int dof : tree.dof) pivot_work_.resize(std::max(pivot_work_.size(), 3 * size_t(dof)));
    size_t d = 0;
    for (size_t k = 0; k < n; ++k) {
      d_.push_back(d);
      d += size_t(tree.dof[k]) * tree.dof[k];
    }
    D.resize(d), L.resize(d);
  }

  // ---- what a model fills in
  std::vector<Pose<S>> pose;              // X_pk
  std::vector<Vector6<S>> H;              // rows, one per coordinate
  std::vector<RigidInertia<S>> inertia;
  std::vector<S> J;                       // rotor inertia per coordinate
  std::vector<int> aligned;               // coordinate axis that a row of H is exactly, or -1
  const std::vector<InertiaFactors<S>>* inertia_factors = nullptr;
  // ---- how the articulated inertia is computed
  Form form = Form::fast;
  bool keep_inertias = true;              // P and P⁺ themselves are wanted (always there in the fast form)
  bool with_bias = false;                 // factored forms: gyroscopic forces and Coriolis accelerations go with the columns

  // ---------------------------------------------------------------- applied to vectors
  void shift_add(int k, const S* x, S* y, int m) const {
    for (int c = 0; c < m; ++c) add_to(force_to_parent(pose[k], load(x, m, c)), y, m, c);
  }
  void shift_transposed_add(int k, const S* x, S* y, int m) const {
    for (int c = 0; c < m; ++c) add_to(motion_to_child(pose[k], load(x, m, c)), y, m, c);
  }
  void articulated_shift_add(int k, const S* x, S* y, int m) const {  // y += E (x - G H x)
    for (int c = 0; c < m; ++c) {
      const Vector6<S> xc = load(x, m, c);
      Vector6<S> w = xc;
      for (int j = first(k); j < last(k); ++j) w = w - dot(H[j], xc) * G[j];
      add_to(force_to_parent(pose[k], w), y, m, c);
    }
  }
  void articulated_shift_transposed_add(int k, const S* x, S* y, int m) const {  // y += (I - H*G*) E* x
    for (int c = 0; c < m; ++c) {
      const Vector6<S> w = motion_to_child(pose[k], load(x, m, c));
      Vector6<S> v = w;
      for (int j = first(k); j < last(k); ++j) v = v - dot(G[j], w) * H[j];
      add_to(v, y, m, c);
    }
  }
  void hinge(int k, const S* x, S* y, int m) const {
    for (int c = 0; c < m; ++c) {
      const Vector6<S> xc = load(x, m, c);
      for (int j = first(k); j < last(k); ++j) y[(j - first(k)) * m + c] = dot(H[j], xc);
    }
  }
  void hinge_transposed_add(int k, const S* x, S* y, int m) const {
    for (int c = 0; c < m; ++c)
      for (int j = first(k); j < last(k); ++j) add_to(x[(j - first(k)) * m + c] * H[j], y, m, c);
  }
  void hinge_diagonal_add(int k, const S* x, S* y, int m) const {
    for (int j = first(k); j < last(k); ++j)
      for (int c = 0; c < m; ++c) y[(j - first(k)) * m + c] += J[j] * x[(j - first(k)) * m + c];
  }
  void inertia_in_place(int k, S* x, int m) const {
    for (int c = 0; c < m; ++c) store(inertia[k] * load(x, m, c), x, m, c);
  }
  void innovation(int k, const S* x, S* z, S* e, int m) const {  // e = x - H z, z += G e
    for (int c = 0; c < m; ++c) {
      Vector6<S> zc = load(z, m, c), w = zc;
      for (int j = first(k); j < last(k); ++j) {
        const int i = j - first(k);
        const S innovation = x[i * m + c] - dot(H[j], zc);
        e[i * m + c] = innovation;
        w = w + innovation * G[j];
      }
      store(w, z, m, c);
    }
  }
  void gain_transposed_subtract(int k, const S* a, S* y, int m) const {
    for (int c = 0; c < m; ++c) {
      const Vector6<S> ac = load(a, m, c);
      for (int j = first(k); j < last(k); ++j) y[(j - first(k)) * m + c] -= dot(G[j], ac);
    }
  }
  void solve_D_in_place(int k, S* x, int m) const {
    const int n = tree_.dof[k];
    if (n == 1) {
      for (int c = 0; c < m; ++c) x[c] /= D[d_[k]];
      return;
    }
    ldl_solve(L.data() + d_[k], pivots_.data() + first(k), n, x, m);
  }
  void apply(SymbolId id, bool transposed, int k, const S* x, S* y, int m) const {
    const int n = tree_.dof[k];
    switch (id) {
      case SymbolId::H:
      case SymbolId::G: {
        const std::vector<Vector6<S>>& rows = id == SymbolId::H ? H : G;
        const bool to_six = (id == SymbolId::H) == transposed;
        if (to_six) {
          std::fill_n(y, 6 * m, S(0));
          for (int c = 0; c < m; ++c)
            for (int j = first(k); j < last(k); ++j) add_to(x[(j - first(k)) * m + c] * rows[j], y, m, c);
        } else {
          for (int c = 0; c < m; ++c) {
            const Vector6<S> xc = load(x, m, c);
            for (int j = first(k); j < last(k); ++j) y[(j - first(k)) * m + c] = dot(rows[j], xc);
          }
        }
        return;
      }
      case SymbolId::J:
        std::fill_n(y, n * m, S(0));
        hinge_diagonal_add(k, x, y, m);
        return;
      case SymbolId::D:
        for (int i = 0; i < n; ++i)
          for (int c = 0; c < m; ++c) {
            S sum = S(0);
            for (int j = 0; j < n; ++j) sum += D[d_[k] + i * n + j] * x[j * m + c];
            y[i * m + c] = sum;
          }
        return;
      case SymbolId::M:
        for (int c = 0; c < m; ++c) store(inertia[k] * load(x, m, c), y, m, c);
        return;
      default: {
        const Symmetric6<S>& A = six(id, k);
        for (int c = 0; c < m; ++c) store(A * load(x, m, c), y, m, c);
      }
    }
  }
  void block(SymbolId id, int k, S* out) const {
    const int n = tree_.dof[k];
    switch (id) {
      case SymbolId::E: {
        const Matrix3<S> lR = skew(pose[k].p) * pose[k].R;
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) {
            out[i * 6 + j] = out[(i + 3) * 6 + j + 3] = pose[k].R(i, j);
            out[i * 6 + j + 3] = lR(i, j);
            out[(i + 3) * 6 + j] = S(0);
          }
        return;
      }
      case SymbolId::H:
        for (int j = 0; j < n; ++j)
          for (int i = 0; i < 6; ++i) out[j * 6 + i] = H[first(k) + j][i];
        return;
      case SymbolId::G:
        for (int j = 0; j < n; ++j)
          for (int i = 0; i < 6; ++i) out[i * n + j] = G[first(k) + j][i];
        return;
      case SymbolId::J:
        std::fill_n(out, n * n, S(0));
        for (int j = 0; j < n; ++j) out[j * n + j] = J[first(k) + j];
        return;
      case SymbolId::D: std::copy_n(D.data() + d_[k], n * n, out); return;
      default: {
        const Symmetric6<S> A = id == SymbolId::M ? symmetric6(inertia[k]) : six(id, k);
        for (int i = 0; i < 6; ++i)
          for (int j = 0; j < 6; ++j) out[i * 6 + j] = A(i, j);
      }
    }
  }
  // ---------------------------------------------------------------- forces in a wider scalar T
  template <class T>
  void inertia_wide(int k, const std::vector<MassProperties>& masses, const S* a, T* f, int m) const;
  template <class T>
  void shift_add_wide(int k, const T* x, T* y, int m) const;
  template <class T>
  void residual_wide(int k, const T* f, const S* x, const S* b, S* r, int m) const;

  // ---------------------------------------------------------------- sizes of what residuals add up (algebra/trees/sweeps/residual_rounding.h)
  bool exact_pose(int k) const;
  void motion_sizes(int k, const S* parent, const S* x, const S* a, S* out, int m) const;
  template <class Units>
  void inertia_sizes(int k, const S* a, const Units& u, S* out, int m) const;
  template <class Units>
  void shifted_force_sizes(int k, const S* f, const Units& u, S* out, int m) const;
  template <class Units>
  void coordinate_sizes(int k, const S* f, const S* x, const Units& u, S* out, int m) const;

  // Pivots d of D(k) = L d L*.
  const S* pivots(int k) const { return pivots_.data() + first(k); }

  // ---------------------------------------------------------------- articulated inertia
  void start_articulated(int k) {
    if (form == Form::fast) {
      P[k] = symmetric6(inertia[k]);
    } else {
      if (!factors_) factors_ = std::make_unique<RigidFactors<S>>(tree_);
      factors_->start(k, (*inertia_factors)[k]);
    }
    mass_[k] = inertia[k].mass;
    rotational_[k] = inertia[k].rotational.s[0] + inertia[k].rotational.s[3] + inertia[k].rotational.s[5] + uncertain(k);
    reach_[k] = S(0);
    lever_[k] = ratio_or_zero(longest(inertia[k].moment), inertia[k].mass);
    error_[k] = S(0), growth_[k] = S(1);
    if (k == tree_.bodies() - 1) faint_ = {};  // the first that any sweep eliminates
  }
  // D, G, P⁺ of body k; doubtful where a pivot is so small that only the error sweep can tell whether it is noise.
  Pivots eliminate_hinge(int k) {
    if (form == Form::fast) {
      if (!eliminate_hinge_of_inertia(k)) return Pivots::not_positive;
    } else {
      if (keep_inertias) P[k] = factors_->inertia(k);
      const int f = first(k);
      if (!factors_->eliminate(k, form, H.data() + f, J.data() + f, aligned.data() + f, with_bias, G.data() + f, D.data() + d_[k], L.data() + d_[k],
                               pivots_.data() + f))
        return Pivots::not_positive;
      if (keep_inertias) Pplus[k] = factors_->plus(k);
    }
    return doubtful(k) ? Pivots::doubtful : Pivots::sound;
  }
  void articulated_to_parent(int k) {
    const int p = tree_.parent[k];
    if (form == Form::fast)
      pycraft::add(P[p], to_parent(pose[k], Pplus[k]));
    else
      factors_->to_parent(k, pose[k]);
    using std::abs;
    const Vector3<S>& l = pose[k].p;
    lever_[p] = maximum(lever_[p], maximum(lever_[k], longest(l)));
    mass_[p] += mass_[k];
    rotational_[p] += rotational_[k];
    reach_[p] = maximum(reach_[p], S(reach_[k] + abs(l[0]) + abs(l[1]) + abs(l[2])));
    error_[p] = maximum(error_[p], error_[k]), growth_[p] = maximum(growth_[p], growth_[k]);
  }
  RigidFactors<S>& factors() { return *factors_; }
  // The faintest coordinate of the last sweep (algebra/trees/sweeps/singular_pivot.h); body -1: none.
  const FaintPivot& faint() const { return faint_; }
  // ---------------------------------------------------------------- error bound
  void start_error(int k);
  void check_pivots(int k);
  void error_to_parent(int k) { pycraft::add(X_[tree_.parent[k]], to_parent(pose[k], error_left(k))); }

  // ---------------------------------------------------------------- composite inertia, compliance
  void start_composite(int k) { R[k] = symmetric6(inertia[k]); }
  void composite_to_parent(int k) { pycraft::add(R[tree_.parent[k]], to_parent(pose[k], R[k])); }
  void compliance_from_parent(int k, int p) {
    // τ̄* (E*Υ(p)E) τ̄ + H*D⁻¹H
    Y[k] = p < 0 ? Symmetric6<S>::zero() : projected(compliance_to_child(pose[k], Y[p]), G, H, k);
    add_hinge_compliance(k);
  }

  // ---------------------------------------------------------------- for neighbours of another kind (algebra/trees/mixed_blocks.h)
  void carried(Carried what, int k, S* out) const {
    const Symmetric6<S> A = what == Carried::articulated ? Pplus[k] : what == Carried::composite ? R[k] : error_left(k);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) out[i * 6 + j] = A(i, j);
  }
  void take(Carried what, int p, const S* A) {
    pycraft::add(what == Carried::articulated ? P[p] : what == Carried::composite ? R[p] : X_[p],
                 symmetric6_of<S>([&](int i, int j) { return A[i * 6 + j]; }));
  }
  template <class F>
  void carried_columns(int k, F&& f) {
    factors_->carried_columns(k, f);
  }
  template <class Column>
  void take_column(int p, const S& weight, Column&& u) {
    factors_->take_column(p, weight, u);
  }
  void compliance_from(int k, const S* seen) {
    Y[k] = projected(symmetric6_of<S>([&](int i, int j) { return seen[i * 6 + j]; }), G, H, k);
    add_hinge_compliance(k);
  }

  std::vector<Symmetric6<S>> P, Pplus, R, Y;
  std::vector<Vector6<S>> G;   // columns of G, one per coordinate
  std::vector<S> D, L;         // n_k x n_k per body: D(k) and L of its factors LdL*, d the pivots
  const std::vector<size_t>& d_offsets() const { return d_; }  // where D(k) and L begin

 private:
  Symmetric6<S> error_left(int k) const;
  // Υ(k) += H*D⁻¹H
  void add_hinge_compliance(int k) {
    const int n = tree_.dof[k], f = first(k);
    if (n == 1) {
      Vector6<S> h = (S(1) / D[d_[k]]) * H[f];
      add_symmetric_product(Y[k], S(0.5) * h, H[f]);
      return;
    }
    for (int i = 0; i < n; ++i) {  // L⁻¹H
      W[f + i] = H[f + i];
      for (int a = 0; a < i; ++a) W[f + i] = W[f + i] - L[d_[k] + i * n + a] * W[f + a];
      const Vector6<S> scaled = (S(1) / pivots_[f + i]) * W[f + i];
      add_symmetric_product(Y[k], S(0.5) * scaled, W[f + i]);
    }
  }

  int first(int k) const { return tree_.dof_offset[k]; }
  int last(int k) const { return tree_.dof_offset[k + 1]; }
  const Symmetric6<S>& six(SymbolId id, int k) const {
    switch (id) {
      case SymbolId::P: return P[k];
      case SymbolId::P_plus: return Pplus[k];
      case SymbolId::R: return R[k];
      default: return Y[k];
    }
  }
  bool eliminate_hinge_of_inertia(int k);
  bool doubtful(int k);
  void note_faint(int k, const S* own, S* squares, S* w);
  // P(3,3) + P(4,4) + P(5,5)
  S linear_trace(int k) const { return form == Form::fast ? S(P[k].C(0, 0) + P[k].C(1, 1) + P[k].C(2, 2)) : factors_->linear_trace(); }
  static S longest(const Vector3<S>& l) {
    using std::abs;
    return maximum(S(abs(l[0])), maximum(S(abs(l[1])), S(abs(l[2]))));
  }
  // In units of the rounding bound: what factors of the body's inertia leave out. The plain form rounds at more than that.
  S uncertain(int k) const { return form == Form::fast ? S(0) : S((*inertia_factors)[k].uncertain / rounding_bound<S>(form)); }
  static S largest_growth(Form form) {
    static const S growth[] = {of_fifth_root(Form::fast), of_fifth_root(Form::ud), of_fifth_root(Form::square_root)};
    return growth[static_cast<int>(form)];
  }
  static S of_fifth_root(Form form) { return S(std::pow(double(to_double(rounding_bound<S>(form))), -0.2)); }
  S own_rounding(int k, const Vector6<S>& h) const;
  bool no_hinge_diagonal(int k) const {
    for (int j = first(k); j < last(k); ++j)
      if (!(J[j] == S(0))) return false;
    return true;
  }
  Symmetric6<S> projected(const Symmetric6<S>& A, const std::vector<Vector6<S>>& a, const std::vector<Vector6<S>>& b, int k) const;

  const SkoStructure& tree_;
  std::vector<size_t> d_;
  std::vector<S> pivots_, pivot_work_, mass_, rotational_, reach_, lever_, error_, growth_;  // of what a body carries; lever: its longest piece
  FaintPivot faint_;
  std::vector<Vector6<S>> W;
  std::vector<Symmetric6<S>> X_;
  std::unique_ptr<RigidFactors<S>> factors_;
};

#define PYCRAFT_EXTERN(S) extern template class RigidBlocks<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft

#include "rigid/rigid_elimination.h"
#include "rigid/rigid_residuals.h"
