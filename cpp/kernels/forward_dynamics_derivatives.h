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

#include "kernels/articulated_rates.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

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

// The columns of coordinates outboard of a link: ν, and z about the parent's origin.
template <class Kind, class S>
[[gnu::always_inline]] inline void respond(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Lying<S>& lying, const Direction<S>& own,
                                           const Spatial<S>& hinge, const ResponseColumns<S>& z, const ResponseRows<S>& rows) {
  using V = Vector3<Block<S>>;
  const V l = in_all(link.parent < 0 ? Vector3<S>::zero() : lying.arm), s = in_all(own.s), slide = in_all(own.x);
  const V turn = in_all(hinge.angular), pull = in_all(hinge.linear);
  const Block<S> inverse = in_all(w.inverse);
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
// What else is in those rows, to their ends: ν of the link's own coordinates, and nothing elsewhere.
template <class S>
inline void respond_else(const LinkOf<S>& link, int nv, const S* nu, const ResponseRows<S>& rows) {
  constexpr int n = BlockOf<S>::columns;
  const Block<S> nothing(typename S::Scalar(0));
  const int before = link.v - link.v % n, after = (link.end + n - 1) / n * n;
  for (int i = 0; i < nv; ++i) {
    const ResponseRows<S> to = rows.of(link.v + i);
    for (int c = before; c < link.v; ++c) to.q[c] = to.v[c] = to.m[c] = S(0);
    for (int c = 0; c < nv; ++c) to.q[link.v + c] = nu[18 * c + i], to.v[link.v + c] = nu[18 * c + 6 + i], to.m[link.v + c] = nu[18 * c + 12 + i];
    for (int c = link.end; c < after && c < to.room; ++c) to.q[c] = to.v[c] = to.m[c] = S(0);
    for (int c = after; c < to.room; c += n) put_first(nothing, to.q + c, to.room - c), put_first(nothing, to.v + c, to.room - c), put_first(nothing, to.m + c, to.room - c);
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
  std::ptrdiff_t from_parent;  // from the parent's columns to the link's

  Finisher(const LinkOf<S>& link, const ForwardMultiple<S>& multiple, const Instant<S>& instant, const Direction<S>& own, const ArticulatedRate<S>& K, const ResponseRows<S>& rows, std::ptrdiff_t from_parent)
      : l(in_all(link.parent < 0 ? Vector3<S>::zero() : instant.lying.arm)), d(in_all(S(2) * instant.drift)), s(in_all(own.s)), slide(in_all(own.x)), turn(in_all(K.gain.angular)), pull(in_all(K.gain.linear)), axes(in_all(instant.lying.axes)),
        gain(in_all(multiple.gain)), above(in_all(K.kappa[0])), below(in_all(K.kappa[1])), stride(rows.stride), room(rows.room), from_parent(from_parent) {
  }

  // b: of inboard coordinates, else zero; y: of its own.
  template <Standing where>
  [[gnu::always_inline]] void pass(int c, const Rows3<S>& angulars, const Rows3<S>& linears, const V& b, const V& y_angular, const V& y_linear, S* row, B& odd) const {
    V angular = angulars.at(c - from_parent), linear = linears.at(c - from_parent);
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
  const size_t size = stride * ResponseColumns<S>::rows;
  const std::ptrdiff_t from_parent = link.parent < 0 ? 0 : std::ptrdiff_t(size) * (link.slot - links.link[link.parent].slot);
  const ResponseColumns<S> alpha(w.alpha + size * link.slot, stride);
  const OwnColumns<S> adds(w.own, stride);
  const ResponseRows<S> to = rows.of(link.v);
  const Finisher<Kind, S> at(link, *w.forward.of(link), w.instant[at_link], w.direction[link.v], w.rate[at_link], to, from_parent);
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

// What the columns of a root start from: nothing. Of other branches b is none of a link's.
template <class S, class T>
inline void begin_columns(const Links<T>& links, int k, const ForwardDerivativeWork<S>& w) {
  const Link<T>& link = links.link[k];
  const size_t stride = row_of(links.nv), size = stride * ResponseColumns<S>::rows;
  const Block<S> nothing(typename S::Scalar(0));
  if (link.parent < 0)
    for (size_t i = 0; i < size; i += BlockOf<S>::columns) put_block<S>(nothing, w.alpha + size * link.slot + i);
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
  // What blocks hold besides a link's columns is finite, and no number so small that arithmetic on it is slow.
  for (size_t i = 0; i < size_t(ResponseColumns<S>::rows + OwnColumns<S>::rows) * stride; i += BlockOf<S>::columns) put_block<S>(Block<S>(T(0)), w.z + i);
  unsigned sound = S::mask(accelerate_all(links, at, w));
  start_all(links, at, w);
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k, N);
    const Link<T>& link = links.link[k];
    with_shape(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      respond<Kind>(link, w.forward.link[k], *w.forward.of(link), w.instant[k].lying, w.direction[link.v], w.rate[k].gain, ResponseColumns<S>(w.z, stride), rows);
      respond_else(link, Kind::nv, w.nu + size_t(18) * link.v, rows);
    });
  }
  Block<S> odd(T(0));
  for (int k = 0; k < links.count; ++k) {
    stay_open(at, k, N);
    begin_columns(links, k, w);
    with_shape(links.link[k].step, [&](auto kind) { finish_at<decltype(kind)>(links, k, w, rows, odd); });
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
