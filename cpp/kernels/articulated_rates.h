// The first sweeps of derivatives of forward dynamics (kernels/forward_dynamics_derivatives.h, whose equations they are): forward dynamics itself,
// the articulated rates K of momenta, and what the columns of each coordinate start from at its own link.
#pragma once

#include "kernels/column_blocks.h"
#include "kernels/forward_dynamics.h"
#include "kernels/instants.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// Forces (n; f) or accelerations (α; a) of the columns of ∂q, ∂v and of the inverse.
template <class S>
struct ResponseColumns {
  static constexpr int rows = 18;
  Rows3<S> qn, qf, vn, vf, mn, mf;
  ResponseColumns(S* base, size_t stride)
      : qn(base, stride), qf(base + 3 * stride, stride), vn(base + 6 * stride, stride), vf(base + 9 * stride, stride), mn(base + 12 * stride, stride), mf(base + 15 * stride, stride) {}
};
// What coordinates add at their own links: b and y of ∂q and of ∂v.
template <class S>
struct OwnColumns {
  static constexpr int rows = 18;
  Rows3<S> qb, vb, qa, ql, va, vl;
  OwnColumns(S* base, size_t stride)
      : qb(base, stride), vb(base + 3 * stride, stride), qa(base + 6 * stride, stride), ql(base + 9 * stride, stride), va(base + 12 * stride, stride), vl(base + 15 * stride, stride) {}
};
template <class S>
struct ResponseRows {
  S *q, *v, *m;
  int stride, room;  // room: how far a row may be written to
  ResponseRows of(int i) const { return {q + size_t(i) * stride, v + size_t(i) * stride, m + size_t(i) * stride, stride, room}; }
};

// A link as columns pass it: its coordinates, and what of K and P passes inward.
template <class S>
struct ArticulatedRate {
  Matrix3<S> n, f;      // K
  Matrix3<S> kappa[2];  // rows of κ, of up to six coordinates; of one, the first
  Spatial<S> gain;      // G of one coordinate
};

template <class S>
struct ForwardDerivativeWork {
  S *z, *own, *alpha, *rows, *nu;  // nu: ν of coordinates at their own links, six of each kind a coordinate
  ForwardWork<S> forward;
  Inertia<S>* outboard;  // P⁺
  Instant<S>* instant;
  Carrying<S>* carried;
  ArticulatedRate<S>* rate;
  Direction<S>* direction;
  double* accelerations;
  template <class T>
  static size_t columns(const Links<T>& links) {
    const size_t row = row_of(links.nv);
    return row * (ResponseColumns<S>::rows * (1 + links.slots) + OwnColumns<S>::rows + (in_place<S>(links.nv) ? 0 : size_t(3) * links.nv)) + row_of(18 * links.nv);
  }
  template <class T>
  static size_t size(const Links<T>& links) {
    return columns(links) * sizeof(S) + ForwardWork<S>::size(links) + links.nv * (sizeof(Direction<S>) + S::width * sizeof(double)) +
           links.count * (sizeof(Inertia<S>) + sizeof(Instant<S>) + sizeof(Carrying<S>) + sizeof(ArticulatedRate<S>));
  }
  template <class T>
  ForwardDerivativeWork(const Links<T>& links, T* work) : z(reinterpret_cast<S*>(work)), forward(links, reinterpret_cast<T*>(z + columns(links))) {
    const size_t row = row_of(links.nv);
    own = z + row * ResponseColumns<S>::rows, alpha = own + row * OwnColumns<S>::rows, nu = alpha + row * ResponseColumns<S>::rows * links.slots;
    rows = nu + row_of(18 * links.nv);
    outboard = reinterpret_cast<Inertia<S>*>(reinterpret_cast<char*>(z + columns(links)) + ForwardWork<S>::size(links));
    instant = reinterpret_cast<Instant<S>*>(outboard + links.count);
    carried = reinterpret_cast<Carrying<S>*>(instant + links.count);
    rate = reinterpret_cast<ArticulatedRate<S>*>(carried + links.count);
    direction = reinterpret_cast<Direction<S>*>(rate + links.count);
    accelerations = reinterpret_cast<double*>(direction + links.nv);
  }
};

template <class S>
[[gnu::always_inline]] inline Vector3<S> column(const Matrix3<S>& A, int j) {
  return {A(0, j), A(1, j), A(2, j)};
}
template <class S>
[[gnu::always_inline]] inline void add_column(Matrix3<S>& A, int j, const Vector3<S>& x) {
  for (int r = 0; r < 3; ++r) A(r, j) += x[r];
}

