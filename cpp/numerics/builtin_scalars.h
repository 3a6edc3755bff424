// Scalars that a compiler knows, or all but knows: single, double, extended, quad.
#pragma once

#include <cfloat>

#if LDBL_MANT_DIG <= 53
#include <boost/multiprecision/cpp_double_fp.hpp>
#endif
#if defined(PYCRAFT_FLOAT128)
#include <boost/multiprecision/float128.hpp>
#else
#include <boost/multiprecision/cpp_bin_float.hpp>
#endif

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

}  // namespace pycraft
