// Forces in a scalar T that is wider than that of the poses, motions and hinge maps which they meet. Each of these numbers is widened where
// it is used, and masses come as the doubles that were given: wide copies would cost more than the arithmetic.
#pragma once

#include <type_traits>

#include "spatial/pose.h"
#include "spatial/rigid_inertia.h"

namespace pycraft {

// x in T, from memory each time: a processor that computes in wide registers widens as it loads, and stores them slowly.
template <class T, class S>
[[gnu::always_inline]] inline T widened(const S& x) {
#if defined(__x86_64__) && defined(__GNUC__)
  if constexpr (std::is_same_v<T, long double>) {
    const S* from = &x;
    asm volatile("" : "+r"(from));  // not the same number, for all that the compiler knows: it keeps no copy
    return T(*from);
  }
#endif
  return T(x);
}

// Numbers in T one by one, few at a time: a wide register file is small.
template <class T, class A, class B>
[[gnu::always_inline]] inline T product(const A& a, const B& b) {
  return widened<T>(a) * widened<T>(b);
}
// Row i of A times x.
template <class T, class S>
[[gnu::always_inline]] inline T wide_row(const Symmetric3<double>& A, int i, const Vector3<S>& x) {
  return product<T>(A(i, 0), x[0]) + product<T>(A(i, 1), x[1]) + product<T>(A(i, 2), x[2]);
}
template <class T, class S>
[[gnu::always_inline]] inline T wide_row(const Matrix3<S>& R, int i, const Vector3<T>& x) {
  return widened<T>(R(i, 0)) * widened<T>(x[0]) + widened<T>(R(i, 1)) * widened<T>(x[1]) + widened<T>(R(i, 2)) * widened<T>(x[2]);
}

// f = M a + (ω × Iω; ω × (ω × h)), without ω: M a. Of the centre of mass c: m (a + a_ω × c + ω × (ω × c)), and its moment.
template <class T, class S>
[[gnu::always_inline]] inline void wide_force(const MassProperties& M, const Vector6<S>& a, const Vector3<S>* omega, Vector6<T>& f) {
  const T mass = T(M.mass);
  const Vector3<double>& c = M.com;
  const Vector3<S>& turn = a.angular;
  T x = T(a.linear[0]) + (product<T>(turn[1], c[2]) - product<T>(turn[2], c[1]));
  T y = T(a.linear[1]) + (product<T>(turn[2], c[0]) - product<T>(turn[0], c[2]));
  T z = T(a.linear[2]) + (product<T>(turn[0], c[1]) - product<T>(turn[1], c[0]));
  if (omega) {
    const Vector3<S>& w = *omega;
    const T u = product<T>(w[1], c[2]) - product<T>(w[2], c[1]), v = product<T>(w[2], c[0]) - product<T>(w[0], c[2]), t = product<T>(w[0], c[1]) - product<T>(w[1], c[0]);
    x += widened<T>(w[1]) * t - widened<T>(w[2]) * v;
    y += widened<T>(w[2]) * u - widened<T>(w[0]) * t;
    z += widened<T>(w[0]) * v - widened<T>(w[1]) * u;
  }
  x *= mass, y *= mass, z *= mass;
  f.linear[0] = x, f.linear[1] = y, f.linear[2] = z;
  T p = widened<T>(c[1]) * z - widened<T>(c[2]) * y + wide_row<T>(M.about_com, 0, turn);
  T q = widened<T>(c[2]) * x - widened<T>(c[0]) * z + wide_row<T>(M.about_com, 1, turn);
  T r = widened<T>(c[0]) * y - widened<T>(c[1]) * x + wide_row<T>(M.about_com, 2, turn);
  if (omega) {
    const Vector3<S>& w = *omega;
    const T u = wide_row<T>(M.about_com, 0, w), v = wide_row<T>(M.about_com, 1, w), t = wide_row<T>(M.about_com, 2, w);
    p += widened<T>(w[1]) * t - widened<T>(w[2]) * v;
    q += widened<T>(w[2]) * u - widened<T>(w[0]) * t;
    r += widened<T>(w[0]) * v - widened<T>(w[1]) * u;
  }
  f.angular[0] = p, f.angular[1] = q, f.angular[2] = r;
}
// H f
template <class T, class S>
[[gnu::always_inline]] inline T wide_dot(const Vector6<S>& h, const Vector6<T>& f) {
  T sum = widened<T>(h[0]) * widened<T>(f[0]);
  for (int i = 1; i < 6; ++i) sum += widened<T>(h[i]) * widened<T>(f[i]);
  return sum;
}
// f of the parent += φ f
template <class T, class S>
[[gnu::always_inline]] inline void add_wide_to_parent(const Pose<S>& X, const Vector6<T>& f, Vector6<T>& parent) {
  const T x = wide_row<T>(X.R, 0, f.linear), y = wide_row<T>(X.R, 1, f.linear), z = wide_row<T>(X.R, 2, f.linear);
  parent.angular[0] += widened<T>(X.p[1]) * z - widened<T>(X.p[2]) * y + wide_row<T>(X.R, 0, f.angular);
  parent.angular[1] += widened<T>(X.p[2]) * x - widened<T>(X.p[0]) * z + wide_row<T>(X.R, 1, f.angular);
  parent.angular[2] += widened<T>(X.p[0]) * y - widened<T>(X.p[1]) * x + wide_row<T>(X.R, 2, f.angular);
  parent.linear[0] += x, parent.linear[1] += y, parent.linear[2] += z;
}

}  // namespace pycraft
