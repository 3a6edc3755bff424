// Nodes of expressions: made with their hash and depth, compared and taken apart whatever their depth.
#pragma once

#include <memory>

#include "algebra/language/expression.h"

namespace pycraft {

// The expression of a node; memo: the one that it shares with another.
Expression make_node(Expression::Node node, std::shared_ptr<Memo> memo = nullptr);

}  // namespace pycraft
