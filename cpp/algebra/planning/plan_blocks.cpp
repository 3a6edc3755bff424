// Steps that make the blocks of a block-diagonal expression, body by body.
#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/language/properties.h"
#include "algebra/planning/costs.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/planning.h"
#include "runtime/errors.h"

namespace pycraft {

using namespace planning;

int Planner::multiply_blocks(int a, int b) {
  const auto known = block_product_memo_.find({a, b});
  if (known != block_product_memo_.end()) return known->second;
  const Register x = plan_.registers[a], y = plan_.registers[b];
  Step s{StepKind::multiply_blocks};
  s.in = {a, b};
  s.flops = block_product_flops(x.space, x.columns, y.columns);
  s.bytes = 8 * block_entries(x.space, y.columns);
  s.text = "blocks: product";
  return block_product_memo_[{a, b}] = emit(std::move(s), {RegisterKind::blocks, x.space, y.columns, nullptr, false});
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

// The register of the blocks of e that a step makes.
int Planner::emit_blocks(Step s, const Expression& e, const std::string& text) {
  s.bytes = 8 * block_entries(e.codomain(), e.domain());
  s.text = "blocks: " + text;
  return emit(std::move(s), {RegisterKind::blocks, e.codomain(), e.domain(), nullptr, false});
}

int Planner::blocks(const Expression& e) {
  const int key = id_of(e);
  const auto known = block_memo_.find(key);
  if (known != block_memo_.end()) return known->second;
  return block_memo_[key] = blocks_anew(e);
}

int Planner::blocks_anew(const Expression& e) {
  switch (e.kind()) {
    case NodeKind::identity: return identity_blocks(e.codomain(), e.domain());
    case NodeKind::zero: return zero_blocks(e.codomain(), e.domain());
    case NodeKind::symbol: {
      const Symbol& symbol = e.node().symbol;
      if (symbol.definition->pattern == Pattern::compound) return blocks(lower(symbol.definition->expand(symbol), true));
      Step s{StepKind::load_blocks};
      s.symbol = symbol;
      s.context = context_of(symbol, symbol.definition->groups);
      return emit_blocks(std::move(s), e, shown(e));
    }
    case NodeKind::constant: {
      Step s{StepKind::load_blocks};
      s.constant = e.node().constant;
      return emit_blocks(std::move(s), e, shown(e));
    }
    case NodeKind::transpose: {
      const Expression& inner = e.children()[0];
      if (inner.kind() == NodeKind::symbol && inner.node().symbol.definition->pattern == Pattern::compound) return blocks(lower(e, true));
      Step s{StepKind::transpose_blocks};
      s.in = {blocks(inner)};
      return emit_blocks(std::move(s), e, "transpose");
    }
    case NodeKind::scaled:
    case NodeKind::sum: return blocks_of_sum(e);
    case NodeKind::product: return blocks_of_product(e);
    case NodeKind::inverse: {
      Step s{StepKind::invert_blocks};
      s.in = {blocks(e.children()[0])};
      s.flops = block_product_flops(e.codomain(), e.codomain(), e.domain());
      return emit_blocks(std::move(s), e, shown(e));
    }
    case NodeKind::square_root: {
      const Expression& inner = e.children()[0];  // block diagonal by structure, or by theorems
      Step s{StepKind::root_blocks};
      s.in = {is_block_diagonal(inner) ? blocks(inner) : diagonal_blocks(inner)};
      s.flops = block_product_flops(e.codomain(), e.codomain(), e.domain()) / 6;
      return emit_blocks(std::move(s), e, shown(e));
    }
    case NodeKind::block_function: return blocks_of_function(e);
    case NodeKind::block_diagonal: return diagonal_blocks(e.children()[0]);
    default: throw EvaluationError(show(e) + " has no blocks");
  }
}

int Planner::blocks_of_sum(const Expression& e) {
  Step s{StepKind::combine_blocks};
  const std::vector<Expression> terms = e.kind() == NodeKind::sum ? e.children() : std::vector<Expression>{e};
  for (const Expression& t : terms) {
    const Scaled part = split_scalar(t);
    s.in.push_back(blocks(part.expression));
    s.coefficients.push_back(part.coefficient);
  }
  s.flops = 2 * block_entries(e.codomain(), e.domain()) * terms.size();
  return emit_blocks(std::move(s), e, shown(e));
}

int Planner::blocks_of_product(const Expression& e) {
  bool t = false;
  const Symbol* first = letter_of(e.children().front(), t);
  if (first && first->definition->pattern == Pattern::edges && !t) {  // E X E*
    const std::vector<Expression> inside(e.children().begin() + 1, e.children().end() - 1);
    Step s{StepKind::congruence_blocks};
    s.in = {blocks(product_of(inside))};
    s.context = context_of(*first, Group::kinematics);
    s.symbol = *first;
    s.flops = group_flops(*first->source, Group::composite);
    return emit_blocks(std::move(s), e, shown(e) + " (tip to base)");
  }
  int r = blocks(e.children()[0]);
  for (size_t i = 1; i < e.children().size(); ++i) r = multiply_blocks(r, blocks(e.children()[i]));
  return r;
}

int Planner::blocks_of_function(const Expression& e) {
  const Symbol& symbol = e.node().symbol;
  const Expression& operand = e.children()[0];
  Step s{StepKind::function_blocks};
  s.symbol = symbol;
  if (symbol.source) s.context = context_of(symbol, Group::kinematics);
  s.in = {symbol.source ? column(operand) : blocks(operand)};
  return emit_blocks(std::move(s), e, shown(e));
}

}  // namespace pycraft
