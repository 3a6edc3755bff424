// What expressions cost that have parts in common: each part is planned once for all of them.
#pragma once

#include <unordered_map>
#include <utility>
#include <vector>

#include "algebra/language/expression.h"
#include "algebra/planning/planner.h"
#include "algebra/theorems/polynomial.h"

namespace pycraft {

// Of lowered expressions in the letters of one model at one state, applied to a vector as they stand.
class SharedCosts {
 public:
  // one_cut: no coordinates of theirs are cut into bodies in two ways.
  SharedCosts(const Context& model, bool one_cut) : model_(model), one_cut_(one_cut), planner_(PlanOptions{false}) { begin(); }
  bool are_of(const Context& model, bool one_cut) const { return model == model_ && one_cut == one_cut_; }

  double flops(const Expression& e);
  // Of a normal form between these spaces, written out as the sum of its words.
  double flops(const Polynomial& form, const Alphabet& alphabet, const Space& domain, const Space& codomain);

 private:
  void begin();
  int input(const Space& space);
  unsigned groups_of(const Expression& e);
  unsigned groups_of_node(const Expression& e);
  double flops_of_steps(std::vector<int> registers);
  double flops_of_values(unsigned groups) const;

  Context model_;
  bool one_cut_;
  Planner planner_;
  std::vector<std::pair<Space, int>> inputs_;                      // registers of what is applied to, by space
  std::vector<int> step_of_;                                       // by register, -1: none
  std::vector<unsigned> counted_;                                  // by step: in which count
  unsigned count_ = 0;
  size_t seen_steps_ = 0;
  std::unordered_map<const Expression::Node*, unsigned> groups_;   // of values, of the nodes that the planner has met and what is below them
  std::unordered_map<const SymbolDefinition*, unsigned> groups_of_compounds_;
};

}  // namespace pycraft
