// Steps that apply an expression to a vector: recognised kernels, sweeps, blocks, eliminations.
#include <algorithm>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/language/properties.h"
#include "algebra/planning/costs.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/planning.h"
#include "algebra/planning/recognise.h"
#include "algebra/planning/square_root.h"
#include "algebra/theorems/theorems.h"
#include "runtime/errors.h"

namespace pycraft {

using namespace planning;

namespace {

bool ends_with(const std::vector<Expression>& factors, size_t end, const std::vector<Expression>& tail) {
  if (end < tail.size()) return false;
  for (size_t i = 0; i < tail.size(); ++i)
    if (factors[end - tail.size() + i] != tail[i]) return false;
  return true;
}

// [I-HψK]Hφ -> Hψ and φ*H*[I-HψK]* -> ψ*H* (the theorem "[I-HψK]Hφ = Hψ") beside the factors of ℳ⁻¹, which a product such as ℳ⁻¹𝒥* or
// 𝒥ℳ⁻¹ has: φ gathers what [I-HψK] takes back, and the difference loses digits that ψ never meets. A solve that is to be refined stays one.
std::vector<Expression> gathered_by_psi(const std::vector<Expression>& factors) {
  std::vector<Expression> out;
  for (const Expression& f : factors) {
    bool transposed = false;
    const Symbol* symbol = letter_of(f, transposed);
    if (!symbol || symbol->definition->pattern != Pattern::compound || symbol->definition->tangent_of_inverse) {
      out.push_back(f);
      continue;
    }
    const Expression typed = symbol->definition->expand(*symbol), spelled = lower(transposed ? typed.T() : typed, true);  // 𝒥 = B*φ*H*
    if (spelled.kind() == NodeKind::product)
      out.insert(out.end(), spelled.children().begin(), spelled.children().end());
    else
      out.push_back(f);
  }
  bool changed = false;
  const auto letter = [](const Expression& e, SymbolId id, bool starred) {
    bool transposed = false;
    const Symbol* symbol = letter_of(e, transposed);
    return symbol && transposed == starred && symbol->definition->id == id ? symbol : nullptr;
  };
  for (size_t i = 0; i + 2 < out.size(); ++i) {
    const bool starred = letter(out[i], SymbolId::phi, true);
    const Symbol* h = letter(out[i + 1], SymbolId::H, starred);
    if (!h || !(starred || letter(out[i + 2], SymbolId::phi, false)) || out[starred ? i + 2 : i].kind() != NodeKind::sum) continue;
    if (h->binding && h->binding->arithmetic.refinement.steps != 0) continue;
    const std::vector<Expression> inverse = kernels_of(*h).mass_matrix_inverse;
    const Expression& resolvent = starred ? out[i].children()[0] : out[i + 2];
    if (!same_model(resolvent.node().symbol, *h) || inverse.size() != 3 || out[starred ? i + 2 : i] != inverse[starred ? 0 : 2]) continue;
    const Expression hinge = out[i + 1];
    Expression psi = make_symbol(SymbolId::psi, h->source);
    if (h->binding) psi = psi.at(h->binding);
    out.erase(out.begin() + i + 2);
    changed = true;
    out[i] = starred ? lower(psi.T(), false) : hinge;
    out[i + 1] = starred ? hinge : psi;
  }
  return changed ? out : factors;
}

}  // namespace

int Planner::apply(const Expression& e, int x) {
  const std::pair<int, int> key{id_of(e), x};
  const auto known = vector_memo_.find(key);
  if (known != vector_memo_.end()) return known->second;
  const bool wide = plan_.registers[x].wide;
  int y = -1;
  switch (e.kind()) {
    case NodeKind::identity: y = x; break;
    case NodeKind::zero: {
      Step s{StepKind::zero};
      s.text = "0";
      s.bytes = vector_bytes(e.codomain());
      y = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, wide});
      break;
    }
    case NodeKind::symbol: y = apply_symbol(e.node().symbol, false, false, x); break;
    case NodeKind::transpose: {
      const Expression& inner = e.children()[0];
      if (inner.kind() == NodeKind::symbol) {
        y = apply_symbol(inner.node().symbol, true, false, x);
      } else if (inner.kind() == NodeKind::vector) {
        Step s{StepKind::apply_column};
        s.in = {vector_value(inner), x};
        s.transposed = true;
        s.flops = 2.0 * inner.codomain().dimension();
        s.text = show(e);
        y = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, wide});
      } else if (inner.kind() == NodeKind::constant && inner.node().constant->blocks.empty()) {
        Step s{StepKind::apply_constant};
        s.in = {x};
        s.constant = inner.node().constant;
        s.transposed = true;
        s.flops = 2.0 * e.domain().dimension() * e.codomain().dimension();
        s.text = show(e);
        y = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, wide});
      } else if (inner.kind() == NodeKind::external) {
        Step s{StepKind::apply_external};
        s.in = {x};
        s.external = inner.node().external;
        s.transposed = true;
        s.text = show(e);
        y = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, wide});
      } else {
        y = apply_blocks(blocks(e), false, x, show(e));
      }
      break;
    }
    case NodeKind::vector: {
      Step s{StepKind::apply_column};
      s.in = {vector_value(e), x};
      s.flops = 2.0 * e.codomain().dimension();
      s.bytes = vector_bytes(e.codomain());
      s.text = show(e);
      y = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, wide});
      break;
    }
    case NodeKind::constant: {
      if (!e.node().constant->blocks.empty()) {
        y = apply_blocks(blocks(e), false, x, show(e));
        break;
      }
      Step s{StepKind::apply_constant};
      s.in = {x};
      s.constant = e.node().constant;
      s.flops = 2.0 * e.domain().dimension() * e.codomain().dimension();
      s.bytes = vector_bytes(e.codomain());
      s.text = show(e);
      y = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, wide});
      break;
    }
    case NodeKind::external: {
      Step s{StepKind::apply_external};
      s.in = {x};
      s.external = e.node().external;
      s.bytes = vector_bytes(e.codomain());
      s.text = show(e);
      y = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, wide});
      break;
    }
    case NodeKind::scaled: {
      Step s{StepKind::combine};
      s.in = {apply(e.children()[0], x)};
      s.coefficients = {e.node().coefficient};
      s.flops = e.codomain().dimension();
      s.bytes = vector_bytes(e.codomain());
      s.text = show(e.node().coefficient * identity());
      y = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, wide});
      break;
    }
    case NodeKind::sum: y = apply_sum(e, x); break;
    case NodeKind::product: y = apply_product(e.children(), x, e); break;
    case NodeKind::inverse: y = apply_inverse(e, x); break;
    case NodeKind::block_diagonal:
    case NodeKind::block_function:
    case NodeKind::square_root: y = apply_blocks(blocks(e), false, x, show(e)); break;
  }
  vector_memo_[key] = y;
  return y;
}

