// Steps that make blocks over the tree: loads, products, sums, inverses, roots, recursions of congruences.
#pragma once

#include "algebra/engine/workspace.h"

namespace pycraft {

template <class S>
void Workspace<S>::block_step(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts) {
  BlockStorage<S>& out = blocks_[s.out];
  const int bodies = static_cast<int>(out.rows.size());
  const auto in = [&](int i) -> const BlockStorage<S>& { return blocks_[s.in[i]]; };
  switch (s.kind) {
    case StepKind::load_blocks: return load_blocks(s, values);
    case StepKind::identity_blocks:
      std::fill(out.data.begin(), out.data.end(), S(0));
      for (int k = 0; k < bodies; ++k)
        for (int i = 0; i < std::min(out.rows[k], out.columns[k]); ++i) out.at(k)[i * out.columns[k] + i] = S(1);
      return;
    case StepKind::multiply_blocks:
      std::fill(out.data.begin(), out.data.end(), S(0));
      for (int k = 0; k < bodies; ++k) multiply_add(in(0).at(k), in(1).at(k), out.at(k), out.rows[k], in(0).columns[k], out.columns[k]);
      return;
    case StepKind::combine_blocks:
      std::fill(out.data.begin(), out.data.end(), S(0));
      for (size_t t = 0; t < s.in.size(); ++t)
        for (size_t i = 0; i < out.data.size(); ++i) out.data[i] += S(s.coefficients[t]) * in(static_cast<int>(t)).data[i];
      return;
    case StepKind::transpose_blocks:
      for (int k = 0; k < bodies; ++k)
        for (int i = 0; i < out.rows[k]; ++i)
          for (int j = 0; j < out.columns[k]; ++j) out.at(k)[i * out.columns[k] + j] = in(0).at(k)[j * out.rows[k] + i];
      return;
    case StepKind::invert_blocks:
      for (int k = 0; k < bodies; ++k) invert_block(in(0), out, k, plan_->registers[s.in[0]].space);
      return;
    case StepKind::root_blocks:
      for (int k = 0; k < bodies; ++k) root_block(in(0), out, k);
      return;
    case StepKind::function_blocks:
      for (int k = 0; k < bodies; ++k) function_block(s, values, k);
      return;
    case StepKind::congruence_blocks:
      std::fill(out.data.begin(), out.data.end(), S(0));
      for (int k = 0; k < bodies; ++k) {
        const int p = structure(s).parent[k];
        if (p >= 0) add_congruence(s, values, k, in(0).at(s.transposed ? p : k), out.at(s.transposed ? k : p), s.transposed);
      }
      return;
    case StepKind::lyapunov_blocks:
      out.data = in(0).data;
      if (!s.transposed) {
        for (int k = bodies - 1; k >= 0; --k)
          if (const int p = structure(s).parent[k]; p >= 0) add_congruence(s, values, k, out.at(k), out.at(p), false);
      } else {
        for (int k = 0; k < bodies; ++k)
          if (const int p = structure(s).parent[k]; p >= 0) add_congruence(s, values, k, out.at(p), out.at(k), true);
      }
      return;
    case StepKind::selected_blocks: return with_factors(s.in[0], [&](auto& factors) { factors.selected(out); });
    case StepKind::blocks_of_dense: return blocks_of_dense(s, values, counts);
    default: return;
  }
}

template <class S>
void Workspace<S>::load_blocks(const Step& s, const std::vector<SkoValues<S>*>& values) {
  BlockStorage<S>& out = blocks_[s.out];
  for (size_t k = 0; k < out.rows.size(); ++k) {
    if (out.rows[k] == 0 || out.columns[k] == 0) continue;
    if (s.constant)
      std::transform(s.constant->blocks[k].begin(), s.constant->blocks[k].end(), out.at(static_cast<int>(k)), [](double v) { return S(v); });
    else
      values[s.context]->block(s.symbol, static_cast<int>(k), out.at(static_cast<int>(k)));
  }
}

template <class S>
void Workspace<S>::invert_block(const BlockStorage<S>& in, BlockStorage<S>& out, int k, const Space& space) {
  const int n = out.rows[k];
  factor_block(in, k, space);
  std::fill_n(out.at(k), size_t(n) * n, S(0));
  for (int i = 0; i < n; ++i) out.at(k)[i * n + i] = S(1);
  product_.resize(std::max(product_.size(), size_t(n) * n));
  lu_.solve(out.at(k), n, product_.data());
}

// A function of a vector, or the lower half of a block.
template <class S>
void Workspace<S>::function_block(const Step& s, const std::vector<SkoValues<S>*>& values, int k) {
  BlockStorage<S>& out = blocks_[s.out];
  if (s.context >= 0) {
    gathered_.clear();
    elimination::for_rows(plan_->registers[s.in[0]].space, k, [&](int, int row) { gathered_.push_back(numbers(s.in[0])[row]); });
    values[s.context]->function_block(s.symbol, k, gathered_.data(), out.at(k));
    return;
  }
  const S* in = blocks_[s.in[0]].at(k);
  const int n = out.rows[k];
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) out.at(k)[i * n + j] = i > j ? in[i * n + j] : i == j ? in[i * n + j] / S(2) : S(0);
}

