// How a link is turned against its parent: about a coordinate axis (Planar) or by any rotation (Full). Each turns vectors
// to and from the parent's axes and blocks R A R* of inertias, by no more than its structure asks: a planar one mixes two of three rows.
//
// turn<zero>(P) turns the three blocks of an inertia [[A, B], [B*, C]] of which row and column `zero` of A and row `zero` of B are exactly zero
// (-1: none): what is stored there does not count. turned_zero<zero> is what is zero afterwards.
#pragma once

#include "lanes/lanes.h"
#include "spatial/symmetric3.h"
#include "spatial/vector3.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S, class T>
[[gnu::always_inline]] inline Vector3<S> spread(const T* x) {
  return {S(x[0]), S(x[1]), S(x[2])};
}
template <class V, class S>
[[gnu::always_inline]] inline Vector3<V> wide(const Vector3<S>& x) {
  return {wide<V>(x[0]), wide<V>(x[1]), wide<V>(x[2])};
}
template <class V, class S>
[[gnu::always_inline]] inline Matrix3<V> wide(const Matrix3<S>& A) {
  Matrix3<V> B;
  each_of<9>([&](int i) { B.m[i] = wide<V>(A.m[i]); });
  return B;
}
template <class S>
[[gnu::always_inline]] inline Vector3<S> operator*(const Product<S>& s, const Vector3<S>& x) {
  return S(s) * x;
}

template <class S>
struct Inertia {  // [[A, B], [B*, C]], the force (n; f) that goes with it, and how sure they are
  Symmetric3<S> A;
  Matrix3<S> B;
  Symmetric3<S> C;
  Vector3<S> n, f;
  S error, growth;  // of the pivots outboard (pivots.h)
};

template <class S>
[[gnu::always_inline]] inline void add(Inertia<S>& P, const Inertia<S>& Q) {
  for (int i = 0; i < 6; ++i) P.A.s[i] += Q.A.s[i], P.C.s[i] += Q.C.s[i];
  for (int i = 0; i < 9; ++i) P.B.m[i] += Q.B.m[i];
  P.n = P.n + Q.n, P.f = P.f + Q.f;
  P.error = larger(P.error, Q.error), P.growth = larger(P.growth, Q.growth);
}
template <class S>
[[gnu::always_inline]] inline Inertia<S> no_inertia() {
  return {Symmetric3<S>::zero(), Matrix3<S>::zero(), Symmetric3<S>::zero(), Vector3<S>::zero(), Vector3<S>::zero(), S(0), S(1)};
}

// About axis K by the angle whose cosine and sine are c and s.
template <int K, class S>
struct Planar {
  static constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  template <int zero>
  static constexpr int turned_zero = zero;
  S c, s;
  [[gnu::always_inline]] Vector3<S> to_child(const Vector3<S>& x) const {
    Vector3<S> y;
    y[i] = c * x[i] + s * x[j], y[j] = c * x[j] - s * x[i], y[K] = x[K];
    return y;
  }
  template <class V>  // S, or wider numbers
  [[gnu::always_inline]] Vector3<V> to_parent(const Vector3<V>& x) const {
    Vector3<V> y;
    y[i] = c * x[i] - s * x[j], y[j] = c * x[j] + s * x[i], y[K] = x[K];
    return y;
  }
  // y += x times what axis m becomes.
  [[gnu::always_inline]] void add_column(int m, const S& x, Vector3<S>& y) const {
    if (m == i)
      y[i] += x * c, y[j] += x * s;
    else if (m == j)
      y[i] -= x * s, y[j] += x * c;
    else
      y[K] += x;
  }
  [[gnu::always_inline]] Vector3<S> column(int m) const {
    Vector3<S> y = Vector3<S>::zero();
    if (m == i)
      y[i] = c, y[j] = s;
    else if (m == j)
      y[i] = -s, y[j] = c;
    else
      y[K] = S(1);
    return y;
  }
  // Entry by entry, so that a small one turned into a large one's place and back keeps its digits.
  [[gnu::always_inline]] void turn_block(Symmetric3<S>& A) const {
    const S ci = c * A(i, i) - s * A(i, j), cj = c * A(i, j) - s * A(j, j), si = s * A(i, i) + c * A(i, j), sj = s * A(i, j) + c * A(j, j);
    A(i, i) = c * ci - s * cj, A(i, j) = c * si - s * sj, A(j, j) = s * si + c * sj;
  }
  [[gnu::always_inline]] void turn_symmetric(Symmetric3<S>& A) const {
    turn_block(A);
    const S a = c * A(i, K) - s * A(j, K);
    A(j, K) = c * A(j, K) + s * A(i, K), A(i, K) = a;
  }
  template <int zero>
  [[gnu::always_inline]] void turn(Inertia<S>& P) const {
    static_assert(zero == K || zero == -1);
    if constexpr (zero == K)
      turn_block(P.A);
    else
      turn_symmetric(P.A);
    turn_symmetric(P.C);
    Matrix3<S>& B = P.B;
    for (int r = 0; r < 3; ++r) {
      const S a = c * B(i, r) - s * B(j, r);
      B(j, r) = c * B(j, r) + s * B(i, r), B(i, r) = a;
    }
    for (int r = 0; r < 3; ++r) {
      if (r == zero) continue;
      const S a = c * B(r, i) - s * B(r, j);
      B(r, j) = c * B(r, j) + s * B(r, i), B(r, i) = a;
    }
  }
};

