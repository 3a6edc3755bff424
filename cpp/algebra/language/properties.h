// Properties known by rule, one short rule per kind of node: no number is looked at.
#pragma once

#include "algebra/language/expression.h"

namespace pycraft {

// Block (k, k) only.
bool is_block_diagonal(const Expression& e);
// Blocks on and above the diagonal (rows of ancestors, columns of descendants), or on and below it.
bool is_upper_triangular(const Expression& e);
bool is_lower_triangular(const Expression& e);
// Whether no space Θ in it is cut into a model's bodies and into groups of them besides: what goes body by body goes by one cut.
bool cut_in_one_way(const Expression& e);
// A* = A by the laws of transposition (after lowering both).
bool is_symmetric(const Expression& e);

}  // namespace pycraft
