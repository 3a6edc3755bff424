#include "operators/alphabet.h"

#include <algorithm>

#include "operators/directions.h"
#include "operators/embedded_operators.h"
#include "operators/grouped_operators.h"
#include "operators/multibody_operators.h"
#include "runtime/errors.h"

namespace pycraft {

const std::vector<const SymbolDefinition*>& alphabet() {
  static const std::vector<const SymbolDefinition*> all = [] {
    std::vector<const SymbolDefinition*> found;
    for (const auto* table : {&sko_symbols(), &mechanics_symbols(), &derivative_symbols(), &grouped_symbols(), &embedding_symbols()})
      for (const SymbolDefinition& d : *table) found.push_back(&d);
    std::sort(found.begin(), found.end(), [](const auto* a, const auto* b) { return a->id < b->id; });
    return found;
  }();
  return all;
}

const SymbolDefinition& definition_of(SymbolId id) {
  return **std::lower_bound(alphabet().begin(), alphabet().end(), id, [](const auto* d, SymbolId wanted) { return d->id < wanted; });
}

const SymbolDefinition& definition_named(const std::string& ascii) {
  for (const SymbolDefinition* d : alphabet())
    if (d->ascii == ascii) return *d;
  throw EvaluationError("no operator is called '" + ascii + "'");
}

}  // namespace pycraft