// R takes the child's coordinates to the parent's.
template <class S>
struct Full {
  template <int zero>
  static constexpr int turned_zero = -1;
  const Matrix3<S>& R;
  [[gnu::always_inline]] Vector3<S> to_child(const Vector3<S>& x) const { return transpose_times(R, x); }
  template <class V>
  [[gnu::always_inline]] Vector3<V> to_parent(const Vector3<V>& x) const {
    Vector3<V> y;
    each_of<3>([&](int r) { y[r] = R(r, 0) * x[0] + R(r, 1) * x[1] + R(r, 2) * x[2]; });
    return y;
  }
  [[gnu::always_inline]] void add_column(int m, const S& x, Vector3<S>& y) const {
    each_of<3>([&](int r) { y[r] += x * R(r, m); });
  }
  [[gnu::always_inline]] Vector3<S> column(int m) const { return {R(0, m), R(1, m), R(2, m)}; }
  [[gnu::always_inline]] void turn_symmetric(Symmetric3<S>& A) const {
    Matrix3<S> T;  // R A
    each_of<3>([&](int r) { each_of<3>([&](int k) { T(r, k) = R(r, 0) * A(0, k) + R(r, 1) * A(1, k) + R(r, 2) * A(2, k); }); });
    each_of<3>([&](int r) {
      each_of<3>([&](int k) {
        if (k >= r) A(r, k) = T(r, 0) * R(k, 0) + T(r, 1) * R(k, 1) + T(r, 2) * R(k, 2);
      });
    });
  }
  // With zero = 2, A has two columns and B two rows.
  template <int zero>
  [[gnu::always_inline]] void turn(Inertia<S>& P) const {
    static_assert(zero == 2 || zero == -1);
    constexpr int n = zero == 2 ? 2 : 3;
    turn_symmetric(P.C);
    Matrix3<S> T;  // its first n rows: of A R*, then of B R*
    const auto turned = [&](int r, int k) {  // R T
      S x = R(r, 0) * T(0, k) + R(r, 1) * T(1, k);
      if constexpr (n == 3) x += R(r, 2) * T(2, k);
      return x;
    };
    each_of<n>([&](int r) {
      each_of<3>([&](int k) {
        T(r, k) = P.A(r, 0) * R(k, 0) + P.A(r, 1) * R(k, 1);
        if constexpr (n == 3) T(r, k) += P.A(r, 2) * R(k, 2);
      });
    });
    each_of<3>([&](int r) {
      each_of<3>([&](int k) {
        if (k >= r) P.A(r, k) = turned(r, k);
      });
    });
    each_of<n>([&](int r) { each_of<3>([&](int k) { T(r, k) = P.B(r, 0) * R(k, 0) + P.B(r, 1) * R(k, 1) + P.B(r, 2) * R(k, 2); }); });
    each_of<3>([&](int r) { each_of<3>([&](int k) { P.B(r, k) = turned(r, k); }); });
  }
};

// The same inertia about a point at -l, where row `zero` of A and B is zero (what is stored there does not count):
//   B' = B + l~ C,   A' = A - B l~ + l~ B'*
template <int zero, class S>
[[gnu::always_inline]] inline void shift(const Vector3<S>& l, Inertia<S>& P) {
  const Matrix3<S> old = P.B;
  for (int k = 0; k < 3; ++k) {
    const Vector3<S> moved = cross(l, Vector3<S>{P.C(0, k), P.C(1, k), P.C(2, k)});
    for (int r = 0; r < 3; ++r) {
      if (r == zero)
        P.B(r, k) = moved[r];
      else
        P.B(r, k) += moved[r];
    }
  }
  for (int k = 0; k < 3; ++k) {
    const Vector3<S> left = cross(l, Vector3<S>{P.B(k, 0), P.B(k, 1), P.B(k, 2)});
    for (int r = 0; r <= k; ++r) {
      S change = left[r];
      if (r != zero) change -= cross(Vector3<S>{old(r, 0), old(r, 1), old(r, 2)}, l)[k];
      if (r == zero || k == zero)
        P.A(r, k) = change;
      else
        P.A(r, k) += change;
    }
  }
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
