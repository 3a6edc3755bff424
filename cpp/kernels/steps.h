// The step of a link at a configuration: how it is turned and where its origin lies against its parent, and which rows H has.
//
// A step is a type, so that a sweep over links takes one of a few straight pieces of code a link: `with_step` calls it by the link's kind.
#pragma once

#include "kernels/links.h"
#include "kernels/rotations.h"
#include "lanes/sine_cosine.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
using LinkOf = Link<typename S::Scalar>;

// In loops over links k, each of some 100 operations on so many columns, as runtime/interrupt.h has it.
template <class T>
[[gnu::always_inline]] inline void stay_open(const States<T>& at, int k, int columns = 1) {
  if ((k & 255) == 255 || columns > 64) at.interrupt();
}

// What a configuration makes of a link.
template <class S>
struct Place {
  S c, s;        // pins: cosine and sine
  Matrix3<S> R;  // where axes are turned beyond a coordinate axis
  Vector3<S> p;  // of sliders, screws and free links: the origin in the parent's frame
};

template <class S>
[[gnu::always_inline]] inline Matrix3<S> fixed_rotation(const LinkOf<S>& link) {
  Matrix3<S> R;
  for (int i = 0; i < 9; ++i) R.m[i] = S(link.R[i]);
  return R;
}
// R turned about its third axis by the angle of c and s.
template <class S>
[[gnu::always_inline]] inline void turned_about_z(const LinkOf<S>& link, Place<S>& place) {
  each_of<3>([&](int r) {
    const S x(link.R[3 * r]), y(link.R[3 * r + 1]);
    place.R(r, 0) = x * place.c + y * place.s, place.R(r, 1) = y * place.c - x * place.s, place.R(r, 2) = S(link.R[3 * r + 2]);
  });
}
// By the angle whose sine and cosine these are.
template <class S>
[[gnu::always_inline]] inline void turn_by(const LinkOf<S>& link, const SineCosine<S>& of, Place<S>& place) {
  place.c = of.cosine, place.s = S(link.sign) * of.sine;
}
// Of a quaternion w, x, y, z of any length but zero: first of the size of one, so that no square leaves its range.
template <class S>
[[gnu::always_inline]] inline Matrix3<S> rotation_of(const S* q) {
  const S scale = S(1) / larger(larger(magnitude(q[0]), magnitude(q[1])), larger(magnitude(q[2]), magnitude(q[3])));
  const S w = scale * q[0], x = scale * q[1], y = scale * q[2], z = scale * q[3];
  const S k = S(2) / (w * w + x * x + y * y + z * z);
  const S kx = k * x, ky = k * y, kz = k * z, one(1);
  return {one - (ky * y + kz * z), kx * y - kz * w, kx * z + ky * w, kx * y + kz * w, one - (kx * x + kz * z), ky * z - kx * w, kx * z - ky * w, ky * z + kx * w, one - (kx * x + ky * y)};
}
template <class S>
[[gnu::always_inline]] inline Matrix3<S> product(const Matrix3<S>& A, const Matrix3<S>& B) {
  Matrix3<S> C;
  each_of<3>([&](int i) { each_of<3>([&](int j) { C(i, j) = A(i, 0) * B(0, j) + A(i, 1) * B(1, j) + A(i, 2) * B(2, j); }); });
  return C;
}

