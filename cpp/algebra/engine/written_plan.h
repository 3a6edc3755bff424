// A plan, or a scalar that is made of several, as a tape that source is written of (pycraft/compiled).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "algebra/language/scalar_expression.h"
#include "algebra/planning/plan.h"
#include "lanes/tape.h"

namespace pycraft {

// What is computed at one state, as a tape, and the arrays that it reads, by number.
struct WrittenPlan {
  enum class Reads { q, v, x, vector };
  struct Array {
    Reads what;
    std::string name;  // of a named vector
    int width;
  };
  kernels::Tape tape;  // results in the order of entries
  std::vector<Array> arrays;
  int rows = 1, columns = 1;
};

// Contexts that are bound to a batch of one state are functions of q and v, written down as that state decides; the values of all others are
// constants. Throws EvaluationError that names what cannot be written down, or says that more than `most` operations would be.
WrittenPlan written(const std::shared_ptr<const Plan>& plan, size_t most);
WrittenPlan written(const Scalar& scalar, size_t most);

}  // namespace pycraft
