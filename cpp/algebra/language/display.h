// How an expression is shown.
#pragma once

#include <string>

#include "algebra/language/expression.h"

namespace pycraft {

// A text is a tree, and grows with every repetition of a shared part: what is long ends in " …" soon after `shown` bytes.
enum class Style { unicode, python, latex };
constexpr size_t shown = 400;
std::string show(const Expression& e, Style style = Style::unicode, size_t length = shown);
// In full; EvaluationError above this length.
constexpr size_t longest_text = 10'000'000;
std::string show_in_full(const Expression& e, Style style = Style::unicode);

// What an error calls an expression: short ones by their text.
std::string label(const Expression& e);

}  // namespace pycraft
