// simplify(): the shortest of what was typed, what lowering gives and what the theorems give.
#include <unordered_map>

#include "algebra/language/lower.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/recognise.h"
#include "algebra/planning/simplify.h"
#include "algebra/theorems/polynomial.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace {

// Letters, and a little for every sum, inverse and scalar.
double length_of_node(const Expression& e) {
  double sum = e.kind() == NodeKind::symbol || e.kind() == NodeKind::vector || e.kind() == NodeKind::constant ? 1.0 : 0.0;
  if (e.kind() == NodeKind::sum) sum += 0.1 * e.children().size();
  if (e.kind() == NodeKind::inverse) sum += 0.5;
  if (e.kind() == NodeKind::transpose) sum += 0.05;
  if (e.kind() == NodeKind::scaled) sum += 0.1;
  if (e.kind() == NodeKind::identity) sum += 0.2;
  return sum;
}

// Written out: a shared part counts wherever it occurs.
double length(const Expression& e) {
  std::unordered_map<const Expression::Node*, double> of;
  each_from_below(e, [&](const Expression& x) {
    double sum = length_of_node(x);
    for (const Expression& c : x.children()) sum += of.at(c.get());
    of.emplace(x.get(), sum);
  });
  return of.at(e.get());
}

}  // namespace

static Expression shortest(const Expression& e) {
  std::vector<Expression> candidates = {lower(e, false)};
  std::vector<std::string> notes;
  candidates.push_back(optimise(candidates[0], notes));
  for (size_t i = 0; i < 2; ++i) {
    Alphabet alphabet;
    if (const auto form = normal_form(candidates[i], alphabet))
      candidates.push_back(lower(to_expression(*form, alphabet, e.domain(), e.codomain()), false));
  }
  Expression best = e;
  for (const Expression& c : candidates)
    if (length(c) < length(best)) best = c;
  return with_batch_of(e, best);
}

Expression simplify(const Expression& e) {
  if (e.floating()) return e;
  e.check_current();
  Expression found;
  with_stack_for(e.node().depth, [&] { found = shortest(e); });
  return found;
}

}  // namespace pycraft
