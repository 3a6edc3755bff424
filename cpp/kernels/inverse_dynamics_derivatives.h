// Derivatives of inverse dynamics on links: ∂T/∂q, ∂T/∂v and ∂T/∂v̇ = ℳ + J, from what kernels/instants.h says of every coordinate k. With I, B
// and F of all that a link carries, about its origin, there are four columns a coordinate, moved from link to link inward:
//
//   y = I S,  c = B* S,  p = I ψ̈ + B ψ̇ + crf(S) F,  r = I χ + B S
//   y, p, r: n <- n + l × f;    c <- c + 2d × y_f
//
// and with each coordinate i at or inboard of k, (·)_i of the pair at k's columns,
//
//   ∂_kT_i = S_i·p,  ∂T_i/∂v_k = S_i·r,  ℳ(i,k) = S_i·y,  ∂_iT_k = ψ̈_i·y + ψ̇_i·c,  ∂T_k/∂v_i = χ_i·y + s_i·c.
//
// Within one hinge crf(S) F is left out of p. Cost O(N · depth).
#pragma once

#include "kernels/column_blocks.h"
#include "kernels/instants.h"
#include "kernels/inverse_dynamics.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
struct DerivativeColumns {  // of all coordinates
  static constexpr int rows = 21;
  Rows3<S> yn, yf, c, pn, pf, rn, rf;
  DerivativeColumns(S* base, size_t stride, int first)
      : yn(base, stride, first), yf(base + 3 * stride, stride, first), c(base + 6 * stride, stride, first), pn(base + 9 * stride, stride, first),
        pf(base + 12 * stride, stride, first), rn(base + 15 * stride, stride, first), rf(base + 18 * stride, stride, first) {}
};
// Rows of results on and above the diagonal; `later`: those of the transposed ones that stand below it.
template <class S>
struct DerivativeRows {
  S *q, *v, *mass, *later_q, *later_v;
};

template <class S>
struct InverseDerivativeWork {
  InverseLink<S>* link;
  Instant<S>* instant;
  Carrying<S>* carried;
  S *columns, *rows;
  static int matrices() { return S::width == 1 && sizeof(typename S::Scalar) == sizeof(double) ? 2 : 5; }  // else results are written in place
  template <class T>
  static size_t size(const Links<T>& links) {
    return links.count * (sizeof(InverseLink<S>) + sizeof(Instant<S>) + sizeof(Carrying<S>)) +
           (DerivativeColumns<S>::rows * row_of<S>(links.nv) + size_t(matrices()) * links.nv * links.nv) * sizeof(S);
  }
  template <class T>
  InverseDerivativeWork(const Links<T>& links, T* work) {
    link = reinterpret_cast<InverseLink<S>*>(work);
    instant = reinterpret_cast<Instant<S>*>(link + links.count);
    carried = reinterpret_cast<Carrying<S>*>(instant + links.count);
    columns = reinterpret_cast<S*>(carried + links.count);
    rows = columns + DerivativeColumns<S>::rows * row_of<S>(links.nv);
  }
};

// The columns of a link's own coordinates, without crf(S) F.
template <int nv, class S>
[[gnu::always_inline]] inline void own_columns(const Direction<S> (&own)[nv], const Carrying<S>& carried, const DerivativeColumns<S>& to) {
  for (int i = 0; i < nv; ++i) {
    const Direction<S>& k = own[i];
    const Spatial<S> y = inertia_times(carried, {k.s, k.x});
    const Spatial<S> p = inertia_times(carried, k.psi_rate) + rate_times(carried, k.psi), r = inertia_times(carried, k.chi) + rate_times(carried, k.s);
    to.yn.set(i, y.angular), to.yf.set(i, y.linear);
    to.c.set(i, carried.rate * k.s + cross(carried.n, k.s) + S(2) * cross(carried.f, k.x));
    to.pn.set(i, p.angular), to.pf.set(i, p.linear), to.rn.set(i, r.angular), to.rf.set(i, r.linear);
  }
}

