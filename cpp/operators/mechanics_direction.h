// What directions are made of: the letters of a model at one binding, and what becomes of the leaves in any direction that moves its hinges
// (directions.h).
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/theorems/differentiate.h"
#include "operators/alphabet.h"
#include "operators/directions.h"
#include "operators/embedded_operators.h"
#include "operators/grouped_operators.h"
#include "operators/loop_operators.h"
#include "runtime/errors.h"

namespace pycraft {

namespace directions {

using enum SymbolId;

inline bool is_zero(const Expression& e) { return e.kind() == NodeKind::zero; }
inline Expression times(const std::vector<Expression>& f) { return lowered_product(f, f.back().domain(), f.front().codomain()); }
inline Expression plus(const std::vector<Expression>& t) { return lowered_sum(t, t[0].domain(), t[0].codomain()); }

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

inline int body_of_coordinate(const SkoStructure& tree, int i) {
  int k = 0;
  while (tree.dof_offset[k + 1] <= i) ++k;
  return k;
}
inline int subhinge_of_coordinate(const MultibodyOperators& source, int k, int i) {
  int at = source.structure().dof_offset[k], s = 0;
  for (const Subhinge& h : source.model()->body(k).hinge.subhinges) {
    at += h.nv();
    if (i < at) return s;
    ++s;
  }
  return s;
}
inline int most_subhinges(const MultibodyOperators& source) {
  int most = 0;
  for (int k = 0; k < source.model()->bodies(); ++k) most = std::max(most, static_cast<int>(source.model()->body(k).hinge.subhinges.size()));
  return most;
}

// Where in its hinge a direction stands: after all subhinges before `slot`, and whether it comes before one at `other`.
struct Place {
  int body;
  double slot;  // coordinates of subhinge s: s; a twist before subhinge p: p - 1/2
};
inline Place place_of(const MultibodyOperators& source, const TwistPlace& at) {
  if (const auto* of = std::get_if<OfTwist>(&at)) return {of->body, of->position - 0.5};
  const int coordinate = std::get<OfCoordinate>(at).coordinate, k = body_of_coordinate(source.structure(), coordinate);
  return {k, static_cast<double>(subhinge_of_coordinate(source, k, coordinate))};
}

// Ḣ of the robot's bodies, one by one.
inline Expression own_H_dot(const MechanicsLetters& l) {
  std::vector<Expression> terms = {zero(l.o.H.domain(), l.o.H.codomain())};
  for (int p = 1; p < most_subhinges(*l.robot); ++p)
    terms.push_back(times({l.selection(OfSubhinges{-1, 0, p}), l.own_H(), l.crf(times({l.own_H().T(), l.selection(OfSubhinges{-1, p, p + 1}), l.letter(theta_dot)}))}));
  return plus(terms);
}

// ∂ of a letter of ∂X or Ẋ of embedded loops: along an independent coordinate, time (coordinate -1), or twists in hinges. EvaluationError of what
// is along twists, or a second derivative already.
inline Expression second_map(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters& l, const Expression& e, const Twists& second, const std::string& text) {
  const Symbol& s = e.node().symbol;
  const auto* const along = std::get_if<OfCoordinate>(&s.arguments);
  if (s.definition->id != coordinate_map_rate && (s.definition->id != coordinate_map_tangent || !along))
    throw EvaluationError("'" + s.definition->ascii + "' of '" + embedded->name() + "' has no derivative: the map of coordinates is differentiated twice, and by parameters last");
  const TwistPlace first = along ? *along : along_time;
  Twists both = {{1.0, first}};
  both.insert(both.end(), second.begin(), second.end());
  const SymbolId id = is_time(first) || is_time(second[0].second) ? embedding_letters::second_map_rate : embedding_letters::second_map_tangent;
  return l.bound(make_symbol(definition_of(id), embedded, OfDirection{false, both}, (along ? s.argument_text : "time") + ", " + text));
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
    const SymbolId id = s.definition->id;
    if (const auto embedded = std::dynamic_pointer_cast<EmbeddedOperators>(s.source); embedded && id != SymbolId::M) {
      const MechanicsLetters l = letters(s);
      const Symbol of_group{s.definition, embedded->grouped(), s.binding, {}, {}};
      const Expression X = l.bound(make_symbol(definition_of(coordinate_map), embedded)), dX = map_tangent(embedded, l);
      if (id == SymbolId::H) return plus({times({X.T(), block_tangent(of_group)}), times({dX.T(), l.o.H})});
      const Expression one_side = times({X.T(), l.o.J, dX});
      return plus({times({X.T(), block_tangent(of_group), X}), one_side, one_side.T()});
    }
    const MechanicsLetters l = letters(s);
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
    if (const auto embedded = std::dynamic_pointer_cast<EmbeddedOperators>(e.node().symbol.source)) {
      const auto own = [&](SymbolId id) { return l.bound(make_symbol(definition_of(id), embedded)); };
      switch (e.node().symbol.definition->id) {
        case coordinate_map: return map_tangent(embedded, l);
        case theta_dot: return independent_rates(embedded, l);
        case coriolis_acceleration:  // a_g + H_g* Ẋ θ̇_r
          return rules(plus({l.letter(coriolis_acceleration), times({l.o.H.T(), own(coordinate_map_rate), own(theta_dot)})}));
        default: return second_map_tangent(embedded, l, e);
      }
    }
    if (e.kind() == NodeKind::block_function)
      return l.function(e.node().symbol.definition->id, rules(e.children()[0]));
    const Symbol& s = e.node().symbol;
    if (const auto loops = std::dynamic_pointer_cast<LoopOperators>(s.source)) return loops->tangent(e, moving(), [&] { return velocity_tangent(l, l.letter(theta_dot)); });
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

  // Of the model's own letters.
  virtual Expression body_edge_factor(const MechanicsLetters& l) const = 0;
  virtual Expression tangent_of_block(const MechanicsLetters& l, SymbolId id) const = 0;
  // ∂Δ_a = Δ_a W - W Δ_a and ∂h_a = W* h_a, W what moves outboard of a in its hinge.
  virtual Expression outboard_motion(const MechanicsLetters& l, const TwistPlace& direction) const = 0;
  // crf of what moves a body relative to its parent, roots included.
  virtual Expression root_motion(const MechanicsLetters& l) const = 0;

 protected:
  virtual std::optional<OfDirection> moving() const = 0;  // nothing where inertias change alone
  virtual Expression velocity_tangent(const MechanicsLetters&, const Expression& e) const { return zero(e.domain(), e.codomain()); }
  virtual Expression inertia_tangent(const MechanicsLetters&, const Symbol& s) const { return zero(s.source->motions(), s.source->forces()); }
  // ∂X of embedded loops; ∂θ̇_r; ∂ of ∂X and Ẋ.
  virtual Expression map_tangent(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters&) const {
    throw EvaluationError("'" + embedded->name() + "' has derivatives along its independent coordinates, along time and by parameters: not along what moves the tree off its loops");
  }
  virtual Expression independent_rates(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters&) const {
    return zero(Space::euclidean(1), embedded->theta());
  }
  virtual Expression second_map_tangent(const std::shared_ptr<EmbeddedOperators>&, const MechanicsLetters&, const Expression& e) const { return zero(e.domain(), e.codomain()); }

  MechanicsLetters letters(const Symbol& s) const {
    if (const auto embedded = std::dynamic_pointer_cast<EmbeddedOperators>(s.source); embedded && embedded->base() == source_) return {embedded->grouped(), source_, s.binding};
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

}  // namespace directions

}  // namespace pycraft
