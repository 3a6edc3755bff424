// Solves with factors and their refinement: residuals in the same scalar, gathered, or one scalar up, by a twin of the workspace there.
#pragma once

#include "algebra/engine/workspace.h"

namespace pycraft {

// Of what spans several bindings: the most that one of them asks for.
template <class S>
Refinement Workspace<S>::refinement() const {
  Refinement r;
  for (const Context& c : plan_->contexts) {
    if (!c.binding) continue;
    const Refinement& own = c.binding->arithmetic.refinement;
    r.residual = std::max(r.residual, own.residual);
    r.steps = own.steps == Refinement::automatic || r.steps == Refinement::automatic ? Refinement::automatic : std::max(r.steps, own.steps);
  }
  return r;
}

// The values of this plan one scalar up, at the state of these.
template <class S>
void Workspace<S>::follow(const std::vector<SkoValues<S>*>& values) {
  if (!wide_) wide_ = std::make_unique<Workspace<Wider<S>>>(plan_);
  std::vector<std::uint64_t> now;
  for (const SkoValues<S>* v : values) now.push_back(v->generation());
  if (now == followed_) return;
  followed_.clear();  // an error may come before all are there
  followed_to_ = 0;
  wide_values_.resize(values.size());
  wide_at_.clear();
  for (size_t c = 0; c < values.size(); ++c) {
    const SkoSource& source = *plan_->contexts[c].source;
    const Binding* b = plan_->contexts[c].binding.get();
    if (!wide_values_[c]) {
      wide_values_[c] = source.make_values(Wider<S>());
      if (b) wide_values_[c]->use(b->arithmetic.form);
    }
    if (b) {
      const size_t at = b->batch < 0 ? 0 : size_t(state);
      wide_values_[c]->move_to(b->q.data() + at * b->nq, b->v.data() + at * b->nv);
    } else {
      const auto now = source.state();
      wide_values_[c]->move_to(now->q.data(), now->v.data());
    }
    wide_values_[c]->require(plan_->groups[c] | Group::kinematics);
    wide_at_.push_back(wide_values_[c].get());
  }
  wide_->state = state;
  wide_->values = wide_at_;
  followed_ = now;
}

// The steps before this one, in their order and no further: what stands behind it (another factorization, say) is not made in the narrow
// workspace yet.
template <class S>
void Workspace<S>::follow_steps(const Step& until) {
  const size_t end = size_t(&until - plan_->steps.data());
  for (const auto& [_, r] : plan_->vectors) convert(numbers(r), size_t(rows(r)), wide_->vectors_[r]);
  for (; followed_to_ < end; ++followed_to_) wide_->run_as(*this, plan_->steps[followed_to_]);
}

// Blocks, and what they are made of. Columns that functions of blocks take are computed, those that a solve or somebody else's operator
// makes are taken over.
template <class S>
template <class T>
void Workspace<S>::run_as(Workspace<T>& narrow, const Step& s) {
  if (s.out < 0) return;
  PassCounts counts;
  const Register& reg = plan_->registers[s.out];
  const auto read_by_selected = [&](const Step& t) { return t.kind == StepKind::selected_blocks && t.in[0] == s.out; };
  if (reg.kind == RegisterKind::blocks) return step(s, values, 1, counts);
  if (reg.kind == RegisterKind::factor && std::any_of(plan_->steps.begin(), plan_->steps.end(), read_by_selected)) return step(s, values, 1, counts);
  if (reg.kind != RegisterKind::vector || reg.wide || !functions_of_vectors_) return;
  vectors_[s.out].resize(rows(s.out));
  switch (s.kind) {
    case StepKind::solve:
    case StepKind::mass_matrix_solve:
    case StepKind::mass_matrix_solve_tangent:
    case StepKind::dense_solve:
    case StepKind::apply_external: return convert(narrow.numbers(s.out), size_t(rows(s.out)), vectors_[s.out]);
    default: return step(s, values, 1, counts);
  }
}

// The narrower workspace's system of a factorization, its bodies merged as there.
template <class S>
template <class T>
TreeElimination<S>& Workspace<S>::system_as(const Workspace<T>& narrow, int r) {
  Factors& factors = eliminations_[r];
  const auto& theirs = narrow.eliminations_[r];
  if (!factors.system) factors.system = std::make_unique<TreeElimination<S>>(plan_->registers[r].realization);
  if (factors.system_of != theirs.made)
    factors.system->assemble_as(*theirs.own, [&](int i) -> const BlockStorage<S>& { return blocks_[i]; }, [&](int c) -> const SkoValues<S>& { return *values[c]; });
  factors.system_of = theirs.made;
  return *factors.system;
}

// Residuals of eliminated systems are formed one scalar up, whatever was asked for: their own rounding is soon all that is left in
// those of the same scalar, no adjoint solve tells when, and beside the elimination they cost little.
template <class S>
void Workspace<S>::solve_realization(const Step& s, const std::vector<SkoValues<S>*>& values, int w) {
  const Refinement how = refinement();
  const S* x = numbers(s.in[1]);
  S* y = numbers(s.out);
  const auto blocks = [&](int r) -> const BlockStorage<S>& { return blocks_[r]; };
  if (how.steps == 0 || std::is_same_v<S, Wider<S>> || eliminations_[s.in[0]].wide)
    return with_factors(s.in[0], [&](auto& factors) { factors.solve(x, y, w, blocks, how); });
  follow(values);
  follow_steps(s);
  auto& wide = wide_->system_as(*this, s.in[0]);
  eliminations_[s.in[0]].own->solve(x, y, w, blocks, how, [&](const S* b, const S* solution, S* r) {
    wide.residual(b, solution, r, w, [&](int i) -> const BlockStorage<Wider<S>>& { return wide_->blocks_[i]; });
  });
}

template <class S>
void Workspace<S>::solve_mass_matrix(const Step& s, const std::vector<SkoValues<S>*>& values, int w) {
  const SkoValues<S>& own = *values[s.context];
  const S* x = numbers(s.in[0]);
  S* y = numbers(s.out);
  if (s.flag) return own.inverse_by_itself(x, y, w, scratch_.data());
  own.mass_matrix_inverse(x, y, w, scratch_.data());
  const Binding* binding = plan_->contexts[s.context].binding.get();
  if (!binding || binding->arithmetic.refinement.steps == 0) return;
  Refinement how = binding->arithmetic.refinement;
  if (how.gathers_wider() && !own.gathers_wider()) how.residual = ResidualPrecision::wider;
  const int n = plan_->registers[s.out].space.dimension();
  const size_t size = size_t(n) * w;
  if (how.wider()) follow(values);
  const auto residual = [&](const S* solution, S* r) {
    if (how.gathers_wider()) {
      own.gathered_residual(solution, x, r, w, scratch_.data(), wide_scratch_);
    } else if (how.wider()) {
      convert(solution, size, wide_x_);
      wide_y_.resize(size), wide_scratch_.resize(std::max(wide_scratch_.size(), scratch_.size()));
      wide_at_[s.context]->mass_matrix(true, wide_x_.data(), wide_y_.data(), w, wide_scratch_.data());
      for (size_t i = 0; i < size; ++i) r[i] = static_cast<S>(Wider<S>(x[i]) - wide_y_[i]);
    } else {
      own.mass_matrix(true, solution, r, w, scratch_.data());
      for (size_t i = 0; i < size; ++i) r[i] = x[i] - r[i];
    }
  };
  refine(y, n, w, how, binding->arithmetic.form, S(0), [&] { return plan_->text; }, residual, [&](const S* r, S* d) {
    own.mass_matrix_inverse(r, d, w, scratch_.data());
  }, [&](const S* direction, S* rounding) { own.mass_matrix_rounding(y, x, direction, units_of<S>(how), rounding, w, sizes_); }, refinement_);
}

template <class S>
void Workspace<S>::solve_mass_matrix_tangent(const Step& s, const std::vector<SkoValues<S>*>& values, int w, PassCounts& counts) {
  auto [known, fresh] = tangents_.try_emplace(s.out);
  if (fresh) known->second = values[s.context]->inverse_tangent();
  if (known->second && known->second->apply(*values[s.context], s.symbol, numbers(s.in[0]), numbers(s.out), w)) return;
  Workspace& typed = operand_workspace(s);
  const size_t size = size_t(rows(s.out)) * w;
  typed.vector(s.operand->input).assign(numbers(s.in[0]), numbers(s.in[0]) + size);
  typed.run(operand_values(s, values), w, true, counts);
  std::copy_n(typed.numbers(s.operand->output), size, numbers(s.out));
}

}  // namespace pycraft
