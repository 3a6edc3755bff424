// Steps that make a vector: a sweep, a product, a sum, a solve with factors.
#pragma once

#include "algebra/engine/workspace.h"

namespace pycraft {

template <class S>
void Workspace<S>::vector_step(const Step& s, const std::vector<SkoValues<S>*>& values, int m, PassCounts& counts) {
  switch (s.kind) {
    case StepKind::gather:
    case StepKind::scatter:
      ++(s.kind == StepKind::gather ? counts.gathers : counts.scatters);
      values[s.context]->sweep(s.symbol.definition->id, s.kind == StepKind::scatter, vectors_[s.in[0]].data(), vectors_[s.out].data(), width(s.in[0], m));
      return;
    case StepKind::apply_symbol:
      values[s.context]->apply(s.symbol, s.transposed, s.inverted, vectors_[s.in[0]].data(), vectors_[s.out].data(), width(s.in[0], m));
      return;
    case StepKind::apply_blocks: return apply_block_register(s, width(s.in[1], m));
    case StepKind::apply_constant: return apply_constant(s, width(s.in[0], m));
    case StepKind::apply_column: return apply_column(s, width(s.in[1], m));
    case StepKind::apply_external: return apply_external_operator(s, width(s.in[0], m));
    case StepKind::combine: return combine(s);
    case StepKind::vector_symbol:
      if (s.constant)
        std::transform(s.constant->dense.begin(), s.constant->dense.end(), vectors_[s.out].begin(), [](double v) { return S(v); });
      else
        values[s.context]->vector(s.symbol, vectors_[s.out].data());
      return;
    case StepKind::zero: std::fill(vectors_[s.out].begin(), vectors_[s.out].end(), S(0)); return;
    case StepKind::solve: return solve_realization(s, values, width(s.in[1], m));
    case StepKind::mass_matrix:
    case StepKind::mass_matrix_solve: ++counts.kernels; return apply_mass_matrix(s, values, width(s.in[0], m));
    case StepKind::mass_matrix_solve_tangent: ++counts.kernels; return solve_mass_matrix_tangent(s, values, width(s.in[0], m), counts);
    case StepKind::dense_solve: return solve_dense(s, width(s.in[1], m));
    case StepKind::diagonal_of_blocks: return read_diagonal(s);
    default: return;
  }
}

template <class S>
void Workspace<S>::apply_constant(const Step& s, int w) {
  const int r = rows(s.out), c = rows(s.in[0]);
  const S* x = vectors_[s.in[0]].data();
  S* y = vectors_[s.out].data();
  std::fill_n(y, size_t(r) * w, S(0));
  for (int i = 0; i < r; ++i)
    for (int j = 0; j < c; ++j) {
      const S a = S(s.transposed ? s.constant->dense[size_t(j) * r + i] : s.constant->dense[size_t(i) * c + j]);
      if (a == S(0)) continue;
      for (int k = 0; k < w; ++k) y[size_t(i) * w + k] += a * x[size_t(j) * w + k];
    }
}

template <class S>
void Workspace<S>::apply_column(const Step& s, int w) {
  const S *v = vectors_[s.in[0]].data(), *x = vectors_[s.in[1]].data();
  S* y = vectors_[s.out].data();
  if (s.transposed) {
    std::fill_n(y, w, S(0));
    for (int i = 0; i < rows(s.in[0]); ++i)
      for (int k = 0; k < w; ++k) y[k] += v[i] * x[size_t(i) * w + k];
  } else {
    for (int i = 0; i < rows(s.in[0]); ++i)
      for (int k = 0; k < w; ++k) y[size_t(i) * w + k] = v[i] * x[k];
  }
}

template <class S>
void Workspace<S>::combine(const Step& s) {
  const size_t n = vectors_[s.out].size();
  S* y = vectors_[s.out].data();
  for (size_t t = 0; t < s.in.size(); ++t) {
    const S* x = vectors_[s.in[t]].data();
    const S c = S(s.coefficients[t]);
    if (t == 0)
      for (size_t i = 0; i < n; ++i) y[i] = c * x[i];
    else
      for (size_t i = 0; i < n; ++i) y[i] += c * x[i];
  }
}

template <class S>
void Workspace<S>::apply_block_register(const Step& s, int w) {
  const BlockStorage<S>& b = blocks_[s.in[0]];
  const Register& reg = plan_->registers[s.in[0]];
  const S* x = vectors_[s.in[1]].data();
  S* y = vectors_[s.out].data();
  for (size_t kk = 0; kk < b.rows.size(); ++kk) {
    const int k = static_cast<int>(kk);
    elimination::for_rows(reg.space, k, [&](int i, int row) {
      S* target = y + size_t(row) * w;
      std::fill_n(target, w, S(0));
      elimination::for_rows(reg.columns, k, [&](int j, int column) {
        const S a = b.at(k)[i * b.columns[kk] + j];
        const S* source = x + size_t(column) * w;
        for (int c = 0; c < w; ++c) target[c] += a * source[c];
      });
    });
  }
}

template <class S>
void Workspace<S>::apply_external_operator(const Step& s, int w) {
  if constexpr (std::is_same_v<S, double>) {
    const auto& f = s.transposed ? s.external->apply_transposed : s.external->apply;
    if (!f) throw EvaluationError("the operator '" + s.external->name + "' has no " + (s.transposed ? "transpose" : "product"));
    f(vectors_[s.in[0]].data(), vectors_[s.out].data(), w);
  } else {
    throw EvaluationError("the operator '" + s.external->name + "' comes from outside and computes in double precision only");
  }
}

template <class S>
void Workspace<S>::apply_mass_matrix(const Step& s, const std::vector<SkoValues<S>*>& values, int w) {
  scratch_.resize(std::max(scratch_.size(), size_t(plan_->contexts[s.context].source->structure().dimension()) * w));
  if (s.kind == StepKind::mass_matrix)
    values[s.context]->mass_matrix(s.flag, vectors_[s.in[0]].data(), vectors_[s.out].data(), w, scratch_.data());
  else
    solve_mass_matrix(s, values, w);
}

template <class S>
void Workspace<S>::solve_dense(const Step& s, int w) {
  vectors_[s.out] = vectors_[s.in[1]];
  if (gram_[s.in[0]]) return gram_[s.in[0]]->solve(vectors_[s.out].data(), w);
  scratch_.resize(std::max(scratch_.size(), vectors_[s.out].size()));
  dense_factors(s.in[0]).solve(vectors_[s.out].data(), w, scratch_.data());
}

template <class S>
void Workspace<S>::read_diagonal(const Step& s) {
  const BlockStorage<S>& b = blocks_[s.in[0]];
  for (size_t k = 0; k < b.rows.size(); ++k)
    elimination::for_rows(plan_->registers[s.in[0]].space, static_cast<int>(k),
                          [&](int i, int row) { vectors_[s.out][row] = b.at(static_cast<int>(k))[i * b.columns[k] + i]; });
}

}  // namespace pycraft
