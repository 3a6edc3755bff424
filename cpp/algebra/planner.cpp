#include "algebra/planner.h"

#include <algorithm>
#include <cmath>

#include "algebra/errors.h"
#include "algebra/lower.h"
#include "algebra/polynomial.h"
#include "algebra/properties.h"

namespace pycraft {

namespace {

bool is_symbol(const Expression& e, SymbolId id) { return e.kind() == NodeKind::symbol && e.node().symbol.definition->id == id; }

// A symbol or its transpose.
const Symbol* letter_of(const Expression& e, bool& transposed) {
  transposed = e.kind() == NodeKind::transpose;
  const Expression& inner = transposed ? e.children()[0] : e;
  return inner.kind() == NodeKind::symbol ? &inner.node().symbol : nullptr;
}

bool same_model(const Symbol& a, const Symbol& b) { return a.source == b.source && a.binding == b.binding; }

bool ends_with(const std::vector<Expression>& factors, size_t end, const std::vector<Expression>& tail) {
  if (end < tail.size()) return false;
  for (size_t i = 0; i < tail.size(); ++i)
    if (factors[end - tail.size() + i] != tail[i]) return false;
  return true;
}

double block_entries(const Space& rows, const Space& columns) {
  double sum = 0;
  for (size_t k = 0; k < rows.layout().of_body.size(); ++k) sum += double(rows.body_size(k)) * columns.body_size(k);
  return sum;
}

double block_product_flops(const Space& rows, const Space& middle, const Space& columns) {
  double sum = 0;
  for (size_t k = 0; k < rows.layout().of_body.size(); ++k) sum += 2.0 * rows.body_size(k) * middle.body_size(k) * columns.body_size(k);
  return sum;
}

}  // namespace

// ------------------------------------------------------------------ registers and steps

int Planner::new_register(RegisterKind kind, const Space& rows, const Space& columns, bool wide) {
  plan_.registers.push_back({kind, rows, columns, nullptr, wide});
  return static_cast<int>(plan_.registers.size()) - 1;
}

int Planner::emit(Step step, Register out) {
  plan_.registers.push_back(std::move(out));
  step.out = static_cast<int>(plan_.registers.size()) - 1;
  step.symbol.binding = nullptr;  // the context holds it
  plan_.steps.push_back(std::move(step));
  return plan_.steps.back().out;
}

int Planner::context_of(const Symbol& symbol, unsigned groups) {
  const Context wanted{symbol.source, symbol.binding};
  auto found = std::find(plan_.contexts.begin(), plan_.contexts.end(), wanted);
  if (found == plan_.contexts.end()) {
    plan_.contexts.push_back(wanted);
    plan_.groups.push_back(0);
    plan_.hinge_diagonal.push_back(symbol.source->traits().hinge_diagonal);
    found = plan_.contexts.end() - 1;
  }
  const int c = static_cast<int>(found - plan_.contexts.begin());
  plan_.groups[c] |= groups;
  return c;
}

int Planner::id_of(const Expression& e) { return ids_.try_emplace(e, static_cast<int>(ids_.size())).first->second; }

// The sweeps that make the values go in front; a run skips those that are cached.
void Planner::emit_values() {
  std::vector<Step> front;
  for (size_t c = 0; c < plan_.contexts.size(); ++c) {
    const std::pair<unsigned, const char*> names[] = {{Group::kinematics, "E, H, M, J"},
                                                      {Group::articulated, "P, D, G (Riccati sweep, tip to base)"},
                                                      {Group::composite, "R (composite-body sweep, tip to base)"},
                                                      {Group::compliance, "Υ (Lyapunov sweep, base to tip)"},
                                                      {Group::velocities, "velocities (base to tip)"}};
    for (const auto& [group, text] : names) {
      if (!(plan_.groups[c] & group)) continue;
      Step s{StepKind::values};
      s.context = static_cast<int>(c);
      s.groups = group;
      s.flops = group_flops(*plan_.contexts[c].source, group);
      s.bytes = group_bytes(*plan_.contexts[c].source, group);
      s.tier = 0;
      s.text = text;
      front.push_back(s);
    }
  }
  plan_.steps.insert(plan_.steps.begin(), front.begin(), front.end());
}

// ------------------------------------------------------------------ vectors

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
    case NodeKind::square_root: y = apply_blocks(blocks(e), false, x, show(e)); break;
  }
  vector_memo_[key] = y;
  return y;
}

