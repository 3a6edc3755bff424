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
    const std::vector<Expression> inverse = mass_matrix_inverse_of(*h);
    const Expression& resolvent = starred ? out[i].children()[0] : out[i + 2];
    if (!same_model(resolvent.node().symbol, *h) || inverse.size() != 3 || out[starred ? i + 2 : i] != inverse[starred ? 0 : 2]) continue;
    const Expression hinge = out[i + 1];
    const Expression psi = make_symbol(SymbolId::psi, h->source, h->binding);
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
  return vector_memo_[key] = apply_anew(e, x);
}

int Planner::apply_anew(const Expression& e, int x) {
  switch (e.kind()) {
    case NodeKind::identity: return x;
    case NodeKind::zero: {
      Step s{StepKind::zero};
      s.text = "0";
      return emit_vector(std::move(s), e.codomain(), x);
    }
    case NodeKind::symbol: return apply_symbol(e, false, false, x);
    case NodeKind::transpose: {
      const Expression& inner = e.children()[0];
      return inner.kind() == NodeKind::symbol ? apply_symbol(inner, true, false, x) : apply_given(e, inner, true, x);
    }
    case NodeKind::vector:
    case NodeKind::constant:
    case NodeKind::external: return apply_given(e, e, false, x);
    case NodeKind::scaled: {
      Step s{StepKind::combine};
      s.in = {apply(e.children()[0], x)};
      s.coefficients = {e.node().coefficient};
      s.flops = e.codomain().dimension();
      s.text = shown(e.node().coefficient * identity());
      return emit_vector(std::move(s), e.codomain(), x);
    }
    case NodeKind::sum: return apply_sum(e, x);
    case NodeKind::product: return apply_product(e.children(), x);
    case NodeKind::inverse: return apply_inverse(e, x);
    case NodeKind::block_diagonal:
    case NodeKind::block_function:
    case NodeKind::square_root: break;
  }
  return apply_blocks(blocks(e), false, x, shown(e));
}

// A user's vector, constant or operator, or the transpose e of it.
int Planner::apply_given(const Expression& e, const Expression& given, bool transposed, int x) {
  Step s{StepKind::apply_external};
  s.transposed = transposed;
  s.text = shown(e);
  if (given.kind() == NodeKind::vector) {
    s.kind = StepKind::apply_column;
    s.in = {vector_value(given), x};
    s.flops = 2.0 * given.codomain().dimension();
  } else if (given.kind() == NodeKind::constant && given.node().constant->blocks.empty()) {
    s.kind = StepKind::apply_constant;
    s.in = {x};
    s.constant = given.node().constant;
    s.flops = 2.0 * e.domain().dimension() * e.codomain().dimension();
  } else if (given.kind() == NodeKind::external) {
    s.in = {x};
    s.external = given.node().external;
  } else {
    return apply_blocks(blocks(e), false, x, s.text);
  }
  return emit_vector(std::move(s), e.codomain(), x);
}

// The register of a vector in `space`, as wide as register x.
int Planner::emit_vector(Step s, const Space& space, int x) {
  if (s.bytes == 0) s.bytes = vector_bytes(space);
  return emit(std::move(s), {RegisterKind::vector, space, {}, nullptr, plan_.registers[x].wide});
}

// Whether the source's own numbers serve ℳ⁻¹: in double, in the form fast, unrefined. What is part of another plan knows not what that asks for.
bool Planner::inverse_by_itself(const Symbol& model) const {
  if (part_ || whole_ || more_digits_ || !model.source->inverse_by_itself()) return false;
  if (!model.binding) return true;
  const Arithmetic& how = model.binding->arithmetic;
  return how.form == Form::fast && how.precision == Precision::double_ && how.refinement.steps == 0;
}

// A kernel of a whole model's ℳ or ℳ⁻¹ on a vector: HφMφ*H*, with J where it is asked for, or its inverse.
int Planner::emit_kernel(StepKind kind, const Symbol& model, bool with_J, int x, const char* text) {
  const bool solves = kind == StepKind::mass_matrix_solve;
  Step s{kind};
  s.in = {x};
  s.flag = solves ? inverse_by_itself(model) : with_J;
  s.context = context_of(model, !solves ? Group::kinematics : s.flag ? Group::inverse : Group::kinematics | Group::articulated);
  s.flops = mass_matrix_flops(*model.source, solves);
  s.bytes = vector_bytes(model.source->theta()) + vector_bytes(model.source->motions());
  s.tier = 1;
  s.text = text;
  return emit_vector(std::move(s), model.source->theta(), x);
}

