// The inverse of the mass matrix on links: recursions/inverse_mass_matrix.h, whose equations they are, with the sweep for articulated
// inertias of kernels/forward_dynamics.h, and columns in the base's axes.
//
//   tip to base:  e = δ - H z,   ν = D⁻¹ e,   z <- z + G e,   z_n <- z_n + l × z_f
//   base to tip:  α_a <- α_a - l × α_α,   row = ν - G* α,   α <- α + H* row
#pragma once

#include "kernels/columns.h"
#include "kernels/forward_dynamics.h"
#include "kernels/mass_matrix_of_links.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
struct InverseWork {
  Lying<S>* lying;
  S *z, *rows, *alpha;  // (6, nv); (nv, nv); (6, nv) a slot
  template <class T>
  static size_t size(const Links<T>& links) {
    return links.count * sizeof(Lying<S>) + (size_t(6) * links.nv * (1 + links.slots) + size_t(links.nv) * links.nv) * sizeof(S);
  }
  template <class T>
  InverseWork(const Links<T>& links, T* work) : lying(reinterpret_cast<Lying<S>*>(work)) {
    z = reinterpret_cast<S*>(lying + links.count), rows = z + size_t(6) * links.nv, alpha = rows + size_t(links.nv) * links.nv;
  }
};

// A hinge of one coordinate in the base's axes: its row of H without the sign, and G.
template <class S>
struct OneCoordinate {
  HingeRow<S> h, gain;
  S inverse, sign;
  template <class Kind>
  static OneCoordinate of(const LinkOf<S>& link, const ForwardLink<S>& w, const Matrix3<S>& axes) {
    const S sign(link.sign);
    HingeRow<S> h = hinge_row<Kind>(link, axes, 0);
    h.angular = sign * h.angular, h.linear = sign * h.linear;
    return {h, {axes * (w.inverse * w.angular), axes * (w.inverse * w.linear)}, w.inverse, sign};
  }
};

// ν, and z + G e about the parent's origin, of the columns outboard of a link and its own, which come first.
template <class Kind, class S>
[[gnu::always_inline]] inline void innovations(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Lying<S>& lying, const Columns<S>& z, S* rows, int N) {
  const int count = link.end - link.v;
  const Vector3<S> l = link.parent < 0 ? Vector3<S>::zero() : lying.arm;
  if constexpr (Kind::nv == 1) {
    const auto own = OneCoordinate<S>::template of<Kind>(link, w, lying.axes);
    S* __restrict nu = rows;
    nu[0] = own.sign * own.inverse;
    const Vector3<S> f = own.sign * own.gain.linear, n = own.sign * own.gain.angular + cross(l, f);
    for (int r = 0; r < 3; ++r) z.n[r][0] = n[r], z.f[r][0] = f[r];
    each_column<true>(z, 1, count, [&](int c, Vector3<S>& n, Vector3<S>& f) {
      S e = -dot(own.h.angular, n);
      if constexpr (!Kind::pin) e -= dot(own.h.linear, f);
      nu[c] = e * own.inverse;
      f = f + e * own.gain.linear;
      n = n + e * own.gain.angular + cross(l, f);
    });
  } else {
    for (int c = 0; c < Kind::nv; ++c)
      for (int r = 0; r < 3; ++r) z.n[r][c] = z.f[r][c] = S(0);
    each_few_columns(z, count, [&]<class V>(int c, Vector3<V>& n, Vector3<V>& f) {
      const Matrix3<V> axes = wide<V>(lying.axes);
      n = transpose_times(axes, n), f = transpose_times(axes, f);  // in the link's own axes
      V e[Kind::nv];
      each_of<3>([&](int i) {
        const V own = unit<V, S>(c, i);
        e[i] = own - n[i], n[i] = own;
        if constexpr (Kind::nv == 6) {
          const V along = unit<V, S>(c, 3 + i);
          e[3 + i] = along - f[i], f[i] = along;
        }
      });
      if constexpr (Kind::nv == 3) f = f + transpose_times(wide<V>(multiple.gain), Vector3<V>{e[0], e[1], e[2]});
      if constexpr (Kind::nv == 3)
        multiple.ball.solve(e);
      else
        multiple.free.solve(e);
      each_of<Kind::nv>([&](int i) { stored(e[i], rows + size_t(i) * N + c); });
      f = axes * f;
      n = axes * n + cross(wide<V>(l), f);
    });
  }
  for (int i = 0; i < Kind::nv; ++i)
    for (int a = count; a < N - link.v; ++a) rows[size_t(i) * N + a] = S(0);
}

