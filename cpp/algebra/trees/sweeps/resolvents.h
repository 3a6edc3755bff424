// The resolvents by sweeps, never formed. Vectors of m columns are row-major: body k's rows start at offset(k) * m.
//
//   y = φ x :   y(k) = x(k) + Σ_{children c} E(k,c) y(c)            tip to base
//   y = φ* x:   y(k) = x(k) + E(p,k)* y(p)                          base to tip
//   y = ψ x, ψ* x: the same with E_ψ(p,k) = E(p,k) (I - G(k)H(k))
//
// Cost O(N m): one block of E (and of G, H) per body.
#pragma once

#include <algorithm>

#include "algebra/language/structure.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class Blocks, class S>
void gather_phi_tip_to_base(const SkoStructure& tree, const Blocks& blocks, const S* x, S* y, int m) {
  std::copy_n(x, static_cast<size_t>(tree.dimension()) * m, y);
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    check_interrupt_at(k, m);
    if (tree.parent[k] >= 0) blocks.shift_add(k, y + tree.offset[k] * m, y + tree.offset[tree.parent[k]] * m, m);
  }
}

template <class Blocks, class S>
void scatter_phi_base_to_tip(const SkoStructure& tree, const Blocks& blocks, const S* x, S* y, int m) {
  std::copy_n(x, static_cast<size_t>(tree.dimension()) * m, y);
  for (int k = 0; k < tree.bodies(); ++k) {
    check_interrupt_at(k, m);
    if (tree.parent[k] >= 0) blocks.shift_transposed_add(k, y + tree.offset[tree.parent[k]] * m, y + tree.offset[k] * m, m);
  }
}

template <class Blocks, class S>
void gather_psi_tip_to_base(const SkoStructure& tree, const Blocks& blocks, const S* x, S* y, int m) {
  std::copy_n(x, static_cast<size_t>(tree.dimension()) * m, y);
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    check_interrupt_at(k, m);
    if (tree.parent[k] >= 0) blocks.articulated_shift_add(k, y + tree.offset[k] * m, y + tree.offset[tree.parent[k]] * m, m);
  }
}

template <class Blocks, class S>
void scatter_psi_base_to_tip(const SkoStructure& tree, const Blocks& blocks, const S* x, S* y, int m) {
  std::copy_n(x, static_cast<size_t>(tree.dimension()) * m, y);
  for (int k = 0; k < tree.bodies(); ++k) {
    check_interrupt_at(k, m);
    if (tree.parent[k] >= 0) blocks.articulated_shift_transposed_add(k, y + tree.offset[tree.parent[k]] * m, y + tree.offset[k] * m, m);
  }
}

// y = E x: y(p) = Σ_{children k} E(p,k) x(k).
template <class Blocks, class S>
void apply_edges(const SkoStructure& tree, const Blocks& blocks, const S* x, S* y, int m) {
  std::fill_n(y, static_cast<size_t>(tree.dimension()) * m, S(0));
  for (int k = 0; k < tree.bodies(); ++k) {
    check_interrupt_at(k, m);
    if (tree.parent[k] >= 0) blocks.shift_add(k, x + tree.offset[k] * m, y + tree.offset[tree.parent[k]] * m, m);
  }
}

// y = E* x: y(k) = E(p,k)* x(p).
template <class Blocks, class S>
void apply_edges_transposed(const SkoStructure& tree, const Blocks& blocks, const S* x, S* y, int m) {
  std::fill_n(y, static_cast<size_t>(tree.dimension()) * m, S(0));
  for (int k = 0; k < tree.bodies(); ++k) {
    check_interrupt_at(k, m);
    if (tree.parent[k] >= 0) blocks.shift_transposed_add(k, x + tree.offset[tree.parent[k]] * m, y + tree.offset[k] * m, m);
  }
}

}  // namespace pycraft
