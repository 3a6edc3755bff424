// The pose or the Jacobian of a frame in the base as a tape, a function of q, from which source is written (pycraft/compiled). EvaluationError if
// they need more than `most` operations.
#pragma once

#include "lanes/tape.h"
#include "model/multibody.h"

namespace pycraft {

// X (4 x 4), X = X(0,1) ... X(p,k) X(k,node), row after row.
kernels::Tape recorded_pose(const Multibody& model, const Node& frame, size_t most);
// 𝒥 (6 x nv) in the frame's own axes about its origin, row after row: 𝒥_i = φ*(k,node) H*_i.
kernels::Tape recorded_jacobian(const Multibody& model, const Node& frame, size_t most);

}  // namespace pycraft
