// Inverse dynamics on links: the Newton-Euler algorithm of recursions/newton_euler.h, in accelerations of points.
//
//   base to tip:  α = E* α(p) + a' + H* θ̈,   f = M α + b' - w
//   tip to base:  T = H f + J θ̈,   f(p) += E f
#pragma once

#include "kernels/motions.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
struct InverseLink {
  Motion<S> motion;
  Vector3<S> alpha, acceleration, n, f;
  S rotor;  // J θ̈
};

// alpha, acceleration: the parent's, then the link's. Without accelerations θ̈ is zero.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void push(const Link<T>& link, const States<T>& at, const T* wrench, InverseLink<S>& w) {
  const Motion<S>& m = w.motion;
  const auto rotation = Kind::rotation(m.place);
  w.acceleration = rotation.to_child(w.acceleration + cross(w.alpha, Kind::arm(link, m.place)) + (Kind::nv < 6 ? m.sliding : Vector3<S>::zero()));
  w.alpha = rotation.to_child(w.alpha) + m.turning;
  if constexpr (Kind::nv == 6) w.acceleration = w.acceleration + m.sliding;
  const auto rate = [&](int i) { return gathered<S>(at.u + link.v + i, at.u_stride, at.states); };
  if (at.u) {
    if constexpr (Kind::nv == 1) {
      const S x = S(link.sign) * rate(0);
      w.alpha[Kind::row] += Kind::pin ? x : S(link.turn) * x;
      if constexpr (!Kind::pin) w.acceleration[Kind::row] += S(link.travel) * x;
      w.rotor = S(link.J) * x;
    } else {
      each_of<3>([&](int i) { w.alpha[i] += rate(i); });
      if constexpr (Kind::nv == 6) each_of<3>([&](int i) { w.acceleration[i] += rate(3 + i); });
    }
  } else {
    w.rotor = S(0);
  }
  const Symmetric3<S> I = rotational_of<S>(link);
  const Vector3<S> h = spread<S>(link.moment);
  w.n = I * w.alpha + cross(h, w.acceleration) + gyroscopic(m.omega, I);
  w.f = S(link.mass) * w.acceleration + cross(w.alpha, h) + twice_crossed(m.omega, h);
  if (wrench) w.n = w.n - spread<S>(wrench), w.f = w.f - spread<S>(wrench + 3);
}

// The hinge's forces, and (n; f) about the parent's origin, in its axes.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void give_forces(const Link<T>& link, const States<T>& at, InverseLink<S>& w, double* out, size_t stride) {
  const auto give = [&](int i, const S& x) { scattered(x, out + link.v + i, stride, at.states); };
  if constexpr (Kind::nv == 1) {
    S force = w.n[Kind::row];
    if constexpr (!Kind::pin) force = S(link.turn) * force + S(link.travel) * w.f[Kind::row];
    force += w.rotor;
    give(0, S(link.sign) * force);
  } else {
    for (int i = 0; i < 3; ++i) give(i, w.n[i]);
    if constexpr (Kind::nv == 6)
      for (int i = 0; i < 3; ++i) give(3 + i, w.f[i]);
  }
  const auto rotation = Kind::rotation(w.motion.place);
  w.f = rotation.to_parent(w.f);
  w.n = rotation.to_parent(w.n) + cross(Kind::arm(link, w.motion.place), w.f);
}

template <class S>
unsigned inverse_dynamics(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t stride, typename S::Scalar* work) {
  using T = typename S::Scalar;
  auto* const w = reinterpret_cast<InverseLink<S>*>(work);
  const Vector3<S> base = -spread<S>(at.gravity);
  for (int k = 0; k < links.count; ++k) {
    const Link<T>& link = links.link[k];
    InverseLink<S>& own = w[k];
    const InverseLink<S>* const above = link.parent < 0 ? nullptr : &w[link.parent];
    own.alpha = above ? above->alpha : Vector3<S>::zero(), own.acceleration = above ? above->acceleration : base;
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      place_link<Kind>(link, at, own.motion.place);
      move_link<Kind>(link, at, above ? &above->motion.omega : nullptr, own.motion);
      push<Kind>(link, at, at.wrenches ? at.wrenches + 6 * k : nullptr, own);
    });
  }
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    with_step(link.step, [&](auto kind) { give_forces<decltype(kind)>(link, at, w[k], out, stride); });
    if (link.parent >= 0) w[link.parent].n = w[link.parent].n + w[k].n, w[link.parent].f = w[link.parent].f + w[k].f;
  }
  return ~0u;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
