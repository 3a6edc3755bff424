// Whether numbers are finite, several at a time: x - x is 0 of a finite number and no number of any other.
#pragma once

#include <cstddef>

namespace pycraft {

inline bool all_finite(const double* x, std::size_t n) {
  double odd[4] = {};
  std::size_t i = 0;
  for (; i + 4 <= n; i += 4)
    for (int k = 0; k < 4; ++k) odd[k] += x[i + k] - x[i + k];
  for (; i < n; ++i) odd[0] += x[i] - x[i];
  return (odd[0] + odd[1]) + (odd[2] + odd[3]) == 0;
}

}  // namespace pycraft
