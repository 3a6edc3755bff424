// The numbers of a model with the rotors that all effects of a scene bring, in the scalar of the scene: for effects that need ℳ + J.
#pragma once

#include <memory>

#include "model/compiled_model.h"
#include "simulation/effect.h"

namespace pycraft {

template <class S>
std::shared_ptr<const CompiledModel<S>> model_with_rotors(const Multibody& model, const HingeTerms& terms) {
  const HingeTerms rotors{.inertia = terms.inertia};
  if constexpr (requires(S x) { x.d; })
    return std::make_shared<const CompiledModel<S>>(broadcast<S>(*compile_model<double>(model, rotors)));
  else
    return compile_model<S>(model, rotors);
}

}  // namespace pycraft
