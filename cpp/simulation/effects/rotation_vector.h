// Rotations as vectors, with derivatives everywhere but at half a turn: at no rotation, too, where a length has none.
#pragma once

#include <cmath>

#include "spatial/rotation.h"

namespace pycraft {

// atan(r/w)/r of r² = square, w > 0.
template <class S>
inline S angle_over_sine(const S& square, const S& w) {
  using std::atan2, std::sqrt;
  const S y = square / (w * w);
  if (y > S(0.01)) {
    const S r = sqrt(square);
    return S(atan2(r, w)) / r;
  }
  S power = S(1), sum = S(1);  // Σ (-y)^k/(2k + 1)
  for (int k = 1; k < 60; ++k) {
    power *= -y;
    const S next = sum + power / S(2 * k + 1);
    if (next == sum && k > 2) break;  // two terms more: derivatives are of them, too
    sum = next;
  }
  return sum / w;
}

// θ with exp(θ~) the rotation of a quaternion of any length, |θ| <= π.
template <class S>
inline Vector3<S> rotation_vector(const Quaternion<S>& q) {
  const S square = q.x * q.x + q.y * q.y + q.z * q.z;
  const bool turned = S(0) > q.w;
  const S w = turned ? -q.w : q.w;
  S scale;
  if (w * w > S(1e-8) * square) {
    scale = S(2) * angle_over_sine(square, w);
  } else {
    using std::atan2, std::sqrt;
    const S r = sqrt(square);
    scale = S(2) * S(atan2(r, w)) / r;
  }
  if (turned) scale = -scale;
  return {scale * q.x, scale * q.y, scale * q.z};
}

template <class S>
inline Quaternion<S> conjugate(const Quaternion<S>& q) {
  return {q.w, -q.x, -q.y, -q.z};
}

}  // namespace pycraft
