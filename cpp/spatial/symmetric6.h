// Symmetric 6x6 operators by their 21 numbers, [[A, B], [B*, C]]: articulated and composite inertias (V -> F) and, in the dual
// spaces, the compliances Υ (F -> V). Symmetric by construction: one rounding error of asymmetry would cost all accuracy below 1e-8.
#pragma once

#include "spatial/pose.h"
#include "spatial/rigid_inertia.h"
#include "spatial/symmetric3.h"

namespace pycraft {

template <class S>
struct Symmetric6 {
  Symmetric3<S> A;
  Matrix3<S> B;
  Symmetric3<S> C;
  static Symmetric6 zero() { return {Symmetric3<S>::zero(), Matrix3<S>::zero(), Symmetric3<S>::zero()}; }
  S operator()(int i, int j) const {
    if (i < 3 && j < 3) return A(i, j);
    if (i >= 3 && j >= 3) return C(i - 3, j - 3);
    return i < 3 ? B(i, j - 3) : B(j, i - 3);
  }
};

template <class S>
inline Symmetric6<S> symmetric6(const RigidInertia<S>& M) {
  return {M.rotational, skew(M.moment), Symmetric3<S>::diagonal(M.mass)};
}
// Of its entries (i, j), those with i <= j and of the upper right block.
template <class S, class Entry>
inline Symmetric6<S> symmetric6_of(Entry&& entry) {
  Symmetric6<S> P;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      if (j >= i) P.A(i, j) = entry(i, j), P.C(i, j) = entry(i + 3, j + 3);
      P.B(i, j) = entry(i, j + 3);
    }
  return P;
}
template <class S>
inline Vector6<S> operator*(const Symmetric6<S>& P, const Vector6<S>& V) {
  return {P.A * V.angular + P.B * V.linear, transpose_times(P.B, V.angular) + P.C * V.linear};
}
template <class S>
inline Symmetric6<S> diagonal_part(const Symmetric6<S>& P) {
  Symmetric6<S> Q = Symmetric6<S>::zero();
  for (int i = 0; i < 3; ++i) Q.A(i, i) = P.A(i, i), Q.C(i, i) = P.C(i, i);
  return Q;
}
template <class S>
inline void add(Symmetric6<S>& P, const Symmetric6<S>& Q) {
  for (int i = 0; i < 6; ++i) P.A.s[i] += Q.A.s[i], P.C.s[i] += Q.C.s[i];
  for (int i = 0; i < 9; ++i) P.B.m[i] += Q.B.m[i];
}
// P - u w*, symmetric: w is a multiple of u.
template <class S>
inline void downdate(Symmetric6<S>& P, const Vector6<S>& u, const Vector6<S>& w) {
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) {
      P.A(i, j) -= u.angular[i] * w.angular[j];
      P.C(i, j) -= u.linear[i] * w.linear[j];
    }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) P.B(i, j) -= u.angular[i] * w.linear[j];
}
// P + (u w* + w u*).
template <class S>
inline void add_symmetric_product(Symmetric6<S>& P, const Vector6<S>& u, const Vector6<S>& w) {
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) {
      P.A(i, j) += u.angular[i] * w.angular[j] + w.angular[i] * u.angular[j];
      P.C(i, j) += u.linear[i] * w.linear[j] + w.linear[i] * u.linear[j];
    }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) P.B(i, j) += u.angular[i] * w.linear[j] + w.angular[i] * u.linear[j];
}
// Row and column i set to exact zero.
template <class S>
inline void annihilate(Symmetric6<S>& P, int i) {
  if (i < 3) {
    for (int j = 0; j < 3; ++j) P.A(i, j) = S(0), P.B(i, j) = S(0);
  } else {
    for (int j = 0; j < 3; ++j) P.C(i - 3, j) = S(0), P.B(j, i - 3) = S(0);
  }
}

// φ P φ* for the pose X = X_PB: an inertia in B about P's origin, in P's axes.
//   B' = RBR* + l~ RCR*,   A' = RAR* - (RBR*) l~ + l~ B'*
template <class S>
inline Symmetric6<S> to_parent(const Pose<S>& X, const Symmetric6<S>& P) {
  const Symmetric3<S> C = rotate(X.R, P.C);
  const Matrix3<S> B = X.R * P.B * transpose(X.R);
  Symmetric3<S> A = rotate(X.R, P.A);
  const Vector3<S>& l = X.p;
  Symmetric6<S> Q;
  for (int j = 0; j < 3; ++j) {
    const Vector3<S> moved = cross(l, Vector3<S>{C(0, j), C(1, j), C(2, j)});
    for (int i = 0; i < 3; ++i) Q.B(i, j) = B(i, j) + moved[i];
  }
  for (int j = 0; j < 3; ++j) {
    const Vector3<S> left = cross(l, Vector3<S>{Q.B(j, 0), Q.B(j, 1), Q.B(j, 2)});   // column j of l~ B'*
    for (int i = 0; i <= j; ++i) {
      const Vector3<S> right = cross(Vector3<S>{B(i, 0), B(i, 1), B(i, 2)}, l);        // row i of (RBR*) l~
      Q.A(i, j) = A(i, j) - right[j] + left[i];
    }
  }
  Q.C = C;
  return Q;
}

// φ* Υ φ for the pose X = X_PB: a compliance in P carried to B.
//   A' = R*AR,   B' = R*(B + A l~)R,   C' = R*(C + B*l~ - l~(B + A l~))R
template <class S>
inline Symmetric6<S> compliance_to_child(const Pose<S>& X, const Symmetric6<S>& U) {
  const Matrix3<S> Rt = transpose(X.R);
  const Vector3<S>& l = X.p;
  Matrix3<S> B;
  for (int i = 0; i < 3; ++i) {
    const Vector3<S> row = cross(Vector3<S>{U.A(i, 0), U.A(i, 1), U.A(i, 2)}, l);
    for (int j = 0; j < 3; ++j) B(i, j) = U.B(i, j) + row[j];
  }
  Symmetric3<S> C;
  for (int j = 0; j < 3; ++j) {
    const Vector3<S> left = cross(l, Vector3<S>{B(0, j), B(1, j), B(2, j)});
    for (int i = 0; i <= j; ++i) {
      const Vector3<S> right = cross(Vector3<S>{U.B(0, i), U.B(1, i), U.B(2, i)}, l);  // row i of B* l~
      C(i, j) = U.C(i, j) + right[j] - left[i];
    }
  }
  return {rotate(Rt, U.A), Rt * B * X.R, rotate(Rt, C)};
}

}  // namespace pycraft
