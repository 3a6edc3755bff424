// Free subhinges as rotations and positions, SO(3) × R³, which variational integrators move on: a body that is small for its way moves straight and
// turns by itself there, where on SE(3) each would see the rounding of the other enlarged by that way.
//
// Velocities are (ω; ẋ), ω in the body's axes, ẋ the rate of the position in the axes before the step; momenta (π; R p). Functions of the body's twist
// (ω; v), v = R*ẋ, have in addition ∂/∂θ = p×v at ẋ held. All other subhinges are as they are. O(N).
#pragma once

#include "model/configuration.h"

namespace pycraft {

// f(q, v) where the numbers of a free subhinge begin.
template <class S, class F>
void each_free(const CompiledModel<S>& model, F f) {
  each_subhinge(model, [&](auto row, int q, int v) {
    if constexpr (row.nv == 6) f(q, v);
  });
}
template <class S>
Matrix3<S> rotation_at(const S* q) {
  return quaternion_rotation(Quaternion<S>{q[0], q[1], q[2], q[3]});
}
template <class S>
void put(const Vector3<S>& x, S* to) {
  for (int i = 0; i < 3; ++i) to[i] = x[i];
}

// Linear parts of velocities or momenta, from the body's axes to those before the step, and back, in place.
template <class S>
void outward(const CompiledModel<S>& model, const S* q, S* x) {
  each_free(model, [&](int at, int v) { put(Vector3<S>(rotation_at(q + at) * Vector3<S>{x[v + 3], x[v + 4], x[v + 5]}), x + v + 3); });
}
template <class S>
void inward(const CompiledModel<S>& model, const S* q, S* x) {
  each_free(model, [&](int at, int v) { put(Vector3<S>(transpose_times(rotation_at(q + at), Vector3<S>{x[v + 3], x[v + 4], x[v + 5]})), x + v + 3); });
}

// q moved along w, a rotation vector and a way.
template <class S>
void move_apart(const CompiledModel<S>& model, const S* q, const S* w, S* out) {
  each_subhinge(model, [&](auto row, int at, int v) {
    if constexpr (row.nv == 6) {
      for (int i = 4; i < 7; ++i) out[at + i] = q[at + i] + w[v + i - 1];
      BallSubhinge::move(q + at, w + v, out + at);
    } else {
      row.move(q + at, w + v, out + at);
    }
  });
}

// The rate of (ω; ẋ), in place of that of the twist.
template <class S>
void accelerations_apart(const CompiledModel<S>& model, const S* q, const S* twist, S* rate) {
  each_free(model, [&](int, int v) {
    const Vector3<S> turning = cross(Vector3<S>{twist[v], twist[v + 1], twist[v + 2]}, Vector3<S>{twist[v + 3], twist[v + 4], twist[v + 5]});
    for (int i = 0; i < 3; ++i) rate[v + 3 + i] += turning[i];
  });
  outward(model, q, rate);
}

// Momenta and forces of (ω; ẋ), in place of those of the twist.
template <class S>
void momenta_and_forces_apart(const CompiledModel<S>& model, const S* q, const S* twist, S* pi, S* forces) {
  each_free(model, [&](int, int v) {
    const Vector3<S> turning = cross(Vector3<S>{pi[v + 3], pi[v + 4], pi[v + 5]}, Vector3<S>{twist[v + 3], twist[v + 4], twist[v + 5]});
    for (int i = 0; i < 3; ++i) forces[v + i] += turning[i];
  });
  outward(model, q, pi), outward(model, q, forces);
}

}  // namespace pycraft
