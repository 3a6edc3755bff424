#include "operators/directions.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/theorems/theorems.h"
#include "operators/alphabet.h"
#include "operators/grouped_operators.h"
#include "operators/inverse_tangent.h"
#include "operators/loop_operators.h"
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

namespace {

using enum SymbolId;

bool is_zero(const Expression& e) { return e.kind() == NodeKind::zero; }
Expression times(const std::vector<Expression>& f) { return lowered_product(f, f.back().domain(), f.front().codomain()); }
Expression plus(const std::vector<Expression>& t) { return lowered_sum(t, t[0].domain(), t[0].codomain()); }

// The letters of a model at one binding: a robot's own, or those of its bodies in groups.
struct MechanicsLetters {
  std::shared_ptr<SkoSource> source;
  std::shared_ptr<MultibodyOperators> robot;
  std::shared_ptr<const Binding> binding;
  bool grouped;
  Letters o;
  MechanicsLetters(std::shared_ptr<SkoSource> s, std::shared_ptr<MultibodyOperators> r, const std::shared_ptr<const Binding>& b)
      : source(s), robot(std::move(r)), binding(b), grouped(source != robot), o(s, b) {}

  // Of the robot's bodies, one by one: H, φ; and φ_S, which they are carried by within a group.
  Expression own_H() const { return grouped ? bound(make_symbol(definition_of(SymbolId::inner_H), source)) : o.H; }
  Expression own_phi() const { return grouped ? times({inner(), o.phi}) : o.phi; }
  Expression inner() const { return grouped ? bound(make_symbol(definition_of(SymbolId::inner_phi), source)) : identity(o.M.codomain()); }

  Expression bound(const Expression& e) const { return binding ? e.at(binding) : e; }
  Expression letter(SymbolId id) const { return bound(make_symbol(definition_of(id), source)); }
  Expression delta(const TwistPlace& at) const { return bound(make_symbol(definition_of(SymbolId::Delta), source, as_arguments(at), text(at))); }
  Expression twist(const TwistPlace& at) const { return bound(make_symbol(definition_of(SymbolId::direction_twist), source, as_arguments(at), text(at))); }
  Expression selection(const OfSubhinges& of) const {
    const std::string range = std::to_string(of.from) + ":" + (of.to > 5 ? std::string() : std::to_string(of.to));
    return selected(of, of.body < 0 ? range : robot->structure().hinge_names[of.body] + "[" + range + "]");
  }
  Expression selection(const OfCoordinate& of) const { return selected(of, robot->structure().coordinate_names[of.coordinate]); }
  Expression selected(SymbolArguments which, std::string shown) const {
    return bound(make_symbol(definition_of(SymbolId::coordinate_selection), source, std::move(which), std::move(shown)));
  }
  Expression crm(const Expression& x) const { return function(SymbolId::motion_cross, x); }
  Expression crf(const Expression& x) const { return function(SymbolId::force_cross, x); }
  Expression function(SymbolId id, const Expression& x) const {
    const SymbolDefinition& d = definition_of(id);
    return is_zero(x) ? zero(source->space(d.domain, {}), source->space(d.codomain, {})) : block_function(d, source, binding, x);
  }

  std::string text(const TwistPlace& at) const {
    if (const auto* of = std::get_if<OfCoordinate>(&at)) return robot->structure().coordinate_names[of->coordinate];
    static const char* components[] = {"rx", "ry", "rz", "x", "y", "z"};
    const OfTwist& of = std::get<OfTwist>(at);
    return robot->structure().hinge_names[of.body] + "@" + std::to_string(of.position) + "." + components[of.component];
  }
};

int body_of_coordinate(const SkoStructure& tree, int i) {
  int k = 0;
  while (tree.dof_offset[k + 1] <= i) ++k;
  return k;
}
int subhinge_of_coordinate(const MultibodyOperators& source, int k, int i) {
  int at = source.structure().dof_offset[k], s = 0;
  for (const Subhinge& h : source.model()->body(k).hinge.subhinges) {
    at += h.nv();
    if (i < at) return s;
    ++s;
  }
  return s;
}
int most_subhinges(const MultibodyOperators& source) {
  int most = 0;
  for (int k = 0; k < source.model()->bodies(); ++k) most = std::max(most, static_cast<int>(source.model()->body(k).hinge.subhinges.size()));
  return most;
}

// Where in its hinge a direction stands: after all subhinges before `slot`, and whether it comes before one at `other`.
struct Place {
  int body;
  double slot;  // coordinates of subhinge s: s; a twist before subhinge p: p - 1/2
};
Place place_of(const MultibodyOperators& source, const TwistPlace& at) {
  if (const auto* of = std::get_if<OfTwist>(&at)) return {of->body, of->position - 0.5};
  const int coordinate = std::get<OfCoordinate>(at).coordinate, k = body_of_coordinate(source.structure(), coordinate);
  return {k, static_cast<double>(subhinge_of_coordinate(source, k, coordinate))};
}

// Ḣ of the robot's bodies, one by one.
Expression own_H_dot(const MechanicsLetters& l) {
  std::vector<Expression> terms = {zero(l.o.H.domain(), l.o.H.codomain())};
  for (int p = 1; p < most_subhinges(*l.robot); ++p)
    terms.push_back(times({l.selection(OfSubhinges{-1, 0, p}), l.own_H(), l.crf(times({l.own_H().T(), l.selection(OfSubhinges{-1, p, p + 1}), l.letter(theta_dot)}))}));
  return plus(terms);
}

// What is common: symbols that are functions of others.
class MechanicsDirection : public Direction {
 public:
  explicit MechanicsDirection(std::shared_ptr<MultibodyOperators> source) : source_(std::move(source)) {}

