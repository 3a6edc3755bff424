// Bodies of two kinds in one tree: some in blocks of a structure that makes them cheap (rigid ones), the others in dense blocks of any size
// (compound bodies, flexible ones). Every body's own work is that of its kind, and so is an edge between two of one kind; an edge between
// kinds is a dense matrix, across which
//
//   vectors                 y(p) += E x(k),  y(k) += E* x(p)
//   P⁺, X⁺, R               A(p) += E A(k) E*, as dense symmetric matrices
//   factors of P⁺           column by column, u(p) = E u(k)
//   Υ                       A = E* Υ(p) E, as a dense matrix
#pragma once

#include <algorithm>
#include <vector>

#include "algebra/trees/block_policy.h"
#include "algebra/trees/dense_blocks.h"

namespace pycraft {

template <CarryingPolicy Structured>
class MixedBlocks {
 public:
  using Scalar = typename Structured::Scalar;
  using S = Scalar;

  // is_structured: which bodies are of the structured kind.
  MixedBlocks(const SkoStructure& tree, std::vector<char> is_structured)
      : structured(tree), dense(tree), tree_(tree), is_structured_(std::move(is_structured)) {
    int widest = 0;
    for (int s : tree.size) widest = std::max(widest, s);
    for (auto* x : {&carried_, &moved_, &product_}) x->resize(size_t(widest) * widest);
  }

  Structured structured;  // numbers of bodies and edges of the structured kind
  DenseBlocks<S> dense;   // of the others
  Form form = Form::fast;
  bool keep_inertias = true, with_bias = false;

  bool is_structured(int k) const { return is_structured_[k]; }
  bool is_structured_edge(int k) const { return is_structured_[k] && is_structured_[tree_.parent[k]]; }

  // ---------------------------------------------------------------- applied to vectors
  void shift_add(int k, const S* x, S* y, int m) const {
    of_edge(k, [&](const auto& b) { b.shift_add(k, x, y, m); });
  }
  void shift_transposed_add(int k, const S* x, S* y, int m) const {
    of_edge(k, [&](const auto& b) { b.shift_transposed_add(k, x, y, m); });
  }
  void articulated_shift_add(int k, const S* x, S* y, int m) const {
    if (is_structured_edge(k)) return structured.articulated_shift_add(k, x, y, m);
    if (!is_structured_[k]) return dense.articulated_shift_add(k, x, y, m);
    const int s = tree_.size[k], n = tree_.dof[k];
    thread_local std::vector<S> left, along, gained;
    left.assign(x, x + size_t(s) * m), along.resize(size_t(n) * m), gained.resize(size_t(s) * m);
    structured.hinge(k, x, along.data(), m);
    structured.apply(SymbolId::G, false, k, along.data(), gained.data(), m);
    for (int i = 0; i < s * m; ++i) left[i] -= gained[i];
    dense.shift_add(k, left.data(), y, m);
  }
  void articulated_shift_transposed_add(int k, const S* x, S* y, int m) const {
    if (is_structured_edge(k)) return structured.articulated_shift_transposed_add(k, x, y, m);
    if (!is_structured_[k]) return dense.articulated_shift_transposed_add(k, x, y, m);
    const int s = tree_.size[k], n = tree_.dof[k];
    thread_local std::vector<S> seen, along;
    seen.assign(size_t(s) * m, S(0)), along.assign(size_t(n) * m, S(0));
    dense.shift_transposed_add(k, x, seen.data(), m);
    structured.gain_transposed_subtract(k, seen.data(), along.data(), m);
    structured.hinge_transposed_add(k, along.data(), seen.data(), m);
    for (int i = 0; i < s * m; ++i) y[i] += seen[i];
  }
  void hinge(int k, const S* x, S* y, int m) const {
    of_body(k, [&](const auto& b) { b.hinge(k, x, y, m); });
  }
  void hinge_transposed_add(int k, const S* x, S* y, int m) const {
    of_body(k, [&](const auto& b) { b.hinge_transposed_add(k, x, y, m); });
  }
  void hinge_diagonal_add(int k, const S* x, S* y, int m) const {
    of_body(k, [&](const auto& b) { b.hinge_diagonal_add(k, x, y, m); });
  }
  void inertia_in_place(int k, S* x, int m) const {
    of_body(k, [&](const auto& b) { b.inertia_in_place(k, x, m); });
  }
  void innovation(int k, const S* x, S* z, S* e, int m) const {
    of_body(k, [&](const auto& b) { b.innovation(k, x, z, e, m); });
  }
  void gain_transposed_subtract(int k, const S* a, S* y, int m) const {
    of_body(k, [&](const auto& b) { b.gain_transposed_subtract(k, a, y, m); });
  }
  void solve_D_in_place(int k, S* x, int m) const {
    of_body(k, [&](const auto& b) { b.solve_D_in_place(k, x, m); });
  }
  void apply(SymbolId id, bool transposed, int k, const S* x, S* y, int m) const {
    of_body(k, [&](const auto& b) { b.apply(id, transposed, k, x, y, m); });
  }
  void block(SymbolId id, int k, S* out) const {
    if (id == SymbolId::E)
      of_edge(k, [&](const auto& b) { b.block(id, k, out); });
    else
      of_body(k, [&](const auto& b) { b.block(id, k, out); });
  }
  const S* pivots(int k) const { return is_structured_[k] ? structured.pivots(k) : dense.pivots(k); }

