#include "dynamics/tangent_dynamics.h"

#include <algorithm>
#include <cmath>

#include "recursions/articulated_body.h"
#include "recursions/kinematics.h"

namespace pycraft {

template <class T>
TangentDynamics<T>::TangentDynamics(const Multibody& model)
    : tree_(model.structure()), values_(model.compiled<T>()), model_(broadcast<S>(*values_)), blocks_(tree_), alpha_(tree_.bodies()), force_(tree_.bodies()),
      vdot_(tree_.coordinates()) {}

template <class T>
bool TangentDynamics<T>::forward_dynamics(const double* q, const double* v, const double* tau, Form form, T* dq, T* dv, const Applied<double>* applied) {
  const int N = model_.nv;
  convert(q, model_.nq, at_), convert(v, N, velocity_);
  tau_.assign(tau, tau + N);
  blocks_.form = form;
  for (int first = 0; first < 2 * N; first += width) {
    const int count = std::min(width, 2 * N - first);
    state_.seed(*values_, at_.data(), velocity_.data(), first, count);
    kinematics(model_, state_.q.data(), blocks_);
    point_accelerations_base_to_tip(model_, blocks_.pose.data(), blocks_.H.data(), state_.v.data(), OwnTerms::absorbed, points_);
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
