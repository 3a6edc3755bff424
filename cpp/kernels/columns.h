// Six rows of columns, (n; f) or (α; a) a column, in the base's axes about the origin of one link after another. From link to link columns are
// moved, not turned: forces gain l × f in their angular part, motions lose l × α in their linear one. Neighbouring columns are neighbours in
// every row, so that one instruction takes several of them.
#pragma once

#include "kernels/mirror.h"
#include "kernels/steps.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// How a link lies at a configuration, in the base's axes.
template <class S>
struct Lying {
  Matrix3<S> axes;
  Vector3<S> arm;  // its origin from the parent's
};

template <class Kind, class S, class T>
[[gnu::always_inline]] inline void lie_in(const Link<T>& link, const Lying<S>* above, const Place<S>& place, Lying<S>& out) {
  const auto rotation = Kind::rotation(place);
  const Vector3<S> arm = Kind::arm(link, place);
  out.arm = above ? above->axes * arm : arm;
  for (int r = 0; r < 3; ++r) {  // rows of axes: what takes the link's coordinates to one of the base's
    Vector3<S> row = Vector3<S>::zero();
    if (above)
      row = {above->axes(r, 0), above->axes(r, 1), above->axes(r, 2)};
    else
      row[r] = S(1);
    row = rotation.to_child(row);
    out.axes(r, 0) = row[0], out.axes(r, 1) = row[1], out.axes(r, 2) = row[2];
  }
}

template <class S>
struct Columns {
  S *n[3], *f[3];
  Columns(S* base, size_t stride, int first) {
    for (int r = 0; r < 3; ++r) n[r] = base + r * stride + first, f[r] = base + (3 + r) * stride + first;
  }
};

// move(c, n, f) of every column from the first on; what it makes of f is kept only where `forces` says so.
template <bool forces, class S, class Move>
[[gnu::always_inline]] inline void each_column(const Columns<S>& y, int first, int last, Move move) {
  S *__restrict n0 = y.n[0], *__restrict n1 = y.n[1], *__restrict n2 = y.n[2], *__restrict f0 = y.f[0], *__restrict f1 = y.f[1], *__restrict f2 = y.f[2];
#pragma GCC ivdep
  for (int c = first; c < last; ++c) {
    Vector3<S> n{n0[c], n1[c], n2[c]}, f{f0[c], f1[c], f2[c]};
    move(c, n, f);
    n0[c] = n[0], n1[c] = n[1], n2[c] = n[2];
    if constexpr (forces) f0[c] = f[0], f1[c] = f[1], f2[c] = f[2];
  }
}

// move(c, n, f) as above, of all columns before the last, several at once where that goes.
template <class S, class Move>
[[gnu::always_inline]] inline void each_few_columns(const Columns<S>& y, int last, Move move) {
  const auto take = [&]<class V>(V, int c) {
    Vector3<V> n{loaded<V>(y.n[0] + c), loaded<V>(y.n[1] + c), loaded<V>(y.n[2] + c)}, f{loaded<V>(y.f[0] + c), loaded<V>(y.f[1] + c), loaded<V>(y.f[2] + c)};
    move(c, n, f);
    each_of<3>([&](int r) { stored(n[r], y.n[r] + c), stored(f[r], y.f[r] + c); });
  };
  int c = 0;
  for (; c + BlockOf<S>::columns <= last; c += BlockOf<S>::columns) take(Block<S>(), c);
  for (; c < last; ++c) take(S(), c);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
