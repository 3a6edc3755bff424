// The numbers of a bare tree, which has one state.
#pragma once

#include <algorithm>

#include "algebra/trees/matrix_tree.h"
#include "algebra/trees/tree_values.h"

namespace pycraft {

template <class S>
class MatrixTreeValues final : public TreeValues<DenseBlocks<S>> {
 public:
  explicit MatrixTreeValues(const MatrixTree& model) : TreeValues<DenseBlocks<S>>(model.structure()), model_(model) {}

 protected:
  void set_state(const double*, const double*) override {}
  void fill() override {
    const auto copy = [](const std::vector<double>& from, S* to) { std::transform(from.begin(), from.end(), to, [](double x) { return S(x); }); };
    for (int k = 0; k < this->tree_.bodies(); ++k) {
      if (this->tree_.parent[k] >= 0) copy(model_.E[k], this->blocks_.edge(k));
      copy(model_.H[k], this->blocks_.hinge_map(k));
      copy(model_.M[k], this->blocks_.mass(k));
      copy(model_.J[k], this->blocks_.hinge_diagonal(k));
    }
  }

 private:
  const MatrixTree& model_;
};


}  // namespace pycraft
