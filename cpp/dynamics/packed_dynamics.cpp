#include "dynamics/packed_dynamics.h"

#include "recursions/articulated_body.h"
#include "recursions/kinematics.h"

namespace pycraft {

template <class T>
PackedDynamics<T>::PackedDynamics(const Multibody& model)
    : tree_(model.structure()), model_(broadcast<S>(*model.compiled<T>())), blocks_(tree_), alpha_(tree_.bodies()), force_(tree_.bodies()), vdot_(tree_.coordinates()) {}

template <class T>
void PackedDynamics<T>::load(const double* from, size_t stride, int n, std::vector<S>& to) {
  to.resize(n);
  for (int i = 0; i < n; ++i)
    for (int b = 0; b < width; ++b) to[i].v[b] = static_cast<T>(from[b * stride + i]);
}

template <class T>
bool PackedDynamics<T>::forward_dynamics(const double* q, size_t q_stride, const double* v, size_t v_stride, const double* tau, size_t tau_stride, double* vdot,
                                         Form form, const Applied<double>* applied) {
  load(q, q_stride, model_.nq, q_);
  load(v, v_stride, model_.nv, v_);
  load(tau, tau_stride, model_.nv, tau_);
  kinematics(model_, q_.data(), blocks_);
  point_accelerations_base_to_tip(model_, blocks_.pose.data(), blocks_.H.data(), v_.data(), OwnTerms::absorbed, points_);
  blocks_.form = form;
  try {
    articulated_body(tree_, model_, blocks_, points_, applied ? converted(*applied, model_.bodies, wrenches_) : own_gravity(model_), tau_.data(), vdot_.data(), force_, alpha_);
  } catch (const SingularHingeError&) {
    return false;
  }
  if (blocks_.faint().body >= 0) return false;
  for (int b = 0; b < width; ++b)
    for (int i = 0; i < model_.nv; ++i) vdot[size_t(b) * model_.nv + i] = vdot_[i].v[b] - points_.absorbed[i].v[b];
  return true;
}

template class PackedDynamics<Single>;
template class PackedDynamics<double>;

}  // namespace pycraft
