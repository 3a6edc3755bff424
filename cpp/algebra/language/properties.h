// Properties known by rule, one short rule per kind of node: no number is looked at.
#pragma once

#include "algebra/language/expression.h"

namespace pycraft {

// Block (k, k) only.
bool is_block_diagonal(const Expression& e);
// Blocks on and above the diagonal (rows of ancestors, columns of descendants), or on and below it.
bool is_upper_triangular(const Expression& e);
bool is_lower_triangular(const Expression& e);
// Whether both are cut into the same bodies and have as many rows at each: blocks (k, k) of what maps one to the other are square. The
// Jacobian of one node, from six coordinates, is square, and has blocks of 6 x 1.
bool cut_equally(const Space& a, const Space& b);
// Whether those rows also stand at the same places in a vector: the diagonal of the matrix is then that of its blocks.
bool cut_at_the_same_rows(const Space& a, const Space& b);
// Whether no space Θ in it is cut into a model's bodies and into groups of them besides: what goes body by body goes by one cut.
bool cut_in_one_way(const Expression& e);
// A* = A by the laws of transposition (after lowering both).
bool is_symmetric(const Expression& e);

}  // namespace pycraft