int Planner::apply_product(const std::vector<Expression>& typed, int x, const Expression&) {
  const std::vector<Expression> factors = options_.rules ? gathered_by_psi(typed) : typed;
  size_t end = factors.size();
  while (end > 0) {
    // A run of factors with a kernel of its own?
    bool transposed = false;
    const Symbol* last = letter_of(factors[end - 1], transposed);
    size_t taken = 0;
    if (options_.rules && last && is_symbol(transposed ? factors[end - 1].children()[0] : factors[end - 1], SymbolId::H) && transposed) {
      const Kernels kernels = kernels_of(*last);
      if (ends_with(factors, end, kernels.mass_matrix)) {
        Step s{StepKind::mass_matrix};
        s.in = {x};
        s.context = context_of(*last, Group::kinematics);
        s.flops = mass_matrix_flops(*last->source, false);
        s.bytes = vector_bytes(last->source->theta()) + vector_bytes(last->source->motions());
        s.tier = 1;
        s.text = "HφMφ*H* (Newton-Euler at rest: base to tip, tip to base)";
        x = emit(std::move(s), {RegisterKind::vector, last->source->theta(), {}, nullptr, plan_.registers[x].wide});
        taken = kernels.mass_matrix.size();
      }
    }
    if (!taken && options_.rules && factors[end - 1].kind() == NodeKind::sum) {
      for (const Expression& t : factors[end - 1].children()) {
        const Scaled part = split_scalar(t);
        if (part.expression.kind() != NodeKind::product || !is_symbol(part.expression.children()[0], SymbolId::H)) continue;
        const Symbol& h = part.expression.children()[0].node().symbol;
        const Kernels kernels = kernels_of(h);
        if (!ends_with(factors, end, kernels.mass_matrix_inverse)) continue;
        Step s{StepKind::mass_matrix_solve};
        s.in = {x};
        s.context = context_of(h, Group::kinematics | Group::articulated);
        s.flops = mass_matrix_flops(*h.source, true);
        s.bytes = vector_bytes(h.source->theta()) + vector_bytes(h.source->motions());
        s.tier = 1;
        s.text = "[I-HψK]* D⁻¹ [I-HψK] (tip to base, base to tip)";
        x = emit(std::move(s), {RegisterKind::vector, h.source->theta(), {}, nullptr, plan_.registers[x].wide});
        taken = kernels.mass_matrix_inverse.size();
        break;
      }
    }
    if (taken) {
      end -= taken;
      continue;
    }
    x = apply(factors[--end], x);
  }
  return x;
}

