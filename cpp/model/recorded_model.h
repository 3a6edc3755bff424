// A model at the recorded scalar, and the state at which it is recorded.
#pragma once

#include "model/multibody.h"

namespace pycraft {

// A state like any other: angles and travels between 0.4 and 1, either way, from where all coordinates are zero.
StateData generic_state(const Multibody& model);

}  // namespace pycraft
