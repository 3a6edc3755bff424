// The memory of a plan's runs at one scalar, and its steps: each does one sweep, one product, one factorization.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algebra/engine/elimination/elimination.h"
#include "algebra/engine/engine.h"
#include "algebra/language/values.h"
#include "numerics/gram_factors.h"
#include "numerics/refinement.h"
#include "numerics/small_lu.h"
#include "runtime/errors.h"

namespace pycraft {

// Columns of the identity that dense requests take at a time: bounds the memory of a run.
constexpr int columns_at_a_time = 64;

template <class S>
class Workspace {
 public:
  // of an operand's plan: `whole` holds the factors that it shares
  explicit Workspace(std::shared_ptr<const Plan> plan, Workspace* whole = nullptr) : plan_(std::move(plan)), whole_(whole ? whole : this), vectors_(plan_->registers.size()), blocks_(plan_->registers.size()),
                                                         scalars_(plan_->registers.size(), S(0)), dense_(plan_->registers.size()) {
    eliminations_.resize(plan_->registers.size());
    dense_lu_.resize(plan_->registers.size());
    gram_.resize(plan_->registers.size());
    for (size_t r = 0; r < plan_->registers.size(); ++r) {
      const Register& reg = plan_->registers[r];
      if (reg.kind == RegisterKind::blocks) blocks_[r].shape(reg.space, reg.columns);
    }
    for (const Step& s : plan_->steps)
      functions_of_vectors_ |= s.kind == StepKind::function_blocks && plan_->registers[s.in[0]].kind == RegisterKind::vector;
    for (const Step& s : plan_->steps)
      if (s.operand) operands_.emplace_back(&s, std::make_unique<Workspace>(s.operand, s.kind == StepKind::dense_factor && !s.flag ? whole_ : nullptr));
  }

  // Steps that make no vector (blocks, factors, scalars) run only where the values changed.
  void run(const std::vector<SkoValues<S>*>& values, int columns, bool values_changed, PassCounts& counts) {
    for (size_t r = 0; r < plan_->registers.size(); ++r) {
      const Register& reg = plan_->registers[r];
      if (reg.kind == RegisterKind::vector) vectors_[r].resize(size_t(reg.space.dimension()) * (reg.wide ? columns : 1));
    }
    for (const Step& s : plan_->steps) {
      if (&s != plan_->steps.data()) check_interrupt();
      const bool per_column = s.out >= 0 && plan_->registers[s.out].kind == RegisterKind::vector;
      // a function of a vector, and what is made of it, may hang on a named vector
      if (!values_changed && !per_column && !functions_of_vectors_) continue;
      step(s, values, columns, counts);
    }
  }

