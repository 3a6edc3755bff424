// Forward dynamics of several states at once: the same kernels on packs, in the forms that never branch on a value (fast, ud).
#pragma once

#include <vector>

#include "model/multibody.h"
#include "numerics/arithmetic.h"
#include "numerics/pack.h"
#include "recursions/applied.h"
#include "recursions/point_accelerations.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

template <class T>
class PackedDynamics {
 public:
  static constexpr int width = 32 / sizeof(T);
  using S = Pack<T, width>;

  explicit PackedDynamics(const Multibody& model);

  // States b = 0, ..., width - 1 at q + b*q_stride, ...; accelerations to vdot + b*nv. False where a hinge of one of them is in doubt:
  // nothing is decided then, and the states are to be taken one by one. `applied` acts on all of them; null: the model's gravity alone.
  bool forward_dynamics(const double* q, size_t q_stride, const double* v, size_t v_stride, const double* tau, size_t tau_stride, double* vdot, Form form,
                        const Applied<double>* applied = nullptr);

 private:
  static void load(const double* from, size_t stride, int n, std::vector<S>& to);

  const SkoStructure tree_;
  CompiledModel<S> model_;
  RigidBlocks<S> blocks_;
  PointAccelerations<S> points_;
  std::vector<Vector6<S>> alpha_, force_;
  std::vector<Vector6<S>> wrenches_;
  std::vector<S> q_, v_, tau_, vdot_;
};

extern template class PackedDynamics<Single>;
extern template class PackedDynamics<double>;

}  // namespace pycraft
