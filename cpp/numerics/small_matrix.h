// Products of small row-major matrices as plain loops: any scalar, no temporaries.
#pragma once

#include <algorithm>

namespace pycraft {

// C (r x c) += f A (r x n) B (n x c)
template <class S>
inline void multiply_add(const S* A, const S* B, S* C, int r, int n, int c, S f = S(1)) {
  for (int i = 0; i < r; ++i)
    for (int k = 0; k < n; ++k) {
      const S a = f * A[i * n + k];
      for (int j = 0; j < c; ++j) C[i * c + j] += a * B[k * c + j];
    }
}
// C (r x c) += f A* B, A (n x r), B (n x c)
template <class S>
inline void transposed_multiply_add(const S* A, const S* B, S* C, int r, int n, int c, S f = S(1)) {
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < r; ++i) {
      const S a = f * A[k * r + i];
      for (int j = 0; j < c; ++j) C[i * c + j] += a * B[k * c + j];
    }
}
// C (r x c) += f A B*, A (r x n), B (c x n)
template <class S>
inline void multiply_transposed_add(const S* A, const S* B, S* C, int r, int n, int c, S f = S(1)) {
  for (int i = 0; i < r; ++i)
    for (int j = 0; j < c; ++j) {
      S sum = S(0);
      for (int k = 0; k < n; ++k) sum += A[i * n + k] * B[j * n + k];
      C[i * c + j] += f * sum;
    }
}
template <class S>
inline void symmetrise(S* A, int n) {
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) A[j * n + i] = A[i * n + j];
}

}  // namespace pycraft
