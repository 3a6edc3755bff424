// A bare SKO model: a tree whose blocks E(p,k), H(k), M(k), J(k) are given as matrices of any size. The algebra is tested on it
// without any mechanics; compound bodies and state-space models of other fields are such trees.
#pragma once

#include <vector>

#include "algebra/language/source.h"
#include "algebra/trees/dense_blocks.h"
#include "algebra/trees/tree_values.h"

namespace pycraft {

class MatrixTree final : public SkoSource {
 public:
  // Row-major blocks: E[k] (s_parent x s_k; empty for roots), H[k] (n_k x s_k), M[k] (s_k x s_k), J[k] (n_k x n_k) or J empty for zero.
  MatrixTree(SkoStructure structure, std::string name, std::vector<std::vector<double>> E, std::vector<std::vector<double>> H,
             std::vector<std::vector<double>> M, std::vector<std::vector<double>> J);

  Traits traits() const override;
  BlockCosts costs(int k) const override { return dense_costs(structure(), k); }
  int nq() const override { return 0; }
  int nv() const override { return 0; }
  void check_state(const double* q, size_t nq, const double* v, size_t nv) const override;
  std::shared_ptr<const StateData> state() const override { return state_; }
  std::uint64_t parameters() const override { return 0; }
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)

  std::vector<std::vector<double>> E, H, M, J;

 private:
  std::shared_ptr<const StateData> state_ = std::make_shared<StateData>();
};

}  // namespace pycraft
