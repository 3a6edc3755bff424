#include "algebra/trees/aggregated_tree.h"

#include <algorithm>

namespace pycraft {

namespace {

std::vector<std::vector<int>> pairs(const SkoStructure& t) {
  std::vector<std::vector<int>> groups;
  for (int k = 0; k < t.bodies(); ++k) {
    groups.push_back({k});
    if (k + 1 < t.bodies() && t.parent[k + 1] == k) groups.back().push_back(++k);
  }
  return groups;
}

SkoStructure grouped(const SkoStructure& t) {
  SkoStructure s;
  std::vector<int> group_of(t.bodies());
  const auto groups = pairs(t);
  for (size_t g = 0; g < groups.size(); ++g) {
    int size = 0, dof = 0;
    for (int k : groups[g]) {
      group_of[k] = static_cast<int>(g);
      size += t.size[k];
      dof += t.dof[k];
    }
    const int p = t.parent[groups[g][0]];
    s.parent.push_back(p < 0 ? -1 : group_of[p]);
    s.size.push_back(size);
    s.dof.push_back(dof);
    s.body_names.push_back(t.body_names[groups[g][0]] + (groups[g].size() > 1 ? "+" + t.body_names[groups[g][1]] : ""));
  }
  s.coordinate_names = t.coordinate_names;
  s.finish();
  return s;
}

template <class S>
class AggregatedValues final : public TreeValues<DenseBlocks<S>> {
 public:
  explicit AggregatedValues(const AggregatedTree& model) : TreeValues<DenseBlocks<S>>(model.structure()), model_(model), base_(model.base().make_values(S())) {}

 protected:
  void set_state(const double* q, const double* v) override { base_->move_to(q, v); }
  void fill() override {
    base_->require(Group::kinematics);
    const SkoStructure &t = model_.base().structure(), &c = this->tree_;
    const auto get = [&](SymbolId id, int k, int rows, int columns) {
      std::vector<S> out(size_t(rows) * columns);
      if (!out.empty()) base_->block(Symbol{&sko_symbols()[id], nullptr, nullptr, {}, {}}, k, out.data());
      return out;
    };
    for (int g = 0; g < c.bodies(); ++g) {
      const std::vector<int>& bodies = model_.groups()[g];
      const int s = c.size[g], n = c.dof[g];
      // φ_S of the pair: [[1, E], [0, 1]]
      std::vector<S> phi(size_t(s) * s, S(0));
      for (int i = 0; i < s; ++i) phi[size_t(i) * s + i] = S(1);
      if (bodies.size() > 1) {
        const std::vector<S> e = get(SymbolId::E, bodies[1], t.size[bodies[0]], t.size[bodies[1]]);
        for (int i = 0; i < t.size[bodies[0]]; ++i)
          for (int j = 0; j < t.size[bodies[1]]; ++j) phi[size_t(i) * s + t.size[bodies[0]] + j] = e[size_t(i) * t.size[bodies[1]] + j];
      }
      std::vector<S> own(size_t(n) * s, S(0));
      S* M = this->blocks_.mass(g);
      S* J = this->blocks_.hinge_diagonal(g);
      std::fill_n(M, size_t(s) * s, S(0));
      std::fill_n(J, size_t(n) * n, S(0));
      int row = 0, column = 0;
      for (int k : bodies) {
        const std::vector<S> h = get(SymbolId::H, k, t.dof[k], t.size[k]), m = get(SymbolId::M, k, t.size[k], t.size[k]), j = get(SymbolId::J, k, t.dof[k], t.dof[k]);
        for (int a = 0; a < t.dof[k]; ++a) {
          for (int b = 0; b < t.size[k]; ++b) own[size_t(row + a) * s + column + b] = h[size_t(a) * t.size[k] + b];
          for (int b = 0; b < t.dof[k]; ++b) J[size_t(row + a) * n + row + b] = j[size_t(a) * t.dof[k] + b];
        }
        for (int a = 0; a < t.size[k]; ++a)
          for (int b = 0; b < t.size[k]; ++b) M[size_t(column + a) * s + column + b] = m[size_t(a) * t.size[k] + b];
        row += t.dof[k];
        column += t.size[k];
      }
      std::fill_n(this->blocks_.hinge_map(g), size_t(n) * s, S(0));
      multiply_add(own.data(), phi.data(), this->blocks_.hinge_map(g), n, s, s);
      const int p = t.parent[bodies[0]];
      if (p < 0) continue;
      // A: the first body's E in the rows of its own parent inside the parent group; then A φ_S
      const int gp = model_.group_of(p), sp = c.size[gp];
      int offset = 0;
      for (int k : model_.groups()[gp]) {
        if (k == p) break;
        offset += t.size[k];
      }
      std::vector<S> A(size_t(sp) * s, S(0));
      const std::vector<S> e = get(SymbolId::E, bodies[0], t.size[p], t.size[bodies[0]]);
      for (int i = 0; i < t.size[p]; ++i)
        for (int j = 0; j < t.size[bodies[0]]; ++j) A[size_t(offset + i) * s + j] = e[size_t(i) * t.size[bodies[0]] + j];
      std::fill_n(this->blocks_.edge(g), size_t(sp) * s, S(0));
      multiply_add(A.data(), phi.data(), this->blocks_.edge(g), sp, s, s);
    }
  }

 private:
  const AggregatedTree& model_;
  std::unique_ptr<SkoValues<S>> base_;
};

}  // namespace

AggregatedTree::AggregatedTree(std::shared_ptr<SkoSource> base)
    : SkoSource(grouped(base->structure()), base->name() + ", grouped"), base_(std::move(base)), groups_(pairs(base_->structure())) {
  group_of_.resize(base_->structure().bodies());
  for (size_t g = 0; g < groups_.size(); ++g)
    for (int k : groups_[g]) group_of_[k] = static_cast<int>(g);
  share_coordinates_with(*base_);
}

#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> AggregatedTree::make_values(S) const { return std::make_unique<AggregatedValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

}  // namespace pycraft