// A pin about coordinate axis K.
template <int K>
struct LevelPin {
  static constexpr int nq = 1, nv = 1, row = K;
  static constexpr bool pin = true;
  template <class S>
  static auto rotation(const Place<S>& place) { return Planar<K, S>{place.c, place.s}; }
  template <class S>
  [[gnu::always_inline]] static void place(const LinkOf<S>& link, const SineCosine<S>& q, Place<S>& at) { turn_by(link, q, at); }
  template <class S>
  [[gnu::always_inline]] static Vector3<S> arm(const LinkOf<S>& link, const Place<S>&) { return spread<S>(link.p); }
};
struct TurnedPin {
  static constexpr int nq = 1, nv = 1, row = 2;
  static constexpr bool pin = true;
  template <class S>
  static auto rotation(const Place<S>& place) { return Full<S>{place.R}; }
  template <class S>
  [[gnu::always_inline]] static void place(const LinkOf<S>& link, const SineCosine<S>& q, Place<S>& at) { turn_by(link, q, at), turned_about_z(link, at); }
  template <class S>
  [[gnu::always_inline]] static Vector3<S> arm(const LinkOf<S>& link, const Place<S>&) { return spread<S>(link.p); }
};
// A slider or a screw, by its turn and its travel for a unit of the coordinate.
struct Helix {
  static constexpr int nq = 1, nv = 1, row = 2;
  static constexpr bool pin = false;
  template <class S>
  static auto rotation(const Place<S>& place) { return Full<S>{place.R}; }
  template <class S>
  [[gnu::always_inline]] static void place(const LinkOf<S>& link, const S* q, Place<S>& at) {
    turn_by(link, sine_cosine(S(S(link.turn) * q[0])), at), turned_about_z(link, at);
    const S travel = S(link.sign) * S(link.travel) * q[0];
    each_of<3>([&](int r) { at.p[r] = S(link.p[r]) + travel * at.R(r, 2); });
  }
  template <class S>
  [[gnu::always_inline]] static Vector3<S> arm(const LinkOf<S>&, const Place<S>& at) { return at.p; }
};
struct Ball {
  static constexpr int nq = 4, nv = 3, row = -1;
  static constexpr bool pin = false;
  template <class S>
  static auto rotation(const Place<S>& place) { return Full<S>{place.R}; }
  template <class S>
  [[gnu::always_inline]] static void place(const LinkOf<S>& link, const S* q, Place<S>& at) { at.R = product(fixed_rotation<S>(link), rotation_of(q)); }
  template <class S>
  [[gnu::always_inline]] static Vector3<S> arm(const LinkOf<S>& link, const Place<S>&) { return spread<S>(link.p); }
};
struct Free {
  static constexpr int nq = 7, nv = 6, row = -1;
  static constexpr bool pin = false;
  template <class S>
  static auto rotation(const Place<S>& place) { return Full<S>{place.R}; }
  template <class S>
  [[gnu::always_inline]] static void place(const LinkOf<S>& link, const S* q, Place<S>& at) {
    const Matrix3<S> R = fixed_rotation<S>(link);
    at.R = product(R, rotation_of(q));
    at.p = spread<S>(link.p) + R * Vector3<S>{q[4], q[5], q[6]};
  }
  template <class S>
  [[gnu::always_inline]] static Vector3<S> arm(const LinkOf<S>&, const Place<S>& at) { return at.p; }
};

template <class F>
[[gnu::always_inline]] inline void with_step(Step step, F&& f) {
  switch (step) {
    case Step::pin_x: return f(LevelPin<0>{});
    case Step::pin_y: return f(LevelPin<1>{});
    case Step::pin_z: return f(LevelPin<2>{});
    case Step::turned_pin: return f(TurnedPin{});
    case Step::helix: return f(Helix{});
    case Step::ball: return f(Ball{});
    case Step::free: return f(Free{});
  }
}

// By what a step is in the base's axes, where all pins are one.
template <class F>
[[gnu::always_inline]] inline void with_shape(Step step, F&& f) {
  switch (step) {
    case Step::helix: return f(Helix{});
    case Step::ball: return f(Ball{});
    case Step::free: return f(Free{});
    default: return f(TurnedPin{});
  }
}

// The coordinates of a link of every state, then its place.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void place_link(const Link<T>& link, const States<T>& at, Place<S>& place) {
  if constexpr (Kind::pin && S::width == 1) {
    Kind::place(link, SineCosine<S>{S(at.sines[link.q]), S(at.cosines[link.q])}, place);
  } else {
    S q[Kind::nq];
    for (int i = 0; i < Kind::nq; ++i) q[i] = gathered<S>(at.q + link.q + i, at.q_stride, at.states);
    if constexpr (Kind::pin)
      Kind::place(link, sine_cosine(q[0]), place);
    else
      Kind::place(link, q, place);
  }
}

// Of one state: the sines and cosines of all its coordinates, neighbours at once; what is no angle costs little. Of wide numbers, of which it would
// cost as much, of its pins. work: turns_size() numbers.
template <class T>
inline size_t padded(const Links<T>& links) { return size_t(links.nq + neighbours<T> - 1) / neighbours<T> * neighbours<T>; }
template <class T>
inline size_t turns_size(const Links<T>& links) { return (2 * padded(links) + 7) / 8 * 8; }  // what follows stays aligned
template <class T>
inline States<T> with_turns(const Links<T>& links, const States<T>& at, T* work) {
  constexpr int W = neighbours<T>;
  T* const cosines = work + padded(links);
  const auto turn = [&](int i, int count) {
    Lanes<T, W> q(T(0));
    for (int b = 0; b < W && b < count; ++b) q.set(b, T(at.q[i + b]));
    const SineCosine<Lanes<T, W>> of = sine_cosine(q);
    for (int b = 0; b < W; ++b) work[i + b] = of.sine.lane(b), cosines[i + b] = of.cosine.lane(b);
  };
  if constexpr (is_word<T>)
    for (int i = 0; i < links.nq; i += W) turn(i, links.nq - i);
  else
    for (int k = 0; k < links.count; ++k)
      if (links.link[k].step <= Step::turned_pin) turn(links.link[k].q, 1);
  States<T> turned = at;
  turned.sines = work, turned.cosines = cosines;
  return turned;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
