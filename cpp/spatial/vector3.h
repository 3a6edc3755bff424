// Three-vectors and 3x3 matrices as plain arrays of scalars: no alignment demands, any scalar (a SIMD pack of states too).
// What every sweep does at every body is inlined always: what else a source compiles does not then decide how fast its sweeps are.
#pragma once

#include <cmath>

namespace pycraft {

template <class S>
struct Vector3 {
  S v[3];
  S& operator[](int i) { return v[i]; }
  const S& operator[](int i) const { return v[i]; }
  static Vector3 zero() { return {S(0), S(0), S(0)}; }
};

// Row-major.
template <class S>
struct Matrix3 {
  S m[9];
  S& operator()(int i, int j) { return m[3 * i + j]; }
  const S& operator()(int i, int j) const { return m[3 * i + j]; }
  static Matrix3 zero() { return {S(0), S(0), S(0), S(0), S(0), S(0), S(0), S(0), S(0)}; }
  static Matrix3 identity() { return {S(1), S(0), S(0), S(0), S(1), S(0), S(0), S(0), S(1)}; }
};

template <class S>
[[gnu::always_inline]] inline Vector3<S> operator+(const Vector3<S>& a, const Vector3<S>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
template <class S>
[[gnu::always_inline]] inline Vector3<S> operator-(const Vector3<S>& a, const Vector3<S>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class S>
inline Vector3<S> operator-(const Vector3<S>& a) {
  return {-a[0], -a[1], -a[2]};
}
template <class S>
[[gnu::always_inline]] inline Vector3<S> operator*(const S& c, const Vector3<S>& a) {
  return {c * a[0], c * a[1], c * a[2]};
}
template <class S>
[[gnu::always_inline]] inline S dot(const Vector3<S>& a, const Vector3<S>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class S>
[[gnu::always_inline]] inline Vector3<S> cross(const Vector3<S>& a, const Vector3<S>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
template <class S>
inline S norm(const Vector3<S>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}

template <class S>
[[gnu::always_inline]] inline Vector3<S> operator*(const Matrix3<S>& A, const Vector3<S>& x) {
  return {A(0, 0) * x[0] + A(0, 1) * x[1] + A(0, 2) * x[2], A(1, 0) * x[0] + A(1, 1) * x[1] + A(1, 2) * x[2],
          A(2, 0) * x[0] + A(2, 1) * x[1] + A(2, 2) * x[2]};
}
// A* x without forming A*.
template <class S>
[[gnu::always_inline]] inline Vector3<S> transpose_times(const Matrix3<S>& A, const Vector3<S>& x) {
  return {A(0, 0) * x[0] + A(1, 0) * x[1] + A(2, 0) * x[2], A(0, 1) * x[0] + A(1, 1) * x[1] + A(2, 1) * x[2],
          A(0, 2) * x[0] + A(1, 2) * x[1] + A(2, 2) * x[2]};
}
template <class S>
inline Matrix3<S> operator*(const Matrix3<S>& A, const Matrix3<S>& B) {
  Matrix3<S> C;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) C(i, j) = A(i, 0) * B(0, j) + A(i, 1) * B(1, j) + A(i, 2) * B(2, j);
  return C;
}
template <class S>
inline Matrix3<S> operator+(const Matrix3<S>& A, const Matrix3<S>& B) {
  Matrix3<S> C;
  for (int i = 0; i < 9; ++i) C.m[i] = A.m[i] + B.m[i];
  return C;
}
template <class S>
inline Matrix3<S> operator-(const Matrix3<S>& A, const Matrix3<S>& B) {
  Matrix3<S> C;
  for (int i = 0; i < 9; ++i) C.m[i] = A.m[i] - B.m[i];
  return C;
}
template <class S>
inline Matrix3<S> operator*(const S& c, const Matrix3<S>& A) {
  Matrix3<S> C;
  for (int i = 0; i < 9; ++i) C.m[i] = c * A.m[i];
  return C;
}
template <class S>
inline Matrix3<S> transpose(const Matrix3<S>& A) {
  return {A(0, 0), A(1, 0), A(2, 0), A(0, 1), A(1, 1), A(2, 1), A(0, 2), A(1, 2), A(2, 2)};
}
// a~, the matrix of x -> a × x.
template <class S>
inline Matrix3<S> skew(const Vector3<S>& a) {
  return {S(0), -a[2], a[1], a[2], S(0), -a[0], -a[1], a[0], S(0)};
}
template <class S>
inline S determinant(const Matrix3<S>& A) {
  return A(0, 0) * (A(1, 1) * A(2, 2) - A(1, 2) * A(2, 1)) - A(0, 1) * (A(1, 0) * A(2, 2) - A(1, 2) * A(2, 0)) +
         A(0, 2) * (A(1, 0) * A(2, 1) - A(1, 1) * A(2, 0));
}

template <class T, class S>
inline Vector3<T> cast(const Vector3<S>& a) {
  return {T(a[0]), T(a[1]), T(a[2])};
}
template <class T, class S>
inline Matrix3<T> cast(const Matrix3<S>& A) {
  Matrix3<T> B;
  for (int i = 0; i < 9; ++i) B.m[i] = T(A.m[i]);
  return B;
}

}  // namespace pycraft
