#include "algebra/trees/aggregated_tree.h"

#include "algebra/trees/aggregated_values.h"

namespace pycraft {

AggregatedTree::AggregatedTree(std::shared_ptr<SkoSource> base) : AggregatedTree(base, Grouping(base->structure(), base->name(), pairs_of_bodies(base->structure()))) {}

AggregatedTree::AggregatedTree(std::shared_ptr<SkoSource> base, Grouping grouping)
    : SkoSource(grouping.structure, base->name() + ", grouped"), base_(std::move(base)), grouping_(std::move(grouping)) {
  share_coordinates_in_groups(*base_, grouping_.groups);
}

Traits AggregatedTree::traits() const {
  const SkoStructure& own = structure();
  const bool grouped = own.bodies() < base_->structure().bodies();
  return {own.is_chain(), own.single_dof(), base_->traits().constant_hinges && !grouped, base_->traits().hinge_diagonal, own.free_root(), own.equal_blocks()};
}

#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> AggregatedTree::make_values(S) const { return std::make_unique<AggregatedValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

}  // namespace pycraft
