// Floating-point operations and bytes of what plans are made of.
#pragma once

#include "algebra/language/source.h"
#include "algebra/language/symbol.h"

namespace pycraft {

// Floating-point operations per column and per sweep of a tree, by the structure of its blocks.
double symbol_flops(const Symbol& symbol);
double resolvent_flops(const Symbol& symbol);
double group_flops(const SkoSource& source, unsigned group);
double group_bytes(const SkoSource& source, unsigned group);
double mass_matrix_flops(const SkoSource& source, bool inverse);
double mass_matrix_dense_flops(const SkoSource& source);

}  // namespace pycraft