  Expression edge_factor(const Symbol& s) const override {
    const MechanicsLetters l = letters(s);
    if (is_world(s)) return zero(s.source->forces(), s.source->forces());  // parent matrix ⊗ 1
    return l.grouped ? times({body_edge_factor(l), l.inner()}) : body_edge_factor(l);
  }

  Expression block_tangent(const Symbol& s) const override {
    const MechanicsLetters l = letters(s);
    const SymbolId id = s.definition->id;
    if (s.source == source_) return tangent_of_block(l, id);
    if (l.grouped) {  // H = H_S φ_S, ∂φ_S = (φ_S - I) Δ φ_S
      if (id != SymbolId::H) return tangent_of_block(l, id);
      const Expression turned = times({body_edge_factor(l), l.inner()});
      return plus({times({tangent_of_block(l, id), l.inner()}), times({l.o.H, turned}), times({-1.0 * l.own_H(), turned})});
    }
    const Letters own(s.source, s.binding);
    if (is_world(s)) {  // H' = HX⁻¹, M' = XMX*, X moves by X W
      const Expression X = l.letter(X_world), W = times({X, frame_motion(s), X.inv()});
      if (id == SymbolId::H) return plus({times({tangent_of_block(l, id), X.inv()}), times({-1.0 * own.H, W})});
      if (id == SymbolId::M) return plus({times({X, tangent_of_block(l, id), X.T()}), times({W, own.M}), times({own.M, W.T()})});
      return tangent_of_block(l, id);
    }
    const Expression whole = tangent_of_block(l, id);
    if (id == SymbolId::M) return whole;
    if (!is_zero(whole)) throw EvaluationError("operators of some hinges have no derivative here: their hinge map moves within a hinge of several subhinges");
    const Expression letter = id == SymbolId::H ? own.H : own.J;
    return zero(letter.domain(), letter.codomain());
  }

  Expression tangent(const Expression& e, Differentiator& rules) const override {
    const MechanicsLetters l = letters(e.node().symbol);
    if (e.kind() == NodeKind::block_function)
      return l.function(e.node().symbol.definition->id, rules(e.children()[0]));
    const Symbol& s = e.node().symbol;
    if (const auto loops = std::dynamic_pointer_cast<LoopOperators>(s.source)) return loops->tangent(e, moving());
    const Expression theta = l.letter(theta_dot), relative = times({l.own_H().T(), theta}), V = times({l.o.phi.T(), l.o.H.T(), theta});
    switch (s.definition->id) {
      case Delta: return moved(l, l.delta(place_in(s.arguments)), place_in(s.arguments));
      case direction_twist: return moved_twist(l, l.twist(place_in(s.arguments)), place_in(s.arguments));
      case Delta_theta_dot: return l.crf(rules(relative));
      case V_tilde: return l.crm(rules(V));
      case V_bar: return l.crf(rules(V));
      case momentum_cross: return l.function(momentum_cross_of, rules(times({l.o.M, V})));
      case SymbolId::X_world: return times({l.letter(X_world), frame_motion(s)});
      case H_dot: {
        if (!l.grouped) return rules(own_H_dot(l));
        const Expression turned = times({l.letter(Delta_theta_dot), l.inner()});
        return rules(plus({times({own_H_dot(l), l.inner()}), times({l.o.H, turned}), times({-1.0 * l.own_H(), turned})}));
      }
      case inner_phi: {
        const Expression turned = times({body_edge_factor(l), l.inner()});
        return plus({times({l.inner(), turned}), times({-1.0 * identity(turned.codomain()), turned})});
      }
      case inner_H: return tangent_of_block(l, SymbolId::H);
      case theta_dot: return velocity_tangent(l, e);
      case velocity: return rules(V);
      case coriolis_acceleration: {
        const Expression own = plus({times({l.letter(V_tilde), relative}), times({l.grouped ? own_H_dot(l).T() : l.letter(H_dot).T(), theta})});
        return rules(l.grouped ? times({l.inner().T(), own}) : own);
      }
      case gyroscopic_force: return rules(times({l.letter(V_bar), l.o.M, V}));
      case gravity_field: return times({frame_motion(s).T(), e});
      case gravity_base: {
        if (!l.grouped) return times({root_motion(l).T(), e});
        const Expression of_roots = times({l.inner().inv().T(), e});  // a₀ = φ_S* of it
        return plus({times({rules(l.inner()).T(), of_roots}), times({l.inner().T(), root_motion(l).T(), of_roots})});
      }
      case inertia_derivative: return inertia_tangent(l, s);
      default: return zero(e.domain(), e.codomain());  // B, Π
    }
  }

