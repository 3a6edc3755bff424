// The same system with bodies grouped in pairs (a body and the child that follows it in the order), each pair one SKO node of dense blocks: a tree of
// any kind in blocks of other sizes, on which theorems are tried (grouping.h). Robots' bodies are grouped by operators/grouped_operators.h.
#pragma once

#include <memory>

#include "algebra/language/source.h"
#include "algebra/trees/grouping.h"

namespace pycraft {

class AggregatedTree final : public SkoSource {
 public:
  explicit AggregatedTree(std::shared_ptr<SkoSource> base);

  const SkoSource& base() const { return *base_; }
  const Grouping& grouping() const { return grouping_; }

  Traits traits() const override;
  BlockCosts costs(int k) const override { return dense_costs(structure(), k); }
  int nq() const override { return base_->nq(); }
  int nv() const override { return base_->nv(); }
  void check_state(const double* q, size_t nq, const double* v, size_t nv) const override { base_->check_state(q, nq, v, nv); }
  std::shared_ptr<const StateData> state() const override { return base_->state(); }
  StateData generic_state() const override { return base_->generic_state(); }
  void check_current() const override { base_->check_current(); }
  std::uint64_t parameters() const override { return base_->parameters(); }
  unsigned enter_use() const override { return base_->enter_use(); }
  void leave_use(unsigned entered) const noexcept override { base_->leave_use(entered); }
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)

 private:
  AggregatedTree(std::shared_ptr<SkoSource> base, Grouping grouping);
  std::shared_ptr<SkoSource> base_;
  Grouping grouping_;
};

}  // namespace pycraft
