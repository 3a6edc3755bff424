// The memory of a plan's runs at one scalar, and its steps: each does one sweep, one product, one factorization.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algebra/engine/elimination/elimination.h"
#include "algebra/engine/engine.h"
#include "algebra/language/values.h"
#include "numerics/gram_factors.h"
#include "numerics/refinement.h"
#include "numerics/small_lu.h"
#include "runtime/errors.h"

namespace pycraft {

// Columns of the identity that dense requests take at a time: bounds the memory of a run.
constexpr int columns_at_a_time = 64;

template <class S>
class Workspace {
 public:
  // of an operand's plan: `whole` holds the factors that it shares
  explicit Workspace(std::shared_ptr<const Plan> plan, Workspace* whole = nullptr) : plan_(std::move(plan)), whole_(whole ? whole : this), vectors_(plan_->registers.size()), lent_(plan_->registers.size()), blocks_(plan_->registers.size()),
                                                         scalars_(plan_->registers.size(), S(0)), dense_(plan_->registers.size()) {
    eliminations_.resize(plan_->registers.size());
    dense_lu_.resize(plan_->registers.size());
    gram_.resize(plan_->registers.size());
    for (size_t r = 0; r < plan_->registers.size(); ++r) {
      const Register& reg = plan_->registers[r];
      if (reg.kind == RegisterKind::blocks) blocks_[r].shape(reg.space, reg.columns);
    }
    for (const Step& s : plan_->steps)
      functions_of_vectors_ |= (s.kind == StepKind::function_blocks && plan_->registers[s.in[0]].kind == RegisterKind::vector) || (s.operand && !s.operand->vectors.empty());
    for (const Step& s : plan_->steps)
      if (s.operand) operands_.emplace_back(&s, std::make_unique<Workspace>(s.operand, s.kind == StepKind::dense_factor && !s.flag ? whole_ : nullptr));
  }

  // Steps that make no vector (blocks, factors, scalars) run only where the values changed.
  void run(const std::vector<SkoValues<S>*>& values, int columns, bool values_changed, PassCounts& counts) {
    for (size_t r = 0; r < plan_->registers.size(); ++r) {
      const Register& reg = plan_->registers[r];
      if (reg.kind == RegisterKind::vector && !lent_[r]) vectors_[r].resize(size_t(reg.space.dimension()) * (reg.wide ? columns : 1));
    }
    if (values_changed || functions_of_vectors_) followed_to_ = 0;
    bool worked = false;
    for (const Step& s : plan_->steps) {
      const bool per_column = s.out >= 0 && plan_->registers[s.out].kind == RegisterKind::vector;
      // a function of a vector, an operand with one in it, and what is made of them, may depend on a named vector
      if (!values_changed && !per_column && !functions_of_vectors_) continue;
      if (worked) check_interrupt();
      step(s, values, columns, counts);
      worked |= s.kind != StepKind::values;  // those are there before a run
    }
  }

