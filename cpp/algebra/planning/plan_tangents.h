// Derivatives of inverse mass matrices as letters of their own.
#pragma once

#include "algebra/language/expression.h"
#include "algebra/planning/plan.h"

namespace pycraft {

// The same with -X⁻¹ ∂X X⁻¹, X = HφMφ*H* (+ J), as a letter of its own, and for a trace tr(X⁻¹ ∂X) as tr(D⁻¹ ∂D), where the form carries
// factors of P: differentiated forces lose what these keep (plan_tangents.cpp).
Expression with_swept_tangents(const Expression& lowered, Request request);
bool has_swept_tangent(const Expression& e);

}  // namespace pycraft