// The row of a coordinate, at the columns of its own link and of those outboard; afterwards the columns are moved to the parent's origin.
template <class Kind, bool moves, class S>
[[gnu::always_inline]] inline void derivative_row(const Direction<S>& own, const Vector3<S>& arm, const Vector3<S>& drift, int count, const DerivativeColumns<S>& x, const DerivativeRows<S>& to) {
  using V = Vector3<Block<S>>;
  constexpr bool turns = Kind::pin || Kind::nv == 3;
  const V s = in_all(own.s), slide = in_all(own.x), psi = in_all(own.psi), turn = in_all(own.psi_rate.angular), pull = in_all(own.psi_rate.linear);
  const V chi = in_all(own.chi.angular), travel = in_all(own.chi.linear), l = in_all(arm), d = in_all(S(2) * drift);
  each_block<S>(0, count, [&](int c, int there, const Block<S>& its) {
    const V yn = x.yn.at(c), yf = x.yf.at(c), cc = x.c.at(c), pn = x.pn.at(c), rn = x.rn.at(c);
    const V pf = x.pf.at(c), rf = x.rf.at(c);
    Block<S> q = dot(s, pn), v = dot(s, rn), m = dot(s, yn), later_v = dot(chi, yn) + dot(s, cc);
    const Block<S> later_q = dot(turn, yn) + dot(pull, yf) + dot(psi, cc);
    if constexpr (!turns) q += dot(slide, pf), v += dot(slide, rf), m += dot(slide, yf), later_v += dot(travel, yf);
    put_first(q, to.q + c, there), put_first(v, to.v + c, there), put_first(m, to.mass + c, there);
    put_first(later_q, to.later_q + c, there), put_first(later_v, to.later_v + c, there);
    if constexpr (moves) {
      const V by = its * l;
      x.yn.put(c, yn + cross(by, yf)), x.pn.put(c, pn + cross(by, pf)), x.rn.put(c, rn + cross(by, rf));
      x.c.put(c, cc + cross(its * d, yf));
    }
  });
}

template <class Kind, class S, class T>
[[gnu::always_inline]] inline void derivative_rows(const Link<T>& link, const States<T>& at, const Instant<S>* above, const Instant<S>& instant, const Carrying<S>& carried,
                                                   const DerivativeColumns<S>& columns, const DerivativeRows<S>& rows, int N) {
  const int count = link.end - link.v;
  Direction<S> own[Kind::nv];
  for (int i = 0; i < Kind::nv; ++i) own[i] = direction<Kind>(link, at, above, instant, i);
  own_columns<Kind::nv>(own, carried, columns);
  for (int i = 0; i < Kind::nv; ++i) {
    const size_t row = size_t(i) * N;
    const DerivativeRows<S> to{rows.q + row, rows.v + row, rows.mass + row, rows.later_q + row, rows.later_v + row};
    if (i + 1 == Kind::nv && above)
      derivative_row<Kind, true>(own[i], instant.lying.arm, instant.drift, count, columns, to);
    else
      derivative_row<Kind, false>(own[i], instant.lying.arm, instant.drift, count, columns, to);
    for (int c = count; c < N - link.v; ++c) to.q[c] = to.v[c] = to.mass[c] = to.later_q[c] = to.later_v[c] = S(0);
    if constexpr (Kind::nv == 1) to.mass[0] += S(link.J);
  }
  if (!above) return;
  for (int i = 0; i < Kind::nv; ++i) {
    const Spatial<S> moved = inboard(instant.lying.arm, turned_force(own[i], carried));
    columns.pn.set(i, columns.pn.get(i) + moved.angular), columns.pf.set(i, columns.pf.get(i) + moved.linear);
  }
}

