// Sensitivities to the numbers of a model: the inertial regressor, gradients of ln det(ℳ + J) (sensitivities.h).
#pragma once

#include "dynamics/sensitivities.h"
#include "recursions/kinematics.h"
#include "recursions/log_determinant.h"
#include "recursions/newton_euler.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class S>
void Sensitivities<S>::inertial_regressor(const S* q, const S* v, const S* vdot, S* out, const Vector3<S>* gravity) {
  const CompiledModel<S>& m = *model_;
  const int columns = 10 * m.bodies;
  kinematics(m, q, blocks_);
  point_accelerations_base_to_tip(m, blocks_.pose.data(), blocks_.H.data(), v, OwnTerms::kept, points_);
  rates_.resize(m.nv);
  newton_euler(m, blocks_, points_, gravity ? Applied<S>{*gravity} : own_gravity(m), vdot, rates_.data(), alpha_, force_);
  std::fill_n(out, size_t(m.nv) * columns, S(0));
  for (int k = 0; k < m.bodies; ++k) {
    check_interrupt_at(k, k);
    const Vector3<S>& omega = points_.angular_velocity[k];
    for (int p = 0; p < 10; ++p) {
      RigidInertia<S> unit = RigidInertia<S>::zero();
      if (p == 0)
        unit.mass = S(1);
      else if (p < 4)
        unit.moment[p - 1] = S(1);
      else
        unit.rotational.s[p - 4] = S(1);
      Vector6<S> f = unit * alpha_[k] + gyroscopic_part(unit, omega);
      for (int a = k; a >= 0; a = m.parent[a]) {
        for (int i = m.v_offset[a]; i < m.v_offset[a] + m.nv_of[a]; ++i) out[size_t(i) * columns + 10 * k + p] = dot(blocks_.H[i], f);
        f = force_to_parent(blocks_.pose[a], f);
      }
    }
  }
}

template <class S>
void Sensitivities<S>::log_determinant(const S* q, S* coordinates, S* inertias, S* geometry, S* axes) {
  log_determinant_gradient(*model_, tree_, blocks_, frame_.subhinge_of, q, LogDeterminant<S>{coordinates, inertias, geometry, axes});
}

}  // namespace pycraft