int Planner::apply_product(const std::vector<Expression>& factors, int x, const Expression&) {
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
  std::vector<std::pair<double, int>> parts;
  if (options_.rules)
    for (size_t i = 0; i < e.children().size(); ++i) {
      const Scaled a = split_scalar(e.children()[i]);
      if (a.expression.kind() != NodeKind::product || !is_symbol(a.expression.children()[0], SymbolId::H)) continue;
      const Symbol& h = a.expression.children()[0].node().symbol;
      if (a.expression.children() != kernels_of(h).mass_matrix) continue;
      for (size_t j = 0; j < e.children().size(); ++j) {
        const Scaled b = split_scalar(e.children()[j]);
        if (used[j] || !is_symbol(b.expression, SymbolId::J) || !same_model(b.expression.node().symbol, h) || b.coefficient != a.coefficient) continue;
        Step s{StepKind::mass_matrix};
        s.in = {x};
        s.flag = true;
        s.context = context_of(h, Group::kinematics);
        s.flops = mass_matrix_flops(*h.source, false);
        s.bytes = vector_bytes(h.source->theta()) + vector_bytes(h.source->motions());
        s.tier = 1;
        s.text = "HφMφ*H* + J (Newton-Euler at rest: base to tip, tip to base)";
        parts.emplace_back(a.coefficient, emit(std::move(s), {RegisterKind::vector, e.codomain(), {}, nullptr, plan_.registers[x].wide}));
        used[i] = used[j] = 1;
        break;
      }
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
    case Pattern::compound: return apply(lower(transposed ? d.expand(symbol).T() : d.expand(symbol), true), x);
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
  if (d.id >= first_extra) return apply_blocks(blocks(transposed ? e.T() : e), false, x, text);
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

int Planner::solve_dense(const Expression& operand, int x, const std::string& reason) {
  plan_.notes.push_back("dense: " + reason);
  const double n = operand.domain().dimension();
  Step f{StepKind::dense_factor};
  f.operand = std::make_shared<const Plan>(Planner(options_).plan(operand, Request::apply));
  for (const Context& c : f.operand->contexts) context_of(Symbol{nullptr, c.source, c.binding, {}, {}}, f.operand->groups[&c - f.operand->contexts.data()]);
  f.flops = 2 * n * n * n / 3 + n * f.operand->flops();
  f.bytes = 8 * n * n;
  f.tier = 4;
  f.text = show(operand) + " made dense and factored: " + reason;
  const int factor = emit(std::move(f), {RegisterKind::dense, operand.codomain(), operand.domain(), nullptr, false});
  if (x < 0) return factor;
  Step s{StepKind::dense_solve};
  s.in = {factor, x};
  s.flops = 2 * n * n;
  s.bytes = 8 * n;
  s.tier = 4;
  s.text = "(" + show(operand) + ")⁻¹ by the dense factors";
  return emit(std::move(s), {RegisterKind::vector, operand.domain(), {}, nullptr, plan_.registers[x].wide});
}

// ------------------------------------------------------------------ blocks

int Planner::multiply_blocks(int a, int b) {
  const Register x = plan_.registers[a], y = plan_.registers[b];
  Step s{StepKind::multiply_blocks};
  s.in = {a, b};
  s.flops = block_product_flops(x.space, x.columns, y.columns);
  s.bytes = 8 * block_entries(x.space, y.columns);
  s.text = "blocks: product";
  return emit(std::move(s), {RegisterKind::blocks, x.space, y.columns, nullptr, false});
}

int Planner::identity_blocks(const Space& rows, const Space& columns) {
  Step s{StepKind::identity_blocks};
  s.bytes = 8 * block_entries(rows, columns);
  s.text = "blocks: I";
  return emit(std::move(s), {RegisterKind::blocks, rows, columns, nullptr, false});
}

int Planner::zero_blocks(const Space& rows, const Space& columns) {
  Step s{StepKind::combine_blocks};
  s.bytes = 8 * block_entries(rows, columns);
  s.text = "blocks: 0";
  return emit(std::move(s), {RegisterKind::blocks, rows, columns, nullptr, false});
}

int Planner::blocks(const Expression& e) {
  const int key = id_of(e);
  const auto known = block_memo_.find(key);
  if (known != block_memo_.end()) return known->second;
  const double entries = block_entries(e.codomain(), e.domain());
  const Register out{RegisterKind::blocks, e.codomain(), e.domain(), nullptr, false};
  int r = -1;
  switch (e.kind()) {
    case NodeKind::identity: r = identity_blocks(e.codomain(), e.domain()); break;
    case NodeKind::zero: r = zero_blocks(e.codomain(), e.domain()); break;
    case NodeKind::symbol: {
      const Symbol& symbol = e.node().symbol;
      if (symbol.definition->pattern == Pattern::compound) {
        r = blocks(lower(symbol.definition->expand(symbol), true));
        break;
      }
      Step s{StepKind::load_blocks};
      s.symbol = symbol;
      s.context = context_of(symbol, symbol.definition->groups);
      s.bytes = 8 * entries;
      s.text = "blocks: " + show(e);
      r = emit(std::move(s), out);
      break;
    }
    case NodeKind::constant: {
      Step s{StepKind::load_blocks};
      s.constant = e.node().constant;
      s.bytes = 8 * entries;
      s.text = "blocks: " + show(e);
      r = emit(std::move(s), out);
      break;
    }
    case NodeKind::transpose: {
      const Expression& inner = e.children()[0];
      if (inner.kind() == NodeKind::symbol && inner.node().symbol.definition->pattern == Pattern::compound) {
        r = blocks(lower(e, true));
        break;
      }
      Step s{StepKind::transpose_blocks};
      s.in = {blocks(inner)};
      s.bytes = 8 * entries;
      s.text = "blocks: transpose";
      r = emit(std::move(s), out);
      break;
    }
    case NodeKind::scaled:
    case NodeKind::sum: {
      Step s{StepKind::combine_blocks};
      const std::vector<Expression> terms = e.kind() == NodeKind::sum ? e.children() : std::vector<Expression>{e};
      for (const Expression& t : terms) {
        const Scaled part = split_scalar(t);
        s.in.push_back(blocks(part.expression));
        s.coefficients.push_back(part.coefficient);
      }
      s.flops = 2 * entries * terms.size();
      s.bytes = 8 * entries;
      s.text = "blocks: " + show(e);
      r = emit(std::move(s), out);
      break;
    }
    case NodeKind::product: {
      bool t = false;
      const Symbol* first = letter_of(e.children().front(), t);
      if (first && first->definition->pattern == Pattern::edges && !t) {  // E X E*
        const std::vector<Expression> inside(e.children().begin() + 1, e.children().end() - 1);
        Step s{StepKind::congruence_blocks};
        s.in = {blocks(product_of(inside))};
        s.context = context_of(*first, Group::kinematics);
        s.symbol = *first;
        s.flops = group_flops(*first->source, Group::composite);
        s.bytes = 8 * entries;
        s.text = "blocks: " + show(e) + " (tip to base)";
        r = emit(std::move(s), out);
        break;
      }
      r = blocks(e.children()[0]);
      for (size_t i = 1; i < e.children().size(); ++i) r = multiply_blocks(r, blocks(e.children()[i]));
      break;
    }
    case NodeKind::inverse: {
      Step s{StepKind::invert_blocks};
      s.in = {blocks(e.children()[0])};
      s.flops = block_product_flops(e.codomain(), e.codomain(), e.domain());
      s.bytes = 8 * entries;
      s.text = "blocks: " + show(e);
      r = emit(std::move(s), out);
      break;
    }
    case NodeKind::square_root: {
      Step s{StepKind::root_blocks};
      s.in = {blocks(e.children()[0])};
      s.flops = block_product_flops(e.codomain(), e.codomain(), e.domain()) / 6;
      s.bytes = 8 * entries;
      s.text = "blocks: " + show(e);
      r = emit(std::move(s), out);
      break;
    }
    case NodeKind::block_diagonal: r = diagonal_blocks(e.children()[0]); break;
    default: throw EvaluationError(show(e) + " has no blocks");
  }
  block_memo_[key] = r;
  return r;
}

// ------------------------------------------------------------------ diagonal blocks, determinants

std::optional<int> Planner::diagonal_by_structure(const Expression& e) {
  if (is_block_diagonal(e)) return blocks(e);
  switch (e.kind()) {
    case NodeKind::symbol:
    case NodeKind::transpose: {
      bool t = false;
      const Symbol* symbol = letter_of(e, t);
      if (!symbol) return std::nullopt;
      if (symbol->definition->pattern == Pattern::resolvent) return identity_blocks(e.codomain(), e.domain());
      if (symbol->definition->pattern == Pattern::edges) return zero_blocks(e.codomain(), e.domain());
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
      s.bytes = 8 * block_entries(e.codomain(), e.domain());
      s.text = "blocks: blockdiag(" + show(e) + ")";
      return emit(std::move(s), {RegisterKind::blocks, e.codomain(), e.domain(), nullptr, false});
    }
    case NodeKind::inverse: {
      const Expression& inner = e.children()[0];
      if (!is_upper_triangular(inner) && !is_lower_triangular(inner)) return std::nullopt;
      const auto r = diagonal_by_structure(inner);
      if (!r) return std::nullopt;
      Step s{StepKind::invert_blocks};
      s.in = {*r};
      s.flops = block_product_flops(e.codomain(), e.codomain(), e.domain());
      s.bytes = 8 * block_entries(e.codomain(), e.domain());
      s.text = "blocks: blockdiag(" + show(e) + ")";
      return emit(std::move(s), {RegisterKind::blocks, e.codomain(), e.domain(), nullptr, false});
    }
    case NodeKind::product: {
      const auto& f = e.children();
      if (is_upper_triangular(e) || is_lower_triangular(e)) {
        bool each = true;  // a triangular product is the product of triangular factors unless E ... E* met inside
        for (const Expression& x : f) each &= is_upper_triangular(e) ? is_upper_triangular(x) : is_lower_triangular(x);
        if (!each) return std::nullopt;
        std::optional<int> r;
        for (const Expression& x : f) {
          const auto d = diagonal_by_structure(x);
          if (!d) return std::nullopt;
          r = r ? multiply_blocks(*r, *d) : *d;
        }
        return r;
      }
      // A φ X φ* B with A, X, B block diagonal: a Lyapunov sweep.
      size_t i = 0;
      while (i < f.size() && is_block_diagonal(f[i])) ++i;
      size_t j = f.size();
      while (j > i && is_block_diagonal(f[j - 1])) --j;
      if (j < i + 2) return std::nullopt;
      bool left_t = false, right_t = false;
      const Symbol *left = letter_of(f[i], left_t), *right = letter_of(f[j - 1], right_t);
      if (!left || !right || left->definition != right->definition || left->definition->pattern != Pattern::resolvent || !same_model(*left, *right) ||
          left_t == right_t)
        return std::nullopt;
      for (size_t k = i + 1; k + 1 < j; ++k)
        if (!is_block_diagonal(f[k])) return std::nullopt;
      int middle;
      if (j == i + 2) {
        middle = identity_blocks(f[i].domain(), f[j - 1].codomain());
      } else {
        middle = blocks(product_of(std::vector<Expression>(f.begin() + i + 1, f.begin() + j - 1)));
      }
      Step s{StepKind::lyapunov_blocks};
      s.in = {middle};
      s.symbol = *left;
      s.transposed = left_t;
      s.context = context_of(*left, left->definition->groups);
      s.flops = group_flops(*left->source, Group::composite) * (left->definition->id == SymbolId::psi ? 2 : 1);
      s.bytes = 8 * block_entries(f[i].codomain(), f[j - 1].domain());
      s.text = "blocks: blockdiag(" + show(product_of(std::vector<Expression>(f.begin() + i, f.begin() + j))) + ")" +
               (left_t ? " (base to tip)" : " (tip to base)");
      int r = emit(std::move(s), {RegisterKind::blocks, f[i].codomain(), f[j - 1].domain(), nullptr, false});
      if (i > 0) r = multiply_blocks(blocks(product_of(std::vector<Expression>(f.begin(), f.begin() + i))), r);
      if (j < f.size()) r = multiply_blocks(r, blocks(product_of(std::vector<Expression>(f.begin() + j, f.end()))));
      return r;
    }
    default: return std::nullopt;
  }
}

int Planner::diagonal_blocks(const Expression& e) {
  // Attempts that fail leave steps behind that nothing reads: drop_unused removes them.
  if (const auto r = diagonal_by_structure(e)) return *r;
  std::string reason;
  const auto realization = build_realization(*this, e, true, reason);
  if (realization) {
    Step f{StepKind::factor};
    f.realization = realization;
    f.flops = realization->factor_flops();
    f.bytes = 8 * realization->entries();
    f.tier = 3;
    f.text = "eliminate " + show(e) + " over the tree, leaves to root";
    const int factor = emit(std::move(f), {RegisterKind::factor, {}, {}, realization, false});
    Step s{StepKind::selected_blocks};
    s.in = {factor};
    s.realization = realization;
    s.flops = 2 * realization->factor_flops();
    s.bytes = 8 * realization->entries();
    s.tier = 3;
    s.text = "blocks: blockdiag(" + show(e) + ") from the factors, root to leaves";
    return emit(std::move(s), {RegisterKind::blocks, e.codomain(), e.domain(), nullptr, false});
  }
  plan_.notes.push_back("dense: " + reason);
  Step s{StepKind::blocks_of_dense};
  s.operand = std::make_shared<const Plan>(Planner(options_).plan(e, Request::apply));
  for (size_t c = 0; c < s.operand->contexts.size(); ++c)
    context_of(Symbol{nullptr, s.operand->contexts[c].source, s.operand->contexts[c].binding, {}, {}}, s.operand->groups[c]);
  s.flops = e.domain().dimension() * s.operand->flops();
  s.bytes = 8.0 * e.domain().dimension() * e.codomain().dimension();
  s.tier = 4;
  s.text = "blocks: blockdiag(" + show(e) + ") column by column: " + reason;
  return emit(std::move(s), {RegisterKind::blocks, e.codomain(), e.domain(), nullptr, false});
}

std::optional<int> Planner::logdet_by_structure(const Expression& e) {
  const Register scalar{RegisterKind::scalar, {}, {}, nullptr, false};
  const auto combine = [&](std::vector<int> in, std::vector<double> c, const std::string& text, double constant) {
    Step s{StepKind::combine_scalars};
    s.in = std::move(in);
    s.coefficients = std::move(c);
    s.coefficients.push_back(constant);
    s.text = text;
    return emit(std::move(s), scalar);
  };
  switch (e.kind()) {
    case NodeKind::identity: return combine({}, {}, "ln det I = 0", 0);
    case NodeKind::scaled: {
      const auto r = logdet_by_structure(e.children()[0]);
      if (!r) return std::nullopt;
      return combine({*r}, {1.0}, "ln det of a multiple", e.domain().dimension() * std::log(std::abs(e.node().coefficient)));
    }
    case NodeKind::inverse: {
      const auto r = logdet_by_structure(e.children()[0]);
      if (!r) return std::nullopt;
      return combine({*r}, {-1.0}, "ln det of an inverse", 0);
    }
    case NodeKind::product: {
      std::vector<int> parts;
      bool square = true;
      for (const Expression& f : e.children()) square &= f.domain().dimension() == f.codomain().dimension();
      if (square) {
        for (const Expression& f : e.children()) {
          const auto r = logdet_by_structure(f);
          if (!r) break;
          parts.push_back(*r);
        }
        if (parts.size() == e.children().size()) return combine(parts, std::vector<double>(parts.size(), 1.0), "ln det of a product", 0);
      }
      break;
    }
    default: break;
  }
  if (e.kind() == NodeKind::symbol && e.node().symbol.definition->id == SymbolId::D) {
    const Symbol& symbol = e.node().symbol;
    Step s{StepKind::logdet_of_D};
    s.symbol = symbol;
    s.context = context_of(symbol, symbol.definition->groups);
    s.flops = 10.0 * symbol.source->structure().coordinates();
    s.text = "Σ ln det D(k)";
    return emit(std::move(s), scalar);
  }
  if (!e.domain().belongs_to_bodies() || !e.codomain().belongs_to_bodies()) return std::nullopt;
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

int Planner::logdet(const Expression& e) {
  if (const auto r = logdet_by_structure(e)) return *r;
  const Register scalar{RegisterKind::scalar, {}, {}, nullptr, false};
  std::string reason;
  const auto system = build_realization(*this, lower(e.inv(), false), false, reason);
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
    f.text = std::string("eliminate the realization of ") + show(e) + (realization == system ? " closed, leaves to root" : " itself");
    const int factor = emit(std::move(f), {RegisterKind::factor, {}, {}, realization, false});
    Step s{StepKind::logdet_of_factor};
    s.in = {factor};
    s.flops = 10.0 * e.domain().dimension();
    s.tier = 3;
    s.text = "ln|det| from the pivots";
    parts.push_back(emit(std::move(s), scalar));
  }
  Step s{StepKind::combine_scalars};
  s.in = parts;
  s.coefficients = {1.0, -1.0, 0.0};
  s.tier = 3;
  s.text = "ln|det| of " + show(e);
  return emit(std::move(s), scalar);
}

// ------------------------------------------------------------------ requests

namespace {

// Steps whose result nobody reads (left by attempts that a better way overtook) go.
void drop_unused(Plan& plan) {
  std::vector<char> needed(plan.registers.size(), 0);
  if (plan.output >= 0) needed[plan.output] = 1;
  std::vector<Step> kept;
  for (auto s = plan.steps.rbegin(); s != plan.steps.rend(); ++s) {
    if (s->out >= 0 && !needed[s->out]) continue;
    for (int r : s->in) needed[r] = 1;
    if (s->realization) {
      for (const auto* terms : {&s->realization->terms, &s->realization->inputs, &s->realization->outputs})
        for (const Realization::Term& t : *terms)
          for (int r : {t.left, t.right})
            if (r >= 0) needed[r] = 1;
    }
    kept.push_back(*s);
  }
  plan.steps.assign(kept.rbegin(), kept.rend());
}

}  // namespace

Plan Planner::plan(const Expression& typed, Request request) {
  plan_ = Plan{};
  plan_.request = request;
  plan_.text = show(typed);
  typed.check_current();
  Expression e = lower(typed, false);
  if (options_.rules) e = optimise(e, plan_.notes);
  plan_.domain = e.domain();
  plan_.codomain = e.codomain();
  const bool bodies = e.domain().belongs_to_bodies() && e.codomain().belongs_to_bodies() &&
                      e.domain().layout().of_body.size() == e.codomain().layout().of_body.size();
  const auto apply_to_input = [&] {
    plan_.input = new_register(RegisterKind::vector, e.domain(), {}, true);
    plan_.output = apply(e, plan_.input);
  };
  switch (request) {
    case Request::apply: apply_to_input(); break;
    case Request::dense: {
      const Scaled whole = split_scalar(e);
      if (bodies && is_block_diagonal(e)) {
        Step s{StepKind::gather_blocks};
        s.in = {blocks(e)};
        s.bytes = 8.0 * e.domain().dimension() * e.codomain().dimension();
        s.text = "blocks as a matrix";
        plan_.output = emit(std::move(s), {RegisterKind::dense, e.codomain(), e.domain(), nullptr, false});
        break;
      }
      const Expression* h = nullptr;
      bool with_J = false;
      const auto is_mass_matrix = [](const Expression& x) {
        return x.kind() == NodeKind::product && is_symbol(x.children()[0], SymbolId::H) &&
               x.children() == kernels_of(x.children()[0].node().symbol).mass_matrix;
      };
      if (options_.rules && is_mass_matrix(e)) h = &e.children()[0];
      if (options_.rules && e.kind() == NodeKind::sum && e.children().size() == 2)
        for (int i : {0, 1})
          if (is_mass_matrix(e.children()[i]) && is_symbol(e.children()[1 - i], SymbolId::J) &&
              same_model(e.children()[i].children()[0].node().symbol, e.children()[1 - i].node().symbol)) {
            h = &e.children()[i].children()[0];
            with_J = true;
          }
      if (h) {
        const Symbol& symbol = h->node().symbol;
        Step s{StepKind::mass_matrix_dense};
        s.flag = with_J;
        s.context = context_of(symbol, Group::kinematics | Group::composite);
        s.flops = mass_matrix_dense_flops(*symbol.source);
        s.bytes = 8.0 * e.domain().dimension() * e.codomain().dimension();
        s.tier = 1;
        s.text = "composite-body assembly of HφMφ*H*";
        plan_.output = emit(std::move(s), {RegisterKind::dense, e.codomain(), e.domain(), nullptr, false});
        break;
      }
      plan_.columns_of_identity = true;
      apply_to_input();
      break;
    }
    case Request::block_diagonal:
    case Request::diagonal:
    case Request::trace: {
      const char* what = request == Request::trace ? "trace" : "diagonal";
      if (!bodies) {
        plan_.columns_of_identity = true;
        apply_to_input();
        break;
      }
      const int b = diagonal_blocks(e);
      if (request == Request::block_diagonal) {
        plan_.output = b;
        break;
      }
      if (e.domain().dimension() != e.codomain().dimension())
        throw SpaceError(std::string(what) + " of " + show(typed) + ": it maps " + e.domain().description() + " to " + e.codomain().description());
      Step s{request == Request::trace ? StepKind::trace_of_blocks : StepKind::diagonal_of_blocks};
      s.in = {b};
      s.text = what;
      plan_.output = emit(std::move(s), {request == Request::trace ? RegisterKind::scalar : RegisterKind::vector, e.codomain(), {}, nullptr, false});
      break;
    }
    case Request::logdet: plan_.output = logdet(e); break;
    case Request::norm: {
      // Small or tall operators column by column; long ones as tr(X*X) over the tree.
      if (e.domain().dimension() > 600 && bodies) {
        const Expression square = lower(e.T() * e, false);
        std::string reason;
        if (is_block_diagonal(e) || build_realization(*this, square, true, reason)) {
          Step s{StepKind::root_of_trace};
          s.in = {diagonal_blocks(square)};
          s.text = "norm from tr(X*X)";
          plan_.output = emit(std::move(s), {RegisterKind::scalar, {}, {}, nullptr, false});
          break;
        }
      }
      plan_.columns_of_identity = true;
      apply_to_input();
      Step s{StepKind::norm_of_vector};
      s.in = {plan_.output};
      s.text = "norm, columns of the identity some at a time";
      plan_.output = emit(std::move(s), {RegisterKind::scalar, {}, {}, nullptr, false});
      break;
    }
  }
  drop_unused(plan_);
  emit_values();
  for (const Context& c : plan_.contexts) {
    if (!c.binding) continue;
    if (c.binding->batch >= 0) {
      if (plan_.batched && plan_.batch != c.binding->batch)
        throw EvaluationError("batches of " + std::to_string(plan_.batch) + " and " + std::to_string(c.binding->batch) + " states in one expression");
      plan_.batched = true;
      plan_.batch = c.binding->batch;
    }
  }
  bool first = true;
  for (const Context& c : plan_.contexts) {
    const Precision p = c.binding ? c.binding->precision : Precision::double_;
    if (!c.binding) continue;
    if (!first && p != plan_.precision) throw EvaluationError("two precisions in one expression: bind all of it with one .at(..., precision=...)");
    plan_.precision = p;
    first = false;
  }
  return std::move(plan_);
}

std::shared_ptr<const Plan> make_plan(const Expression& e, Request request, const PlanOptions& options) {
  return std::make_shared<const Plan>(Planner(options).plan(e, request));
}

double Plan::flops() const {
  double sum = 0;
  for (const Step& s : steps) sum += s.flops;
  return sum;
}

double Plan::bytes() const {
  double sum = 0;
  for (const Step& s : steps) sum += s.bytes;
  return sum;
}

bool Plan::has_dense_step() const {
  return std::any_of(steps.begin(), steps.end(), [](const Step& s) { return s.tier == 4; });
}

}  // namespace pycraft
