// Rows of numbers, one a column of a matrix, taken as many at a time as a register holds. Where lanes are states already, one at a time.
//
// A row has room for a last block that sticks out. What sticks out may be columns of another branch, which wait at their place: a block moves
// only those that are its own.
#pragma once

#include "kernels/lanes.h"
#include "spatial/vector3.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

#ifdef __AVX2__
inline constexpr int columns_at_once = 4;
#else
inline constexpr int columns_at_once = 2;
#endif

template <class S>
struct BlockOf {
  using type = S;
  static constexpr int columns = 1;
};
template <class T>
struct BlockOf<Lanes<T, 1>> {
  using type = Lanes<T, columns_at_once>;
  static constexpr int columns = columns_at_once;
};
template <class S>
using Block = typename BlockOf<S>::type;

// How long a row is that holds n columns.
template <class S>
constexpr size_t row_of(int n) {
  return size_t(n) + 7 & ~size_t(3);
}

template <class S>
[[gnu::always_inline]] inline Block<S> block_at(const S* x) {
  Block<S> y;
  __builtin_memcpy(&y, x, sizeof y);
  return y;
}
template <class S>
[[gnu::always_inline]] inline void put_block(const Block<S>& y, S* x) {
  __builtin_memcpy(x, &y, sizeof y);
}
template <class S>
[[gnu::always_inline]] inline void put_first(const Block<S>& y, S* x, int count) {
  if constexpr (BlockOf<S>::columns == 1) {
    *x = y;
  } else if (count >= BlockOf<S>::columns) {
    put_block<S>(y, x);
  } else {
    for (int b = 0; b < count; ++b) x[b] = S(y.lane(b));
  }
}
template <class S>
[[gnu::always_inline]] inline Block<S> in_all(const S& x) {
  if constexpr (BlockOf<S>::columns == 1)
    return x;
  else
    return Block<S>(x.v);
}
template <class S>
[[gnu::always_inline]] inline Vector3<Block<S>> in_all(const Vector3<S>& x) {
  return {in_all<S>(x[0]), in_all<S>(x[1]), in_all<S>(x[2])};
}

// f(c, count, its): the block from column c on, of which count are asked for; its: one for those, zero for what sticks out.
template <class S, class F>
[[gnu::always_inline]] inline void each_block(int first, int last, F f) {
  constexpr int n = BlockOf<S>::columns;
  Block<S> ones(typename S::Scalar(1));
  int c = first;
  for (; c + n <= last; c += n) f(c, n, ones);
  if constexpr (n > 1) {
    if (c == last) return;
    for (int b = last - c; b < n; ++b) ones.set(b, 0);
    f(c, last - c, ones);
  }
}

// Three rows.
template <class S>
struct Rows3 {
  S* row[3];
  Rows3(S* base, size_t stride, int first) : row{base + first, base + stride + first, base + 2 * stride + first} {}
  [[gnu::always_inline]] Vector3<Block<S>> at(int c) const { return {block_at(row[0] + c), block_at(row[1] + c), block_at(row[2] + c)}; }
  [[gnu::always_inline]] void put(int c, const Vector3<Block<S>>& x) const {
    for (int r = 0; r < 3; ++r) put_block<S>(x[r], row[r] + c);
  }
  void set(int c, const Vector3<S>& x) const {
    for (int r = 0; r < 3; ++r) row[r][c] = x[r];
  }
  Vector3<S> get(int c) const { return {row[0][c], row[1][c], row[2][c]}; }
};

// What lies below the diagonal of a result, from its rows above; false where one of the whole is not finite. out: n numbers a side.
inline bool put_below(const double* above, double* out, int n, void (*interrupt)()) {
  constexpr int tile = 8;
  double odd[tile] = {};
  for (int top = 0; top < n; top += tile) {
    if (n > 1024) interrupt();
    for (int left = 0; left <= top; left += tile) {
      const bool whole = left < top && top + tile <= n;
      const int bottom = top + tile < n ? top + tile : n;
      if (whole) {
        double block[tile][tile];
        for (int j = 0; j < tile; ++j)
          for (int i = 0; i < tile; ++i) block[i][j] = above[size_t(left + j) * n + top + i];
        for (int i = 0; i < tile; ++i)
          for (int j = 0; j < tile; ++j) out[size_t(top + i) * n + left + j] = block[i][j];
      } else {
        for (int i = top; i < bottom; ++i)
          for (int j = left; j < i && j < left + tile; ++j) out[size_t(i) * n + j] = above[size_t(j) * n + i];
      }
    }
    for (int i = top; i < n && i < top + tile; ++i) {
      int j = 0;
      for (; j + tile <= n; j += tile)
        for (int b = 0; b < tile; ++b) odd[b] += out[size_t(i) * n + j + b] - out[size_t(i) * n + j + b];
      for (; j < n; ++j) odd[0] += out[size_t(i) * n + j] - out[size_t(i) * n + j];
    }
  }
  for (int i = 1; i < tile; ++i) odd[0] += odd[i];
  return odd[0] == 0;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
