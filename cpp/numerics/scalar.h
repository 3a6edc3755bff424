// Scalars the engine runs on, on every platform: single, double, extended, quad, and 50 and 100 decimal digits.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>
#include <vector>

#include "numerics/builtin_scalars.h"
#include "numerics/digits.h"

namespace pycraft {

// X(S) for the scalars up to quad, and for every scalar, from narrow to wide.
#define PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(X) X(Single) X(double) X(Extended) X(Quad)
#define PYCRAFT_FOR_EACH_SCALAR(X) X(Single) X(double) X(Extended) X(Quad) X(Digits50) X(Digits100)

// The double that writes down what is done to it (recorded.h): a scalar to values and workspaces, and to nothing that a user names.
struct Recorded;
template <class S>
inline constexpr bool is_recorded = std::is_same_v<S, Recorded>;
#define PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(X) PYCRAFT_FOR_EACH_SCALAR(X) X(Recorded)

// One thing per scalar that the engine runs on: std::get<Thing<S>>(...).
template <template <class> class Thing>
using PerScalar = std::tuple<Thing<Single>, Thing<double>, Thing<Extended>, Thing<Quad>, Thing<Digits50>, Thing<Digits100>>;

// The next wider scalar; the widest is its own.
template <class S>
struct WiderThan {
  using type = S;
};
template <>
struct WiderThan<Single> {
  using type = double;
};
template <>
struct WiderThan<double> {
  using type = Extended;
};
template <>
struct WiderThan<Extended> {
  using type = Quad;
};
template <>
struct WiderThan<Quad> {
  using type = Digits50;
};
template <>
struct WiderThan<Digits50> {
  using type = Digits100;
};
template <class S>
using Wider = typename WiderThan<S>::type;

// Whether S stands for several numbers at once, so that no two of them can be ordered.
template <class S>
inline constexpr bool is_pack = false;

template <class S>
inline S epsilon() {
  return std::numeric_limits<S>::epsilon();
}

template <class S>
inline S maximum(const S& a, const S& b) {
  return a < b ? b : a;
}

template <class S>
inline double to_double(const S& x) {
  return static_cast<double>(x);
}

template <class S, class T>
inline void convert(const T* from, size_t n, std::vector<S>& to) {
  to.resize(n);
  for (size_t i = 0; i < n; ++i) to[i] = S(from[i]);
}

// An exact sum of doubles that is worth x: what a wider number becomes when it leaves the core.
template <class S>
inline std::vector<double> expansion(S x) {
  std::vector<double> parts;
  for (int i = 0; i < 8; ++i) {
    const double head = static_cast<double>(x);
    parts.push_back(head);
    if (!std::isfinite(head)) break;
    x -= S(head);
    if (x == S(0)) break;
  }
  return parts;
}

// x / y, and zero where y is.
template <class S>
inline S ratio_or_zero(const S& x, const S& y) {
  return y == S(0) ? S(0) : S(x / y);
}

}  // namespace pycraft
