// rigid_blocks.h: articulated inertias through a hinge, and whether pivots are more than rounding.
#pragma once

#include <algorithm>
#include <cmath>

namespace pycraft {

// D, G, P⁺ from P; false where a pivot is not positive.
template <class S>
inline bool RigidBlocks<S>::eliminate_hinge_of_inertia(int k) {
  const int n = tree_.dof[k], f = first(k);
  Pplus[k] = P[k];
  if (n == 0) return true;
  S *d = D.data() + d_[k], *l = L.data() + d_[k], *pivots = pivots_.data() + f;
  for (int j = 0; j < n; ++j) G[f + j] = P[k] * H[f + j];  // PH*
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) d[i * n + j] = d[j * n + i] = dot(H[f + i], G[f + j]) + (i == j ? J[f + i] : S(0));
  if (n == 1) {
    pivots[0] = d[0];
    if (!(d[0] > S(0))) return false;
    W[f] = (S(1) / d[0]) * G[f];
    // P - (PH*)(PH*)*/D, symmetric by construction
    downdate(Pplus[k], G[f], W[f]);
    G[f] = W[f];
  } else {
    std::copy_n(d, n * n, l);
    if (ldl_in_place(l, n, pivots) < n) return false;
    for (int i = 0; i < n; ++i) {  // W = PH*L⁻*d⁻¹
      for (int a = 0; a < i; ++a) G[f + i] = G[f + i] - l[i * n + a] * G[f + a];
      W[f + i] = (S(1) / pivots[i]) * G[f + i];
      downdate(Pplus[k], G[f + i], W[f + i]);
    }
    for (int i = n - 1; i >= 0; --i) {  // G = W L⁻¹
      for (int a = i + 1; a < n; ++a) W[f + i] = W[f + i] - l[a * n + i] * W[f + a];
      G[f + i] = W[f + i];
    }
  }
  for (int j = f; j < f + n; ++j)
    if (aligned[j] >= 0 && no_hinge_diagonal(k)) annihilate(Pplus[k], aligned[j]);
  return true;
}

// Whether a pivot may be noise, so that the error sweep must tell. Two things make noise: what a hinge carries rounds at its composite
// inertia, not at the pivot, and light pivots y² » D enlarge what was there. The first is added up, the second multiplied, from the
// tips; of ratios y²/D only what exceeds 16 counts, or long chains of oblique axes would all be in doubt, and only products above the
// fifth root of the rounding bound's inverse are. A machine of coordinate axes has y² = D.
template <class S>
inline bool RigidBlocks<S>::doubtful(int k) {
  const int n = tree_.dof[k], f = first(k);
  if (n == 0) return false;
  S *own = pivot_work_.data(), *carried = own + n, *w = carried + n;
  const S furthest = maximum(reach_[k], lever_[k]), inertia_bound = S(4) * (rotational_[k] + mass_[k] * furthest * furthest);
  for (int i = 0; i < n; ++i) {
    const Vector6<S>& h = H[f + i];
    carried[i] = dot(h.angular, h.angular) * inertia_bound + S(2) * dot(h.linear, h.linear) * mass_[k] + J[f + i];
    own[i] = aligned[f + i] >= 0 ? D[d_[k] + i * n + i] : S(own_rounding(k, h) + J[f + i]);
  }
  S fresh = S(0), grown = S(1);
  for (int j = 0; j < n; ++j) {
    const S inverse = S(1) / pivots_[f + j];
    fresh = maximum(fresh, S(inverse * pivot_reach(L.data() + d_[k], n, j, carried, w)));
    grown = maximum(grown, S(inverse * pivot_reach(L.data() + d_[k], n, j, own, w)));
  }
  if (!(S(1) > faint_ratio<S>(form) * fresh)) note_faint(k, own, carried, w);
  error_[k] += rounding_bound<S>(form) * fresh;
  growth_[k] *= maximum(S(1), S(grown / S(16)));
  if (!(S(1) > gain_bound<S>(form) * grown)) return true;
  return !(largest_growth(form) > growth_[k] && S(1) > S(4) * error_[k] * growth_[k]);
}

