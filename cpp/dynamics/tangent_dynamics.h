// Derivatives of forward dynamics by the derivative of the sweep itself, several directions at a time.
//
// In the factored forms this keeps the digits that the form keeps: what is left of a heavy column after it has been made orthogonal is
// rounding, and enters the derivative as it enters the value, squared. By way of ∂T/∂q, whose entries are forces, it would not.
// Cost O(N) sweeps of O(N), each worth about three of the form's.
#pragma once

#include <vector>

#include "dynamics/tangent_directions.h"
#include "model/multibody.h"
#include "numerics/arithmetic.h"
#include "recursions/applied.h"
#include "recursions/point_accelerations.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

template <class T>
class TangentDynamics {
 public:
  static constexpr int width = 4;
  using S = Tangent<T, width>;

  explicit TangentDynamics(const Multibody& model);

  // ∂v̇/∂q, ∂v̇/∂v (nv x nv) along quasi-velocities and velocities. False where the sweep has no derivative: P⁺ lost a direction here
  // that it has beside. SingularHingeError as forward dynamics.
  bool forward_dynamics(const double* q, const double* v, const double* tau, Form form, T* dq, T* dv, const Applied<double>* applied = nullptr);

 private:
  const SkoStructure tree_;
  std::shared_ptr<const CompiledModel<T>> values_;
  CompiledModel<S> model_;
  RigidBlocks<S> blocks_;
  PointAccelerations<S> points_;
  std::vector<Vector6<S>> alpha_, force_;
  std::vector<Vector6<S>> wrenches_;
  TangentDirections<T, width> state_;
  std::vector<S> tau_, vdot_;
  std::vector<T> at_, velocity_;
};

#define PYCRAFT_EXTERN(S) extern template class TangentDynamics<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
