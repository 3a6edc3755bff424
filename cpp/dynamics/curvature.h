// Second derivatives of inverse dynamics, contracted: of the power μ*T of a virtual velocity μ, T = ID(q, v, v̇), in O(N) a direction.
//
// In the frame of recursions/inertial_frame.h, W(k) the virtual velocity of body k, W⁻ that just inboard of a subhinge, ΔW(k) what its hinge adds:
//
//   base to tip:  W(k) = W⁻(k) + ΔW(k),  ΔW = Σ μ_j S_j,    χ_j = W⁻ × S_j
//   tip to base:  p(k) = R ΔW + Σ_children p,    c(k) = B* ΔW + Σ_children c,    P = p + R W⁻,    C = c + B* W⁻
//
// with the sums R, B and F over subtrees, so that P = Σ I W and C = Σ B* W. A displacement along S_j moves all that is outboard rigidly, which
// changes no power; what it changes besides is ψ̇_j, ψ̈_j and χ_j, the same for every body there:
//
//   ∂(μ*T)/∂q_j = ψ̈_j·P + ψ̇_j·C + χ_j·F,    ∂(μ*T)/∂v_j = (Ṡ_j + ψ̇_j)·P + S_j·C + ∂(μ*c)/∂v_j,    ∂(μ*T)/∂v̇_j = S_j·P + (J μ)_j
//
// with c(v) of rotors (model/rotor_forces.h). These are computed on numbers with derivatives along four directions at a time, whose derivatives are the second ones: along q_i of a
// derivative along q_j, which on ball and free hinges are quasi-velocities and do not commute. Cost O(N · nv).
// Source: the gradient of the power as in J. Nganga, P. M. Wensing, Accelerating second-order differential dynamic programming for rigid-body
// systems, IEEE Robotics and Automation Letters 6 (2021), there by reverse accumulation, here in closed form.
#pragma once

#include <memory>
#include <vector>

#include "dynamics/tangent_directions.h"
#include "model/multibody.h"
#include "recursions/inertial_frame.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

template <class T>
class Curvature {
 public:
  static constexpr int width = 4;
  static constexpr int blocks = 4;  // along q and q, q and v, q and v̇, v and v; what is not there is zero
  using S = Tangent<T, width>;

  explicit Curvature(const Multibody& model);

  // For each of `count` virtual velocities μ (nv) the four blocks (nv x nv), entry (i, j) the derivative along the first's i of that along the
  // second's j. Gravity null: the model's.
  void inverse_dynamics(const T* q, const T* v, const T* vdot, const T* mu, int count, T* out, const Vector3<T>* gravity = nullptr);

 private:
  void contract(const T* mu);

  const SkoStructure tree_;
  std::shared_ptr<const CompiledModel<T>> values_;
  CompiledModel<S> model_;
  RigidBlocks<S> blocks_;
  InertialFrame<S> frame_;
  TangentDirections<T, width> state_;
  std::vector<S> vdot_, mu_, of_rotors_;          // of rotors: ∂(μ*c)/∂v
  std::vector<Vector6<S>> W_, momentum_, chi_;    // W per body; p, then P; χ per coordinate
  std::vector<Vector3<S>> couple_;                // c, then C: the linear part of B* W is zero
};

#define PYCRAFT_EXTERN(S) extern template class Curvature<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
