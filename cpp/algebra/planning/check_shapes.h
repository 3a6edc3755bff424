// What a finished plan promises its steps.
#pragma once

#include "algebra/planning/plan.h"

namespace pycraft {

// Throws where a step gets registers of other shapes than it takes: steps do not look again, and would read and write past their ends.
// O(steps), and O(bodies) for each pair of spaces that have a layout each.
void check_shapes(const Plan& plan);

}  // namespace pycraft
