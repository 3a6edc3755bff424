// The numbers of grouped bodies, from those of the bodies.
#pragma once

#include <memory>

#include "algebra/trees/aggregated_tree.h"
#include "algebra/trees/reordered_values.h"

namespace pycraft {

template <class S>
class AggregatedValues final : public ReorderedValues<DenseBlocks<S>> {
 public:
  explicit AggregatedValues(const AggregatedTree& model) : ReorderedValues<DenseBlocks<S>>(model), model_(model), base_(model.base().make_values(S())) {}

 protected:
  void set_state(const double* q, const double* v) override { base_->move_to(q, v); }
  void fill() override {
    base_->require(Group::kinematics);
    const SkoStructure& t = model_.base().structure();
    const auto get = [&](SymbolId id, int k) {
      const int columns = id == SymbolId::J ? t.dof[k] : t.size[k];
      const int rows = id == SymbolId::H || id == SymbolId::J ? t.dof[k] : id == SymbolId::E ? t.size[t.parent[k]] : t.size[k];
      std::vector<S> out(size_t(rows) * columns);
      if (!out.empty()) base_->block(Symbol{&sko_symbol(id), nullptr, nullptr, {}, {}}, k, out.data());
      return out;
    };
    std::vector<S> phi, H;
    for (int g = 0; g < this->tree_.bodies(); ++g) {
      inner_blocks(t, model_.grouping(), g, get, phi, H);
      fill_group(t, model_.grouping(), g, get, phi, H, this->blocks_);
      if (this->tree_.parent[g] >= 0) fill_edge(t, model_.grouping(), g, get, phi, this->blocks_.edge(g));
    }
  }

 private:
  const AggregatedTree& model_;
  std::unique_ptr<SkoValues<S>> base_;
};


}  // namespace pycraft
