// Laws of any ring of operators, no theorem of SOA among them: transposes go down to the letters, sums and products lose zeros,
// identities and nested scalars, (AB)⁻¹ = B⁻¹A⁻¹ for square factors. The planner and the normal form both start here.
#pragma once

#include "algebra/language/expression.h"

namespace pycraft {

// Letters of a lowered expression: symbol, vector, constant, external, their transposes and inverses, and inverse or blockdiag of a
// lowered expression that is no letter. With expand, compound symbols are replaced by what they abbreviate.
Expression lower(const Expression& e, bool expand);

// c · e, with e free of an outer scalar.
struct Scaled {
  Coefficient coefficient;
  Expression expression;
};
Scaled split_scalar(const Expression& e);

// Lowered sum and product.
Expression lowered_sum(const std::vector<Expression>& terms, const Space& domain, const Space& codomain);
Expression lowered_inverse(const Expression& lowered);
Expression lowered_product(const std::vector<Expression>& factors, const Space& domain, const Space& codomain);

}  // namespace pycraft
