// An angle without its whole turns, where a scalar's own sine and cosine would lose digits to them.
#pragma once

#include "lanes/turn_sines.h"
#include "numerics/scalar.h"

namespace pycraft {

// Scalars of the C library and libquadmath take off whole turns themselves, at full accuracy.
template <class S>
inline const S& within_turns(const S& angle) {
  return angle;
}
// Boost's take them off at their own precision: of an angle of 10^60 nothing is left. Right for every angle of the range of doubles.
Digits50 within_turns(const Digits50& angle);
Digits100 within_turns(const Digits100& angle);


// What a rotation by an angle is made of.
template <class S>
struct TurnSines {
  S cosine, sine, sine_of_half;
};
template <class S>
inline TurnSines<S> turn_sines(const S& angle) {
  using std::cos, std::sin;
  const S within = within_turns(angle);
  return {cos(within), sin(within), sin(within / S(2))};
}
// With the bits that packs of states have (lanes/sine_cosine.h).
inline TurnSines<double> turn_sines(double angle) {
  double of[3];
  kernels::turn_sines(angle, of);
  return {of[0], of[1], of[2]};
}

}  // namespace pycraft
