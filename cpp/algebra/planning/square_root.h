// Square roots of operators that the theorems show to be symmetric and block diagonal.
#pragma once

#include "algebra/language/expression.h"

namespace pycraft {

// L with A = L L*, block by block lower triangular (Cholesky). SpaceError where A is not symmetric and block diagonal, neither by its
// structure nor by what the theorems make of it: τ̄P and EP(I-φ⁻¹)* are.
Expression square_root(const Expression& a);

}  // namespace pycraft
