// The sizes of what inverse dynamics adds up, body by body and entry by entry: what the rounding of a residual τ - (ℳθ̈ + 𝒞) is made of,
// see algebra/trees/sweeps/residual_rounding.h. Every product is that of newton_euler and point_accelerations with absolute values, |·|. With u a
// unit of rounding, angular velocities are off by u dω in any direction, base to tip
//
//   dω(k) = dω(p) + ‖ω(k)‖ + ‖ω(p)‖ + Σ ‖h_ω‖|θ̇|
//
// and a' and b' are with W = |ω| + dω, (w; u) the hinge's relative twist and l from the parent's origin
//
//   da' = (W × |w|;  W(p) × (W(p) × |l|) + 2 W × |u|),    db' = (W × |I| W;  W × (W × |h|))
//
// Poses, hinge maps off the axes and angular velocities are those that the solution was computed with, and no residual sees their rounding.
// In one scalar the forces' own is as large; where forces are gathered in a wider one theirs is left, and a correction within it makes a
// better solution of equations that are off by as much.
//
// Cost O(N), after newton_euler at the same accelerations.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "algebra/trees/sweeps/residual_rounding.h"
#include "recursions/applied.h"
#include "recursions/point_accelerations.h"
#include "rigid/rigid_blocks.h"
#include "spatial/sizes.h"

namespace pycraft {

// alpha, f: of newton_euler at vdot. Numbers of a wider scalar T may be sized in a narrower S.
template <class S, class T>
void newton_euler_sizes(const SkoStructure& tree, const CompiledModel<T>& model, const RigidBlocks<T>& blocks, const PointAccelerations<T>& points, const Applied<T>& applied, const T* v, const T* vdot,
                        const S* tau, const std::vector<Vector6<T>>& alpha, const std::vector<Vector6<T>>& f, const RoundingUnits<S>& units,
                        ResidualSizes<S>& out) {
  using std::abs;
  out.resize(tree, 1);
  const auto size = [](const auto& x) { return sizes::of<S>(x); };
  const Vector6<S> base{Vector3<S>::zero(), size(applied.gravity)};
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
    Vector6<S> force = S(2) * sizes::pushed(M, size(alpha[k])) + size(points.b[k]) + size(f[k]);
    if (applied.wrenches) force = force + size(applied.wrenches[k]);
    const Vector6<S> gyroscopic{sizes::crossed(spin, M.rotational * spin), sizes::crossed(spin, sizes::crossed(spin, M.moment))};
    store(units.force * force + units.motion * gyroscopic, out.force.data() + tree.offset[k], 1, 0);
  }
  for (int k = model.bodies - 1; k >= 0; --k) {
    const Vector6<S> total = size(f[k]);
    for (int j = model.v_offset[k]; j < model.v_offset[k] + model.nv_of[k]; ++j)
      out.coordinate[j] = (blocks.aligned[j] >= 0 ? units.force : units.motion) * dot(size(blocks.H[j]), total) +
                          units.force * (S(abs(static_cast<S>(blocks.J[j] * vdot[j]))) + S(abs(tau[j]))) + units.motion * S(abs(static_cast<S>(points.with_rotors(j, T(0)))));
    if (const int p = model.parent[k]; p >= 0)
      add_to((blocks.exact_pose(k) ? units.force : units.motion) * sizes::force_carried(size(blocks.pose[k]), total), out.force.data() + tree.offset[p], 1, 0);
  }
}

}  // namespace pycraft
