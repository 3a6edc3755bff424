// All letters, whichever room their records stand in.
#pragma once

#include <string>
#include <vector>

#include "algebra/language/symbol.h"

namespace pycraft {

// In the order of SymbolId.
const std::vector<const SymbolDefinition*>& alphabet();
const SymbolDefinition& definition_of(SymbolId id);
const SymbolDefinition& definition_named(const std::string& ascii);  // EvaluationError where there is none

}  // namespace pycraft
