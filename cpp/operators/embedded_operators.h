// A robot with its loops embedded: the bodies around each loop are one node of a tree whose coordinates are free of loops.
//
// Bodies are grouped as in operators/grouped_operators.h, S those of a node, H_g = H_S φ_S their hinge map. Of the rows of loops around S as many as
// are independent, Q_S θ̇_S = 0, are solved for dependent coordinates d by the independent ones r, with which alone the node is described:
//
//   θ̇_S = X θ̇_r,  X_r = 1,  X_d = -Q_d⁻¹ Q_r          H_C = X* H_g,  E_C = E_g,  M_C = M_g,  J_C = X* J_g X
//
// so that ℳ_C = X* ℳ X and V_C = V, F_C = F. X moves as loops move, along anything:
//
//   Q_d ∂X_d = -∂Q X,  ∂X_r = 0                        ∂H_C = ∂X* H_g + X* ∂H_g
//   a_C = a_g + H_g* Ẋ θ̇_r
//
// and once more, w the velocities of the tree along each of two directions (X e_i, θ̇, or what follows a twist in a hinge):
//
//   Q_d ∂₂∂₁X_d = -(∂₂(∂₁Q) X + ∂₁Q ∂₂X + ∂₂Q ∂₁X),  ∂₂w₁ = ∂₂X e_i, or ∂₂X θ̇_r
//
// Along a twist in a hinge, as placements and axes are, independent coordinates stay and dependent ones keep the loops: Q_d ∂θ_d = -∂r.
//
// Letters that the robot has body by body are those of the grouped tree, on the same spaces V and F. q stays the tree's: at states that are off the
// loops nothing is evaluated, nor what depends on v where v breaks them. Choices of bodies, rows and coordinates: pycraft/models/embedded_loops.py.
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapter on constraint embedding.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/loops.h"
#include "operators/grouped_operators.h"

namespace pycraft {

// Letters that only derivatives of embedded loops bring up: after all in SymbolId.
namespace embedding_letters {
constexpr SymbolId second_map_tangent = static_cast<SymbolId>(1021), second_map_rate = static_cast<SymbolId>(1022), dependent_shift = static_cast<SymbolId>(1023),
                   parameter_map_tangent = static_cast<SymbolId>(1024);
}

// Records of the letters that embedded loops alone have.
const std::vector<SymbolDefinition>& embedding_symbols();

// The bodies around loops that hang together, the independent ones of their rows, and as many coordinates of the tree, which these are solved for.
struct EmbeddedLoops {
  std::vector<int> bodies, rows, dependent;
};

class EmbeddedOperators final : public DerivedOperators {
 public:
  // ModelError where bodies do not hang together, or rows and dependent coordinates are not as many.
  EmbeddedOperators(std::shared_ptr<GroupedOperators> grouped, std::shared_ptr<LoopSet> loops, std::vector<EmbeddedLoops> sets);

  // The same groups of bodies, nothing embedded.
  const std::shared_ptr<GroupedOperators>& grouped() const { return grouped_; }
  const std::shared_ptr<LoopSet>& loops() const { return loops_; }
  const std::vector<EmbeddedLoops>& sets() const { return sets_; }
  // Of node g: its loops, null where it has none; its coordinates in the tree; which of them, by place, depend on the others.
  const EmbeddedLoops* loops_of(int g) const { return set_of_[g] < 0 ? nullptr : &sets_[set_of_[g]]; }
  const std::vector<int>& coordinates_of(int g) const { return coordinates_[g]; }
  const std::vector<int>& independent_of(int g) const { return independent_of_[g]; }
  // The tree's coordinate of each of Θ_r.
  std::vector<int> independent() const;
  // Whether a node is a rigid body with its own hinge.
  bool is_rigid(int g) const { return grouped_->grouping().single(g) && set_of_[g] < 0; }

  Traits traits() const override;
  BlockCosts costs(int g) const override;
  Space space(SpaceKind kind, const SymbolArguments& arguments) const override;
  void check_current() const override;
  // Not recorded, as states off the loops have no numbers: batches run state after state.
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)

 private:
  std::shared_ptr<GroupedOperators> grouped_;
  std::shared_ptr<LoopSet> loops_;
  std::vector<EmbeddedLoops> sets_;
  std::vector<std::string> row_names_;
  std::vector<int> set_of_;
  std::vector<std::vector<int>> coordinates_, independent_of_;
};

std::shared_ptr<EmbeddedOperators> embedded_operators(const std::shared_ptr<MultibodyOperators>& base, const std::shared_ptr<LoopSet>& loops,
                                                      std::vector<EmbeddedLoops> sets);

// A letter of mechanics of embedded loops: of the grouped tree where it is made body by body.
Expression embedded_letter(const std::shared_ptr<EmbeddedOperators>& source, const SymbolDefinition& definition, const std::vector<std::string>& nodes, int coordinate);

}  // namespace pycraft
