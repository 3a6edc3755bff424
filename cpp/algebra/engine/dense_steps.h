// Steps that make a dense matrix, or factors: of eliminated realizations, of matrices, of rows taken together.
#pragma once

#include "algebra/engine/workspace.h"

namespace pycraft {

template <class S>
void Workspace<S>::dense_step(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts) {
  switch (s.kind) {
    case StepKind::mass_matrix_dense:
      ++counts.kernels;
      dense_[s.out].resize(size_t(rows(s.out)) * rows(s.out));
      values[s.context]->mass_matrix_dense(s.flag, dense_[s.out].data());
      return;
    case StepKind::dense_factor: {
      if (s.flag) return factor_gram(s, values, counts);
      ++counts.dense;
      std::vector<S>& A = dense_[s.out];
      operand_as_matrix(s, values, A, counts);
      const int n = rows(s.out);
      if (!dense_lu_[s.out].factor(A.data(), n, nullptr)) throw SingularOperatorError(plan_->text + ": singular at this state");
      return;
    }
    case StepKind::gather_blocks: return matrix_of_blocks(s);
    default: return;
  }
}

template <class S>
void Workspace<S>::matrix_of_blocks(const Step& s) {
  const BlockStorage<S>& b = blocks_[s.in[0]];
  const Register& reg = plan_->registers[s.in[0]];
  const int columns = reg.columns.dimension();
  dense_[s.out].assign(size_t(reg.space.dimension()) * columns, S(0));
  for (size_t k = 0; k < b.rows.size(); ++k)
    elimination::for_rows(reg.space, static_cast<int>(k), [&](int i, int row) {
      elimination::for_rows(reg.columns, static_cast<int>(k),
                            [&](int j, int column) { dense_[s.out][size_t(row) * columns + column] = b.at(static_cast<int>(k))[i * b.columns[k] + j]; });
    });
}

template <class S>
void Workspace<S>::factor_gram(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts) {
  ++counts.kernels;
  operand_as_matrix(s, values, dense_[s.out], counts);
  if (!gram_[s.out]) gram_[s.out].emplace();
  const int rows = s.operand->codomain.dimension(), columns = s.operand->domain.dimension();
  if (!gram_[s.out]->factor(dense_[s.out], rows, columns))
    throw SingularOperatorError(plan_->text + " is singular at this state: " + std::to_string(rows) + " coordinates do not move its " +
                                std::to_string(columns) + " rows independently, to working precision");
}

template <class S>
void Workspace<S>::operand_as_matrix(const Step& s, const std::vector<SkoValues<S>*>& values, std::vector<S>& A, PassCounts& counts) {
  Workspace* w = &operand_workspace(s);
  const std::vector<SkoValues<S>*> own = operand_values(s, values);
  const int rows = s.operand->codomain.dimension(), columns = s.operand->domain.dimension();
  A.resize(size_t(rows) * columns);
  for (int start = 0; start < columns; start += columns_at_a_time) {
    const int m = std::min(columns_at_a_time, columns - start);
    std::vector<S>& x = w->vector(s.operand->input);
    x.assign(size_t(columns) * m, S(0));
    for (int j = 0; j < m; ++j) x[size_t(start + j) * m + j] = S(1);
    w->run(own, m, start == 0, counts);
    const std::vector<S>& y = w->vector(s.operand->output);
    for (int i = 0; i < rows; ++i) std::copy_n(y.data() + size_t(i) * m, m, A.data() + size_t(i) * columns + start);
    check_interrupt();
  }
}

// Body by body in S; where that loses digits and the model is too large for one front, in quad.
template <class S>
void Workspace<S>::eliminate(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts) {
  const auto blocks = [&](int r) -> const BlockStorage<S>& { return blocks_[r]; };
  const auto numbers = [&](int c) -> const SkoValues<S>& { return *values[c]; };
  const auto note = [&](const std::string& text) {
    if (std::find(notes_.begin(), notes_.end(), text) == notes_.end()) notes_.push_back(text);
  };
  Factors& factors = eliminations_[s.out];
  auto& own = factors.own;
  auto& wide = factors.wide;
  ++factors.made;
  if (!own) own = std::make_unique<TreeElimination<S>>(s.realization);
  wide.reset();
  const bool solved = own->factor(blocks, numbers);
  if (solved) {
    counts.dense += own->dense();
    if (!own->note().empty()) note(own->note());
    return;
  }
  const std::string reason = own->note();
  if constexpr (!is_recorded<S> && std::numeric_limits<S>::digits < std::numeric_limits<Quad>::digits) {
    wide = std::make_unique<TreeElimination<Quad>>(s.realization);
    if (wide->factor(blocks, numbers, Quad(1e7) * Quad(epsilon<S>()))) return note("quad: " + reason + "; eliminated in quad precision");
  }
  throw SingularOperatorError((wide ? wide->note() : reason) + ": it counts as singular at this state");
}

}  // namespace pycraft
