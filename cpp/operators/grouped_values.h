// The numbers of a robot's bodies in groups, from those of the robot.
#pragma once

#include <algorithm>
#include <vector>

#include "algebra/trees/mixed_blocks.h"
#include "algebra/trees/reordered_values.h"
#include "operators/alphabet.h"
#include "operators/directions.h"
#include "operators/grouped_operators.h"
#include "operators/rigid_values.h"

namespace pycraft {

inline std::vector<char> single_groups(const Grouping& grouping) {
  std::vector<char> single;
  for (const auto& bodies : grouping.groups) single.push_back(bodies.size() == 1);
  return single;
}

template <class S>
class GroupedValues final : public ReorderedValues<MixedBlocks<RigidBlocks<S>>> {
  using Base = ReorderedValues<MixedBlocks<RigidBlocks<S>>>;

 public:
  explicit GroupedValues(const GroupedOperators& source)
      : Base(source, single_groups(source.grouping())), source_(source), robot_(source.base()->structure()), base_(*source.base()),
        phi_(robot_.bodies()), H_(robot_.bodies()), factors_(source.structure().bodies()) {
    this->blocks_.structured.inertia_factors = &factors_;
  }

  void block(const Symbol& symbol, int g, S* out) const override {
    const SymbolDefinition& d = *symbol.definition;
    switch (d.id) {
      case SymbolId::inner_phi: std::copy(phi_[g].begin(), phi_[g].end(), out); return;
      case SymbolId::inner_H: std::copy(H_[g].begin(), H_[g].end(), out); return;
      case SymbolId::H_dot: return block_of_H_dot(symbol, g, out);
      default: break;
    }
    if (d.kind() == LetterKind::sko) return Base::block(symbol, g, out);
    along_diagonal(g, d.domain, d.codomain, [&](int k, S* own) { base_.block(symbol, k, own); }, out, &symbol);
  }
  void function_block(const Symbol& function, int g, const S* x, S* out) const override {
    const SymbolDefinition& d = *function.definition;
    along_diagonal(g, d.domain, d.codomain, [&](int k, S* own) { base_.function_block(function, k, x + grouping().row_of[k], own); }, out);
  }
  void vector(const Symbol& symbol, S* out) const override {
    if (symbol.definition->codomain == SpaceKind::Theta) return base_.vector(symbol, out);
    std::vector<S> by_body(robot_.dimension());
    base_.vector(symbol, by_body.data());
    const bool of_hinges = symbol.definition->id == SymbolId::coriolis_acceleration || symbol.definition->id == SymbolId::gravity_base;
    for (int g = 0; g < this->tree_.bodies(); ++g) {
      const int s = this->tree_.size[g];
      S* to = out + this->tree_.offset[g];
      std::vector<S> stacked;
      for (int k : groups()[g]) stacked.insert(stacked.end(), by_body.begin() + robot_.offset[k], by_body.begin() + robot_.offset[k + 1]);
      if (of_hinges) {
        std::fill_n(to, s, S(0));
        transposed_multiply_add(phi_[g].data(), stacked.data(), to, s, s, 1);
      } else {
        std::copy(stacked.begin(), stacked.end(), to);
      }
    }
  }

 protected:
  void set_state(const double* q, const double* v) override { base_.move_to(q, v); }
  void compute_velocities() override { base_.require(Group::kinematics | Group::velocities); }
  void fill() override {
    base_.require(Group::kinematics);
    const RigidBlocks<S>& rigid = base_.blocks();
    const auto get = [&](SymbolId id, int k) {
      std::vector<S> out(size_t(id == SymbolId::H || id == SymbolId::J ? robot_.dof[k] : 6) * (id == SymbolId::J ? robot_.dof[k] : 6));
      if (!out.empty()) rigid.block(id, k, out.data());
      return out;
    };
    MixedBlocks<RigidBlocks<S>>& blocks = this->blocks_;
    for (int g = 0; g < this->tree_.bodies(); ++g) {
      const int first = groups()[g][0], p = this->tree_.parent[g];
      inner_blocks(robot_, grouping(), g, get, phi_[g], H_[g]);
      if (grouping().single(g))
        fill_single(g, first, rigid);
      else
        fill_group(robot_, grouping(), g, get, phi_[g], H_[g], blocks.dense);
      if (p >= 0 && !blocks.is_structured_edge(g)) fill_edge(robot_, grouping(), g, get, phi_[g], blocks.dense.edge(g));
    }
  }