 protected:
  virtual std::optional<OfDirection> moving() const = 0;  // nothing where inertias change alone
  // Of the model's own letters.
  virtual Expression body_edge_factor(const MechanicsLetters& l) const = 0;
  virtual Expression tangent_of_block(const MechanicsLetters& l, SymbolId id) const = 0;
  // ∂Δ_a = Δ_a W - W Δ_a and ∂h_a = W* h_a, W what moves outboard of a in its hinge.
  virtual Expression outboard_motion(const MechanicsLetters& l, const TwistPlace& direction) const = 0;
  virtual Expression velocity_tangent(const MechanicsLetters&, const Expression& e) const { return zero(e.domain(), e.codomain()); }
  virtual Expression inertia_tangent(const MechanicsLetters&, const Symbol& s) const { return zero(s.source->motions(), s.source->forces()); }
  // crf of what moves a body relative to its parent, roots included.
  virtual Expression root_motion(const MechanicsLetters& l) const = 0;

  MechanicsLetters letters(const Symbol& s) const {
    if (mechanics_of(s.source) == source_) return {std::dynamic_pointer_cast<GroupedOperators>(s.source) ? s.source : source_, source_, s.binding};
    throw EvaluationError("'" + s.source->name() + "' is not the model that this derivative is taken of" +
                          (s.source->name() == source_->name() ? ": another of that name is" : ", '" + source_->name() + "'"));
  }
  static bool is_world(const Symbol& s) { return std::dynamic_pointer_cast<WorldFrame>(s.source) != nullptr; }

  std::shared_ptr<MultibodyOperators> source_;

 private:
  Expression moved(const MechanicsLetters& l, const Expression& delta, const TwistPlace& direction) const {
    const Expression W = outboard_motion(l, direction);
    return plus({times({delta, W}), times({-1.0 * identity(W.codomain()), W, delta})});
  }
  Expression moved_twist(const MechanicsLetters& l, const Expression& twist, const TwistPlace& direction) const {
    const Expression W = outboard_motion(l, direction);
    return is_zero(W) ? zero(twist.domain(), twist.codomain()) : times({W.T(), twist});
  }
};

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
  TimeDirection(std::shared_ptr<MultibodyOperators> source, Expression vdot) : MechanicsDirection(std::move(source)), vdot_(std::move(vdot)) {}
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
  Expression velocity_tangent(const MechanicsLetters&, const Expression&) const override {
    if (!vdot_) throw EvaluationError("the time derivative of what depends on v needs the accelerations: .dot(vdot=...)");
    return vdot_;
  }

 private:
  Expression vdot_;
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

std::unique_ptr<Direction> time_direction(const std::shared_ptr<MultibodyOperators>& source, const Expression& vdot) {
  if (vdot && !(vdot.codomain() == source->theta() && vdot.domain() == Space::euclidean(1)))
    throw SpaceError("vdot: the accelerations are a vector of " + source->theta().description() + ", not " + show(vdot));
  return std::make_unique<TimeDirection>(source, vdot);
}

std::unique_ptr<Direction> parameter_direction(const Parameter& p) {
  p.source->check_current();
  if (p.twists.empty()) return std::make_unique<InertiaDirection>(p.source, p.inertia_body, p.inertia, p.rotor);
  Twists twists;
  for (const InsertedTwist& t : p.twists)
    for (int c = 0; c < 6; ++c)
      if (t.twist[c] != 0) twists.emplace_back(t.twist[c], OfTwist{t.body, t.position, c});
  return twist_direction(p.source, std::move(twists));
}

}  // namespace pycraft
