// The direction of an independent coordinate of embedded loops (directions.h).
#include <cmath>

#include "operators/mechanics_direction.h"

namespace pycraft {

using namespace directions;

namespace {

// Along w = X e_i.
class IndependentDirection final : public MechanicsDirection {
 public:
  IndependentDirection(const std::shared_ptr<EmbeddedOperators>& embedded, int i) : MechanicsDirection(embedded->base()), embedded_(embedded), i_(i) {}
  Expression frame_motion(const Symbol& like) const override {
    const MechanicsLetters l = letters(like);
    return l.crf(times({l.own_phi().T(), l.own_H().T(), along(l)}));
  }

 protected:
  std::optional<OfDirection> moving() const override {
    throw EvaluationError("rows of loops of '" + source_->name() + "' are differentiated along coordinates of the tree, not along independent ones of embedded loops");
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
  Expression map_tangent(const std::shared_ptr<EmbeddedOperators>& embedded, const MechanicsLetters& l) const override {
    if (embedded != embedded_) throw EvaluationError("operators of two embeddings of '" + source_->name() + "': differentiate along a coordinate of either before they are combined");
    return l.bound(make_symbol(definition_of(coordinate_map_tangent), embedded, OfCoordinate{i_}, embedded->structure().coordinate_names[i_]));
  }
  Expression embedded_tangent(const Expression& e) const override {
    return e.node().symbol.definition->id == theta_dot ? zero(e.domain(), e.codomain()) : MechanicsDirection::embedded_tangent(e);
  }

 private:
  Expression along(const MechanicsLetters& l) const {
    std::vector<double> unit(embedded_->theta().dimension(), 0.0);
    unit[i_] = 1.0;
    const Expression e = constant(unit, Space::euclidean(1), embedded_->theta(), "e(" + embedded_->structure().coordinate_names[i_] + ")");
    return times({l.bound(make_symbol(definition_of(coordinate_map), embedded_)), e});
  }
  std::shared_ptr<EmbeddedOperators> embedded_;
  int i_;
};

}  // namespace

std::unique_ptr<Direction> independent_direction(const std::shared_ptr<EmbeddedOperators>& source, int coordinate) {
  return std::make_unique<IndependentDirection>(source, coordinate);
}

}  // namespace pycraft
