#include "operators/inverse_tangent.h"

#include <algorithm>
#include <cmath>

#include "algebra/language/lower.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/recognise.h"
#include "algebra/theorems/theorems.h"
#include "algebra/trees/sweeps/articulated_inertia.h"
#include "algebra/trees/sweeps/mass_matrix.h"
#include "operators/alphabet.h"
#include "operators/rigid_values.h"

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

template <class S>
Vector6<S> value(const Vector6<Tangent<S, 1>>& u) {
  Vector6<S> x;
  for (int i = 0; i < 6; ++i) x[i] = u[i].x;
  return x;
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

template <class S>
void RigidInverseTangent<S>::move(const RigidValues<S>& values, const S& amount, const TwistPlace& place) {
  int k;
  const Vector6<S> h = amount * values.twist(place, k);
  const auto add = [&](int body, const Matrix3<S>& turned, const Vector3<S>& shifted) {
    for (int i = 0; i < 9; ++i) blocks_.pose[body].R.m[i].d[0] += turned.m[i];
    for (int i = 0; i < 3; ++i) blocks_.pose[body].p[i].d[0] += shifted[i];
  };
  const int first = tree_.dof_offset[k], last = first + coordinates_before(values.source(), place);
  if (first < last && last == tree_.dof_offset[k + 1]) {
    for (Vector6<T>& u : factors_[k].column) {
      const Vector6<S> moved = cross_force(h, value(u));
      for (int i = 0; i < 6; ++i) u[i].d[0] += moved[i];
    }
    for (int c = k + 1; c < tree_.bodies(); ++c) {
      if (tree_.parent[c] != k) continue;
      const Pose<S>& X = values.blocks().pose[c];
      add(c, skew(h.angular) * X.R, cross(h.angular, X.p) + h.linear);
    }
    return;
  }
  const Pose<S>& X = values.blocks().pose[k];
  add(k, X.R * skew(h.angular), X.R * h.linear);
  for (int j = first; j < last; ++j) {
    const Vector6<S> moved = cross_motion(h, values.blocks().H[j]);
    for (int i = 0; i < 6; ++i) blocks_.H[j][i].d[0] -= moved[i];
    blocks_.aligned[j] = -1;
  }
}

template <class S>
void RigidInverseTangent<S>::seed(const RigidValues<S>& values) {
  if (compiled_ != values.compiled_model()) compiled_ = values.compiled_model(), model_ = broadcast<T>(*compiled_);
  const RigidBlocks<S>& at = values.blocks();
  for (int k = 0; k < tree_.bodies(); ++k) blocks_.pose[k] = cast<T>(at.pose[k]);
  for (int j = 0; j < tree_.coordinates(); ++j) blocks_.H[j] = cast<T>(at.H[j]);
  std::copy(model_.inertia.begin(), model_.inertia.end(), blocks_.inertia.begin());
  std::copy(model_.rotor_inertia.begin(), model_.rotor_inertia.end(), blocks_.J.begin());
  std::copy(at.aligned.begin(), at.aligned.end(), blocks_.aligned.begin());
  factors_ = model_.inertia_factors;
  blocks_.inertia_factors = &factors_;
  blocks_.form = Form::ud;  // reflections would pass over a row that is zero here and not beside it
  for (const auto& [amount, place] : direction_->twists) move(values, S(amount), place);
  for (int i = 0; direction_->time && i < tree_.coordinates(); ++i) move(values, values.v()[i], OfCoordinate{i});
}

template <class S>
bool RigidInverseTangent<S>::apply(const SkoValues<S>& values, const Symbol& letter, const S* x, S* y, int columns) {
  const size_t size = size_t(tree_.coordinates()) * columns;
  x_.assign(x, x + size);
  y_.resize(size), scratch_.resize(size_t(tree_.dimension()) * columns);
  if (!direction_) direction_ = std::get<OfDirection>(letter.arguments);
  seed(static_cast<const RigidValues<S>&>(values));
  articulated_inertia_tip_to_base(tree_, blocks_);
  mass_matrix_inverse_apply(tree_, blocks_, x_.data(), y_.data(), columns, scratch_.data());
  for (size_t i = 0; i < size; ++i) {
    y[i] = y_[i].d[0];
    if (!std::isfinite(to_double(y[i]))) return false;
  }
  return true;
}

#define PYCRAFT_INSTANTIATE(S) template class RigidInverseTangent<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
