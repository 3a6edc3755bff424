// A batch's plan as a program that is done at many states at once (lanes/program.h): what the engine does at one state, on numbers that write
// it down.
#pragma once

#include <memory>

#include "algebra/engine/engine.h"
#include "lanes/program.h"

namespace pycraft {

struct TapedPlan {
  kernels::Program program;
  PassCounts counts;   // at a state
  int rows, columns;   // of the result at a state
  size_t instructions; // for a pack
};

// Whether a plan's batch may be recorded at all.
bool recordable(const Plan& plan);
// Whether what its states have in common is decided once, at one state: the order of pivots of an elimination. Of other plans a program gives the
// bits of what runs state after state.
bool decides_once(const Plan& plan);

// Applied to x of so many columns, or to the number 1. Null where more than `most` operations would be written down, or where the numbers of a state
// decide what cannot be.
std::shared_ptr<const TapedPlan> taped(const std::shared_ptr<const Plan>& plan, int columns, bool with_x, size_t most);

}  // namespace pycraft
