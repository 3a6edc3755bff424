// Velocities of links, base to tip, and the accelerations of points that they make (recursions/point_accelerations.h), for every kind of step:
//
//   ω(k) = R* ω(p) + w,   a'(k) = (Ω × w;  Ω_p × (Ω_p × l) + 2 Ω_p × u),   Ω_p = ω(p),  Ω = R* ω(p)
//
// with (w; u) the relative twist of the hinge and l from the parent's origin to the link's. The linear part is in the parent's axes. Where a
// link is free its own linear part x is taken from its coordinates at the end, and never meets a mass.
#pragma once

#include "kernels/steps.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
struct Motion {
  Place<S> place;
  Vector3<S> omega;     // of the link, in its axes
  Vector3<S> turning;   // Ω × w
  Vector3<S> sliding;   // the linear part of a', in the parent's axes; of a free link x, in its own
};

// u × (u × l): nothing where l lies along u, which u(u·l) - l(u·u) would leave to rounding.
template <class S>
[[gnu::always_inline]] inline Vector3<S> twice_crossed(const Vector3<S>& u, const Vector3<S>& l) {
  return cross(u, cross(u, l));
}
// ω × Aω
template <class S>
[[gnu::always_inline]] inline Vector3<S> gyroscopic(const Vector3<S>& omega, const Symmetric3<S>& A) {
  return cross(omega, A * omega);
}
template <class S>
[[gnu::always_inline]] inline Symmetric3<S> rotational_of(const LinkOf<S>& link) {
  return {S(link.rotational[0]), S(link.rotational[1]), S(link.rotational[2]), S(link.rotational[3]), S(link.rotational[4]), S(link.rotational[5])};
}

// above: the parent's angular velocity; null at the base. States without v are at rest.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void move_link(const Link<T>& link, const States<T>& at, const Vector3<S>* above, Motion<S>& m) {
  if (!at.v) [[unlikely]] return void(m.omega = m.turning = m.sliding = Vector3<S>::zero());
  const auto velocity = [&](int i) { return gathered<S>(at.v + link.v + i, at.v_stride, at.states); };
  const auto rotation = Kind::rotation(m.place);
  const Vector3<S> none = Vector3<S>::zero();
  const Vector3<S> carried = above ? rotation.to_child(*above) : none;  // Ω
  m.sliding = above ? twice_crossed(*above, Kind::arm(link, m.place)) : none;
  m.omega = carried;
  m.turning = none;
  if constexpr (Kind::nv == 1) {
    constexpr int K = Kind::row, i = (K + 1) % 3, j = (K + 2) % 3;
    S turn = S(link.sign) * velocity(0);
    if constexpr (!Kind::pin) {
      Vector3<S> slide = none;
      slide[K] = S(2) * S(link.travel) * turn;
      turn *= S(link.turn);
      if (above) m.sliding = m.sliding + cross(*above, rotation.to_parent(slide));
    }
    m.omega[K] += turn;
    m.turning[i] = carried[j] * turn, m.turning[j] = -(carried[i] * turn);
  } else {
    const Vector3<S> w{velocity(0), velocity(1), velocity(2)};
    m.omega = m.omega + w;
    m.turning = cross(carried, w);
    if constexpr (Kind::nv == 6) {
      const Vector3<S> u{velocity(3), velocity(4), velocity(5)};
      m.sliding = rotation.to_child(m.sliding) + cross(carried + m.omega, u);
    }
  }
}

// How far sliders, screws and free links have gone altogether: no link is further from another than at rest by more than that.
template <class S, class T>
[[gnu::always_inline]] inline S travel(const Links<T>& links, const States<T>& at) {
  S sum(0);
  for (int k = 0; k < links.count; ++k) {
    const Link<T>& link = links.link[k];
    const auto q = [&](int i) { return magnitude(gathered<S>(at.q + link.q + i, at.q_stride, at.states)); };
    if (link.step == Step::helix) sum += magnitude(S(link.travel)) * q(0);
    if (link.step == Step::free && link.parent >= 0) sum += q(4) + q(5) + q(6);
  }
  return sum;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