int Planner::apply_sum(const Expression& e, int x) {
  // ℳ + J in one kernel.
  std::vector<char> used(e.children().size(), 0);
  std::vector<std::pair<Coefficient, int>> parts;
  if (options_.rules)
    for (const MassMatrixWithRotors& whole : mass_matrices_with_rotors(e)) {
      const Symbol& h = whole.model;
      Step s{StepKind::mass_matrix};
      s.in = {x};
      s.flag = true;
      s.context = context_of(h, Group::kinematics);
      s.flops = mass_matrix_flops(*h.source, false);
      s.bytes = vector_bytes(h.source->theta()) + vector_bytes(h.source->motions());
      s.tier = 1;
      s.text = "HφMφ*H* + J (Newton-Euler at rest: base to tip, tip to base)";
      parts.emplace_back(whole.coefficient, emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, plan_.registers[x].wide}));
      used[whole.product] = used[whole.rotors] = 1;
    }
  for (size_t i = 0; i < e.children().size(); ++i) {
    if (used[i]) continue;
    const Scaled s = split_scalar(e.children()[i]);
    parts.emplace_back(s.coefficient, apply(s.expression, x));
  }
  if (parts.size() == 1 && parts[0].first == 1) return parts[0].second;
  Step s{StepKind::combine};
  for (const auto& [c, r] : parts) {
    s.coefficients.push_back(c);
    s.in.push_back(r);
  }
  s.flops = 2.0 * e.codomain().dimension() * parts.size();
  s.bytes = vector_bytes(e.codomain());
  s.text = parts.size() == 1 ? "scale" : "sum of " + std::to_string(parts.size()) + " terms";
  return emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, plan_.registers[x].wide});
}

int Planner::apply_symbol(const Symbol& symbol, bool transposed, bool inverted, int x) {
  const SymbolDefinition& d = *symbol.definition;
  Expression e = make_symbol(d, symbol.source, symbol.arguments, symbol.argument_text);
  if (symbol.binding) e = e.at(symbol.binding);
  const Space domain = inverted ? (transposed ? e.domain().dual() : e.codomain()) : (transposed ? e.codomain().dual() : e.domain());
  const Space codomain = inverted ? (transposed ? e.codomain().dual() : e.domain()) : (transposed ? e.domain().dual() : e.codomain());
  const bool wide = plan_.registers[x].wide;
  std::string text = show(e) + (transposed ? "*" : "") + (inverted ? "⁻¹" : "");
  switch (d.pattern) {
    case Pattern::compound:
      if (d.tangent_of_inverse) return apply_inverse_tangent(symbol, x);
      return apply(lower(transposed ? d.expand(symbol).T() : d.expand(symbol), true), x);
    case Pattern::vector: {
      Step s{StepKind::apply_column};
      s.in = {vector_value(e), x};
      s.transposed = transposed;
      s.flops = 2.0 * e.codomain().dimension();
      s.text = text;
      return emit(std::move(s), {RegisterKind::vector, codomain, {}, nullptr, wide});
    }
    case Pattern::resolvent: {
      Step s{transposed ? StepKind::scatter : StepKind::gather};
      s.in = {x};
      s.symbol = symbol;
      s.context = context_of(symbol, d.groups);
      s.flops = resolvent_flops(symbol);
      s.bytes = vector_bytes(codomain);
      s.text = text + (transposed ? " (base to tip)" : " (tip to base)");
      return emit(std::move(s), {RegisterKind::vector, codomain, {}, nullptr, wide});
    }
    default: break;
  }
  if (d.kind() != LetterKind::sko) return apply_blocks(blocks(transposed ? e.T() : e), false, x, text);
  Step s{StepKind::apply_symbol};
  s.in = {x};
  s.symbol = symbol;
  s.transposed = transposed && !d.symmetric;
  s.inverted = inverted;
  s.context = context_of(symbol, d.groups);
  s.flops = symbol_flops(symbol);
  s.bytes = vector_bytes(codomain);
  s.text = text;
  return emit(std::move(s), {RegisterKind::vector, codomain, {}, nullptr, wide});
}

