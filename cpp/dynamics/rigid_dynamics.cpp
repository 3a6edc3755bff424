#include "dynamics/rigid_dynamics.h"

#include "algebra/sweeps/articulated_inertia.h"
#include "algebra/sweeps/mass_matrix.h"
#include "recursions/articulated_body.h"
#include "recursions/composite_mass_matrix.h"
#include "recursions/kinematics.h"
#include "recursions/newton_euler.h"

namespace pycraft {

template <class S>
RigidDynamics<S>::RigidDynamics(const Multibody& model)
    : tree_(model.structure()), model_(model.compiled<S>()), blocks_(tree_), alpha_(tree_.bodies()), force_(tree_.bodies()), zero_(tree_.coordinates(), S(0)) {}

template <class S>
void RigidDynamics<S>::forward_dynamics(const S* q, const S* v, const S* tau, S* vdot) {
  kinematics(*model_, q, blocks_);
  velocities_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), v, velocities_);
  articulated_body(tree_, *model_, blocks_, velocities_, tau, vdot, force_, alpha_);
}

template <class S>
void RigidDynamics<S>::inverse_dynamics(const S* q, const S* v, const S* vdot, S* tau) {
  kinematics(*model_, q, blocks_);
  velocities_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), v, velocities_);
  newton_euler(*model_, blocks_, velocities_, vdot, tau, alpha_, force_);
}

template <class S>
void RigidDynamics<S>::mass_matrix(const S* q, S* out) {
  kinematics(*model_, q, blocks_);
  composite_mass_matrix(tree_, *model_, blocks_, out);
}

template <class S>
void RigidDynamics<S>::mass_matrix_inverse(const S* q, S* out) {
  const int N = model_->nv;
  kinematics(*model_, q, blocks_);
  articulated_inertia_tip_to_base(tree_, blocks_);
  columns_.assign(size_t(N) * N, S(0));
  for (int i = 0; i < N; ++i) columns_[size_t(i) * N + i] = S(1);
  scratch_.resize(size_t(6) * model_->bodies * N);
  mass_matrix_inverse_apply(tree_, blocks_, columns_.data(), out, N, scratch_.data());
  // Symmetric by meaning; the two triangles differ by rounding and the mean is the better of them.
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < i; ++j) out[size_t(i) * N + j] = out[size_t(j) * N + i] = S(0.5) * (out[size_t(i) * N + j] + out[size_t(j) * N + i]);
}

template <class S>
void RigidDynamics<S>::jacobian(const Node& node, const S* q, S* out) {
  const int N = model_->nv;
  kinematics(*model_, q, blocks_);
  std::fill_n(out, size_t(6) * N, S(0));
  Pose<S> X = cast<S>(node.pose);  // X_aN for the ancestor a
  for (int a = node.body; a >= 0; a = model_->parent[a]) {
    for (int j = model_->v_offset[a]; j < model_->v_offset[a] + model_->nv_of[a]; ++j) {
      const Vector6<S> column = motion_to_child(X, blocks_.H[j]);
      for (int i = 0; i < 6; ++i) out[size_t(i) * N + j] = column[i];
    }
    X = blocks_.pose[a] * X;
  }
}

template <class S>
Pose<S> RigidDynamics<S>::pose(const Node& node, const S* q) {
  kinematics(*model_, q, blocks_);
  Pose<S> X = cast<S>(node.pose);
  for (int a = node.body; a >= 0; a = model_->parent[a]) X = blocks_.pose[a] * X;
  return X;
}

template <class S>
S RigidDynamics<S>::kinetic_energy(const S* q, const S* v) {
  kinematics(*model_, q, blocks_);
  velocities_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), v, velocities_);
  S twice = S(0);
  for (int k = 0; k < model_->bodies; ++k) twice += dot(velocities_.V[k], model_->inertia[k] * velocities_.V[k]);
  for (int j = 0; j < model_->nv; ++j) twice += model_->rotor_inertia[j] * v[j] * v[j];
  return twice / S(2);
}

template <class S>
S RigidDynamics<S>::potential_energy(const S* q) {
  kinematics(*model_, q, blocks_);
  std::vector<Pose<S>> world(model_->bodies);
  S energy = S(0);
  for (int k = 0; k < model_->bodies; ++k) {
    world[k] = model_->parent[k] < 0 ? blocks_.pose[k] : world[model_->parent[k]] * blocks_.pose[k];
    const Vector3<S> moment = world[k].R * model_->inertia[k].moment + model_->inertia[k].mass * world[k].p;
    energy -= dot(model_->gravity, moment);
  }
  return energy;
}

template class RigidDynamics<double>;
template class RigidDynamics<Extended>;
template class RigidDynamics<Quad>;

}  // namespace pycraft
