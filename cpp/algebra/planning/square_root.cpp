#include "algebra/planning/square_root.h"

#include "algebra/language/display.h"
#include "algebra/language/properties.h"
#include "algebra/planning/simplify.h"
#include "algebra/theorems/polynomial.h"
#include "runtime/errors.h"

namespace pycraft {

// Whether e is its own transpose, body by body, by what the theorems make of it.
static bool symmetric_block_diagonal_by_theorems(const Expression& e) {
  if (e.floating() || !(e.domain() == e.codomain().dual())) return false;
  const Expression shortest = simplify(e);
  if (is_block_diagonal(shortest) && is_symmetric(shortest)) return true;
  for (const Expression& spelling : {e, shortest}) {
    Alphabet alphabet;
    const auto form = normal_form(spelling, alphabet);
    if (!form) continue;
    const Expression made = to_expression(*form, alphabet, e.domain(), e.codomain());
    if (!is_block_diagonal(made)) continue;
    const auto starred = normal_form(made.T(), alphabet);
    if (starred && *starred == *form) return true;
  }
  return false;
}

Expression square_root(const Expression& a) {
  if (a.floating() && a.kind() != NodeKind::identity) throw SpaceError("sqrt(" + label(a) + "): it has no space yet");
  if (a.kind() != NodeKind::identity && !(is_block_diagonal(a) && is_symmetric(a)) && !symmetric_block_diagonal_by_theorems(a))
    throw SpaceError("sqrt(" + label(a) + "): a square root is taken of a symmetric block-diagonal operator, body by body");
  return square_root_of(a);
}

}  // namespace pycraft
