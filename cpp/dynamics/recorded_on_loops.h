// Dynamics on loops written down operation by operation, for source to be made of it (pycraft/compiled): the recursion of constrained_dynamics.h runs
// once, at a state on the loops, on numbers that remember what becomes of them. What it decides by numbers, which rows ask something, that none hang
// together, and that what comes out was put into both equations, stays behind as guards: where they do not hold the tape says nothing.
#pragma once

#include <memory>

#include "lanes/tape.h"
#include "model/loops.h"

namespace pycraft {

// θ̈ (nv) by tree augmentation, form fast, no refinement; inputs q, v and T are arrays 0, 1, 2. At q, v and tau the results equal the call itself.
// ModelError if the loops contain what cannot be recorded, such as a user's function; EvaluationError if they need more than `most` operations;
// otherwise the errors of the call itself.
kernels::Tape recorded_on_loops(const Multibody& model, const std::shared_ptr<const ResolvedLoops>& loops, const double* q, const double* v, const double* tau, size_t most);

}  // namespace pycraft
