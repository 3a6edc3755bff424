// Second derivatives of inverse dynamics on one state or a batch.
#pragma once

#include <algorithm>
#include <vector>

#include "dynamics/batches.h"
#include "dynamics/curvature.h"

namespace pycraft {

template <>
inline constexpr bool available_at<Curvature, Digits50> = false;
template <>
inline constexpr bool available_at<Curvature, Digits100> = false;

class BatchCurvature : public Batches<Curvature> {
 public:
  using Batches::Batches;
  static constexpr int blocks = Curvature<double>::blocks;

  // mu: `count` virtual velocities a state; out: as many times `blocks` matrices (nv x nv) a state.
  void inverse_dynamics(const Given& q, const Given& v, const Given& vdot, const double* mu, int count, Precision precision, double* out) {
    const ModelInUse use(model());
    check_given(model(), {q, v, vdot});
    const int batch = common_batch({q, v, vdot}), states = batch < 0 ? 1 : batch, N = model().nv();
    const size_t given = size_t(count) * N, size = given * blocks * N;
    at_precision(precision, [&]<class S>(S) {
      if constexpr (!available_at<Curvature, S>) {
        throw EvaluationError(to_quad);
      } else {
        std::vector<S> x[4], y(size);
        each<S>(0, states, states, [&](Curvature<S>& w, int b) {
          convert(q.at(b), q.width, x[0]), convert(v.at(b), v.width, x[1]), convert(vdot.at(b), vdot.width, x[2]), convert(mu + b * given, given, x[3]);
          w.inverse_dynamics(x[0].data(), x[1].data(), x[2].data(), x[3].data(), count, y.data());
          std::transform(y.begin(), y.end(), out + b * size, [](const S& one) { return to_double(one); });
          require_finite(out + b * size, size, model());
        });
      }
    });
  }
};

}  // namespace pycraft
