// What the theorems do for plans: recognise the forms that have kernels however they are spelled, invert by factors, let resolvents
// meet their inverses. None of it changes a result; all of it changes the cost.
#include <algorithm>
#include <deque>
#include <unordered_map>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/language/properties.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/recognise.h"
#include "algebra/planning/shared_costs.h"
#include "algebra/theorems/polynomial.h"
#include "algebra/theorems/rules.h"
#include "algebra/theorems/theorems.h"
#include "runtime/interrupt.h"

namespace pycraft {

std::vector<Expression> mass_matrix_inverse_of(const Symbol& like) {
  const auto letter = [&](SymbolId id) { return make_symbol(id, like.source, like.binding); };
  const Expression S = identity() - letter(SymbolId::H) * letter(SymbolId::psi) * letter(SymbolId::K);
  return lower(S.T() * letter(SymbolId::D).inv() * S, false).children();
}

const Symbol* mass_matrix_model(const std::vector<Expression>& factors, size_t at) {
  static constexpr std::pair<SymbolId, bool> letters[mass_matrix_factors] = {
      {SymbolId::H, false}, {SymbolId::phi, false}, {SymbolId::M, false}, {SymbolId::phi, true}, {SymbolId::H, true}};
  if (at + mass_matrix_factors > factors.size()) return nullptr;
  const Symbol* model = nullptr;
  for (const auto& [id, starred] : letters) {
    bool transposed = false;
    const Symbol* symbol = letter_of(factors[at++], transposed);
    if (!symbol || transposed != starred || symbol->definition->id != id || (model && !same_model(*symbol, *model))) return nullptr;
    if (!model) model = symbol;
  }
  return model;
}

const Symbol* mass_matrix_model(const Expression& e) {
  return e.kind() == NodeKind::product && e.children().size() == mass_matrix_factors ? mass_matrix_model(e.children(), 0) : nullptr;
}

std::vector<MassMatrixWithRotors> mass_matrices_with_rotors(const Expression& e) {
  std::vector<MassMatrixWithRotors> found;
  if (e.kind() != NodeKind::sum) return found;
  std::vector<char> taken(e.children().size(), 0);
  for (size_t i = 0; i < e.children().size(); ++i) {
    const Scaled product = split_scalar(e.children()[i]);
    const Symbol* model = mass_matrix_model(product.expression);
    if (!model) continue;
    for (size_t j = 0; j < e.children().size(); ++j) {
      const Scaled rotors = split_scalar(e.children()[j]);
      if (taken[j] || !is_symbol(rotors.expression, SymbolId::J) || !same_model(rotors.expression.node().symbol, *model) || rotors.coefficient != product.coefficient)
        continue;
      found.push_back({*model, product.coefficient, i, j});
      taken[j] = 1;
      break;
    }
  }
  return found;
}

namespace {

// [I-HψK]* D⁻¹ [I-HψK]
bool is_mass_matrix_inverse(const Expression& e) {
  const auto& f = e.children();
  if (e.kind() != NodeKind::product || f.size() != 3 || f[1].kind() != NodeKind::inverse || !is_symbol(f[1].children()[0], SymbolId::D)) return false;
  return f == mass_matrix_inverse_of(f[1].children()[0].node().symbol);
}

// What is longer has no normal form that would be found in time, and no kernel of its own.
constexpr size_t most_letters = 1000;

// Beyond words that cost as much, to rounding: sums of flops in another order.
constexpr double same_cost = 1 - 1e-12;

// What is known of a node from the nodes below it.
struct Sketch {
  size_t length = 1;                // nodes, written out as a tree, as far as most_letters + 1
  const Symbol* model = nullptr;    // one that has its model and state
  bool several_models = false, resolvents = false;
};

class Optimiser {
 public:
  Optimiser(const Expression& whole, std::vector<std::string>& notes) : notes_(notes), one_cut_(cut_in_one_way(whole)) {}

