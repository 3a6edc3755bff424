// Rows made orthogonal by Householder reflections, as orthogonal_rows.h does by Gram-Schmidt, with the roots of the weights in the columns:
// A = L Q, Q Q* = 1. Row r becomes L(r,r) in one column, which then is through:
//
//   v = a + sign(a_j) |a| e_j,   b <- b - (2/v*v) (v*b) v,   L(r,r) = -sign(a_j) |a|,   L(s,r) = b_j
//
// j is the column with the largest entry of the row: entries of light columns would else be rounded at the size of heavy ones. Which one that is
// differs from state to state, so that no column changes its place.
//
// Sources: M. Powell and J. Reid, On applying Householder transformations to linear least squares problems, IFIP 1968; A. J. Cox and N. J.
// Higham, Stability of Householder QR factorization for weighted least squares problems, 1998.
#pragma once

#include "kernels/orthogonal_rows.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// The largest entry of a row by its size, and the column it is in, -1: none but zeros.
template <class S>
struct Largest {
  S size, column;
};
template <class S>
[[gnu::always_inline]] inline void keep_larger(Largest<S>& most, const S& size, const S& column) {
  if constexpr (S::width == 1) {
    if (size.v > most.size.v) most = {size, column};
  } else {
    const auto more = greater(size, most.size);
    most = {S::choose(more, size, most.size), S::choose(more, column, most.column)};
  }
}
// The numbers of columns c, c + 1, ... of a block.
template <class S>
[[gnu::always_inline]] inline Block<S> numbers_from(int c) {
  using V = Block<S>;
  V x{typename V::Scalar(c)};
  if constexpr (BlockOf<S>::columns > 1)
    for (int b = 0; b < V::width; ++b) x.set(b, typename V::Scalar(c + b));
  return x;
}
// The row's entry in a column.
template <class S>
[[gnu::always_inline]] inline S entry_in(const S* row, int fours, const S& column) {
  S x(0);
  if constexpr (S::width == 1) {
    if (column.v >= 0) x = row[int(column.v) / 4 * four + int(column.v) % 4];
  } else {
    for (int k = 0; k < 4 * fours; ++k) x = S::choose(same(column, S(typename S::Scalar(k))), row[k / 4 * four + k % 4], x);
  }
  return x;
}

// The largest entry of row r, and of what sums_over sums.
template <int count, class S, class Visit>
[[gnu::always_inline]] inline Largest<S> sums_and_largest(S* at, int fours, S* total, Visit visit) {
  using V = Block<S>;
  constexpr int columns = BlockOf<S>::columns;
  Largest<S> most{S(0), S(-1)};
  Largest<V> of_part{};
  int block = 0;
  sums_over<count>(at, fours, total, [&](S* x, V* sums) __attribute__((always_inline)) {
    if (block == 0) of_part = {V(typename V::Scalar(0)), V(typename V::Scalar(-1))};
    const V numbers = numbers_from<S>(int(x - at) - block * (four - 4));
    keep_larger(of_part, magnitude(visit(x, numbers, sums)), numbers);
    if (++block < fours) return;
    block = 0;
    if constexpr (columns == 1)
      keep_larger(most, of_part.size, of_part.column);
    else
      each_of<columns>([&](int b) { keep_larger(most, S(of_part.size.lane(b)), S(of_part.column.lane(b))); });
  });
  return most;
}

template <int n, int r, class S>
[[gnu::always_inline]] inline void reflect_from(S* at, int fours, const Largest<S>& most, const S* total, Triangle<n, S>& L) {
  using V = Block<S>;
  const S zero(0), head = entry_in(at + 4 * r, fours, most.column), length = square_root(total[0]);
  const S signed_length = S::choose(greater(zero, head), -length, length), scale = inverse_or_zero(S(total[0] + magnitude(head) * length));
  const S inverse = L.inverse[r] = inverse_or_zero(total[0]);
  L.weight[r] = total[0], L.root[r] = -signed_length;
  S f[n + 1];
  const S to_unit = -(signed_length * inverse);
  for (int s = r + 1; s <= n; ++s) {
    const S b = entry_in(at + (s == n ? rho_row : 4 * s), fours, most.column);
    f[s] = (total[s - r] + signed_length * b) * scale;
    const S left = b - f[s] * (head + signed_length);
    L.lower[r][s] = left * to_unit;
    if constexpr (r == 0) L.products[s] = left * -signed_length;
  }
  if constexpr (r == 0) L.products[0] = total[0];
  if constexpr (r + 1 < n) {
    V wide_f[n + 1];
    for (int s = r + 1; s <= n; ++s) wide_f[s] = wide<V>(f[s]);
    const V through = wide<V>(most.column);
    S next[n - r];
    const Largest<S> largest = sums_and_largest<n - r>(at, fours, next, [&](S* x, const V& numbers, V* sums) __attribute__((always_inline)) {
      const V a = loaded<V>(x + 4 * r);
      const auto gone = same(through, numbers);
      const auto reflected = [&](int s, int row) __attribute__((always_inline)) {
        const V b = V::choose(gone, V(typename V::Scalar(0)), V(loaded<V>(x + row) - wide_f[s] * a));
        stored(b, x + row);
        return b;
      };
      const V row = reflected(r + 1, 4 * (r + 1));
      sums[0] += row * row;
      each_of<n - r - 2>([&](int i) { sums[1 + i] += row * reflected(r + 2 + i, 4 * (r + 2 + i)); });
      sums[n - r - 1] += row * reflected(n, rho_row);
      return row;
    });
    reflect_from<n, r + 1>(at, fours, largest, next, L);
  }
}

// n rows of columns in fours; what is left as from orthogonalise, and L(r, r).
template <int n, class S>
[[gnu::noinline]] void reflect(S* at, int fours, Triangle<n, S>& L) {
  using V = Block<S>;
  S total[n + 1];
  const Largest<S> most = sums_and_largest<n + 1>(at, fours, total, [](S* x, const V&, V* sums) __attribute__((always_inline)) {
    const V a = loaded<V>(x);
    sums[0] += a * a;
    each_of<n - 1>([&](int i) { sums[1 + i] += a * loaded<V>(x + 4 * (1 + i)); });
    sums[n] += a * loaded<V>(x + rho_row);
    return a;
  });
  reflect_from<n, 0>(at, fours, most, total, L);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
