// Sizes of what is added up in products of motions, forces, poses and inertias: the same with absolute values, entry by entry. S may be
// narrower than the numbers' own T.
#pragma once

#include <cmath>

#include "spatial/pose.h"
#include "spatial/rigid_inertia.h"

namespace pycraft {

namespace sizes {

template <class S, class T>
inline Vector3<S> of(const Vector3<T>& x) {
  using std::abs;
  return {abs(static_cast<S>(x[0])), abs(static_cast<S>(x[1])), abs(static_cast<S>(x[2]))};
}
template <class S, class T>
inline Vector6<S> of(const Vector6<T>& x) {
  return {of<S>(x.angular), of<S>(x.linear)};
}
template <class S, class T>
inline Pose<S> of(const Pose<T>& X) {
  using std::abs;
  Pose<S> size;
  for (int i = 0; i < 9; ++i) size.R.m[i] = abs(static_cast<S>(X.R.m[i]));
  size.p = of<S>(X.p);
  return size;
}
template <class S, class T>
inline RigidInertia<S> of(const RigidInertia<T>& M) {
  using std::abs;
  RigidInertia<S> size{static_cast<S>(M.mass), of<S>(M.moment), {}};
  for (int i = 0; i < 6; ++i) size.rotational.s[i] = abs(static_cast<S>(M.rotational.s[i]));
  return size;
}

// |x × y| and what follows, of sizes.
template <class S>
inline Vector3<S> crossed(const Vector3<S>& a, const Vector3<S>& b) {
  return {a[1] * b[2] + a[2] * b[1], a[2] * b[0] + a[0] * b[2], a[0] * b[1] + a[1] * b[0]};
}
template <class S>
inline Vector6<S> motion_carried(const Pose<S>& X, const Vector6<S>& V) {
  return {transpose_times(X.R, V.angular), transpose_times(X.R, V.linear + crossed(X.p, V.angular))};
}
template <class S>
inline Vector6<S> force_carried(const Pose<S>& X, const Vector6<S>& f) {
  const Vector3<S> linear = X.R * f.linear;
  return {X.R * f.angular + crossed(X.p, linear), linear};
}
template <class S>
inline Vector6<S> pushed(const RigidInertia<S>& M, const Vector6<S>& V) {
  return {M.rotational * V.angular + crossed(M.moment, V.linear), M.mass * V.linear + crossed(M.moment, V.angular)};
}

}  // namespace sizes

}  // namespace pycraft
