// The number of Boost's behind one of 50 or 100 digits, for sources that need more of it than its arithmetic.
#pragma once

#include <new>
#include <type_traits>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "numerics/digits.h"

namespace pycraft {

template <unsigned decimals>
using DigitsValue = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<decimals>, boost::multiprecision::et_off>;

template <unsigned decimals>
inline const DigitsValue<decimals>& value_of(const Digits<decimals>& a) {
  using Value = DigitsValue<decimals>;
  // It holds its limbs itself: copying its bytes copies it, and nothing is left to destroy.
  static_assert(sizeof(Value) == Digits<decimals>::size && alignof(Value) <= alignof(Digits<decimals>) && std::is_trivially_destructible_v<Value>);
  return *std::launder(static_cast<const Value*>(a.bytes()));
}

template <unsigned decimals>
inline Digits<decimals> digits_of(const DigitsValue<decimals>& x) {
  Digits<decimals> made;
  new (made.bytes()) DigitsValue<decimals>(x);
  return made;
}

}  // namespace pycraft