template <class S>
void Workspace<S>::blocks_of_dense(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts) {
  ++(s.tier == 4 ? counts.dense : counts.kernels);
  std::vector<S> A;
  operand_as_matrix(s, values, A, counts);
  BlockStorage<S>& b = blocks_[s.out];
  const int columns = s.operand->domain.dimension();
  for (size_t k = 0; k < b.rows.size(); ++k)
    elimination::for_rows(s.operand->codomain, static_cast<int>(k), [&](int i, int row) {
      elimination::for_rows(s.operand->domain, static_cast<int>(k),
                            [&](int j, int column) { b.at(static_cast<int>(k))[i * b.columns[k] + j] = A[size_t(row) * columns + column]; });
    });
}

template <class S>
void Workspace<S>::factor_block(const BlockStorage<S>& b, int k, const Space& space) {
  if (b.rows[k] != b.columns[k])
    throw EvaluationError("block " + std::to_string(k) + " of " + plan_->text + " has " + std::to_string(b.rows[k]) + " x " + std::to_string(b.columns[k]) +
                          " entries: it is not square and cannot be factored");
  block_.assign(b.at(k), b.at(k) + size_t(b.rows[k]) * b.columns[k]);
  if (!lu_.factor(block_.data(), b.rows[k], nullptr))
    throw SingularOperatorError("block '" + space.layout().blocks[space.layout().of_body[k][0]].label + "' of a block-diagonal operator in " + plan_->text +
                                " is singular: it has no inverse at this state");
}

// Y += X B X* (up: Y the parent's block) or X* B X (down: Y the child's), X = E(p,k) or E_ψ(p,k).
template <class S>
void Workspace<S>::add_congruence(const Step& s, const std::vector<SkoValues<S>*>& values, int k, const S* B, S* Y, bool down) {
  static const Symbol edge{&sko_symbol(SymbolId::E), nullptr, nullptr, {}, {}}, gain{&sko_symbol(SymbolId::G), nullptr, nullptr, {}, {}},
      hinge{&sko_symbol(SymbolId::H), nullptr, nullptr, {}, {}};
  const SkoStructure& t = structure(s);
  const int sk = t.size[k], sp = t.size[t.parent[k]], n = t.dof[k];
  block_.resize(size_t(sp) * sk);
  values[s.context]->block(edge, k, block_.data());
  if (s.symbol.definition->id == SymbolId::psi && n > 0) {  // E - (EG)H
    magnitude_.resize(2 * size_t(sk) * n);
    S *g = magnitude_.data(), *h = g + size_t(sk) * n;
    values[s.context]->block(gain, k, g);
    values[s.context]->block(hinge, k, h);
    product_.assign(size_t(sp) * n, S(0));
    multiply_add(block_.data(), g, product_.data(), sp, sk, n);
    multiply_add(product_.data(), h, block_.data(), sp, n, sk, S(-1));
  }
  product_.assign(size_t(sp) * sk, S(0));
  if (!down) {
    multiply_add(block_.data(), B, product_.data(), sp, sk, sk);
    multiply_transposed_add(product_.data(), block_.data(), Y, sp, sk, sp);
  } else {
    multiply_add(B, block_.data(), product_.data(), sp, sp, sk);
    transposed_multiply_add(block_.data(), product_.data(), Y, sk, sp, sk);
  }
}

// Lower Cholesky factor; a semidefinite block is let through (zero columns), an indefinite one is not.
template <class S>
void Workspace<S>::root_block(const BlockStorage<S>& in, BlockStorage<S>& out, int k) {
  using std::sqrt;
  const int n = in.rows[k];
  const S* A = in.at(k);
  S* L = out.at(k);
  std::fill_n(L, size_t(n) * n, S(0));
  S largest = S(0);
  for (int i = 0; i < n; ++i) largest = maximum(largest, A[i * n + i]);
  for (int j = 0; j < n; ++j) {
    S pivot = A[j * n + j];
    for (int a = 0; a < j; ++a) pivot -= L[j * n + a] * L[j * n + a];
    const S bound = S(16 * n) * epsilon<S>() * largest;
    if (pivot < -bound)
      throw SingularOperatorError("block '" + plan_->registers[0].space.name() + "' number " + std::to_string(k) +
                                  " is not positive semidefinite: it has no square root");
    if (!(pivot > bound)) continue;
    L[j * n + j] = sqrt(pivot);
    for (int i = j + 1; i < n; ++i) {
      S sum = A[i * n + j];
      for (int a = 0; a < j; ++a) sum -= L[i * n + a] * L[j * n + a];
      L[i * n + j] = sum / L[j * n + j];
    }
  }
}

}  // namespace pycraft
