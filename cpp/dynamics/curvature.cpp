#include "dynamics/curvature.h"

#include <algorithm>

#include "recursions/kinematics.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class T>
Curvature<T>::Curvature(const Multibody& model)
    : tree_(model.structure()), values_(model.compiled<T>()), model_(broadcast<S>(*values_)), blocks_(tree_), frame_(model_), W_(tree_.bodies()),
      momentum_(tree_.bodies()), chi_(tree_.coordinates()), couple_(tree_.bodies()) {}

template <class T>
void Curvature<T>::inverse_dynamics(const T* q, const T* v, const T* vdot, const T* mu, int count, T* out, const Vector3<T>* gravity) {
  const int N = model_.nv;
  const Vector3<S> field = gravity ? cast<S>(*gravity) : model_.gravity;
  const size_t square = size_t(N) * N;
  vdot_.assign(vdot, vdot + N);
  for (int first = 0; first < 2 * N;) {
    const bool along_q = first < N;
    const int directions = std::min(width, (along_q ? N : 2 * N) - first);
    state_.seed(*values_, q, v, first, directions);
    kinematics(model_, state_.q.data(), blocks_);
    frame_.fill(model_, blocks_, field, state_.v.data(), vdot_.data());
    for (int m = 0; m < count; ++m) {
      contract(mu + size_t(m) * N);
      of_rotors_.assign(N, S(0));
      mu_.assign(mu + size_t(m) * N, mu + size_t(m + 1) * N);
      for (int k = 0; k < model_.bodies && model_.has_rotor_inertia; ++k)
        add_rotor_power_gradient(model_, k, model_.rotor_inertia.data(), state_.v.data(), mu_.data(), of_rotors_.data());
      T* const to = out + size_t(m) * blocks * square;
      for (int j = 0; j < N; ++j) {
        const int k = frame_.body_of[j];
        const Vector6<S>& P = momentum_[k];
        const Vector3<S>& C = couple_[k];
        const S of_v = dot(frame_.twist_rate[j] + frame_.psi_dot[j], P) + dot(frame_.twist[j].angular, C) + of_rotors_[j];
        if (!along_q) {
          for (int w = 0; w < directions; ++w) to[3 * square + size_t(first - N + w) * N + j] = of_v.d[w];
          continue;
        }
        const S of_q = dot(frame_.psi_ddot[j], P) + dot(frame_.psi_dot[j].angular, C) + dot(chi_[j], frame_.force[k]);
        const S of_vdot = dot(frame_.twist[j], P);
        for (int w = 0; w < directions; ++w) {
          const size_t at = size_t(first + w) * N + j;
          to[at] = of_q.d[w], to[square + at] = of_v.d[w], to[2 * square + at] = of_vdot.d[w];
        }
      }
    }
    first += directions;
  }
}

// χ, and P and C of every body.
template <class T>
void Curvature<T>::contract(const T* mu) {
  for (int k = 0; k < model_.bodies; ++k) {
    check_interrupt_at(k);
    const int p = model_.parent[k];
    Vector6<S> W = p < 0 ? Vector6<S>::zero() : motion_outboard(frame_.arm[k], W_[p]), gained = Vector6<S>::zero();
    for (int j = model_.v_offset[k], last = j + model_.nv_of[k]; j < last;) {  // one subhinge after the other
      const Vector6<S> before = W + gained;
      for (const int subhinge = frame_.subhinge_of[j]; j < last && frame_.subhinge_of[j] == subhinge; ++j) {
        chi_[j] = cross_motion(before, frame_.twist[j]);
        gained = gained + S(mu[j]) * frame_.twist[j];
      }
    }
    W_[k] = W + gained;
    momentum_[k] = frame_.R[k] * gained;
    couple_[k] = couple(frame_.B[k], gained);
  }
  for (int k = model_.bodies - 1; k >= 0; --k) {
    check_interrupt_at(k);
    const int p = model_.parent[k];
    if (p < 0) continue;
    momentum_[p] = momentum_[p] + force_inboard(frame_.arm[k], momentum_[k]);
    couple_[p] = couple_[p] + couple_[k];
    const Vector6<S> inboard = motion_outboard(frame_.arm[k], W_[p]);
    momentum_[k] = momentum_[k] + frame_.R[k] * inboard;
    couple_[k] = couple_[k] + couple(frame_.B[k], inboard);
  }
}

#define PYCRAFT_INSTANTIATE(S) template class Curvature<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
