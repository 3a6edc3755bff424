// The sizes of what inverse dynamics adds up, body by body and entry by entry: what the rounding of a residual τ - (ℳθ̈ + 𝒞) is made of,
// see algebra/sweeps/residual_rounding.h. Every product is that of newton_euler and velocities with absolute values, |·|. With u a unit of
// rounding, velocities are off by u dV, base to tip
//
//   dV(k) = |E*| (dV(p) + |V(p)|) + |V(k)| + |H*||θ̇|
//
// and so, besides their own rounding, a = ṼH*θ̇ and b = V̄MV by
//
//   da = (|V| + dV)~ |H*θ̇|,    db = (|V| + dV)¯ |MV| + |V|¯ |M| (|V| + dV)
//
// Poses and velocities are those that the solution was computed with, and no residual sees their rounding. In one scalar the forces' own
// is as large; where forces are gathered in a wider one it counts if `shared`: for the error of a value, and not for the question whether
// a correction makes it a better solution of the same equations.
//
// Cost O(N), after newton_euler at the same accelerations.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "algebra/sweeps/residual_rounding.h"
#include "operators/rigid_blocks.h"
#include "recursions/velocities.h"

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
template <class S>
inline Vector6<S> motion_crossed(const Vector6<S>& V, const Vector6<S>& x) {
  return {crossed(V.angular, x.angular), crossed(V.angular, x.linear) + crossed(V.linear, x.angular)};
}
template <class S>
inline Vector6<S> force_crossed(const Vector6<S>& V, const Vector6<S>& f) {
  return {crossed(V.angular, f.angular) + crossed(V.linear, f.linear), crossed(V.angular, f.linear)};
}

}  // namespace sizes

// alpha, f: of newton_euler at vdot. Numbers of a wider scalar T may be sized in a narrower S.
template <class S, class T>
void newton_euler_sizes(const SkoStructure& tree, const CompiledModel<T>& model, const RigidBlocks<T>& blocks, const Velocities<T>& velocities, const T* vdot,
                        const S* tau, const std::vector<Vector6<T>>& alpha, const std::vector<Vector6<T>>& f, const RoundingUnits<S>& units, bool shared,
                        ResidualSizes<S>& out) {
  using std::abs;
  out.resize(tree, 1);
  const auto size = [](const auto& x) { return sizes::of<S>(x); };
  const auto right_angles = [](const Matrix3<T>& R) {  // turns by right angles are exact
    return std::all_of(R.m, R.m + 9, [](const T& x) { return x == T(0) || x == T(1) || x == T(-1); });
  };
  const S carried = shared ? units.motion : units.force;
  const Vector6<S> base{Vector3<S>::zero(), size(model.gravity)};
  S* off = out.g.data();  // dV
  for (int k = 0; k < model.bodies; ++k) {
    const int p = model.parent[k], first = model.v_offset[k];
    const Pose<S> X = size(blocks.pose[k]);
    const RigidInertia<S> M = size(blocks.inertia[k]);
    const Vector6<S> V = size(velocities.V[k]), relative = size(velocities.relative[k]);
    Vector6<S> dV = V + relative, motion = size(alpha[k]) + size(velocities.a[k]);
    if (p >= 0) dV = dV + sizes::motion_carried(X, size(velocities.V[p]) + load(off + 6 * p, 1, 0));
    store(dV, off + 6 * k, 1, 0);
    motion = motion + sizes::motion_carried(X, p < 0 ? base : size(alpha[p])) + sizes::motion_crossed(V + dV, relative);
    for (int j = first; j < first + model.nv_of[k]; ++j) motion = motion + S(abs(static_cast<S>(vdot[j]))) * size(blocks.H[j]);
    store(units.motion * motion, out.motion.data() + tree.offset[k], 1, 0);
    const Vector6<S> own = S(2) * sizes::pushed(M, size(alpha[k])) + size(velocities.b[k]) + size(f[k]);
    const Vector6<S> gyroscopic = sizes::force_crossed(V + dV, size(blocks.inertia[k] * velocities.V[k])) + sizes::force_crossed(V, sizes::pushed(M, V + dV));
    store(units.force * own + carried * gyroscopic, out.force.data() + tree.offset[k], 1, 0);
  }
  for (int k = model.bodies - 1; k >= 0; --k) {
    const Vector6<S> total = size(f[k]);
    for (int j = model.v_offset[k]; j < model.v_offset[k] + model.nv_of[k]; ++j)
      out.coordinate[j] = units.force * (dot(size(blocks.H[j]), total) + S(abs(static_cast<S>(blocks.J[j] * vdot[j]))) + S(abs(tau[j])));
    if (const int p = model.parent[k]; p >= 0)
      add_to((right_angles(blocks.pose[k].R) ? units.force : carried) * sizes::force_carried(size(blocks.pose[k]), total), out.force.data() + tree.offset[p], 1, 0);
  }
}

}  // namespace pycraft
