// The operational-space compliance kernel, base to tip:
//
//   Υ(k) = H(k)* D(k)⁻¹ H(k) + E_ψ(p,k)* Υ(p) E_ψ(p,k)
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the operational-space chapter. Cost O(N).
#pragma once

#include "algebra/language/structure.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class Blocks>
void upsilon_base_to_tip(const SkoStructure& tree, Blocks& blocks) {
  for (int k = 0; k < tree.bodies(); ++k) {
    check_interrupt_at(k);
    blocks.compliance_from_parent(k, tree.parent[k]);
  }
}

}  // namespace pycraft
