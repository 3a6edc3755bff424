// What derivatives of dynamics are made of (recursions/inertial_frame.h), on links, in the base's axes. Quantities of a link are about its origin
// and with respect to the inertial frame in which that origin rests at this instant, so that no velocity of what carries the link is in them.
// With Ω, Ω' the parent's angular velocity and acceleration, ω the link's, a its origin's acceleration, d the velocity of its origin as seen from
// the parent's, W y = Ω' × y + Ω × (Ω × y), and (s; x) a row of H:
//
//   ψ̇ = Ω × s (of it no more is felt),  ψ̈ = (W s; a × s + W x),  χ = Ṡ + ψ̇ = ((Ω + ω) × s; (Ω + ω) × x)
//
// and of a free link, u its hinge's velocity and a⁺ the acceleration of a point of the parent where its origin is:
//
//   ψ̈ = (W s; a⁺ × s - 2u × (Ω × s) + W x),  χ = ((Ω + ω) × s; (Ω + ω) × x - u × s)
//
// From a link's frame to its parent's, which is slower by d, velocities gain d: B b = B⁺ b + I (0; 2d × b) between a frame and one slower by d.
#pragma once

#include "kernels/columns.h"
#include "kernels/mass_matrix_of_links.h"
#include "kernels/motions.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// How a link moves.
template <class S>
struct Moving {
  Lying<S> lying;
  Vector3<S> omega, drift;         // ω, d
};
// And what moves it.
template <class S>
struct Instant : Moving<S> {
  Vector3<S> spin, acceleration;   // the rate of ω, a
};

// I, and B = [[N, 0], [-2f~, 0]] by N = İ - n~ and the momentum (n; f), of a link or of all that it carries.
template <class S>
struct Momenta {
  S mass;
  Vector3<S> moment;
  Symmetric3<S> rotational, rate;  // A; İ
  Vector3<S> n, f;
};
// And the force F.
template <class S>
struct Carrying : Momenta<S> {
  Vector3<S> torque, force;
};

template <class S>
struct Spatial {
  Vector3<S> angular, linear;
};
template <class S>
[[gnu::always_inline]] inline Spatial<S> operator+(const Spatial<S>& a, const Spatial<S>& b) {
  return {a.angular + b.angular, a.linear + b.linear};
}
// A force about a point at -l.
template <class S>
[[gnu::always_inline]] inline Spatial<S> inboard(const Vector3<S>& l, const Spatial<S>& f) {
  return {f.angular + cross(l, f.linear), f.linear};
}

// A coordinate: its row of H, and what a step along it or its velocity adds to the acceleration of all that it carries.
template <class S>
struct Direction {
  Vector3<S> s, x;
  Vector3<S> psi;                    // ψ̇
  Spatial<S> psi_rate, chi;          // ψ̈, χ
};

template <class S>
[[gnu::always_inline]] inline Symmetric3<S> turned(const Matrix3<S>& R, Symmetric3<S> A) {
  Full<S>{R}.turn_symmetric(A);
  return A;
}
// -(l~h~ + h~l~)
template <class S>
[[gnu::always_inline]] inline void add_moment_square(const Vector3<S>& l, const Vector3<S>& h, Symmetric3<S>& A) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    A(i, i) += S(2) * (l[j] * h[j] + l[k] * h[k]);
    A(i, j) -= l[i] * h[j] + h[i] * l[j];
  }
}

// The hinge's velocity of a free link.
template <class S, class T>
[[gnu::always_inline]] inline Vector3<S> hinge_travel(const Link<T>& link, const States<T>& at, const Matrix3<S>& axes) {
  const auto velocity = [&](int i) { return gathered<S>(at.v + link.v + i, at.v_stride, at.states); };
  return axes * Vector3<S>{velocity(3), velocity(4), velocity(5)};
}

// d of a link that lies where it lies.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void drift_from(const Link<T>& link, const States<T>& at, const Moving<S>* above, Moving<S>& out) {
  const Matrix3<S>& axes = out.lying.axes;
  out.drift = above ? cross(above->omega, out.lying.arm) : Vector3<S>::zero();
  if constexpr (Kind::nv == 6) {
    out.drift = out.drift + hinge_travel(link, at, axes);
  } else if constexpr (Kind::nv == 1 && !Kind::pin) {
    const S rate = S(link.sign) * S(link.travel) * gathered<S>(at.v + link.v, at.v_stride, at.states);
    out.drift = out.drift + rate * Vector3<S>{axes(0, 2), axes(1, 2), axes(2, 2)};
  }
}
// From the link's own axes: ω, its rate and a as the sweeps of dynamics have them.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void stand(const Link<T>& link, const States<T>& at, const Instant<S>* above, const Vector3<S>& omega, const Vector3<S>& spin,
                                         const Vector3<S>& acceleration, Instant<S>& out) {
  const Matrix3<S>& axes = out.lying.axes;
  out.omega = axes * omega, out.spin = axes * spin, out.acceleration = axes * acceleration;
  drift_from<Kind>(link, at, above, out);
}

