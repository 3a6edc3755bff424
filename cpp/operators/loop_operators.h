// Rows of loops (model/loops.h) as operators of the tree that they are declared beside:
//
//   Q = Σ Q_k,        Q_k the columns of the hinge of body k, in the rows that it is around            Θ → rows
//   A = Σ A_k,        A_k the columns of the ends on body k, in the rows of their loops                NodesV(ends) → rows
//   Q = A B* φ* H*    where all loops are of two ends: their rows are g·V, V = V_b - Ad(X⁻¹) V_a, X the pose of the end frame on b in that on a
//
// Q_k and A_k are block diagonal, between Θ, NodesV(ends) and the rows by body: every body has those of the loops that it is around or an end of.
// Σ, ones, adds them up. Ends are bodies and nodes as loops were declared on them; B is their letter. Along coordinates, twists in hinges (which placements and
// axes are) and time
//
//   ∂Q, ∂A, ∂²Q, ∂²A  the rows' own code (recursions/loop_rows.h) with derivatives carried along; of a user's function its second derivatives
//   ∂ₜ∂ₜQ             along v twice, and ∂Q along accelerations
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/loops.h"
#include "operators/derived_operators.h"

namespace pycraft {

// Letters of second derivatives are along one place after the other, each a coordinate, a twist, or time, which is coordinate -1 there.
constexpr OfCoordinate along_time{-1};
inline bool is_time(const TwistPlace& place) { return place == TwistPlace(along_time); }
inline OfDirection direction_at(const TwistPlace& place) { return is_time(place) ? OfDirection{true, {}} : OfDirection{false, {{1.0, place}}}; }

class LoopOperators final : public DerivedOperators {
 public:
  LoopOperators(std::shared_ptr<MultibodyOperators> base, std::shared_ptr<LoopSet> loops);

  const LoopSet& loops() const { return *loops_; }
  // The rows of loops that body k is around or an end of, by number, in order.
  const std::vector<int>& rows_of(int k) const { return rows_[k]; }
  // The bodies and nodes that are ends, as OfNodes has them, without the base; the places of a loop's own a and b among them, -1: the base.
  const std::vector<int>& ends() const { return ends_; }
  const std::vector<std::string>& end_names() const { return end_names_; }
  struct Ends {
    int a = -1, b = -1;
  };
  const Ends& ends_of(const Loop& loop) const { return ends_of_.at(loop.name); }

  // "Q", "A", or a derivative of one (loop_operators.cpp); EvaluationError where it is none of them.
  Expression letter(const std::string& ascii, const SymbolArguments& arguments = {}, const std::string& text = "") const;
  // Q or A with the parts of each row added up, Σ Q_k or Σ A_k: to R^rows.
  Expression whole(const std::string& ascii) const;
  // A B* φ* H*, which Q is where all loops are of two ends; nothing where they are not.
  std::optional<Expression> by_ends() const;
  // ∂ of a letter along coordinates, twists in hinges or time, zero where nothing moves. accelerations: of the tree, for the second time
  // derivative. EvaluationError of what is a second derivative already, and where accelerations are no numbers.
  Expression tangent(const Expression& letter, const std::optional<OfDirection>& along, const std::function<Expression()>& accelerations) const;

  Space space(SpaceKind kind, const SymbolArguments& arguments) const override;
  // StaleOperatorError where loops were added or taken away since.
  void check_current() const override;
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)

 private:
  int place_of(const std::string& frame);
  OfDirection along_numbers(const Expression& vdot) const;
  std::string text_of(const Twists& twists) const;

  std::shared_ptr<LoopSet> loops_;
  std::vector<std::shared_ptr<const Loop>> declared_;
  std::vector<std::vector<int>> rows_;
  std::vector<int> ends_;
  std::vector<std::string> end_names_;
  std::map<std::string, Ends> ends_of_;
  std::shared_ptr<const SpaceLayout> row_layout_;
  Expression sums_;  // Σ
};

}  // namespace pycraft
