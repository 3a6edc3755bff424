// Derivatives of forward dynamics on links: ∂v̇/∂q, ∂v̇/∂v and ∂v̇/∂T = (ℳ + J)⁻¹, by the sweeps of the articulated-body algorithm on columns, a
// coordinate k each, without ∂T and without products of matrices. What a step along k (or its velocity) adds to the accelerations outboard of it
// is y = ψ̈ (or χ), with b = ψ̇ (or S) in the rates of momenta B (kernels/instants.h). P, D, G, P⁺ as in kernels/forward_dynamics.h, and beside P
// the articulated rate K, of which three columns are not zero:
//
//   K = B + Σ φ(K⁺ + P⁺ (0; -2d~)) of those outboard,   κ = D⁻¹ H K,   K⁺ = K - P H* κ
//   tip to base:  at k   ν = -κ b,   z = K⁺ b + P⁺ y + crf(S) F;    inboard of it  e = -H z,  ν = D⁻¹ e,  z <- z + G e;   z_n <- z_n + l × z_f
//   base to tip:  α_a <- α_a - l × α_α,   at k  α <- α + y;   outboard of it  α_a <- α_a - 2d × b,  ν = -κ b;   ∂v̇ = ν - G* α,   α <- α + H* ∂v̇
//
// with columns of (ℳ + J)⁻¹ as kernels/mass_matrix_inverse.h has them. Columns are in the base's axes. Cost O(N²).
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
  ResponseColumns(S* base, size_t stride, int first)
      : qn(base, stride, first), qf(base + 3 * stride, stride, first), vn(base + 6 * stride, stride, first), vf(base + 9 * stride, stride, first),
        mn(base + 12 * stride, stride, first), mf(base + 15 * stride, stride, first) {}
};
template <class S>
struct ResponseRows {
  S *q, *v, *m;
};

// A link as columns pass it: its coordinates, and what of K and P passes inward.
template <class S>
struct ArticulatedRate {
  Matrix3<S> n, f;      // K
  Matrix3<S> kappa[2];  // rows of κ, of up to six coordinates; of one, the first
};

