#include "operators/inverse_tangent.h"

#include <algorithm>

#include "algebra/language/lower.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/recognise.h"
#include "algebra/theorems/theorems.h"
#include "operators/alphabet.h"
#include "operators/inverse_tangent_sweep.h"

namespace pycraft {

namespace {

std::unique_ptr<Direction> as_direction(const std::shared_ptr<MultibodyOperators>& source, const OfDirection& direction) {
  return direction.time ? time_direction(source, {}) : twist_direction(source, direction.twists);
}

const Symbol* delta_of(const Expression& e) {
  return e.kind() == NodeKind::symbol && e.node().symbol.definition->id == SymbolId::Delta ? &e.node().symbol : nullptr;
}

// Σ c Δ(twist), if e is such a sum.
std::optional<Twists> twists_of(const Expression& e) {
  Twists twists;
  for (const Expression& t : e.kind() == NodeKind::sum ? e.children() : std::vector<Expression>{e}) {
    const Scaled part = split_scalar(t);
    const Symbol* delta = delta_of(part.expression);
    if (!delta || !part.coefficient.is_double()) return std::nullopt;
    twists.emplace_back(part.coefficient.nearest(), place_in(delta->arguments));
  }
  return twists;
}

// Directions that the letters of a derivative speak of: time; what follows an E, which ∂E = E Σ c Δ says in full; single twists.
std::vector<OfDirection> directions_in(const Expression& tangent) {
  std::vector<OfDirection> found;
  std::vector<TwistPlace> single;
  bool time = false;
  visit(tangent, [&](const Expression& e) {
    if (e.kind() == NodeKind::symbol) {
      const SymbolId id = e.node().symbol.definition->id;
      time |= id == SymbolId::Delta_theta_dot || id == SymbolId::H_dot;
      if (const Symbol* delta = delta_of(e); delta && std::find(single.begin(), single.end(), place_in(delta->arguments)) == single.end())
        single.push_back(place_in(delta->arguments));
    }
    if (e.kind() != NodeKind::product) return;
    for (size_t i = 0; i + 1 < e.children().size(); ++i)
      if (e.children()[i].is(SymbolId::E) && e.children()[i + 1].kind() == NodeKind::sum)
        if (auto twists = twists_of(e.children()[i + 1])) found.push_back({false, std::move(*twists)});
  });
  for (const TwistPlace& place : single) found.push_back({false, {{1.0, place}}});
  if (time) found.insert(found.begin(), OfDirection{true, {}});
  return found;
}

}  // namespace

Expression expand_inverse_tangent(const Symbol& s) {
  const Letters o(s.source, s.binding);
  const Expression inverse = product_of(mass_matrix_inverse_of(s));
  const auto direction = as_direction(std::dynamic_pointer_cast<MultibodyOperators>(s.source), std::get<OfDirection>(s.arguments));
  return lower(-1.0 * (inverse * differentiate(o.H * o.phi * o.M * o.phi.T() * o.H.T(), *direction) * inverse), false);
}

bool tangent_of_inverse(const std::shared_ptr<MultibodyOperators>& source, const Expression& X, const Expression& tangent, Expression& letter, Expression& of_D) {
  // A fixed twist in the midst of a hinge may move its rows out of what they span here and nowhere beside it: there the sweep has no derivative.
  const auto amid = [&](const Twists::value_type& twist) {
    const auto* of = std::get_if<OfTwist>(&twist.second);
    const int before = of ? coordinates_before(*source, *of) : 0;
    return before > 0 && before < source->structure().dof[of->body];
  };
  for (const OfDirection& direction : directions_in(tangent)) {
    if (std::any_of(direction.twists.begin(), direction.twists.end(), amid)) continue;
    const auto along = as_direction(source, direction);
    if (lower(differentiate(X, *along), false) != tangent) continue;
    const Letters o(source, contexts(X)[0].binding);
    letter = make_symbol(definition_of(SymbolId::inverse_tangent), source, direction, direction.time ? "time" : "a coordinate");
    if (contexts(X)[0].binding) letter = letter.at(contexts(X)[0].binding);
    of_D = lower(differentiate(o.D, *along), false);
    return true;
  }
  return false;
}

#define PYCRAFT_INSTANTIATE(S) template class RigidInverseTangent<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
