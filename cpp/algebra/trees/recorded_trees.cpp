// Bare trees at the recorded scalar: by themselves, as no time is spent in them (CMakeLists.txt).
#include "algebra/trees/aggregated_values.h"
#include "algebra/trees/matrix_tree_values.h"
#include "numerics/recorded.h"

namespace pycraft {

std::unique_ptr<SkoValues<Recorded>> MatrixTree::make_values(Recorded) const { return std::make_unique<MatrixTreeValues<Recorded>>(*this); }
std::unique_ptr<SkoValues<Recorded>> AggregatedTree::make_values(Recorded) const { return std::make_unique<AggregatedValues<Recorded>>(*this); }

}  // namespace pycraft
