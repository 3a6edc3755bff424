#include "operators/directions.h"

#include <algorithm>
#include <cmath>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/theorems/theorems.h"
#include "operators/grouped_operators.h"
#include "runtime/errors.h"

namespace pycraft {

const std::vector<SymbolDefinition>& derivative_symbols() {
  using S = SpaceKind;
  using enum Pattern;
  static const std::vector<SymbolDefinition> table = {
      {inertia_derivative, "dM", "∂M", "\\partial M", "derivative of M by mass properties of one body", S::V, S::F, block_diagonal, true},
      {coordinate_selection, "Pi", "Π", "\\Pi", "some coordinates: ones on the diagonal", S::Theta, S::Theta, block_diagonal, true},
      {direction_twist, "h", "h", "h", "the twist of a direction, in the axes of its body", S::Euclidean, S::V, vector},
      {motion_cross, "crm", "crm", "\\operatorname{crm}", "motion cross product with a vector", S::V, S::V, function},
      {force_cross, "crf", "crf", "\\operatorname{crf}", "force cross product with a vector", S::F, S::F, function},
      {momentum_cross_of, "mcross", "mcross", "\\operatorname{mcross}", "-[[ñ, f̃], [f̃, 0]] of a vector (n; f)", S::V, S::F, function},
  };
  return table;
}

namespace {

const SymbolDefinition& definition(DerivativeSymbolId id) { return derivative_symbols()[id - first_derivative_symbol]; }
const SymbolDefinition& definition(MechanicsSymbolId id) { return mechanics_symbols()[static_cast<int>(id) - static_cast<int>(first_extra)]; }

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
  Expression own_H() const { return grouped ? bound(make_symbol(grouped_symbols()[1], source)) : o.H; }
  Expression own_phi() const { return grouped ? times({inner(), o.phi}) : o.phi; }
  Expression inner() const { return grouped ? bound(make_symbol(grouped_symbols()[0], source)) : identity(o.M.codomain()); }

  Expression bound(const Expression& e) const { return binding ? e.at(binding) : e; }
  Expression letter(MechanicsSymbolId id) const { return bound(make_symbol(definition(id), source)); }
  Expression delta(const std::vector<int>& direction) const { return bound(make_symbol(definition(Delta), source, direction, text(direction))); }
  Expression twist(const std::vector<int>& direction) const { return bound(make_symbol(definition(direction_twist), source, direction, text(direction))); }
  Expression selection(const std::vector<int>& which) const { return bound(make_symbol(definition(coordinate_selection), source, which, selection_text(which))); }
  Expression crm(const Expression& x) const { return function(motion_cross, x); }
  Expression crf(const Expression& x) const { return function(force_cross, x); }
  Expression function(DerivativeSymbolId id, const Expression& x) const {
    const SymbolDefinition& d = definition(id);
    return is_zero(x) ? zero(source->space(d.domain, {}), source->space(d.codomain, {})) : block_function(d, source, binding, x);
  }

