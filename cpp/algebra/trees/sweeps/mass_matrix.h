// The mass matrix and its inverse applied to vectors, each by two sweeps with nothing stored in between but one V or F vector.
//
//   y = HφMφ*H* x (+ J x)                         (Newton-Euler at rest)
//     base to tip:  α(k) = E(p,k)* α(p) + H(k)* x(k)
//     tip to base:  f(k) = M(k) α(k) + Σ E(k,c) f(c),   y(k) = H(k) f(k)
//
//   y = [I-HψK]* D⁻¹ [I-HψK] x                    (the innovations factors, from the articulated inertia's D and G)
//     tip to base:  z(k) = Σ E(k,c) z⁺(c),  ε(k) = x(k) - H(k) z(k),  z⁺(k) = z(k) + G(k) ε(k),  ν(k) = D(k)⁻¹ ε(k)
//     base to tip:  α⁺(k) = E(p,k)* α(p),   y(k) = ν(k) - G(k)* α⁺(k),  α(k) = α⁺(k) + H(k)* y(k)
//
// scratch: dimension * m scalars. Cost O(N m).
#pragma once

#include <algorithm>
#include <vector>

#include "algebra/language/structure.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class Blocks, class S>
void mass_matrix_apply(const SkoStructure& tree, const Blocks& blocks, bool with_hinge_diagonal, const S* x, S* y, int m, S* scratch) {
  S* alpha = scratch;
  std::fill_n(alpha, static_cast<size_t>(tree.dimension()) * m, S(0));
  for (int k = 0; k < tree.bodies(); ++k) {
    check_interrupt_at(k, m);
    S* ak = alpha + tree.offset[k] * m;
    if (tree.parent[k] >= 0) blocks.shift_transposed_add(k, alpha + tree.offset[tree.parent[k]] * m, ak, m);
    blocks.hinge_transposed_add(k, x + tree.dof_offset[k] * m, ak, m);
  }
  for (int k = 0; k < tree.bodies(); ++k) blocks.inertia_in_place(k, alpha + tree.offset[k] * m, m);
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    check_interrupt_at(k, m);
    const S* fk = alpha + tree.offset[k] * m;
    blocks.hinge(k, fk, y + tree.dof_offset[k] * m, m);
    if (with_hinge_diagonal) blocks.hinge_diagonal_add(k, x + tree.dof_offset[k] * m, y + tree.dof_offset[k] * m, m);
    if (tree.parent[k] >= 0) blocks.shift_add(k, fk, alpha + tree.offset[tree.parent[k]] * m, m);
  }
}

// r = b - (HφMφ*H* + J) x with motions in S and forces, of masses that are no rounded inertias, gathered in a wider T; scratch: dimension * m scalars.
template <class Blocks, class Masses, class S, class T>
void mass_matrix_residual_gathered(const SkoStructure& tree, const Blocks& blocks, const Masses& masses, const S* x, const S* b, S* r, int m, S* scratch, std::vector<T>& forces) {
  S* alpha = scratch;
  forces.assign(std::max(forces.size(), static_cast<size_t>(tree.dimension()) * m), T(0));
  std::fill_n(alpha, static_cast<size_t>(tree.dimension()) * m, S(0));
  for (int k = 0; k < tree.bodies(); ++k) {
    S* ak = alpha + tree.offset[k] * m;
    if (tree.parent[k] >= 0) blocks.shift_transposed_add(k, alpha + tree.offset[tree.parent[k]] * m, ak, m);
    blocks.hinge_transposed_add(k, x + tree.dof_offset[k] * m, ak, m);
    blocks.inertia_wide(k, masses, ak, forces.data() + tree.offset[k] * m, m);
  }
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    const T* fk = forces.data() + tree.offset[k] * m;
    const int at = tree.dof_offset[k] * m;
    blocks.residual_wide(k, fk, x + at, b + at, r + at, m);
    if (tree.parent[k] >= 0) blocks.shift_add_wide(k, fk, forces.data() + tree.offset[tree.parent[k]] * m, m);
  }
}

template <class Blocks, class S>
void mass_matrix_inverse_apply(const SkoStructure& tree, const Blocks& blocks, const S* x, S* y, int m, S* scratch) {
  S* z = scratch;
  std::fill_n(z, static_cast<size_t>(tree.dimension()) * m, S(0));
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    check_interrupt_at(k, m);
    S *zk = z + tree.offset[k] * m, *yk = y + tree.dof_offset[k] * m;
    blocks.innovation(k, x + tree.dof_offset[k] * m, zk, yk, m);  // yk = ε, zk += Gε
    if (tree.parent[k] >= 0) blocks.shift_add(k, zk, z + tree.offset[tree.parent[k]] * m, m);
    blocks.solve_D_in_place(k, yk, m);
  }
  S* alpha = scratch;
  for (int k = 0; k < tree.bodies(); ++k) {
    check_interrupt_at(k, m);
    S *ak = alpha + tree.offset[k] * m, *yk = y + tree.dof_offset[k] * m;
    std::fill_n(ak, tree.size[k] * m, S(0));
    if (tree.parent[k] >= 0) {
      blocks.shift_transposed_add(k, alpha + tree.offset[tree.parent[k]] * m, ak, m);
      blocks.gain_transposed_subtract(k, ak, yk, m);
    }
    blocks.hinge_transposed_add(k, yk, ak, m);
  }
}

}  // namespace pycraft
