// Scalars with the derivatives that what is compiled once for each of them may carry.
#pragma once

#include "numerics/recorded.h"
#include "numerics/scalar.h"
#include "numerics/tangent.h"

namespace pycraft {

// Along one direction.
template <class S>
using First = Tangent<S, 1>;
template <class S>
using Second = First<First<S>>;
// As effects of scenes carry them.
using Derivatives = Tangent<double, 4>;
using SecondDerivatives = Tangent<Derivatives, 4>;

// X(S) for every scalar, by itself and with derivatives.
#define PYCRAFT_FOR_EACH_CARRIED(X)                                                                                             \
  PYCRAFT_FOR_EACH_SCALAR(X)                                                                                                    \
  X(First<Single>) X(First<double>) X(First<Extended>) X(First<Quad>) X(First<Digits50>) X(First<Digits100>) X(Derivatives)      \
  X(Second<Single>) X(Second<double>) X(Second<Extended>) X(Second<Quad>) X(Second<Digits50>) X(Second<Digits100>) X(SecondDerivatives)
// Those that are written down: X(Recorded), by itself and with derivatives.
#define PYCRAFT_FOR_EACH_RECORDED(X) X(Recorded) X(First<Recorded>) X(Second<Recorded>)

}  // namespace pycraft
