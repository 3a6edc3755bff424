// The sizes of what inverse dynamics adds up, body by body: what the rounding of a residual τ - (ℳθ̈ + 𝒞) is made of, see
// algebra/sweeps/residual_rounding.h. With u a unit of rounding, velocities are off by u dV, base to tip
//
//   dV(k) = |E*| dV(p) + |V(k)| + |E*||V(p)| + |H*||θ̇|
//
// and a = ṼH*θ̇ and b = V̄MV by what that makes of them besides their own rounding:
//
//   da = (|V| + dV)~ |H*θ̇|,    db = (|V| + dV)¯ |MV| + |V|¯ |M| (|V| + dV)
//
// Poses and velocities are those that the solution was computed with, and no residual sees their rounding. In S the force's own rounding
// is as large; where forces are gathered in a wider scalar it counts if `shared`: for the error of a value, and not for the question
// whether a correction makes it a better solution of the same equations.
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

// alpha, f: of newton_euler at vdot. Numbers of a wider scalar T may be sized in a narrower S.
template <class S, class T>
void newton_euler_sizes(const SkoStructure& tree, const CompiledModel<T>& model, const RigidBlocks<T>& blocks, const Velocities<T>& velocities, const T* vdot,
                        const S* tau, const std::vector<Vector6<T>>& alpha, const std::vector<Vector6<T>>& f, const RoundingUnits<S>& units, bool shared,
                        ResidualSizes<S>& sizes) {
  using std::abs;
  const auto size = [](const Vector3<T>& x) { return static_cast<S>(RigidBlocks<T>::magnitude(x)); };
  sizes.resize(tree, 1);
  struct Pair {
    S angular, linear;
  };
  // |x × y| of a motion and a motion, of a motion and a force
  const auto on_motion = [](const Pair& x, const Pair& y) { return Pair{S(x.angular * y.angular), S(x.linear * y.angular + x.angular * y.linear)}; };
  const auto on_force = [](const Pair& x, const Pair& y) { return Pair{S(x.angular * y.angular + x.linear * y.linear), S(x.angular * y.linear)}; };
  const auto store_alike = [](const Pair& x, S* out) { std::fill_n(out, 3, x.angular), std::fill_n(out + 3, 3, x.linear); };
  const auto sized = [&](const Vector6<T>& x) { return Pair{size(x.angular), size(x.linear)}; };
  const auto exact = [](const Matrix3<T>& R) {  // of turns by right angles nothing is rounded
    return std::all_of(R.m, R.m + 9, [](const T& x) { return x == T(0) || x == T(1) || x == T(-1); });
  };
  S* off = sizes.g.data();  // dV
  for (int k = 0; k < model.bodies; ++k) {
    const int p = model.parent[k], first = model.v_offset[k];
    const S offset = size(blocks.pose[k].p);
    const Pair V = sized(velocities.V[k]), relative = sized(velocities.relative[k]), a = sized(velocities.a[k]), own = sized(alpha[k]);
    Pair dV{S(V.angular + relative.angular), S(V.linear + relative.linear)};
    Pair motion{S(own.angular + a.angular), S(own.linear + a.linear)};
    const auto carried = [&](const Pair& x, Pair& to) { to.angular += x.angular, to.linear += x.linear + offset * x.angular; };
    if (p >= 0) {
      carried(sized(velocities.V[p]), dV), carried({off[2 * p], off[2 * p + 1]}, dV);
      carried(sized(alpha[p]), motion);
    } else {
      carried({S(0), size(model.gravity)}, motion);
    }
    off[2 * k] = dV.angular, off[2 * k + 1] = dV.linear;
    for (int j = first; j < first + model.nv_of[k]; ++j) {
      const S rate = abs(static_cast<S>(vdot[j]));
      motion.angular += rate * size(blocks.H[j].angular), motion.linear += rate * size(blocks.H[j].linear);
    }
    const Pair whole{S(V.angular + dV.angular), S(V.linear + dV.linear)};
    const Pair da = on_motion(whole, relative);
    motion.angular += da.angular, motion.linear += da.linear;
    store_alike({units.motion * motion.angular, units.motion * motion.linear}, sizes.motion.data() + tree.offset[k]);
    const auto inertia = [&](const Pair& x) {
      const Vector6<T> y = blocks.inertia_size(k, T(x.angular), T(x.linear));
      return Pair{static_cast<S>(y.angular[0]), static_cast<S>(y.linear[0])};
    };
    const Pair pushed = inertia(own), momentum = on_force(whole, sized(blocks.inertia[k] * velocities.V[k])), rest = on_force(V, inertia(whole)),
               b = sized(velocities.b[k]), total = sized(f[k]);
    const S off_by = shared ? units.motion : units.force;
    store_alike({S(units.force * (pushed.angular + b.angular + total.angular) + off_by * (momentum.angular + rest.angular)),
                 S(units.force * (pushed.linear + b.linear + total.linear) + off_by * (momentum.linear + rest.linear))},
                sizes.force.data() + tree.offset[k]);
  }
  for (int k = model.bodies - 1; k >= 0; --k) {
    const Pair total = sized(f[k]);
    const S offset = size(blocks.pose[k].p);
    for (int j = model.v_offset[k]; j < model.v_offset[k] + model.nv_of[k]; ++j)
      sizes.coordinate[j] = units.force * (size(blocks.H[j].angular) * total.angular + size(blocks.H[j].linear) * total.linear +
                                           abs(static_cast<S>(blocks.J[j] * vdot[j])) + abs(tau[j]));
    if (const int p = model.parent[k]; p >= 0) {
      S* to = sizes.force.data() + tree.offset[p];
      const S unit = shared && !exact(blocks.pose[k].R) ? units.motion : units.force;
      for (int i = 0; i < 3; ++i) to[i] += unit * (total.angular + offset * total.linear), to[3 + i] += unit * total.linear;
    }
  }
}

}  // namespace pycraft
