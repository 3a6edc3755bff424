// Symmetric 3x3 matrices by their six numbers: symmetric by construction, never by luck.
#pragma once

#include "spatial/vector3.h"

namespace pycraft {

// (xx, xy, xz, yy, yz, zz)
template <class S>
struct Symmetric3 {
  S s[6];
  static constexpr int index(int i, int j) {
    constexpr int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    return at[i][j];
  }
  const S& operator()(int i, int j) const { return s[index(i, j)]; }
  S& operator()(int i, int j) { return s[index(i, j)]; }
  static Symmetric3 zero() { return {S(0), S(0), S(0), S(0), S(0), S(0)}; }
  static Symmetric3 diagonal(const S& d) { return {d, S(0), S(0), d, S(0), d}; }
};

template <class S>
inline Symmetric3<S> operator+(const Symmetric3<S>& A, const Symmetric3<S>& B) {
  Symmetric3<S> C;
  for (int i = 0; i < 6; ++i) C.s[i] = A.s[i] + B.s[i];
  return C;
}
template <class S>
[[gnu::always_inline]] inline Vector3<S> operator*(const Symmetric3<S>& A, const Vector3<S>& x) {
  return {A.s[0] * x[0] + A.s[1] * x[1] + A.s[2] * x[2], A.s[1] * x[0] + A.s[3] * x[1] + A.s[4] * x[2],
          A.s[2] * x[0] + A.s[4] * x[1] + A.s[5] * x[2]};
}
template <class S>
inline Matrix3<S> full(const Symmetric3<S>& A) {
  return {A.s[0], A.s[1], A.s[2], A.s[1], A.s[3], A.s[4], A.s[2], A.s[4], A.s[5]};
}
// The symmetric part's six numbers of a matrix that is symmetric by its meaning.
template <class S>
inline Symmetric3<S> upper(const Matrix3<S>& A) {
  return {A(0, 0), A(0, 1), A(0, 2), A(1, 1), A(1, 2), A(2, 2)};
}
// R A R*.
template <class S>
inline Symmetric3<S> rotate(const Matrix3<S>& R, const Symmetric3<S>& A) {
  const Matrix3<S> T = R * full(A);
  Symmetric3<S> C;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) C(i, j) = T(i, 0) * R(j, 0) + T(i, 1) * R(j, 1) + T(i, 2) * R(j, 2);
  return C;
}
// -c~ c~ = |c|² 1 - c c*: what a unit mass at c adds to the inertia about the origin.
template <class S>
inline Symmetric3<S> point_inertia(const Vector3<S>& c) {
  const S xx = c[0] * c[0], yy = c[1] * c[1], zz = c[2] * c[2];
  return {yy + zz, -(c[0] * c[1]), -(c[0] * c[2]), xx + zz, -(c[1] * c[2]), xx + yy};
}
template <class T, class S>
inline Symmetric3<T> cast(const Symmetric3<S>& A) {
  Symmetric3<T> B;
  for (int i = 0; i < 6; ++i) B.s[i] = T(A.s[i]);
  return B;
}

}  // namespace pycraft
