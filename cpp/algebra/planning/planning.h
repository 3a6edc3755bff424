// What the planner's files share.
#pragma once

#include <vector>

#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/planning/planner.h"

namespace pycraft::planning {

// The model in whose innovations factor I - HψK this sum may be; null if none.
inline const Symbol* innovations_model(const Expression& e) {
  if (e.kind() != NodeKind::sum) return nullptr;
  for (const Expression& t : e.children()) {
    const Scaled part = split_scalar(t);
    if (part.expression.kind() == NodeKind::product && is_symbol(part.expression.children()[0], SymbolId::H))
      return &part.expression.children()[0].node().symbol;
  }
  return nullptr;
}

inline double block_entries(const Space& rows, const Space& columns) {
  double sum = 0;
  for (size_t k = 0; k < rows.layout().of_body.size(); ++k) sum += double(rows.body_size(static_cast<int>(k))) * columns.body_size(static_cast<int>(k));
  return sum;
}

inline double block_product_flops(const Space& rows, const Space& middle, const Space& columns) {
  double sum = 0;
  for (size_t k = 0; k < rows.layout().of_body.size(); ++k) {
    const int i = static_cast<int>(k);
    sum += 2.0 * rows.body_size(i) * middle.body_size(i) * columns.body_size(i);
  }
  return sum;
}

}  // namespace pycraft::planning
