// The tape of a computation on recorded numbers (recorded.h), or an error that names the computation and the reason why there is no tape.
#pragma once

#include <string>

#include "numerics/recorded.h"
#include "runtime/errors.h"

namespace pycraft {

// The tape that record(recording) writes, of at most `most` operations. Throws EvaluationError where the computation takes more or decides by plain
// numbers; `what` names the computation, `instead` is the advice that ends the error.
template <class Record>
kernels::Tape recorded_tape(const std::string& what, size_t most, const std::string& instead, Record record) {
  Recording recording(most);
  try {
    record(recording);
  } catch (const Recording::OffTape&) {
    throw EvaluationError(recording.tape().operations.size() < most
                              ? "compile() cannot record " + what + ": it decides by more than comparisons of its values; " + instead
                              : what + " needs more than " + std::to_string(most) + " operations in straight-line code; " + instead);
  }
  if (!recording.trusted()) throw EvaluationError("compile() cannot record " + what + ": it decides by plain numbers of one state; " + instead);
  return recording.tape();
}

}  // namespace pycraft
