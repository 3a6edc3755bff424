#include "numerics/turns.h"

#include <boost/math/constants/constants.hpp>

#include "numerics/digits_value.h"

namespace pycraft {

namespace {

// 308 digits before the point, a hundred behind it, and some for the quotient's rounding.
using Long = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<430>, boost::multiprecision::et_off>;

template <unsigned decimals>
Digits<decimals> without_turns(const Digits<decimals>& angle) {
  if (!(abs(angle) > Digits<decimals>(4))) return angle;
  const Long x(value_of(angle)), turn = boost::math::constants::two_pi<Long>();
  return digits_of<decimals>(static_cast<DigitsValue<decimals>>(Long(x - turn * round(Long(x / turn)))));
}

}  // namespace

Digits50 within_turns(const Digits50& angle) { return without_turns(angle); }
Digits100 within_turns(const Digits100& angle) { return without_turns(angle); }

}  // namespace pycraft
