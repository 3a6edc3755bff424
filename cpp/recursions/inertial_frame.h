// Velocities, momenta and forces with respect to one inertial frame: what sensitivities are made of.
//
// The frame has the axes of the root body at this instant and moves, without turning, as the root body's origin does. Every body's
// quantities are about its own origin. So neither where the model is nor how fast it travels is in the numbers, and what is local stays
// local: from one body to the next, forces gain l × f in their angular part and motions lose l × ω in their linear one.
//
// Per coordinate j, s its subhinge, "-" just inboard of s, "s" just outboard:
//   S_j                      its twist               Ṡ_j = V_s × S_j
//   ψ̇_j = V⁻ × S_j                                   ψ̈_j = α⁻ × S_j + V⁻ × ψ̇_j
// Per body, summed over its subtree, outboard to inboard:
//   R composite inertia,  p = Σ I V,  F = Σ f,  f = I α + V ×* I V,
//   B = Σ (crf(V) I - I crm(V) + mcross(I V)) = [[İ - ñ, 0], [-2 f̃, 0]] of the momentum (n; f): 9 numbers, as İ's linear part is f's.
//
// A displacement along S_j moves all that is outboard rigidly, and what it changes besides is the same velocity ψ̇_j and acceleration
// for every body there: ∂_jV = S_j × V + ψ̇_j and ∂_jα = S_j × α + ψ̈_j - V × ψ̇_j, a motion's cross product each. So
//   ∂_j f = crf(S_j) f + I ψ̈_j + (B of the body) ψ̇_j,    ∂f/∂v_j = I (Ṡ_j + ψ̇_j) + (B of the body) S_j,
// and sums over subtrees are sums of R, B and F. Seen from the frame the world moves at -u, u the velocity of the root's origin. Cost O(N).
#pragma once

#include <vector>

#include "model/compiled_model.h"
#include "model/hinge_kinematics.h"
#include "recursions/point_accelerations.h"
#include "rigid/rigid_blocks.h"
#include "runtime/interrupt.h"

namespace pycraft {

// About a point at -l from the one before, axes the same: from a body's origin to its parent's.
template <class S>
inline Vector6<S> force_inboard(const Vector3<S>& l, const Vector6<S>& f) {
  return {f.angular + cross(l, f.linear), f.linear};
}
// About a point at l from the one before: from the parent's origin to the body's.
template <class S>
inline Vector6<S> motion_outboard(const Vector3<S>& l, const Vector6<S>& V) {
  return {V.angular, V.linear - cross(l, V.angular)};
}
// -(l~h~ + h~l~)
template <class S>
inline Symmetric3<S> moment_square(const Vector3<S>& l, const Vector3<S>& h) {
  const S d = S(2) * dot(l, h);
  Symmetric3<S> A;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) A(i, j) = (i == j ? d : S(0)) - (l[i] * h[j] + h[i] * l[j]);
  return A;
}
template <class S>
inline RigidInertia<S> inertia_inboard(const Vector3<S>& l, const RigidInertia<S>& M) {
  const Vector3<S> ml = M.mass * l;
  return {M.mass, M.moment + ml, M.rotational + moment_square(l, M.moment + S(0.5) * ml)};
}

// B of one body or of a subtree.
template <class S>
struct MomentumRate {
  Symmetric3<S> rate;    // İ, rotational
  Vector6<S> momentum;   // (n; f)
};
template <class S>
inline MomentumRate<S> operator+(const MomentumRate<S>& a, const MomentumRate<S>& b) {
  return {a.rate + b.rate, a.momentum + b.momentum};
}
// B x
template <class S>
inline Vector6<S> operator*(const MomentumRate<S>& B, const Vector6<S>& x) {
  return {B.rate * x.angular - cross(B.momentum.angular, x.angular), S(-2) * cross(B.momentum.linear, x.angular)};
}
// The angular part of B* x; the linear one is zero, so that it is the same about every point.
template <class S>
inline Vector3<S> couple(const MomentumRate<S>& B, const Vector6<S>& x) {
  return B.rate * x.angular + cross(B.momentum.angular, x.angular) + S(2) * cross(B.momentum.linear, x.linear);
}
// B of a body from its inertia and velocity: İ = ω̃A - Aω̃ - (ṽh̃ + h̃ṽ), A rotational, h = m c.
template <class S>
inline MomentumRate<S> momentum_rate(const RigidInertia<S>& I, const Vector6<S>& V) {
  const Matrix3<S> w = skew(V.angular), A = full(I.rotational);
  return {upper(w * A - A * w) + moment_square(V.linear, I.moment), I * V};
}
// İ changes with the point as I does, by the rate of h, which is f.
template <class S>
inline MomentumRate<S> momentum_rate_inboard(const Vector3<S>& l, const MomentumRate<S>& B) {
  return {B.rate + moment_square(l, B.momentum.linear), force_inboard(l, B.momentum)};
}

template <class S>
struct InertialFrame {
  std::vector<Vector6<S>> twist, twist_rate, psi_dot, psi_ddot;  // per coordinate
  std::vector<Vector6<S>> V, alpha, force;                       // per body; force: summed over the subtree
  std::vector<RigidInertia<S>> R;                                // summed over the subtree
  std::vector<MomentumRate<S>> B;                                // summed over the subtree
  std::vector<Matrix3<S>> axes;                                  // per body: its axes
  std::vector<Vector3<S>> arm, origin;                           // per body: its origin from its parent's, and from the root's
  std::vector<Vector3<S>> travel;                                // per body: u
  std::vector<int> body_of, subhinge_of;                         // per coordinate

