// Interbody forces of a scene at a state: those of its accelerations, under the gravity and the wrenches of the effects that are on. Forces that
// effects put on coordinates act between a body and its parent: they are part of what the hinge between them carries. Cost O(N).
#pragma once

#include "dynamics/interbody_forces.h"
#include "simulation/compiled_scene.h"

namespace pycraft {

// To `on`; own: the effects' states; vdot (nv): scratch, afterwards the accelerations. Errors are those of CompiledScene::accelerations.
template <class S>
void scene_interbody_forces(CompiledScene<S>& scene, const S& t, const S* q, const S* v, const S* own, S* vdot, InterbodyForces<S>& on) {
  scene.accelerations(t, q, v, own, vdot);
  SceneForces<S>& effects = scene.effects();
  Applied<S> applied{Vector3<S>::zero(), effects.wrenched().empty() ? nullptr : effects.wrenches()};
  for (const auto& e : effects.effects())
    if (e->declared.uniform_gravity) applied.gravity = applied.gravity + cast<S>(e->declared.gravity);
  on.place(q);
  on.find(v, vdot, applied);
}

}  // namespace pycraft
