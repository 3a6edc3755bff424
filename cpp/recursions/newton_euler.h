// Inverse dynamics (Newton-Euler), with gravity as the acceleration -g of the base:
//
//   base to tip:  α(k) = E(p,k)* α(p) + H(k)* θ̈(k) + a(k),   α(base) = -g
//   tip to base:  f(k) = M(k) α(k) + b(k) - w(k) + Σ_{children c} E(k,c) f(c),   T(k) = H(k) f(k) + J(k) θ̈(k) + c(k)
//
// with w the wrench applied to the body (recursions/applied.h), c that of rotors, and α, a and b those of points (recursions/point_accelerations.h): the equations are the same for these and for the book's. vdot is θ̈ + x
// where hinges absorb their own terms x. It may be null (zero): T is then the bias 𝒞 (Coriolis, gyroscopic and gravity forces).
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the Newton-Euler inverse dynamics algorithm. Cost O(N).
#pragma once

#include <vector>

#include "recursions/applied.h"
#include "recursions/point_accelerations.h"
#include "rigid/rigid_blocks.h"
#include "runtime/interrupt.h"
#include "spatial/wide_force.h"

namespace pycraft {

// alpha, f: scratch, one Vector6 per body; f holds the interbody forces afterwards (the hinge's on body k, in k's frame).
template <class S>
void newton_euler(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, const PointAccelerations<S>& points, const Applied<S>& applied, const S* vdot, S* T,
                  std::vector<Vector6<S>>& alpha, std::vector<Vector6<S>>& f) {
  const Vector6<S> base = applied.base();
  for (int k = 0; k < model.bodies; ++k) {
    check_interrupt_at(k);
    const int p = model.parent[k], first = model.v_offset[k], n = model.nv_of[k];
    Vector6<S> acceleration = motion_to_child(blocks.pose[k], p < 0 ? base : alpha[p]) + points.a[k];
    if (vdot)
      for (int j = first; j < first + n; ++j) acceleration = acceleration + vdot[j] * blocks.H[j];
    alpha[k] = acceleration;
    f[k] = blocks.inertia[k] * acceleration + points.b[k];
    applied.subtract_from(f[k], k);
  }
  for (int k = model.bodies - 1; k >= 0; --k) {
    check_interrupt_at(k);
    const int p = model.parent[k], first = model.v_offset[k], n = model.nv_of[k];
    for (int j = first; j < first + n; ++j) T[j] = points.with_rotors(j, dot(blocks.H[j], f[k]) + (vdot ? blocks.J[j] * vdot[j] : S(0)));
    if (p >= 0) f[p] = f[p] + force_to_parent(blocks.pose[k], f[k]);
  }
}

// r = τ - T of the same equations, motions in S and forces gathered in a wider T: M α + b of masses that are no rounded inertias. f in S as
// above.
template <class S, class T, class U>
void newton_euler_residual_gathered(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, const PointAccelerations<S>& points, const Applied<S>& applied,
                                    const S* vdot, const U* tau, S* r, std::vector<Vector6<S>>& alpha, std::vector<Vector6<S>>& f, std::vector<Vector6<T>>& wide) {
  const Vector6<S> base = applied.base();
  wide.resize(model.bodies);
  for (int k = 0; k < model.bodies; ++k) {
    check_interrupt_at(k);
    const int p = model.parent[k], first = model.v_offset[k], n = model.nv_of[k];
    Vector6<S> acceleration = motion_to_child(blocks.pose[k], p < 0 ? base : alpha[p]) + points.a[k];
    for (int j = first; j < first + n; ++j) acceleration = acceleration + vdot[j] * blocks.H[j];
    alpha[k] = acceleration;
    wide_force(model.mass_properties[k], alpha[k], &points.angular_velocity[k], wide[k]);
    if (applied.wrenches) wide[k] = wide[k] - cast<T>(applied.wrenches[k]);
  }
  for (int k = model.bodies - 1; k >= 0; --k) {
    check_interrupt_at(k);
    const int p = model.parent[k], first = model.v_offset[k], n = model.nv_of[k];
    f[k] = cast<S>(wide[k]);
    for (int j = first; j < first + n; ++j) r[j] = static_cast<S>(T(tau[j]) - T(points.with_rotors(j, S(0))) - wide_dot(blocks.H[j], wide[k]) - T(blocks.J[j]) * T(vdot[j]));
    if (p >= 0) add_wide_to_parent(blocks.pose[k], wide[k], wide[p]);
  }
}

}  // namespace pycraft
