// A pack of numbers, one per state: a scalar to every kernel that neither branches on a value nor compares two lanes.
//
// A comparison holds where it holds in every lane, so that `!(x > y)` is true as soon as one lane fails: what tests for trouble finds
// trouble in any lane, and the caller repeats the states one by one.
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>

#include "numerics/turns.h"

namespace pycraft {

template <class T, int W>
struct Pack {
  T v[W];
  Pack() = default;
  Pack(T x) {
    for (int i = 0; i < W; ++i) v[i] = x;
  }
  template <class U>
    requires(std::numeric_limits<U>::is_specialized && !std::is_same_v<U, T>)
  Pack(U x) : Pack(static_cast<T>(x)) {}
  explicit operator double() const { return v[0]; }

  Pack& operator+=(const Pack& b) {
    for (int i = 0; i < W; ++i) v[i] += b.v[i];
    return *this;
  }
  Pack& operator-=(const Pack& b) {
    for (int i = 0; i < W; ++i) v[i] -= b.v[i];
    return *this;
  }
  Pack& operator*=(const Pack& b) {
    for (int i = 0; i < W; ++i) v[i] *= b.v[i];
    return *this;
  }
  Pack& operator/=(const Pack& b) {
    for (int i = 0; i < W; ++i) v[i] /= b.v[i];
    return *this;
  }
  friend Pack operator+(Pack a, const Pack& b) { return a += b; }
  friend Pack operator-(Pack a, const Pack& b) { return a -= b; }
  friend Pack operator*(Pack a, const Pack& b) { return a *= b; }
  friend Pack operator/(Pack a, const Pack& b) { return a /= b; }
  friend Pack operator-(Pack a) {
    for (int i = 0; i < W; ++i) a.v[i] = -a.v[i];
    return a;
  }
  friend bool operator>(const Pack& a, const Pack& b) { return every(a, b, [](T x, T y) { return x > y; }); }
  friend bool operator==(const Pack& a, const Pack& b) { return every(a, b, [](T x, T y) { return x == y; }); }

  friend Pack sqrt(const Pack& a) { return each(a, [](T x) { return std::sqrt(x); }); }
  friend Pack abs(const Pack& a) { return each(a, [](T x) { return std::abs(x); }); }
  friend Pack sin(const Pack& a) { return each(a, [](T x) { return std::sin(x); }); }
  friend TurnSines<Pack> turn_sines(const Pack& angle) {  // with the bits of each number
    TurnSines<Pack> of;
    for (int i = 0; i < W; ++i) {
      const TurnSines<T> one = turn_sines(angle.v[i]);
      of.cosine.v[i] = one.cosine, of.sine.v[i] = one.sine, of.sine_of_half.v[i] = one.sine_of_half;
    }
    return of;
  }
  friend Pack cos(const Pack& a) { return each(a, [](T x) { return std::cos(x); }); }
  friend Pack maximum(const Pack& a, const Pack& b) {
    Pack c;
    for (int i = 0; i < W; ++i) c.v[i] = a.v[i] < b.v[i] ? b.v[i] : a.v[i];
    return c;
  }
  friend Pack ratio_or_zero(const Pack& a, const Pack& b) {
    Pack c;
    for (int i = 0; i < W; ++i) c.v[i] = b.v[i] == T(0) ? T(0) : a.v[i] / b.v[i];
    return c;
  }

 private:
  template <class F>
  static Pack each(const Pack& a, F f) {
    Pack c;
    for (int i = 0; i < W; ++i) c.v[i] = f(a.v[i]);
    return c;
  }
  template <class F>
  static bool every(const Pack& a, const Pack& b, F f) {
    bool all = true;
    for (int i = 0; i < W; ++i) all &= f(a.v[i], b.v[i]);
    return all;
  }
};

template <class T, int W>
inline constexpr bool is_pack<Pack<T, W>> = true;

}  // namespace pycraft

template <class T, int W>
struct std::numeric_limits<pycraft::Pack<T, W>> : std::numeric_limits<T> {};
