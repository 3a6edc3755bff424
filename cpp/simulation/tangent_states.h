// States of a scene, (q, v, y), with derivatives along several directions at once: displacements, then velocities, then the effects' own states.
#pragma once

#include <algorithm>
#include <vector>

#include "model/configuration.h"
#include "numerics/tangent.h"

namespace pycraft {

template <class T, int W>
struct TangentStates {
  std::vector<Tangent<T, W>> q, v, y;

  // Directions first, ..., first + count - 1 of the 2 nv + own.
  void seed(const CompiledModel<T>& model, int own, const T* at, const T* velocity, const T* states, int first, int count) {
    const int N = model.nv;
    q.assign(at, at + model.nq), v.assign(velocity, velocity + N), y.assign(states, states + own);
    along_.resize(N), rate_.resize(model.nq);
    for (int w = 0; w < count; ++w) {
      const int k = first + w;
      if (k >= N) {
        (k < 2 * N ? v[k - N] : y[k - 2 * N]).d[w] = T(1);
        continue;
      }
      std::fill(along_.begin(), along_.end(), T(0));
      along_[k] = T(1);
      configuration_rate(model, at, along_.data(), rate_.data());
      for (int j = 0; j < model.nq; ++j) q[j].d[w] = rate_[j];
    }
  }

 private:
  std::vector<T> along_, rate_;
};

}  // namespace pycraft
