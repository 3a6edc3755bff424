// What two Coriolis matrices of a rigid body differ by, Hφ(MJ̇ + 𝓑J) and Christoffel's: K = ½(𝓑 - V̄M - MṼ), which is skew. Of a body or of a subtree
// about one point, by velocities (ω; v) of that point, mass m, moment h and rotational inertia A:
//
//   K = -[[a~, Q], [-Q*, b~]],   a = ½ tr(A) ω + h × v,   Q = m v~ + ω~h~,   b = m ω
//   where v gains d:       a + h × d,   Q + m d~
//   about a point at -l:   Q + l~b~,    a - tr(Q) l + Q* l + (l·b) l
#pragma once

#include "spatial/symmetric3.h"
#include "spatial/vector3.h"

namespace pycraft {

template <class S>
struct SkewPart {
  Vector3<S> a, b;
  Matrix3<S> Q;

  // Of a body whose point rests.
  [[gnu::always_inline]] static SkewPart of(const S& mass, const Vector3<S>& moment, const Symmetric3<S>& A, const Vector3<S>& omega) {
    const S half = S(0.5) * (A(0, 0) + A(1, 1) + A(2, 2));
    SkewPart K{half * omega, mass * omega, Matrix3<S>::zero()};
    K.add_crosses(omega, moment);
    return K;
  }
  [[gnu::always_inline]] void speed_up(const S& mass, const Vector3<S>& moment, const Vector3<S>& d) {
    a = a + cross(moment, d);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      Q(k, j) += mass * d[i], Q(j, k) -= mass * d[i];
    }
  }
  [[gnu::always_inline]] void move_inboard(const Vector3<S>& l) {
    const S along = dot(l, b) - (Q(0, 0) + Q(1, 1) + Q(2, 2));
    a = a + transpose_times(Q, l) + along * l;
    add_crosses(l, b);
  }
  [[gnu::always_inline]] void add(const SkewPart& other) {
    a = a + other.a, b = b + other.b;
    for (int i = 0; i < 9; ++i) Q.m[i] += other.Q.m[i];
  }
  // The two parts of K (angular; linear).
  [[gnu::always_inline]] Vector3<S> angular(const Vector3<S>& turning, const Vector3<S>& moving) const { return Vector3<S>::zero() - (cross(a, turning) + Q * moving); }
  [[gnu::always_inline]] Vector3<S> linear(const Vector3<S>& turning, const Vector3<S>& moving) const { return transpose_times(Q, turning) - cross(b, moving); }

 private:
  // Q + x~y~, which is y x* - (x·y).
  [[gnu::always_inline]] void add_crosses(const Vector3<S>& x, const Vector3<S>& y) {
    const S along = dot(x, y);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) Q(i, j) += y[i] * x[j];
      Q(i, i) -= along;
    }
  }
};

}  // namespace pycraft
