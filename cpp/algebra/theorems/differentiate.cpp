#include "algebra/theorems/differentiate.h"
#include "runtime/interrupt.h"

#include <deque>
#include <optional>
#include <unordered_map>

#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/language/properties.h"
#include "algebra/language/source.h"
#include "algebra/theorems/theorems.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

bool is_zero(const Expression& e) { return e.kind() == NodeKind::zero; }

// Products and sums that lose zeros at once, so that what does not depend on the direction vanishes by structure.
Expression times(const std::vector<Expression>& factors) {
  return lowered_product(factors, factors.back().domain(), factors.front().codomain());
}
Expression plus(const std::vector<Expression>& terms) { return lowered_sum(terms, terms[0].domain(), terms[0].codomain()); }
Expression minus(const Expression& e) { return is_zero(e) ? e : -1.0 * e; }
Expression star(const Expression& e) { return is_zero(e) ? zero(e.codomain().dual(), e.domain().dual()) : lower(e.T(), false); }
Expression with_transpose(const Expression& e) { return plus({e, star(e)}); }

}  // namespace

struct Differentiator::State {
  const Direction& direction;
  std::unordered_map<const Expression::Node*, Expression> done;
  std::vector<Expression> alive;
  std::unordered_map<const void*, Expression> articulated_factor;  // F of ∂E_ψ = E F, by binding

  std::deque<std::pair<Context, Letters>> letters;                   // of the models and states met

  explicit State(const Direction& d) : direction(d) {}

  const Letters& letters_of(const Symbol& s) {
    const Context model{s.source, s.binding};
    for (const auto& [known, of_model] : letters)
      if (known == model) return of_model;
    return letters.emplace_back(model, Letters(s.source, s.binding)).second;
  }

  Expression run(const Expression& e) {
    const auto found = done.find(e.get());
    if (found != done.end()) return found->second;
    check_interrupt();
    Expression result = compute(e);
    done.emplace(e.get(), result);
    alive.push_back(e);
    return result;
  }

  Expression compute(const Expression& e) {
    switch (e.kind()) {
      case NodeKind::symbol: return letter(e);
      case NodeKind::vector:
      case NodeKind::identity:
      case NodeKind::zero:
      case NodeKind::constant:
      case NodeKind::external: return zero(e.domain(), e.codomain());
      case NodeKind::sum: {
        std::vector<Expression> terms;
        for (const Expression& c : e.children()) terms.push_back(run(c));
        return plus(terms);
      }
      case NodeKind::product: {
        std::vector<Expression> terms;
        const auto& f = e.children();
        for (size_t i = 0; i < f.size(); ++i) {
          std::vector<Expression> factors(f.begin(), f.end());
          factors[i] = run(f[i]);
          terms.push_back(times(factors));
        }
        return plus(terms);
      }
      case NodeKind::scaled: return times({e.node().coefficient * identity(e.codomain()), run(e.children()[0])});
      case NodeKind::transpose: return star(run(e.children()[0]));
      case NodeKind::inverse: return minus(times({e, run(e.children()[0]), e}));
      case NodeKind::square_root: {
        const Expression tangent = run(e.children()[0]);
        if (is_zero(tangent)) return zero(e.domain(), e.codomain());
        const Expression inverse = e.inv(), own = is_block_diagonal(tangent) ? tangent : block_diagonal(tangent);
        return times({e, lower_half(times({inverse, own, star(inverse)})), identity(e.domain())});
      }
      case NodeKind::block_function: {
        if (e.node().symbol.definition->id != SymbolId::lower_half_of) return direction.tangent(e, *owner);
        const Expression tangent = run(e.children()[0]);
        return is_zero(tangent) ? zero(e.domain(), e.codomain()) : lower_half(tangent);
      }
      case NodeKind::block_diagonal: {
        if (const auto swept = lyapunov(e)) return *swept;
        const Expression tangent = run(e.children()[0]);
        if (is_zero(tangent)) return zero(e.domain(), e.codomain());
        return is_block_diagonal(tangent) ? tangent : block_diagonal(tangent);
      }
    }
    return e;
  }

