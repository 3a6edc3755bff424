// Steps for diagonal blocks and determinants: by structure where the algebra gives them, else from an elimination.
#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/language/properties.h"
#include "algebra/planning/costs.h"
#include "algebra/planning/plan_tangents.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/planning.h"
#include "algebra/planning/recognise.h"
#include "algebra/theorems/theorems.h"
#include "runtime/errors.h"

namespace pycraft {

using namespace planning;

std::optional<int> Planner::diagonal_by_structure(const Expression& e) {
  const int key = id_of(e);
  if (const auto known = diagonal_memo_.find(key); known != diagonal_memo_.end()) return known->second;
  return diagonal_memo_[key] = structural_diagonal(e);
}

std::optional<int> Planner::structural_diagonal(const Expression& e) {
  if (is_block_diagonal(e)) return blocks(e);
  if (!one_cut_) return std::nullopt;
  switch (e.kind()) {
    case NodeKind::symbol:
    case NodeKind::transpose: {
      bool t = false;
      const Symbol* symbol = letter_of(e, t);
      if (!symbol) return std::nullopt;
      if (symbol->definition->pattern == Pattern::resolvent) return identity_blocks(e.codomain(), e.domain());
      if (symbol->definition->pattern == Pattern::edges) return zero_blocks(e.codomain(), e.domain());
      if (symbol->definition->tangent_of_inverse) return std::nullopt;
      if (symbol->definition->pattern == Pattern::compound) return diagonal_by_structure(lower(e, true));
      return std::nullopt;
    }
    case NodeKind::scaled:
    case NodeKind::sum: {
      const std::vector<Expression> terms = e.kind() == NodeKind::sum ? e.children() : std::vector<Expression>{e};
      Step s{StepKind::combine_blocks};
      for (const Expression& t : terms) {
        const Scaled part = split_scalar(t);
        const auto r = diagonal_by_structure(part.expression);
        if (!r) return std::nullopt;
        s.in.push_back(*r);
        s.coefficients.push_back(part.coefficient);
      }
      s.flops = 2 * block_entries(e.codomain(), e.domain()) * terms.size();
      return emit_blocks(std::move(s), e, "blockdiag(" + shown(e) + ")");
    }
    case NodeKind::inverse: {
      if (!is_upper_triangular(e) && !is_lower_triangular(e)) return std::nullopt;
      const auto r = diagonal_by_structure(e.children()[0]);
      if (!r) return std::nullopt;
      Step s{StepKind::invert_blocks};
      s.in = {*r};
      s.flops = block_product_flops(e.codomain(), e.codomain(), e.domain());
      return emit_blocks(std::move(s), e, "blockdiag(" + shown(e) + ")");
    }
    case NodeKind::product: return diagonal_of_product(e);
    default: return std::nullopt;
  }
}

std::optional<int> Planner::diagonal_of_product(const Expression& e) {
  const auto& f = e.children();
  if (is_upper_triangular(e) || is_lower_triangular(e)) {  // and not both, like E X E*: then so is each factor
    std::optional<int> r;
    for (const Expression& x : f) {
      const auto d = diagonal_by_structure(x);
      if (!d) return std::nullopt;
      r = r ? multiply_blocks(*r, *d) : *d;
    }
    return r;
  }
  // blockdiag(A X B) = A blockdiag(X) B with A, B block diagonal.
  size_t i = 0, j = f.size();
  while (i < f.size() && is_block_diagonal(f[i])) ++i;
  while (j > i && is_block_diagonal(f[j - 1])) --j;
  if (i == 0 && j == f.size()) return diagonal_of_congruence(e);
  const auto part = [&](size_t from, size_t to) { return product_of(std::vector<Expression>(f.begin() + from, f.begin() + to)); };
  const auto inner = i < j ? diagonal_by_structure(part(i, j)) : std::nullopt;
  if (!inner) return std::nullopt;
  int r = *inner;
  if (i > 0) r = multiply_blocks(blocks(part(0, i)), r);
  if (j < f.size()) r = multiply_blocks(r, blocks(part(j, f.size())));
  return r;
}

// φ X φ* with X block diagonal: a Lyapunov sweep. E* X E: a step base to tip.
std::optional<int> Planner::diagonal_of_congruence(const Expression& e) {
  const auto& f = e.children();
  if (const auto known = diagonal_by_theorem(f)) return known;
  bool left_t = false, right_t = false;
  const Symbol *left = letter_of(f.front(), left_t), *right = letter_of(f.back(), right_t);
  if (!left || !right || left->definition != right->definition || !same_model(*left, *right) || left_t == right_t) return std::nullopt;
  const bool edges = left->definition->pattern == Pattern::edges && left_t;
  if (left->definition->pattern != Pattern::resolvent && !edges) return std::nullopt;
  const std::vector<Expression> inside(f.begin() + 1, f.end() - 1);
  if (!inside.empty() && !is_block_diagonal(product_of(inside))) return std::nullopt;
  Step s{edges ? StepKind::congruence_blocks : StepKind::lyapunov_blocks};
  s.in = {f.size() == 2 ? identity_blocks(f[0].domain(), f[1].codomain()) : blocks(product_of(inside))};
  s.symbol = *left;
  s.transposed = left_t;
  s.context = context_of(*left, left->definition->groups);
  s.flops = group_flops(*left->source, Group::composite) * (left->definition->id == SymbolId::psi ? 2 : 1);
  return emit_blocks(std::move(s), e, "blockdiag(" + shown(e) + ")" + (left_t ? " (base to tip)" : " (tip to base)"));
}

// What the sweeps P, D, G (tip to base) and Υ (base to tip) say of the diagonal blocks of a product, O(N):
//
//   blockdiag([I-HψK]* D⁻¹ [I-HψK]) = D⁻¹ + K*ΥK: block (k,k) of K*ΩK sees Ω at k's parent alone
//   blockdiag(ψ*H*D⁻¹Hψ) = blockdiag(φ*H* [I-HψK]* D⁻¹ [I-HψK] Hφ) = Υ
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the operational-space chapter.
std::optional<int> Planner::diagonal_by_theorem(const std::vector<Expression>& factors) {
  if (!options_.rules) return std::nullopt;
  bool transposed = false;
  const Symbol* model = factors.size() == 3 ? innovations_model(factors.back()) : letter_of(factors.back(), transposed);
  if (!model || transposed || !model->source) return std::nullopt;
  const Letters o(model->source, model->binding);
  const std::vector<Expression> inverse = mass_matrix_inverse_of(*model);
  if (factors == inverse) return diagonal_by_structure(lower(o.D.inv() + o.G.T() * o.E.T() * o.Upsilon * o.E * o.G, false));
  const Expression between = product_of(inverse);
  for (const Expression& omega : {o.psi.T() * o.H.T() * o.D.inv() * o.H * o.psi, o.phi.T() * o.H.T() * between * o.H * o.phi})
    if (factors == lower(omega, false).children()) return blocks(o.Upsilon);
  return std::nullopt;
}

int Planner::diagonal_blocks(const Expression& e) {
  // Attempts that fail leave steps behind that nothing reads: drop_unused removes them.
  if (const auto r = diagonal_by_structure(e)) return *r;
  const Register out{RegisterKind::blocks, e.codomain(), e.domain(), nullptr, false};
  const auto from_columns = [&](const std::string& how, int tier) {
    Step s{StepKind::blocks_of_dense};
    s.operand = plan_operand(e);
    s.flops = e.domain().dimension() * s.operand->flops();
    s.bytes = 8.0 * e.domain().dimension() * e.codomain().dimension();
    s.tier = tier;
    s.text = "blocks: blockdiag(" + shown(e) + ") column by column" + how;
    return emit(std::move(s), out);
  };
  if (has_swept_tangent(e)) return from_columns(", by the derivative of the Riccati sweep", 1);
  const Expression spelled = lower(e, true);  // Λ and its like are as small as their nodes
  if (spelled.kind() == NodeKind::inverse && gram_root(spelled.children()[0])) return from_columns(", by its triangular factors", 1);
  std::string reason;
  const auto realization = build_realization(*this, e, true, reason);
  if (realization) {
    Step f{StepKind::factor};
    f.realization = realization;
    f.flops = realization->factor_flops();
    f.bytes = 8 * realization->entries();
    f.tier = 3;
    f.text = "eliminate " + shown(e) + " over the tree, leaves to root";
    const int factor = emit(std::move(f), {RegisterKind::factor, {}, {}, realization, false});
    Step s{StepKind::selected_blocks};
    s.in = {factor};
    s.realization = realization;
    s.flops = 2 * realization->factor_flops();
    s.bytes = 8 * realization->entries();
    s.tier = 3;
    s.text = "blocks: blockdiag(" + shown(e) + ") from the factors, root to leaves";
    return emit(std::move(s), out);
  }
  plan_.notes.push_back("dense: " + reason);
  return from_columns(": " + reason, 4);
}

std::optional<int> Planner::logdet_by_structure(const Expression& e) {
  const Register scalar{RegisterKind::scalar, {}, {}, nullptr, false};
  if (e.kind() == NodeKind::symbol && e.node().symbol.definition->id == SymbolId::D) {
    const Symbol& symbol = e.node().symbol;
    Step s{StepKind::logdet_of_D};
    s.symbol = symbol;
    s.context = context_of(symbol, symbol.definition->groups);
    s.flops = 10.0 * symbol.source->structure().coordinates();
    s.text = "Σ ln det D(k)";
    return emit(std::move(s), scalar);
  }
  if (!cut_equally(e.domain(), e.codomain())) return std::nullopt;  // triangular by blocks, and these are not square
  if (is_block_diagonal(e) || is_upper_triangular(e) || is_lower_triangular(e)) {
    const auto b = diagonal_by_structure(e);
    if (!b) return std::nullopt;
    Step s{StepKind::logdet_of_blocks};
    s.in = {*b};
    s.flops = block_product_flops(e.codomain(), e.codomain(), e.domain()) / 3;
    s.text = "Σ ln|det| of the diagonal blocks";
    return emit(std::move(s), scalar);
  }
  return std::nullopt;
}

// ln|det| of the factors of a product, HφMφ*H* (whose determinant is D's where J = 0) taken together; none where another one is not square.
std::optional<std::vector<int>> Planner::logdet_of_factors(const std::vector<Expression>& factors) {
  std::vector<Expression> parts;
  for (size_t i = 0; i < factors.size();) {
    const Symbol* model = options_.rules ? mass_matrix_model(factors, i) : nullptr;
    if (model && !model->source->traits().hinge_diagonal) {
      parts.push_back(make_symbol(SymbolId::D, model->source, model->binding));
      i += mass_matrix_factors;
    } else {
      if (factors[i].domain().dimension() != factors[i].codomain().dimension()) return std::nullopt;
      parts.push_back(factors[i++]);
    }
  }
  std::vector<int> registers;
  for (const Expression& part : parts) registers.push_back(logdet(part));
  return registers;
}

int Planner::combine_scalars(std::vector<int> in, std::vector<Coefficient> coefficients, const std::string& text, const Coefficient& constant) {
  Step s{StepKind::combine_scalars};
  s.in = std::move(in);
  s.coefficients = std::move(coefficients);
  s.coefficients.push_back(constant);
  s.text = text;
  return emit(std::move(s), {RegisterKind::scalar, {}, {}, nullptr, false});
}

int Planner::logdet(const Expression& e) {
  switch (e.kind()) {
    case NodeKind::symbol:
      if (e.node().symbol.definition->pattern == Pattern::compound) return logdet(lower(e, true));  // Λ
      break;
    case NodeKind::identity: return combine_scalars({}, {}, "ln det I = 0", 0);
    case NodeKind::scaled:
      return combine_scalars({logdet(e.children()[0])}, {1}, "ln det of a multiple", e.domain().dimension() * Coefficient::log_of_size(e.node().coefficient));
    case NodeKind::inverse: return combine_scalars({logdet(e.children()[0])}, {-1}, "ln det of an inverse", 0);
    case NodeKind::product: {
      const auto parts = logdet_of_factors(e.children());
      if (!parts) break;
      if (parts->size() == 1) return parts->front();
      return combine_scalars(*parts, std::vector<Coefficient>(parts->size(), 1), "ln det of a product", 0);
    }
    case NodeKind::sum: {  // ln det (ℳ + J) = ln det D
      if (!options_.rules || e.children().size() != 2) break;
      const auto whole = mass_matrices_with_rotors(e);
      if (whole.size() == 1 && whole[0].coefficient == 1) return logdet(make_symbol(SymbolId::D, whole[0].model.source, whole[0].model.binding));
      break;
    }
    default: break;
  }
  if (const auto r = logdet_by_structure(e)) return *r;
  if (const auto root = gram_root(e)) {
    Step s{StepKind::logdet_of_dense};
    s.in = {factor_gram(e, *root)};
    s.tier = 1;
    s.text = "ln|det| from the factors of " + shown(e);
    return emit(std::move(s), {RegisterKind::scalar, {}, {}, nullptr, false});
  }
  return logdet_by_elimination(e);
}

// A sum, or a product of factors that are not square: the closed realization has its determinant over that of its own states.
int Planner::logdet_by_elimination(const Expression& e) {
  const Register scalar{RegisterKind::scalar, {}, {}, nullptr, false};
  std::string reason;
  const auto system = build_realization(*this, e.inv(), false, reason);
  const auto own = system ? build_realization(*this, e, false, reason) : nullptr;
  if (!system || !own) {
    Step s{StepKind::logdet_of_dense};
    s.in = {solve_dense(e, -1, reason)};
    s.tier = 4;
    s.text = "ln|det| from the dense factors";
    return emit(std::move(s), scalar);
  }
  // det X = det[T -B; C D] / det T
  std::vector<int> parts;
  for (const auto& realization : {system, own}) {
    Step f{StepKind::factor};
    f.realization = realization;
    f.flops = realization->factor_flops();
    f.bytes = 8 * realization->entries();
    f.tier = 3;
    f.text = std::string("eliminate the realization of ") + shown(e) + (realization == system ? " closed, leaves to root" : " itself");
    const int factor = emit(std::move(f), {RegisterKind::factor, {}, {}, realization, false});
    Step s{StepKind::logdet_of_factor};
    s.in = {factor};
    s.flops = 10.0 * e.domain().dimension();
    s.tier = 3;
    s.text = "ln|det| from the pivots";
    parts.push_back(emit(std::move(s), scalar));
  }
  return combine_scalars(parts, {1, -1}, "ln|det| of " + shown(e), 0);
}

}  // namespace pycraft