  std::vector<S>& vector(int r) { return vectors_[r]; }
  BlockStorage<S>& blocks(int r) { return blocks_[r]; }
  std::vector<S>& dense(int r) { return dense_[r]; }
  S& scalar(int r) { return scalars_[r]; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void step(const Step& s, const std::vector<SkoValues<S>*>& values, int m, PassCounts& counts) {
    const Plan& plan = *plan_;
    const auto rows = [&](int r) { return plan.registers[r].space.dimension(); };
    switch (s.kind) {
      case StepKind::values:
        ++counts.values;
        return;  // done before the run
      case StepKind::gather:
      case StepKind::scatter:
        ++(s.kind == StepKind::gather ? counts.gathers : counts.scatters);
        values[s.context]->sweep(static_cast<SymbolId>(s.symbol.definition->id), s.kind == StepKind::scatter, vectors_[s.in[0]].data(),
                                 vectors_[s.out].data(), width(s.in[0], m));
        return;
      case StepKind::apply_symbol:
        values[s.context]->apply(s.symbol, s.transposed, s.inverted, vectors_[s.in[0]].data(), vectors_[s.out].data(), width(s.in[0], m));
        return;
      case StepKind::apply_blocks: apply_block_register(s, width(s.in[1], m)); return;
      case StepKind::apply_constant: {
        const int r = rows(s.out), c = rows(s.in[0]), w = width(s.in[0], m);
        const S* x = vectors_[s.in[0]].data();
        S* y = vectors_[s.out].data();
        std::fill_n(y, size_t(r) * w, S(0));
        for (int i = 0; i < r; ++i)
          for (int j = 0; j < c; ++j) {
            const S a = S(s.transposed ? s.constant->dense[size_t(j) * r + i] : s.constant->dense[size_t(i) * c + j]);
            if (a == S(0)) continue;
            for (int k = 0; k < w; ++k) y[size_t(i) * w + k] += a * x[size_t(j) * w + k];
          }
        return;
      }
      case StepKind::apply_column: {
        const int w = width(s.in[1], m);
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
        return;
      }
      case StepKind::apply_external: apply_external_operator(s, width(s.in[0], m)); return;
      case StepKind::combine: {
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
        return;
      }
      case StepKind::vector_symbol:
        if (s.constant)
          std::transform(s.constant->dense.begin(), s.constant->dense.end(), vectors_[s.out].begin(), [](double v) { return S(v); });
        else
          values[s.context]->vector(s.symbol, vectors_[s.out].data());
        return;
      case StepKind::zero: std::fill(vectors_[s.out].begin(), vectors_[s.out].end(), S(0)); return;
      case StepKind::load_blocks:
      case StepKind::identity_blocks:
      case StepKind::multiply_blocks:
      case StepKind::combine_blocks:
      case StepKind::transpose_blocks:
      case StepKind::invert_blocks:
      case StepKind::root_blocks:
      case StepKind::function_blocks:
      case StepKind::congruence_blocks:
      case StepKind::lyapunov_blocks: block_step(s, values); return;
      case StepKind::factor: {
        ++counts.eliminations;
        eliminate(s, values, counts);
        return;
      }
      case StepKind::solve:
        solve_realization(s, values, width(s.in[1], m));
        return;
      case StepKind::selected_blocks:
        with_factors(s.in[0], [&](auto& factors) { factors.selected(blocks_[s.out]); });
        return;
      case StepKind::mass_matrix:
      case StepKind::mass_matrix_solve: {
        ++counts.kernels;
        const int w = width(s.in[0], m);
        scratch_.resize(std::max(scratch_.size(), size_t(plan.contexts[s.context].source->structure().dimension()) * w));
        if (s.kind == StepKind::mass_matrix)
          values[s.context]->mass_matrix(s.flag, vectors_[s.in[0]].data(), vectors_[s.out].data(), w, scratch_.data());
        else
          solve_mass_matrix(s, values, w);
        return;
      }
      case StepKind::mass_matrix_solve_tangent:
        ++counts.kernels;
        solve_mass_matrix_tangent(s, values, width(s.in[0], m), counts);
        return;
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
        if (!dense_lu_[s.out].factor(A.data(), n, nullptr)) throw SingularOperatorError(plan.text + ": singular at this state");
        return;
      }
      case StepKind::dense_solve: {
        const int w = width(s.in[1], m);
        vectors_[s.out] = vectors_[s.in[1]];
        if (gram_[s.in[0]]) return gram_[s.in[0]]->solve(vectors_[s.out].data(), w);
        scratch_.resize(std::max(scratch_.size(), vectors_[s.out].size()));
        dense_factors(s.in[0]).solve(vectors_[s.out].data(), w, scratch_.data());
        return;
      }
      case StepKind::blocks_of_dense: {
        ++(s.tier == 4 ? counts.dense : counts.kernels);
        std::vector<S> A;
        operand_as_matrix(s, values, A, counts);
        BlockStorage<S>& b = blocks_[s.out];
        const int columns = s.operand->domain.dimension();
        for (size_t k = 0; k < b.rows.size(); ++k)
          elimination::for_rows(s.operand->codomain, static_cast<int>(k), [&](int i, int row) {
            elimination::for_rows(s.operand->domain, static_cast<int>(k), [&](int j, int column) {
              b.at(static_cast<int>(k))[i * b.columns[k] + j] = A[size_t(row) * columns + column];
            });
          });
        return;
      }
      case StepKind::gather_blocks: {
        const BlockStorage<S>& b = blocks_[s.in[0]];
        const Register& reg = plan.registers[s.in[0]];
        const int columns = reg.columns.dimension();
        dense_[s.out].assign(size_t(reg.space.dimension()) * columns, S(0));
        for (size_t k = 0; k < b.rows.size(); ++k)
          elimination::for_rows(reg.space, static_cast<int>(k), [&](int i, int row) {
            elimination::for_rows(reg.columns, static_cast<int>(k), [&](int j, int column) {
              dense_[s.out][size_t(row) * columns + column] = b.at(static_cast<int>(k))[i * b.columns[k] + j];
            });
          });
        return;
      }
      case StepKind::diagonal_of_blocks: {
        const BlockStorage<S>& b = blocks_[s.in[0]];
        for (size_t k = 0; k < b.rows.size(); ++k)
          elimination::for_rows(plan.registers[s.in[0]].space, static_cast<int>(k),
                                [&](int i, int row) { vectors_[s.out][row] = b.at(static_cast<int>(k))[i * b.columns[k] + i]; });
        return;
      }
      case StepKind::trace_of_blocks:
      case StepKind::root_of_trace: {
        const BlockStorage<S>& b = blocks_[s.in[0]];
        S sum = S(0);
        for (size_t k = 0; k < b.rows.size(); ++k)
          for (int i = 0; i < b.rows[k]; ++i) sum += b.at(static_cast<int>(k))[i * b.columns[k] + i];
        using std::sqrt;
        scalars_[s.out] = s.kind == StepKind::trace_of_blocks ? sum : sqrt(std::max(sum, S(0)));
        return;
      }
      case StepKind::logdet_of_blocks: {
        const BlockStorage<S>& b = blocks_[s.in[0]];
        Magnitude<S> all;
        for (size_t k = 0; k < b.rows.size(); ++k) {
          factor_block(b, static_cast<int>(k), plan.registers[s.in[0]].space);
          all.multiply(lu_.determinant());
        }
        scalars_[s.out] = all.log();
        return;
      }
      case StepKind::logdet_of_D: scalars_[s.out] = values[s.context]->log_determinant_of_D(); return;
      case StepKind::logdet_of_factor:
        with_factors(s.in[0], [&](const auto& factors) { scalars_[s.out] = static_cast<S>(factors.log_abs_determinant()); });
        return;
      case StepKind::logdet_of_dense:
        scalars_[s.out] = (gram_[s.in[0]] ? gram_[s.in[0]]->determinant() : dense_lu_[s.in[0]].determinant()).log();
        return;
      case StepKind::norm_of_vector: return;  // taken by the pool over all columns_at_a_times
      case StepKind::combine_scalars: {
        S sum = S(s.coefficients.back());
        for (size_t i = 0; i < s.in.size(); ++i) sum += S(s.coefficients[i]) * scalars_[s.in[i]];
        scalars_[s.out] = sum;
        return;
      }
    }
  }