int Planner::apply_inverse_tangent(const Symbol& symbol, int x) {
  const Space space = symbol.source->theta();
  Step s{StepKind::mass_matrix_solve_tangent};
  s.in = {x};
  s.symbol = symbol;
  s.context = context_of(symbol, symbol.definition->groups);
  s.operand = plan_operand(symbol.definition->expand(symbol));
  s.flops = 3 * (group_flops(*symbol.source, Group::articulated) + mass_matrix_flops(*symbol.source, true));
  s.bytes = vector_bytes(space) + vector_bytes(symbol.source->motions());
  s.tier = 1;
  s.text = "∂(HφMφ*H* + J)⁻¹ along " + symbol.argument_text + " (the derivative of the Riccati sweep)";
  return emit(std::move(s), {RegisterKind::vector, space, {}, nullptr, plan_.registers[x].wide});
}

int Planner::vector_value(const Expression& e) {
  const auto known = block_memo_.find(id_of(e));
  if (known != block_memo_.end()) return known->second;
  int r;
  if (e.kind() == NodeKind::vector) {
    const auto found = plan_.vectors.find(e.node().name);
    if (found != plan_.vectors.end()) {
      if (!(plan_.registers[found->second].space == e.codomain()))
        throw SpaceError("vector '" + e.node().name + "' is used in two spaces, " + plan_.registers[found->second].space.description() + " and " +
                         e.codomain().description());
      return found->second;
    }
    r = new_register(RegisterKind::vector, e.codomain(), {}, false);
    plan_.vectors[e.node().name] = r;
  } else {
    const Symbol& symbol = e.node().symbol;
    Step s{StepKind::vector_symbol};
    s.symbol = symbol;
    s.context = context_of(symbol, symbol.definition->groups);
    s.bytes = vector_bytes(e.codomain());
    s.text = show(e);
    r = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, false});
  }
  block_memo_[id_of(e)] = r;
  return r;
}

int Planner::column(const Expression& e) {
  const auto known = block_memo_.find(id_of(e));
  if (known != block_memo_.end()) return known->second;
  int r = -1;
  switch (e.kind()) {
    case NodeKind::vector: return vector_value(e);
    case NodeKind::symbol:
      if (e.node().symbol.definition->pattern == Pattern::vector) return vector_value(e);
      break;
    case NodeKind::constant: {
      if (!(e.domain() == Space::euclidean(1))) break;
      Step s{StepKind::vector_symbol};
      s.constant = e.node().constant;
      s.bytes = vector_bytes(e.codomain());
      s.text = show(e);
      r = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, false});
      break;
    }
    case NodeKind::product: {
      const auto& f = e.children();
      r = apply_product(std::vector<Expression>(f.begin(), f.end() - 1), column(f.back()), e);
      break;
    }
    case NodeKind::scaled:
    case NodeKind::sum: {
      Step s{StepKind::combine};
      for (const Expression& t : e.kind() == NodeKind::sum ? e.children() : std::vector<Expression>{e}) {
        const Scaled part = split_scalar(t);
        s.in.push_back(column(part.expression));
        s.coefficients.push_back(part.coefficient);
      }
      s.flops = 2.0 * e.codomain().dimension() * s.in.size();
      s.bytes = vector_bytes(e.codomain());
      s.text = show(e);
      r = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, false});
      break;
    }
    default: break;
  }
  if (r < 0) throw EvaluationError(show(e) + " is no vector that a block can be made of");
  block_memo_[id_of(e)] = r;
  return r;
}

