// rigid_blocks.h: residuals in a wider scalar, and the sizes of what they add up (algebra/trees/sweeps/residual_rounding.h).
#pragma once

#include <algorithm>
#include <cmath>

namespace pycraft {

template <class S>
template <class T>
inline void RigidBlocks<S>::inertia_wide(int k, const std::vector<MassProperties>& masses, const S* a, T* f, int m) const {
  for (int c = 0; c < m; ++c) {
    Vector6<T> force;
    wide_force<T, S>(masses[k], load(a, m, c), nullptr, force);
    store(force, f, m, c);
  }
}

template <class S>
template <class T>
inline void RigidBlocks<S>::shift_add_wide(int k, const T* x, T* y, int m) const {
  for (int c = 0; c < m; ++c) {
    Vector6<T> sum = load(y, m, c);
    add_wide_to_parent(pose[k], load(x, m, c), sum);
    store(sum, y, m, c);
  }
}

// r = b - H f - J x
template <class S>
template <class T>
inline void RigidBlocks<S>::residual_wide(int k, const T* f, const S* x, const S* b, S* r, int m) const {
  for (int c = 0; c < m; ++c)
    for (int j = first(k); j < last(k); ++j) {
      const size_t at = size_t(j - first(k)) * m + c;
      r[at] = static_cast<S>(T(b[at]) - wide_dot(H[j], load(f, m, c)) - T(J[j]) * T(x[at]));
    }
}

// Poses and hinge maps are rounded as motions are, but for turns by right angles without travel, and axes of coordinates.
template <class S>
inline bool RigidBlocks<S>::exact_pose(int k) const {
  for (int j = first(k); j < last(k); ++j)
    if (aligned[j] < 0 || aligned[j] > 2) return false;
  return std::all_of(pose[k].R.m, pose[k].R.m + 9, [](const S& x) { return x == S(0) || x == S(1) || x == S(-1); });
}

template <class S>
inline void RigidBlocks<S>::motion_sizes(int k, const S* parent, const S* x, const S* a, S* out, int m) const {
  using std::abs;
  const Pose<S> X = sizes::of<S>(pose[k]);
  for (int c = 0; c < m; ++c) {
    Vector6<S> sum = sizes::of<S>(load(a, m, c));
    if (parent) sum = sum + sizes::motion_carried(X, sizes::of<S>(load(parent, m, c)));
    for (int j = first(k); j < last(k); ++j) sum = sum + S(abs(x[(j - first(k)) * m + c])) * sizes::of<S>(H[j]);
    store(sum, out, m, c);
  }
}

// of M a, twice: of its terms and of what they add up to
template <class S>
template <class Units>
inline void RigidBlocks<S>::inertia_sizes(int k, const S* a, const Units& u, S* out, int m) const {
  const RigidInertia<S> M = sizes::of<S>(inertia[k]);
  for (int c = 0; c < m; ++c) store(S(S(2) * u.force) * sizes::pushed(M, sizes::of<S>(load(a, m, c))), out, m, c);
}

template <class S>
template <class Units>
inline void RigidBlocks<S>::shifted_force_sizes(int k, const S* f, const Units& u, S* out, int m) const {
  const Pose<S> X = sizes::of<S>(pose[k]);
  const S& unit = exact_pose(k) ? u.force : u.motion;
  for (int c = 0; c < m; ++c) add_to(unit * sizes::force_carried(X, sizes::of<S>(load(f, m, c))), out, m, c);
}

template <class S>
template <class Units>
inline void RigidBlocks<S>::coordinate_sizes(int k, const S* f, const S* x, const Units& u, S* out, int m) const {
  using std::abs;
  for (int c = 0; c < m; ++c) {
    const Vector6<S> size = sizes::of<S>(load(f, m, c));
    for (int j = first(k); j < last(k); ++j) {
      const size_t at = size_t(j - first(k)) * m + c;
      out[at] = (aligned[j] >= 0 ? u.force : u.motion) * dot(sizes::of<S>(H[j]), size) + u.force * J[j] * S(abs(x[at]));
    }
  }
}

}  // namespace pycraft