// Lengths are right to eps of themselves, so that where a linear inertia p remains, rows of columns for turns are right to eps l √p. What a
// body carries has p at most its mass; only where that leaves a doubt it is taken from P.
template <class S>
inline void RigidBlocks<S>::note_faint(int k, const S* own, S* squares, S* w) {
  const int n = tree_.dof[k], f = first(k);
  for (const bool exact : {false, true}) {
    const S linear = lever_[k] * lever_[k] * (exact ? linear_trace(k) : S(S(3) * mass_[k]));
    for (int i = 0; i < n; ++i) squares[i] = dot(H[f + i].angular, H[f + i].angular) * linear + (aligned[f + i] >= 0 ? S(0) : own[i]);
    bool sound = true;
    for (int j = 0; j < n; ++j) {
      const S ratio = pivot_reach(L.data() + d_[k], n, j, squares, w) / pivots_[f + j];
      if (S(1) > faint_ratio<S>(form) * ratio) continue;
      sound = false;
      if (exact && !(faint_.ratio > to_double(ratio))) faint_ = {k, j, to_double(pivots_[f + j]), to_double(ratio)};
    }
    if (sound) return;
  }
}

// Σ h(i)² P(i,i)
template <class S>
inline S RigidBlocks<S>::own_rounding(int k, const Vector6<S>& h) const {
  S sum = S(0);
  for (int i = 0; i < 6; ++i) sum += h[i] * h[i] * (form == Form::fast ? P[k](i, i) : factors_->diagonal(i));
  return sum;
}

template <class S>
inline void RigidBlocks<S>::start_error(int k) {
  X_.resize(tree_.bodies());
  X_[k] = diagonal_part(P[k]);
  for (int i = 0; i < 3; ++i) X_[k].A(i, i) += uncertain(k);
}

template <class S>
inline void RigidBlocks<S>::check_pivots(int k) {
  for (int j = first(k); j < last(k); ++j) pivot_work_[j - first(k)] = dot(H[j], X_[k] * H[j]) + J[j];
  require_pivots(tree_, k, L.data() + d_[k], pivots_.data() + first(k), pivot_work_.data(), form);
  const Symmetric6<S> own = diagonal_part(P[k]);
  for (int j = first(k); j < last(k); ++j)
    pivot_work_[j - first(k)] = aligned[j] >= 0 ? D[d_[k] + (j - first(k)) * (tree_.dof[k] + 1)] : S(dot(H[j], own * H[j]) + J[j]);
  require_gain(tree_, k, L.data() + d_[k], pivots_.data() + first(k), pivot_work_.data(), form);
}

// X⁺(k)
template <class S>
inline Symmetric6<S> RigidBlocks<S>::error_left(int k) const {
  Symmetric6<S> plus = projected(X_[k], H, G, k);  // τ̄Xτ̄*
  const Symmetric6<S> own = diagonal_part(P[k]);
  for (int j = first(k); j < last(k); ++j) add_symmetric_product(plus, (S(0.5) * (dot(H[j], own * H[j]) + J[j])) * G[j], G[j]);
  pycraft::add(plus, own);
  return plus;
}

// (I - Σ b a*) A (I - Σ a b*) for the rows a, b of hinge k.
template <class S>
inline Symmetric6<S> RigidBlocks<S>::projected(const Symmetric6<S>& A, const std::vector<Vector6<S>>& a, const std::vector<Vector6<S>>& b, int k) const {
  Symmetric6<S> Q = A;
  // A - Σ_j (b_j (A a_j)* + (A a_j) b_j*) + Σ_ij b_i (a_i* A a_j) b_j*
  for (int j = first(k); j < last(k); ++j) {
    Vector6<S> u = S(-1) * (A * a[j]);
    for (int i = first(k); i < last(k); ++i) u = u + (S(0.5) * dot(a[i], A * a[j])) * b[i];
    add_symmetric_product(Q, u, b[j]);
  }
  return Q;
}

}  // namespace pycraft