  SmallLU<S>& dense_factors(int r) {
    const int shared = plan_->registers[r].shared;
    return shared < 0 ? dense_lu_[r] : whole_->dense_lu_[shared];
  }

  void factor_gram(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts) {
    ++counts.kernels;
    operand_as_matrix(s, values, dense_[s.out], counts);
    if (!gram_[s.out]) gram_[s.out].emplace();
    const int rows = s.operand->codomain.dimension(), columns = s.operand->domain.dimension();
    if (!gram_[s.out]->factor(dense_[s.out], rows, columns))
      throw SingularOperatorError(plan_->text + " is singular at this state: " + std::to_string(rows) + " coordinates do not move its " +
                                  std::to_string(columns) + " rows independently, to working precision");
  }

  int width(int r, int m) const { return plan_->registers[r].wide ? m : 1; }

  void factor_block(const BlockStorage<S>& b, int k, const Space& space) {
    block_.assign(b.at(k), b.at(k) + size_t(b.rows[k]) * b.columns[k]);
    if (!lu_.factor(block_.data(), b.rows[k], nullptr))
      throw SingularOperatorError("block '" + space.layout().blocks[space.layout().of_body[k][0]].label + "' of a block-diagonal operator in " +
                                  plan_->text + " is singular: it has no inverse at this state");
  }

