// Which state of a batch an error is of.
#pragma once

#include <string>

#include "runtime/errors.h"

namespace pycraft {

// check(), which looks through what was given for one state of a batch; its error says for which.
template <class F>
void checking_state(int state, int states, F&& check) {
  if (states < 2) return check();
  try {
    check();
  } catch (const ModelError& e) {
    throw ModelError(e.what() + (" (state " + std::to_string(state) + " of a batch of " + std::to_string(states) + ")"));
  }
}

}  // namespace pycraft