  // ∂ of one letter, by the table at the head of differentiate.h.
  Expression letter(const Expression& e) {
    const Symbol& s = e.node().symbol;
    if (s.definition->kind() != LetterKind::sko) {
      if (s.definition->pattern == Pattern::compound) return run(lower(s.definition->expand(s), false));
      return direction.tangent(e, *owner);
    }
    const Letters& o = letters_of(s);
    switch (s.definition->id) {
      case SymbolId::H:
      case SymbolId::M:
      case SymbolId::J: return direction.block_tangent(s);
      case SymbolId::E: return times({o.E, direction.edge_factor(s)});
      case SymbolId::phi: return times({o.phi, o.E, direction.edge_factor(s), o.phi});
      case SymbolId::psi: return times({o.psi, o.E, edge_factor_of_psi(s), o.psi});
      case SymbolId::R: {
        const Expression moved = with_transpose(times({direction.edge_factor(s), o.R}));
        return swept(o.phi, plus({run(o.M), times({o.E, moved, o.E.T()})}));
      }
      case SymbolId::P: return swept(o.psi, plus({run(o.M), times({o.E, plus({with_transpose(times({direction.edge_factor(s), o.P_plus})), hinge_terms(s)}), o.E.T()})}));
      case SymbolId::P_plus: {
        const Expression bar = plus({identity(o.H.domain()), minus(times({o.G, o.H}))});
        return plus({times({bar, run(o.P), star(bar)}), hinge_terms(s)});
      }
      case SymbolId::D: return plus({times({o.H, run(o.P), o.H.T()}), with_transpose(times({run(o.H), o.P, o.H.T()})), run(o.J)});
      case SymbolId::G:
        return times({plus({times({run(o.P), o.H.T()}), times({o.P, star(run(o.H))}), minus(times({o.G, run(o.D)}))}), o.D.inv()});
      case SymbolId::Upsilon: {
        const Expression bar = plus({identity(o.H.domain()), minus(times({o.G, o.H}))}), F = edge_factor_of_psi(s);
        const Expression source = with_transpose(times({run(o.H).T(), o.D.inv(), o.H}));
        const Expression hinge = minus(times({o.H.T(), o.D.inv(), run(o.D), o.D.inv(), o.H}));
        std::vector<Expression> terms = {source, hinge};
        if (!is_zero(F)) terms.push_back(block_diagonal(with_transpose(times({star(F), o.E.T(), o.Upsilon, o.E, bar}))));
        return swept(o.psi.T(), plus(terms));
      }
      default: return run(lower(s.definition->expand(s), false));  // φ̃, K, τ, τ̄, E_ψ, ψ̃, Ω: by their definitions
    }
  }

  // blockdiag(A X A*), A one of φ, ψ, φ*, ψ*.
  Expression swept(const Expression& A, const Expression& X) {
    if (is_zero(X)) return X;
    return block_diagonal(times({A, X, star(A)}));
  }

  // - G ∂H P⁺ - P⁺ ∂H* G* + G ∂J G*
  Expression hinge_terms(const Symbol& s) {
    const Letters& o = letters_of(s);
    return plus({minus(with_transpose(times({o.G, run(o.H), o.P_plus}))), times({o.G, run(o.J), o.G.T()})});
  }

  // F with ∂E_ψ = E F.
  Expression edge_factor_of_psi(const Symbol& s) {
    const auto known = articulated_factor.find(s.binding.get());
    if (known != articulated_factor.end() && known->second.domain() == s.source->forces()) return known->second;
    const Letters& o = letters_of(s);
    const Expression bar = plus({identity(o.H.domain()), minus(times({o.G, o.H}))});
    const Expression F = plus({times({direction.edge_factor(s), bar}), minus(times({run(o.G), o.H})), minus(times({o.G, run(o.H)}))});
    articulated_factor[s.binding.get()] = F;
    return F;
  }

  // Y = blockdiag(A X A*) with A = φ, ψ, φ* or ψ* and X block diagonal obeys its own recursion.
  std::optional<Expression> lyapunov(const Expression& e) {
    const Expression& inner = e.children()[0];
    if (inner.kind() != NodeKind::product || inner.children().size() < 2) return std::nullopt;
    const auto& f = inner.children();
    bool first_t = false, last_t = false;
    const Symbol *first = letter_of(f.front(), first_t), *last = letter_of(f.back(), last_t);
    if (!first || !last || first->definition != last->definition || first->definition->pattern != Pattern::resolvent || first_t == last_t ||
        !same_model(*first, *last))
      return std::nullopt;
    if (f.size() > 2 && !is_block_diagonal(product_of(std::vector<Expression>(f.begin() + 1, f.end() - 1)))) return std::nullopt;
    const Letters& o = letters_of(*first);
    const bool articulated = first->definition->id == SymbolId::psi;
    const Expression middle = f.size() == 2 ? identity(f[0].domain()) : times(std::vector<Expression>(f.begin() + 1, f.end() - 1));
    const Expression bar = articulated ? plus({identity(o.H.domain()), minus(times({o.G, o.H}))}) : identity(o.H.domain());
    const Expression F = articulated ? edge_factor_of_psi(*first) : direction.edge_factor(*first);
    std::vector<Expression> terms = {run(middle)};
    if (!is_zero(F)) {
      // X need not be symmetric
      if (!first_t)
        terms.push_back(times({o.E, plus({times({F, e, star(bar)}), times({bar, e, star(F)})}), o.E.T()}));
      else
        terms.push_back(block_diagonal(plus({times({star(F), o.E.T(), e, o.E, bar}), times({star(bar), o.E.T(), e, o.E, F})})));
    }
    return swept(f.front(), plus(terms));
  }

