#pragma once

#include "algebra/language/expression.h"

namespace pycraft {

// The shortest expression that the rewriting theorems find equal to e; e itself where none is shorter.
Expression simplify(const Expression& e);

}  // namespace pycraft
