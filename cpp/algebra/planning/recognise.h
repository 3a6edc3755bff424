// What the theorems do for plans: the forms that have kernels, however they are spelled.
#pragma once

#include <string>
#include <vector>

#include "algebra/language/expression.h"

namespace pycraft {

// The cheapest expression that the theorems give for e: recognised forms, cancelled inverses, normal form if it costs less.
Expression optimise(const Expression& lowered, std::vector<std::string>& notes);

// Of one model at one state, lowered, the forms that have kernels: HφMφ*H*, of five factors, and those of [I-HψK]* D⁻¹ [I-HψK].
constexpr size_t mass_matrix_factors = 5;
std::vector<Expression> mass_matrix_inverse_of(const Symbol& like);

// Whose mass matrix HφMφ*H* e is, and whose a product has in its factors from `at` on; null where it is none.
const Symbol* mass_matrix_model(const Expression& e);
const Symbol* mass_matrix_model(const std::vector<Expression>& factors, size_t at);

// f (HφMφ*H* + J) among the terms of a sum: both of one model, both with one coefficient. Every term is in one of them at most.
struct MassMatrixWithRotors {
  Symbol model;
  Coefficient coefficient;
  size_t product, rotors;  // terms
};
std::vector<MassMatrixWithRotors> mass_matrices_with_rotors(const Expression& sum);

}  // namespace pycraft
