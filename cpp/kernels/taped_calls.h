// What a kernel computes for one model, operation by operation: its loops run once, on numbers that write down what becomes of them
// (traced.h). Source is written from that, for this model alone (pycraft/compiled). Nothing is folded here: constants are operations too, zeros
// and ones among them.
#pragma once

#include "kernels/links.h"
#include "lanes/tape.h"

namespace pycraft::kernels {

// A call's tape; its inputs are q, v and u. `size` numbers are its output; without u, inverse dynamics is that of no acceleration.
Tape tape_of(const Links<double>& links, Call call, const double* gravity, bool with_u, int size);

}  // namespace pycraft::kernels
