// Numbers with their derivatives along several directions at once: a scalar to every kernel, which then differentiates itself.
//
//   (x; d) (y; e) = (x y; x e + y d),  ...
//
// Comparisons are the values'. Where a value of zero has a derivative that does not vanish, a quotient or a root by it has none: NaN.
// Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, the forward mode with several directions.
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>

#include "numerics/decisions.h"
#include "numerics/turns.h"

namespace pycraft {

template <class T, int W>
struct Tangent {
  T x;
  T d[W];
  Tangent() = default;
  Tangent(const T& value) : x(value) {
    for (int i = 0; i < W; ++i) d[i] = T(0);
  }
  template <class U>
    requires(std::numeric_limits<U>::is_specialized && !std::is_same_v<U, T>)
  Tangent(const U& value) : Tangent(static_cast<T>(value)) {}
  explicit operator double() const { return to_double(x); }

  Tangent& operator+=(const Tangent& b) {
    x += b.x;
    for (int i = 0; i < W; ++i) d[i] += b.d[i];
    return *this;
  }
  Tangent& operator-=(const Tangent& b) {
    x -= b.x;
    for (int i = 0; i < W; ++i) d[i] -= b.d[i];
    return *this;
  }
  Tangent& operator*=(const Tangent& b) {
    const T left = x, right = b.x;
    for (int i = 0; i < W; ++i) d[i] = left * b.d[i] + right * d[i];
    x *= right;
    return *this;
  }
  Tangent& operator/=(const Tangent& b) {
    const T inverse = T(1) / b.x, ratio = x / b.x;
    for (int i = 0; i < W; ++i) d[i] = (d[i] - ratio * b.d[i]) * inverse;
    x = ratio;
    return *this;
  }
  friend Tangent operator+(Tangent a, const Tangent& b) { return a += b; }
  friend Tangent operator-(Tangent a, const Tangent& b) { return a -= b; }
  friend Tangent operator*(Tangent a, const Tangent& b) { return a *= b; }
  friend Tangent operator/(Tangent a, const Tangent& b) { return a /= b; }
  friend Tangent operator-(Tangent a) { return along(a, -a.x, T(-1)); }
  friend bool operator<(const Tangent& a, const Tangent& b) { return a.x < b.x; }
  friend bool operator>(const Tangent& a, const Tangent& b) { return a.x > b.x; }
  friend bool operator<=(const Tangent& a, const Tangent& b) { return a.x <= b.x; }
  friend bool operator>=(const Tangent& a, const Tangent& b) { return a.x >= b.x; }
  friend bool operator==(const Tangent& a, const Tangent& b) { return a.x == b.x; }

  friend Tangent abs(const Tangent& a) {
    if constexpr (is_recorded<T>)
      return along(a, abs(a.x), where_less(a.x, T(0), T(-1), T(1)));
    else
      return a.x < T(0) ? -a : a;
  }
  friend Tangent maximum(const Tangent& a, const Tangent& b)
    requires(is_recorded<T>)
  {
    Tangent c(maximum(a.x, b.x));
    for (int i = 0; i < W; ++i) c.d[i] = where_less(a.x, b.x, b.d[i], a.d[i]);
    return c;
  }
  friend Tangent within_turns(const Tangent& a) {
    return along(a, within_turns(a.x), T(1));
  }
  friend Tangent sin(const Tangent& a) {
    using std::cos, std::sin;
    return along(a, sin(a.x), cos(a.x));
  }
  friend Tangent cos(const Tangent& a) {
    using std::cos, std::sin;
    return along(a, cos(a.x), -sin(a.x));
  }
  friend Tangent sqrt(const Tangent& a) {
    using std::sqrt;
    const T root = sqrt(a.x);
    if (root == T(0)) return undefined_unless_constant(a);
    return along(a, root, T(0.5) / root);
  }
  friend Tangent atan2(const Tangent& y, const Tangent& x) {
    using std::atan2;
    const T square = x.x * x.x + y.x * y.x;
    Tangent b = along(y, atan2(y.x, x.x), x.x / square);
    for (int i = 0; i < W; ++i) b.d[i] -= y.x / square * x.d[i];
    return b;
  }
  friend Tangent tanh(const Tangent& a) {
    using std::tanh;
    const T value = tanh(a.x);
    return along(a, value, T(1) - value * value);
  }
  friend Tangent ratio_or_zero(const Tangent& a, const Tangent& b) {
    if (!(b.x == T(0))) return a / b;
    return undefined_unless_constant(a + b);
  }

 private:
  // (value; slope d)
  static Tangent along(const Tangent& a, const T& value, const T& slope) {
    Tangent b;
    b.x = value;
    for (int i = 0; i < W; ++i) b.d[i] = slope * a.d[i];
    return b;
  }
  static Tangent undefined_unless_constant(const Tangent& a) {
    Tangent b(T(0));
    for (int i = 0; i < W; ++i)
      if (!(a.d[i] == T(0))) b.d[i] = std::numeric_limits<T>::quiet_NaN();
    return b;
  }
};

}  // namespace pycraft

template <class T, int W>
struct std::numeric_limits<pycraft::Tangent<T, W>> : std::numeric_limits<T> {};
