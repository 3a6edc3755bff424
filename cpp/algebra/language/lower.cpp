#include "algebra/language/lower.h"

#include <algorithm>
#include <unordered_map>

#include "algebra/language/properties.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

Scaled split_scalar(const Expression& e) {
  Scaled s{1, e};
  while (s.expression.kind() == NodeKind::scaled) {
    s.coefficient *= s.expression.node().coefficient;
    s.expression = s.expression.children()[0];
  }
  return s;
}

Expression lowered_sum(const std::vector<Expression>& terms, const Space& domain, const Space& codomain) {
  // Equal terms are collected, zeros dropped; the order of first appearance is kept.
  std::vector<Scaled> collected;
  std::unordered_map<Expression, size_t, ExpressionHash> place;
  const auto add = [&](const Coefficient& c, const Expression& e) {
    const auto [found, fresh] = place.try_emplace(e, collected.size());
    if (fresh)
      collected.push_back({c, e});
    else
      collected[found->second].coefficient += c;
  };
  for (const Expression& t : terms) {
    const Scaled s = split_scalar(t);
    if (s.expression.kind() == NodeKind::zero) continue;
    if (s.expression.kind() == NodeKind::sum) {
      for (const Expression& inner : s.expression.children()) {
        const Scaled i = split_scalar(inner);
        add(s.coefficient * i.coefficient, i.expression);
      }
    } else {
      add(s.coefficient, s.expression);
    }
  }
  std::vector<Expression> kept;
  for (const Scaled& s : collected)
    if (s.coefficient != 0) kept.push_back(s.coefficient == 1 ? s.expression : s.coefficient * s.expression);
  if (kept.empty()) return zero(domain, codomain);
  return sum_of(std::move(kept));
}

Expression lowered_product(const std::vector<Expression>& factors, const Space& domain, const Space& codomain) {
  Coefficient c = 1;
  std::vector<Expression> kept;
  for (const Expression& f : factors) {
    const Scaled own = split_scalar(f);
    c *= own.coefficient;
    const Expression& inner = own.expression;
    if (inner.kind() == NodeKind::zero) return zero(domain, codomain);
    if (inner.kind() == NodeKind::identity) continue;
    if (inner.kind() == NodeKind::product)
      kept.insert(kept.end(), inner.children().begin(), inner.children().end());
    else
      kept.push_back(inner);
  }
  if (c == 0) return zero(domain, codomain);
  const Expression product = kept.empty() ? identity(domain) : product_of(std::move(kept));
  return c == 1 ? product : c * product;
}

namespace {

class Lowering {
 public:
  explicit Lowering(bool expand) : expand_(expand) {}

  // What is below comes first, so that nothing recurses; each node once as it is and once transposed.
  Expression run(const Expression& root, bool transposed) {
    if (done(root, transposed)) return at(root, transposed);
    std::vector<std::pair<const Expression*, bool>> todo = {{&root, transposed}};
    while (!todo.empty()) {
      const auto [place, t] = todo.back();
      const Expression& e = *place;
      if (done(e, t)) {
        todo.pop_back();
        continue;
      }
      const size_t before = todo.size();
      const bool below = transposed_below(e, t);
      for (const Expression& c : e.children())
        if (!done(c, below)) todo.emplace_back(&c, below);
      if (todo.size() > before) continue;
      check_interrupt();
      Expression result = compute(e, t);
      todo.pop_back();
      if (!t && result.get() == e.get()) {
        stays(e).set(1);
        continue;
      }
      if ((t ? transposed_ : plain_).emplace(e.get(), std::move(result)).second) alive_.push_back(e);
    }
    return at(root, transposed);
  }

  // Of what is lowered already.
  static Expression inverse_of(const Expression& lowered) { return invert(lowered); }

 private:
  // What lowering leaves as it is, it leaves so for ever.
  const Found& stays(const Expression& e) const { return expand_ ? e.node().spelled_out : e.node().lowered; }
  bool done(const Expression& e, bool t) const { return t ? transposed_.contains(e.get()) : stays(e).value() == 1 || plain_.contains(e.get()); }
  const Expression& at(const Expression& e, bool t) const {
    if (!t && stays(e).value() == 1) return e;
    return (t ? transposed_ : plain_).at(e.get());
  }

  static bool transposed_below(const Expression& e, bool t) {
    switch (e.kind()) {
      case NodeKind::transpose: return !t;
      case NodeKind::square_root:
      case NodeKind::block_function: return false;
      default: return t;
    }
  }

  // Whether e, whose parts are as they were, is what lowering makes of it.
  static bool is_lowered(const Expression& e) {
    const auto& parts = e.children();
    const auto none = [&](std::initializer_list<NodeKind> kinds) {
      return std::none_of(parts.begin(), parts.end(), [&](const Expression& x) { return std::find(kinds.begin(), kinds.end(), x.kind()) != kinds.end(); });
    };
    switch (e.kind()) {
      case NodeKind::product: return none({NodeKind::scaled, NodeKind::zero, NodeKind::identity, NodeKind::product});
      case NodeKind::scaled: return none({NodeKind::scaled, NodeKind::zero, NodeKind::identity}) && !e.node().coefficient.is_zero() && e.node().coefficient != 1;
      case NodeKind::inverse: return none({NodeKind::scaled, NodeKind::zero, NodeKind::identity, NodeKind::inverse, NodeKind::product});
      case NodeKind::identity:
      case NodeKind::zero: return !e.node().symbol.binding;
      case NodeKind::square_root: return none({NodeKind::identity});
      case NodeKind::block_diagonal: return none({NodeKind::scaled}) && !is_block_diagonal(parts[0]);
      case NodeKind::sum: {
        if (!none({NodeKind::zero, NodeKind::sum})) return false;
        const auto term = [&](size_t i) -> const Expression& { return parts[i].kind() == NodeKind::scaled ? parts[i].children()[0] : parts[i]; };
        for (size_t i = 0; i < parts.size(); ++i) {
          const NodeKind kind = term(i).kind();
          if (kind == NodeKind::zero || kind == NodeKind::sum || kind == NodeKind::scaled || (parts[i].kind() == NodeKind::scaled && !is_lowered(parts[i]))) return false;
        }
        std::vector<size_t> hashes;
        for (size_t i = 0; i < parts.size(); ++i) hashes.push_back(term(i).node().hash);
        std::sort(hashes.begin(), hashes.end());
        return std::adjacent_find(hashes.begin(), hashes.end()) == hashes.end();  // else there may be terms to collect
      }
      default: return false;
    }
  }
  bool unchanged(const Expression& e) const {
    return is_lowered(e) && std::all_of(e.children().begin(), e.children().end(), [&](const Expression& c) { return at(c, false).get() == c.get(); });
  }