// G of a hinge of one coordinate in the base's axes, with its sign.
template <class S>
[[gnu::always_inline]] inline Spatial<S> one_gain(const LinkOf<S>& link, const ForwardLink<S>& w, const Matrix3<S>& axes) {
  const S by = S(link.sign) * w.inverse;
  return {axes * (by * w.angular), axes * (by * w.linear)};
}

// The columns of B.
template <class S>
[[gnu::always_inline]] inline void start_rate(const Momenta<S>& c, ArticulatedRate<S>& K) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    K.n(i, i) = c.rate(i, i), K.n(i, j) = c.rate(i, j) + c.n[k], K.n(j, i) = c.rate(i, j) - c.n[k];
    K.f(i, i) = S(0), K.f(i, j) = S(2) * c.f[k], K.f(j, i) = S(-2) * c.f[k];
  }
}

// Forward dynamics, and how links stand and move at it.
template <class S, class T>
inline typename S::Bits accelerate_all(const Links<T>& links, const States<T>& at, const ForwardDerivativeWork<S>& w) {
  for (int k = 0; k < links.count; ++k) {
    const Link<T>& link = links.link[k];
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      Motion<S>& m = w.forward.link[k].motion;
      place_link<Kind>(link, at, m.place);
      move_link<Kind>(link, at, link.parent < 0 ? nullptr : &w.forward.link[link.parent].motion.omega, m);
      lie_in<Kind>(link, link.parent < 0 ? nullptr : &w.instant[link.parent].lying, m.place, w.instant[k].lying);
    });
  }
  const typename S::Bits sound = articulated_tip_to_base<true>(links, at, w.forward, [&](int k, const Inertia<S>& P) { w.outboard[k] = P; });
  const Vector3<S> base = -spread<S>(at.gravity);
  for (int k = 0; k < links.count; ++k) {
    const Link<T>& link = links.link[k];
    ForwardLink<S>& own = w.forward.link[k];
    const ForwardLink<S>* const above = link.parent < 0 ? nullptr : &w.forward.link[link.parent];
    own.alpha = above ? above->alpha : Vector3<S>::zero(), own.acceleration = above ? above->acceleration : base;
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      accelerate<Kind>(link, at, own, w.forward.of(link), own.alpha, own.acceleration, w.accelerations, links.nv);
      stand<Kind>(link, at, above ? &w.instant[link.parent] : nullptr, own.motion.omega, own.alpha, own.acceleration, w.instant[k]);
    });
    const Carrying<S> c = carrying<S>(link, w.instant[k]);
    w.carried[k] = c;
    start_rate(c, w.rate[k]);
  }
  return sound;
}

// κ, and K⁺ in the place of K, about the link's origin.
template <class Kind, class S>
[[gnu::always_inline]] inline void project_rate(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Matrix3<S>& axes, const Direction<S>& own, ArticulatedRate<S>& K) {
  Spatial<S> gain;
  if constexpr (Kind::nv == 1) K.gain = gain = one_gain(link, w, axes);
  for (int j = 0; j < 3; ++j) {
    const Vector3<S> n = column(K.n, j), f = column(K.f, j);
    if constexpr (Kind::nv == 1) {
      S e = dot(own.s, n);
      if constexpr (!Kind::pin) e += dot(own.x, f);
      K.kappa[0](0, j) = e * w.inverse;
      add_column(K.n, j, S(-e) * gain.angular), add_column(K.f, j, S(-e) * gain.linear);
    } else {
      const Vector3<S> turn = transpose_times(axes, n), along = transpose_times(axes, f);
      S e[6] = {turn[0], turn[1], turn[2], along[0], along[1], along[2]};
      const Vector3<S> left = Kind::nv == 3 ? axes * (along - transpose_times(multiple.gain, turn)) : Vector3<S>::zero();
      if constexpr (Kind::nv == 3)
        multiple.ball.solve(e);
      else
        multiple.free.solve(e);
      for (int i = 0; i < Kind::nv; ++i) K.kappa[i / 3](i % 3, j) = e[i];
      for (int r = 0; r < 3; ++r) K.n(r, j) = S(0), K.f(r, j) = left[r];
    }
  }
}

