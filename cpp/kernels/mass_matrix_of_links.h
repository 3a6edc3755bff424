// The mass matrix on links: composite inertias R, tip to base, and with them the columns R h* of every coordinate outboard of a link. A link's
// row of ℳ is its hinge's row times those columns:
//
//   (n; f)(k) = R(k) h(k)*,   ℳ(a, k) = h(a) (n; f)(k) for a from k to the base,   n <- n + l(a) × f
//
// columns in the base's axes about the origin of a, inertias in the links' own. Cost O(N · depth), nine products an entry.
#pragma once

#include "kernels/columns.h"
#include "kernels/motions.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
struct CompositeInertia {
  S mass;
  Vector3<S> moment;
  Symmetric3<S> rotational;
};
template <class S>
[[gnu::always_inline]] inline void add(CompositeInertia<S>& R, const CompositeInertia<S>& other) {
  R.mass += other.mass, R.moment = R.moment + other.moment, R.rotational = R.rotational + other.rotational;
}
// About the parent's origin, which lies at -l, in its axes.
template <class Rotation, class S>
[[gnu::always_inline]] inline void to_parent(const Rotation& rotation, const Vector3<S>& l, CompositeInertia<S>& R) {
  rotation.turn_symmetric(R.rotational);
  const Vector3<S> h = rotation.to_parent(R.moment), g = h + (S(0.5) * R.mass) * l;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    R.rotational(i, i) += S(2) * (l[j] * g[j] + l[k] * g[k]);  // what lies along an axis is not felt about it
    R.rotational(i, j) -= l[i] * g[j] + g[i] * l[j];
  }
  R.moment = h + R.mass * l;
}

// A row of H in the base's axes.
template <class S>
struct HingeRow {
  Vector3<S> angular, linear;
};
// Row i of a link's hinge in the link's axes, and in the base's.
template <class Kind, class S>
[[gnu::always_inline]] inline HingeRow<S> own_row(const LinkOf<S>& link, int i) {
  HingeRow<S> h{Vector3<S>::zero(), Vector3<S>::zero()};
  if constexpr (Kind::nv > 1) {
    (i < 3 ? h.angular : h.linear)[i % 3] = S(1);
  } else {
    h.angular[Kind::row] = S(link.sign) * S(link.turn);
    if constexpr (!Kind::pin) h.linear[Kind::row] = S(link.sign) * S(link.travel);
  }
  return h;
}
template <class Kind, class S>
[[gnu::always_inline]] inline HingeRow<S> hinge_row(const LinkOf<S>& link, const Matrix3<S>& axes, int i) {
  const Vector3<S> none = Vector3<S>::zero();
  const int r = Kind::nv == 1 ? Kind::row : i % 3;
  const Vector3<S> axis{axes(0, r), axes(1, r), axes(2, r)};
  if constexpr (Kind::nv > 1) return i < 3 ? HingeRow<S>{axis, none} : HingeRow<S>{none, axis};
  if constexpr (Kind::pin) return {S(link.sign) * axis, none};
  return {S(link.sign) * S(link.turn) * axis, S(link.sign) * S(link.travel) * axis};
}

template <class S>
struct MatrixWork {
  Lying<S>* lying;
  Place<S>* place;
  CompositeInertia<S>* branch;
  S* columns;  // (6, nv)
  template <class T>
  static size_t size(const Links<T>& links) {
    return links.count * (sizeof(Lying<S>) + sizeof(Place<S>) + sizeof(CompositeInertia<S>)) + size_t(6) * links.nv * sizeof(S);
  }
  template <class T>
  MatrixWork(const Links<T>& links, T* work) {
    lying = reinterpret_cast<Lying<S>*>(work);
    place = reinterpret_cast<Place<S>*>(lying + links.count);
    branch = reinterpret_cast<CompositeInertia<S>*>(place + links.count);
    columns = reinterpret_cast<S*>(branch + links.count);
  }
};

// Columns of a link's own coordinates. R in the link's axes.
template <class Kind, class S>
[[gnu::always_inline]] inline void start_columns(const LinkOf<S>& link, const Lying<S>& lying, const CompositeInertia<S>& R, const Columns<S>& y) {
  for (int i = 0; i < Kind::nv; ++i) {
    const HingeRow<S> h = own_row<Kind, S>(link, i);
    const Vector3<S> n = lying.axes * (R.rotational * h.angular + cross(R.moment, h.linear)), f = lying.axes * (R.mass * h.linear - cross(R.moment, h.angular));
    for (int r = 0; r < 3; ++r) y.n[r][i] = n[r], y.f[r][i] = f[r];
  }
}
template <class S, class T>
[[gnu::always_inline]] inline Vector3<S> arm_of(const Link<T>& link, const Lying<S>& lying) {
  return link.parent < 0 ? Vector3<S>::zero() : lying.arm;
}

