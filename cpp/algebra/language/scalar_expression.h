// Scalars made of operators: trace, ln|det|, norm, their sums, products and quotients. Data, like expressions.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "algebra/language/display.h"
#include "algebra/language/expression.h"

namespace pycraft {

enum class ScalarKind { number, trace, logdet, norm, sum, scaled, product, reciprocal };
const char* scalar_kind_name(ScalarKind kind);

class Scalar {
 public:
  struct Node {
    ScalarKind kind;
    Coefficient value = 0;           // number; factor of scaled
    Expression operand;              // trace, logdet, norm
    std::vector<Scalar> terms;       // sum and product (kept flat), scaled, reciprocal
    int depth = 1;                   // levels of nodes
  };
  explicit Scalar(Node node);        // EvaluationError above most_levels
  static constexpr int most_levels = 1000;
  const Node& node() const { return *node_; }

 private:
  std::shared_ptr<const Node> node_;
};

Scalar number(const Coefficient& value);
Scalar trace(const Expression& e);    // of a map of a space to itself, or to its dual
Scalar logdet(const Expression& e);   // ln|det|
Scalar norm(const Expression& e);     // Frobenius
Scalar operator+(const Scalar& a, const Scalar& b);
Scalar operator-(const Scalar& a, const Scalar& b);
Scalar operator*(const Coefficient& c, const Scalar& a);
Scalar operator*(const Scalar& a, const Scalar& b);
Scalar reciprocal(const Scalar& a);
Scalar power(const Scalar& a, int exponent);
bool operator==(const Scalar& a, const Scalar& b);
Scalar at(const Scalar& a, const std::shared_ptr<const Binding>& binding);
std::string show(const Scalar& a, Style style = Style::unicode);
void visit(const Scalar& a, const std::function<void(const Expression&)>& operands);

}  // namespace pycraft
