// A rigid body's spatial inertia by its ten numbers: mass m, first moment h = m c, inertia about the frame's origin.
//
//   M = [[I, h~], [-h~, m 1]]
#pragma once

#include "spatial/pose.h"
#include "spatial/symmetric3.h"

namespace pycraft {

template <class S>
struct RigidInertia {
  S mass;
  Vector3<S> moment;         // m c
  Symmetric3<S> rotational;  // about the body frame's origin
  static RigidInertia zero() { return {S(0), Vector3<S>::zero(), Symmetric3<S>::zero()}; }
};

// A body's numbers as they are given, of which inertias in any scalar are made.
struct MassProperties {
  double mass;
  Vector3<double> com;
  Symmetric3<double> about_com;
};

// From mass, centre of mass and the inertia about the centre of mass.
template <class S>
inline RigidInertia<S> rigid_inertia(const S& mass, const Vector3<S>& com, const Symmetric3<S>& about_com) {
  const Vector3<S> h = mass * com;
  Symmetric3<S> I = about_com;
  const Symmetric3<S> point = point_inertia(com);
  for (int i = 0; i < 6; ++i) I.s[i] += mass * point.s[i];
  return {mass, h, I};
}
template <class S>
[[gnu::always_inline]] inline Vector6<S> operator*(const RigidInertia<S>& M, const Vector6<S>& V) {
  return {M.rotational * V.angular + cross(M.moment, V.linear), M.mass * V.linear - cross(M.moment, V.angular)};
}
template <class S>
inline RigidInertia<S> operator+(const RigidInertia<S>& a, const RigidInertia<S>& b) {
  return {a.mass + b.mass, a.moment + b.moment, a.rotational + b.rotational};
}
// φ M φ*: the inertia of a body given in B, about P's origin and in P's axes, for the pose X = X_PB.
template <class S>
inline RigidInertia<S> to_parent(const Pose<S>& X, const RigidInertia<S>& M) {
  const Vector3<S> h = X.R * M.moment;
  Symmetric3<S> I = rotate(X.R, M.rotational);
  // -(l~h~ + h~l~) - m l~l~ = (l·h') 2·1 - (l h'* + h' l*), h' = h + m l/2
  const Vector3<S>& l = X.p;
  const Vector3<S> g = h + (S(0.5) * M.mass) * l;
  const S d = S(2) * dot(l, g);
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) I(i, j) += (i == j ? d : S(0)) - (l[i] * g[j] + g[i] * l[j]);
  return {M.mass, h + M.mass * l, I};
}
template <class T, class S>
inline RigidInertia<T> cast(const RigidInertia<S>& M) {
  return {T(M.mass), cast<T>(M.moment), cast<T>(M.rotational)};
}

}  // namespace pycraft
