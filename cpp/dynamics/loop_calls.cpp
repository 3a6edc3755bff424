#include "dynamics/loop_calls.h"

#include <algorithm>

namespace pycraft {

// The model's use is entered before its loops are resolved: no edit comes between.
void LoopCalls::residual(Precision precision, Given q, double* out) {
  const ModelInUse use(model());
  const auto loops = loops_->resolved();
  run(precision, {q}, loops->rows, out, [&]<class S>(LoopWorkspace<S>& w, const S* const* given, S* r) { loop_residuals(*w.model, *loops, given[0], w.buffers, r); });
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

void LoopCalls::bias(Precision precision, Given q, Given v, double* out) {
  const ModelInUse use(model());
  const auto loops = loops_->resolved();
  run(precision, {q, v}, loops->rows, out,
      [&]<class S>(LoopWorkspace<S>& w, const S* const* given, S* bias) { loop_bias(*w.model, *loops, given[0], given[1], w.buffers, bias); });
}

}  // namespace pycraft