int Planner::apply_blocks(int block, bool transposed, int x, const std::string& text) {
  const Register b = plan_.registers[block];
  Step s{StepKind::apply_blocks};
  s.in = {block, x};
  s.transposed = transposed;
  s.flops = 2 * block_entries(b.space, b.columns);
  const Space out = transposed ? b.columns.dual() : b.space;
  s.bytes = vector_bytes(out);
  s.text = text;
  return emit(std::move(s), {RegisterKind::vector, out, {}, nullptr, plan_.registers[x].wide});
}

int Planner::apply_inverse(const Expression& e, int x) {
  const Expression& inner = e.children()[0];
  bool transposed = false;
  if (const Symbol* symbol = letter_of(inner, transposed)) {
    if (symbol->definition->id == SymbolId::D) return apply_symbol(*symbol, false, true, x);
    if (symbol->definition->pattern == Pattern::resolvent && options_.rules) {  // φ⁻¹ = I - E, ψ⁻¹ = I - E_ψ
      const SymbolId edge = symbol->definition->id == SymbolId::phi ? SymbolId::E : SymbolId::E_psi;
      Expression edges = make_symbol(edge, symbol->source);
      if (symbol->binding) edges = edges.at(symbol->binding);
      if (transposed) edges = edges.T();
      return apply(lower(identity() - edges, true), x);
    }
  }
  if (is_block_diagonal(inner)) return apply_blocks(blocks(e), false, x, show(e));
  if (const auto root = gram_root(inner)) {
    Step s{StepKind::dense_solve};
    s.in = {factor_gram(inner, *root), x};
    s.flops = 2.0 * inner.domain().dimension() * inner.domain().dimension();
    s.bytes = vector_bytes(e.codomain());
    s.tier = 1;
    s.text = show(e) + " by its triangular factors";
    return emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, plan_.registers[x].wide});
  }
  return solve_realization(e, x);
}

int Planner::solve_realization(const Expression& e, int x) {
  std::string reason;
  const auto realization = build_realization(*this, e, false, reason);
  if (!realization) return solve_dense(e.children()[0], x, reason);
  Step f{StepKind::factor};
  f.realization = realization;
  f.flops = realization->factor_flops();
  f.bytes = 8 * realization->entries();
  f.tier = 3;
  f.text = "eliminate " + show(e) + " over the tree, leaves to root";
  const auto key = id_of(e);
  int factor;
  if (const auto known = block_memo_.find(key); known != block_memo_.end()) {
    factor = known->second;
  } else {
    factor = emit(std::move(f), {RegisterKind::factor, {}, {}, realization, false});
    block_memo_[key] = factor;
  }
  Step s{StepKind::solve};
  s.in = {factor, x};
  s.realization = realization;
  s.flops = realization->solve_flops();
  s.bytes = vector_bytes(e.codomain());
  s.tier = 3;
  s.text = show(e) + " (leaves to root, root to leaves)";
  return emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, plan_.registers[x].wide});
}

// A plan of its own, whose values are computed with this one's.
std::shared_ptr<const Plan> Planner::plan_operand(const Expression& operand) {
  auto made = std::make_shared<const Plan>(Planner(options_).plan(operand, Request::apply));
  for (size_t c = 0; c < made->contexts.size(); ++c)
    context_of(Symbol{nullptr, made->contexts[c].source, made->contexts[c].binding, {}, {}}, made->groups[c]);
  return made;
}

