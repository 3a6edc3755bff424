// The theorems that rewrite, compiled to words of letter codes; and the theorems that invert, compiled to normal forms.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "algebra/theorems/polynomial.h"

namespace pycraft {

struct Rule {
  std::vector<int> from;                                // letter codes
  std::vector<std::pair<Coefficient, std::vector<int>>> to;  // sum of words
  std::string theorem;
};

// All rules, transposes included, and those of them that begin with a letter; compiled from sko_theorems once.
const std::vector<Rule>& rewrite_rules();
const std::vector<const Rule*>& rewrite_rules_from(int letter_code);

// A theorem lhs⁻¹ = rhs read on one model's letters: if e is a multiple of some lhs, its inverse by the theorem; else nothing.
struct Inverted {
  Expression inverse;
  std::string theorem;
};
std::optional<Inverted> invert_by_theorem(const Expression& e);

}  // namespace pycraft