  // ---------------------------------------------------------------- sizes of what residuals add up
  void motion_sizes(int k, const S* parent, const S* x, const S* a, S* out, int m) const {
    if (!is_structured_[k]) return dense.motion_sizes(k, parent, x, a, out, m);
    const bool across = parent && !is_structured_edge(k);
    structured.motion_sizes(k, across ? nullptr : parent, x, a, out, m);
    if (across) dense.carried_motion_sizes(k, parent, out, m);
  }
  template <class Units>
  void inertia_sizes(int k, const S* a, const Units& u, S* out, int m) const {
    of_body(k, [&](const auto& b) { b.inertia_sizes(k, a, u, out, m); });
  }
  template <class Units>
  void shifted_force_sizes(int k, const S* f, const Units& u, S* out, int m) const {
    of_edge(k, [&](const auto& b) { b.shifted_force_sizes(k, f, u, out, m); });
  }
  template <class Units>
  void coordinate_sizes(int k, const S* f, const S* x, const Units& u, S* out, int m) const {
    of_body(k, [&](const auto& b) { b.coordinate_sizes(k, f, x, u, out, m); });
  }

  // ---------------------------------------------------------------- articulated inertia
  void start_articulated(int k) {
    structured.form = dense.form = form;
    structured.keep_inertias = true, structured.with_bias = false;
    of_body(k, [&](auto& b) { b.start_articulated(k); });
  }
  // Always in doubt, as dense blocks are: what they hand on comes without a bound on its rounding.
  Pivots eliminate_hinge(int k) {
    Pivots found = Pivots::sound;
    of_body(k, [&](auto& b) { found = b.eliminate_hinge(k); });
    return found == Pivots::sound && tree_.dof[k] > 0 ? Pivots::doubtful : found;
  }
  void articulated_to_parent(int k) {
    if (of_one_kind(k)) return of_body(k, [&](auto& b) { b.articulated_to_parent(k); });
    if (form == Form::fast) return carry(Carried::articulated, k);
    const int s = tree_.size[k], p = tree_.parent[k];
    of_body(k, [&](auto& from) {
      from.carried_columns(k, [&](const S& weight, auto&& u) {
        of_body(p, [&](auto& to) {
          to.take_column(p, weight, [&](int i) {
            S sum = S(0);
            for (int a = 0; a < s; ++a) sum += dense.edge(k)[i * s + a] * u(a);
            return sum;
          });
        });
      });
    });
  }
  // ---------------------------------------------------------------- error bound
  void start_error(int k) {
    of_body(k, [&](auto& b) { b.start_error(k); });
  }
  void check_pivots(int k) {
    of_body(k, [&](auto& b) { b.check_pivots(k); });
  }
  void error_to_parent(int k) {
    if (of_one_kind(k)) return of_body(k, [&](auto& b) { b.error_to_parent(k); });
    carry(Carried::error, k);
  }
  // ---------------------------------------------------------------- composite inertia, compliance
  void start_composite(int k) {
    of_body(k, [&](auto& b) { b.start_composite(k); });
  }
  void composite_to_parent(int k) {
    if (of_one_kind(k)) return of_body(k, [&](auto& b) { b.composite_to_parent(k); });
    carry(Carried::composite, k);
  }
  void compliance_from_parent(int k, int p) {
    if (p < 0 || of_one_kind(k)) return of_body(k, [&](auto& b) { b.compliance_from_parent(k, p); });
    const int s = tree_.size[k], sp = tree_.size[p];
    block(SymbolId::Upsilon, p, carried_.data());
    std::fill_n(product_.data(), size_t(sp) * s, S(0));
    multiply_add(carried_.data(), dense.edge(k), product_.data(), sp, sp, s);
    std::fill_n(moved_.data(), size_t(s) * s, S(0));
    transposed_multiply_add(dense.edge(k), product_.data(), moved_.data(), s, sp, s);
    of_body(k, [&](auto& b) { b.compliance_from(k, moved_.data()); });
  }

 private:
  bool of_one_kind(int k) const { return is_structured_[k] == is_structured_[tree_.parent[k]]; }
  template <class F>
  void of_body(int k, F&& f) const {
    is_structured_[k] ? f(structured) : f(dense);
  }
  template <class F>
  void of_body(int k, F&& f) {
    is_structured_[k] ? f(structured) : f(dense);
  }
  template <class F>
  void of_edge(int k, F&& f) const {
    is_structured_edge(k) ? f(structured) : f(dense);
  }
  // A(p) += E A(k) E*
  void carry(Carried what, int k) {
    const int s = tree_.size[k], p = tree_.parent[k], sp = tree_.size[p];
    of_body(k, [&](auto& b) { b.carried(what, k, carried_.data()); });
    std::fill_n(product_.data(), size_t(sp) * s, S(0));
    multiply_add(dense.edge(k), carried_.data(), product_.data(), sp, s, s);
    for (int i = 0; i < sp; ++i)
      for (int j = 0; j <= i; ++j) {
        S sum = S(0);
        for (int a = 0; a < s; ++a) sum += product_[size_t(i) * s + a] * dense.edge(k)[j * s + a];
        moved_[size_t(i) * sp + j] = moved_[size_t(j) * sp + i] = sum;
      }
    of_body(p, [&](auto& b) { b.take(what, p, moved_.data()); });
  }

  const SkoStructure& tree_;
  std::vector<char> is_structured_;
  std::vector<S> carried_, moved_, product_;
};

}  // namespace pycraft