// L⁻¹HψB of B*ψ*H*D⁻¹HψB, D = LL*, in whatever spelling reads the same from D⁻¹ to both sides: of the operators of nodes and of R^n, whose
// inverse is Λ and its like.
std::optional<Expression> Planner::gram_root(const Expression& e) const {
  const SpaceKind kind = e.domain().kind();
  if (kind == SpaceKind::Theta || kind == SpaceKind::V || kind == SpaceKind::F) return std::nullopt;
  if (!options_.rules || e.kind() != NodeKind::product) return std::nullopt;
  const std::vector<Expression>& f = e.children();
  const size_t middle = f.size() / 2;
  if (f.size() % 2 == 0 || f[middle].kind() != NodeKind::inverse || !is_symbol(f[middle].children()[0], SymbolId::D)) return std::nullopt;
  for (size_t i = 0; i < middle; ++i)
    if (f[i] != lower(f[f.size() - 1 - i].T(), false)) return std::nullopt;
  const Expression D = f[middle].children()[0];
  const Letters o(D.node().symbol.source, D.node().symbol.binding);
  std::vector<Expression> right{square_root(D).inv()};
  size_t i = middle + 1;
  if (i + 2 < f.size() && f[i] == kernels_of(D.node().symbol).mass_matrix_inverse.back() && f[i + 1] == o.H && f[i + 2] == o.phi) {
    right.insert(right.end(), {o.H, o.psi});  // [I-HψK]Hφ = Hψ
    i += 3;
  }
  right.insert(right.end(), f.begin() + i, f.end());
  return product_of(right);
}

int Planner::factor_gram(const Expression& e, const Expression& root) {
  const int key = id_of(e);
  if (const auto known = block_memo_.find(key); known != block_memo_.end()) return known->second;
  const double n = root.codomain().dimension(), r = root.domain().dimension();
  Step f{StepKind::dense_factor};
  f.flag = true;
  f.operand = plan_operand(root);
  f.flops = 2 * n * r * r + r * f.operand->flops();
  f.bytes = 8 * (n * r + r * r);
  f.tier = 1;
  f.text = "X*X = " + show(e) + ": triangular factors of X = " + show(root);
  return block_memo_[key] = emit(std::move(f), {RegisterKind::dense, e.codomain(), e.domain(), nullptr, false});
}

// Of one operand the whole plan has the factors once, wherever they are needed.
int Planner::dense_factor(const Expression& operand, const std::string& reason) {
  if (whole_) return whole_->dense_factor(operand, reason);
  const int key = id_of(operand);
  if (const auto known = dense_memo_.find(key); known != dense_memo_.end()) return known->second;
  if (std::find(plan_.notes.begin(), plan_.notes.end(), "dense: " + reason) == plan_.notes.end()) plan_.notes.push_back("dense: " + reason);
  const double n = operand.domain().dimension();
  Step f{StepKind::dense_factor};
  f.operand = std::make_shared<const Plan>(Planner(options_, *this).plan_lowered(operand));
  for (size_t c = 0; c < f.operand->contexts.size(); ++c)
    context_of(Symbol{nullptr, f.operand->contexts[c].source, f.operand->contexts[c].binding, {}, {}}, f.operand->groups[c]);
  f.flops = 2 * n * n * n / 3 + n * f.operand->flops();
  f.bytes = 8 * n * n;
  f.tier = 4;
  f.text = show(operand) + " made dense and factored: " + reason;
  return dense_memo_[key] = emit(std::move(f), {RegisterKind::dense, operand.codomain(), operand.domain(), nullptr, false});
}

int Planner::solve_dense(const Expression& operand, int x, const std::string& reason) {
  const double n = operand.domain().dimension();
  int factor = dense_factor(operand, reason);
  if (whole_) {
    const auto [known, fresh] = imported_.try_emplace(factor, -1);
    if (fresh) {
      known->second = new_register(RegisterKind::dense, operand.codomain(), operand.domain(), false);
      plan_.registers[known->second].shared = factor;
    }
    factor = known->second;
  }
  if (x < 0) return factor;
  Step s{StepKind::dense_solve};
  s.in = {factor, x};
  s.flops = 2 * n * n;
  s.bytes = 8 * n;
  s.tier = 4;
  s.text = "(" + show(operand) + ")⁻¹ by the dense factors";
  return emit(std::move(s), {RegisterKind::vector, operand.domain(), {}, nullptr, plan_.registers[x].wide});
}

}  // namespace pycraft
