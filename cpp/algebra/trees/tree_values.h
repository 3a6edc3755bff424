// The engine's view of a block policy: every virtual call is one sweep over the tree.
#pragma once

#include <utility>

#include "algebra/language/values.h"
#include "algebra/trees/block_policy.h"
#include "algebra/trees/sweeps/articulated_inertia.h"
#include "algebra/trees/sweeps/composite_inertia.h"
#include "algebra/trees/sweeps/mass_matrix.h"
#include "algebra/trees/sweeps/residual_rounding.h"
#include "algebra/trees/sweeps/resolvents.h"
#include "algebra/trees/sweeps/upsilon.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <BlockPolicy Blocks>
class TreeValues : public SkoValues<typename Blocks::Scalar> {
 public:
  using S = typename Blocks::Scalar;

  template <class... Arguments>
  explicit TreeValues(const SkoStructure& tree, Arguments&&... arguments) : tree_(tree), blocks_(tree, std::forward<Arguments>(arguments)...) {}

  void use(Form form) override { blocks_.form = form; }
  void apply(const Symbol& symbol, bool transposed, bool inverse, const S* x, S* y, int m) const override {
    const SymbolDefinition& d = *symbol.definition;
    if (d.pattern == Pattern::edges) {
      if (transposed)
        apply_edges_transposed(tree_, blocks_, x, y, m);
      else
        apply_edges(tree_, blocks_, x, y, m);
      return;
    }
    const auto offset = [&](SpaceKind kind, int k) { return (kind == SpaceKind::Theta ? tree_.dof_offset[k] : tree_.offset[k]) * m; };
    for (int k = 0; k < tree_.bodies(); ++k) {
      const S* xk = x + offset(transposed ? d.codomain : d.domain, k);
      S* yk = y + offset(transposed ? d.domain : d.codomain, k);
      if (inverse) {  // D⁻¹
        std::copy_n(xk, tree_.dof[k] * m, yk);
        blocks_.solve_D_in_place(k, yk, m);
      } else {
        blocks_.apply(d.id, transposed, k, xk, yk, m);
      }
    }
  }
  void sweep(SymbolId resolvent, bool transposed, const S* x, S* y, int m) const override {
    if (resolvent == SymbolId::phi) {
      if (transposed)
        scatter_phi_base_to_tip(tree_, blocks_, x, y, m);
      else
        gather_phi_tip_to_base(tree_, blocks_, x, y, m);
    } else {
      if (transposed)
        scatter_psi_base_to_tip(tree_, blocks_, x, y, m);
      else
        gather_psi_tip_to_base(tree_, blocks_, x, y, m);
    }
  }
  void block(const Symbol& symbol, int k, S* out) const override { blocks_.block(symbol.definition->id, k, out); }
  void function_block(const Symbol& function, int, const S*, S*) const override { throw EvaluationError("no function '" + function.definition->ascii + "' here"); }
  void vector(const Symbol& symbol, S*) const override { throw EvaluationError("no vector '" + symbol.definition->ascii + "' here"); }
  void mass_matrix(bool with_hinge_diagonal, const S* x, S* y, int m, S* scratch) const override {
    mass_matrix_apply(tree_, blocks_, with_hinge_diagonal, x, y, m, scratch);
  }
  void mass_matrix_inverse(const S* x, S* y, int m, S* scratch) const override { mass_matrix_inverse_apply(tree_, blocks_, x, y, m, scratch); }
  void mass_matrix_rounding(const S* x, const S* b, const S* w, const RoundingUnits<S>& units, S* out, int m, ResidualSizes<S>& sizes) const override {
    residual_sizes(tree_, blocks_, x, b, m, units, sizes);
    rounding_along(tree_, blocks_, w, m, sizes, out);
  }
  S log_determinant_of_D() const override {
    using std::log;
    S sum = S(0);
    for (int k = 0; k < tree_.bodies(); ++k)
      for (int j = 0; j < tree_.dof[k]; ++j) sum += log(blocks_.pivots(k)[j]);
    return sum;
  }

  // ℳ(k,j) = H(k) R(k) φ*(k,j)...: column j of body k is carried from k to its ancestors only.
  void mass_matrix_dense(bool with_hinge_diagonal, S* out) const override {
    const int N = tree_.coordinates();
    std::fill_n(out, static_cast<size_t>(N) * N, S(0));
    std::vector<S> f, next, row, h;
    for (int k = 0; k < tree_.bodies(); ++k) {
      check_interrupt_at(k, k);
      const int n = tree_.dof[k];
      if (n == 0) continue;
      // f = R(k) H(k)*, one column per coordinate
      h.assign(static_cast<size_t>(n) * n, S(0));
      for (int j = 0; j < n; ++j) h[j * n + j] = S(1);
      next.assign(static_cast<size_t>(tree_.size[k]) * n, S(0));
      blocks_.hinge_transposed_add(k, h.data(), next.data(), n);
      f.assign(next.size(), S(0));
      blocks_.apply(SymbolId::R, false, k, next.data(), f.data(), n);
      for (int a = k; a >= 0; a = tree_.parent[a]) {
        row.resize(static_cast<size_t>(tree_.dof[a]) * n);
        blocks_.hinge(a, f.data(), row.data(), n);
        for (int i = 0; i < tree_.dof[a]; ++i)
          for (int j = 0; j < n; ++j) {
            const int r = tree_.dof_offset[a] + i, c = tree_.dof_offset[k] + j;
            if (a != k)
              out[static_cast<size_t>(r) * N + c] = out[static_cast<size_t>(c) * N + r] = row[i * n + j];
            else if (i <= j)
              out[static_cast<size_t>(r) * N + c] = out[static_cast<size_t>(c) * N + r] = row[i * n + j];
          }
        if (tree_.parent[a] >= 0) {
          next.assign(static_cast<size_t>(tree_.size[tree_.parent[a]]) * n, S(0));
          blocks_.shift_add(a, f.data(), next.data(), n);
          f.swap(next);
        }
      }
      if (with_hinge_diagonal) {
        row.assign(static_cast<size_t>(n) * n, S(0));
        blocks_.hinge_diagonal_add(k, h.data(), row.data(), n);
        for (int i = 0; i < n; ++i)
          for (int j = 0; j < n; ++j) out[static_cast<size_t>(tree_.dof_offset[k] + i) * N + tree_.dof_offset[k] + j] += row[i * n + j];
      }
    }
  }

  const SkoStructure& tree() const { return tree_; }
  const Blocks& blocks() const { return blocks_; }

 protected:
  virtual void fill() = 0;                   // E, H, M, J at the state that was set
  virtual void compute_velocities() {}
  unsigned compute(unsigned group) override {
    switch (group) {
      case Group::kinematics: fill(); break;
      case Group::articulated: articulated_inertia_tip_to_base(tree_, blocks_); break;
      case Group::composite: composite_inertia_tip_to_base(tree_, blocks_); break;
      case Group::compliance: upsilon_base_to_tip(tree_, blocks_); break;
      case Group::velocities: compute_velocities(); break;
      case Group::inverse: return Group::kinematics | Group::articulated;
    }
    return 0;
  }

  const SkoStructure& tree_;
  Blocks blocks_;
};

}  // namespace pycraft
