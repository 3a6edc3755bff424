// The same system with bodies grouped in pairs (a body and the child that follows it in the order), each pair one SKO node:
//
//   φ_S = (I - E_S)⁻¹,  H_C = H_S φ_S,  M_C = M_S,  E(p,C) = A φ_S with A the row of E to the pair's first body,
//   E(C,child) = the child's E in the rows of its own parent.
//
// Compound bodies of any kind (loops, coalesced bodies) are built this way; here nothing is constrained, so nothing outside changes.
#pragma once

#include <memory>
#include <vector>

#include "algebra/language/source.h"
#include "algebra/trees/dense_blocks.h"
#include "algebra/trees/tree_values.h"

namespace pycraft {

class AggregatedTree final : public SkoSource {
 public:
  explicit AggregatedTree(std::shared_ptr<SkoSource> base);

  const SkoSource& base() const { return *base_; }
  const std::vector<std::vector<int>>& groups() const { return groups_; }
  int group_of(int body) const { return group_of_[body]; }

  Traits traits() const override { return base_->traits(); }
  int nq() const override { return base_->nq(); }
  int nv() const override { return base_->nv(); }
  void check_state(const double* q, size_t nq, const double* v, size_t nv) const override { base_->check_state(q, nq, v, nv); }
  std::shared_ptr<const StateData> state() const override { return base_->state(); }
  std::uint64_t parameters() const override { return base_->parameters(); }
  PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_OVERRIDE_MAKE_VALUES)

 private:
  std::shared_ptr<SkoSource> base_;
  std::vector<std::vector<int>> groups_;
  std::vector<int> group_of_;
};

}  // namespace pycraft
