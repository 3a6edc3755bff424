// The Riccati sweep, tip to base:
//
//   P(k)  = M(k) + Σ_{children c} E(k,c) P⁺(c) E(k,c)*       articulated-body inertia
//   D(k)  = H(k) P(k) H(k)* + J(k)                            refused where singular: see singular_pivot.h
//   G(k)  = P(k) H(k)* D(k)⁻¹
//   P⁺(k) = P(k) - G(k) D(k) G(k)*                            (= τ̄P)
//
// in one of its forms: `fast` as it stands; `ud` and `square-root` in factors of P (factored_inertia.h). A body is started where its first
// child comes in, so that of the factors no more are held than the sweep has open.
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the articulated-body chapter. Cost O(N).
#pragma once

#include "algebra/language/structure.h"
#include "algebra/trees/sweeps/singular_pivot.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class Blocks>
void articulated_inertia_tip_to_base(const SkoStructure& tree, Blocks& blocks) {
  bool doubtful = false;
  blocks.keep_inertias = true;
  blocks.with_bias = false;
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    check_interrupt_at(k);
    if (tree.last_child[k] < 0) blocks.start_articulated(k);
    const Pivots found = blocks.eliminate_hinge(k);
    if (found == Pivots::not_positive) check_pivots_tip_to_base(tree, blocks, k);
    doubtful |= found == Pivots::doubtful;
    if (const int p = tree.parent[k]; p >= 0) {
      if (tree.last_child[p] == k) blocks.start_articulated(p);
      blocks.articulated_to_parent(k);
    }
  }
  if (doubtful) check_pivots_tip_to_base(tree, blocks);
}

}  // namespace pycraft
