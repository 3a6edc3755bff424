// A plan as a table.
#pragma once

#include <string>

#include "algebra/planning/plan.h"

namespace pycraft {

std::string explain(const Plan& plan);

}  // namespace pycraft
