// A robot with some connected sets of bodies taken as one node each (algebra/trees/grouping.h): dense blocks of 6n rows beside rigid single bodies, in
// one tree of mixed blocks. Coordinates are the robot's, in its order; V and F are stacked group by group.
//
// Letters that are the robot's, body by body: M, J, B, Δ, Δ_θ̇, Ṽ, V̄, 𝓑, X, Π, ∂M and the vectors θ̇, V, b, γ, h. As Hφ = H_C φ_C and φ = φ_S φ_C,
//
//   a_C = φ_S* a,   a₀_C = φ_S* a₀,   Ḣ_C = Ḣ_S φ_S + (H_C - H_S) Δ_θ̇ φ_S
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapters on transforming SKO models and on constraint embedding.
#pragma once

#include <memory>
#include <vector>

#include "algebra/trees/grouping.h"
#include "operators/derived_operators.h"

namespace pycraft {

// Records of the letters that grouped bodies alone have.
const std::vector<SymbolDefinition>& grouped_symbols();

class GroupedOperators final : public DerivedOperators {
 public:
  GroupedOperators(std::shared_ptr<MultibodyOperators> base, Grouping grouping);

  const Grouping& grouping() const { return grouping_; }
  // Whose bodies each group is, by number.
  const std::vector<std::vector<int>>& groups() const { return grouping_.groups; }

  Traits traits() const override;
  BlockCosts costs(int g) const override;
  Space space(SpaceKind kind, const SymbolArguments& arguments) const override;
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)

 private:
  Grouping grouping_;
};

// The operators of a robot with these bodies, by name, grouped. ModelError for an unknown body, one that is named twice, a set that does not hang together.
std::shared_ptr<GroupedOperators> grouped_operators(const std::shared_ptr<MultibodyOperators>& base, const std::vector<std::vector<std::string>>& groups);

}  // namespace pycraft
