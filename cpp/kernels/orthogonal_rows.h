// Rows of columns made orthogonal one after the other (numerics/orthogonalisation.h), of several states at once or of one whose columns stand
// side by side: A = L Q, Q W Q* = diag d, L with a unit diagonal.
//
// Columns lie in fours, of each nine rows of four numbers: up to seven that are made orthogonal, at 7 the row ρ that is relieved with them, at 8
// the weights. A sum over columns is one of four sums, of columns 0, 4, 8, ..., of 1, 5, 9, ..., and so on, whatever takes them.
#pragma once

#include "lanes/lanes.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

inline constexpr int four = 36, rho_row = 7 * 4, weight_row = 8 * 4;  // where the numbers of a four are

template <int n, class S>
struct Triangle {
  S lower[n][n + 1];        // [r][s]: of row s against row r; [r][n]: of ρ
  S weight[n], inverse[n];  // d, 1/d or zero
  S products[n + 1];        // of row 0 with all: its column of P
  S root[n];                // of reflections: L(r, r) before it was made one
};

template <class V>
[[gnu::always_inline]] inline V all_of(const V& x) { return x; }
template <class T>
[[gnu::always_inline]] inline Lanes<T, 1> sum_of_lanes(const Lanes<T, 4>& x) { return (x.lane(0) + x.lane(1)) + (x.lane(2) + x.lane(3)); }
template <class T>
[[gnu::always_inline]] inline Lanes<T, 1> sum_of_lanes(const Lanes<T, 2>& x) { return x.lane(0) + x.lane(1); }

// 1/x, or nothing.
template <class S>
[[gnu::always_inline]] inline S inverse_or_zero(const S& x) {
  const S zero(0), one(1);
  if constexpr (S::width == 1)
    return x.v > 0 ? one / x : zero;
  else
    return S::choose(greater(x, zero), one / x, zero);
}

template <class S>
[[gnu::always_inline]] inline S square_root(const S& x) {
  S y;
  if constexpr (S::width == 1)
    y.v = __builtin_sqrt(x.v);
  else
    for (int b = 0; b < S::width; ++b) y.set(b, typename S::Scalar(__builtin_sqrt(x.lane(b))));
  return y;
}

// Sums over columns: visit(x, sums) for what stands at x of every four.
template <int count, class S, class Visit>
[[gnu::always_inline]] inline void sums_over(S* at, int fours, S* total, Visit visit) {
  using V = Block<S>;
  constexpr int columns = BlockOf<S>::columns, parts = 4 / columns;
  S part[parts][count];
  for (int g = 0; g < parts; ++g) {
    V sums[count];
    each_of<count>([&](int i) { sums[i] = V(typename V::Scalar(0)); });
    for (int k = 0; k < fours; ++k) visit(at + k * four + g * columns, sums);
    if constexpr (columns == 1)
      each_of<count>([&](int i) { part[g][i] = sums[i]; });
    else
      each_of<count>([&](int i) { part[g][i] = sum_of_lanes(sums[i]); });
  }
  each_of<count>([&](int i) {
    if constexpr (parts == 1)
      total[i] = part[0][i];
    else if constexpr (parts == 2)
      total[i] = part[0][i] + part[1][i];
    else
      total[i] = (part[0][i] + part[1][i]) + (part[2][i] + part[3][i]);
  });
}

// a W a*, a W b* of row r with those after it.
template <int n, int r, class S>
[[gnu::always_inline]] inline void products_of_row(S* at, int fours, S* total) {
  using V = Block<S>;
  sums_over<n - r + 1>(at, fours, total, [](S* x, V* sums) __attribute__((always_inline)) {
    const V a = loaded<V>(x + 4 * r), weighted = loaded<V>(x + weight_row) * a;
    sums[0] += weighted * a;
    each_of<n - r - 1>([&](int i) { sums[1 + i] += weighted * loaded<V>(x + 4 * (r + 1 + i)); });
    sums[n - r] += weighted * loaded<V>(x + rho_row);
  });
}
// Subtract f[s] of row r from row s, and compute the products of the next row. shared: a row that is scaled by f[shared] instead, -1: none.
template <int n, int r, int shared = -1, class S>
[[gnu::always_inline]] inline void relieve(S* at, int fours, const S* f, S* total) {
  using V = Block<S>;
  V wide_f[n + 1];
  for (int s = r + 1; s <= n; ++s) wide_f[s] = wide<V>(f[s]);
  sums_over<n - r>(at, fours, total, [&](S* x, V* sums) __attribute__((always_inline)) {
    const V a = loaded<V>(x + 4 * r);
    const auto relieved = [&](int s, int row) __attribute__((always_inline)) {
      const V b = s == shared ? V(loaded<V>(x + row) * wide_f[s]) : V(loaded<V>(x + row) - wide_f[s] * a);
      stored(b, x + row);
      return b;
    };
    const V next = relieved(r + 1, 4 * (r + 1)), weighted = loaded<V>(x + weight_row) * next;
    sums[0] += weighted * next;
    each_of<n - r - 2>([&](int i) { sums[1 + i] += weighted * relieved(r + 2 + i, 4 * (r + 2 + i)); });
    sums[n - r - 1] += weighted * relieved(n, rho_row);
  });
}

// Row r of L, from its products.
template <int n, class S>
[[gnu::always_inline]] inline void take_row(int r, const S* total, Triangle<n, S>& L) {
  L.weight[r] = total[0];
  const S inverse = L.inverse[r] = inverse_or_zero(total[0]);
  for (int s = r + 1; s <= n; ++s) L.lower[r][s] = total[s - r] * inverse;
}
template <int n, int r, class S>
[[gnu::always_inline]] inline void orthogonalise_from(S* at, int fours, S* total, Triangle<n, S>& L) {
  take_row(r, total, L);
  if constexpr (r + 1 < n) {
    S next[n - r];
    relieve<n, r>(at, fours, L.lower[r], next);
    orthogonalise_from<n, r + 1>(at, fours, next, L);
  }
}

// n rows of columns in fours.
template <int n, class S>
[[gnu::noinline]] void orthogonalise(S* at, int fours, Triangle<n, S>& L) {
  products_of_row<n, 0>(at, fours, L.products);
  orthogonalise_from<n, 0>(at, fours, L.products, L);
}

// The same if row 0 is h + e: h is row `shared`, e is 1 in the rotor's column, at `rotor`, of weight J. With W the weights and D = hWh* + J,
//
//   h - (hWh*/D) (h + e) = (J/D) h - (hWh*/D) e = (J/D) (h - (hWh*/J) e)
//
// Row `shared` is scaled by J/D after -hWh*/J is written into the rotor's column. The difference of the rows would be rounding where h is heavy and
// the rotor light.
template <int n, int shared, class S>
[[gnu::noinline]] void orthogonalise_with_rotor(S* at, int fours, S* rotor, const S& J, Triangle<n, S>& L) {
  products_of_row<n, 0>(at, fours, L.products);
  take_row(0, L.products, L);
  S f[n + 1], next[n];
  for (int s = 1; s <= n; ++s) f[s] = L.lower[0][s];
  f[shared] = J * L.inverse[0], rotor[4 * shared] = -(L.products[shared] / J);
  relieve<n, 0, shared>(at, fours, f, next);
  orthogonalise_from<n, 1>(at, fours, next, L);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