  explicit InertialFrame(const CompiledModel<S>& model)
      : twist(model.nv), twist_rate(model.nv), psi_dot(model.nv), psi_ddot(model.nv), V(model.bodies), alpha(model.bodies), force(model.bodies), R(model.bodies),
        B(model.bodies), axes(model.bodies), arm(model.bodies), origin(model.bodies), travel(model.bodies), body_of(model.nv), subhinge_of(model.nv) {
    for (int k = 0; k < model.bodies; ++k) {
      int j = model.v_offset[k];
      for (int i = model.first_subhinge[k]; i < model.first_subhinge[k + 1]; ++i)
        for (int c = 0; c < record_of(model.subhinges[i].kind).nv; ++c, ++j) body_of[j] = k, subhinge_of[j] = i;
    }
  }

  // On one path to the base: i's subhinge stands inboard of j's (bodies are numbered parents first, subhinges along them).
  bool inboard(int i, int j) const { return subhinge_of[i] < subhinge_of[j]; }

  // From hinge kinematics at a configuration; v, vdot may be null (rest). With own terms absorbed, vdot and what it is differentiated for
  // are the accelerations θ̈ + x of free roots (recursions/point_accelerations.h), and rates do not depend on their travel at all.
  void fill(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, const Vector3<S>& gravity, const S* v, const S* vdot, OwnTerms own = OwnTerms::kept) {
    for (int k = 0; k < model.bodies; ++k) {
      check_interrupt_at(k);
      place(model, blocks, gravity, k);
      move(model, k, v, vdot, own);
      const RigidInertia<S>& I = model.inertia[k];
      R[k] = {I.mass, axes[k] * I.moment, rotate(axes[k], I.rotational)};
      B[k] = momentum_rate(R[k], V[k]);
      force[k] = R[k] * alpha[k] + cross_force(V[k], B[k].momentum);
    }
    for (int k = model.bodies - 1; k >= 0; --k) {
      check_interrupt_at(k);
      if (const int p = model.parent[k]; p >= 0) {
        R[p] = R[p] + inertia_inboard(arm[k], R[k]);
        B[p] = B[p] + momentum_rate_inboard(arm[k], B[k]);
        force[p] = force[p] + force_inboard(arm[k], force[k]);
      }
    }
  }

  // A root on one free subhinge whose own terms can be absorbed.
  static bool floats(const CompiledModel<S>& model, int k) {
    return model.parent[k] < 0 && model.translations[k][0] >= 0 && model.nv_of[k] == 6 && model.first_subhinge[k + 1] - model.first_subhinge[k] == 1;
  }

 private:
  void place(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, const Vector3<S>& gravity, int k) {
    const int p = model.parent[k];
    const Pose<S>& X = blocks.pose[k];
    axes[k] = p < 0 ? Matrix3<S>::identity() : axes[p] * X.R;
    arm[k] = p < 0 ? Vector3<S>::zero() : axes[p] * X.p;
    origin[k] = p < 0 ? Vector3<S>::zero() : origin[p] + arm[k];
    alpha[k] = p < 0 ? Vector6<S>{Vector3<S>::zero(), transpose_times(X.R, -gravity)} : motion_outboard(arm[k], alpha[p]);
    for (int c = model.v_offset[k]; c < model.v_offset[k] + model.nv_of[k]; ++c) twist[c] = {axes[k] * blocks.H[c].angular, axes[k] * blocks.H[c].linear};
  }

  // Along the hinge: velocities, accelerations, and what its coordinates change.
  void move(const CompiledModel<S>& model, int k, const S* v, const S* vdot, OwnTerms own) {
    const int p = model.parent[k], first = model.v_offset[k], last = first + model.nv_of[k];
    const bool still = !v || (own == OwnTerms::absorbed && floats(model, k));  // the root's travel does not count
    const auto rate = [&](int c) { return still && c >= first + (v ? 3 : 0) ? S(0) : v[c]; };
    Vector6<S> velocity = p < 0 ? Vector6<S>::zero() : motion_outboard(arm[k], V[p]), acceleration = alpha[k];
    travel[k] = p < 0 ? Vector3<S>::zero() : travel[p];
    if (p < 0)
      for (int c = first; c < last; ++c) travel[k] = travel[k] + rate(c) * twist[c].linear;
    const auto seen = [&](const Vector6<S>& x) { return p < 0 ? Vector6<S>{x.angular, x.linear - travel[k]} : x; };
    for (int i = model.first_subhinge[k], j = first; i < model.first_subhinge[k + 1]; ++i) {
      const int end = j + record_of(model.subhinges[i].kind).nv;
      const Vector6<S> before = seen(velocity), acceleration_before = acceleration;
      for (int c = j; c < end; ++c) {
        psi_dot[c] = cross_motion(before, twist[c]);
        psi_ddot[c] = cross_motion(acceleration_before, twist[c]) + cross_motion(before, psi_dot[c]);
        velocity = velocity + rate(c) * twist[c];
      }
      const Vector6<S> after = seen(velocity);
      for (int c = j; c < end; ++c) {
        twist_rate[c] = cross_motion(after, twist[c]);
        acceleration = acceleration + rate(c) * twist_rate[c];
        if (vdot) acceleration = acceleration + vdot[c] * twist[c];
      }
      if (v && still)
        for (int c = j + 3; c < end; ++c) twist_rate[c] = Vector6<S>::zero();
      j = end;
    }
    V[k] = seen(velocity);
    alpha[k] = acceleration;
  }
};

// f(i) for every coordinate of a body and of those inboard of it, from its hinge inward.
template <class S, class F>
inline void on_path(const CompiledModel<S>& model, int body, F f) {
  for (int a = body; a >= 0; a = model.parent[a])
    for (int i = model.v_offset[a] + model.nv_of[a] - 1; i >= model.v_offset[a]; --i) f(i);
}

}  // namespace pycraft
