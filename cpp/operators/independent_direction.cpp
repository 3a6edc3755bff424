// Directions on embedded loops: an independent coordinate, and a parameter that dependent coordinates follow (directions.h).
#include <cmath>

#include "operators/mechanics_direction.h"

namespace pycraft {

using namespace directions;

namespace {

// Along velocities w of the tree.
class DirectionOnLoops : public MechanicsDirection {
 public:
  explicit DirectionOnLoops(const std::shared_ptr<EmbeddedOperators>& embedded) : MechanicsDirection(embedded->base()), embedded_(embedded) {}
  Expression frame_motion(const Symbol& like) const override {
    const MechanicsLetters l = letters(like);
    return l.crf(times({l.own_phi().T(), l.own_H().T(), along(l)}));
  }

 protected:
  virtual Expression along(const MechanicsLetters& l) const = 0;
  std::optional<OfDirection> moving() const override {
    throw EvaluationError("rows of loops of '" + source_->name() + "' are differentiated along coordinates and parameters of the tree, not along what moves embedded loops");
  }
  Expression body_edge_factor(const MechanicsLetters& l) const override { return l.crf(times({l.own_H().T(), along(l)})); }
  Expression root_motion(const MechanicsLetters& l) const override { return body_edge_factor(l); }
  Expression tangent_of_block(const MechanicsLetters& l, SymbolId id) const override {
    if (id != SymbolId::H) return id == SymbolId::M ? zero(l.o.M.domain(), l.o.M.codomain()) : zero(l.o.J.domain(), l.o.J.codomain());
    std::vector<Expression> terms = {zero(l.o.H.domain(), l.o.H.codomain())};
    for (int p = 1; p < most_subhinges(*source_); ++p)
      terms.push_back(times({l.selection(OfSubhinges{-1, 0, p}), l.own_H(), l.crf(times({l.own_H().T(), l.selection(OfSubhinges{-1, p, p + 1}), along(l)}))}));
    return plus(terms);
  }
  Expression outboard_motion(const MechanicsLetters& l, const TwistPlace& direction) const override {
    const Place own = place_of(*source_, direction);
    const int from = static_cast<int>(std::floor(own.slot)) + 1, count = static_cast<int>(source_->model()->body(own.body).hinge.subhinges.size());
    if (from >= count) return zero(l.o.M.codomain(), l.o.M.codomain());
    return l.crf(times({l.own_H().T(), l.selection(OfSubhinges{own.body, from, count}), along(l)}));
  }
  // θ̇ = X θ̇_r, and θ̇_r stays.
  Expression velocity_tangent(const MechanicsLetters& l, const Expression&) const override {
    return times({map_tangent(embedded_, l), l.bound(make_symbol(definition_of(theta_dot), embedded_))});
  }
  void check_embedding(const std::shared_ptr<EmbeddedOperators>& embedded) const {
    if (embedded != embedded_) throw EvaluationError("operators of two embeddings of '" + source_->name() + "': differentiate along a coordinate of either before they are combined");
  }
  std::shared_ptr<EmbeddedOperators> embedded_;
};

// Along w = X e_i.
class IndependentDirection final : public DirectionOnLoops {
 public:
  IndependentDirection(const std::shared_ptr<EmbeddedOperators>& embedded, int i) : DirectionOnLoops(embedded), i_(i) {}

 protected:
  Expression along(const MechanicsLetters& l) const override {
    std::vector<double> unit(embedded_->theta().dimension(), 0.0);
    unit[i_] = 1.0;
    const Expression e = constant(unit, Space::euclidean(1), embedded_->theta(), "e(" + embedded_->structure().coordinate_names[i_] + ")");
    return times({l.bound(make_symbol(definition_of(coordinate_map), embedded_)), e});
  }
  Expression map_tangent(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters& l) const override {
    check_embedding(embedded);
    return l.bound(make_symbol(definition_of(coordinate_map_tangent), embedded, OfCoordinate{i_}, embedded->structure().coordinate_names[i_]));
  }
  Expression second_map_tangent(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters& l, const Expression& e) const override {
    check_embedding(embedded);
    return second_map(embedded, l, e, {{1.0, OfCoordinate{i_}}}, embedded->structure().coordinate_names[i_]);
  }

 private:
  int i_;
};

// Along twists in hinges, and w = ∂θ_d of what follows them.
class ParameterOnLoops final : public DirectionOnLoops {
 public:
  ParameterOnLoops(const std::shared_ptr<EmbeddedOperators>& embedded, const Parameter& parameter)
      : DirectionOnLoops(embedded), twists_(twists_of(parameter)), name_(parameter.name), in_hinges_(twist_direction(embedded->base(), twists_)) {}
  Expression frame_motion(const Symbol& like) const override { return plus({DirectionOnLoops::frame_motion(like), in_hinges().frame_motion(like)}); }

 protected:
  Expression along(const MechanicsLetters& l) const override { return letter(l, embedding_letters::dependent_shift); }
  Expression body_edge_factor(const MechanicsLetters& l) const override { return plus({DirectionOnLoops::body_edge_factor(l), in_hinges().body_edge_factor(l)}); }
  Expression root_motion(const MechanicsLetters& l) const override { return plus({DirectionOnLoops::body_edge_factor(l), in_hinges().root_motion(l)}); }
  Expression tangent_of_block(const MechanicsLetters& l, SymbolId id) const override {
    return plus({DirectionOnLoops::tangent_of_block(l, id), in_hinges().tangent_of_block(l, id)});
  }
  Expression outboard_motion(const MechanicsLetters& l, const TwistPlace& direction) const override {
    return plus({DirectionOnLoops::outboard_motion(l, direction), in_hinges().outboard_motion(l, direction)});
  }
  Expression map_tangent(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters& l) const override {
    check_embedding(embedded);
    return letter(l, embedding_letters::parameter_map_tangent);
  }
  Expression second_map_tangent(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters& l, const Expression& e) const override {
    check_embedding(embedded);
    return second_map(embedded, l, e, twists_, name_);
  }

 private:
  const MechanicsDirection& in_hinges() const { return static_cast<const MechanicsDirection&>(*in_hinges_); }
  Expression letter(const MechanicsLetters& l, SymbolId id) const { return l.bound(make_symbol(definition_of(id), embedded_, OfDirection{false, twists_}, name_)); }
  Twists twists_;
  std::string name_;
  std::unique_ptr<Direction> in_hinges_;
};

}  // namespace

std::unique_ptr<Direction> independent_direction(const std::shared_ptr<EmbeddedOperators>& source, int coordinate) {
  return std::make_unique<IndependentDirection>(source, coordinate);
}

std::unique_ptr<Direction> parameter_on_loops(const std::shared_ptr<EmbeddedOperators>& source, const Parameter& parameter) {
  if (parameter.source != source->base())
    throw EvaluationError("parameter " + parameter.name + " is of another model than '" + source->name() + "'");
  if (parameter.twists.empty()) return parameter_direction(parameter);
  return std::make_unique<ParameterOnLoops>(source, parameter);
}

}  // namespace pycraft