  std::string text(const std::vector<int>& direction) const {
    if (direction.size() == 1) return robot->structure().coordinate_names[direction[0]];
    static const char* components[] = {"rx", "ry", "rz", "x", "y", "z"};
    return robot->structure().hinge_names[direction[0]] + "@" + std::to_string(direction[1]) + "." + components[direction[2]];
  }
  std::string selection_text(const std::vector<int>& which) const {
    if (which.size() == 1) return robot->structure().coordinate_names[which[0]];
    const std::string range = std::to_string(which[1]) + ":" + (which[2] > 5 ? std::string() : std::to_string(which[2]));
    return which[0] < 0 ? range : robot->structure().hinge_names[which[0]] + "[" + range + "]";
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
Place place_of(const MultibodyOperators& source, const std::vector<int>& direction) {
  if (direction.size() == 3) return {direction[0], direction[1] - 0.5};
  const int k = body_of_coordinate(source.structure(), direction[0]);
  return {k, static_cast<double>(subhinge_of_coordinate(source, k, direction[0]))};
}

// Ḣ of the robot's bodies, one by one.
Expression own_H_dot(const MechanicsLetters& l) {
  std::vector<Expression> terms = {zero(l.o.H.domain(), l.o.H.codomain())};
  for (int p = 1; p < most_subhinges(*l.robot); ++p)
    terms.push_back(times({l.selection({-1, 0, p}), l.own_H(), l.crf(times({l.own_H().T(), l.selection({-1, p, p + 1}), l.letter(theta_dot)}))}));
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
    const SymbolId id = static_cast<SymbolId>(s.definition->id);
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
      return l.function(static_cast<DerivativeSymbolId>(e.node().symbol.definition->id), rules(e.children()[0]));
    const Symbol& s = e.node().symbol;
    const Expression theta = l.letter(theta_dot), relative = times({l.own_H().T(), theta}), V = times({l.o.phi.T(), l.o.H.T(), theta});
    switch (s.definition->id) {
      case Delta: return moved(l, l.delta(s.arguments), s.arguments);
      case direction_twist: return moved_twist(l, l.twist(s.arguments), s.arguments);
      case Delta_theta_dot: return l.crf(rules(relative));
      case V_tilde: return l.crm(rules(V));
      case V_bar: return l.crf(rules(V));
      case momentum_cross: return l.function(momentum_cross_of, rules(times({l.o.M, V})));
      case MechanicsSymbolId::X_world: return times({l.letter(X_world), frame_motion(s)});
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
  // Of the model's own letters.
  virtual Expression body_edge_factor(const MechanicsLetters& l) const = 0;
  virtual Expression tangent_of_block(const MechanicsLetters& l, SymbolId id) const = 0;
  // ∂Δ_a = Δ_a W - W Δ_a and ∂h_a = W* h_a, W what moves outboard of a in its hinge.
  virtual Expression outboard_motion(const MechanicsLetters& l, const std::vector<int>& direction) const = 0;
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
  Expression moved(const MechanicsLetters& l, const Expression& delta, const std::vector<int>& direction) const {
    const Expression W = outboard_motion(l, direction);
    return plus({times({delta, W}), times({-1.0 * identity(W.codomain()), W, delta})});
  }
  Expression moved_twist(const MechanicsLetters& l, const Expression& twist, const std::vector<int>& direction) const {
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
      if (before > 0) terms.push_back(times({c * l.selection({at.body, 0, before}), l.own_H(), l.delta(direction)}));
    }
    return plus(terms);
  }
  Expression outboard_motion(const MechanicsLetters& l, const std::vector<int>& direction) const override {
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
  Expression outboard_motion(const MechanicsLetters& l, const std::vector<int>& direction) const override {
    const Place own = place_of(*source_, direction);
    const int from = static_cast<int>(std::floor(own.slot)) + 1, count = static_cast<int>(source_->model()->body(own.body).hinge.subhinges.size());
    if (from >= count) return zero(l.o.M.codomain(), l.o.M.codomain());
    return l.crf(times({l.own_H().T(), l.selection({own.body, from, count}), l.letter(theta_dot)}));
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
  InertiaDirection(std::shared_ptr<MultibodyOperators> source, int body, int parameter, int rotor)
      : MechanicsDirection(std::move(source)), body_(body), parameter_(parameter), rotor_(rotor) {}
  Expression frame_motion(const Symbol& like) const override { return nothing(letters(like)); }

 protected:
  Expression body_edge_factor(const MechanicsLetters& l) const override { return nothing(l); }
  Expression root_motion(const MechanicsLetters& l) const override { return nothing(l); }
  Expression outboard_motion(const MechanicsLetters& l, const std::vector<int>&) const override { return nothing(l); }
  Expression tangent_of_block(const MechanicsLetters& l, SymbolId id) const override {
    if (id == SymbolId::M && rotor_ < 0) return derivative(l, {body_, parameter_});
    if (id == SymbolId::J && rotor_ >= 0) return l.selection({rotor_});
    const Expression letter = id == SymbolId::H ? l.o.H : id == SymbolId::M ? l.o.M : l.o.J;
    return zero(letter.domain(), letter.codomain());
  }
  Expression inertia_tangent(const MechanicsLetters& l, const Symbol& s) const override {
    if (rotor_ >= 0 || s.arguments[0] != body_) return zero(l.o.M.domain(), l.o.M.codomain());
    std::vector<int> arguments = s.arguments;
    arguments.push_back(parameter_);
    std::sort(arguments.begin() + 1, arguments.end());
    return derivative(l, arguments);
  }

 private:
  static Expression nothing(const MechanicsLetters& l) { return zero(l.o.M.codomain(), l.o.M.codomain()); }
  Expression derivative(const MechanicsLetters& l, const std::vector<int>& arguments) const {
    static const char* names[] = {"mass", "com_x", "com_y", "com_z", "I_xx", "I_xy", "I_xz", "I_yy", "I_yz", "I_zz"};
    int masses = 0, coms = 0, entries = 0;
    std::string text = source_->structure().body_names[arguments[0]];
    for (size_t i = 1; i < arguments.size(); ++i) {
      (arguments[i] == mass_of_body ? masses : arguments[i] <= com_z ? coms : entries) += 1;
      text += std::string(i == 1 ? "." : ",") + names[arguments[i]];
    }
    // M is linear in the mass and the inertia about the centre of mass, and quadratic in the centre of mass.
    if (masses > 1 || coms > 2 || entries > 1 || (entries && masses + coms)) return zero(l.o.M.domain(), l.o.M.codomain());
    return l.bound(make_symbol(definition(inertia_derivative), l.source, arguments, text));
  }
  int body_, parameter_, rotor_;
};

}  // namespace

std::unique_ptr<Direction> twist_direction(const std::shared_ptr<MultibodyOperators>& source, Twists twists) {
  return std::make_unique<TwistDirection>(source, std::move(twists));
}

int coordinates_before(const MultibodyOperators& source, const std::vector<int>& twist) {
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
  return twist_direction(source, {{1.0, {coordinate}}});
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
      if (t.twist[c] != 0) twists.push_back({t.twist[c], {t.body, t.position, c}});
  return twist_direction(p.source, std::move(twists));
}

}  // namespace pycraft
