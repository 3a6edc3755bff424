// Direct calls for those who want numbers and no algebra: one workspace per thread, batches state after state, no allocation after the
// first call. All arrays are row-major with an optional leading batch axis; SI units; spatial quantities angular first.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dynamics/workspace_pool.h"
#include "model/multibody.h"
#include "operators/rigid_blocks.h"
#include "recursions/velocities.h"

namespace pycraft {

// Numbers of one model at one scalar.
template <class S>
class RigidDynamics {
 public:
  explicit RigidDynamics(const Multibody& model);

  // Each takes one state; sizes are the caller's business (Multibody::check_q, check_v).
  void forward_dynamics(const S* q, const S* v, const S* tau, S* vdot);
  void inverse_dynamics(const S* q, const S* v, const S* vdot, S* tau);   // vdot null: bias forces
  void mass_matrix(const S* q, S* out);           // ℳ + J, full
  void mass_matrix_inverse(const S* q, S* out);   // (ℳ + J)⁻¹, full; O(N) a column
  void jacobian(const Node& node, const S* q, S* out);  // 6 x nv, node axes
  Pose<S> pose(const Node& node, const S* q);     // X_WN
  S kinetic_energy(const S* q, const S* v);       // with rotor inertia
  S potential_energy(const S* q);                 // -Σ m g·c, zero at the world's origin

 private:
  const SkoStructure tree_;
  std::shared_ptr<const CompiledModel<S>> model_;
  RigidBlocks<S> blocks_;
  Velocities<S> velocities_;
  std::vector<Vector6<S>> alpha_, force_;
  std::vector<S> columns_, scratch_, zero_;
};

extern template class RigidDynamics<double>;
extern template class RigidDynamics<Extended>;
extern template class RigidDynamics<Quad>;

template <class S>
using DynamicsPool = WorkspacePool<RigidDynamics<S>>;

}  // namespace pycraft
