// Coriolis matrices on links, Hφ(MJ̇ + ½(𝓑 + V̄M + MṼ)J) and Hφ(MJ̇ + 𝓑J), from what kernels/instants.h says of every link. With I and B of all that a
// link carries, about its origin, and S, Ṡ = ω × S of its coordinates, there are three columns a coordinate k, moved from link to link inward:
//
//   y = I S,  r = I Ṡ + ½B S,  c = ½B* S
//   y, r: n <- n + l × f;    c <- c + d × y_f
//
// and with each coordinate i at or inboard of k, (·)_i of the pair at k's columns,
//
//   C(i,k) = S_i·r,   C(k,i) = Ṡ_i·y + S_i·c
//
// That is Christoffel's. Hφ(MJ̇ + 𝓑J) is that of r + K S and c - K S, which is moved as a force; K, of velocities in the world, as spatial/skew_part.h has it.
// Source: Echeandia and Wensing, Numerical methods to compute the Coriolis matrix and Christoffel symbols for rigid-body systems (2021).
// Cost O(N · depth).
#pragma once

#include "kernels/column_blocks.h"
#include "kernels/instants.h"
#include "spatial/skew_part.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// An odd number of lines of memory: rows of columns stand in different parts of it.
constexpr size_t columns_apart(int n) { return row_of(n) | 8; }

template <class S>
struct MovingRow {  // S and Ṡ of a coordinate
  HingeRow<S> own, rate;
};
template <class S>
struct CoriolisColumns {  // of all coordinates; c_f is there only besides Christoffel's
  static constexpr int rows = 18;
  Rows3<S> yn, yf, rn, rf, cn, cf;
  CoriolisColumns(S* base, size_t stride)
      : yn(base, stride), yf(base + 3 * stride, stride), rn(base + 6 * stride, stride), rf(base + 9 * stride, stride), cn(base + 12 * stride, stride), cf(base + 15 * stride, stride) {}
};
// Rows of the result on and above the diagonal; `later`: what stands below it, transposed.
template <class S>
struct CoriolisRows {
  S *upper, *later;
  int stride, later_stride, later_mask;  // later: row i at (i & mask) stride
  CoriolisRows of(int i) const { return {upper + size_t(i) * stride, later + size_t(i & later_mask) * later_stride, stride, later_stride, later_mask}; }
};

template <class S>
struct CoriolisWork {
  static constexpr int ring = 16;  // rows that wait to be turned, where results are in place
  Moving<S>* moving;
  Momenta<S>* carried;
  SkewPart<S>* skew;
  Vector3<S>* speed;      // of a link's origin in the world
  MovingRow<S>* axis;     // of every coordinate
  S *columns, *rows;
  template <class T>
  static size_t size(const Links<T>& links) {
    const size_t row = columns_apart(links.nv), results = in_place<S>(links.nv) ? size_t(ring) : size_t(2) * links.nv;
    return links.count * (sizeof(Moving<S>) + sizeof(Momenta<S>) + sizeof(SkewPart<S>) + sizeof(Vector3<S>)) + links.nv * sizeof(MovingRow<S>) +
           (CoriolisColumns<S>::rows + results) * row * sizeof(S);
  }
  template <class T>
  CoriolisWork(const Links<T>& links, T* work) {
    const size_t row = columns_apart(links.nv);
    columns = reinterpret_cast<S*>(work);
    rows = columns + CoriolisColumns<S>::rows * row;
    axis = reinterpret_cast<MovingRow<S>*>(rows + (in_place<S>(links.nv) ? size_t(ring) : size_t(2) * links.nv) * row);
    moving = reinterpret_cast<Moving<S>*>(axis + links.nv);
    carried = reinterpret_cast<Momenta<S>*>(moving + links.count);
    skew = reinterpret_cast<SkewPart<S>*>(carried + links.count);
    speed = reinterpret_cast<Vector3<S>*>(skew + links.count);
  }
};

