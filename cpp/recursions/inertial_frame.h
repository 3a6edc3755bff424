// Everything in one inertial frame, which coincides with the root body's frame at this instant: what sensitivities are made of.
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
// and sums over subtrees are sums of R, B and F. Cost O(N).
#pragma once

#include <vector>

#include "model/compiled_model.h"
#include "model/hinge_kinematics.h"
#include "operators/rigid_blocks.h"

namespace pycraft {

// B of one body or of a subtree.
template <class S>
struct MomentumRate {
  Symmetric3<S> rate;    // İ, rotational
  Vector6<S> momentum;   // (n; f)
  static MomentumRate zero() { return {Symmetric3<S>::zero(), Vector6<S>::zero()}; }
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
// B* x
template <class S>
inline Vector6<S> transpose_times(const MomentumRate<S>& B, const Vector6<S>& x) {
  return {B.rate * x.angular + cross(B.momentum.angular, x.angular) + S(2) * cross(B.momentum.linear, x.linear), Vector3<S>::zero()};
}
// B of a body from its inertia and velocity: İ = ω̃A - Aω̃ - (ṽh̃ + h̃ṽ), A rotational, h = m c.
template <class S>
inline MomentumRate<S> momentum_rate(const RigidInertia<S>& I, const Vector6<S>& V) {
  const Matrix3<S> w = skew(V.angular), v = skew(V.linear), h = skew(I.moment), A = full(I.rotational);
  return {upper(w * A - A * w - (v * h + h * v)), I * V};
}

template <class S>
struct InertialFrame {
  std::vector<Vector6<S>> twist, twist_rate, psi_dot, psi_ddot;  // per coordinate
  std::vector<Vector6<S>> V, alpha, force;                       // per body; force: summed over the subtree
  std::vector<RigidInertia<S>> R;                                // summed over the subtree
  std::vector<MomentumRate<S>> B;                                // summed over the subtree
  std::vector<Pose<S>> pose;                                     // from the frame to each body
  std::vector<int> body_of, subhinge_of;                         // per coordinate

  explicit InertialFrame(const CompiledModel<S>& model)
      : twist(model.nv), twist_rate(model.nv), psi_dot(model.nv), psi_ddot(model.nv), V(model.bodies), alpha(model.bodies), force(model.bodies), R(model.bodies),
        B(model.bodies), pose(model.bodies), body_of(model.nv), subhinge_of(model.nv) {
    for (int k = 0; k < model.bodies; ++k) {
      int j = model.v_offset[k];
      for (int i = model.first_subhinge[k]; i < model.first_subhinge[k + 1]; ++i)
        for (int c = 0; c < coordinates(model.subhinges[i].kind); ++c, ++j) body_of[j] = k, subhinge_of[j] = i;
    }
  }

  // On one path to the base: i's subhinge stands inboard of j's (bodies are numbered parents first, subhinges along them).
  bool inboard(int i, int j) const { return subhinge_of[i] < subhinge_of[j]; }

  // From hinge kinematics at a configuration; v, vdot may be null (rest).
  void fill(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, const S* v, const S* vdot) {
    for (int k = 0; k < model.bodies; ++k) {
      const int p = model.parent[k];
      pose[k] = p < 0 ? Pose<S>::identity() : pose[p] * blocks.pose[k];
      const Pose<S> back = inverse(pose[k]);
      Vector6<S> velocity = p < 0 ? Vector6<S>::zero() : V[p];
      Vector6<S> acceleration = p < 0 ? motion_to_child(blocks.pose[k], Vector6<S>{Vector3<S>::zero(), -model.gravity}) : alpha[p];
      int j = model.v_offset[k];
      for (int i = model.first_subhinge[k]; i < model.first_subhinge[k + 1]; ++i) {
        const int n = coordinates(model.subhinges[i].kind);
        const Vector6<S> before = velocity, acceleration_before = acceleration;
        for (int c = j; c < j + n; ++c) {
          twist[c] = motion_to_child(back, blocks.H[c]);
          psi_dot[c] = cross_motion(before, twist[c]);
          psi_ddot[c] = cross_motion(acceleration_before, twist[c]) + cross_motion(before, psi_dot[c]);
          if (v) velocity = velocity + v[c] * twist[c];
        }
        for (int c = j; c < j + n; ++c) {
          twist_rate[c] = cross_motion(velocity, twist[c]);
          if (v) acceleration = acceleration + v[c] * twist_rate[c];
          if (vdot) acceleration = acceleration + vdot[c] * twist[c];
        }
        j += n;
      }
      V[k] = velocity;
      alpha[k] = acceleration;
      R[k] = to_parent(pose[k], model.inertia[k]);
      B[k] = momentum_rate(R[k], velocity);
      force[k] = R[k] * acceleration + cross_force(velocity, B[k].momentum);
    }
    for (int k = model.bodies - 1; k >= 0; --k)
      if (const int p = model.parent[k]; p >= 0) {
        R[p] = R[p] + R[k];
        B[p] = B[p] + B[k];
        force[p] = force[p] + force[k];
      }
  }
};

// f(i) for every coordinate on the path from the base to j's hinge, j's own hinge included, from j's hinge inward.
template <class S, class F>
inline void on_path(const CompiledModel<S>& model, int body, F f) {
  for (int a = body; a >= 0; a = model.parent[a])
    for (int i = model.v_offset[a] + model.nv_of[a] - 1; i >= model.v_offset[a]; --i) f(i);
}

}  // namespace pycraft
