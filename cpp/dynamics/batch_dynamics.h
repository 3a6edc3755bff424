// The direct calls of rigid dynamics on one state or a batch: forward dynamics in packs where that is the same, inverse dynamics, mass
// matrices, Jacobians, poses, energies. Arrays are row-major, state after state; SI units, spatial quantities angular first.
#pragma once

#include <memory>
#include <tuple>
#include <vector>

#include "dynamics/batches.h"
#include "dynamics/packed_dynamics.h"
#include "dynamics/rigid_dynamics.h"

namespace pycraft {

// The corrections of a refined call and what is left of its error, |x - exact|/|x|.
struct RefinementReport {
  std::vector<double> corrections;
  double estimated_error = 0;
};

class BatchDynamics : public Batches<RigidDynamics> {
 public:
  using Batches::Batches;

  // v̇, nv a state. `applied` acts at every state; null: the model's gravity alone. SingularHingeError names the coordinate.
  void forward_dynamics(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, double* vdot,
                        const Applied<double>* applied = nullptr);
  // The same of one state, and how it was refined.
  RefinementReport refinement(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, double* vdot);
  // T, nv a state; without vdot the bias forces 𝒞.
  void inverse_dynamics(const Given& q, const Given& v, const Given* vdot, Precision precision, double* tau, const Applied<double>* applied = nullptr);
  void mass_matrix(const Given& q, Precision precision, double* out);                                     // ℳ + J, (nv, nv) a state
  void mass_matrix_inverse(const Given& q, const Solving& how, Precision precision, double* out);         // (ℳ + J)⁻¹, (nv, nv) a state
  void jacobian(const Node& node, const Given& q, Precision precision, double* out);                      // (6, nv) a state, the node's axes
  void pose(const Node& node, const Given& q, double* out);                                               // X_WN, (4, 4) a state
  void energy(const Given& q, const Given& v, const Vector3<double>& datum, double* out);                 // kinetic, potential

 private:
  template <class S>
  void forward_dynamics_at(const Given& q, const Given& v, const Given& tau, int states, const Solving& how, double* vdot, const Applied<double>* applied);

  std::tuple<WorkspacePool<PackedDynamics<Single>>, WorkspacePool<PackedDynamics<double>>> packs_;
};

}  // namespace pycraft
