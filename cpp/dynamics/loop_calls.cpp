#include "dynamics/loop_calls.h"

#include <algorithm>

#include "recursions/loop_columns.h"
#include "recursions/loop_tangents.h"

namespace pycraft {

namespace {

// Of Q̇v of functions, Σ ∂²r/∂q_i∂q_j v_i v_j, the derivatives by q and by v, to be added; third ones are asked for where coordinates move.
template <class S>
void differentiate_functions(const ResolvedLoops& loops, int nv, const S* q, const S* v, S* along_q, S* along_v) {
  for (const ResolvedLoop& loop : loops.loops) {
    if (!loop.loop->coupling.function || std::none_of(loop.v.begin(), loop.v.end(), [&](int j) { return v[j] != S(0); })) continue;
    const size_t n = loop.v.size();
    std::vector<double> at(n), gradient(n), second(n * n), third(n * n * n);
    for (size_t i = 0; i < n; ++i) at[i] = to_double(q[loop.q[i]]);
    double r = 0;
    loop.loop->coupling.function(at.data(), &r, gradient.data(), second.data(), third.data());
    const size_t row = size_t(loop.first_row) * nv;
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j) {
        along_v[row + loop.v[j]] += S(2) * S(second[i * n + j]) * v[loop.v[i]];
        for (size_t k = 0; k < n; ++k) along_q[row + loop.v[k]] += S(third[(i * n + j) * n + k]) * v[loop.v[i]] * v[loop.v[j]];
      }
  }
}

// One state. The rows' own code, with derivatives along one coordinate after the other, then along one velocity after the other.
template <class S>
void differentiate(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* const* given, const double* multipliers, S* out) {
  const int nv = model.nv, rows = loops.rows, size = rows * nv;
  const std::vector<S> q(given[0], given[0] + model.nq), v(given[1], given[1] + nv);
  const S* const vdot = given[2];
  S *const slip = out, *const along_q = slip + size, *const along_v = along_q + size, *const forces = along_v + size;
  std::fill_n(out, 3 * size + nv * nv, S(0));
  using T = typename LoopTangents<S>::T;
  LoopBuffers<T> buffers;
  LoopMotion<S> direction{std::vector<S>(nv, S(0)), {}};
  std::vector<T> moving(v.begin(), v.end()), bias(rows, T(S(0)));
  for (int j = 0; j < nv; ++j) {
    direction.w[j] = S(1);
    const LoopTangents<S> there(model, loops, q, direction);
    there.jacobian([&](int row, int i, const S& number) {
      slip[row * nv + j] += number * v[i], along_q[row * nv + j] += number * vdot[i], forces[i * nv + j] += number * S(multipliers[row]);
    });
    loop_bias(there.model, there.by_rule, there.q.data(), moving.data(), buffers, bias.data());
    for (int row = 0; row < rows; ++row) along_q[row * nv + j] += bias[row].d[0];
    direction.w[j] = S(0);
  }
  const LoopTangents<S> still(model, loops, q, direction);
  for (int j = 0; j < nv; ++j) {
    moving[j].d[0] = S(1);
    loop_bias(still.model, still.by_rule, still.q.data(), moving.data(), buffers, bias.data());
    moving[j].d[0] = S(0);
    for (int row = 0; row < rows; ++row) along_v[row * nv + j] = bias[row].d[0];
  }
  differentiate_functions(loops, nv, q.data(), v.data(), along_q, along_v);
}

}  // namespace

// The model's use is entered before its loops are resolved: no edit comes between.
void LoopCalls::residual(Precision precision, Given q, double* out) {
  const ModelInUse use(model());
  const auto loops = loops_->resolved();
  run(precision, {q}, loops->rows, out, [&]<class S>(LoopWorkspace<S>& w, const S* const* given, S* r) { loop_residuals(*w.model, *loops, given[0], w.buffers, r); });
}

void LoopCalls::sizes(Precision precision, Given q, double* out) {
  const ModelInUse use(model());
  const auto loops = loops_->resolved();
  run(precision, {q}, loops->rows, out, [&]<class S>(LoopWorkspace<S>& w, const S* const* given, S* sizes) {
    LoopRows<S> rows;
    rows.find(*w.model, *loops, given[0], w.buffers);
    for (int row = 0; row < loops->rows; ++row) {
      sizes[row] = S(0);
      for (const auto& e : rows.entries[row]) sizes[row] = maximum(sizes[row], e.size);
    }
  });
}

void LoopCalls::jacobian(Precision precision, Given q, double* out) {
  const ModelInUse use(model());
  const auto loops = loops_->resolved();
  const int n = model().nv();
  run(precision, {q}, loops->rows * n, out, [&]<class S>(LoopWorkspace<S>& w, const S* const* given, S* Q) {
    std::fill_n(Q, loops->rows * n, S(0));
    loop_jacobian(*w.model, *loops, given[0], w.buffers, [&](int row, int i, const S& number) { Q[row * n + i] = number; });
  });
}

void LoopCalls::rates(Precision precision, Given q, Given v, double* out) {
  const ModelInUse use(model());
  const auto loops = loops_->resolved();
  run(precision, {q, v}, loops->rows, out, [&]<class S>(LoopWorkspace<S>& w, const S* const* given, S* rates) {
    std::fill_n(rates, loops->rows, S(0));
    loop_jacobian(*w.model, *loops, given[0], w.buffers, [&](int row, int i, const S& number) { rates[row] += number * given[1][i]; });
  });
}

void LoopCalls::bias(Precision precision, Given q, Given v, double* out) {
  const ModelInUse use(model());
  const auto loops = loops_->resolved();
  run(precision, {q, v}, loops->rows, out,
      [&]<class S>(LoopWorkspace<S>& w, const S* const* given, S* bias) { loop_bias(*w.model, *loops, given[0], given[1], w.buffers, bias); });
}

void LoopCalls::derivatives(Precision precision, Given q, Given v, Given vdot, const double* multipliers, double* out) {
  const ModelInUse use(model());
  const auto loops = loops_->resolved();
  const int n = model().nv();
  run(precision, {q, v, vdot}, (3 * loops->rows + n) * n, out,
      [&]<class S>(LoopWorkspace<S>& w, const S* const* given, S* to) { differentiate(*w.model, *loops, given, multipliers, to); });
}

}  // namespace pycraft
