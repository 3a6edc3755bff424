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

// α of a link from its parent's, but for H* θ̈. kept: with what its hinge could absorb.
template <class Kind, bool kept, class S, class T>
[[gnu::always_inline]] inline void carry(const Link<T>& link, const Motion<S>& m, Vector3<S>& alpha, Vector3<S>& acceleration) {
  const auto rotation = Kind::rotation(m.place);
  acceleration = rotation.to_child(acceleration + cross(alpha, Kind::arm(link, m.place)) + (Kind::nv < 6 ? m.sliding : Vector3<S>::zero()));
  alpha = rotation.to_child(alpha) + m.turning;
  if constexpr (Kind::nv == 6 && kept) acceleration = acceleration + m.sliding;
}
// H* θ̈ of rate(i).
template <class Kind, class S, class T, class Rate>
[[gnu::always_inline]] inline void add_rates(const Link<T>& link, Rate rate, Vector3<S>& alpha, Vector3<S>& acceleration) {
  if constexpr (Kind::nv == 1) {
    const S x = S(link.sign) * rate(0);
    alpha[Kind::row] += Kind::pin ? x : S(S(link.turn) * x);
    if constexpr (!Kind::pin) acceleration[Kind::row] += S(link.travel) * x;
  } else {
    each_of<3>([&](int i) { alpha[i] += rate(i); });
    if constexpr (Kind::nv == 6) each_of<3>([&](int i) { acceleration[i] += rate(3 + i); });
  }
}
// f = M α + b' - w
template <class S, class T>
[[gnu::always_inline]] inline void own_force(const Link<T>& link, const Vector3<S>& omega, const T* wrench, const Vector3<S>& alpha, const Vector3<S>& acceleration, Vector3<S>& n, Vector3<S>& f) {
  const Symmetric3<S> I = rotational_of<S>(link);
  const Vector3<S> h = spread<S>(link.moment);
  n = I * alpha + cross(h, acceleration) + gyroscopic(omega, I);
  f = S(link.mass) * acceleration + cross(alpha, h) + twice_crossed(omega, h);
  if (wrench) n = n - spread<S>(wrench), f = f - spread<S>(wrench + 3);
}

// alpha, acceleration: the parent's, then the link's. Without accelerations θ̈ is zero.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void push(const Link<T>& link, const States<T>& at, const T* wrench, InverseLink<S>& w) {
  carry<Kind, true>(link, w.motion, w.alpha, w.acceleration);
  const auto rate = [&](int i) { return gathered<S>(at.u + link.v + i, at.u_stride, at.states); };
  if (at.u) add_rates<Kind>(link, rate, w.alpha, w.acceleration);
  if constexpr (Kind::nv == 1) w.rotor = at.u ? S(S(link.J) * S(S(link.sign) * rate(0))) : S(0);
  own_force(link, w.motion.omega, wrench, w.alpha, w.acceleration, w.n, w.f);
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

// Links first..last, outward and inward; apart: what the first one leaves to its parent is not added to it yet.
template <class S, class T>
[[gnu::always_inline]] inline void push_links(const Links<T>& links, const States<T>& at, InverseLink<S>* w, int first, int last) {
  const Vector3<S> base = -spread<S>(at.gravity);
  for (int k = first; k < last; ++k) {
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
}
template <class S, class T>
[[gnu::always_inline]] inline void add_to_parent(const Links<T>& links, InverseLink<S>* w, int k) {
  const int parent = links.link[k].parent;
  if (parent >= 0) w[parent].n = w[parent].n + w[k].n, w[parent].f = w[parent].f + w[k].f;
}
template <class S, class T>
[[gnu::always_inline]] inline void gather_links(const Links<T>& links, const States<T>& at, InverseLink<S>* w, int first, int last, bool apart, double* out, size_t stride) {
  for (int k = last - 1; k >= first; --k) {
    stay_open(at, k);
    with_step(links.link[k].step, [&](auto kind) { give_forces<decltype(kind)>(links.link[k], at, w[k], out, stride); });
    if (!apart || k > first) add_to_parent(links, w, k);
  }
}

template <class S>
unsigned inverse_dynamics(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t stride, typename S::Scalar* work) {
  auto* const w = reinterpret_cast<InverseLink<S>*>(work);
  push_links(links, at, w, 0, links.count);
  gather_links(links, at, w, 0, links.count, false, out, stride);
  return ~0u;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
