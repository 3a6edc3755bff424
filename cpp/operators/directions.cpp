#include "operators/directions.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/theorems/theorems.h"
#include "operators/alphabet.h"
#include "operators/embedded_operators.h"
#include "operators/grouped_operators.h"
#include "operators/inverse_tangent.h"
#include "operators/mechanics_direction.h"
#include "runtime/errors.h"

namespace pycraft {

const std::vector<SymbolDefinition>& derivative_symbols() {
  using S = SpaceKind;
  using enum Pattern;
  using enum SymbolId;
  static const std::vector<SymbolDefinition> table = {
      {inertia_derivative, "dM", "∂M", "\\partial M", "derivative of M by mass properties of one body", S::V, S::F, block_diagonal, {.symmetric = true, .takes = Takes::inertia}},
      {coordinate_selection, "Pi", "Π", "\\Pi", "some coordinates: ones on the diagonal", S::Theta, S::Theta, block_diagonal, {.symmetric = true, .takes = Takes::selection}},
      {direction_twist, "h", "h", "h", "the twist of a direction, in the axes of its body", S::Euclidean, S::V, vector, {.takes = Takes::place}},
      {motion_cross, "crm", "crm", "\\operatorname{crm}", "motion cross product with a vector", S::V, S::V, function},
      {force_cross, "crf", "crf", "\\operatorname{crf}", "force cross product with a vector", S::F, S::F, function},
      {momentum_cross_of, "mcross", "mcross", "\\operatorname{mcross}", "-[[ñ, f̃], [f̃, 0]] of a vector (n; f)", S::V, S::F, function},
      {inverse_tangent, "dMM_inv", "∂(ℳ+J)⁻¹", "\\partial(\\mathcal{M}+J)^{-1}", "derivative of the inverse mass matrix", S::Theta, S::Theta, compound,
       {.symmetric = true, .groups = Group::kinematics | Group::articulated, .takes = Takes::direction, .expand = expand_inverse_tangent, .tangent_of_inverse = true}},
  };
  return table;
}

using namespace directions;

namespace {

// Moves along fixed twists: a coordinate, or what a placement or an axis is perturbed by.
class TwistDirection : public MechanicsDirection {
 public:
  TwistDirection(std::shared_ptr<MultibodyOperators> source, Twists twists)
      : MechanicsDirection(std::move(source)), twists_(std::move(twists)) {}

  Expression frame_motion(const Symbol& like) const override {
    const MechanicsLetters l = letters(like);
    std::vector<Expression> terms = {zero(Space::euclidean(1), l.o.M.domain())};
    for (const auto& [c, direction] : twists_) terms.push_back(times({c * l.own_phi().T(), l.twist(direction)}));
    return l.crf(plus(terms));
  }

 protected:
  std::optional<OfDirection> moving() const override { return OfDirection{false, twists_}; }
  Expression body_edge_factor(const MechanicsLetters& l) const override {
    std::vector<Expression> terms = {zero(l.o.M.codomain(), l.o.M.codomain())};
    for (const auto& [c, direction] : twists_)
      if (source_->structure().parent[place_of(*source_, direction).body] >= 0) terms.push_back(c * l.delta(direction));
    return plus(terms);
  }
  Expression root_motion(const MechanicsLetters& l) const override {
    std::vector<Expression> terms = {zero(l.o.M.codomain(), l.o.M.codomain())};
    for (const auto& [c, direction] : twists_)
      if (source_->structure().parent[place_of(*source_, direction).body] < 0) terms.push_back(c * l.delta(direction));
    return plus(terms);
  }
  Expression tangent_of_block(const MechanicsLetters& l, SymbolId id) const override {
    if (id != SymbolId::H) return id == SymbolId::M ? zero(l.o.M.domain(), l.o.M.codomain()) : zero(l.o.J.domain(), l.o.J.codomain());
    std::vector<Expression> terms = {zero(l.o.H.domain(), l.o.H.codomain())};
    for (const auto& [c, direction] : twists_) {
      const Place at = place_of(*source_, direction);
      const int before = static_cast<int>(std::ceil(at.slot));  // subhinges inboard of it
      if (before > 0) terms.push_back(times({c * l.selection(OfSubhinges{at.body, 0, before}), l.own_H(), l.delta(direction)}));
    }
    return plus(terms);
  }
  Expression outboard_motion(const MechanicsLetters& l, const TwistPlace& direction) const override {
    const Place own = place_of(*source_, direction);
    std::vector<Expression> terms = {zero(l.o.M.codomain(), l.o.M.codomain())};
    for (const auto& [c, other] : twists_) {
      const Place at = place_of(*source_, other);
      if (at.body == own.body && own.slot < at.slot) terms.push_back(c * l.delta(other));
    }
    return plus(terms);
  }