template <class S>
struct ForwardDerivativeWork {
  ForwardWork<S> forward;
  Inertia<S>* outboard;  // P⁺
  Instant<S>* instant;
  Carrying<S>* carried;
  ArticulatedRate<S>* rate;
  S *z, *b, *alpha, *rows;
  double* accelerations;
  static constexpr bool in_place = S::width == 1 && sizeof(typename S::Scalar) == sizeof(double);
  template <class T>
  static size_t size(const Links<T>& links) {
    const size_t row = row_of<S>(links.nv), own = ForwardWork<S>::size(links) + 63 & ~size_t(63);
    return own + links.count * (sizeof(Inertia<S>) + sizeof(Instant<S>) + sizeof(Carrying<S>) + sizeof(ArticulatedRate<S>)) +
           (row * (ResponseColumns<S>::rows * (1 + links.slots) + 6) + (in_place ? 0 : size_t(3) * links.nv * links.nv)) * sizeof(S) +
           size_t(links.nv) * S::width * sizeof(double);
  }
  template <class T>
  ForwardDerivativeWork(const Links<T>& links, T* work) : forward(links, work) {
    const size_t row = row_of<S>(links.nv), own = ForwardWork<S>::size(links) + 63 & ~size_t(63);
    outboard = reinterpret_cast<Inertia<S>*>(reinterpret_cast<char*>(work) + own);
    instant = reinterpret_cast<Instant<S>*>(outboard + links.count);
    carried = reinterpret_cast<Carrying<S>*>(instant + links.count);
    rate = reinterpret_cast<ArticulatedRate<S>*>(carried + links.count);
    z = reinterpret_cast<S*>(rate + links.count);
    b = z + row * ResponseColumns<S>::rows;
    alpha = b + row * 6;
    rows = alpha + row * ResponseColumns<S>::rows * links.slots;
    accelerations = reinterpret_cast<double*>(rows + (in_place ? 0 : size_t(3) * links.nv * links.nv));
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

// A hinge of one coordinate in the base's axes, with its sign.
template <class S>
struct OneGain {
  Spatial<S> gain;
  S inverse;
  OneGain(const LinkOf<S>& link, const ForwardLink<S>& w, const Matrix3<S>& axes) : inverse(w.inverse) {
    const S by = S(link.sign) * w.inverse;
    gain = {axes * (by * w.angular), axes * (by * w.linear)};
  }
};

// L d L* x = e of columns.
template <int n, class S>
[[gnu::always_inline]] inline void solve_columns(const Factors<n, S>& of, Block<S>* x) {
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < i; ++a) x[i] -= in_all(of.lower[i][a]) * x[a];
  for (int i = 0; i < n; ++i) x[i] *= in_all(of.inverse[i]);
  for (int i = n - 1; i >= 0; --i)
    for (int a = i + 1; a < n; ++a) x[i] -= in_all(of.lower[a][i]) * x[a];
}
template <class S>
[[gnu::always_inline]] inline Matrix3<Block<S>> in_all(const Matrix3<S>& A) {
  Matrix3<Block<S>> B;
  for (int i = 0; i < 9; ++i) B.m[i] = in_all<S>(A.m[i]);
  return B;
}

// κ, and K⁺ in the place of K, about the link's origin.
template <class Kind, class S>
[[gnu::always_inline]] inline void project_rate(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Matrix3<S>& axes, const Direction<S>& own, ArticulatedRate<S>& K) {
  for (int j = 0; j < 3; ++j) {
    const Vector3<S> n = column(K.n, j), f = column(K.f, j);
    if constexpr (Kind::nv == 1) {
      const OneGain<S> hinge(link, w, axes);
      S e = dot(own.s, n);
      if constexpr (!Kind::pin) e += dot(own.x, f);
      K.kappa[0](0, j) = e * hinge.inverse;
      add_column(K.n, j, S(-e) * hinge.gain.angular), add_column(K.f, j, S(-e) * hinge.gain.linear);
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

// The columns of coordinates outboard of a link: ν, and z about the parent's origin.
template <class Kind, class S>
[[gnu::always_inline]] inline void respond(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Matrix3<S>& frame, const Vector3<S>& arm, const Direction<S>& own,
                                           const ResponseColumns<S>& z, const ResponseRows<S>& to, int N) {
  using V = Vector3<Block<S>>;
  const int count = link.end - link.v;
  const V l = in_all(arm);
  if constexpr (Kind::nv == 1) {
    const OneGain<S> hinge(link, w, frame);
    const V s = in_all(own.s), slide = in_all(own.x), turn = in_all(hinge.gain.angular), pull = in_all(hinge.gain.linear);
    const Block<S> inverse = in_all(hinge.inverse);
    each_block<S>(1, count, [&](int c, int there, const Block<S>& its) {
      const V by = its * l;
      const auto pass = [&](const Rows3<S>& ns, const Rows3<S>& fs, S* row) {
        V n = ns.at(c), f = fs.at(c);
        Block<S> e = -dot(s, n);
        if constexpr (!Kind::pin) e -= dot(slide, f);
        put_first(e * inverse, row + c, there);
        e *= its;
        f = f + e * pull;
        n = n + e * turn + cross(by, f);
        ns.put(c, n), fs.put(c, f);
      };
      pass(z.qn, z.qf, to.q), pass(z.vn, z.vf, to.v), pass(z.mn, z.mf, to.m);
    });
  } else {
    const Matrix3<Block<S>> axes = in_all(frame), gain = in_all(multiple.gain);
    each_block<S>(Kind::nv, count, [&](int c, int there, const Block<S>& its) {
      const auto pass = [&](const Rows3<S>& ns, const Rows3<S>& fs, S* row) {
        const V n = ns.at(c), f = fs.at(c), turn = transpose_times(axes, n), along = transpose_times(axes, f);
        Block<S> e[6] = {-turn[0], -turn[1], -turn[2], -along[0], -along[1], -along[2]};
        const V left = Kind::nv == 3 ? axes * (along - transpose_times(gain, turn)) : V::zero(), moved = cross(l, left);
        if constexpr (Kind::nv == 3)
          solve_columns(multiple.ball, e);
        else
          solve_columns(multiple.free, e);
        for (int i = 0; i < Kind::nv; ++i) put_first(e[i], row + size_t(i) * N + c, there);
        if (there == BlockOf<S>::columns) {
          ns.put(c, moved), fs.put(c, left);
        } else {
          for (int r = 0; r < 3; ++r) put_first(moved[r], ns.row[r] + c, there), put_first(left[r], fs.row[r] + c, there);
        }
      };
      pass(z.qn, z.qf, to.q), pass(z.vn, z.vf, to.v), pass(z.mn, z.mf, to.m);
    });
  }
}

// The columns of a link's own coordinates: ν, and their z about the parent's origin. K: K⁺ about that point; P: P⁺, null at a root.
template <class Kind, class S>
[[gnu::always_inline]] inline void start(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Instant<S>& instant, const Carrying<S>& carried,
                                         const Direction<S> (&own)[Kind::nv], const ArticulatedRate<S>& K, const Inertia<S>* P, const ResponseColumns<S>& z, const ResponseRows<S>& to, int N) {
  const Vector3<S>& l = instant.lying.arm;
  const Matrix3<S>& axes = instant.lying.axes;
  for (int c = 0; c < Kind::nv; ++c) {
    const Direction<S>& k = own[c];
    S e[6] = {S(0), S(0), S(0), S(0), S(0), S(0)};
    e[c] = S(1);
    Spatial<S> m;  // of a unit force along the coordinate
    if constexpr (Kind::nv == 1) {
      const OneGain<S> hinge(link, w, axes);
      m = hinge.gain, e[0] = hinge.inverse;
    } else {
      m = {axes * Vector3<S>{e[0], e[1], e[2]}, axes * Vector3<S>{e[3], e[4], e[5]}};
      if constexpr (Kind::nv == 3) m.linear = axes * Vector3<S>{multiple.gain(c, 0), multiple.gain(c, 1), multiple.gain(c, 2)};
      if constexpr (Kind::nv == 3)
        multiple.ball.solve(e);
      else
        multiple.free.solve(e);
    }
    for (int i = 0; i < Kind::nv; ++i) {
      const Matrix3<S>& kappa = K.kappa[i / 3];
      const Vector3<S> row{kappa(i % 3, 0), kappa(i % 3, 1), kappa(i % 3, 2)};
      const size_t at = size_t(i) * N + c;
      to.q[at] = -dot(row, k.psi), to.v[at] = -dot(row, k.s), to.m[at] = e[i];
    }
    if (!P) continue;
    const auto pushed = [&](const Vector3<S>& b, const Spatial<S>& y) {
      const Vector3<S> a = y.linear + cross(l, y.angular);
      return Spatial<S>{K.n * b + P->A * y.angular + P->B * a, K.f * b + transpose_times(P->B, y.angular) + P->C * a};
    };
    const Spatial<S> q = pushed(k.psi, k.psi_rate) + inboard(l, turned_force(k, carried)), v = pushed(k.s, k.chi), unit = inboard(l, m);
    z.qn.set(c, q.angular), z.qf.set(c, q.linear), z.vn.set(c, v.angular), z.vf.set(c, v.linear), z.mn.set(c, unit.angular), z.mf.set(c, unit.linear);
  }
}

// Tip to base at a link.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void respond_at(const Links<T>& links, int at_link, const States<T>& at, const ForwardDerivativeWork<S>& w, const ResponseRows<S>& rows) {
  const Link<T>& link = links.link[at_link];
  const int N = links.nv;
  const Instant<S>& instant = w.instant[at_link];
  const Instant<S>* const above = link.parent < 0 ? nullptr : &w.instant[link.parent];
  const ForwardLink<S>& own = w.forward.link[at_link];
  const ForwardMultiple<S>& multiple = *w.forward.of(link);
  const ResponseColumns<S> z(w.z, row_of<S>(N), link.v);
  const size_t first = size_t(link.v) * N + link.v;
  const ResponseRows<S> to{rows.q + first, rows.v + first, rows.m + first};
  const Vector3<S> l = above ? instant.lying.arm : Vector3<S>::zero();
  Direction<S> directions[Kind::nv];
  for (int i = 0; i < Kind::nv; ++i) directions[i] = direction<Kind>(link, at, above, instant, i);
  ArticulatedRate<S>& K = w.rate[at_link];
  project_rate<Kind>(link, own, multiple, instant.lying.axes, directions[0], K);
  respond<Kind>(link, own, multiple, instant.lying.axes, l, directions[0], z, to, N);
  for (int i = 0; i < Kind::nv; ++i)
    for (int c = link.end - link.v; c < N - link.v; ++c) to.q[size_t(i) * N + c] = to.v[size_t(i) * N + c] = to.m[size_t(i) * N + c] = S(0);
  Inertia<S>* const P = above ? &w.outboard[at_link] : nullptr;
  if (above) {
    Full<S>{above->lying.axes}.template turn<-1>(*P);
    for (int j = 0; j < 3; ++j) add_column(K.n, j, cross(l, column(K.f, j)));
  }
  start<Kind>(link, own, multiple, instant, w.carried[at_link], directions, K, P, z, to, N);
  if (!above) return;
  ArticulatedRate<S>& parent = w.rate[link.parent];
  const Vector3<S> d = S(-2) * instant.drift;
  for (int j = 0; j < 3; ++j) {
    Vector3<S> unit = Vector3<S>::zero();
    unit[j] = S(1);
    const Vector3<S> left = cross(d, unit);
    add_column(parent.n, j, column(K.n, j) + P->B * left), add_column(parent.f, j, column(K.f, j) + P->C * left);
  }
  Carrying<S>& carries = w.carried[link.parent];
  carries.torque = carries.torque + w.carried[at_link].torque + cross(l, w.carried[at_link].force), carries.force = carries.force + w.carried[at_link].force;
}

template <class S>
[[gnu::always_inline]] inline Block<S> first_of(const S* x, int count) {
  if (count == BlockOf<S>::columns) return block_at(x);
  Block<S> y(typename S::Scalar(0));
  if constexpr (BlockOf<S>::columns > 1)
    for (int b = 0; b < count; ++b) y.set(b, x[b].v);
  return y;
}

// Base to tip at a link, columns from `first` to `last`; inboard: those of coordinates inboard of the link, whose ν is made here.
template <class Kind, bool inboard, class S>
[[gnu::always_inline]] inline void finish_columns(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Instant<S>& instant, const Direction<S>& own,
                                                  const ArticulatedRate<S>& K, S* b, size_t stride, const ResponseColumns<S>& alpha, const ResponseRows<S>& rows, int first, int last, int N) {
  using V = Vector3<Block<S>>;
  const V l = in_all(link.parent < 0 ? Vector3<S>::zero() : instant.lying.arm), d = in_all(S(2) * instant.drift);
  const Rows3<S> bq(b, stride, 0), bv(b + 3 * stride, stride, 0);
  const Matrix3<Block<S>> axes = in_all(instant.lying.axes), gains = in_all(multiple.gain), above = in_all(K.kappa[0]), below = in_all(K.kappa[1]);
  const OneGain<S> hinge(link, w, instant.lying.axes);
  const V s = in_all(own.s), slide = in_all(own.x), turn = in_all(hinge.gain.angular), pull = in_all(hinge.gain.linear);
  each_block<S>(first, last, [&](int c, int there, const Block<S>&) {
    const auto pass = [&](const Rows3<S>& angulars, const Rows3<S>& linears, const Rows3<S>& bs, S* row) {
      V angular = angulars.at(c), linear = linears.at(c), of = V::zero();
      linear = linear + cross(angular, l);
      if constexpr (inboard) of = bs.at(c), linear = linear + cross(of, d);
      if constexpr (Kind::nv == 1) {
        Block<S> x = inboard ? -dot(V{above(0, 0), above(0, 1), above(0, 2)}, of) : first_of(row + c, there);
        x = x - dot(turn, angular) - dot(pull, linear);
        put_first(x, row + c, there);
        angular = angular + x * s;
        if constexpr (!Kind::pin) linear = linear + x * slide;
      } else {
        linear = transpose_times(axes, linear), angular = transpose_times(axes, angular);
        V whole, moved;
        if constexpr (inboard)
          whole = V::zero() - above * of;
        else
          for (int i = 0; i < 3; ++i) whole[i] = first_of(row + size_t(i) * N + c, there);
        if constexpr (Kind::nv == 3) whole = whole - gains * linear;
        for (int i = 0; i < 3; ++i) put_first(whole[i] - angular[i], row + size_t(i) * N + c, there);
        if constexpr (Kind::nv == 6) {
          if constexpr (inboard)
            moved = V::zero() - below * of;
          else
            for (int i = 0; i < 3; ++i) moved[i] = first_of(row + size_t(3 + i) * N + c, there);
          for (int i = 0; i < 3; ++i) put_first(moved[i] - linear[i], row + size_t(3 + i) * N + c, there);
          linear = moved;
        }
        angular = axes * whole, linear = axes * linear;
      }
      for (int r = 0; r < 3; ++r) put_first(angular[r], angulars.row[r] + c, there), put_first(linear[r], linears.row[r] + c, there);
    };
    pass(alpha.qn, alpha.qf, bq, rows.q), pass(alpha.vn, alpha.vf, bv, rows.v);
    if constexpr (!inboard) pass(alpha.mn, alpha.mf, bq, rows.m);
  });
}

template <class Kind, class S, class T>
[[gnu::always_inline]] inline void finish_at(const Links<T>& links, int at_link, const States<T>& at, const ForwardDerivativeWork<S>& w, const ResponseRows<S>& rows) {
  const Link<T>& link = links.link[at_link];
  const int N = links.nv;
  const size_t stride = row_of<S>(N);
  const Instant<S>& instant = w.instant[at_link];
  const Instant<S>* const above = link.parent < 0 ? nullptr : &w.instant[link.parent];
  const ResponseColumns<S> alpha(w.alpha + stride * ResponseColumns<S>::rows * link.slot, stride, 0);
  const Rows3<S> bq(w.b, stride, 0), bv(w.b + 3 * stride, stride, 0);
  const size_t first = size_t(link.v) * N;
  const ResponseRows<S> to{rows.q + first, rows.v + first, rows.m + first};
  Direction<S> own[Kind::nv];
  for (int i = 0; i < Kind::nv; ++i) {
    own[i] = direction<Kind>(link, at, above, instant, i);
    const int c = link.v + i;
    const auto raise = [&](const Rows3<S>& angular, const Rows3<S>& linear, const Spatial<S>& y) {
      angular.set(c, angular.get(c) + y.angular);
      linear.set(c, linear.get(c) + y.linear + (above ? cross(instant.lying.arm, y.angular) : Vector3<S>::zero()));
    };
    raise(alpha.qn, alpha.qf, own[i].psi_rate), raise(alpha.vn, alpha.vf, own[i].chi);
    bq.set(c, own[i].psi), bv.set(c, own[i].s);
  }
  const ForwardLink<S>& hinge = w.forward.link[at_link];
  const ForwardMultiple<S>& multiple = *w.forward.of(link);
  finish_columns<Kind, true>(link, hinge, multiple, instant, own[0], w.rate[at_link], w.b, stride, alpha, to, 0, link.v, N);
  finish_columns<Kind, false>(link, hinge, multiple, instant, own[0], w.rate[at_link], w.b, stride, alpha, to, link.v, N, N);
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
  const typename S::Bits sound = articulated_tip_to_base(links, at, w.forward, [&](int k, const Inertia<S>& P) { w.outboard[k] = P; });
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
    for (int j = 0; j < 3; ++j) {
      Vector3<S> unit = Vector3<S>::zero();
      unit[j] = S(1);
      const Spatial<S> of = rate_times(c, unit);
      for (int r = 0; r < 3; ++r) w.rate[k].n(r, j) = of.angular[r], w.rate[k].f(r, j) = of.linear[r];
    }
  }
  return sound;
}

// What a link's columns start from: its parent's, or nothing; b of other branches is none of it.
template <class S, class T>
inline void begin_columns(const Links<T>& links, int k, const ForwardDerivativeWork<S>& w) {
  const Link<T>& link = links.link[k];
  const size_t stride = row_of<S>(links.nv), size = stride * ResponseColumns<S>::rows;
  const int above = link.parent < 0 ? -1 : links.link[link.parent].slot;
  if (above != link.slot)
    for (size_t i = 0; i < size; ++i) w.alpha[size * link.slot + i] = above < 0 ? S(0) : w.alpha[size * above + i];
  if (link.parent == k - 1) return;
  for (int r = 0; r < 6; ++r)
    for (int c = link.parent < 0 ? 0 : links.link[link.parent + 1].v; c < link.v; ++c) w.b[r * stride + c] = S(0);
}

// ∂v̇/∂q to `out`, ∂v̇/∂v and (ℳ + J)⁻¹ to the others.
template <class S>
unsigned forward_dynamics_derivatives(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t out_stride, typename S::Scalar* work) {
  using Work = ForwardDerivativeWork<S>;
  const Work w(links, work);
  const int N = links.nv;
  const size_t square = size_t(N) * N, stride = row_of<S>(N);
  ResponseRows<S> rows{w.rows, w.rows + square, w.rows + 2 * square};
  if constexpr (Work::in_place) rows = {reinterpret_cast<S*>(out), reinterpret_cast<S*>(at.others[0]), reinterpret_cast<S*>(at.others[1])};
  for (int r = 0; r < ResponseColumns<S>::rows + 6; ++r)
    for (size_t c = N; c < stride; ++c) w.z[r * stride + c] = S(0);
  unsigned sound = S::mask(accelerate_all(links, at, w));
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k, N);
    with_step(links.link[k].step, [&](auto kind) { respond_at<decltype(kind)>(links, k, at, w, rows); });
  }
  for (int k = 0; k < links.count; ++k) {
    stay_open(at, k, N);
    begin_columns(links, k, w);
    with_step(links.link[k].step, [&](auto kind) { finish_at<decltype(kind)>(links, k, at, w, rows); });
  }
  for (int b = 0; b < S::width && b < at.states; ++b) {
    double* const to[] = {out + b * out_stride, at.others[0] + b * out_stride, at.others[1] + b * out_stride};
    double odd = 0;
    for (size_t i = 0; i < square; ++i) {
      if constexpr (!Work::in_place) to[0][i] = double(rows.q[i].lane(b)), to[1][i] = double(rows.v[i].lane(b)), to[2][i] = double(rows.m[i].lane(b));
      odd += (to[0][i] - to[0][i]) + (to[1][i] - to[1][i]);
    }
    if (!mirror(to[2], N, at.interrupt) || odd != 0) sound &= ~(1u << b);
  }
  return sound;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
