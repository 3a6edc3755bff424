// What the theorems do for plans: recognise the forms that have kernels however they are spelled, invert by factors, let resolvents
// meet their inverses. None of it changes a result; all of it changes the cost.
#include <algorithm>
#include <unordered_map>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/language/properties.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/recognise.h"
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

// Of what is lowered, as it stands.
double plan_flops(const Expression& e) { return Planner({false}).lowered_flops(e); }

struct HashOfExpression {
  size_t operator()(const Expression& e) const { return e.node().hash; }
};

// What is longer has no normal form that would be found in time, and no kernel of its own.
constexpr size_t most_letters = 1000;

// Nodes of the expression written out as a tree, as far as most_letters.
size_t written_length(const Expression& e) {
  size_t length = 0;
  std::vector<const Expression*> todo = {&e};
  while (!todo.empty() && length <= most_letters) {
    const Expression& x = *todo.back();
    todo.pop_back();
    ++length;
    for (const Expression& c : x.children()) todo.push_back(&c);
  }
  return length;
}

class Optimiser {
 public:
  explicit Optimiser(std::vector<std::string>& notes) : notes_(notes) {}

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
        if (!is_block_diagonal(inner) && written_length(inner) <= most_letters) {
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
    if (mass_matrix_model(e) || is_mass_matrix_inverse(e) || written_length(e) > most_letters) return e;
    const auto models = contexts(e);
    if (models.size() != 1 || !e.domain().belongs_to_bodies()) return e;
    bool resolvents = false;
    visit(e, [&](const Expression& x) {
      resolvents |= x.kind() == NodeKind::symbol && (x.node().symbol.definition->pattern == Pattern::resolvent || x.node().symbol.definition->pattern == Pattern::compound);
    });
    if (!resolvents) return e;
    Alphabet alphabet;
    const auto form = normal_form(e, alphabet);
    if (!form) return e;
    const size_t most_words = 5;  // HφMφ*H* is HφKD + HφKDK*φ*H* + D + DK*φ*H* - J
    if (form->size() <= most_words && e.domain() == models[0].source->theta() && e.codomain() == models[0].source->theta()) {
      const auto letter = [&](SymbolId id) { return make_symbol(id, models[0].source, models[0].binding); };
      const Expression H = letter(SymbolId::H), phi = letter(SymbolId::phi), J = letter(SymbolId::J);
      const Expression mass_matrix = product_of({H, phi, letter(SymbolId::M), phi.T(), H.T()});
      const auto own = normal_form(mass_matrix, alphabet);
      const Word j{alphabet.letter(J)};
      Polynomial with_J = *own;
      if (models[0].source->traits().hinge_diagonal) {
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
    const Expression normal = lower(to_expression(*form, alphabet, e.domain(), e.codomain()), false);
    if (normal == e || plan_flops(normal) >= plan_flops(e)) return e;
    return found(e, normal);
  }

  Expression found(const Expression& e, const Expression& better) {
    if (better == e) return e;
    note(show(e) + " = " + show(better));
    return better;
  }

  std::vector<std::string>& notes_;
  std::unordered_map<Expression, Expression, HashOfExpression> done_;  // a part that occurs again is another node as often as not
};

}  // namespace

Expression optimise(const Expression& lowered, std::vector<std::string>& notes) { return Optimiser(notes).run(lowered); }

}  // namespace pycraft