// The columns of a link's own coordinates: ν, and their z about the parent's origin. K: K⁺ about that point; P: P⁺, null at a root.
template <class Kind, class S>
[[gnu::always_inline]] inline void start(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Instant<S>& instant, const Carrying<S>& carried,
                                         const Direction<S>* own, const ArticulatedRate<S>& K, const Inertia<S>* P, const ResponseColumns<S>& z, S* nu) {
  const Vector3<S>& l = instant.lying.arm;
  const Matrix3<S>& axes = instant.lying.axes;
  for (int i = 0; i < Kind::nv; ++i, nu += 18) {
    const Direction<S>& k = own[i];
    const int c = link.v + i;
    S e[6] = {S(0), S(0), S(0), S(0), S(0), S(0)};
    e[i] = S(1);
    Spatial<S> m;  // of a unit force along the coordinate
    if constexpr (Kind::nv == 1) {
      m = K.gain, e[0] = w.inverse;
    } else {
      m = {axes * Vector3<S>{e[0], e[1], e[2]}, axes * Vector3<S>{e[3], e[4], e[5]}};
      if constexpr (Kind::nv == 3) m.linear = axes * Vector3<S>{multiple.gain(i, 0), multiple.gain(i, 1), multiple.gain(i, 2)};
      if constexpr (Kind::nv == 3)
        multiple.ball.solve(e);
      else
        multiple.free.solve(e);
    }
    for (int j = 0; j < Kind::nv; ++j) {
      const Matrix3<S>& kappa = K.kappa[j / 3];
      const Vector3<S> row{kappa(j % 3, 0), kappa(j % 3, 1), kappa(j % 3, 2)};
      nu[j] = -dot(row, k.psi), nu[6 + j] = -dot(row, k.s), nu[12 + j] = e[j];
    }
    if (!P) continue;
    const auto pushed = [&](const Vector3<S>& b, const Spatial<S>& y) {
      const Vector3<S> a = y.linear + cross(l, y.angular);
      return Spatial<S>{K.n * b + P->A * y.angular + P->B * a, K.f * b + transpose_times(P->B, y.angular) + P->C * a};
    };
    const Spatial<S> q = pushed(k.psi, k.psi_rate) + inboard(l, turned_force<Kind>(k, carried)), v = pushed(k.s, k.chi), unit = inboard(l, m);
    z.qn.set(c, q.angular), z.qf.set(c, q.linear), z.vn.set(c, v.angular), z.vf.set(c, v.linear), z.mn.set(c, unit.angular), z.mf.set(c, unit.linear);
  }
}

// Tip to base: K, and what columns start from.
template <class S, class T>
inline void start_all(const Links<T>& links, const States<T>& at, const ForwardDerivativeWork<S>& w) {
  const size_t stride = row_of(links.nv);
  const ResponseColumns<S> z(w.z, stride);
  const OwnColumns<S> adds(w.own, stride);
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    const Instant<S>& instant = w.instant[k];
    const Instant<S>* const above = link.parent < 0 ? nullptr : &w.instant[link.parent];
    const Vector3<S> l = instant.lying.arm, d = S(-2) * instant.drift;
    ArticulatedRate<S>& K = w.rate[k];
    Inertia<S>* const P = above ? &w.outboard[k] : nullptr;
    if (above) Full<S>{above->lying.axes}.template turn<-1>(*P);
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      Direction<S>* const own = w.direction + link.v;
      for (int i = 0; i < Kind::nv; ++i) {
        const Direction<S> along = own[i] = direction<Kind>(link, at, above, instant, i);
        const int c = link.v + i;
        adds.qb.set(c, along.psi), adds.vb.set(c, along.s), adds.qa.set(c, along.psi_rate.angular), adds.ql.set(c, along.psi_rate.linear);
        adds.va.set(c, along.chi.angular), adds.vl.set(c, along.chi.linear);
      }
      project_rate<Kind>(link, w.forward.link[k], *w.forward.of(link), instant.lying.axes, own[0], K);
      for (int j = 0; above && j < 3; ++j) add_column(K.n, j, cross(l, column(K.f, j)));
      start<Kind>(link, w.forward.link[k], *w.forward.of(link), instant, w.carried[k], own, K, P, z, w.nu + size_t(18) * link.v);
    });
    if (!above) continue;
    ArticulatedRate<S>& parent = w.rate[link.parent];
    for (int i = 0; i < 9; ++i) parent.n.m[i] += K.n.m[i], parent.f.m[i] += K.f.m[i];
    add_times_skew(P->B, d, parent.n), add_times_skew(P->C, d, parent.f);
    Carrying<S>&carries = w.carried[link.parent], &own = w.carried[k];
    carries.torque = carries.torque + own.torque + cross(l, own.force), carries.force = carries.force + own.force;
  }
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