  std::vector<S>& vector(int r) { return vectors_[r]; }
  // Where the numbers of a vector register lie: in memory of its own, or in what it was lent for a run.
  S* numbers(int r) { return lent_[r] ? lent_[r] : vectors_[r].data(); }
  void lend(int r, S* memory) { lent_[r] = memory; }
  BlockStorage<S>& blocks(int r) { return blocks_[r]; }
  std::vector<S>& dense(int r) { return dense_[r]; }
  S& scalar(int r) { return scalars_[r]; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void step(const Step& s, const std::vector<SkoValues<S>*>& values, int m, PassCounts& counts) {
    if (s.kind == StepKind::values) {  // done before the run
      ++counts.values;
      return;
    }
    switch (plan_->registers[s.out].kind) {
      case RegisterKind::vector: return vector_step(s, values, m, counts);
      case RegisterKind::blocks: return block_step(s, values, counts);
      case RegisterKind::factor: ++counts.eliminations; return eliminate(s, values, counts);
      case RegisterKind::dense: return dense_step(s, values, counts);
      case RegisterKind::scalar: return scalar_step(s, values);
    }
  }

  // vector_steps.h
  void vector_step(const Step& s, const std::vector<SkoValues<S>*>& values, int m, PassCounts& counts);
  void apply_constant(const Step& s, int w);
  void apply_column(const Step& s, int w);
  void combine(const Step& s, size_t n);
  void apply_block_register(const Step& s, int w);
  void apply_external_operator(const Step& s, int w);
  void apply_mass_matrix(const Step& s, const std::vector<SkoValues<S>*>& values, int w);
  void solve_dense(const Step& s, int w);
  void read_diagonal(const Step& s);

  // block_steps.h
  void block_step(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts);
  void load_blocks(const Step& s, const std::vector<SkoValues<S>*>& values);
  void invert_block(const BlockStorage<S>& in, BlockStorage<S>& out, int k, const Space& space);
  void function_block(const Step& s, const std::vector<SkoValues<S>*>& values, int k);
  void blocks_of_dense(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts);
  void factor_block(const BlockStorage<S>& b, int k, const Space& space);
  void add_congruence(const Step& s, const std::vector<SkoValues<S>*>& values, int k, const S* B, S* Y, bool down);
  void root_block(const BlockStorage<S>& in, BlockStorage<S>& out, int k);

  // dense_steps.h
  void dense_step(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts);
  void matrix_of_blocks(const Step& s);
  void factor_gram(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts);
  void operand_as_matrix(const Step& s, const std::vector<SkoValues<S>*>& values, std::vector<S>& A, PassCounts& counts);
  void eliminate(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts);

  // scalar_steps.h
  void scalar_step(const Step& s, const std::vector<SkoValues<S>*>& values);

  // refined_solves.h
  Refinement refinement() const;
  void follow(const std::vector<SkoValues<S>*>& values);
  void follow_steps(const Step& until);
  template <class T>
  void run_as(Workspace<T>& narrow, const Step& s);
  template <class T>
  TreeElimination<S>& system_as(const Workspace<T>& narrow, int r);
  void solve_realization(const Step& s, const std::vector<SkoValues<S>*>& values, int w);
  void solve_mass_matrix(const Step& s, const std::vector<SkoValues<S>*>& values, int w);
  void solve_mass_matrix_tangent(const Step& s, const std::vector<SkoValues<S>*>& values, int w, PassCounts& counts);

  int rows(int r) const { return plan_->registers[r].space.dimension(); }
  int width(int r, int m) const { return plan_->registers[r].wide ? m : 1; }
  const SkoStructure& structure(const Step& s) const { return plan_->contexts[s.context].source->structure(); }
  SmallLU<S>& dense_factors(int r) {
    const int shared = plan_->registers[r].shared;
    return shared < 0 ? dense_lu_[r] : whole_->dense_lu_[shared];
  }
  template <class F>
  void with_factors(int r, F f) {
    Factors& factors = eliminations_[r];
    if constexpr (!is_recorded<S>)
      if (factors.wide) return f(*factors.wide);
    f(*factors.own);
  }
  Workspace& operand_workspace(const Step& s) {
    Workspace* w = nullptr;
    for (auto& [step, workspace] : operands_)
      if (step == &s) w = workspace.get();
    w->state = state;
    for (const auto& [name, r] : s.operand->vectors) w->vectors_[r] = vectors_[plan_->vectors.at(name)];
    return *w;
  }
  std::vector<SkoValues<S>*> operand_values(const Step& s, const std::vector<SkoValues<S>*>& values) const {
    std::vector<SkoValues<S>*> own;
    for (const Context& c : s.operand->contexts) own.push_back(values[std::find(plan_->contexts.begin(), plan_->contexts.end(), c) - plan_->contexts.begin()]);
    return own;
  }

  std::shared_ptr<const Plan> plan_;
  Workspace* whole_;
  std::vector<std::vector<S>> vectors_;
  std::vector<S*> lent_;                                  // null: none
  std::vector<BlockStorage<S>> blocks_;
  bool functions_of_vectors_ = false;
  std::vector<S> scalars_;
  std::vector<std::vector<S>> dense_;
  struct Factors {
    std::unique_ptr<TreeElimination<S>> own;
    std::unique_ptr<TreeElimination<Quad>> wide;
    int made = 0;                                   // how many times
    std::unique_ptr<TreeElimination<S>> system;     // of a narrower workspace's, not factored: for residuals
    int system_of = 0;                              // which of those
  };
  std::vector<Factors> eliminations_;
  std::vector<SmallLU<S>> dense_lu_;
  std::vector<std::optional<GramFactors<S>>> gram_;
  std::vector<std::pair<const Step*, std::unique_ptr<Workspace>>> operands_;
  std::map<int, std::unique_ptr<InverseTangent<S>>> tangents_;  // by the register that is written
  SmallLU<S> lu_;
  std::vector<S> gathered_, scratch_, block_, product_, magnitude_;
  RefinementWork<S> refinement_;
  ResidualSizes<S> sizes_;
  std::vector<std::string> notes_;
  // one scalar up, for residuals
  template <class T>
  friend class Workspace;
  std::unique_ptr<Workspace<Wider<S>>> wide_;
  std::vector<std::unique_ptr<SkoValues<Wider<S>>>> wide_values_;
  std::vector<SkoValues<Wider<S>>*> wide_at_;
  std::vector<Wider<S>> wide_x_, wide_y_, wide_scratch_;
  std::vector<std::uint64_t> followed_;                   // the values that it is at
  size_t followed_to_ = 0;                                // steps that it has done there

 public:
  std::vector<std::unique_ptr<SkoValues<S>>> own_values;  // of batched contexts
  std::vector<ValuesInUse<S>> held;                       // of the others, during a run
  std::vector<SkoValues<S>*> values;                      // of all, during a run
  bool ran = false;
  int state = 0;                                          // of the batch
  std::vector<std::uint64_t> generations;                 // of the values that blocks and factors were made from
};

}  // namespace pycraft
