#include "dynamics/tangent_dynamics.h"

#include <algorithm>
#include <cmath>

#include "model/configuration.h"
#include "recursions/articulated_body.h"
#include "recursions/kinematics.h"

namespace pycraft {

template <class T>
TangentDynamics<T>::TangentDynamics(const Multibody& model)
    : tree_(model.structure()), values_(model.compiled<T>()), model_(broadcast<S>(*values_)), blocks_(tree_), alpha_(tree_.bodies()), force_(tree_.bodies()),
      vdot_(tree_.coordinates()), direction_(tree_.coordinates()) {}

// Directions first, ..., first + count - 1 of the 2N: along coordinate i, then along velocity i.
template <class T>
void TangentDynamics<T>::seed(const T* q, const T* v, int first, int count) {
  const int nq = model_.nq, N = model_.nv;
  q_.assign(q, q + nq), v_.assign(v, v + N);
  rate_.resize(nq);
  for (int w = 0; w < count; ++w) {
    const int i = first + w;
    if (i >= N) {
      v_[i - N].d[w] = T(1);
      continue;
    }
    std::fill(direction_.begin(), direction_.end(), T(0));
    direction_[i] = T(1);
    configuration_rate(*values_, q, direction_.data(), rate_.data());
    for (int j = 0; j < nq; ++j) q_[j].d[w] = rate_[j];
  }
}

template <class T>
bool TangentDynamics<T>::forward_dynamics(const double* q, const double* v, const double* tau, Form form, T* dq, T* dv, const Applied<double>* applied) {
  const int N = model_.nv;
  convert(q, model_.nq, at_), convert(v, N, velocity_);
  tau_.assign(tau, tau + N);
  blocks_.form = form;
  for (int first = 0; first < 2 * N; first += width) {
    const int count = std::min(width, 2 * N - first);
    seed(at_.data(), velocity_.data(), first, count);
    kinematics(model_, q_.data(), blocks_);
    point_accelerations_base_to_tip(model_, blocks_.pose.data(), blocks_.H.data(), v_.data(), OwnTerms::absorbed, points_);
    articulated_body(tree_, model_, blocks_, points_, applied ? converted(*applied, model_.bodies, wrenches_) : own_gravity(model_), tau_.data(), vdot_.data(), force_, alpha_);
    for (int w = 0; w < count; ++w) {
      T* column = first + w < N ? dq + first + w : dv + (first + w - N);
      for (int j = 0; j < N; ++j) {
        column[size_t(j) * N] = vdot_[j].d[w] - points_.absorbed[j].d[w];
        if (!std::isfinite(to_double(column[size_t(j) * N]))) return false;
      }
    }
  }
  return true;
}

#define PYCRAFT_INSTANTIATE(S) template class TangentDynamics<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