// Positions, velocities and accelerations, base to tip.
template <class S, class T>
inline void stand_all(const Links<T>& links, const States<T>& at, const InverseDerivativeWork<S>& w) {
  const Vector3<S> base = -spread<S>(at.gravity);
  for (int k = 0; k < links.count; ++k) {
    const Link<T>& link = links.link[k];
    InverseLink<S>& own = w.link[k];
    const InverseLink<S>* const above = link.parent < 0 ? nullptr : &w.link[link.parent];
    const Instant<S>* const parent = above ? &w.instant[link.parent] : nullptr;
    own.alpha = above ? above->alpha : Vector3<S>::zero(), own.acceleration = above ? above->acceleration : base;
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      place_link<Kind>(link, at, own.motion.place);
      move_link<Kind>(link, at, above ? &above->motion.omega : nullptr, own.motion);
      push<Kind, S, T>(link, at, nullptr, own);
      lie_in<Kind>(link, parent ? &parent->lying : nullptr, own.motion.place, w.instant[k].lying);
      stand<Kind>(link, at, parent, own.motion.omega, own.alpha, own.acceleration, w.instant[k]);
    });
    w.carried[k] = carrying<S>(link, w.instant[k]);
  }
}

// ∂T/∂q to `out`, ∂T/∂v and ℳ + J to the others.
template <class S>
unsigned inverse_dynamics_derivatives(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t out_stride, typename S::Scalar* work) {
  using T = typename S::Scalar;
  const InverseDerivativeWork<S> w(links, work);
  const int N = links.nv;
  const size_t square = size_t(N) * N, row = row_of<S>(N);
  DerivativeRows<S> rows{w.rows + 2 * square, w.rows + 3 * square, w.rows + 4 * square, w.rows, w.rows + square};
  constexpr bool in_place = S::width == 1 && sizeof(T) == sizeof(double);
  if constexpr (in_place) rows.q = reinterpret_cast<S*>(out), rows.v = reinterpret_cast<S*>(at.others[0]), rows.mass = reinterpret_cast<S*>(at.others[1]);
  for (int r = 0; r < DerivativeColumns<S>::rows; ++r)
    for (size_t c = N; c < row; ++c) w.columns[r * row + c] = S(0);
  stand_all(links, at, w);
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k, N);
    const Link<T>& link = links.link[k];
    const size_t first = size_t(link.v) * N + link.v;
    const DerivativeRows<S> to{rows.q + first, rows.v + first, rows.mass + first, rows.later_q + first, rows.later_v + first};
    const Instant<S>* const above = link.parent < 0 ? nullptr : &w.instant[link.parent];
    with_step(link.step, [&](auto kind) { derivative_rows<decltype(kind)>(link, at, above, w.instant[k], w.carried[k], DerivativeColumns<S>(w.columns, row, link.v), to, N); });
    if (above) to_parent(w.instant[k].lying.arm, w.instant[k].drift, w.carried[k]), add(w.carried[link.parent], w.carried[k]);
  }
  unsigned sound = ~0u;
  for (int b = 0; b < S::width && b < at.states; ++b) {
    double* const to[] = {out + b * out_stride, at.others[0] + b * out_stride, at.others[1] + b * out_stride};
    bool finite = true;
    if constexpr (in_place) {
      finite &= put_below(reinterpret_cast<const double*>(rows.later_q), to[0], N, at.interrupt);
      finite &= put_below(reinterpret_cast<const double*>(rows.later_v), to[1], N, at.interrupt);
      finite &= mirror(to[2], N, at.interrupt);
    } else {
      double odd = 0;
      for (int i = 0; i < N; ++i)
        for (int j = i; j < N; ++j) {
          const size_t upper = size_t(i) * N + j, lower = size_t(j) * N + i;
          const double dq = double(rows.q[upper].lane(b)), dv = double(rows.v[upper].lane(b)), mass = double(rows.mass[upper].lane(b));
          const double below_q = double(rows.later_q[upper].lane(b)), below_v = double(rows.later_v[upper].lane(b));
          to[0][upper] = dq, to[1][upper] = dv, to[2][upper] = to[2][lower] = mass;
          if (i != j) to[0][lower] = below_q, to[1][lower] = below_v;
          odd += (dq - dq) + (dv - dv) + (mass - mass) + (below_q - below_q) + (below_v - below_v);
        }
      finite = odd == 0;
    }
    if (!finite) sound &= ~(1u << b);
  }
  return sound;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