  Differentiator* owner = nullptr;
};

Differentiator::Differentiator(const Direction& direction) : state_(std::make_unique<State>(direction)) { state_->owner = this; }
Differentiator::~Differentiator() = default;
Expression Differentiator::operator()(const Expression& e) { return state_->run(lower(e, false)); }

Expression differentiate(const Expression& e, const Direction& direction) {
  if (e.floating()) return e - e;
  e.check_current();
  Expression result;
  with_stack_for(e.node().depth, [&] { result = with_batch_of(e, lower(Differentiator(direction)(e), false)); });
  return result;
}

Context model_of_spaces(const Expression& e) {
  Context found;
  visit(e, [&](const Expression& x) {
    if (!x.children().empty() || x.floating()) return;
    for (const Space& space : {x.domain(), x.codomain()})
      if (!found.source) found = {source_owning(space), x.node().symbol.binding};
  });
  return found;
}

namespace {

// y = x as numbers, for two spaces that are cut alike.
Expression same_numbers(const Space& domain, const Space& codomain) {
  const auto ones = [](int n) {
    std::vector<double> block(size_t(n) * n, 0.0);
    for (int i = 0; i < n; ++i) block[size_t(i) * n + i] = 1;
    return block;
  };
  const size_t bodies = domain.belongs_to_bodies() ? domain.layout().of_body.size() : 0;
  if (bodies == 0) return constant(ones(domain.dimension()), domain, codomain, "I");
  std::vector<std::vector<double>> blocks;
  for (size_t k = 0; k < bodies; ++k) blocks.push_back(ones(domain.body_size(static_cast<int>(k))));
  return constant_blocks(std::move(blocks), domain, codomain, "I");
}

}  // namespace

Expression differentiate_in_world(const Expression& e, const Direction& direction) {
  Expression result = differentiate(e, direction);
  const auto models = contexts(e);
  const Context model = models.empty() ? model_of_spaces(e) : models[0];
  if (!model.source) return result;
  const Symbol like{&sko_symbol(SymbolId::E), model.source, model.binding, {}, {}};
  const Expression W = direction.frame_motion(like);
  const auto motion = [&](const Space& s) -> Expression {
    if (s == W.domain()) return W;
    if (s == W.domain().dual()) return minus(star(W));
    return zero(s, s);
  };
  return with_batch_of(e, lower(plus({result, times({motion(e.codomain()), lower(e, false)}), minus(times({lower(e, false), motion(e.domain())}))}), false));
}

Scalar differentiate(const Scalar& a, const Direction& direction) {
  const auto& n = a.node();
  switch (n.kind) {
    case ScalarKind::number: return number(0);
    case ScalarKind::trace: return trace(differentiate(n.operand, direction));
    case ScalarKind::logdet: {
      const Expression tangent = differentiate(n.operand, direction);
      return trace(is_zero(tangent) ? tangent : n.operand.inv() * tangent);
    }
    case ScalarKind::norm: {  // ∂‖A‖ = tr(A* ∂A) / ‖A‖, numbers taken as numbers: I between a space and its dual
      const Expression tangent = differentiate(n.operand, direction);
      const Expression& A = n.operand;
      const Expression paired = A.codomain() == A.codomain().dual() ? A.T() * tangent : A.T() * same_numbers(A.codomain(), A.codomain().dual()) * tangent;
      const Scalar product = trace(is_zero(tangent) ? with_batch_of(tangent, zero(paired.domain(), paired.codomain())) : paired);
      return is_zero(tangent) ? product : product * reciprocal(a);
    }
    case ScalarKind::product: {
      Scalar total = number(0);
      for (size_t i = 0; i < n.terms.size(); ++i) {
        Scalar term = differentiate(n.terms[i], direction);
        for (size_t j = 0; j < n.terms.size(); ++j)
          if (j != i) term = term * n.terms[j];
        total = i ? total + term : term;
      }
      return total;
    }
    case ScalarKind::reciprocal: return -1 * (differentiate(n.terms[0], direction) * (a * a));
    case ScalarKind::scaled: return n.value * differentiate(n.terms[0], direction);
    case ScalarKind::sum: {
      Scalar total = differentiate(n.terms[0], direction);
      for (size_t i = 1; i < n.terms.size(); ++i) total = total + differentiate(n.terms[i], direction);
      return total;
    }
  }
  return number(0);
}

}  // namespace pycraft