// Base to tip: how links move, and what each is by itself.
template <bool skew, class S, class T>
inline void move_all(const Links<T>& links, const States<T>& at, const CoriolisWork<S>& w) {
  for (int k = 0; k < links.count; ++k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    Moving<S>& own = w.moving[k];
    const Moving<S>* const above = link.parent < 0 ? nullptr : &w.moving[link.parent];
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      Place<S> place;
      place_link<Kind>(link, at, place);
      lie_in<Kind>(link, above ? &above->lying : nullptr, place, own.lying);
      own.omega = above ? above->omega : Vector3<S>::zero();
      for (int i = 0; i < Kind::nv; ++i) {
        HingeRow<S>& row = w.axis[link.v + i].own = hinge_row<Kind>(link, own.lying.axes, i);
        if (i < 3) own.omega = own.omega + gathered<S>(at.v + link.v + i, at.v_stride, at.states) * row.angular;
      }
      for (MovingRow<S>* row = w.axis + link.v; row != w.axis + link.v + Kind::nv; ++row) row->rate = {cross(own.omega, row->own.angular), cross(own.omega, row->own.linear)};
      drift_from<Kind>(link, at, above, own);
    });
    w.carried[k] = momenta<S>(link, own);
    if constexpr (skew) {
      w.speed[k] = above ? w.speed[link.parent] + own.drift : own.drift;
      w.skew[k] = SkewPart<S>::of(w.carried[k].mass, w.carried[k].moment, w.carried[k].rotational, own.omega);
    }
  }
}

// Tip to base: what each link carries, and the columns of its own coordinates about its origin.
template <bool skew, class S, class T>
inline void own_columns(const Links<T>& links, const States<T>& at, const CoriolisWork<S>& w) {
  const CoriolisColumns<S> to(w.columns, columns_apart(links.nv));
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    Momenta<S>& carried = w.carried[k];
    SkewPart<S> K;
    if constexpr (skew) K = w.skew[k], K.speed_up(carried.mass, carried.moment, w.speed[k]);
    const int nv = link.step == Step::free ? 6 : link.step == Step::ball ? 3 : 1;
    for (int c = link.v; c < link.v + nv; ++c) {
      const auto& [own, rate] = w.axis[c];
      const Spatial<S> y = inertia_times(carried, {own.angular, own.linear}), half = rate_times(carried, own.angular);
      Spatial<S> r = inertia_times(carried, {rate.angular, rate.linear}) + Spatial<S>{S(0.5) * half.angular, S(0.5) * half.linear};
      Spatial<S> later{S(0.5) * (carried.rate * own.angular + cross(carried.n, own.angular)) + cross(carried.f, own.linear), Vector3<S>::zero()};
      if constexpr (skew) {
        const Spatial<S> turned{K.angular(own.angular, own.linear), K.linear(own.angular, own.linear)};
        r = r + turned, later = later + Spatial<S>{-turned.angular, -turned.linear};
        to.cf.set(c, later.linear);
      }
      to.yn.set(c, y.angular), to.yf.set(c, y.linear), to.rn.set(c, r.angular), to.rf.set(c, r.linear), to.cn.set(c, later.angular);
    }
    if (link.parent < 0) continue;
    const Vector3<S>&l = w.moving[k].lying.arm, &d = w.moving[k].drift;
    if constexpr (skew) {
      SkewPart<S>& moved = w.skew[k];
      moved.speed_up(carried.mass, carried.moment, d), moved.move_inboard(l), w.skew[link.parent].add(moved);
    }
    to_parent(l, d, carried), add(w.carried[link.parent], carried);
  }
}

// The row of a coordinate, at the columns of its own link and of those outboard; afterwards the columns are moved to the parent's origin.
template <class Kind, bool skew, bool moves, class S>
[[gnu::always_inline]] inline void coriolis_row(const MovingRow<S>& of, const Moving<S>& moving, int first, int last, int N, const CoriolisColumns<S>& x, const CoriolisRows<S>& to, Block<S>& odd) {
  using V = Vector3<Block<S>>;
  constexpr bool turns = Kind::pin || Kind::nv == 3;
  const V s = in_all(of.own.angular), slide = in_all(of.own.linear), turn = in_all(of.rate.angular), travel = in_all(of.rate.linear);
  const V l = in_all(moving.lying.arm), d = in_all(moving.drift);
  const int room = in_place<S>(N) ? N : to.stride;
  each_block<S>(first, last, [&](int c, const Block<S>& its) __attribute__((always_inline)) {
    const V yn = x.yn.at(c), yf = x.yf.at(c), rn = x.rn.at(c), rf = x.rf.at(c), cn = x.cn.at(c);
    Block<S> upper = dot(s, rn), later = dot(turn, yn) + dot(s, cn);
    if constexpr (!turns) upper += dot(slide, rf), later += dot(travel, yf);
    V cf;
    if constexpr (skew) cf = x.cf.at(c);
    if constexpr (skew && !turns) later += dot(slide, cf);
    const Block<S> sum = upper + later;
    odd += sum - sum;
    put_first(upper, to.upper + c, room - c);
    put_block<S>(later, to.later + c);
    if constexpr (moves) {
      const V by = its * l;
      x.yn.put(c, yn + cross(by, yf)), x.rn.put(c, rn + cross(by, rf));
      V moved = cn + cross(its * d, yf);
      if constexpr (skew) moved = moved + cross(by, cf);
      x.cn.put(c, moved);
    }
  });
}

