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
      values[s.context]->sweep(s.symbol.definition->id, s.kind == StepKind::scatter, numbers(s.in[0]), numbers(s.out), width(s.in[0], m));
      return;
    case StepKind::apply_symbol:
      values[s.context]->apply(s.symbol, s.transposed, s.inverted, numbers(s.in[0]), numbers(s.out), width(s.in[0], m));
      return;
    case StepKind::apply_blocks: return apply_block_register(s, width(s.in[1], m));
    case StepKind::apply_constant: return apply_constant(s, width(s.in[0], m));
    case StepKind::apply_column: return apply_column(s, width(s.in[1], m));
    case StepKind::apply_external: return apply_external_operator(s, width(s.in[0], m));
    case StepKind::combine: return combine(s, size_t(rows(s.out)) * width(s.out, m));
    case StepKind::vector_symbol:
      if (s.constant)
        std::transform(s.constant->dense.begin(), s.constant->dense.end(), numbers(s.out), [](double v) { return S(v); });
      else
        values[s.context]->vector(s.symbol, numbers(s.out));
      return;
    case StepKind::zero: std::fill_n(numbers(s.out), size_t(rows(s.out)) * width(s.out, m), S(0)); return;
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
  const S* x = numbers(s.in[0]);
  S* y = numbers(s.out);
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
  const S *v = numbers(s.in[0]), *x = numbers(s.in[1]);
  S* y = numbers(s.out);
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
void Workspace<S>::combine(const Step& s, size_t n) {
  S* y = numbers(s.out);
  for (size_t t = 0; t < s.in.size(); ++t) {
    const S* x = numbers(s.in[t]);
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
  const S* x = numbers(s.in[1]);
  S* y = numbers(s.out);
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
    f(numbers(s.in[0]), numbers(s.out), w);
  } else {
    throw EvaluationError("the operator '" + s.external->name + "' comes from outside and computes in double precision only");
  }
}

template <class S>
void Workspace<S>::apply_mass_matrix(const Step& s, const std::vector<SkoValues<S>*>& values, int w) {
  scratch_.resize(std::max(scratch_.size(), size_t(plan_->contexts[s.context].source->structure().dimension()) * w));
  if (s.kind == StepKind::mass_matrix)
    values[s.context]->mass_matrix(s.flag, numbers(s.in[0]), numbers(s.out), w, scratch_.data());
  else
    solve_mass_matrix(s, values, w);
}

template <class S>
void Workspace<S>::solve_dense(const Step& s, int w) {
  const size_t size = size_t(rows(s.out)) * w;
  S* y = numbers(s.out);
  std::copy_n(numbers(s.in[1]), size, y);
  if (gram_[s.in[0]]) return gram_[s.in[0]]->solve(y, w);
  scratch_.resize(std::max(scratch_.size(), size));
  dense_factors(s.in[0]).solve(y, w, scratch_.data());
}

template <class S>
void Workspace<S>::read_diagonal(const Step& s) {
  const BlockStorage<S>& b = blocks_[s.in[0]];
  for (size_t k = 0; k < b.rows.size(); ++k)
    elimination::for_rows(plan_->registers[s.in[0]].space, static_cast<int>(k),
                          [&](int i, int row) { numbers(s.out)[row] = b.at(static_cast<int>(k))[i * b.columns[k] + i]; });
}

}  // namespace pycraft
