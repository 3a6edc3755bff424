// Forward dynamics (articulated-body algorithm), with gravity as the acceleration -g of the base:
//
//   tip to base:  P, D, G, P⁺ of algebra/trees/sweeps/articulated_inertia.h, and
//                 z(k) = P(k) a(k) + b(k) - w(k) + Σ_{children c} E(k,c) z⁺(c)
//                 ε(k) = T(k) - c(k) - H(k) z(k),   ν(k) = D(k)⁻¹ ε(k),   z⁺(k) = z(k) + G(k) ε(k)
//   base to tip:  α⁺(k) = E(p,k)* α(p),   θ̈(k) = ν(k) - G(k)* α⁺(k),   α(k) = α⁺(k) + H(k)* θ̈(k) + a(k),   α(base) = -g
//
// with w the wrench applied to the body (recursions/applied.h), c that of rotors, and α, a and b those of points (recursions/point_accelerations.h): the equations are the same for these and for the book's.
//
// In the factored forms P = C W C* and z = y - C W ρ*: of the forces that go with an inertia only accelerations ρ of its columns are kept,
// so that a heavy body's do not drown a light one's. Per body ρ(k) = -b(k) in its own columns, ρ⁺ what is left of ρ - a*C beside the
// hinge's rows, and
//
//   ε(k) = T(k) - c(k) - H(k) y(k),   ν(k) = D(k)⁻¹ (ε(k) + HC W ρ*),   y⁺(k) = y(k) + G(k) ε(k)
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the articulated-body forward dynamics algorithm. Cost O(N).
#pragma once

#include <vector>

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "recursions/applied.h"
#include "recursions/point_accelerations.h"
#include "rigid/rigid_blocks.h"
#include "runtime/interrupt.h"

namespace pycraft {

// Throws SingularHingeError where a pivot of the bodies from `last` on is noise. Factored forms sweep once more, now with P for the bound.
template <class S>
void refuse_pivots(const SkoStructure& tree, RigidBlocks<S>& blocks, int last) {
  if (blocks.form == Form::fast)
    check_pivots_tip_to_base(tree, blocks, last);
  else
    articulated_inertia_tip_to_base(tree, blocks);
}

// z, alpha: scratch, one Vector6 per body. vdot is θ̈ + x where hinges absorb their own terms x. Returns the largest of the terms that made up
// vdot. Throws SingularHingeError.
template <class S>
S articulated_body(const SkoStructure& tree, const CompiledModel<S>& model, RigidBlocks<S>& blocks, const PointAccelerations<S>& points, const Applied<S>& applied, const S* T, S* vdot,
                   std::vector<Vector6<S>>& z, std::vector<Vector6<S>>& alpha) {
  const bool factored = blocks.form != Form::fast;
  blocks.keep_inertias = false;
  blocks.with_bias = factored;
  bool doubtful = false;
  const auto start = [&](int k) {
    blocks.start_articulated(k);
    z[k] = factored ? blocks.factors().start_bias(k, model.inertia_factors[k], points.angular_velocity[k]) : points.b[k];
    applied.subtract_from(z[k], k);
  };
  for (int k = model.bodies - 1; k >= 0; --k) {
    check_interrupt_at(k);
    if (tree.last_child[k] < 0) start(k);
    const int p = model.parent[k], first = model.v_offset[k], n = model.nv_of[k];
    if (factored) blocks.factors().add_acceleration(k, points.a[k]);
    const Pivots found = blocks.eliminate_hinge(k);
    if (found == Pivots::not_positive) refuse_pivots(tree, blocks, k);
    doubtful |= found == Pivots::doubtful;
    Vector6<S> zk = z[k];
    if (!factored) zk = zk + blocks.P[k] * points.a[k];
    Vector6<S> plus = zk;
    for (int j = first; j < first + n; ++j) {
      const S epsilon = points.without_rotors(j, T[j]) - dot(blocks.H[j], zk);
      plus = plus + epsilon * blocks.G[j];
      vdot[j] = epsilon;
    }
    blocks.solve_D_in_place(k, vdot + first, 1);  // ν
    for (int j = 0; j < n && factored; ++j) vdot[first + j] += blocks.factors().bias(k)[j];
    if (p >= 0) {
      if (tree.last_child[p] == k) start(p);
      blocks.articulated_to_parent(k);
      z[p] = z[p] + force_to_parent(blocks.pose[k], plus);
    }
  }
  if (doubtful) refuse_pivots(tree, blocks, 0);
  S largest = S(0);
  const Vector6<S> base = applied.base();
  for (int k = 0; k < model.bodies; ++k) {
    check_interrupt_at(k);
    const int p = model.parent[k], first = model.v_offset[k], n = model.nv_of[k];
    const Vector6<S> outboard = motion_to_child(blocks.pose[k], p < 0 ? base : alpha[p]);
    Vector6<S> acceleration = outboard + points.a[k];
    for (int j = first; j < first + n; ++j) {
      using std::abs;
      largest = maximum(largest, S(abs(vdot[j])));
      vdot[j] -= dot(blocks.G[j], outboard);
      acceleration = acceleration + vdot[j] * blocks.H[j];
    }
    alpha[k] = acceleration;
  }
  return largest;
}

}  // namespace pycraft