 private:
  Twists twists_;
};

class TimeDirection final : public MechanicsDirection {
 public:
  TimeDirection(std::shared_ptr<MultibodyOperators> source, Expression vdot, std::shared_ptr<EmbeddedOperators> embedded)
      : MechanicsDirection(std::move(source)), vdot_(std::move(vdot)), embedded_(std::move(embedded)) {}
  Expression frame_motion(const Symbol& like) const override { return letters(like).letter(V_bar); }

 protected:
  std::optional<OfDirection> moving() const override { return OfDirection{true, {}}; }
  Expression body_edge_factor(const MechanicsLetters& l) const override {
    bool any = false;
    for (int p : source_->structure().parent) any |= p >= 0;
    return any ? l.letter(Delta_theta_dot) : zero(l.o.M.codomain(), l.o.M.codomain());
  }
  Expression root_motion(const MechanicsLetters& l) const override { return l.letter(Delta_theta_dot); }
  Expression tangent_of_block(const MechanicsLetters& l, SymbolId id) const override {
    if (id == SymbolId::H) return most_subhinges(*source_) > 1 ? (l.grouped ? own_H_dot(l) : l.letter(H_dot)) : zero(l.o.H.domain(), l.o.H.codomain());
    return id == SymbolId::M ? zero(l.o.M.domain(), l.o.M.codomain()) : zero(l.o.J.domain(), l.o.J.codomain());
  }
  Expression outboard_motion(const MechanicsLetters& l, const TwistPlace& direction) const override {
    const Place own = place_of(*source_, direction);
    const int from = static_cast<int>(std::floor(own.slot)) + 1, count = static_cast<int>(source_->model()->body(own.body).hinge.subhinges.size());
    if (from >= count) return zero(l.o.M.codomain(), l.o.M.codomain());
    return l.crf(times({l.own_H().T(), l.selection(OfSubhinges{own.body, from, count}), l.letter(theta_dot)}));
  }
  // θ̈, of embedded loops X θ̈_r + Ẋ θ̇_r
  Expression velocity_tangent(const MechanicsLetters& l, const Expression&) const override {
    if (!embedded_) return accelerations();
    const auto own = [&](SymbolId id) { return l.bound(make_symbol(definition_of(id), embedded_)); };
    return plus({times({own(coordinate_map), accelerations()}), times({own(coordinate_map_rate), own(theta_dot)})});
  }
  Expression map_tangent(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters& l) const override {
    return l.bound(make_symbol(definition_of(coordinate_map_rate), embedded));
  }
  Expression independent_rates(const std::shared_ptr<EmbeddedOperators>&, const MechanicsLetters&) const override { return accelerations(); }
  // Along v twice, and ∂X along the accelerations.
  Expression second_map_tangent(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters& l, const Expression& e) const override {
    std::vector<Expression> terms = {second_map(embedded, l, e, {{1.0, along_time}}, "time")};
    if (e.node().symbol.definition->id != coordinate_map_rate || is_zero(accelerations())) return terms[0];
    if (accelerations().kind() != NodeKind::constant)
      throw EvaluationError("the second time derivative of X_r takes accelerations that are numbers: .dot(vdot=array), not " + show(accelerations()));
    const std::vector<double>& given = accelerations().node().constant->dense;
    for (size_t i = 0; i < given.size(); ++i)
      if (given[i] != 0)
        terms.push_back(given[i] * l.bound(make_symbol(definition_of(coordinate_map_tangent), embedded, OfCoordinate{int(i)}, embedded->structure().coordinate_names[i])));
    return plus(terms);
  }

 private:
  const Expression& accelerations() const {
    if (!vdot_) throw EvaluationError("the time derivative of what depends on v needs the accelerations: .dot(vdot=...)");
    return vdot_;
  }
  Expression vdot_;
  std::shared_ptr<EmbeddedOperators> embedded_;
};

// Mass properties and rotor inertias: nothing moves but M or J.
class InertiaDirection final : public MechanicsDirection {
 public:
  InertiaDirection(std::shared_ptr<MultibodyOperators> source, int body, InertiaParameter parameter, int rotor)
      : MechanicsDirection(std::move(source)), body_(body), parameter_(parameter), rotor_(rotor) {}
  Expression frame_motion(const Symbol& like) const override { return nothing(letters(like)); }

