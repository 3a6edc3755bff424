// Forward dynamics (articulated-body algorithm), with gravity as the acceleration -g of the base:
//
//   tip to base:  P, D, G, P⁺ of algebra/sweeps/articulated_inertia.h, and
//                 z(k) = P(k) a(k) + b(k) + Σ_{children c} E(k,c) z⁺(c)
//                 ε(k) = T(k) - H(k) z(k),   ν(k) = D(k)⁻¹ ε(k),   z⁺(k) = z(k) + G(k) ε(k)
//   base to tip:  α⁺(k) = E(p,k)* α(p),   θ̈(k) = ν(k) - G(k)* α⁺(k),   α(k) = α⁺(k) + H(k)* θ̈(k) + a(k),   α(base) = -g
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the articulated-body forward dynamics algorithm. Cost O(N).
#pragma once

#include <vector>

#include "algebra/sweeps/singular_pivot.h"
#include "operators/rigid_blocks.h"
#include "recursions/velocities.h"

namespace pycraft {

// z, alpha: scratch, one Vector6 per body. Throws SingularHingeError.
template <class S>
void articulated_body(const SkoStructure& tree, const CompiledModel<S>& model, RigidBlocks<S>& blocks, const Velocities<S>& velocities, const S* T,
                      S* vdot, std::vector<Vector6<S>>& z, std::vector<Vector6<S>>& alpha) {
  bool doubtful = false;
  for (int k = 0; k < model.bodies; ++k) {
    blocks.start_articulated(k);
    z[k] = velocities.b[k];
  }
  for (int k = model.bodies - 1; k >= 0; --k) {
    const int p = model.parent[k], first = model.v_offset[k], n = model.nv_of[k];
    doubtful |= blocks.eliminate_hinge(k);
    Vector6<S> zk = z[k] + blocks.P[k] * velocities.a[k], plus = zk;
    for (int j = first; j < first + n; ++j) {
      const S epsilon = T[j] - dot(blocks.H[j], zk);
      plus = plus + epsilon * blocks.G[j];
      vdot[j] = epsilon;
    }
    blocks.solve_D_in_place(k, vdot + first, 1);  // ν
    if (p >= 0) {
      blocks.articulated_to_parent(k);
      z[p] = z[p] + force_to_parent(blocks.pose[k], plus);
    }
  }
  if (doubtful) check_pivots_tip_to_base(tree, blocks);
  const Vector6<S> base{Vector3<S>::zero(), -model.gravity};
  for (int k = 0; k < model.bodies; ++k) {
    const int p = model.parent[k], first = model.v_offset[k], n = model.nv_of[k];
    const Vector6<S> outboard = motion_to_child(blocks.pose[k], p < 0 ? base : alpha[p]);
    Vector6<S> acceleration = outboard + velocities.a[k];
    for (int j = first; j < first + n; ++j) {
      vdot[j] -= dot(blocks.G[j], outboard);
      acceleration = acceleration + vdot[j] * blocks.H[j];
    }
    alpha[k] = acceleration;
  }
}

}  // namespace pycraft
