// Tree-sparse realizations. Any rational expression over tree blocks is y = C s, T s = B x with states s per body, where T couples a
// body to its parent and children only: φ, ψ and their transposes have one, sums and products stack states, the inverse swaps input
// and output. Block elimination from the leaves to the root makes no fill, so solves, determinants and diagonal blocks are O(N).
//
// A state is an intermediate vector of the expression (one per resolvent, edge shift or inverse), an equation says what it is:
//   φ:  s - E s - x = 0        φ*: s - E* s - x = 0        inverse: (X s) - x = 0        shift: s - x = 0
// Terms multiply a state by a block-diagonal factor, carried up or down one edge where the expression has E or E*.
#pragma once

#include <string>
#include <vector>

#include "algebra/planning/plan.h"

namespace pycraft {

enum class Shift { none, up, down };  // up: row of the parent, column of the child (E); down: row of the child, column of the parent (E*)

struct Realization {
  // c · L(row body) · edge · R(column body), added to equation `row` at state `column`. left, right: block registers, -1 for identity.
  struct Term {
    int row, column;
    Coefficient coefficient;
    int right = -1, left = -1;
    Shift shift = Shift::none;
    int context = -1;       // whose E
  };
  std::vector<Space> states;           // the space of each state; Euclidean ones form the border
  std::vector<Space> equations;        // the space of each equation: same total size
  std::vector<Term> terms;             // T
  std::vector<Term> inputs;            // B: column unused, local
  std::vector<Term> outputs;           // C: row unused, local
  struct Border {                      // dense constants between bodies and border states
    int row, column;
    Coefficient coefficient;
    std::shared_ptr<const ConstantData> constant;
    bool transposed;
  };
  std::vector<Border> border_terms;
  Space domain, codomain;
  std::shared_ptr<SkoSource> tree;     // whose tree is eliminated
  // Sizes for the cost.
  std::vector<int> body_states() const;
  double factor_flops() const;
  double solve_flops() const;
  double entries() const;
};

// Calls f on every register that a step reads: its own, and those of the blocks of its realization, and of its operand's factors.
template <class F>
void each_register_read(const Step& step, F f) {
  for (int r : step.in) f(r);
  if (step.operand)
    for (const Register& r : step.operand->registers)
      if (r.shared >= 0) f(r.shared);
  if (!step.realization) return;
  for (const auto* terms : {&step.realization->terms, &step.realization->inputs, &step.realization->outputs})
    for (const Realization::Term& t : *terms)
      for (int r : {t.left, t.right})
        if (r >= 0) f(r);
}

class Planner;

// The realization of y = e x; emits the block registers it needs through the planner. On failure `reason` says why.
std::shared_ptr<const Realization> build_realization(Planner& planner, const Expression& e, bool local_ends, std::string& reason);

}  // namespace pycraft
