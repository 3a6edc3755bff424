// Velocities, base to tip, and the velocity-dependent terms of the equations of motion as the book's operators have them:
//
//   V(k) = E(p,k)* V(p) + H(k)* θ̇(k)
//   a(k) = Ṽ(k) H(k)* θ̇(k) + Ḣ(k)* θ̇(k)        Coriolis acceleration (Ḣ: hinges of several subhinges only)
//   b(k) = V̄(k) M(k) V(k)                        gyroscopic force
//
// Of V = V⁻ + H*θ̇, V⁻ = E*V(p), only V⁻ counts in a, as V_r × V_r = 0; and b = (ω × Iω + h × (ω × v); ω × (ω × h + m v)), as v × mv = 0 and
// by Jacobi's identity: no square of a velocity is formed that cancels. Direct calls do without the rest of v too
// (recursions/point_accelerations.h).
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the equations-of-motion chapter. Cost O(N).
#pragma once

#include <vector>

#include "model/compiled_model.h"
#include "model/hinge_kinematics.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class S>
struct Velocities {
  std::vector<Vector6<S>> V, a, b, relative;  // per body; relative: H*θ̇
  std::vector<Vector6<S>> H_dot;              // per coordinate
  void resize(int bodies, int coordinates) {
    for (auto* x : {&V, &a, &b, &relative}) x->resize(bodies);
    H_dot.resize(coordinates);
  }
};

template <class S>
void velocities_base_to_tip(const CompiledModel<S>& model, const Pose<S>* pose, const Vector6<S>* H, const S* v, Velocities<S>& out) {
  out.resize(model.bodies, model.nv);
  for (int k = 0; k < model.bodies; ++k) {
    check_interrupt_at(k);
    const int p = model.parent[k], f = model.v_offset[k], n = model.nv_of[k];
    Vector6<S> relative = Vector6<S>::zero(), rate = Vector6<S>::zero();
    for (int j = f; j < f + n; ++j) relative = relative + v[j] * H[j];
    if (model.first_subhinge[k + 1] - model.first_subhinge[k] > 1) {
      hinge_map_rate(model, k, H + f, v + f, out.H_dot.data() + f);
      for (int j = f; j < f + n; ++j) rate = rate + v[j] * out.H_dot[j];
    } else {
      for (int j = f; j < f + n; ++j) out.H_dot[j] = Vector6<S>::zero();
    }
    out.V[k] = out.relative[k] = relative;
    out.a[k] = rate;
    if (p >= 0) {
      const Vector6<S> carried = motion_to_child(pose[k], out.V[p]);
      out.V[k] = carried + relative;
      out.a[k] = out.a[k] + cross_motion(carried, relative);
    }
    const RigidInertia<S>& M = model.inertia[k];
    const Vector3<S>&omega = out.V[k].angular, &linear = out.V[k].linear;
    out.b[k] = {cross(omega, M.rotational * omega) + cross(M.moment, cross(omega, linear)), cross(omega, cross(omega, M.moment) + M.mass * linear)};
  }
}

}  // namespace pycraft
