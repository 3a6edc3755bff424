// What acts on a model from outside: gravity, and forces on its bodies.
#pragma once

#include <vector>

#include "model/compiled_model.h"

namespace pycraft {

template <class S>
struct Applied {
  Vector3<S> gravity;                    // m/s², in the base's axes
  const Vector6<S>* wrenches = nullptr;  // (n; f) on every body, in its axes about its origin; null: none

  // Gravity is the acceleration -g of the base.
  Vector6<S> base() const { return {Vector3<S>::zero(), -gravity}; }
  // f -= what is applied to body k.
  void subtract_from(Vector6<S>& f, int k) const {
    if (wrenches) f = f - wrenches[k];
  }
};

// The model's gravity and nothing else.
template <class S>
Applied<S> own_gravity(const CompiledModel<S>& model) {
  return {model.gravity};
}

// The same in another scalar; `wrenches` holds the converted ones.
template <class S, class T>
Applied<S> converted(const Applied<T>& from, int bodies, std::vector<Vector6<S>>& wrenches) {
  Applied<S> to{cast<S>(from.gravity)};
  if (!from.wrenches) return to;
  wrenches.resize(bodies);
  for (int k = 0; k < bodies; ++k) wrenches[k] = cast<S>(from.wrenches[k]);
  to.wrenches = wrenches.data();
  return to;
}

}  // namespace pycraft