  void apply_block_register(const Step& s, int w) {
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

  // Body by body in S; where that loses digits and the model is too large for one front, in quad.
  void eliminate(const Step& s, const std::vector<SkoValues<S>*>& values, PassCounts& counts) {
    const auto blocks = [&](int r) -> const BlockStorage<S>& { return blocks_[r]; };
    const auto numbers = [&](int c) -> const SkoValues<S>& { return *values[c]; };
    const auto note = [&](const std::string& text) {
      if (std::find(notes_.begin(), notes_.end(), text) == notes_.end()) notes_.push_back(text);
    };
    auto& [own, wide] = eliminations_[s.out];
    if (!own) own = std::make_unique<TreeElimination<S>>(s.realization);
    wide.reset();
    const bool solved = own->factor(blocks, numbers);
    if (solved) {
      counts.dense += own->dense();
      if (!own->note().empty()) note(own->note());
      return;
    }
    const std::string reason = own->note();
    if constexpr (std::numeric_limits<S>::digits < std::numeric_limits<Quad>::digits) {
      wide = std::make_unique<TreeElimination<Quad>>(s.realization);
      if (wide->factor(blocks, numbers, Quad(1e7) * Quad(epsilon<S>()))) return note("quad: " + reason + "; eliminated in quad precision");
    }
    throw SingularOperatorError((wide ? wide->note() : reason) + ": it counts as singular at this state");
  }

  template <class F>
  void with_factors(int r, F f) {
    auto& [own, wide] = eliminations_[r];
    if (wide)
      f(*wide);
    else
      f(*own);
  }

  // ---- refinement, asked for by the binding of a context
  // Of what spans several bindings: the most that one of them asks for.
  Refinement refinement() const {
    Refinement r;
    for (const Context& c : plan_->contexts) {
      if (!c.binding) continue;
      const Refinement& own = c.binding->arithmetic.refinement;
      r.residual = std::max(r.residual, own.residual);
      r.steps = own.steps == Refinement::automatic || r.steps == Refinement::automatic ? Refinement::automatic : std::max(r.steps, own.steps);
    }
    return r;
  }
  // This plan one scalar up, at the state of these values: everything but the factors, where they serve solves alone.
  void follow(const std::vector<SkoValues<S>*>& values) {
    if (!wide_) wide_ = std::make_unique<Workspace<Wider<S>>>(plan_);
    std::vector<std::uint64_t> now;
    for (const SkoValues<S>* v : values) now.push_back(v->generation());
    if (now == followed_) return;
    followed_ = now;
    wide_values_.resize(values.size());
    wide_at_.clear();
    for (size_t c = 0; c < values.size(); ++c) {
      const SkoSource& source = *plan_->contexts[c].source;
      const Binding* b = plan_->contexts[c].binding.get();
      if (!wide_values_[c]) {
        wide_values_[c] = source.make_values(Wider<S>());
        if (b) wide_values_[c]->use(b->arithmetic.form);
      }
      if (b) {
        const size_t at = b->batch < 0 ? 0 : size_t(state);
        wide_values_[c]->move_to(b->q.data() + at * b->nq, b->v.data() + at * b->nv);
      } else {
        const auto now = source.state();
        wide_values_[c]->move_to(now->q.data(), now->v.data());
      }
      wide_values_[c]->require(plan_->groups[c] | Group::kinematics);
      wide_at_.push_back(wide_values_[c].get());
    }
    wide_->run_as(*this, wide_at_);
  }
  template <class T>
  void run_as(const Workspace<T>& narrow, const std::vector<SkoValues<S>*>& values) {
    PassCounts counts;
    for (const Step& s : plan_->steps) {
      if (s.out >= 0 && plan_->registers[s.out].kind == RegisterKind::vector) continue;
      const bool solves_only = s.kind == StepKind::factor && std::none_of(plan_->steps.begin(), plan_->steps.end(), [&](const Step& t) {
        return (t.kind == StepKind::selected_blocks || t.kind == StepKind::logdet_of_factor) && t.in[0] == s.out;
      });
      if (!solves_only) {
        step(s, values, 1, counts);
        continue;
      }
      auto& own = eliminations_[s.out].own;
      if (!own) own = std::make_unique<TreeElimination<S>>(s.realization);
      own->assemble_as(*narrow.eliminations_[s.out].own, [&](int r) -> const BlockStorage<S>& { return blocks_[r]; },
                       [&](int c) -> const SkoValues<S>& { return *values[c]; });
    }
  }
  // Residuals of eliminated systems are formed one scalar up, whatever was asked for: their own rounding is soon all that is left in
  // those of the same scalar, no adjoint solve tells when, and beside the elimination they cost little.
  void solve_realization(const Step& s, const std::vector<SkoValues<S>*>& values, int w) {
    const Refinement how = refinement();
    const S* x = vectors_[s.in[1]].data();
    S* y = vectors_[s.out].data();
    const auto blocks = [&](int r) -> const BlockStorage<S>& { return blocks_[r]; };
    if (how.steps == 0 || std::is_same_v<S, Wider<S>> || eliminations_[s.in[0]].wide)
      return with_factors(s.in[0], [&](auto& factors) { factors.solve(x, y, w, blocks, how); });
    follow(values);
    auto& wide = *wide_->eliminations_[s.in[0]].own;
    eliminations_[s.in[0]].own->solve(x, y, w, blocks, how, [&](const S* b, const S* solution, S* r) {
      wide.residual(b, solution, r, w, [&](int i) -> const BlockStorage<Wider<S>>& { return wide_->blocks_[i]; });
    });
  }
  void solve_mass_matrix(const Step& s, const std::vector<SkoValues<S>*>& values, int w) {
    const SkoValues<S>& own = *values[s.context];
    const S* x = vectors_[s.in[0]].data();
    S* y = vectors_[s.out].data();
    own.mass_matrix_inverse(x, y, w, scratch_.data());
    const Binding* binding = plan_->contexts[s.context].binding.get();
    if (!binding || binding->arithmetic.refinement.steps == 0) return;
    Refinement how = binding->arithmetic.refinement;
    if (how.gathers_wider() && !own.gathers_wider()) how.residual = ResidualPrecision::wider;
    const int n = plan_->registers[s.out].space.dimension();
    const size_t size = size_t(n) * w;
    if (how.wider()) follow(values);
    const auto residual = [&](const S* solution, S* r) {
      if (how.gathers_wider()) {
        own.gathered_residual(solution, x, r, w, scratch_.data(), wide_scratch_);
      } else if (how.wider()) {
        convert(solution, size, wide_x_);
        wide_y_.resize(size), wide_scratch_.resize(std::max(wide_scratch_.size(), scratch_.size()));
        wide_at_[s.context]->mass_matrix(true, wide_x_.data(), wide_y_.data(), w, wide_scratch_.data());
        for (size_t i = 0; i < size; ++i) r[i] = static_cast<S>(Wider<S>(x[i]) - wide_y_[i]);
      } else {
        own.mass_matrix(true, solution, r, w, scratch_.data());
        for (size_t i = 0; i < size; ++i) r[i] = x[i] - r[i];
      }
    };
    refine(y, n, w, how, binding->arithmetic.form, S(0), [&] { return plan_->text; }, residual,
           [&](const S* r, S* d) { own.mass_matrix_inverse(r, d, w, scratch_.data()); },
           [&](const S* direction, S* rounding) {
             own.mass_matrix_rounding(y, x, direction, units_of<S>(how), rounding, w, sizes_);
           },
           refinement_);
  }

  void solve_mass_matrix_tangent(const Step& s, const std::vector<SkoValues<S>*>& values, int w, PassCounts& counts) {
    auto [known, fresh] = tangents_.try_emplace(s.out);
    if (fresh) known->second = values[s.context]->inverse_tangent();
    if (known->second && known->second->apply(*values[s.context], s.symbol, vectors_[s.in[0]].data(), vectors_[s.out].data(), w)) return;
    Workspace& typed = operand_workspace(s);
    typed.vector(s.operand->input) = vectors_[s.in[0]];
    typed.run(operand_values(s, values), w, true, counts);
    vectors_[s.out] = typed.vector(s.operand->output);
  }

  Workspace& operand_workspace(const Step& s) {
    Workspace* w = nullptr;
    for (auto& [step, workspace] : operands_)
      if (step == &s) w = workspace.get();
    w->state = state;
    return *w;
  }
  std::vector<SkoValues<S>*> operand_values(const Step& s, const std::vector<SkoValues<S>*>& values) const {
    std::vector<SkoValues<S>*> own;
    for (const Context& c : s.operand->contexts) own.push_back(values[std::find(plan_->contexts.begin(), plan_->contexts.end(), c) - plan_->contexts.begin()]);
    return own;
  }

  void apply_external_operator(const Step& s, int w) {
    if constexpr (std::is_same_v<S, double>) {
      const auto& f = s.transposed ? s.external->apply_transposed : s.external->apply;
      if (!f) throw EvaluationError("the operator '" + s.external->name + "' has no " + (s.transposed ? "transpose" : "product"));
      f(vectors_[s.in[0]].data(), vectors_[s.out].data(), w);
    } else {
      throw EvaluationError("the operator '" + s.external->name + "' comes from outside and computes in double precision only");
    }
  }

  void operand_as_matrix(const Step& s, const std::vector<SkoValues<S>*>& values, std::vector<S>& A, PassCounts& counts) {
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

  void block_step(const Step& s, const std::vector<SkoValues<S>*>& values) {
    BlockStorage<S>& out = blocks_[s.out];
    const int bodies = static_cast<int>(out.rows.size());
    const auto in = [&](int i) -> const BlockStorage<S>& { return blocks_[s.in[i]]; };
    switch (s.kind) {
      case StepKind::load_blocks:
        for (int k = 0; k < bodies; ++k) {
          if (out.rows[k] == 0 || out.columns[k] == 0) continue;
          if (s.constant)
            std::transform(s.constant->blocks[k].begin(), s.constant->blocks[k].end(), out.at(k), [](double v) { return S(v); });
          else
            values[s.context]->block(s.symbol, k, out.at(k));
        }
        return;
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
        for (int k = 0; k < bodies; ++k) {
          const int n = out.rows[k];
          factor_block(in(0), k, plan_->registers[s.in[0]].space);
          std::fill_n(out.at(k), size_t(n) * n, S(0));
          for (int i = 0; i < n; ++i) out.at(k)[i * n + i] = S(1);
          product_.resize(std::max(product_.size(), size_t(n) * n));
          lu_.solve(out.at(k), n, product_.data());
        }
        return;
      case StepKind::root_blocks:
        for (int k = 0; k < bodies; ++k) root_block(in(0), out, k);
        return;
      case StepKind::function_blocks:
        for (int k = 0; k < bodies; ++k) {
          if (s.context >= 0) {
            const Space& space = plan_->registers[s.in[0]].space;
            gathered_.clear();
            elimination::for_rows(space, k, [&](int, int row) { gathered_.push_back(vectors_[s.in[0]][row]); });
            values[s.context]->function_block(s.symbol, k, gathered_.data(), out.at(k));
          } else {
            const int n = out.rows[k];
            for (int i = 0; i < n; ++i)
              for (int j = 0; j < n; ++j) out.at(k)[i * n + j] = i > j ? in(0).at(k)[i * n + j] : i == j ? in(0).at(k)[i * n + j] / S(2) : S(0);
          }
        }
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
      default: return;
    }
  }

  const SkoStructure& structure(const Step& s) const { return plan_->contexts[s.context].source->structure(); }

  // Y += X B X* (up: Y the parent's block) or X* B X (down: Y the child's), X = E(p,k) or E_ψ(p,k).
  void add_congruence(const Step& s, const std::vector<SkoValues<S>*>& values, int k, const S* B, S* Y, bool down) {
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
  void root_block(const BlockStorage<S>& in, BlockStorage<S>& out, int k) {
    using std::sqrt;
    const int n = in.rows[k];
    const S* A = in.at(k);
    S* L = out.at(k);
    std::fill_n(L, size_t(n) * n, S(0));
    S largest = S(0);
    for (int i = 0; i < n; ++i) largest = std::max(largest, A[i * n + i]);
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

  std::shared_ptr<const Plan> plan_;
  Workspace* whole_;
  std::vector<std::vector<S>> vectors_;
  std::vector<BlockStorage<S>> blocks_;
  bool functions_of_vectors_ = false;
  std::vector<S> scalars_;
  std::vector<std::vector<S>> dense_;
  struct Factors {
    std::unique_ptr<TreeElimination<S>> own;
    std::unique_ptr<TreeElimination<Quad>> wide;
  };
  std::vector<Factors> eliminations_;
  std::vector<SmallLU<S>> dense_lu_;
  std::vector<std::optional<GramFactors<S>>> gram_;
  std::vector<std::pair<const Step*, std::unique_ptr<Workspace>>> operands_;
  std::map<int, std::unique_ptr<InverseTangent<S>>> tangents_;  // by the register that is written
  SmallLU<S> lu_;
  std::vector<S> gathered_, scratch_, block_, product_, magnitude_;
  RefinementWork<S> refinement_;
  ResidualSizes<S> sizes_;
  std::vector<std::string> notes_;
  // one scalar up, for residuals
  template <class T>
  friend class Workspace;
  std::unique_ptr<Workspace<Wider<S>>> wide_;
  std::vector<std::unique_ptr<SkoValues<Wider<S>>>> wide_values_;
  std::vector<SkoValues<Wider<S>>*> wide_at_;
  std::vector<Wider<S>> wide_x_, wide_y_, wide_scratch_;
  std::vector<std::uint64_t> followed_;

 public:
  std::vector<std::unique_ptr<SkoValues<S>>> own_values;  // of batched contexts
  std::vector<ValuesInUse<S>> held;                       // of the others, during a run
  std::vector<SkoValues<S>*> values;                      // of all, during a run
  bool ran = false;
  int state = 0;                                          // of the batch
  std::vector<std::uint64_t> generations;                 // of the values that blocks and factors were made from
};

}  // namespace pycraft
