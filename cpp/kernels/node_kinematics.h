// Pose and Jacobian of a node by the links between it and the base, recursions/kinematics.h. With R the node's axes and p its origin in the
// frame of one link after another, from the node to the base:
//
//   columns of the link's hinge, in the node's axes:  R* h_ω,  R* (h_ω × p + h_v);   then  p <- l + E p,  R <- E R
//
// with E what turns the link's axes to its parent's, and l its origin there. What is not between has columns of zeros.
#pragma once

#include "kernels/steps.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class F>
[[gnu::always_inline]] inline void each_axis(F f) {
  f(std::integral_constant<int, 0>()), f(std::integral_constant<int, 1>()), f(std::integral_constant<int, 2>());
}

// visit(kind, link, R, p) at every link on the way; R and p become those of the base.
template <class S, class Visit>
[[gnu::always_inline]] inline void toward_base(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, Matrix3<S>& R, Vector3<S>& p, Visit visit) {
  each_of<9>([&](int i) { R.m[i] = S(at.node->R[i]); });
  p = spread<S>(at.node->p);
  int passed = 0;
  for (int k = at.node->link; k >= 0; k = links.link[k].parent) {
    stay_open(at, passed++);
    const auto& link = links.link[k];
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      visit(kind, link, R, p);
      Place<S> place;
      place_link<Kind>(link, at, place);
      const auto rotation = Kind::rotation(place);
      p = rotation.to_parent(p) + Kind::arm(link, place);
      each_of<3>([&](int c) {
        const Vector3<S> axis = rotation.to_parent(Vector3<S>{R(0, c), R(1, c), R(2, c)});
        R(0, c) = axis[0], R(1, c) = axis[1], R(2, c) = axis[2];
      });
    });
  }
}

// (6, nv), row-major.
template <class S>
unsigned node_jacobian(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t stride, typename S::Scalar*) {
  const size_t N = links.nv;
  for (int b = 0; b < S::width && b < at.states; ++b)
    for (size_t i = 0; i < 6 * N; ++i) out[b * stride + i] = 0;
  Matrix3<S> R;
  Vector3<S> p;
  toward_base(links, at, R, p, [&](auto kind, const LinkOf<S>& link, const Matrix3<S>& R, const Vector3<S>& p) {
    using Kind = decltype(kind);
    const auto give = [&](int column, int r, const S& x) { scattered(x, out + r * N + link.v + column, stride, at.states); };
    // A turn about axis K by `turn`, and a shift along it by `travel`.
    const auto column = [&](int c, auto axis, const S& turn, const S& travel) {
      constexpr int K = decltype(axis)::value, i = (K + 1) % 3, j = (K + 2) % 3;
      each_of<3>([&](int r) {
        give(c, r, turn * R(K, r));
        give(c, 3 + r, turn * (R(j, r) * p[i] - R(i, r) * p[j]) + travel * R(K, r));
      });
    };
    if constexpr (Kind::nv == 1) {
      const S sign(link.sign);
      column(0, std::integral_constant<int, Kind::row>(), Kind::pin ? sign : S(sign * S(link.turn)), Kind::pin ? S(0) : S(sign * S(link.travel)));
    } else {
      each_axis([&](auto axis) {
        column(axis, axis, S(1), S(0));
        if constexpr (Kind::nv == 6) column(3 + axis, axis, S(0), S(1));
      });
    }
  });
  return ~0u;
}

// X_WN, (4, 4), row-major.
template <class S>
unsigned node_pose(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t stride, typename S::Scalar*) {
  Matrix3<S> R;
  Vector3<S> p;
  toward_base(links, at, R, p, [](auto, const LinkOf<S>&, const Matrix3<S>&, const Vector3<S>&) {});
  const auto give = [&](int i, const S& x) { scattered(x, out + i, stride, at.states); };
  each_of<3>([&](int r) {
    each_of<3>([&](int c) { give(4 * r + c, R(r, c)); });
    give(4 * r + 3, p[r]), give(12 + r, S(0));
  });
  give(15, S(1));
  return ~0u;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
