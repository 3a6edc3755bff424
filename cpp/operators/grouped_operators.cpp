#include "operators/grouped_operators.h"

#include <algorithm>

#include "operators/grouped_values.h"

namespace pycraft {

const std::vector<SymbolDefinition>& grouped_symbols() {
  static const std::vector<SymbolDefinition> table = {
      {SymbolId::inner_phi, "phi_S", "φ_S", "\\phi_S", "φ within each group of bodies, (I-E_S)⁻¹", SpaceKind::F, SpaceKind::F, Pattern::block_diagonal},
      {SymbolId::inner_H, "H_S", "H_S", "H_S", "hinge maps of the bodies of each group: H = H_S φ_S", SpaceKind::F, SpaceKind::Theta, Pattern::block_diagonal},
  };
  return table;
}

GroupedOperators::GroupedOperators(std::shared_ptr<MultibodyOperators> base, Grouping grouping)
    : DerivedOperators(grouping.structure, base->name() + ", grouped", base), grouping_(std::move(grouping)) {
  share_coordinates_in_groups(*base_, grouping_.groups);
}

Traits GroupedOperators::traits() const {
  const SkoStructure& own = structure();
  const Traits robot = base_->traits();
  const bool grouped = own.bodies() < base_->structure().bodies();
  return {own.is_chain(), own.single_dof(), robot.constant_hinges && !grouped, robot.hinge_diagonal, own.free_root(), own.equal_blocks()};
}

BlockCosts GroupedOperators::costs(int g) const {
  const int p = structure().parent[g];
  BlockCosts own = grouping_.single(g) ? rigid_costs(structure(), g) : dense_costs(structure(), g);
  if (p < 0 || (grouping_.single(g) && grouping_.single(p))) return own;
  const BlockCosts edge = dense_costs(structure(), g);
  own.shift = edge.shift, own.congruence = edge.congruence;
  own.kinematic_numbers += grouping_.single(g) ? double(structure().size[g]) * structure().size[p] : 0.0;
  return own;
}

Space GroupedOperators::space(SpaceKind kind, const SymbolArguments& arguments) const {
  if (kind != SpaceKind::NodesV && kind != SpaceKind::NodesF) return SkoSource::space(kind, arguments);
  return Space(kind, cut_into_groups(base_->space(kind, arguments).layout(), grouping_.groups, this));
}

std::shared_ptr<GroupedOperators> grouped_operators(const std::shared_ptr<MultibodyOperators>& base, const std::vector<std::vector<std::string>>& groups) {
  std::vector<std::vector<int>> numbers;
  for (const auto& names : groups) {
    numbers.emplace_back();
    for (const std::string& name : names) numbers.back().push_back(base->model()->body_index(name));
  }
  return std::make_shared<GroupedOperators>(base, Grouping(base->structure(), base->name(), numbers));
}

#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> GroupedOperators::make_values(S) const { return std::make_unique<GroupedValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

#define PYCRAFT_INSTANTIATE(S)                                 \
  template class TreeValues<MixedBlocks<RigidBlocks<S>>>;      \
  template class ReorderedValues<MixedBlocks<RigidBlocks<S>>>; \
  template class GroupedValues<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
