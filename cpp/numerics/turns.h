// An angle without its whole turns, where a scalar's own sine and cosine would lose digits to them.
#pragma once

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

}  // namespace pycraft
