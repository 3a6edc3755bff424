// A model at the recorded scalar, and the state at which it is recorded.
#pragma once

#include <cmath>

#include "model/compiled_model.h"
#include "model/multibody.h"
#include "numerics/recorded.h"

namespace pycraft {

// A state like any other: angles and travels between 0.4 and 1, either way, from where all coordinates are zero.
StateData generic_state(const Multibody& model);

template <>
std::shared_ptr<const CompiledModel<Recorded>> compile_model<Recorded>(const Multibody& model, const HingeTerms& terms);

// The angle of (x, y) is on no tape.
inline Recorded atan2(const Recorded& y, const Recorded& x) {
  if (y.is_constant() && x.is_constant()) return std::atan2(y.value, x.value);
  off_tape(y);
  return y;
}

}  // namespace pycraft
