// The derivatives of the direct calls on one state or a batch: `run` for what takes a state in the scalar of the precision, forward dynamics
// from the doubles of the states, as there: what a narrower scalar rounds away, a wider residual sees.
#pragma once

#include <algorithm>
#include <vector>

#include "dynamics/batches.h"
#include "dynamics/sensitivities.h"

namespace pycraft {

template <>
inline constexpr bool available_at<Sensitivities, Digits50> = false;
template <>
inline constexpr bool available_at<Sensitivities, Digits100> = false;

class BatchSensitivities : public Batches<Sensitivities> {
 public:
  using Batches::Batches;

  // ∂v̇/∂q, ∂v̇/∂v, ∂v̇/∂τ one after the other, 3 (nv, nv) a state.
  void forward_dynamics(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, double* out) {
    const ModelInUse use(model());
    check_given(model(), {q, v, tau});
    const int batch = common_batch({q, v, tau}), states = batch < 0 ? 1 : batch;
    const size_t square = size_t(model().nv()) * model().nv();
    at_precision(precision, [&]<class S>(S) {
      if constexpr (!available_at<Sensitivities, S>) {
        throw EvaluationError(to_quad);
      } else {
        std::vector<S> y(3 * square);
        each<S>(0, states, states, [&](Sensitivities<S>& w, int b) {
          w.forward_dynamics(q.at(b), v.at(b), tau.at(b), how, y.data(), y.data() + square, y.data() + 2 * square);
          double* to = out + b * 3 * square;
          std::transform(y.begin(), y.end(), to, [](const S& x) { return to_double(x); });
          require_finite(to, 3 * square, model());
        });
      }
    });
  }
};

}  // namespace pycraft
