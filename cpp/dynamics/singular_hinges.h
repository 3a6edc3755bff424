// Forward dynamics at singular hinges (rigid_dynamics.h).
//
// ℳ + J n = 0 for some n with n_j ≠ 0, j the coordinate at fault. With an inertia s added to J(j) the matrix is
// regular, and its solution x of forces b ⊥ n is one of the singular system: n*(ℳ + s e e*) x = s n_j x_j = n* b = 0.
#pragma once

#include <vector>

#include "algebra/trees/sweeps/composite_inertia.h"
#include "dynamics/rigid_dynamics.h"
#include "numerics/small_ldl.h"
#include "numerics/small_matrix.h"

namespace pycraft {

template <class S>
template <class F>
typename RigidDynamics<S>::AddedInertias RigidDynamics<S>::with_every_hinge_regular(F f) {
  AddedInertias added;
  for (;;) {
    try {
      f();
      return added;
    } catch (const SingularHingeError& e) {
      for (const auto& [j, _] : added)
        if (j == e.coordinate) throw;
      S inertia = S(1);  // any number will do: of the size of the mass that the hinge would move if all others were locked
      composite_inertia_tip_to_base(tree_, blocks_);
      for (int k = 0; k < model_->bodies; ++k)
        if (e.coordinate >= tree_.dof_offset[k] && e.coordinate < tree_.dof_offset[k + 1]) {
          const S locked = dot(blocks_.H[e.coordinate], blocks_.R[k] * blocks_.H[e.coordinate]);
          if (locked > S(0)) inertia = locked;
        }
      added.emplace_back(e.coordinate, inertia);
      blocks_.J[e.coordinate] += inertia;
    }
  }
}

// x <- x - N (N*N)⁻¹ N* x, N = (ℳ + J)⁻¹ e_j of the regularised matrix for every coordinate at fault.
template <class S>
void RigidDynamics<S>::project_off_null_space(const AddedInertias& added, S* x, int m) {
  const int n = model_->nv, z = static_cast<int>(added.size());
  if (z == 0) return;
  std::vector<S> unit(size_t(n) * z, S(0)), N(size_t(n) * z), gram(size_t(z) * z, S(0)), pivots(z), weights(size_t(z) * m);
  for (int c = 0; c < z; ++c) unit[size_t(added[c].first) * z + c] = added[c].second;
  solve(unit.data(), N.data(), z);
  transposed_multiply_add(N.data(), N.data(), gram.data(), z, n, z);
  if (ldl_in_place(gram.data(), z, pivots.data()) < z) throw SingularOperatorError("the null space of '" + source_.name() + "' at its singular hinges is not resolved");
  for (int pass = 0; pass < 2; ++pass) {  // twice is enough
    std::fill(weights.begin(), weights.end(), S(0));
    transposed_multiply_add(N.data(), x, weights.data(), z, n, m);
    ldl_solve(gram.data(), pivots.data(), z, weights.data(), m);
    multiply_add(N.data(), weights.data(), x, n, z, m, S(-1));
  }
}

}  // namespace pycraft
