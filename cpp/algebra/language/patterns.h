// What an expression is: a letter, which one, and whose.
#pragma once

#include "algebra/language/expression.h"

namespace pycraft {

inline bool is_symbol(const Expression& e, SymbolId id) { return e.kind() == NodeKind::symbol && e.node().symbol.definition->id == id; }

// A symbol or its transpose.
inline const Symbol* letter_of(const Expression& e, bool& transposed) {
  transposed = e.kind() == NodeKind::transpose;
  const Expression& inner = transposed ? e.children()[0] : e;
  return inner.kind() == NodeKind::symbol ? &inner.node().symbol : nullptr;
}

inline bool same_model(const Symbol& a, const Symbol& b) { return a.source == b.source && a.binding == b.binding; }

}  // namespace pycraft
