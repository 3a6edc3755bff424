// Steps that make a number: traces, logarithms of determinants, sums.
#pragma once

#include "algebra/engine/workspace.h"

namespace pycraft {

template <class S>
void Workspace<S>::scalar_step(const Step& s, const std::vector<SkoValues<S>*>& values) {
  switch (s.kind) {
    case StepKind::trace_of_blocks:
    case StepKind::root_of_trace: {
      const BlockStorage<S>& b = blocks_[s.in[0]];
      S sum = S(0);
      for (size_t k = 0; k < b.rows.size(); ++k)
        for (int i = 0; i < b.rows[k]; ++i) sum += b.at(static_cast<int>(k))[i * b.columns[k] + i];
      using std::sqrt;
      scalars_[s.out] = s.kind == StepKind::trace_of_blocks ? sum : sqrt(maximum(sum, S(0)));
      return;
    }
    case StepKind::logdet_of_blocks: {
      const BlockStorage<S>& b = blocks_[s.in[0]];
      Magnitude<S> all;
      for (size_t k = 0; k < b.rows.size(); ++k) {
        factor_block(b, static_cast<int>(k), plan_->registers[s.in[0]].space);
        all.multiply(lu_.determinant());
      }
      scalars_[s.out] = all.log();
      return;
    }
    case StepKind::logdet_of_D: scalars_[s.out] = values[s.context]->log_determinant_of_D(); return;
    case StepKind::logdet_of_factor:
      with_factors(s.in[0], [&](const auto& factors) { scalars_[s.out] = static_cast<S>(factors.log_abs_determinant()); });
      return;
    case StepKind::logdet_of_dense: scalars_[s.out] = (gram_[s.in[0]] ? gram_[s.in[0]]->determinant() : dense_lu_[s.in[0]].determinant()).log(); return;
    case StepKind::combine_scalars: {
      S sum = S(s.coefficients.back());
      for (size_t i = 0; i < s.in.size(); ++i) sum += S(s.coefficients[i]) * scalars_[s.in[i]];
      scalars_[s.out] = sum;
      return;
    }
    default: return;  // a norm is taken by the pool, over all columns
  }
}

}  // namespace pycraft
