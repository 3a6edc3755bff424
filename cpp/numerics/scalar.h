// Scalars the engine runs on, on every platform: single, double, extended, quad, and 50 and 100 decimal digits.
#pragma once

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>
#include <vector>

#if LDBL_MANT_DIG <= 53
#include <boost/multiprecision/cpp_double_fp.hpp>
#endif
#if defined(PYCRAFT_FLOAT128)
#include <boost/multiprecision/float128.hpp>
#endif
#include <boost/multiprecision/cpp_bin_float.hpp>

namespace pycraft {

using Single = float;

// "extended": long double where it is wider than double (x86: 64 bits, eps 1e-19; Linux on arm64: 113 bits), else double-double.
#if LDBL_MANT_DIG > 53
using Extended = long double;
#else
using Extended = boost::multiprecision::cpp_double_double;
#endif

// "quad": 113 bits, eps 2e-34; the compiler's own type where there is one.
#if defined(PYCRAFT_FLOAT128)
using Quad = boost::multiprecision::number<boost::multiprecision::float128_backend, boost::multiprecision::et_off>;
#else
using Quad = boost::multiprecision::number<boost::multiprecision::cpp_bin_float_quad::backend_type, boost::multiprecision::et_off>;
#endif

// For references: 50 and 100 decimal digits.
using Digits50 = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<50>, boost::multiprecision::et_off>;
using Digits100 = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<100>, boost::multiprecision::et_off>;

// X(S) for the scalars up to quad, and for every scalar, from narrow to wide.
#define PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(X) X(Single) X(double) X(Extended) X(Quad)
#define PYCRAFT_FOR_EACH_SCALAR(X) X(Single) X(double) X(Extended) X(Quad) X(Digits50) X(Digits100)

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
