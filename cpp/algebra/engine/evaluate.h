// Evaluation of expressions and scalars, and residuals: what is made of one run of a plan or of several.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "algebra/engine/engine.h"
#include "algebra/language/scalar_expression.h"

namespace pycraft {

std::shared_ptr<ExecutionPool> prepare(const Expression& e, Request request, bool rules = true);
void evaluate(const Expression& e, Request request, const Inputs& inputs, Result& result, bool rules = true, bool expansions = false);
// y = e x
void apply(const Expression& e, const Inputs& inputs, Result& result, bool rules = true, bool expansions = false);
// dense, block_diagonal, diagonal, trace, logdet, norm
void evaluate(const Expression& e, Request request, Result& result, bool rules = true, bool expansions = false);
std::vector<double> evaluate(const Scalar& s, int* batch, bool rules = true);

// ‖a - b‖, ‖a‖, ‖b‖ (largest entries), both sides evaluated as typed, no theorem used, the difference taken at the bound precision.
// on_one_path: only blocks (i, j) with i and j on one path to the base. at_most: only what a exceeds b by.
// Operators of many columns are compared on a few random vectors of signs instead of column by column.
struct Residual {
  double difference = 0, left = 0, right = 0;
};
Residual residual(const Expression& a, const Expression& b, const std::map<std::string, std::vector<double>>& vectors, bool on_one_path = false,
                  bool at_most = false);
Residual residual(const Scalar& a, const Scalar& b);

}  // namespace pycraft
