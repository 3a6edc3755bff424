// Scalars the engine runs on: double, extended and quad, on every platform.
#pragma once

#include <cfloat>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#if LDBL_MANT_DIG <= 53
#include <boost/multiprecision/cpp_double_fp.hpp>
#endif
#if defined(PYCRAFT_FLOAT128)
#include <boost/multiprecision/float128.hpp>
#else
#include <boost/multiprecision/cpp_bin_float.hpp>
#endif

namespace pycraft {

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

// One thing per scalar that the engine runs on: std::get<Thing<S>>(...).
template <template <class> class Thing>
using PerScalar = std::tuple<Thing<double>, Thing<Extended>, Thing<Quad>>;

template <class S>
inline S epsilon() {
  return std::numeric_limits<S>::epsilon();
}

template <class S>
inline double to_double(const S& x) {
  return static_cast<double>(x);
}

// An exact sum of doubles that is worth x: what a wider number becomes when it leaves the core.
template <class S>
inline std::vector<double> expansion(S x) {
  std::vector<double> parts;
  for (int i = 0; i < 4; ++i) {
    const double head = static_cast<double>(x);
    parts.push_back(head);
    if (!std::isfinite(head)) break;
    x -= S(head);
    if (x == S(0)) break;
  }
  return parts;
}

}  // namespace pycraft
