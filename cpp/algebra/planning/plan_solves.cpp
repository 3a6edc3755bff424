// Steps that solve: inverses of blocks and letters, eliminated realizations, triangular factors of rows, dense matrices.
#include <algorithm>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/language/properties.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/planning.h"
#include "algebra/planning/recognise.h"
#include "algebra/planning/square_root.h"
#include "algebra/theorems/theorems.h"
#include "runtime/errors.h"

namespace pycraft {

using namespace planning;

int Planner::apply_inverse(const Expression& e, int x) {
  const Expression& inner = e.children()[0];
  bool transposed = false;
  if (const Symbol* symbol = letter_of(inner, transposed)) {
    if (symbol->definition->id == SymbolId::D) return apply_symbol(transposed ? inner.children()[0] : inner, false, true, x);
    if (symbol->definition->pattern == Pattern::resolvent && options_.rules) {  // φ⁻¹ = I - E, ψ⁻¹ = I - E_ψ
      const SymbolId edge = symbol->definition->id == SymbolId::phi ? SymbolId::E : SymbolId::E_psi;
      Expression edges = make_symbol(edge, symbol->source, symbol->binding);
      if (transposed) edges = edges.T();
      return apply(lower(identity() - edges, true), x);
    }
  }
  if (is_block_diagonal(e)) return apply_blocks(blocks(e), false, x, shown(e));
  if (const auto root = gram_root(inner)) {
    Step s{StepKind::dense_solve};
    s.in = {factor_gram(inner, *root), x};
    s.flops = 2.0 * inner.domain().dimension() * inner.domain().dimension();
    s.bytes = vector_bytes(e.codomain());
    s.tier = 1;
    s.text = shown(e) + " by its triangular factors";
    return emit_vector(std::move(s), e.codomain(), x);
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
  f.text = "eliminate " + shown(e) + " over the tree, leaves to root";
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
  s.text = shown(e) + " (leaves to root, root to leaves)";
  return emit_vector(std::move(s), e.codomain(), x);
}

// A plan of its own, whose values are computed with this one's.
std::shared_ptr<const Plan> Planner::plan_operand(const Expression& operand) {
  Planner planner(options_);
  planner.for_costs_ = for_costs_;
  planner.part_ = true;
  auto made = std::make_shared<const Plan>(planner.plan(operand, Request::apply));
  read_also(*made);
  return made;
}

void Planner::read_also(const Plan& operand) {
  for (size_t c = 0; c < operand.contexts.size(); ++c) context_of(Symbol{nullptr, operand.contexts[c].source, operand.contexts[c].binding, {}, {}}, operand.groups[c]);
  for (const auto& [name, r] : operand.vectors) named_vector(name, operand.registers[r].space);
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
  if (i + 2 < f.size() && f[i] == mass_matrix_inverse_of(D.node().symbol).back() && f[i + 1] == o.H && f[i + 2] == o.phi) {
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
  f.text = "X*X = " + shown(e) + ": triangular factors of X = " + shown(root);
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
  read_also(*f.operand);
  f.flops = 2 * n * n * n / 3 + n * f.operand->flops();
  f.bytes = 8 * n * n;
  f.tier = 4;
  f.text = shown(operand) + " made dense and factored: " + reason;
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
  s.text = "(" + shown(operand) + ")⁻¹ by the dense factors";
  return emit_vector(std::move(s), operand.domain(), x);
}

}  // namespace pycraft