  Expression run(const Expression& e) {
    const auto known = done_.find(e);
    if (known != done_.end()) return known->second;
    check_interrupt();
    Expression better = compute(e);
    done_.emplace(e, better);
    return better;
  }

 private:
  Expression compute(const Expression& e) {
    switch (e.kind()) {
      case NodeKind::inverse: {
        const Expression& inner = e.children()[0];
        if (inner.kind() == NodeKind::symbol || inner.kind() == NodeKind::transpose) return e;
        if (!is_block_diagonal(inner) && sketch(inner).length <= most_letters) {
          if (const auto known = invert_by_theorem(inner)) {
            note(known->theorem + ": (" + show(inner) + ")⁻¹ = " + show(known->inverse));
            return is_mass_matrix_inverse(known->inverse) ? known->inverse : run_parts(known->inverse);
          }
        }
        const Expression better = run(inner);
        return better.get() == inner.get() ? e : lowered_inverse(better);
      }
      case NodeKind::sum: return recognise(run_parts(e));
      case NodeKind::product: return mass_matrix_model(e) || is_mass_matrix_inverse(e) ? e : recognise(cancel(run_parts(e)));
      default: return run_parts(e);
    }
  }

  void note(const std::string& text) {
    if (std::find(notes_.begin(), notes_.end(), text) == notes_.end()) notes_.push_back(text);
  }

  Expression run_parts(const Expression& e) {
    if (e.kind() != NodeKind::sum && e.kind() != NodeKind::product && e.kind() != NodeKind::scaled && e.kind() != NodeKind::block_diagonal &&
        e.kind() != NodeKind::square_root)
      return e;
    std::vector<Expression> parts;
    bool changed = false;
    for (const Expression& c : e.children()) {
      parts.push_back(run(c));
      changed |= parts.back().get() != c.get();
    }
    if (!changed) return e;
    switch (e.kind()) {
      case NodeKind::sum: return lowered_sum(parts, e.domain(), e.codomain());
      case NodeKind::product: return lowered_product(parts, e.domain(), e.codomain());
      case NodeKind::scaled: return lowered_product({e.node().coefficient * parts[0]}, e.domain(), e.codomain());
      case NodeKind::block_diagonal: {
        if (is_block_diagonal(parts[0])) return parts[0];
        const Scaled s = split_scalar(parts[0]);
        return s.coefficient == 1 ? block_diagonal(s.expression) : s.coefficient * block_diagonal(s.expression);
      }
      default: return square_root_of(parts[0]);
    }
  }

  // ... X X⁻¹ ... loses both, X a run of factors.
  Expression cancel(const Expression& e) {
    if (e.kind() != NodeKind::product) return e;
    std::vector<Expression> f = e.children();
    bool again = true, changed = false;
    while (again) {
      again = false;
      for (size_t i = 0; i < f.size() && !again; ++i) {
        if (f[i].kind() != NodeKind::inverse) continue;
        const Expression& inner = f[i].children()[0];
        const std::vector<Expression> run = inner.kind() == NodeKind::product ? inner.children() : std::vector<Expression>{inner};
        const auto matches = [&](size_t at) { return at + run.size() <= f.size() && std::equal(run.begin(), run.end(), f.begin() + at); };
        if (i >= run.size() && matches(i - run.size())) {
          f.erase(f.begin() + (i - run.size()), f.begin() + i + 1);
          again = changed = true;
        } else if (matches(i + 1)) {
          f.erase(f.begin() + i, f.begin() + i + 1 + run.size());
          again = changed = true;
        }
      }
    }
    return changed ? lowered_product(f, e.domain(), e.codomain()) : e;
  }