// How many of the factors that end at `end` are a kernel's; x becomes the register of what it makes.
size_t Planner::apply_kernel(const std::vector<Expression>& factors, size_t end, int& x) {
  if (const Symbol* model = end < mass_matrix_factors ? nullptr : mass_matrix_model(factors, end - mass_matrix_factors)) {
    x = emit_kernel(StepKind::mass_matrix, *model, false, x, "HφMφ*H* (Newton-Euler at rest: base to tip, tip to base)");
    return mass_matrix_factors;
  }
  if (end < 3 || factors[end - 1].kind() != NodeKind::sum || factors[end - 2].kind() != NodeKind::inverse || factors[end - 3].kind() != NodeKind::sum) return 0;
  for (const Expression& t : factors[end - 1].children()) {
    const Scaled part = split_scalar(t);
    if (part.expression.kind() != NodeKind::product || !is_symbol(part.expression.children()[0], SymbolId::H)) continue;
    const Symbol& h = part.expression.children()[0].node().symbol;
    const std::vector<Expression> inverse = mass_matrix_inverse_of(h);
    if (!ends_with(factors, end, inverse)) continue;
    x = emit_kernel(StepKind::mass_matrix_solve, h, false, x, "[I-HψK]* D⁻¹ [I-HψK] (tip to base, base to tip)");
    return inverse.size();
  }
  return 0;
}

int Planner::apply_product(const std::vector<Expression>& typed, int x) {
  const std::vector<Expression> factors = options_.rules ? gathered_by_psi(typed) : typed;
  size_t end = factors.size();
  while (end > 0) {
    const size_t taken = options_.rules ? apply_kernel(factors, end, x) : 0;
    if (taken)
      end -= taken;
    else
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
      const int y = emit_kernel(StepKind::mass_matrix, whole.model, true, x, "HφMφ*H* + J (Newton-Euler at rest: base to tip, tip to base)");
      parts.emplace_back(whole.coefficient, y);
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
  s.text = parts.size() == 1 ? "scale" : "sum of " + std::to_string(parts.size()) + " terms";
  return emit_vector(std::move(s), e.codomain(), x);
}

int Planner::apply_symbol(const Expression& e, bool transposed, bool inverted, int x) {
  const Symbol& symbol = e.node().symbol;
  const SymbolDefinition& d = *symbol.definition;
  const Space domain = inverted ? (transposed ? e.domain().dual() : e.codomain()) : (transposed ? e.codomain().dual() : e.domain());
  const Space codomain = inverted ? (transposed ? e.codomain().dual() : e.domain()) : (transposed ? e.domain().dual() : e.codomain());
  const std::string text = shown(e) + (transposed ? "*" : "") + (inverted ? "⁻¹" : "");
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
      return emit_vector(std::move(s), codomain, x);
    }
    case Pattern::resolvent: {
      Step s{transposed ? StepKind::scatter : StepKind::gather};
      s.in = {x};
      s.symbol = symbol;
      s.context = context_of(symbol, d.groups);
      s.flops = resolvent_flops(symbol);
      s.bytes = vector_bytes(codomain);
      s.text = text + (transposed ? " (base to tip)" : " (tip to base)");
      return emit_vector(std::move(s), codomain, x);
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
  return emit_vector(std::move(s), codomain, x);
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
  return emit_vector(std::move(s), space, x);
}

int Planner::vector_value(const Expression& e) {
  const auto known = block_memo_.find(id_of(e));
  if (known != block_memo_.end()) return known->second;
  int r;
  if (e.kind() == NodeKind::vector) {
    r = named_vector(e.node().name, e.codomain());
  } else {
    const Symbol& symbol = e.node().symbol;
    Step s{StepKind::vector_symbol};
    s.symbol = symbol;
    s.context = context_of(symbol, symbol.definition->groups);
    s.bytes = vector_bytes(e.codomain());
    s.text = shown(e);
    r = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, false});
  }
  block_memo_[id_of(e)] = r;
  return r;
}

int Planner::named_vector(const std::string& name, const Space& space) {
  const auto found = plan_.vectors.find(name);
  if (found == plan_.vectors.end()) return plan_.vectors[name] = new_register(RegisterKind::vector, space, {}, false);
  const Space& known = plan_.registers[found->second].space;
  if (!(known == space)) throw SpaceError("vector '" + name + "' is used in two spaces, " + known.description() + " and " + space.description());
  return found->second;
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
      s.text = shown(e);
      r = emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, false});
      break;
    }
    case NodeKind::product: {
      const auto& f = e.children();
      r = apply_product(std::vector<Expression>(f.begin(), f.end() - 1), column(f.back()));
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
      s.text = shown(e);
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
  return emit_vector(std::move(s), out, x);
}

}  // namespace pycraft