// A link's rows of ℳ, and the columns moved to the parent's origin.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void give_rows(const Link<T>& link, const Lying<S>& lying, const Columns<S>& y, const States<T>& at, int N, double* out, size_t out_stride) {
  const int count = link.end - link.v;
  const bool pin = Kind::pin;
  double* const rows = out + size_t(link.v) * N + link.v;
  for (int i = 0; i < Kind::nv; ++i) {
    const HingeRow<S> h = hinge_row<Kind>(link, lying.axes, i);
    double* __restrict const row = rows + size_t(i) * N;
    const bool last = i + 1 == Kind::nv;
    const Vector3<S> l = last ? arm_of(link, lying) : Vector3<S>::zero();
    each_column<false>(y, 0, count, [&](int c, Vector3<S>& n, Vector3<S>& f) {
      S x = dot(h.angular, n);
      if (!pin) x += dot(h.linear, f);
      n = n + cross(l, f);
      if constexpr (S::width == 1)
        row[c] = double(x.v);
      else
        scattered(x, row + c, out_stride, at.states);
    });
    for (int b = 0; b < S::width && b < at.states; ++b) {
      double* const of_state = row + b * out_stride;
      raise<S>(of_state[i], link.J);
      for (int c = count; c < N - link.v; ++c) of_state[c] = 0;
    }
  }
}

// Of one state, where a pin follows a pin and nothing branches between: columns are read and written once for both.
template <class T>
[[gnu::always_inline]] inline bool pins_in_line(const Links<T>& links, int k) {
  const auto pin = [](const Link<T>& link) { return link.step <= Step::turned_pin; };
  const Link<T>&link = links.link[k], &parent = links.link[k > 0 ? k - 1 : 0];
  return k > 0 && link.parent == k - 1 && !parent.branches && pin(link) && pin(parent) && link.end - link.v > 8;
}
template <class S, class T>
[[gnu::always_inline]] inline Vector3<S> pin_axis(const Link<T>& link, const Lying<S>& lying) {
  const int i = link.step == Step::turned_pin ? TurnedPin::row : static_cast<int>(link.step);
  return S(link.sign) * Vector3<S>{lying.axes(0, i), lying.axes(1, i), lying.axes(2, i)};
}
// Rows of ℳ of a link and its parent, and the columns, from the parent's own on, moved to the grandparent's origin.
template <class S, class T>
inline void give_rows_of_two(const Link<T>* parent, const Lying<S>* lying, const Columns<S>& y, int N, double* out) {
  const Link<T>& link = parent[1];
  const int count = link.end - link.v;
  const Vector3<S> h = pin_axis(link, lying[1]), g = pin_axis(*parent, lying[0]);
  const Vector3<S> l = lying[1].arm, m = arm_of(*parent, lying[0]);
  double* __restrict const row = out + size_t(link.v) * N + link.v;
  double* __restrict const above = out + size_t(parent->v) * N + link.v;
  each_column<false>(y, 0, 1, [&](int, Vector3<S>& n, Vector3<S>& f) { above[-1] = double(dot(g, n).v) + parent->J, n = n + cross(m, f); });
  each_column<false>(y, 1, 1 + count, [&](int c, Vector3<S>& n, Vector3<S>& f) {
    row[c - 1] = double(S(dot(h, n)).v);
    n = n + cross(l, f);
    above[c - 1] = double(S(dot(g, n)).v);
    n = n + cross(m, f);
  });
  row[0] += link.J;
  for (int c = count; c < N - link.v; ++c) row[c] = above[c] = 0;
}

template <class S>
unsigned mass_matrix(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t out_stride, typename S::Scalar* work) {
  using T = typename S::Scalar;
  const int N = links.nv;
  const MatrixWork<S> w(links, work);
  const CompositeInertia<S> nothing{S(0), Vector3<S>::zero(), Symmetric3<S>::zero()};
  for (int k = 0; k < links.count; ++k) {
    const Link<T>& link = links.link[k];
    with_step(link.step, [&](auto kind) {
      place_link<decltype(kind)>(link, at, w.place[k]);
      lie_in<decltype(kind)>(link, link.parent < 0 ? nullptr : w.lying + link.parent, w.place[k], w.lying[k]);
    });
    if (link.branches) w.branch[k] = nothing;
  }
  CompositeInertia<S> R = nothing;
  bool outer = false;  // whether the rows of the link before wait for this one's
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k, N);
    const Link<T>& link = links.link[k];
    if (k + 1 == links.count || links.link[k + 1].parent != k) R = nothing;
    if (link.branches) add(R, w.branch[k]);
    add(R, CompositeInertia<S>{S(link.mass), spread<S>(link.moment), rotational_of<S>(link)});
    const bool inner = outer;
    outer = S::width == 1 && !inner && pins_in_line(links, k);
    const Columns<S> y(w.columns, N, link.v);
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      start_columns<Kind>(link, w.lying[k], R, y);
      if (!inner && !outer) give_rows<Kind>(link, w.lying[k], y, at, N, out, out_stride);
      if (link.parent >= 0) to_parent(Kind::rotation(w.place[k]), Kind::arm(link, w.place[k]), R);
    });
    if constexpr (S::width == 1)
      if (inner) give_rows_of_two(&link, w.lying + k, y, N, out);
    if (link.parent >= 0 && link.parent != k - 1) add(w.branch[link.parent], R);
  }
  unsigned sound = 0;
  for (int b = 0; b < S::width && b < at.states; ++b) sound |= unsigned(mirror(out + b * out_stride, N, at.interrupt)) << b;
  return sound;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
