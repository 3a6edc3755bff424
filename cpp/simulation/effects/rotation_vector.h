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
  for (int k = 1, nothing = 0; k < 60 && nothing < 3; ++k) {
    power *= -y;
    const S next = sum + power / S(2 * k + 1);
    if (next == sum) ++nothing;  // two terms more: first and second derivatives are of them, too
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

// θ̇ of a rotation vector, of the angular velocity in the axes that it turns from: the inverse of the exponential's left Jacobian,
//   J⁻¹ x = x - ½ θ × x + κ θ × (θ × x),   κ = (1 - ½θ cot ½θ)/θ²;      its adjoint has +½
template <class S>
inline S rotation_vector_kappa(const S& square) {
  S cosc = S(0.5), sum = S(1) / S(12);  // Σ (-y)^k/(2k + 2)!,  Σ_{k>=1} (-1)^{k+1} 2k y^{k-1}/(2k + 2)!
  if (square > S(1)) {
    using std::cos, std::sin, std::sqrt;
    const S angle = sqrt(square), c = (S(1) - S(cos(angle))) / square;
    return (S(1) - S(sin(angle)) / angle / (S(2) * c)) / square;
  }
  S power = S(1), factorial = S(2);
  for (int k = 1, nothing = 0; k < 40 && nothing < 3; ++k) {
    power *= -square;
    factorial *= S(2 * k + 1) * S(2 * k + 2);
    const S next = cosc + power / factorial;
    if (next == cosc) ++nothing;
    cosc = next;
    sum += S(2 * (k + 1)) * power / (factorial * S(2 * k + 3) * S(2 * k + 4));
  }
  return sum / (S(2) * cosc);
}
template <class S>
inline Vector3<S> rotation_vector_rate(const Vector3<S>& theta, const Vector3<S>& omega) {
  const Vector3<S> once = cross(theta, omega);
  return omega - S(0.5) * once + rotation_vector_kappa(S(dot(theta, theta))) * cross(theta, once);
}
// The moment, in the axes that θ turns from, whose power is x·θ̇.
template <class S>
inline Vector3<S> moment_along_rotation_vector(const Vector3<S>& theta, const Vector3<S>& x) {
  const Vector3<S> once = cross(theta, x);
  return x + S(0.5) * once + rotation_vector_kappa(S(dot(theta, theta))) * cross(theta, once);
}

template <class S>
inline Quaternion<S> conjugate(const Quaternion<S>& q) {
  return {q.w, -q.x, -q.y, -q.z};
}

}  // namespace pycraft
