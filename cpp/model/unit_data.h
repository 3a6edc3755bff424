// What models are declared with, as a scalar has it: unit axes and orthogonal rotations are so to the rounding of S, not of the doubles they were
// given in. Inverses of poses are taken by transposes.
#pragma once

#include <type_traits>

#include "spatial/pose.h"

namespace pycraft {

template <class S>
Vector3<S> renormalised(const Vector3<double>& a) {
  const Vector3<S> x = cast<S>(a);
  if constexpr (std::is_same_v<S, double>) return x;
  return (S(1) / norm(x)) * x;
}
template <class S>
Pose<S> renormalised(const Pose<double>& X) {
  if constexpr (std::is_same_v<S, double>) return X;
  const Pose<S> wide = cast<S>(X);
  return {quaternion_rotation(rotation_quaternion(wide.R)), wide.p};
}

}  // namespace pycraft