 protected:
  std::optional<OfDirection> moving() const override { return std::nullopt; }
  Expression body_edge_factor(const MechanicsLetters& l) const override { return nothing(l); }
  Expression root_motion(const MechanicsLetters& l) const override { return nothing(l); }
  Expression outboard_motion(const MechanicsLetters& l, const TwistPlace&) const override { return nothing(l); }
  Expression map_tangent(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters&) const override {
    return zero(embedded->theta(), embedded->grouped()->theta());
  }
  Expression tangent_of_block(const MechanicsLetters& l, SymbolId id) const override {
    if (id == SymbolId::M && rotor_ < 0) return derivative(l, OfInertia{body_, {parameter_}});
    if (id == SymbolId::J && rotor_ >= 0) return l.selection(OfCoordinate{rotor_});
    const Expression letter = id == SymbolId::H ? l.o.H : id == SymbolId::M ? l.o.M : l.o.J;
    return zero(letter.domain(), letter.codomain());
  }
  Expression inertia_tangent(const MechanicsLetters& l, const Symbol& s) const override {
    OfInertia of = std::get<OfInertia>(s.arguments);
    if (rotor_ >= 0 || of.body != body_) return zero(l.o.M.domain(), l.o.M.codomain());
    of.parameters.push_back(parameter_);
    std::sort(of.parameters.begin(), of.parameters.end());
    return derivative(l, of);
  }

 private:
  static Expression nothing(const MechanicsLetters& l) { return zero(l.o.M.codomain(), l.o.M.codomain()); }
  Expression derivative(const MechanicsLetters& l, const OfInertia& of) const {
    static const char* names[] = {"mass", "com_x", "com_y", "com_z", "I_xx", "I_xy", "I_xz", "I_yy", "I_yz", "I_zz"};
    int masses = 0, coms = 0, entries = 0;
    std::string text = source_->structure().body_names[of.body];
    for (const InertiaParameter& p : of.parameters) {
      (p == InertiaParameter::mass ? masses : p <= InertiaParameter::com_z ? coms : entries) += 1;
      text += std::string(&p == &of.parameters[0] ? "." : ",") + names[static_cast<int>(p)];
    }
    // M is linear in the mass and the inertia about the centre of mass, and quadratic in the centre of mass.
    if (masses > 1 || coms > 2 || entries > 1 || (entries && masses + coms)) return zero(l.o.M.domain(), l.o.M.codomain());
    return l.bound(make_symbol(definition_of(SymbolId::inertia_derivative), l.source, of, text));
  }
  int body_;
  InertiaParameter parameter_;
  int rotor_;
};

}  // namespace

std::unique_ptr<Direction> twist_direction(const std::shared_ptr<MultibodyOperators>& source, Twists twists) {
  return std::make_unique<TwistDirection>(source, std::move(twists));
}

int coordinates_before(const MultibodyOperators& source, const TwistPlace& twist) {
  const Place at = place_of(source, twist);
  int count = 0, subhinge = 0;
  for (const Subhinge& h : source.model()->body(at.body).hinge.subhinges) {
    if (subhinge++ < at.slot) count += h.nv();
  }
  return count;
}

std::unique_ptr<Direction> coordinate_direction(const std::shared_ptr<MultibodyOperators>& source, int coordinate) {
  if (coordinate < 0 || coordinate >= source->nv())
    throw ModelError("coordinate " + std::to_string(coordinate) + " of '" + source->name() + "', which has " + std::to_string(source->nv()));
  return twist_direction(source, {{1.0, OfCoordinate{coordinate}}});
}

std::unique_ptr<Direction> time_direction(const std::shared_ptr<MultibodyOperators>& source, const Expression& vdot, const std::shared_ptr<EmbeddedOperators>& embedded) {
  const Space theta = embedded ? embedded->theta() : source->theta();
  if (vdot && !(vdot.codomain() == theta && vdot.domain() == Space::euclidean(1)))
    throw SpaceError("vdot: the accelerations are a vector of " + theta.description() + ", not " + show(vdot));
  return std::make_unique<TimeDirection>(source, vdot, embedded);
}

Twists twists_of(const Parameter& p) {
  Twists twists;
  for (const InsertedTwist& t : p.twists)
    for (int c = 0; c < 6; ++c)
      if (t.twist[c] != 0) twists.emplace_back(t.twist[c], OfTwist{t.body, t.position, c});
  return twists;
}

std::unique_ptr<Direction> parameter_direction(const Parameter& p) {
  p.source->check_current();
  if (p.twists.empty()) return std::make_unique<InertiaDirection>(p.source, p.inertia_body, p.inertia, p.rotor);
  return twist_direction(p.source, twists_of(p));
}

}  // namespace pycraft
