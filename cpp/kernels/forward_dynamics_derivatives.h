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
    return row * (ResponseColumns<S>::rows * (1 + links.slots) + OwnColumns<S>::rows + (in_place<S>(links.nv) ? 0 : size_t(3) * links.nv)) + size_t(18) * links.nv;
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
    rows = nu + size_t(18) * links.nv;
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
      const OneGain<S> hinge(link, w, axes);
      m = hinge.gain, e[0] = hinge.inverse;
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
    const Spatial<S> q = pushed(k.psi, k.psi_rate) + inboard(l, turned_force(k, carried)), v = pushed(k.s, k.chi), unit = inboard(l, m);
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
    for (int j = 0; j < 3; ++j) {
      Vector3<S> unit = Vector3<S>::zero();
      unit[j] = S(1);
      const Vector3<S> left = cross(d, unit);
      add_column(parent.n, j, column(K.n, j) + P->B * left), add_column(parent.f, j, column(K.f, j) + P->C * left);
    }
    Carrying<S>&carries = w.carried[link.parent], &own = w.carried[k];
    carries.torque = carries.torque + own.torque + cross(l, own.force), carries.force = carries.force + own.force;
  }
}

// The columns of coordinates outboard of a link: ν, and z about the parent's origin.
template <class Kind, class S>
[[gnu::always_inline]] inline void respond(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Lying<S>& lying, const Direction<S>& own,
                                           const ResponseColumns<S>& z, const ResponseRows<S>& rows) {
  using V = Vector3<Block<S>>;
  const V l = in_all(link.parent < 0 ? Vector3<S>::zero() : lying.arm), s = in_all(own.s), slide = in_all(own.x);
  const OneGain<S> hinge(link, w, lying.axes);
  const V turn = in_all(hinge.gain.angular), pull = in_all(hinge.gain.linear);
  const Block<S> inverse = in_all(hinge.inverse);
  const Matrix3<Block<S>> axes = in_all(lying.axes), gain = in_all(multiple.gain);
  const ResponseRows<S> to = rows.of(link.v);
  each_block<S>(link.v + Kind::nv, link.end, [&](int c, const Block<S>& its) __attribute__((always_inline)) {
    const auto pass = [&](const Rows3<S>& ns, const Rows3<S>& fs, S* row) __attribute__((always_inline)) {
      V n = ns.at(c), f = fs.at(c);
      if constexpr (Kind::nv == 1) {
        Block<S> e = -dot(s, n);
        if constexpr (!Kind::pin) e -= dot(slide, f);
        put_first(e * inverse, row + c, to.room - c);
        e = e * its;
        f = f + e * pull;
        n = n + e * turn + cross(its * l, f);
      } else {
        const V about = transpose_times(axes, n), along = transpose_times(axes, f);
        Block<S> e[6] = {-about[0], -about[1], -about[2], -along[0], -along[1], -along[2]};
        const V left = Kind::nv == 3 ? axes * (along - transpose_times(gain, about)) : V::zero(), moved = cross(l, left);
        if constexpr (Kind::nv == 3)
          solve_columns(multiple.ball, e);
        else
          solve_columns(multiple.free, e);
        for (int i = 0; i < Kind::nv; ++i) put_first(e[i], row + size_t(i) * to.stride + c, to.room - c);
        const auto asked = greater(its, Block<S>(typename S::Scalar(0)));
        for (int r = 0; r < 3; ++r) n[r] = Block<S>::choose(asked, moved[r], n[r]), f[r] = Block<S>::choose(asked, left[r], f[r]);
      }
      ns.put(c, n), fs.put(c, f);
    };
    pass(z.qn, z.qf, to.q), pass(z.vn, z.vf, to.v), pass(z.mn, z.mf, to.m);
  });
}
// What else is in those rows: ν of the link's own coordinates, and nothing elsewhere.
template <class S>
inline void respond_else(const LinkOf<S>& link, int nv, const S* nu, const ResponseRows<S>& rows, int N) {
  for (int i = 0; i < nv; ++i) {
    const ResponseRows<S> to = rows.of(link.v + i);
    for (int c = link.v - link.v % BlockOf<S>::columns; c < link.v; ++c) to.q[c] = to.v[c] = to.m[c] = S(0);
    for (int c = 0; c < nv; ++c) to.q[link.v + c] = nu[18 * c + i], to.v[link.v + c] = nu[18 * c + 6 + i], to.m[link.v + c] = nu[18 * c + 12 + i];
    for (int c = link.end; c < N; ++c) to.q[c] = to.v[c] = to.m[c] = S(0);
  }
}

