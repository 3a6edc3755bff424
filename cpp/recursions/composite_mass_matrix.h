// The mass matrix by composite-body inertias:
//
//   R(k) by algebra/trees/sweeps/composite_inertia.h;   ℳ(k,k) = H(k) R(k) H(k)* + J(k);
//   f = R(k) h_j* carried to each ancestor a by f <- φ f:   ℳ(a,k) = H(a) f
//
// Cost O(N · depth). Writes the full symmetric matrix, row-major.
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the composite-rigid-body algorithm.
#pragma once

#include <algorithm>

#include "algebra/trees/sweeps/composite_inertia.h"
#include "rigid/rigid_blocks.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class S>
void composite_mass_matrix(const SkoStructure& tree, const CompiledModel<S>& model, RigidBlocks<S>& blocks, S* out) {
  composite_inertia_tip_to_base(tree, blocks);
  const int N = model.nv;
  std::fill_n(out, size_t(N) * N, S(0));
  for (int k = 0; k < model.bodies; ++k)
    for (int j = model.v_offset[k]; j < model.v_offset[k] + model.nv_of[k]; ++j) {
      check_interrupt_at(k, k);
      Vector6<S> f = blocks.R[k] * blocks.H[j];
      for (int a = k; a >= 0; a = model.parent[a]) {
        const int first = model.v_offset[a], last = a == k ? j + 1 : first + model.nv_of[a];
        for (int i = first; i < last; ++i) out[size_t(i) * N + j] = out[size_t(j) * N + i] = dot(blocks.H[i], f);
        f = force_to_parent(blocks.pose[a], f);
      }
      out[size_t(j) * N + j] += blocks.J[j];
    }
}

}  // namespace pycraft
