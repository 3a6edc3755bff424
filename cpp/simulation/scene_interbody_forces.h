// Interbody forces of a scene at a state: those of its accelerations, under the gravity and the wrenches of the effects that are on. Forces that
// effects put on coordinates act between a body and its parent: they are part of what the hinge between them carries, and so are those of couplings
// and of prescribed motion. Loops that are kept put wrenches on the bodies that they join. Cost O(N).
#pragma once

#include "dynamics/interbody_forces.h"
#include "simulation/compiled_scene.h"
#include "simulation/selection.h"

namespace pycraft {

// Bodies that loops join, and what these put on them at the last state; the base is moved by none.
template <class S>
struct LoopWrenches {
  PushedNodes on{{}, false};
  std::vector<S> numbers;  // six a node

  LoopWrenches(const Multibody& model, const SceneLoops<S>& loops) {
    for (size_t l = 0; l < loops.kept().loops.size(); ++l) {
      const Loop& loop = *loops.kept().loops[l].loop;
      for (const bool on_a : {false, true}) {
        const Node node = node_named(model, on_a ? loop.pair.a : loop.pair.b, "loop");
        if (loop.is_coupling() || node.body < 0) continue;
        on.nodes.push_back(node);
        const Vector6<S> f = loops.force(static_cast<int>(l), on_a);
        for (int i = 0; i < 6; ++i) numbers.push_back(f[i]);
      }
    }
  }
};

// To `on`; own: the effects' states; vdot (nv): scratch, afterwards the accelerations. Errors are those of CompiledScene::accelerations.
template <class S>
void scene_interbody_forces(CompiledScene<S>& scene, const S& t, const S* q, const S* v, const S* own, S* vdot, InterbodyForces<S>& on) {
  scene.accelerations(t, q, v, own, vdot);
  SceneForces<S>& effects = scene.effects();
  Applied<S> applied{Vector3<S>::zero(), effects.wrenched().empty() ? nullptr : effects.wrenches()};
  for (const auto& e : effects.effects())
    if (e->declared.uniform_gravity) applied.gravity = applied.gravity + cast<S>(e->declared.gravity);
  on.place(q);
  std::vector<Vector6<S>> wrenches;
  if (scene.loops()) {
    const LoopWrenches<S> of_loops(scene.scene().model(), *scene.loops());
    const Vector6<S>* const pushed = on.on_bodies(of_loops.on, of_loops.numbers.data());
    for (int k = 0; k < on.model().bodies; ++k) wrenches.push_back(applied.wrenches ? applied.wrenches[k] + pushed[k] : pushed[k]);
    applied.wrenches = wrenches.data();
  }
  on.find(v, vdot, applied);
}

}  // namespace pycraft
