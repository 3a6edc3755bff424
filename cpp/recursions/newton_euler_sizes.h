// The sizes of what inverse dynamics adds up, body by body and entry by entry: what the rounding of a residual τ - (ℳθ̈ + 𝒞) is made of,
// see algebra/sweeps/residual_rounding.h. Every product is that of newton_euler and point_accelerations with absolute values, |·|. With u a
// unit of rounding, angular velocities are off by u dω in any direction, base to tip
//
//   dω(k) = dω(p) + ‖ω(k)‖ + ‖ω(p)‖ + Σ ‖h_ω‖|θ̇|
//
// and a' and b' are with W = |ω| + dω, (w; u) the hinge's relative twist and l from the parent's origin
//
//   da' = (W × |w|;  W(p) × (W(p) × |l|) + 2 W × |u|),    db' = (W × |I| W;  W × (W × |h|))
//
// Poses and angular velocities are those that the solution was computed with, and no residual sees their rounding. In one scalar the forces' own
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
#include "recursions/point_accelerations.h"

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

// alpha, f: of newton_euler at vdot. Numbers of a wider scalar T may be sized in a narrower S.
template <class S, class T>
void newton_euler_sizes(const SkoStructure& tree, const CompiledModel<T>& model, const RigidBlocks<T>& blocks, const PointAccelerations<T>& points, const T* v, const T* vdot,
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
  S* off = out.g.data();  // dω
  for (int k = 0; k < model.bodies; ++k) {
    const int p = model.parent[k], first = model.v_offset[k];
    const Pose<S> X = size(blocks.pose[k]);
    const RigidInertia<S> M = size(blocks.inertia[k]);
    Vector6<S> motion = size(alpha[k]) + size(points.a[k]) + sizes::motion_carried(X, p < 0 ? base : size(alpha[p])), relative = Vector6<S>::zero();
    for (int j = first; j < first + model.nv_of[k]; ++j) {
      const Vector6<S> h = size(blocks.H[j]);
      motion = motion + S(abs(static_cast<S>(vdot[j]))) * h;
      relative = relative + S(abs(static_cast<S>(v[j]))) * h;
    }
    const Vector3<S> own = size(points.angular_velocity[k]);
    off[k] = norm(own) + norm(relative.angular);
    if (p >= 0) {
      const Vector3<S> above = size(points.angular_velocity[p]), parents = above + Vector3<S>{off[p], off[p], off[p]};
      off[k] += off[p] + norm(above);
      motion.linear = motion.linear + transpose_times(X.R, sizes::crossed(parents, sizes::crossed(parents, X.p)));
    }
    const Vector3<S> spin = own + Vector3<S>{off[k], off[k], off[k]};  // W
    motion.angular = motion.angular + sizes::crossed(spin, relative.angular);
    motion.linear = motion.linear + S(2) * sizes::crossed(spin, relative.linear);
    store(units.motion * motion, out.motion.data() + tree.offset[k], 1, 0);
    const Vector6<S> force = S(2) * sizes::pushed(M, size(alpha[k])) + size(points.b[k]) + size(f[k]);
    const Vector6<S> gyroscopic{sizes::crossed(spin, M.rotational * spin), sizes::crossed(spin, sizes::crossed(spin, M.moment))};
    store(units.force * force + carried * gyroscopic, out.force.data() + tree.offset[k], 1, 0);
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
