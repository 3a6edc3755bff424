// Poses and hinge maps of all bodies at a configuration: the first sweep of everything.
#pragma once

#include <algorithm>

#include "model/compiled_model.h"
#include "model/hinge_kinematics.h"
#include "rigid/rigid_blocks.h"
#include "runtime/interrupt.h"

namespace pycraft {

// M, J and what else of a rigid block policy is the same at every configuration.
template <class S>
void set_constants(const CompiledModel<S>& model, RigidBlocks<S>& blocks) {
  std::copy(model.inertia.begin(), model.inertia.end(), blocks.inertia.begin());
  std::copy(model.rotor_inertia.begin(), model.rotor_inertia.end(), blocks.J.begin());
  std::copy(model.aligned.begin(), model.aligned.end(), blocks.aligned.begin());
  blocks.inertia_factors = &model.inertia_factors;
}

// Fills E (as poses), H, M, J of a rigid block policy. Cost O(N).
template <class S>
void kinematics(const CompiledModel<S>& model, const S* q, RigidBlocks<S>& blocks) {
  for (int k = 0; k < model.bodies; ++k) {
    check_interrupt_at(k);
    blocks.pose[k] = hinge_kinematics(model, k, q, blocks.H.data() + model.v_offset[k]);
  }
  set_constants(model, blocks);
}

}  // namespace pycraft
