// Momenta, and the forces that change them, by two sweeps:
//
//   V(k) = E(p,k)* V(p) + H(k)* θ̇(k),    γ(k) = R* γ(p)                   base to tip; γ: the field of gravity in the body's axes
//   p(k) = M(k) V(k) + Σ E(k,c) p(c),    f(k) = M(k) (0; γ) + Σ E f(c)      tip to base
//   π_j = h_j·p + J_j θ̇_j,               ∂KE/∂θ_j = p·(V⁻ × h_j),          G_j = h_j·f
//
// h_j the row of H of coordinate j at its body k, V⁻ the velocity just inboard of j's subhinge, in the body's axes: a displacement along h_j turns
// and moves all that is outboard, which changes no kinetic energy, and changes the velocity of all of it by V⁻ × h_j besides. So π = (ℳ + J) θ̇,
// and ∂KE/∂θ is along quasi-velocities. Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the equations-of-motion chapter. Cost O(N).
#pragma once

#include <vector>

#include "model/compiled_model.h"
#include "model/hinge_kinematics.h"

namespace pycraft {

template <class S>
class Momenta {
 public:
  explicit Momenta(const CompiledModel<S>& model) : model_(model), X_(model.bodies), rows_(model.nv), inboard_(model.nv), V_(model.bodies), p_(model.bodies), f_(model.bodies), field_(model.bodies) {}

  // π (nv) of velocities v; J: (nv), the rotors'.
  void momentum(const S* q, const S* v, const S* J, S* pi) {
    base_to_tip(q, v);
    tip_to_base();
    project(v, J, pi, nullptr, nullptr);
  }
  // And ∂KE/∂θ + G (nv) in a uniform field.
  void momentum_and_forces(const S* q, const S* v, const S* J, const Vector3<S>& gravity, S* pi, S* forces) {
    base_to_tip(q, v);
    weigh(gravity);
    tip_to_base();
    project(v, J, pi, forces, &gravity);
  }

 private:
  void base_to_tip(const S* q, const S* v) {
    for (int k = 0; k < model_.bodies; ++k) {
      const int p = model_.parent[k], first = model_.v_offset[k];
      X_[k] = hinge_kinematics(model_, k, q, rows_.data() + first);
      Vector6<S> V = p < 0 ? Vector6<S>::zero() : motion_to_child(X_[k], V_[p]);
      int j = first;
      for (int i = model_.first_subhinge[k]; i < model_.first_subhinge[k + 1]; ++i) {
        const int end = j + record_of(model_.subhinges[i].kind).nv;
        const Vector6<S> before = V;
        for (; j < end; ++j) inboard_[j] = before, V = V + v[j] * rows_[j];
      }
      V_[k] = V;
      p_[k] = model_.inertia[k] * V;
      f_[k] = Vector6<S>::zero();
    }
  }
  void weigh(const Vector3<S>& gravity) {
    for (int k = 0; k < model_.bodies; ++k) {
      const int p = model_.parent[k];
      field_[k] = transpose_times(X_[k].R, p < 0 ? gravity : field_[p]);
      f_[k] = {cross(model_.inertia[k].moment, field_[k]), model_.inertia[k].mass * field_[k]};
    }
  }
  void tip_to_base() {
    for (int k = model_.bodies - 1; k >= 0; --k)
      if (const int p = model_.parent[k]; p >= 0) p_[p] = p_[p] + force_to_parent(X_[k], p_[k]), f_[p] = f_[p] + force_to_parent(X_[k], f_[k]);
  }
  void project(const S* v, const S* J, S* pi, S* forces, const Vector3<S>* gravity) const {
    for (int k = 0; k < model_.bodies; ++k)
      for (int j = model_.v_offset[k]; j < model_.v_offset[k] + model_.nv_of[k]; ++j) {
        pi[j] = dot(rows_[j], p_[k]) + J[j] * v[j];
        if (gravity) forces[j] = dot(p_[k], cross_motion(inboard_[j], rows_[j])) + dot(rows_[j], f_[k]);
      }
  }

  const CompiledModel<S>& model_;
  std::vector<Pose<S>> X_;
  std::vector<Vector6<S>> rows_, inboard_, V_, p_, f_;  // inboard: V⁻ of every coordinate
  std::vector<Vector3<S>> field_;
};

}  // namespace pycraft
