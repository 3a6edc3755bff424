// Rotations: from an axis and an angle, from a unit quaternion, and the exponential and logarithm on SO(3).
#pragma once

#include <cmath>

#include "numerics/scalar.h"
#include "numerics/turns.h"
#include "spatial/vector3.h"

namespace pycraft {

// Σ term(k), term(0) given, term(k) = -y term(k-1) / ((2k + m - 1)(2k + m)), to the last one that counts.
template <class S>
inline S alternating_series(S term, const S& y, int m) {
  S sum = term;
  for (int k = 1; k < 40; ++k) {
    term *= -y / (S(2 * k + m - 1) * S(2 * k + m));
    const S next = sum + term;
    if (next == sum) break;
    sum = next;
  }
  return sum;
}
// sin(x)/x.
template <class S>
inline S sinc(const S& x) {
  using std::abs;
  using std::sin;
  if (abs(x) > S(0.0625)) return sin(x) / x;
  return alternating_series(S(1), S(x * x), 1);
}
// (1 - cos x)/x², without cancellation.
template <class S>
inline S cosc(const S& x) {
  const S half = sinc(x / S(2));
  return half * half / S(2);
}
// (x - sin x)/x³, without cancellation.
template <class S>
inline S sincc(const S& x) {
  using std::abs;
  using std::sin;
  if (abs(x) > S(1)) return (x - sin(x)) / (x * x * x);
  return alternating_series(S(S(1) / S(6)), S(x * x), 3);
}

// exp(w~) = 1 + sinc|w| w~ + cosc|w| w~².
template <class S>
inline Matrix3<S> exp_rotation(const Vector3<S>& w) {
  const S angle = norm(w), a = sinc(angle), b = cosc(angle);
  const S xx = w[0] * w[0], yy = w[1] * w[1], zz = w[2] * w[2], xy = w[0] * w[1], xz = w[0] * w[2], yz = w[1] * w[2];
  return {S(1) - b * (yy + zz), b * xy - a * w[2],      b * xz + a * w[1],
          b * xy + a * w[2],    S(1) - b * (xx + zz),   b * yz - a * w[0],
          b * xz - a * w[1],    b * yz + a * w[0],      S(1) - b * (xx + yy)};
}

// The rotation about a unit axis: cos, sin of the angle taken once, at full accuracy for angles of any size.
template <class S>
inline Matrix3<S> axis_rotation(const Vector3<S>& axis, const S& angle) {
  const TurnSines<S> of = turn_sines(angle);
  const S &c = of.cosine, &s = of.sine, v = S(2) * of.sine_of_half * of.sine_of_half;
  const S xy = v * axis[0] * axis[1], xz = v * axis[0] * axis[2], yz = v * axis[1] * axis[2];
  return {c + v * axis[0] * axis[0], xy - s * axis[2],          xz + s * axis[1],
          xy + s * axis[2],          c + v * axis[1] * axis[1], yz - s * axis[0],
          xz - s * axis[1],          yz + s * axis[0],          c + v * axis[2] * axis[2]};
}

template <class S>
struct Quaternion {
  S w, x, y, z;
};

// q, divided by its largest component where squares of it might overflow or vanish.
template <class S>
inline Quaternion<S> with_squares(const Quaternion<S>& q) {
  using std::abs;
  const S square = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  if (square > S(1e-20) && S(1e20) > square) return q;
  const S scale = S(1) / maximum(maximum(S(abs(q.w)), S(abs(q.x))), maximum(S(abs(q.y)), S(abs(q.z))));
  return {scale * q.w, scale * q.x, scale * q.y, scale * q.z};
}

// |q|, also where squares overflow or vanish.
template <class S>
inline S length(const Quaternion<S>& q) {
  using std::abs;
  using std::sqrt;
  const S square = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  if (square > S(1e-20) && S(1e20) > square) return sqrt(square);
  const S largest = maximum(maximum(S(abs(q.w)), S(abs(q.x))), maximum(S(abs(q.y)), S(abs(q.z))));
  if (!(largest > S(0))) return S(0);
  const S w = q.w / largest, x = q.x / largest, y = q.y / largest, z = q.z / largest;
  return largest * sqrt(S(w * w + x * x + y * y + z * z));
}

// R(q/|q|): the quaternion is used normalised and never rewritten.
template <class S>
inline Matrix3<S> quaternion_rotation(const Quaternion<S>& given) {
  const Quaternion<S> q = with_squares(given);
  const S s = S(2) / (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  const S xx = s * q.x * q.x, yy = s * q.y * q.y, zz = s * q.z * q.z, xy = s * q.x * q.y, xz = s * q.x * q.z, yz = s * q.y * q.z;
  const S wx = s * q.w * q.x, wy = s * q.w * q.y, wz = s * q.w * q.z;
  return {S(1) - (yy + zz), xy - wz, xz + wy, xy + wz, S(1) - (xx + zz), yz - wx, xz - wy, yz + wx, S(1) - (xx + yy)};
}

template <class S>
inline Quaternion<S> operator*(const Quaternion<S>& a, const Quaternion<S>& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

// The unit quaternion of exp(w~).
template <class S>
inline Quaternion<S> exp_quaternion(const Vector3<S>& w) {
  using std::cos;
  const S half = norm(w) / S(2), a = sinc(half) / S(2);
  return {cos(half), a * w[0], a * w[1], a * w[2]};
}

// w with exp(w~) = R(q), |w| <= pi.
template <class S>
inline Vector3<S> log_quaternion(Quaternion<S> q) {
  using std::atan2;
  using std::sqrt;
  if (q.w < S(0)) q = {-q.w, -q.x, -q.y, -q.z};
  const S sine = sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
  const S length = sqrt(q.w * q.w + sine * sine);
  // angle/sin(angle/2), of relative accuracy epsilon down to zero: atan2(s, w)/s -> 1/w.
  const S scale = sine > length * epsilon<S>() ? S(2) * atan2(sine, q.w) / sine : S(2) / q.w;
  return {scale * q.x, scale * q.y, scale * q.z};
}

// The quaternion of a rotation matrix, w >= 0 (Shepperd's choice of the largest component).
template <class S>
inline Quaternion<S> rotation_quaternion(const Matrix3<S>& R) {
  using std::sqrt;
  const S trace = R(0, 0) + R(1, 1) + R(2, 2);
  Quaternion<S> q;
  if (trace >= R(0, 0) && trace >= R(1, 1) && trace >= R(2, 2)) {
    q = {S(1) + trace, R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)};
  } else if (R(0, 0) >= R(1, 1) && R(0, 0) >= R(2, 2)) {
    q = {R(2, 1) - R(1, 2), S(1) + S(2) * R(0, 0) - trace, R(0, 1) + R(1, 0), R(0, 2) + R(2, 0)};
  } else if (R(1, 1) >= R(2, 2)) {
    q = {R(0, 2) - R(2, 0), R(0, 1) + R(1, 0), S(1) + S(2) * R(1, 1) - trace, R(1, 2) + R(2, 1)};
  } else {
    q = {R(1, 0) - R(0, 1), R(0, 2) + R(2, 0), R(1, 2) + R(2, 1), S(1) + S(2) * R(2, 2) - trace};
  }
  S scale = S(1) / sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  if (q.w < S(0)) scale = -scale;
  return {scale * q.w, scale * q.x, scale * q.y, scale * q.z};
}

}  // namespace pycraft
