// Coriolis matrices of any hinges, at any scalar: the columns of kernels/coriolis_matrix.h, of bodies, each in the inertial frame in which its origin
// rests at this instant, so that no common velocity is in them. Cost O(N · depth).
#pragma once

#include <algorithm>
#include <vector>

#include "recursions/inertial_frame.h"
#include "spatial/skew_part.h"

namespace pycraft {

template <class S>
struct CoriolisBodies {
  std::vector<Matrix3<S>> axes;            // per body, in the root's
  std::vector<Vector3<S>> arm, omega, drift, speed;
  std::vector<RigidInertia<S>> R;          // summed over the subtree, as what follows
  std::vector<MomentumRate<S>> B;
  std::vector<SkewPart<S>> K;
  std::vector<Vector6<S>> twist, twist_rate;  // per coordinate

  explicit CoriolisBodies(const CompiledModel<S>& m)
      : axes(m.bodies), arm(m.bodies), omega(m.bodies), drift(m.bodies), speed(m.bodies), R(m.bodies), B(m.bodies), K(m.bodies), twist(m.nv), twist_rate(m.nv) {}

  // From hinge kinematics at a configuration.
  void fill(const CompiledModel<S>& m, const RigidBlocks<S>& blocks, const S* v) {
    for (int k = 0; k < m.bodies; ++k) {
      check_interrupt_at(k);
      move(m, blocks, v, k);
      const RigidInertia<S>& I = m.inertia[k];
      R[k] = {I.mass, axes[k] * I.moment, rotate(axes[k], I.rotational)};
      B[k] = momentum_rate(R[k], {omega[k], Vector3<S>::zero()});
      K[k] = SkewPart<S>::of(R[k].mass, R[k].moment, R[k].rotational, omega[k]);
    }
    for (int k = m.bodies - 1; k >= 0; --k) {
      check_interrupt_at(k);
      const int p = m.parent[k];
      if (p < 0) continue;
      const Vector3<S>& d = drift[k];
      const MomentumRate<S> faster = B[k] + MomentumRate<S>{moment_square(d, R[k].moment), {cross(R[k].moment, d), R[k].mass * d}};
      SkewPart<S> moved = K[k];
      moved.speed_up(R[k].mass, R[k].moment, d), moved.move_inboard(arm[k]), K[p].add(moved);
      R[p] = R[p] + inertia_inboard(arm[k], R[k]), B[p] = B[p] + momentum_rate_inboard(arm[k], faster);
    }
  }

 private:
  void move(const CompiledModel<S>& m, const RigidBlocks<S>& blocks, const S* v, int k) {
    const int p = m.parent[k], first = m.v_offset[k], last = first + m.nv_of[k];
    const Pose<S>& X = blocks.pose[k];
    axes[k] = p < 0 ? Matrix3<S>::identity() : axes[p] * X.R;
    arm[k] = p < 0 ? Vector3<S>::zero() : axes[p] * X.p;
    omega[k] = p < 0 ? Vector3<S>::zero() : omega[p];
    drift[k] = p < 0 ? Vector3<S>::zero() : cross(omega[p], arm[k]);
    for (int c = first; c < last; ++c) twist[c] = {axes[k] * blocks.H[c].angular, axes[k] * blocks.H[c].linear};
    // Just outboard of a subhinge: what those inboard turn by, and against the body what those outboard move by.
    for (int i = m.first_subhinge[k], j = first; i < m.first_subhinge[k + 1]; ++i) {
      const int end = j + record_of(m.subhinges[i].kind).nv;
      Vector6<S> V = Vector6<S>::zero();
      for (int c = j; c < end; ++c) omega[k] = omega[k] + v[c] * twist[c].angular;
      V.angular = omega[k];
      for (int c = end; c < last; ++c) V.linear = V.linear - v[c] * twist[c].linear;
      for (; j < end; ++j) twist_rate[j] = cross_motion(V, twist[j]), drift[k] = drift[k] + v[j] * twist[j].linear;
    }
    speed[k] = p < 0 ? drift[k] : speed[p] + drift[k];
  }
};

// C, (nv, nv): Hφ(MJ̇ + 𝓑J) or Christoffel's.
template <class S>
void coriolis_matrix(const CompiledModel<S>& m, const CoriolisBodies<S>& of, bool skew, S* out) {
  const int N = m.nv;
  std::fill_n(out, size_t(N) * N, S(0));
  for (int b = 0; b < m.bodies; ++b) {
    SkewPart<S> K = of.K[b];
    K.speed_up(of.R[b].mass, of.R[b].moment, of.speed[b]);
    for (int k = m.v_offset[b]; k < m.v_offset[b] + m.nv_of[b]; ++k) {
      check_interrupt_at(k, b);
      const Vector6<S>& s = of.twist[k];
      Vector6<S> y = of.R[b] * s, r = of.R[b] * of.twist_rate[k] + S(0.5) * (of.B[b] * s);
      Vector6<S> c{S(0.5) * couple(of.B[b], s), Vector3<S>::zero()};
      if (skew) {
        const Vector6<S> turned{K.angular(s.angular, s.linear), K.linear(s.angular, s.linear)};
        r = r + turned, c = c - turned;
      }
      for (int a = b; a >= 0; a = m.parent[a]) {
        for (int i = m.v_offset[a]; i < m.v_offset[a] + m.nv_of[a]; ++i) {
          out[size_t(i) * N + k] = dot(of.twist[i], r);
          if (a != b) out[size_t(k) * N + i] = dot(of.twist_rate[i], y) + dot(of.twist[i], c);
        }
        c.angular = c.angular + cross(of.drift[a], y.linear);
        for (Vector6<S>* f : {&y, &r, &c}) *f = force_inboard(of.arm[a], *f);
      }
    }
  }
}

}  // namespace pycraft
