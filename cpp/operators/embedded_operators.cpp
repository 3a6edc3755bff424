#include "operators/embedded_operators.h"

#include <algorithm>

#include "operators/alphabet.h"
#include "operators/embedded_values.h"
#include "runtime/errors.h"

namespace pycraft {

const std::vector<SymbolDefinition>& embedding_symbols() {
  using enum SymbolId;
  using namespace embedding_letters;
  using S = SpaceKind;
  const unsigned moving = Group::kinematics | Group::velocities;
  static const std::vector<SymbolDefinition> table = {
      {coordinate_map, "X_r", "X_r", "X_r", "velocities by independent ones on loops, θ̇ = X_r θ̇_r", S::Theta, S::TreeTheta, Pattern::block_diagonal},
      {coordinate_map_rate, "X_r_dot", "Ẋ_r", "\\dot{X}_r", "rate of X_r along θ̇", S::Theta, S::TreeTheta, Pattern::block_diagonal, {.groups = moving}},
      {coordinate_map_tangent, "dX_r", "∂X_r", "\\partial X_r", "derivative of X_r along an independent coordinate", S::Theta, S::TreeTheta,
       Pattern::block_diagonal, {.takes = Takes::place}},
      {second_map_tangent, "ddX_r", "∂²X_r", "\\partial^2 X_r", "second derivative of X_r, along a coordinate and what comes after it", S::Theta, S::TreeTheta, Pattern::block_diagonal,
       {.takes = Takes::direction}},
      {second_map_rate, "dX_r_dot", "∂Ẋ_r", "\\partial\\dot{X}_r", "second derivative of X_r, along time among others", S::Theta, S::TreeTheta, Pattern::block_diagonal,
       {.groups = moving, .takes = Takes::direction}},
      {dependent_shift, "dtheta_d", "∂θ_d", "\\partial\\theta_d", "how dependent coordinates follow twists in hinges", S::Euclidean, S::TreeTheta, Pattern::vector,
       {.takes = Takes::direction}},
      {parameter_map_tangent, "dX_r_p", "∂ₚX_r", "\\partial_p X_r", "derivative of X_r along twists in hinges", S::Theta, S::TreeTheta, Pattern::block_diagonal,
       {.takes = Takes::direction}},
  };
  return table;
}

namespace {

// The groups' own structure without the dependent coordinates.
SkoStructure reduced(const GroupedOperators& grouped, const std::vector<EmbeddedLoops>& sets) {
  const SkoStructure& robot = grouped.base()->structure();
  std::vector<char> dependent(robot.coordinates(), 0);
  for (const EmbeddedLoops& set : sets)
    for (int i : set.dependent) dependent.at(i) = 1;
  SkoStructure s = grouped.structure();
  s.coordinate_names.clear(), s.offset.clear(), s.dof_offset.clear();
  for (int g = 0; g < s.bodies(); ++g) {
    s.dof[g] = 0;
    for (int k : grouped.groups()[g])
      for (int i = robot.dof_offset[k]; i < robot.dof_offset[k + 1]; ++i)
        if (!dependent[i]) s.coordinate_names.push_back(robot.coordinate_names[i]), ++s.dof[g];
  }
  s.finish();
  return s;
}

}  // namespace

EmbeddedOperators::EmbeddedOperators(std::shared_ptr<GroupedOperators> grouped, std::shared_ptr<LoopSet> loops, std::vector<EmbeddedLoops> sets)
    : DerivedOperators(reduced(*grouped, sets), grouped->base()->name() + ", loops embedded", grouped->base()), grouped_(std::move(grouped)),
      loops_(std::move(loops)), sets_(std::move(sets)), row_names_(loops_->resolved()->names), set_of_(structure().bodies(), -1),
      coordinates_(structure().bodies()), independent_of_(structure().bodies()) {
  const SkoStructure& robot = base_->structure();
  share_bodies_with(*grouped_);
  for (size_t i = 0; i < sets_.size(); ++i) {
    const EmbeddedLoops& set = sets_[i];
    if (set.rows.size() != set.dependent.size() || set.bodies.empty())
      throw ModelError("embedded loops of '" + base_->name() + "': " + std::to_string(set.rows.size()) + " rows are solved for " + std::to_string(set.dependent.size()) + " coordinates");
    for (int row : set.rows)
      if (row < 0 || row >= static_cast<int>(row_names_.size())) throw ModelError("embedded loops of '" + base_->name() + "': no row " + std::to_string(row));
    set_of_[grouped_->grouping().group_of[set.bodies[0]]] = static_cast<int>(i);
  }
  for (int g = 0; g < structure().bodies(); ++g) {
    const EmbeddedLoops* const set = loops_of(g);
    for (int k : grouped_->groups()[g])
      for (int i = robot.dof_offset[k]; i < robot.dof_offset[k + 1]; ++i) {
        if (!set || std::find(set->dependent.begin(), set->dependent.end(), i) == set->dependent.end())
          independent_of_[g].push_back(static_cast<int>(coordinates_[g].size()));
        coordinates_[g].push_back(i);
      }
  }
}

std::vector<int> EmbeddedOperators::independent() const {
  std::vector<int> all;
  for (int g = 0; g < structure().bodies(); ++g)
    for (int place : independent_of_[g]) all.push_back(coordinates_[g][place]);
  return all;
}

Traits EmbeddedOperators::traits() const {
  const SkoStructure& own = structure();
  const Traits robot = base_->traits();
  return {own.is_chain(), own.single_dof(), robot.constant_hinges && sets_.empty(), robot.hinge_diagonal, own.free_root(), own.equal_blocks()};
}

BlockCosts EmbeddedOperators::costs(int g) const {
  const int p = structure().parent[g];
  if (is_rigid(g) && (p < 0 || is_rigid(p))) return rigid_costs(structure(), g);
  BlockCosts own = is_rigid(g) ? rigid_costs(structure(), g) : dense_costs(structure(), g);
  const BlockCosts edge = dense_costs(structure(), g);
  own.shift = edge.shift, own.congruence = edge.congruence;
  return own;
}

Space EmbeddedOperators::space(SpaceKind kind, const SymbolArguments& arguments) const {
  if (kind == SpaceKind::TreeTheta) return grouped_->theta();
  if (kind == SpaceKind::NodesV || kind == SpaceKind::NodesF) return grouped_->space(kind, arguments);
  return SkoSource::space(kind, arguments);
}

void EmbeddedOperators::check_current() const {
  base_->check_current();
  if (loops_->resolved()->names != row_names_)
    throw StaleOperatorError("these operators were made before the loops of '" + base_->name() + "' changed; take them anew, soa.embedded()");
}

std::shared_ptr<EmbeddedOperators> embedded_operators(const std::shared_ptr<MultibodyOperators>& base, const std::shared_ptr<LoopSet>& loops,
                                                      std::vector<EmbeddedLoops> sets) {
  std::vector<std::vector<int>> groups;
  for (const EmbeddedLoops& set : sets) groups.push_back(set.bodies);
  auto grouped = std::make_shared<GroupedOperators>(base, Grouping(base->structure(), base->name(), groups, true));
  return std::make_shared<EmbeddedOperators>(std::move(grouped), loops, std::move(sets));
}

Expression embedded_letter(const std::shared_ptr<EmbeddedOperators>& source, const SymbolDefinition& d, const std::vector<std::string>& nodes, int coordinate) {
  const std::shared_ptr<SkoSource> grouped = source->grouped();
  const auto own = [&](SymbolId id) { return make_symbol(definition_of(id), source); };
  const auto tree = [&](SymbolId id) { return make_symbol(definition_of(id), grouped); };
  switch (d.id) {
    case SymbolId::theta_dot:
    case SymbolId::coriolis_acceleration: return own(d.id);
    case SymbolId::H_dot: return own(SymbolId::coordinate_map_rate).T() * tree(SymbolId::H) + own(SymbolId::coordinate_map).T() * tree(SymbolId::H_dot);
    case SymbolId::Jacobian: return node_operator(SymbolId::B, grouped, nodes).T() * own(SymbolId::phi).T() * own(SymbolId::H).T();
    case SymbolId::Lambda: {
      const Expression b = node_operator(SymbolId::B, grouped, nodes);
      return (b.T() * own(SymbolId::Omega) * b).inv();
    }
    default: break;
  }
  if (d.takes == Takes::nodes) return node_operator(d.id, grouped, nodes);
  return d.takes == Takes::place ? delta_operator(grouped, coordinate) : tree(d.id);
}

#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> EmbeddedOperators::make_values(S) const { return std::make_unique<EmbeddedValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

}  // namespace pycraft