  Expression compute(const Expression& e, bool t) {
    if (!t && unchanged(e)) return e;
    const Space domain = t ? e.codomain().dual() : e.domain(), codomain = t ? e.domain().dual() : e.codomain();
    switch (e.kind()) {
      case NodeKind::symbol: {
        const SymbolDefinition& d = *e.node().symbol.definition;
        if (expand_ && d.expand) return run(d.expand(e.node().symbol), t);
        return t && !d.symmetric ? e.T() : e;
      }
      case NodeKind::identity: return identity(domain);
      case NodeKind::zero: return zero(domain, codomain);
      case NodeKind::constant: return t && !e.node().constant->symmetric ? e.T() : e;
      case NodeKind::vector:
      case NodeKind::external: return t ? e.T() : e;
      case NodeKind::sum: {
        std::vector<Expression> terms;
        for (const Expression& c : e.children()) terms.push_back(run(c, t));
        return lowered_sum(terms, domain, codomain);
      }
      case NodeKind::product: {
        std::vector<Expression> factors;
        for (const Expression& c : e.children()) factors.push_back(run(c, t));
        if (t) std::reverse(factors.begin(), factors.end());
        return lowered_product(factors, domain, codomain);
      }
      case NodeKind::scaled: return lowered_product({e.node().coefficient * run(e.children()[0], t)}, domain, codomain);
      case NodeKind::transpose: {
        const Expression inner = run(e.children()[0], !t);
        const bool as_it_was = inner.kind() == NodeKind::transpose && inner.children()[0].get() == e.children()[0].get();
        return !t && as_it_was ? e : inner;
      }
      case NodeKind::inverse: return invert(run(e.children()[0], t));
      case NodeKind::square_root: {
        const Expression root = square_root_of(run(e.children()[0], false));
        return t ? root.T() : root;
      }
      case NodeKind::block_function: {
        const Expression& operand = e.children()[0];
        const Expression inner = run(operand, false);
        if (inner.kind() == NodeKind::zero) return zero(domain, codomain);
        Expression made = e;
        if (inner.get() != operand.get()) {
          const Symbol& s = e.node().symbol;
          made = s.source ? block_function(*s.definition, s.source, s.binding, inner) : lower_half(inner);
        }
        return t ? made.T() : made;
      }
      case NodeKind::block_diagonal: {
        const Expression inner = run(e.children()[0], t);
        if (is_block_diagonal(inner)) return inner;
        const Scaled s = split_scalar(inner);
        return s.coefficient == 1 ? block_diagonal(s.expression) : s.coefficient * block_diagonal(s.expression);
      }
    }
    return e;
  }

  static Expression invert(const Expression& e) {
    const Scaled s = split_scalar(e);
    if (s.expression.kind() == NodeKind::zero) throw SingularOperatorError("the zero operator has no inverse");
    Expression inverse;
    if (s.expression.kind() == NodeKind::identity) {
      inverse = identity(s.expression.codomain());
    } else if (s.expression.kind() == NodeKind::inverse) {
      inverse = s.expression.children()[0];
    } else if (s.expression.kind() == NodeKind::product) {
      bool square = true;
      for (const Expression& f : s.expression.children()) square &= f.domain().dimension() == f.codomain().dimension() && f.codomain().dimension() > 0 && invertible_by_space(f);
      if (square) {
        std::vector<Expression> factors;
        for (auto f = s.expression.children().rbegin(); f != s.expression.children().rend(); ++f) factors.push_back(invert(*f));
        inverse = lowered_product(factors, s.expression.codomain(), s.expression.domain());
      } else {
        inverse = s.expression.inv();
      }
    } else {
      inverse = s.expression.inv();
    }
    if (s.coefficient == 1) return inverse;
    return (1 / s.coefficient) * inverse;
  }

  // H, G and their like map between spaces of bodies and of coordinates: square by accident (six coordinates a body), not by meaning.
  static bool invertible_by_space(const Expression& f) {
    const auto bodies = [](const Space& s) { return s.kind() == SpaceKind::V || s.kind() == SpaceKind::F; };
    return f.domain().kind() == f.codomain().kind() || (bodies(f.domain()) && bodies(f.codomain())) ||
           (f.domain() == f.codomain().dual());
  }

  bool expand_;
  std::unordered_map<const Expression::Node*, Expression> plain_, transposed_;
  std::vector<Expression> alive_;
};

}  // namespace

Expression lower(const Expression& e, bool expand) {
  if (e.floating()) throw SpaceError("I has no space yet: combine it with an operator, or write I with a space");
  return Lowering(expand).run(e, false);
}

Expression lowered_inverse(const Expression& lowered) { return Lowering::inverse_of(lowered); }

}  // namespace pycraft