// The rows of a link at the columns from `first` to `last`, which begins with none of its hinge's but the first.
template <bool skew, class S>
inline void coriolis_rows(const LinkOf<S>& link, int k, int first, int last, int N, const CoriolisWork<S>& w, const CoriolisRows<S>& rows, Block<S>& odd) {
  const CoriolisColumns<S> columns(w.columns, columns_apart(N));
  const int from = link.v < first ? first : link.v, to = link.end < last ? link.end : last;
  with_shape(link.step, [&](auto kind) {
    using Kind = decltype(kind);
    for (int i = link.v; i < link.v + Kind::nv; ++i) {
      const CoriolisRows<S> at = rows.of(i);
      if (from < to && i + 1 == link.v + Kind::nv && link.parent >= 0)
        coriolis_row<Kind, skew, true>(w.axis[i], w.moving[k], from, to, N, columns, at, odd);
      else if (from < to)
        coriolis_row<Kind, skew, false>(w.axis[i], w.moving[k], from, to, N, columns, at, odd);
      for (int c = from < to ? to : from; c < last; ++c) at.upper[c] = at.later[c] = S(0);
    }
  });
}

// C; skew: Hφ(MJ̇ + 𝓑J), else Christoffel's. Columns of one state are taken as many at a time as near memory holds.
template <class S, bool skew>
unsigned coriolis_matrix(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t out_stride, typename S::Scalar* work) {
  using T = typename S::Scalar;
  const CoriolisWork<S> w(links, work);
  const int N = links.nv, row = static_cast<int>(columns_apart(N));
  const bool direct = in_place<S>(N);
  CoriolisRows<S> rows{w.rows, w.rows + size_t(row) * N, row, row, -1};
  if constexpr (S::width == 1 && sizeof(T) == sizeof(double))
    if (direct) rows = {reinterpret_cast<S*>(out), w.rows, N, row, CoriolisWork<S>::ring - 1};
  for (size_t i = 0; i < size_t(CoriolisColumns<S>::rows) * row; ++i) w.columns[i] = S(0);  // what blocks hold besides a link's columns is finite
  move_all<skew>(links, at, w);
  own_columns<skew>(links, at, w);
  Block<S> odd(T(0));
  constexpr int near = 128;
  const int step = direct ? near : N;
  for (int first = 0; first < N; first += step) {
    const int last = N - first < step ? N : first + step;
    for (int k = links.count - 1, turned_from = first + static_cast<int>(row_of(last - first)); k >= 0; --k) {
      stay_open(at, k, N);
      const Link<T>& link = links.link[k];
      if (link.v >= last) continue;
      coriolis_rows<skew>(link, k, first, last, N, w, rows, odd);
      for (; direct && turned_from - 8 >= link.v; turned_from -= 8) {  // rows turned_from - 8 and on are there
        const int left = turned_from - 8;
        put_below(reinterpret_cast<const double*>(rows.later), row, rows.later_mask, out, left, left < first ? first : left, last, N);
      }
    }
  }
  for (int b = 0; !direct && b < S::width && b < at.states; ++b) {
    double* const matrix = out + b * out_stride;
    for (int i = 0; i < N; ++i) {
      const CoriolisRows<S> from = rows.of(i);
      for (int j = i; j < N; ++j) {
        matrix[size_t(j) * N + i] = double(from.later[j].lane(b));
        matrix[size_t(i) * N + j] = double(from.upper[j].lane(b));
      }
    }
  }
  return finite_states<S>(odd);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
