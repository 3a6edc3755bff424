// A tree that flies freely with another body as its root: the same bodies and hinge coordinates, the root's own six those of the other body.
// By the blocks alone, of the edges (p, c) on the way from the old root to the new one:
//
//   V(c) = φ*V(p) + H*θ̇   hence   V(p) = φ⁻*V(c) - φ⁻*H*θ̇,   φ = φ(p, c)
//
// turned round an edge has φ(c, p) = φ⁻¹, and -Hφ⁻¹ are its rows, those of the body inboard before. What models do when their root is moved
// (model/structure_edits.h) by their hinges.
#pragma once

#include <memory>
#include <vector>

#include "operators/derived_operators.h"

namespace pycraft {

class RerootedTree final : public DerivedOperators {
 public:
  // ModelError where the model has no one root that is free.
  RerootedTree(std::shared_ptr<MultibodyOperators> base, int root);
  int root() const { return order_.front(); }               // the new one, by its number in the model
  const std::vector<int>& order() const { return order_; }  // of the model's bodies here
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)

 private:
  RerootedTree(std::shared_ptr<MultibodyOperators> base, std::vector<int> order);
  const std::vector<int> order_;
};

}  // namespace pycraft
