// What the theorems do for plans: the forms that have kernels, however they are spelled.
#pragma once

#include <string>
#include <vector>

#include "algebra/language/expression.h"

namespace pycraft {

// The cheapest expression that the theorems give for e: recognised forms, cancelled inverses, normal form if it costs less.
Expression optimise(const Expression& lowered, std::vector<std::string>& notes);

// HφMφ*H* and [I-HψK]* D⁻¹ [I-HψK] of one model at one state, lowered: the forms that have kernels.
struct Kernels {
  std::vector<Expression> mass_matrix;          // factors
  std::vector<Expression> mass_matrix_inverse;  // factors
};
Kernels kernels_of(const Symbol& like);

}  // namespace pycraft