// Rows of the inverse, of the columns from the link's own on, and α of the link from its parent's.
template <class Kind, class S>
[[gnu::always_inline]] inline void finish_rows(const LinkOf<S>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Lying<S>& lying, const Columns<S>& alpha, S* rows, int N) {
  const int count = N - link.v;
  const Vector3<S> l = link.parent < 0 ? Vector3<S>::zero() : lying.arm;
  if constexpr (Kind::nv == 1) {
    const auto own = OneCoordinate<S>::template of<Kind>(link, w, lying.axes);
    S* __restrict row = rows;
    each_column<true>(alpha, 0, count, [&](int c, Vector3<S>& angular, Vector3<S>& linear) {
      linear = linear + cross(angular, l);
      const S x = row[c] - dot(own.gain.angular, angular) - dot(own.gain.linear, linear);
      angular = angular + x * own.h.angular;
      if constexpr (!Kind::pin) linear = linear + x * own.h.linear;
      row[c] = own.sign * x;
    });
  } else {
    each_few_columns(alpha, count, [&]<class V>(int c, Vector3<V>& angular, Vector3<V>& linear) {
      const Matrix3<V> axes = wide<V>(lying.axes);
      linear = transpose_times(axes, linear + cross(angular, wide<V>(l))), angular = transpose_times(axes, angular);
      const auto row = [&](int i) { return rows + size_t(i) * N + c; };
      Vector3<V> whole{loaded<V>(row(0)), loaded<V>(row(1)), loaded<V>(row(2))};
      if constexpr (Kind::nv == 3) whole = whole - wide<V>(multiple.gain) * linear;
      each_of<3>([&](int i) { stored(V(whole[i] - angular[i]), row(i)); });
      angular = axes * whole;
      if constexpr (Kind::nv == 6)
        each_of<3>([&](int i) {
          const V moved = loaded<V>(row(3 + i));
          stored(V(moved - linear[i]), row(3 + i)), linear[i] = moved;
        });
      linear = axes * linear;
    });
  }
}

template <class S>
unsigned mass_matrix_inverse(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t out_stride, typename S::Scalar* work) {
  using T = typename S::Scalar;
  const ForwardWork<S> w(links, work);
  const InverseWork<S> own(links, work + ForwardWork<S>::size(links) / sizeof(T));
  const int N = links.nv;
  S* rows = own.rows;
  if constexpr (S::width == 1 && sizeof(T) == sizeof(double)) rows = reinterpret_cast<S*>(out);
  for (int k = 0; k < links.count; ++k) {
    const Link<T>& link = links.link[k];
    Place<S>& place = w.link[k].motion.place;
    with_step(link.step, [&](auto kind) {
      place_link<decltype(kind)>(link, at, place);
      lie_in<decltype(kind)>(link, link.parent < 0 ? nullptr : own.lying + link.parent, place, own.lying[k]);
    });
  }
  unsigned sound = S::mask(articulated_tip_to_base<false>(links, at, w));
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k, N);
    const Link<T>& link = links.link[k];
    S* const row = rows + size_t(link.v) * N + link.v;
    with_step(link.step, [&](auto kind) { innovations<decltype(kind)>(link, w.link[k], *w.of(link), own.lying[k], Columns<S>(own.z, N, link.v), row, N); });
  }
  for (int k = 0; k < links.count; ++k) {
    stay_open(at, k, N);
    const Link<T>& link = links.link[k];
    const Columns<S> alpha(own.alpha + size_t(6) * N * link.slot, N, link.v);
    const int count = N - link.v, above = link.parent < 0 ? -1 : links.link[link.parent].slot;
    if (above != link.slot) {
      const Columns<S> parents(own.alpha + size_t(6) * N * (above < 0 ? 0 : above), N, link.v);
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < count; ++c) alpha.n[r][c] = above < 0 ? S(0) : parents.n[r][c], alpha.f[r][c] = above < 0 ? S(0) : parents.f[r][c];
    }
    S* const row = rows + size_t(link.v) * N + link.v;
    with_step(link.step, [&](auto kind) { finish_rows<decltype(kind)>(link, w.link[k], *w.of(link), own.lying[k], alpha, row, N); });
  }
  for (int b = 0; b < S::width && b < at.states; ++b) {
    double* const to = out + b * out_stride;
    if (rows == own.rows)
      for (int i = 0; i < N; ++i)
        for (int j = i; j < N; ++j) to[size_t(i) * N + j] = double(rows[size_t(i) * N + j].lane(b));
    if (!mirror(to, N, at.interrupt)) sound &= ~(1u << b);
  }
  return sound;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