  // HφMφ*H* (+ J) in any spelling, and whatever the normal form makes cheaper.
  Expression recognise(const Expression& e) {
    if (mass_matrix_model(e) || is_mass_matrix_inverse(e)) return e;
    const Sketch of = sketch(e);
    if (of.length > most_letters || !of.model || of.several_models || !of.resolvents || !e.domain().belongs_to_bodies()) return e;
    const Context model{of.model->source, of.model->binding};
    Alphabet alphabet;
    const auto form = normal_form(e, alphabet);
    if (!form) return e;
    const size_t most_words = 5;  // HφMφ*H* is HφKD + HφKDK*φ*H* + D + DK*φ*H* - J
    if (form->size() <= most_words && e.domain() == model.source->theta() && e.codomain() == model.source->theta()) {
      const auto letter = [&](SymbolId id) { return make_symbol(id, model.source, model.binding); };
      const Expression H = letter(SymbolId::H), phi = letter(SymbolId::phi), J = letter(SymbolId::J);
      const Expression mass_matrix = product_of({H, phi, letter(SymbolId::M), phi.T(), H.T()});
      const auto own = normal_form(mass_matrix, alphabet);
      const Word j{alphabet.letter(J)};
      Polynomial with_J = *own;
      if (model.source->traits().hinge_diagonal) {
        with_J[j] += 1;
        if (with_J[j] == 0) with_J.erase(j);
      }
      const auto multiple = [&](const Polynomial& p) -> Coefficient {
        if (p.size() != form->size() || p.empty()) return 0;
        const Coefficient f = form->begin()->second / p.begin()->second;
        for (auto a = form->begin(), b = p.begin(); a != form->end(); ++a, ++b)
          if (a->first != b->first || a->second != f * b->second) return 0;
        return f;
      };
      if (const Coefficient f = multiple(*own); f != 0) return found(e, f == 1 ? mass_matrix : f * mass_matrix);
      if (const Coefficient f = multiple(with_J); f != 0) return found(e, lower(f * (mass_matrix + J), false));
    }
    SharedCosts& costs = costs_of(model, one_cut_ || cut_in_one_way(e));
    const double least = same_cost * costs.flops(e);
    if (costs.flops(*form, alphabet, e.domain(), e.codomain()) >= least) return e;
    const Expression normal = lower(to_expression(*form, alphabet, e.domain(), e.codomain()), false);
    if (normal == e || costs.flops(normal) >= least) return e;
    return found(e, normal);
  }

  Sketch sketch(const Expression& e) {
    const auto known = sketches_.find(e.get());
    if (known != sketches_.end()) return known->second;
    Sketch made;
    const auto meet = [&](const Symbol& s) {
      if (!made.model) made.model = &s;
      made.several_models |= !same_model(s, *made.model);
    };
    const Symbol& own = e.node().symbol;
    if (own.source) meet(own);
    if (e.kind() == NodeKind::symbol) made.resolvents = own.definition->pattern == Pattern::resolvent || own.definition->pattern == Pattern::compound;
    for (const Expression& c : e.children()) {
      const Sketch part = sketch(c);
      made.length = std::min(made.length + part.length, most_letters + 1);
      if (part.model) meet(*part.model);
      made.several_models |= part.several_models;
      made.resolvents |= part.resolvents;
    }
    met_.push_back(e);
    return sketches_[e.get()] = made;
  }

  SharedCosts& costs_of(const Context& model, bool one_cut) {
    for (SharedCosts& costs : costs_)
      if (costs.are_of(model, one_cut)) return costs;
    return costs_.emplace_back(model, one_cut);
  }

  Expression found(const Expression& e, const Expression& better) {
    if (better == e) return e;
    note(show(e) + " = " + show(better));
    return better;
  }

  std::vector<std::string>& notes_;
  bool one_cut_;
  std::unordered_map<Expression, Expression, ExpressionHash> done_;  // a part that occurs again is another node as often as not
  std::unordered_map<const Expression::Node*, Sketch> sketches_;     // of those in met_
  std::vector<Expression> met_;
  std::deque<SharedCosts> costs_;
};

}  // namespace

Expression optimise(const Expression& lowered, std::vector<std::string>& notes) { return Optimiser(lowered, notes).run(lowered); }

}  // namespace pycraft