// Of the link alone.
template <class S>
[[gnu::always_inline]] inline Momenta<S> momenta(const LinkOf<S>& link, const Moving<S>& of) {
  const Matrix3<S>& axes = of.lying.axes;
  const Symmetric3<S> A = turned(axes, rotational_of<S>(link));
  const Vector3<S> h = axes * spread<S>(link.moment), w = of.omega;
  Momenta<S> c{S(link.mass), h, A, Symmetric3<S>::zero(), A * w, cross(w, h)};
  Vector3<S> moved[3];  // columns of w~A
  for (int k = 0; k < 3; ++k) moved[k] = cross(w, Vector3<S>{A(0, k), A(1, k), A(2, k)});
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) c.rate(i, j) = moved[j][i] + moved[i][j];
  return c;
}
template <class S>
[[gnu::always_inline]] inline Carrying<S> carrying(const LinkOf<S>& link, const Instant<S>& of) {
  Carrying<S> c{momenta(link, of), Vector3<S>::zero(), Vector3<S>::zero()};
  c.force = c.mass * of.acceleration + cross(of.spin, c.moment) + cross(of.omega, c.f);
  c.torque = c.rotational * of.spin + cross(c.moment, of.acceleration) + cross(of.omega, c.n);
  return c;
}
template <class S>
[[gnu::always_inline]] inline void add(Momenta<S>& c, const Momenta<S>& other) {
  c.mass += other.mass, c.moment = c.moment + other.moment, c.rotational = c.rotational + other.rotational, c.rate = c.rate + other.rate;
  c.n = c.n + other.n, c.f = c.f + other.f;
}
template <class S>
[[gnu::always_inline]] inline void add(Carrying<S>& c, const Carrying<S>& other) {
  add<S>(static_cast<Momenta<S>&>(c), static_cast<const Momenta<S>&>(other));
  c.torque = c.torque + other.torque, c.force = c.force + other.force;
}
// About the parent's origin, in its frame.
template <class S>
[[gnu::always_inline]] inline void to_parent(const Vector3<S>& l, const Vector3<S>& d, Momenta<S>& c) {
  add_moment_square(d, c.moment, c.rate);
  c.n = c.n + cross(c.moment, d), c.f = c.f + c.mass * d;
  add_moment_square(l, c.f, c.rate);
  c.n = c.n + cross(l, c.f);
  add_moment_square(l, c.moment + (S(0.5) * c.mass) * l, c.rotational);
  c.moment = c.moment + c.mass * l;
}
template <class S>
[[gnu::always_inline]] inline void to_parent(const Vector3<S>& l, const Vector3<S>& d, Carrying<S>& c) {
  to_parent(l, d, static_cast<Momenta<S>&>(c));
  c.torque = c.torque + cross(l, c.force);
}
// I y, and B b of the angular part b.
template <class S>
[[gnu::always_inline]] inline Spatial<S> inertia_times(const Momenta<S>& c, const Spatial<S>& y) {
  return {c.rotational * y.angular + cross(c.moment, y.linear), c.mass * y.linear + cross(y.angular, c.moment)};
}
template <class S>
[[gnu::always_inline]] inline Spatial<S> rate_times(const Momenta<S>& c, const Vector3<S>& b) {
  return {c.rate * b - cross(c.n, b), S(2) * cross(b, c.f)};
}
// A += X d~, of 3x3 matrices.
template <class X, class S>
[[gnu::always_inline]] inline void add_times_skew(const X& x, const Vector3<S>& d, Matrix3<S>& A) {
  for (int j = 0; j < 3; ++j) {
    const int a = (j + 1) % 3, b = (j + 2) % 3;
    for (int r = 0; r < 3; ++r) A(r, j) += x(r, a) * d[b] - x(r, b) * d[a];
  }
}
// Whether rows of H have no linear part.
template <class Kind>
inline constexpr bool only_turns = Kind::pin || Kind::nv == 3;
// I S; I χ + B S; crf(S) F: where a hinge only turns, neither S nor χ has a linear part.
template <class Kind, class S>
[[gnu::always_inline]] inline Spatial<S> inertia_times(const Momenta<S>& c, const Vector3<S>& angular, const Vector3<S>& linear) {
  if constexpr (only_turns<Kind>) return {c.rotational * angular, cross(angular, c.moment)};
  return inertia_times(c, {angular, linear});
}
template <class Kind, class S>
[[gnu::always_inline]] inline Spatial<S> turned_force(const Direction<S>& k, const Carrying<S>& c) {
  if constexpr (only_turns<Kind>) return {cross(k.s, c.torque), cross(k.s, c.force)};
  return {cross(k.s, c.torque) + cross(k.x, c.force), cross(k.s, c.force)};
}

template <class Kind, class S, class T>
[[gnu::always_inline]] inline Direction<S> direction(const Link<T>& link, const States<T>& at, const Instant<S>* above, const Instant<S>& own, int i) {
  const Vector3<S> none = Vector3<S>::zero();
  const HingeRow<S> h = hinge_row<Kind>(link, own.lying.axes, i);
  const Vector3<S> omega = above ? above->omega : none, spin = above ? above->spin : none, both = omega + own.omega;
  const auto carried = [&](const Vector3<S>& y) { return cross(spin, y) + cross(omega, cross(omega, y)); };  // W y
  Direction<S> k{h.angular, h.linear, cross(omega, h.angular), {none, none}, {none, none}};
  k.chi.angular = Kind::pin ? Vector3<S>(S(2) * k.psi) : cross(both, h.angular);  // a pin's own velocity lies along it
  k.psi_rate.angular = cross(spin, h.angular) + cross(omega, k.psi);
  if constexpr (Kind::nv == 6) {
    const Vector3<S> u = hinge_travel(link, at, own.lying.axes);
    const Vector3<S> there = above ? above->acceleration + carried(own.lying.arm) : Vector3<S>::zero() - spread<S>(at.gravity);
    if (i < 3)
      k.psi_rate.linear = cross(there, k.s) - S(2) * cross(u, k.psi), k.chi.linear = cross(k.s, u);
    else
      k.psi_rate.linear = carried(k.x), k.chi.linear = cross(both, k.x);
  } else {
    k.psi_rate.linear = cross(own.acceleration, k.s);
    if constexpr (!only_turns<Kind>) k.psi_rate.linear = k.psi_rate.linear + carried(k.x), k.chi.linear = cross(both, k.x);
  }
  return k;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
