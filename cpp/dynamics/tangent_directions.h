// States with derivatives along several directions at once: along quasi-velocities, then along velocities.
#pragma once

#include <algorithm>
#include <vector>

#include "model/configuration.h"
#include "numerics/tangent.h"

namespace pycraft {

template <class T, int W>
struct TangentDirections {
  std::vector<Tangent<T, W>> q, v;

  // Directions first, ..., first + count - 1 of the 2N: along coordinate i, then along velocity i.
  void seed(const CompiledModel<T>& model, const T* at, const T* velocity, int first, int count) {
    const int nq = model.nq, N = model.nv;
    q.assign(at, at + nq), v.assign(velocity, velocity + N);
    direction_.resize(N), rate_.resize(nq);
    for (int w = 0; w < count; ++w) {
      const int i = first + w;
      if (i >= N) {
        v[i - N].d[w] = T(1);
        continue;
      }
      std::fill(direction_.begin(), direction_.end(), T(0));
      direction_[i] = T(1);
      configuration_rate(model, at, direction_.data(), rate_.data());
      for (int j = 0; j < nq; ++j) q[j].d[w] = rate_[j];
    }
  }

 private:
  std::vector<T> direction_, rate_;
};

}  // namespace pycraft
