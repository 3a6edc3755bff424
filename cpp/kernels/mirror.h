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

// Four by four numbers about the diagonal, of which those below it are taken from above it.
[[gnu::always_inline]] inline void mirror_four(double* at, size_t n, RowOfFour& odd) {
  typedef long long Places __attribute__((vector_size(4 * sizeof(double))));
  const auto row = [&](int r) -> RowOfFour& { return *reinterpret_cast<RowOfFour*>(at + r * n); };
  const RowOfFour a = row(0), b = row(1), c = row(2), d = row(3);
  const RowOfFour below_b = __builtin_shuffle(a, b, Places{1, 5, 6, 7});
  const RowOfFour ab = __builtin_shuffle(a, b, Places{2, 6, 3, 7});  // of columns 2 and 3
  const RowOfFour below_c = __builtin_shuffle(ab, c, Places{0, 1, 6, 7}), below_d = __builtin_shuffle(__builtin_shuffle(ab, c, Places{2, 3, 7, 7}), d, Places{0, 1, 2, 7});
  row(1) = below_b, row(2) = below_c, row(3) = below_d;
  odd += a - a, odd += below_b - below_b, odd += below_c - below_c, odd += below_d - below_d;
}

// The upper triangle of n numbers a side mirrored. False where one of them is no number or not finite.
inline bool mirror(double* out, int n, void (*interrupt)()) {
  constexpr int tile = 64, line = 8;
  RowOfFour odd = {};
  const auto at = [&](int i, int j) { return out + size_t(i) * n + j; };
  const auto four = [&](int i, int j) {
    if (i == j)
      mirror_four(at(i, i), n, odd);
    else
      transpose_four(at(j, i), at(i, j), n, odd);
  };
  if (n <= line) {  // what has just been written is read back one by one: a wider load would wait for it
    double rest = 0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j <= i; ++j) rest += *at(j, i) - *at(j, i), *at(i, j) = *at(j, i);
    return rest == 0;
  }
  const int whole = n / 4 * 4;
  for (int top = 0; top < whole; top += tile) {
    if (n > 1024) interrupt();
    for (int left = 0; left <= top; left += tile)
      for (int i = top; i < std::min(top + tile, whole); i += line)
        for (int j = left; j < std::min(left + tile, i + 1); j += line)
          for (int a = i; a < std::min(i + line, whole); a += 4)
            for (int b = j; b < std::min(j + line, a + 1); b += 4) four(a, b);
  }
  if (whole < n) {  // the last four rows, of which some are there already
    for (int j = 0; j < n - 4; j += 4) four(n - 4, j);
    four(n - 4, n - 4);
  }
  return odd[0] + odd[1] + odd[2] + odd[3] == 0;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
