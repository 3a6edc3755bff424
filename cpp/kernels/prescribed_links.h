// Links whose motion is prescribed, in forward dynamics (recursions/prescribed_hinges.h): not eliminated, as a weld that moves,
//
//   a' += H* θ̈;    tip to base:  P⁺ = P,  z⁺ = z + P a';    base to tip:  α = E* α(p) + a',  T = H (P α + z) + J θ̈
//
// with θ̈ where the forces of other links stand, and T where their accelerations go. Each in one call, away from the loops that other links run in.
#pragma once

#include "kernels/articulated_links.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// H* θ̈ to the terms of motion of a link: after it the linear part of a' is in the parent's axes for every kind of step.
template <class S, class T>
[[gnu::noinline]] void prescribe(const Link<T>& link, const States<T>& at, ForwardLink<S>& w) {
  with_step(link.step, [&](auto kind) {
    using Kind = decltype(kind);
    Motion<S>& m = w.motion;
    const auto rotation = Kind::rotation(m.place);
    const auto given = [&](int i) { return gathered<S>(at.u + link.v + i, at.u_stride, at.states); };
    if constexpr (Kind::nv == 1) {
      const S x = S(link.sign) * given(0);
      m.turning[Kind::row] += Kind::pin ? x : S(S(link.turn) * x);
      if constexpr (!Kind::pin) {
        Vector3<S> slide = Vector3<S>::zero();
        slide[Kind::row] = S(link.travel) * x;
        m.sliding = m.sliding + rotation.to_parent(slide);
      }
      w.inverse = S(link.J) * x;
    } else {
      each_of<3>([&](int i) { m.turning[i] += given(i); });
      if constexpr (Kind::nv == 6) m.sliding = rotation.to_parent(m.sliding + Vector3<S>{given(3), given(4), given(5)});
    }
  });
}

// What T will be read from is kept: of one coordinate the row P_h with z_h, of several P itself with z. Then P and z are the parent's.
template <class S, class T>
[[gnu::noinline]] void pass_inward(const Link<T>& link, ForwardLink<S>& w, ForwardMultiple<S>* multiple, Inertia<S>& P) {
  w.keep_diagonals(P);
  with_step(link.step, [&](auto kind) {
    using Kind = decltype(kind);
    const Motion<S>& m = w.motion;
    if constexpr (Kind::nv == 1) {
      constexpr int K = Kind::row;
      const S turn = Kind::pin ? S(1) : S(link.turn), travel = Kind::pin ? S(0) : S(link.travel);
      for (int r = 0; r < 3; ++r) w.angular[r] = turn * P.A(r, K) + travel * P.B(r, K), w.linear[r] = turn * P.B(K, r) + travel * P.C(r, K);
      w.innovation = turn * P.n[K] + travel * P.f[K];
    } else {
      for (int i = 0; i < 3; ++i) {
        multiple->rate[i] = P.n[i], multiple->rate[3 + i] = P.f[i];
        for (int j = 0; j < 3; ++j) {
          multiple->free.lower[i][j] = P.A(i, j), multiple->free.lower[3 + i][3 + j] = P.C(i, j);
          multiple->free.lower[i][3 + j] = P.B(i, j), multiple->free.lower[3 + i][j] = P.B(j, i);
        }
      }
    }
    if (link.parent < 0) return;
    const auto rotation = Kind::rotation(m.place);
    P.n = P.n + P.A * m.turning, P.f = P.f + transpose_times(P.B, m.turning);
    rotation.template turn<-1>(P);
    P.n = rotation.to_parent(P.n) + P.B * m.sliding, P.f = rotation.to_parent(P.f) + P.C * m.sliding;
    const Vector3<S> arm = Kind::arm(link, m.place);
    P.n = P.n + cross(arm, P.f);
    shift<-1>(arm, P);
  });
}

// alpha, acceleration: the parent's, then the link's; T to out.
template <class S, class T>
[[gnu::noinline]] void pass_outward(const Link<T>& link, const States<T>& at, const ForwardLink<S>& w, const ForwardMultiple<S>* multiple, Vector3<S>& alpha, Vector3<S>& acceleration, double* out,
                                    size_t stride) {
  with_step(link.step, [&](auto kind) {
    using Kind = decltype(kind);
    const auto rotation = Kind::rotation(w.motion.place);
    const auto give = [&](int i, const S& x) { scattered(x, out + link.v + i, stride, at.states); };
    acceleration = rotation.to_child(acceleration + cross(alpha, Kind::arm(link, w.motion.place)) + w.motion.sliding);
    alpha = rotation.to_child(alpha) + w.motion.turning;
    if constexpr (Kind::nv == 1) {
      give(0, S(S(link.sign) * (w.innovation + dot(w.angular, alpha) + dot(w.linear, acceleration) + w.inverse)));
    } else {
      for (int i = 0; i < Kind::nv; ++i) {
        S force = multiple->rate[i];
        for (int j = 0; j < 3; ++j) force += multiple->free.lower[i][j] * alpha[j] + multiple->free.lower[i][3 + j] * acceleration[j];
        give(i, force);
      }
    }
  });
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
