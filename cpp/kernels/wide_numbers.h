// Numbers of twice the digits, in which forces of a residual are gathered: a double and what rounding took from it. Sums and products keep what
// the first loses and do not tidy up: the second is a rounding of all that was added, not of what is left of it, as the bound of
// residual_rounding_of_links.h has it. Errors are some u² of that.
//
// Source: T. Ogita, S. Rump, S. Oishi, Accurate sum and dot product, SIAM J. Sci. Comput. 26 (2005).
#pragma once

#include "kernels/links.h"
#include "kernels/rotations.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// a b - c, rounded once.
template <class S>
[[gnu::always_inline]] inline S product_less(const S& a, const S& b, const S& c) {
#ifdef __FMA__
  return a * b - c;
#else
  S d;
  for (int lane = 0; lane < S::width; ++lane) d.set(lane, __builtin_fma(a.lane(lane), b.lane(lane), -c.lane(lane)));
  return d;
#endif
}

template <class S>
struct Wide {
  S v, rest;
  Wide() = default;
  [[gnu::always_inline]] explicit Wide(const S& x) : v(x), rest(typename S::Scalar(0)) {}
  [[gnu::always_inline]] Wide(const S& x, const S& y) : v(x), rest(y) {}
  [[gnu::always_inline]] friend Wide operator+(const Wide& a, const Wide& b) {
    const S sum = a.v + b.v, other = sum - a.v;
    return {sum, S((a.rest + b.rest) + ((a.v - (sum - other)) + (b.v - other)))};
  }
  [[gnu::always_inline]] friend Wide operator-(const Wide& a) { return {-a.v, -a.rest}; }
  [[gnu::always_inline]] friend Wide operator-(const Wide& a, const Wide& b) { return a + -b; }
  [[gnu::always_inline]] friend Wide operator*(const S& a, const Wide& b) {
    const S product = a * b.v;
    return {product, S(product_less(a, b.v, product) + a * b.rest)};
  }
  [[gnu::always_inline]] Wide& operator+=(const Wide& b) { return *this = *this + b; }
  [[gnu::always_inline]] Wide& operator-=(const Wide& b) { return *this = *this - b; }
};

// A number of the state in V, S or wider, and back.
template <class V, class S>
[[gnu::always_inline]] inline V widened(const S& x) { return V(x); }
template <class S>
[[gnu::always_inline]] inline S narrowed(const S& x) { return x; }
template <class S>
[[gnu::always_inline]] inline S narrowed(const Wide<S>& x) { return x.v + x.rest; }

// l × f
template <class V, class S>
[[gnu::always_inline]] inline Vector3<V> arm_times(const Vector3<S>& l, const Vector3<V>& f) {
  return {l[1] * f[2] - l[2] * f[1], l[2] * f[0] - l[0] * f[2], l[0] * f[1] - l[1] * f[0]};
}

// f + M α of a link: mass, mass times centre and rotational inertia about the origin, and after them what rounding took from these.
template <class S>
[[gnu::always_inline]] inline void add_wide_force(const double* M, const Vector3<S>& alpha, const Vector3<S>& acceleration, Vector3<Wide<S>>& n, Vector3<Wide<S>>& f) {
  using V = Wide<S>;
  const auto number = [&](int i) __attribute__((always_inline)) { return V(S(M[i]), S(M[10 + i])); };
  const Vector3<V> h{number(1), number(2), number(3)};
  f = f + arm_times(alpha, h);
  each_of<3>([&](int i) { f[i] += acceleration[i] * number(0); });
  n = n - arm_times(acceleration, h);
  n[0] += alpha[0] * number(4) + alpha[1] * number(5) + alpha[2] * number(6);
  n[1] += alpha[0] * number(5) + alpha[1] * number(7) + alpha[2] * number(8);
  n[2] += alpha[0] * number(6) + alpha[1] * number(8) + alpha[2] * number(9);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
