// The composite-body (Lyapunov) sweep, tip to base:
//
//   R(k) = M(k) + Σ_{children c} E(k,c) R(c) E(k,c)*
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapter on composite-body inertias. Cost O(N).
#pragma once

#include "algebra/language/structure.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class Blocks>
void composite_inertia_tip_to_base(const SkoStructure& tree, Blocks& blocks) {
  for (int k = 0; k < tree.bodies(); ++k) blocks.start_composite(k);
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    check_interrupt_at(k);
    if (tree.parent[k] >= 0) blocks.composite_to_parent(k);
  }
}

}  // namespace pycraft
