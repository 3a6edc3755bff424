// Rows of numbers, one a column of a matrix, taken as many at a time as a register holds: blocks lie on one grid for all links, so that what one
// link writes the next one reads as it was written. Where lanes are states already, one at a time.
//
// At its ends a block sticks out: into columns of another branch, which wait at their place, or into room at a row's end. A mask keeps those still.
#pragma once

#include "lanes/lanes.h"
#include "spatial/vector3.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// How long a row is that holds n columns and the last block of them.
constexpr size_t row_of(int n) { return (size_t(n) + 7) & ~size_t(7); }

template <class S>
[[gnu::always_inline]] inline Block<S> block_at(const S* x) {
  return loaded<Block<S>>(x);
}
template <class S>
[[gnu::always_inline]] inline void put_block(const Block<S>& y, S* x) {
  stored(y, x);
}
// Of a block, what lies before the end of its row.
template <class S>
[[gnu::always_inline]] inline void put_first(const Block<S>& y, S* x, int count) {
  if (count >= BlockOf<S>::columns)
    put_block<S>(y, x);
  else
    for (int b = 0; b < count; ++b) x[b] = S(y.lane(b));
}
template <class S>
[[gnu::always_inline]] inline Block<S> first_of(const S* x, int count) {
  if (count >= BlockOf<S>::columns) return block_at(x);
  Block<S> y(typename S::Scalar(0));
  for (int b = 0; b < count; ++b) y.set(b, x[b].lane(0));
  return y;
}
template <class S>
[[gnu::always_inline]] inline Block<S> in_all(const S& x) {
  return wide<Block<S>>(x);
}
template <class S>
[[gnu::always_inline]] inline Vector3<Block<S>> in_all(const Vector3<S>& x) {
  return {in_all<S>(x[0]), in_all<S>(x[1]), in_all<S>(x[2])};
}

// One in the columns from `first` to `last` of the block from c on, else zero.
template <class S>
[[gnu::always_inline]] inline Block<S> ones_between(int c, int first, int last) {
  using T = typename S::Scalar;
  constexpr int n = BlockOf<S>::columns;
  if constexpr (n == 1) {
    return S(T(c >= first && c < last));
  } else {
    static constexpr T ladder[12] = {0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0};
    const int before = first <= c ? 0 : first - c < n ? first - c : n, after = last >= c + n ? 0 : c + n - last < n ? c + n - last : n;
    Block<S> begin, end;
    begin = block_at(reinterpret_cast<const S*>(ladder + 4 - before)), end = block_at(reinterpret_cast<const S*>(ladder + 8 - n + after));
    return begin * end;
  }
}
// f(c, its): the blocks that hold the columns from `first` to `last`.
template <class S, class F>
[[gnu::always_inline]] inline void each_block(int first, int last, F f) {
  constexpr int n = BlockOf<S>::columns;
  const Block<S> ones(typename S::Scalar(1));
  for (int c = first - first % n; c < last; c += n) f(c, c >= first && c + n <= last ? ones : ones_between<S>(c, first, last));
}

// Three rows.
template <class S>
struct Rows3 {
  S* row[3];
  Rows3(S* base, size_t stride) : row{base, base + stride, base + 2 * stride} {}
  [[gnu::always_inline]] Vector3<Block<S>> at(int c) const { return {block_at(row[0] + c), block_at(row[1] + c), block_at(row[2] + c)}; }
  [[gnu::always_inline]] void put(int c, const Vector3<Block<S>>& x) const {
    put_block<S>(x[0], row[0] + c), put_block<S>(x[1], row[1] + c), put_block<S>(x[2], row[2] + c);
  }
  void set(int c, const Vector3<S>& x) const {
    for (int r = 0; r < 3; ++r) row[r][c] = x[r];
  }
};

// Columns `left` to left + 8 of a result below its diagonal, of rows from `from` to `to`, from as many rows above it: row j at above + (j & mask) stride.
// from: left, or eight's multiple beyond it.
inline void put_below(const double* above, size_t stride, int mask, double* out, int left, int from, int to, int n) {
  constexpr int tile = 8;
  const int right = left + tile < n ? left + tile : n;
  for (int top = from; top < to; top += tile) {
    if (top > left && top + tile <= to) {
      double block[tile][tile];
      for (int j = 0; j < tile; ++j)
        for (int i = 0; i < tile; ++i) block[i][j] = above[size_t((left + j) & mask) * stride + top + i];
      for (int i = 0; i < tile; ++i)
        for (int j = 0; j < tile; ++j) out[size_t(top + i) * n + left + j] = block[i][j];
    } else {
      for (int i = top; i < to && i < top + tile; ++i)
        for (int j = left; j < i && j < right; ++j) out[size_t(i) * n + j] = above[size_t(j & mask) * stride + i];
    }
  }
}
inline void put_below(const double* above, size_t stride, int mask, double* out, int left, int n) { put_below(above, stride, mask, out, left, left, n, n); }

// Results of one state in place: rows of many columns, whose last block ends with the row.
template <class S>
constexpr bool in_place(int n) {
  return S::width == 1 && sizeof(typename S::Scalar) == sizeof(double) && n > 48;
}
// The states whose sums of results are all finite: others are left to the general recursions, be it that a sum alone left its range.
template <class S>
inline unsigned finite_states(const Block<S>& odd) {
  unsigned bad = 0;
  for (int b = 0; b < Block<S>::width; ++b)
    if (!(odd.lane(b) == 0)) bad |= 1u << (S::width == 1 ? 0 : b);
  return ~bad;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
