// What a run need not copy.
#pragma once

#include <algorithm>

#include "algebra/planning/plan.h"

namespace pycraft {

// Doubles are read where they were given, unless an operator from outside could change them meanwhile, and written where they are wanted, by
// steps that write all of a vector.
struct InPlace {
  bool input = false, output = false;
  InPlace() = default;
  explicit InPlace(const Plan& plan) : input(plan.input >= 0 && !plan.calls_outside()) {
    using enum StepKind;
    const auto writer = std::find_if(plan.steps.begin(), plan.steps.end(), [&](const Step& s) { return s.out >= 0 && s.out == plan.output; });
    if (writer == plan.steps.end() || plan.columns_of_identity) return;
    for (const StepKind kind : {gather, scatter, apply_symbol, combine, mass_matrix, mass_matrix_solve}) output |= writer->kind == kind;
  }
};

}  // namespace pycraft
