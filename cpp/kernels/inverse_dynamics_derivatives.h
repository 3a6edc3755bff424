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
  DerivativeColumns(S* base, size_t stride)
      : yn(base, stride), yf(base + 3 * stride, stride), c(base + 6 * stride, stride), pn(base + 9 * stride, stride), pf(base + 12 * stride, stride),
        rn(base + 15 * stride, stride), rf(base + 18 * stride, stride) {}
};
// Rows of results on and above the diagonal; `later`: those of the transposed ones that stand below it.
template <class S>
struct DerivativeRows {
  S *q, *v, *mass, *later_q, *later_v;
  int stride, later_stride, later_mask;  // later: row i at (i & mask) stride
  DerivativeRows of(int i) const {
    const size_t at = size_t(i) * stride, later = size_t(i & later_mask) * later_stride;
    return {q + at, v + at, mass + at, later_q + later, later_v + later, stride, later_stride, later_mask};
  }
};

template <class S>
struct InverseDerivativeWork {
  static constexpr int ring = 16;  // rows that wait to be turned, where results are in place
  InverseLink<S>* link;
  Instant<S>* instant;
  Carrying<S>* carried;
  Direction<S>* direction;  // of every coordinate
  S *columns, *within, *rows;    // within: ∂T/∂q of a hinge by itself, six numbers a coordinate
  template <class T>
  static size_t size(const Links<T>& links) {
    const size_t row = row_of(links.nv), results = in_place<S>(links.nv) ? size_t(2) * ring : size_t(5) * links.nv;
    return links.count * (sizeof(InverseLink<S>) + sizeof(Instant<S>) + sizeof(Carrying<S>)) + links.nv * sizeof(Direction<S>) +
           ((DerivativeColumns<S>::rows + results) * row + size_t(6) * links.nv) * sizeof(S);
  }
  template <class T>
  InverseDerivativeWork(const Links<T>& links, T* work) {
    const size_t row = row_of(links.nv);
    columns = reinterpret_cast<S*>(work);
    rows = columns + DerivativeColumns<S>::rows * row;
    within = rows + (in_place<S>(links.nv) ? size_t(2) * ring : size_t(5) * links.nv) * row;
    direction = reinterpret_cast<Direction<S>*>(within + size_t(6) * links.nv);
    link = reinterpret_cast<InverseLink<S>*>(direction + links.nv);
    instant = reinterpret_cast<Instant<S>*>(link + links.count);
    carried = reinterpret_cast<Carrying<S>*>(instant + links.count);
  }
};

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
      carry<Kind, true>(link, own.motion, own.alpha, own.acceleration);
      if (at.u) add_rates<Kind>(link, [&](int i) { return gathered<S>(at.u + link.v + i, at.u_stride, at.states); }, own.alpha, own.acceleration);
      lie_in<Kind>(link, parent ? &parent->lying : nullptr, own.motion.place, w.instant[k].lying);
      stand<Kind>(link, at, parent, own.motion.omega, own.alpha, own.acceleration, w.instant[k]);
    });
    w.carried[k] = carrying<S>(link, w.instant[k]);
  }
}