 private:
  const Grouping& grouping() const { return source_.grouping(); }
  const std::vector<std::vector<int>>& groups() const { return source_.groups(); }

  void fill_single(int g, int k, const RigidBlocks<S>& rigid) {
    RigidBlocks<S>& own = this->blocks_.structured;
    own.pose[g] = rigid.pose[k], own.inertia[g] = rigid.inertia[k], factors_[g] = (*rigid.inertia_factors)[k];
    for (int j = 0; j < robot_.dof[k]; ++j) {
      const int to = this->tree_.dof_offset[g] + j, from = robot_.dof_offset[k] + j;
      own.H[to] = rigid.H[from], own.J[to] = rigid.J[from], own.aligned[to] = rigid.aligned[from];
    }
  }
  // The robot's blocks of the bodies of group g, one after the other along the diagonal of a block of the group.
  template <class Block>
  void along_diagonal(int g, SpaceKind domain, SpaceKind codomain, Block&& block, S* out, const Symbol* symbol = nullptr) const {
    int rows = 0, columns = 0, row = 0, column = 0;
    for (int k : groups()[g]) rows += rows_of(codomain, k, symbol), columns += rows_of(domain, k, symbol);
    std::fill_n(out, size_t(rows) * columns, S(0));
    std::vector<S> own;
    for (int k : groups()[g]) {
      const int r = rows_of(codomain, k, symbol), c = rows_of(domain, k, symbol);
      own.resize(size_t(r) * c);
      if (!own.empty()) block(k, own.data());
      for (int i = 0; i < r; ++i) std::copy_n(own.data() + size_t(i) * c, c, out + size_t(row + i) * columns + column);
      row += r, column += c;
    }
  }
  // Rows or columns that a block of the robot has at body k.
  int rows_of(SpaceKind kind, int k, const Symbol* symbol = nullptr) const {
    if (kind != SpaceKind::NodesF) return kind == SpaceKind::Theta ? robot_.dof[k] : robot_.size[k];
    const Multibody& model = source_.model();
    const std::vector<int>& of = std::get<OfNodes>(symbol->arguments).nodes;
    return 6 * static_cast<int>(std::count_if(of.begin(), of.end(),
                                              [&](int node) { return (node >= 0 ? model.node(node).body : -1 - node) == k; }));
  }
  // Ḣ_S φ_S + (H_C - H_S) Δ_θ̇ φ_S
  void block_of_H_dot(const Symbol& symbol, int g, S* out) const {
    const int s = this->tree_.size[g], n = this->tree_.dof[g];
    std::vector<S> rate(size_t(n) * s), delta(size_t(s) * s), whole(size_t(n) * s);
    along_diagonal(g, SpaceKind::F, SpaceKind::Theta, [&](int k, S* own) { base_.block(symbol, k, own); }, rate.data());
    const Symbol turning{&definition_of(SymbolId::Delta_theta_dot), nullptr, nullptr, {}, {}};
    along_diagonal(g, SpaceKind::F, SpaceKind::F, [&](int k, S* own) { base_.block(turning, k, own); }, delta.data());
    this->blocks_.block(SymbolId::H, g, whole.data());
    for (size_t i = 0; i < whole.size(); ++i) whole[i] -= H_[g][i];
    multiply_add(whole.data(), delta.data(), rate.data(), n, s, s);
    std::fill_n(out, size_t(n) * s, S(0));
    multiply_add(rate.data(), phi_[g].data(), out, n, s, s);
  }

  const GroupedOperators& source_;
  const SkoStructure& robot_;
  RigidValues<S> base_;
  std::vector<std::vector<S>> phi_, H_;  // φ_S and H_S, by group
  std::vector<InertiaFactors<S>> factors_;
};

#define PYCRAFT_EXTERN(S)                                             \
  extern template class TreeValues<MixedBlocks<RigidBlocks<S>>>;      \
  extern template class ReorderedValues<MixedBlocks<RigidBlocks<S>>>; \
  extern template class GroupedValues<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
