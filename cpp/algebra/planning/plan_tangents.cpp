// Derivatives of (ℳ + J)⁻¹ in the forms that carry factors of P.
//
// As it is typed, ∂(X⁻¹) = -X⁻¹ ∂X X⁻¹ differentiates forces, and those of a heavy body hide a light one's: what factors keep is lost. The
// derivative of the sweep itself keeps it, so that a product of this kind becomes a letter which the values apply by that derivative. It
// abbreviates what was typed: where a plan has no use for the letter, or the sweep no derivative, that is computed.
#include <algorithm>

#include "algebra/language/lower.h"
#include "algebra/language/properties.h"
#include "algebra/language/source.h"
#include "algebra/planning/plan_tangents.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/planning.h"
#include "algebra/planning/recognise.h"
#include "algebra/theorems/rules.h"
#include "algebra/theorems/theorems.h"

namespace pycraft {

using namespace planning;

namespace {

bool carries_factors(const std::shared_ptr<const Binding>& binding) {
  return binding && binding->arithmetic.form != Form::fast && binding->arithmetic.precision <= Precision::quad;
}

// ∂(X⁻¹) and ∂D for X⁻¹ `inverse` and ∂X `tangent`; false where X is no mass matrix, or no direction of its model is found.
bool tangents(const Expression& inverse, const Expression& tangent, Expression& letter, Expression& of_D) {
  if (inverse.kind() != NodeKind::inverse || tangent.kind() == NodeKind::inverse) return false;
  const Expression& X = inverse.children()[0];
  const auto models = contexts(X);
  if (models.size() != 1 || !carries_factors(models[0].binding) || !(X.domain() == models[0].source->theta()) || !(X.codomain() == X.domain())) return false;
  if (contexts(tangent).size() != 1) return false;
  const auto known = invert_by_theorem(X);
  const Symbol like{nullptr, models[0].source, models[0].binding, {}, {}};
  if (!known || known->inverse.kind() != NodeKind::product || known->inverse.children() != mass_matrix_inverse_of(like)) return false;
  return models[0].source->tangent_of_inverse(X, tangent, letter, of_D);
}

Expression in_product(const Expression& e) {
  std::vector<Expression> f = e.children();
  bool changed = false;
  for (size_t i = 0; i + 2 < f.size(); ++i) {
    const size_t next = std::find(f.begin() + i + 1, f.end(), f[i]) - f.begin();
    Expression letter, of_D;
    if (next == f.size() || next == i + 1 || !tangents(f[i], product_of({f.begin() + i + 1, f.begin() + next}), letter, of_D)) continue;
    f[i] = -1.0 * letter;
    f.erase(f.begin() + i + 1, f.begin() + next + 1);
    changed = true;
  }
  return changed ? lowered_product(f, e.domain(), e.codomain()) : e;
}

}  // namespace

Expression with_swept_tangents(const Expression& e, Request request) {
  switch (e.kind()) {
    case NodeKind::scaled: {
      const Expression inner = with_swept_tangents(e.children()[0], request);
      return inner.get() == e.children()[0].get() ? e : lowered_product({e.node().coefficient * inner}, e.domain(), e.codomain());
    }
    case NodeKind::sum: {
      std::vector<Expression> terms;
      bool changed = false;
      for (const Expression& t : e.children()) {
        terms.push_back(with_swept_tangents(t, request));
        changed |= terms.back().get() != t.get();
      }
      return changed ? lowered_sum(terms, e.domain(), e.codomain()) : e;
    }
    case NodeKind::product: {
      const std::vector<Expression>& f = e.children();
      Expression letter, of_D;
      if (request == Request::trace)
        for (const bool first : {true, false})
          if (tangents(first ? f.front() : f.back(), product_of({f.begin() + first, f.end() - !first}), letter, of_D)) {
            const Symbol& s = letter.node().symbol;
            return lowered_product({lower(make_symbol(SymbolId::D, s.source, s.binding).inv(), false), of_D}, e.domain(), e.codomain());
          }
      return in_product(e);
    }
    case NodeKind::block_diagonal: {
      const Expression inner = with_swept_tangents(e.children()[0], Request::block_diagonal);
      return inner.get() == e.children()[0].get() ? e : block_diagonal(inner);
    }
    default: return e;
  }
}

bool has_swept_tangent(const Expression& e) {
  bool found = false;
  visit(e, [&](const Expression& x) { found |= x.kind() == NodeKind::symbol && x.node().symbol.definition->tangent_of_inverse; });
  return found;
}

}  // namespace pycraft
