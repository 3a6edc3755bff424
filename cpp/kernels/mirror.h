// Symmetric matrices of which the upper triangle is known: the lower one, tile by tile, so that what is read and what is written both stay at hand.
#pragma once

#include <algorithm>
#include <cstddef>

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

typedef double RowOfFour __attribute__((vector_size(4 * sizeof(double)), aligned(sizeof(double)), may_alias));

// Four by four numbers at `from` transposed to `to`, both in matrices of n columns; odd: what of them is no number or not finite.
[[gnu::always_inline]] inline void transpose_four(const double* from, double* to, size_t n, RowOfFour& odd) {
  typedef long long Places __attribute__((vector_size(4 * sizeof(double))));
  const auto row = [&](int r) -> const RowOfFour& { return *reinterpret_cast<const RowOfFour*>(from + r * n); };
  const RowOfFour a = row(0), b = row(1), c = row(2), d = row(3);
  odd += a - a, odd += b - b, odd += c - c, odd += d - d;
  const Places even{0, 4, 2, 6}, uneven{1, 5, 3, 7}, low{0, 1, 4, 5}, high{2, 3, 6, 7};
  const RowOfFour ab = __builtin_shuffle(a, b, even), ba = __builtin_shuffle(a, b, uneven);
  const RowOfFour cd = __builtin_shuffle(c, d, even), dc = __builtin_shuffle(c, d, uneven);
  const auto put = [&](int r, const RowOfFour& x) { *reinterpret_cast<RowOfFour*>(to + r * n) = x; };
  put(0, __builtin_shuffle(ab, cd, low)), put(1, __builtin_shuffle(ba, dc, low));
  put(2, __builtin_shuffle(ab, cd, high)), put(3, __builtin_shuffle(ba, dc, high));
}

// The upper triangle of n numbers a side mirrored. False where one of them is no number or not finite.
inline bool mirror(double* out, int n, void (*interrupt)()) {
  constexpr int tile = 64, line = 8;
  RowOfFour odd = {};
  double rest = 0;
  const auto at = [&](int i, int j) { return out + size_t(i) * n + j; };
  for (int top = 0; top < n; top += tile) {
    if (n > 1024) interrupt();
    for (int left = 0; left <= top; left += tile)
      for (int i = top; i < std::min(top + tile, n); i += line)
        for (int j = left; j < std::min(left + tile, i + 1); j += line) {
          if (i == j || i + line > n) {
            for (int r = i; r < std::min(i + line, n); ++r)
              for (int c = j; c < std::min(j + line, r); ++c) {
                const double x = *at(c, r);
                rest += x - x;
                *at(r, c) = x;
              }
            continue;
          }
          for (int a = 0; a < line; a += 4)
            for (int b = 0; b < line; b += 4) transpose_four(at(j + b, i + a), at(i + a, j + b), n, odd);
        }
  }
  for (int i = 0; i < n; ++i) rest += *at(i, i) - *at(i, i);
  return rest + odd[0] + odd[1] + odd[2] + odd[3] == 0;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