// Tip to base: what each link carries, and the columns of its own coordinates about its origin.
template <class S, class T>
inline void own_columns(const Links<T>& links, const States<T>& at, const InverseDerivativeWork<S>& w) {
  const DerivativeColumns<S> to(w.columns, row_of(links.nv));
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    const Instant<S>* const above = link.parent < 0 ? nullptr : &w.instant[link.parent];
    Carrying<S>& carried = w.carried[k];
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      Direction<S>* const own = w.direction + link.v;
      for (int i = 0; i < Kind::nv; ++i) own[i] = direction<Kind>(link, at, above, w.instant[k], i);
      for (int i = 0; i < Kind::nv; ++i) {
        const Direction<S>& along = own[i];
        const int c = link.v + i;
        const Spatial<S> y = inertia_times<Kind>(carried, along.s, along.x), p = inertia_times(carried, along.psi_rate) + rate_times(carried, along.psi);
        const Spatial<S> r = inertia_times<Kind>(carried, along.chi.angular, along.chi.linear) + rate_times(carried, along.s), whole = p + turned_force<Kind>(along, carried);
        to.yn.set(c, y.angular), to.yf.set(c, y.linear);
        Vector3<S> momentum = carried.rate * along.s + cross(carried.n, along.s);
        if constexpr (!only_turns<Kind>) momentum = momentum + S(2) * cross(carried.f, along.x);
        to.c.set(c, momentum);
        to.pn.set(c, whole.angular), to.pf.set(c, whole.linear), to.rn.set(c, r.angular), to.rf.set(c, r.linear);
        for (int j = 0; j < Kind::nv; ++j) w.within[size_t(6) * c + j] = dot(own[j].s, p.angular) + dot(own[j].x, p.linear);
      }
    });
    if (above) to_parent(w.instant[k].lying.arm, w.instant[k].drift, carried), add(w.carried[link.parent], carried);
  }
}

// The row of a coordinate, at the columns of its own link and of those outboard; afterwards the columns are moved to the parent's origin.
template <class Kind, bool moves, class S>
[[gnu::always_inline]] inline void derivative_row(const Direction<S>& own, const Vector3<S>& arm, const Vector3<S>& drift, int first, int last, int N, const DerivativeColumns<S>& x,
                                                  const DerivativeRows<S>& to, Block<S>& odd) {
  using V = Vector3<Block<S>>;
  const V s = in_all(own.s), slide = in_all(own.x), psi = in_all(own.psi), turn = in_all(own.psi_rate.angular), pull = in_all(own.psi_rate.linear);
  const V chi = in_all(own.chi.angular), travel = in_all(own.chi.linear), l = in_all(arm), d = in_all(S(2) * drift);
  const int room = in_place<S>(N) ? N : to.stride;
  each_block<S>(first, last, [&](int c, const Block<S>& its) __attribute__((always_inline)) {
    const V yn = x.yn.at(c), yf = x.yf.at(c), cc = x.c.at(c), pn = x.pn.at(c), pf = x.pf.at(c), rn = x.rn.at(c), rf = x.rf.at(c);
    Block<S> q = dot(s, pn), v = dot(s, rn), m = dot(s, yn), later_v = dot(chi, yn) + dot(s, cc);
    const Block<S> later_q = dot(turn, yn) + dot(pull, yf) + dot(psi, cc);
    if constexpr (!only_turns<Kind>) q += dot(slide, pf), v += dot(slide, rf), m += dot(slide, yf), later_v += dot(travel, yf);
    const Block<S> sum = (q + v) + (m + later_q) + later_v;
    odd += sum - sum;
    put_first(q, to.q + c, room - c), put_first(v, to.v + c, room - c), put_first(m, to.mass + c, room - c);
    put_block<S>(later_q, to.later_q + c), put_block<S>(later_v, to.later_v + c);
    if constexpr (moves) {
      const V by = its * l;
      x.yn.put(c, yn + cross(by, yf)), x.pn.put(c, pn + cross(by, pf)), x.rn.put(c, rn + cross(by, rf));
      x.c.put(c, cc + cross(its * d, yf));
    }
  });
}

