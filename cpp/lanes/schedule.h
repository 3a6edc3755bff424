// Instructions in another order, in which equal ones come one after the other: a run of them is called once.
#pragma once

#include "lanes/instructions.h"

namespace pycraft::kernels {

// None comes before what it reads, and none so much earlier that its numbers would take many places.
void schedule(Instructions& instructions);

}  // namespace pycraft::kernels
