// Poses: X_PB takes coordinates in B to coordinates in P. φ(P, B) carries spatial forces from B to P, φ*(P, B) motions from P to B.
//
//   φ(P,B) = [[R, l~R], [0, R]],   φ*(P,B) = [[R*, 0], [-R*l~, R*]],   R = R_PB, l = p_PB in P's axes.
//
// Spatial vectors are (angular; linear), six scalars in a row: motion (ω; v), force (n; f).
#pragma once

#include "spatial/rotation.h"
#include "spatial/vector3.h"

namespace pycraft {

template <class S>
struct Vector6 {
  Vector3<S> angular, linear;
  S& operator[](int i) { return i < 3 ? angular[i] : linear[i - 3]; }
  const S& operator[](int i) const { return i < 3 ? angular[i] : linear[i - 3]; }
  static Vector6 zero() { return {Vector3<S>::zero(), Vector3<S>::zero()}; }
};

template <class S>
[[gnu::always_inline]] inline Vector6<S> operator+(const Vector6<S>& a, const Vector6<S>& b) {
  return {a.angular + b.angular, a.linear + b.linear};
}
template <class S>
[[gnu::always_inline]] inline Vector6<S> operator-(const Vector6<S>& a, const Vector6<S>& b) {
  return {a.angular - b.angular, a.linear - b.linear};
}
template <class S>
[[gnu::always_inline]] inline Vector6<S> operator*(const S& c, const Vector6<S>& a) {
  return {c * a.angular, c * a.linear};
}
template <class S>
[[gnu::always_inline]] inline S dot(const Vector6<S>& a, const Vector6<S>& b) {
  return dot(a.angular, b.angular) + dot(a.linear, b.linear);
}
// V~ W = crm(V) W, the cross product of motions.
template <class S>
[[gnu::always_inline]] inline Vector6<S> cross_motion(const Vector6<S>& V, const Vector6<S>& W) {
  return {cross(V.angular, W.angular), cross(V.linear, W.angular) + cross(V.angular, W.linear)};
}
// V¯ f = crf(V) f = -(V~)* f, a motion's cross product with a force.
template <class S>
[[gnu::always_inline]] inline Vector6<S> cross_force(const Vector6<S>& V, const Vector6<S>& f) {
  return {cross(V.angular, f.angular) + cross(V.linear, f.linear), cross(V.angular, f.linear)};
}
template <class T, class S>
inline Vector6<T> cast(const Vector6<S>& a) {
  return {cast<T>(a.angular), cast<T>(a.linear)};
}

template <class S>
struct Pose {
  Matrix3<S> R;
  Vector3<S> p;
  static Pose identity() { return {Matrix3<S>::identity(), Vector3<S>::zero()}; }
};

// X_PC = X_PB * X_BC.
template <class S>
inline Pose<S> operator*(const Pose<S>& X_PB, const Pose<S>& X_BC) {
  return {X_PB.R * X_BC.R, X_PB.p + X_PB.R * X_BC.p};
}
template <class S>
inline Pose<S> inverse(const Pose<S>& X) {
  return {transpose(X.R), -transpose_times(X.R, X.p)};
}
template <class S>
[[gnu::always_inline]] inline Vector6<S> force_to_parent(const Pose<S>& X, const Vector6<S>& f) {
  const Vector3<S> linear = X.R * f.linear;
  return {X.R * f.angular + cross(X.p, linear), linear};
}
template <class S>
[[gnu::always_inline]] inline Vector6<S> motion_to_child(const Pose<S>& X, const Vector6<S>& V) {
  return {transpose_times(X.R, V.angular), transpose_times(X.R, V.linear - cross(X.p, V.angular))};
}
template <class T, class S>
inline Pose<T> cast(const Pose<S>& X) {
  return {cast<T>(X.R), cast<T>(X.p)};
}

// The left Jacobian of SO(3) times v: the translation that the twist (w; v) makes in unit time.
template <class S>
inline Vector3<S> screw_translation(const Vector3<S>& w, const Vector3<S>& v) {
  const S angle = norm(w);
  const Vector3<S> wv = cross(w, v);
  return v + cosc(angle) * wv + sincc(angle) * cross(w, wv);
}
// exp on SE(3) of a body twist.
template <class S>
inline Pose<S> exp_pose(const Vector6<S>& twist) {
  return {exp_rotation(twist.angular), screw_translation(twist.angular, twist.linear)};
}
// The twist of a pose whose rotation vector w is known, θ = |w| <= π:
//   v = p - w×p/2 + c w×(w×p),   c = (1 - sinc θ / (2 cosc θ))/θ² = (2 cosc θ - sinc θ)/(2 θ² cosc θ).
// Below 1 the numerator over θ² is summed as the series Σ_{k>=1} (-1)^{k+1} 2k θ^{2k-2}/(2k+2)!, which does not cancel.
template <class S>
inline Vector6<S> log_pose(const Vector3<S>& w, const Vector3<S>& p) {
  const S angle = norm(w), a = sinc(angle), b = cosc(angle), y = angle * angle;
  S c;
  if (angle > S(1)) {
    c = (S(1) - a / (S(2) * b)) / y;
  } else {
    S power = S(1), factorial = S(24), sum = S(0);
    for (int k = 1; k < 40; ++k) {
      const S next = sum + (k % 2 ? S(1) : S(-1)) * power * S(2 * k) / factorial;
      if (next == sum) break;
      sum = next;
      power *= y;
      factorial *= S(2 * k + 3) * S(2 * k + 4);
    }
    c = sum / (S(2) * b);
  }
  const Vector3<S> wp = cross(w, p);
  return {w, p - S(0.5) * wp + c * cross(w, wp)};
}

}  // namespace pycraft