// All rows of a link.
template <class Kind, class S>
[[gnu::always_inline]] inline void derivative_rows(const LinkOf<S>& link, const Instant<S>& instant, const InverseDerivativeWork<S>& w, const DerivativeRows<S>& rows, int N, Block<S>& odd) {
  const DerivativeColumns<S> columns(w.columns, row_of(N));
  for (int i = 0; i < Kind::nv; ++i) {
    const DerivativeRows<S> to = rows.of(link.v + i);
    const Direction<S>& own = w.direction[link.v + i];
    if (i + 1 == Kind::nv && link.parent >= 0)
      derivative_row<Kind, true>(own, instant.lying.arm, instant.drift, link.v, link.end, N, columns, to, odd);
    else
      derivative_row<Kind, false>(own, instant.lying.arm, instant.drift, link.v, link.end, N, columns, to, odd);
    for (int c = link.end; c < N; ++c) to.q[c] = to.v[c] = to.mass[c] = to.later_q[c] = to.later_v[c] = S(0);
    for (int c = 0; c < Kind::nv; ++c) to.q[link.v + c] = w.within[size_t(6) * (link.v + c) + i];
    if constexpr (Kind::nv == 1) to.mass[link.v] += S(link.J);
  }
}

// Results of rows that stand beside each other, a state at a time.
template <class S, class T>
inline void give_results(const DerivativeRows<S>& rows, const States<T>& at, double* out, size_t out_stride, int N) {
  for (int b = 0; b < S::width && b < at.states; ++b) {
    double *const q = out + b * out_stride, *const v = at.others[0] + b * out_stride, *const mass = at.others[1] + b * out_stride;
    for (int i = 0; i < N; ++i) {
      const DerivativeRows<S> from = rows.of(i);
      for (int j = i; j < N; ++j) {
        const size_t upper = size_t(i) * N + j, lower = size_t(j) * N + i;
        q[lower] = double(from.later_q[j].lane(b)), v[lower] = double(from.later_v[j].lane(b)), mass[lower] = double(from.mass[j].lane(b));
        q[upper] = double(from.q[j].lane(b)), v[upper] = double(from.v[j].lane(b)), mass[upper] = double(from.mass[j].lane(b));
      }
    }
  }
}

// ∂T/∂q to `out`, ∂T/∂v and ℳ + J to the others.
template <class S>
unsigned inverse_dynamics_derivatives(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t out_stride, typename S::Scalar* work) {
  using T = typename S::Scalar;
  using Work = InverseDerivativeWork<S>;
  const Work w(links, work);
  const int N = links.nv, row = static_cast<int>(row_of(N));
  const bool direct = in_place<S>(N);
  const size_t size = size_t(row) * N, waiting = size_t(row) * Work::ring;
  DerivativeRows<S> rows{w.rows, w.rows + size, w.rows + 2 * size, w.rows + 3 * size, w.rows + 4 * size, row, row, -1};
  if constexpr (S::width == 1 && sizeof(T) == sizeof(double))
    if (direct) rows = {reinterpret_cast<S*>(out), reinterpret_cast<S*>(at.others[0]), reinterpret_cast<S*>(at.others[1]), w.rows, w.rows + waiting, N, row, Work::ring - 1};
  for (size_t i = 0; i < size_t(DerivativeColumns<S>::rows) * row; ++i) w.columns[i] = S(0);  // what blocks hold besides a link's columns is finite
  stand_all(links, at, w);
  own_columns(links, at, w);
  Block<S> odd(T(0));
  for (int k = links.count - 1, turned_from = row; k >= 0; --k) {
    stay_open(at, k, N);
    const Link<T>& link = links.link[k];
    with_shape(link.step, [&](auto kind) { derivative_rows<decltype(kind)>(link, w.instant[k], w, rows, N, odd); });
    for (; direct && turned_from > link.v; turned_from -= 8) {  // rows turned_from - 8 and on are there
      const int left = turned_from - 8;
      if (left < link.v) break;
      put_below(reinterpret_cast<const double*>(rows.later_q), row, rows.later_mask, out, left, N);
      put_below(reinterpret_cast<const double*>(rows.later_v), row, rows.later_mask, at.others[0], left, N);
      put_below(at.others[1], N, -1, at.others[1], left, N);
    }
  }
  if (!direct) give_results(rows, at, out, out_stride, N);
  return finite_states<S>(odd);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