// Where columns stand to a link: of coordinates inboard of it, in a block with its own, or none of either.
enum class Standing { inboard, own, else_where };

// Base to tip at a link, of one block: rows of results, and α of the link from its parent's.
template <class Kind, class S>
struct Finisher {
  using B = Block<S>;
  using V = Vector3<B>;
  V l, d, s, slide, turn, pull;
  Matrix3<B> axes, gain, above, below;
  int stride, room;

  Finisher(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Instant<S>& instant, const Direction<S>& own, const ArticulatedRate<S>& K, const ResponseRows<S>& rows)
      : l(in_all(link.parent < 0 ? Vector3<S>::zero() : instant.lying.arm)), d(in_all(S(2) * instant.drift)), s(in_all(own.s)), slide(in_all(own.x)), axes(in_all(instant.lying.axes)),
        gain(in_all(multiple.gain)), above(in_all(K.kappa[0])), below(in_all(K.kappa[1])), stride(rows.stride), room(rows.room) {
    const OneGain<S> hinge(link, w, instant.lying.axes);
    turn = in_all(hinge.gain.angular), pull = in_all(hinge.gain.linear);
  }

  // b: of inboard coordinates, else zero; y: of its own.
  template <Standing where>
  [[gnu::always_inline]] void pass(int c, const Rows3<S>& angulars, const Rows3<S>& linears, const V& b, const V& y_angular, const V& y_linear, S* row, B& odd) const {
    V angular = angulars.at(c), linear = linears.at(c);
    linear = linear + cross(angular, l);
    if constexpr (where != Standing::else_where) linear = linear + cross(b, d);
    if constexpr (where == Standing::own) linear = linear + y_linear, angular = angular + y_angular;
    if constexpr (Kind::nv == 1) {
      B x = where == Standing::inboard ? B(typename S::Scalar(0)) : first_of(row + c, room - c);
      if constexpr (where != Standing::else_where) x -= dot(V{above(0, 0), above(0, 1), above(0, 2)}, b);
      x = x - dot(turn, angular) - dot(pull, linear);
      odd += x - x;
      put_first(x, row + c, room - c);
      angular = angular + x * s;
      if constexpr (!Kind::pin) linear = linear + x * slide;
    } else {
      linear = transpose_times(axes, linear), angular = transpose_times(axes, angular);
      V whole = V::zero(), moved = V::zero();
      for (int i = 0; where != Standing::inboard && i < 3; ++i) {
        whole[i] = first_of(row + size_t(i) * stride + c, room - c);
        if constexpr (Kind::nv == 6) moved[i] = first_of(row + size_t(3 + i) * stride + c, room - c);
      }
      if constexpr (where != Standing::else_where) whole = whole - above * b, moved = moved - below * b;
      if constexpr (Kind::nv == 3) whole = whole - gain * linear;
      for (int i = 0; i < 3; ++i) {
        const B x = whole[i] - angular[i];
        odd += x - x;
        put_first(x, row + size_t(i) * stride + c, room - c);
        if constexpr (Kind::nv == 6) {
          const B along = moved[i] - linear[i];
          odd += along - along;
          put_first(along, row + size_t(3 + i) * stride + c, room - c);
          linear[i] = moved[i];
        }
      }
      angular = axes * whole, linear = axes * linear;
    }
    angulars.put(c, angular), linears.put(c, linear);
  }
};

