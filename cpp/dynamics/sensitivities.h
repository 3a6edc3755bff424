// Derivatives of the direct calls along coordinates, velocities and inertial parameters, on arrays: no algebra, O(N · depth) or the
// size of the result. Derivatives are along quasi-velocities on ball and free hinges; third-order arrays have the derivative last.
// Source of the equations: recursions/inertial_frame.h; the same quantities as expressions: Operator.diff.
#pragma once

#include <memory>
#include <vector>

#include "algebra/trees/sweeps/mass_matrix.h"
#include "dynamics/coriolis_bodies.h"
#include "dynamics/rigid_dynamics.h"
#include "dynamics/tangent_dynamics.h"
#include "model/multibody.h"
#include "recursions/inertial_frame.h"

namespace pycraft {

template <class S>
class Sensitivities {
 public:
  explicit Sensitivities(const Multibody& model);

  // ∂T/∂q, ∂T/∂v (nv x nv), row the component of T. Rotors add J to ∂T/∂v̇ = ℳ + J, and ∂c/∂v of their v ×* (J v) to ∂T/∂v.
  // Here and below a null gravity is the model's.
  void inverse_dynamics(const S* q, const S* v, const S* vdot, S* dq, S* dv, const Vector3<S>* gravity = nullptr);
  // ∂v̇/∂q, ∂v̇/∂v, ∂v̇/∂T = (ℳ + J)⁻¹ of forward dynamics, in its form: -(ℳ + J)⁻¹ ∂T at v̇, with its corrections, or in a factored form the
  // derivative of the sweep. SingularHingeError as there.
  void forward_dynamics(const double* q, const double* v, const double* tau, const Solving& how, S* dq, S* dv, S* dtau,
                        const Vector3<double>* gravity = nullptr);
  // ∂ℳ/∂q, (nv, nv, nv).
  void mass_matrix(const S* q, S* out);
  // Γ(i, j, k) of Koszul's formula, with the brackets of quasi-velocities: Σ Γ(i,j,k) v_j v_k = C v without gravity. (nv, nv, nv).
  void christoffel(const S* q, S* out);
  // C (nv, nv): Christoffel's Γ v, or Hφ(MJ̇ + 𝓑J).
  void coriolis_matrix(const S* q, const S* v, bool skew, S* out);
  // ∂KE/∂q and ∂KE/∂v = (ℳ + J) v, each (nv). Rotors do not depend on q.
  void kinetic_energy(const S* q, const S* v, S* dq, S* dv);
  // Hamilton's equations: v = (ℳ + J)⁻¹p and ṗ = T + Ḣp - HV̄p of the bodies' momenta φMV, gravity included, each (nv).
  // SingularHingeError as in forward dynamics.
  void hamiltonian(const S* q, const S* p, const S* tau, S* v, S* p_rate, const Vector3<S>* gravity = nullptr);
  // Momentum about the world's origin in world axes: the matrix A (6 x nv), h = A v, and ∂h/∂q (6 x nv).
  void momentum(const S* q, const S* v, S* matrix, S* dq);
  // d/dt of the node Jacobian (6 x nv), and ∂𝒥/∂q (6, nv, nv), both in the node's axes.
  void jacobian_rate(const Node& node, const S* q, const S* v, S* out);
  void jacobian_derivative(const Node& node, const S* q, S* out);
  // Y (nv, 10 bodies) with T = Y π + J v̇ + v ×* (J v); π per body: mass, m c (3), rotational inertia about its origin (xx, xy, xz, yy, yz, zz).
  void inertial_regressor(const S* q, const S* v, const S* vdot, S* out, const Vector3<S>* gravity = nullptr);
  // ∂ ln det(ℳ + J): along coordinates (nv); by π (10 per body); by a twist of each hinge's placement (6 per body); by the rows of H as
  // they stand in the body's axes, poses held (6 per coordinate). Each may be null. Three sweeps in all.
  void log_determinant(const S* q, S* coordinates, S* inertias, S* geometry, S* axes);

 private:
  void frame_at(const S* q, const S* v, const S* vdot, const Vector3<S>* gravity = nullptr);
  void twists_about(int body);  // of the coordinates on its path, about its origin: outboard_
  void differentiate_forces(S* dq, S* dv, int stride);  // ∂T/∂q, ∂T/∂v in the frame that was filled
  void differentiate_rotors(const S* v, S* dv, int stride) const;  // += ∂c/∂v of the rotors' v ×* (J v)
  void add_brackets_of_rotors(S* out) const;  // to Γ
  void differentiate_absorbed(S* dv);
  bool differentiate_sweep(const double* q, const double* v, const double* tau, const Solving& how, S* dq, S* dv, S* dtau, const Applied<double>* applied);
  Pose<S> node_in_axes(const Node& node) const;

  const Multibody& source_;
  const SkoStructure tree_;
  std::shared_ptr<const CompiledModel<S>> model_;
  RigidBlocks<S> blocks_;
  InertialFrame<S> frame_;
  PointAccelerations<S> points_;
  std::vector<Vector6<S>> outboard_, alpha_, force_;
  std::vector<char> straight_;  // per body: nothing up to it turns
  std::vector<S> q_, v_, rates_, work_, solution_, scratch_;
  std::unique_ptr<RigidDynamics<S>> dynamics_;
  std::unique_ptr<TangentDynamics<S>> tangents_;
  std::unique_ptr<CoriolisBodies<S>> coriolis_;
};

#define PYCRAFT_INSTANTIATE(S) extern template class Sensitivities<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
