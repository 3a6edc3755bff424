// What is decided by numbers, said so that recorded ones (recorded.h) need no guard for it: they write it down whole, or decide it once for all
// states.
#pragma once

#include <cmath>

#include "numerics/scalar.h"

namespace pycraft {

// Zero, so that what it is a factor of may be left out.
template <class S>
inline bool vanishes(const S& x) {
  return x == S(0);
}
template <class S>
inline S where_less(const S& a, const S& b, const S& then, const S& otherwise) {
  return a < b ? then : otherwise;
}
// b where it is not at most a.
template <class S>
inline S larger_or_odd(const S& a, const S& b) {
  return b <= a ? a : b;
}
template <class S>
inline bool is_finite(const S& x) {
  return std::isfinite(to_double(x));
}
// x = fraction 2^exponent, 1/2 <= |fraction| < 1.
template <class S>
inline S split(const S& x, long& exponent) {
  using std::frexp;
  int n = 0;
  const S fraction = frexp(x, &n);
  exponent = n;
  return fraction;
}
// A number by which is decided what all states may have in common, as an order of pivots.
template <class S>
inline const S& soft(const S& x) {
  return x;
}
template <class S>
using Soft = std::conditional_t<is_recorded<S>, double, S>;
// What follows is in no recording: it ends here.
template <class S>
inline void off_tape(const S&) {}
// Entry i of a state's configuration (array 0) or velocities (1): an input of what is recorded.
template <class S>
inline S of_state(double x, int /*array*/, int /*i*/) {
  return S(x);
}

}  // namespace pycraft