template <class Kind, class S, class T>
[[gnu::always_inline]] inline void finish_at(const Links<T>& links, int at_link, const ForwardDerivativeWork<S>& w, const ResponseRows<S>& rows, Block<S>& odd) {
  using V = Vector3<Block<S>>;
  constexpr int n = BlockOf<S>::columns;
  const Link<T>& link = links.link[at_link];
  const int N = links.nv, own_end = link.v + Kind::nv, before = link.v - link.v % n, after = (own_end + n - 1) / n * n;
  const size_t stride = row_of(N);
  const ResponseColumns<S> alpha(w.alpha + stride * ResponseColumns<S>::rows * link.slot, stride);
  const OwnColumns<S> adds(w.own, stride);
  const ResponseRows<S> to = rows.of(link.v);
  const Finisher<Kind, S> at(link, w.forward.link[at_link], *w.forward.of(link), w.instant[at_link], w.direction[link.v], w.rate[at_link], to);
  const V none = V::zero();
  for (int c = 0; c < before; c += n) {
    at.template pass<Standing::inboard>(c, alpha.qn, alpha.qf, adds.qb.at(c), none, none, to.q, odd);
    at.template pass<Standing::inboard>(c, alpha.vn, alpha.vf, adds.vb.at(c), none, none, to.v, odd);
  }
  for (int c = before; c < after && c < N; c += n) {
    const Block<S> inboard = ones_between<S>(c, 0, link.v), own = ones_between<S>(c, link.v, own_end);
    at.template pass<Standing::own>(c, alpha.qn, alpha.qf, inboard * adds.qb.at(c), own * adds.qa.at(c), own * adds.ql.at(c), to.q, odd);
    at.template pass<Standing::own>(c, alpha.vn, alpha.vf, inboard * adds.vb.at(c), own * adds.va.at(c), own * adds.vl.at(c), to.v, odd);
    at.template pass<Standing::else_where>(c, alpha.mn, alpha.mf, none, none, none, to.m, odd);
  }
  for (int c = after; c < N; c += n) {
    at.template pass<Standing::else_where>(c, alpha.qn, alpha.qf, none, none, none, to.q, odd);
    at.template pass<Standing::else_where>(c, alpha.vn, alpha.vf, none, none, none, to.v, odd);
    at.template pass<Standing::else_where>(c, alpha.mn, alpha.mf, none, none, none, to.m, odd);
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
  const size_t stride = row_of(links.nv), size = stride * ResponseColumns<S>::rows;
  const int above = link.parent < 0 ? -1 : links.link[link.parent].slot;
  if (above != link.slot)
    for (size_t i = 0; i < size; ++i) w.alpha[size * link.slot + i] = above < 0 ? S(0) : w.alpha[size * above + i];
  if (link.parent == k - 1) return;
  for (int r = 0; r < 6; ++r)
    for (int c = link.parent < 0 ? 0 : links.link[link.parent + 1].v; c < link.v; ++c) w.own[r * stride + c] = S(0);
}

// ∂v̇/∂q to `out`, ∂v̇/∂v and (ℳ + J)⁻¹ to the others.
template <class S>
unsigned forward_dynamics_derivatives(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t out_stride, typename S::Scalar* work) {
  using T = typename S::Scalar;
  const ForwardDerivativeWork<S> w(links, work);
  const int N = links.nv, stride = static_cast<int>(row_of(N));
  const bool direct = in_place<S>(N);
  const size_t size = size_t(stride) * N;
  ResponseRows<S> rows{w.rows, w.rows + size, w.rows + 2 * size, stride, stride};
  if constexpr (S::width == 1 && sizeof(T) == sizeof(double))
    if (direct) rows = {reinterpret_cast<S*>(out), reinterpret_cast<S*>(at.others[0]), reinterpret_cast<S*>(at.others[1]), N, N};
  for (int r = 0; r < ResponseColumns<S>::rows + OwnColumns<S>::rows; ++r)
    for (int c = N; c < stride; ++c) w.z[size_t(r) * stride + c] = S(0);
  for (size_t i = 0; !direct && i < 3 * size; i += stride)
    for (int c = N; c < stride; ++c) w.rows[i + c] = S(0);
  unsigned sound = S::mask(accelerate_all(links, at, w));
  start_all(links, at, w);
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k, N);
    const Link<T>& link = links.link[k];
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      respond<Kind>(link, w.forward.link[k], *w.forward.of(link), w.instant[k].lying, w.direction[link.v], ResponseColumns<S>(w.z, stride), rows);
      respond_else(link, Kind::nv, w.nu + size_t(18) * link.v, rows, N);
    });
  }
  Block<S> odd(T(0));
  for (int k = 0; k < links.count; ++k) {
    stay_open(at, k, N);
    begin_columns(links, k, w);
    with_step(links.link[k].step, [&](auto kind) { finish_at<decltype(kind)>(links, k, w, rows, odd); });
  }
  sound &= finite_states<S>(odd);
  for (int b = 0; b < S::width && b < at.states; ++b) {
    double* const to[] = {out + b * out_stride, at.others[0] + b * out_stride, at.others[1] + b * out_stride};
    for (int i = 0; !direct && i < N; ++i) {
      const ResponseRows<S> from = rows.of(i);
      for (int j = 0; j < N; ++j) to[0][size_t(i) * N + j] = double(from.q[j].lane(b)), to[1][size_t(i) * N + j] = double(from.v[j].lane(b));
      for (int j = i; j < N; ++j) to[2][size_t(i) * N + j] = double(from.m[j].lane(b));
    }
    mirror(to[2], N, at.interrupt);
  }
  return sound;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
