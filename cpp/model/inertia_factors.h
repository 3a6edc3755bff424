// A rigid body's spatial inertia as a sum of weighted squares, M = Σ w u u*: three columns for the mass at its centre, up to three for
// the inertia about it. Exact where the entries allow: nothing is moved to the frame's origin and back.
//
//   (c × e; e) of weight m,   (l; 0) of weight d,   I_c = Σ d l l*
#pragma once

#include "algebra/sweeps/factored_inertia.h"
#include "spatial/pose.h"
#include "spatial/symmetric3.h"

namespace pycraft {

template <class S>
struct InertiaFactors {
  Vector6<S> column[6];
  S weight[6];
  Vector3<S> com;
  int pivot[3];  // row of the unit entry of each column of I_c
};

template <class S>
inline InertiaFactors<S> inertia_factors(const S& mass, const Vector3<S>& com, const Symmetric3<S>& about_com) {
  InertiaFactors<S> f;
  f.com = com;
  for (int i = 0; i < 3; ++i) {
    Vector3<S> e = Vector3<S>::zero();
    e[i] = S(1);
    f.column[i] = {cross(com, e), e};
    f.weight[i] = mass;
  }
  const Matrix3<S> I = full(about_com);
  S U[9], work[9];
  semidefinite_factors(I.m, 3, U, f.weight + 3, work);
  for (int r = 0; r < 3; ++r) {
    f.column[3 + r] = {{U[3 * r], U[3 * r + 1], U[3 * r + 2]}, Vector3<S>::zero()};
    f.pivot[r] = U[3 * r] == S(1) ? 0 : U[3 * r + 1] == S(1) ? 1 : 2;
  }
  return f;
}

// The gyroscopic force b = V¯ M V as -Σ w u ρ + rest: accelerations ρ of the columns, and what a direction without inertia feels.
template <class S>
inline Vector6<S> gyroscopic_bias(const InertiaFactors<S>& f, const Vector6<S>& V, S* rho) {
  const Vector3<S>& w = V.angular;
  const Vector3<S> along = cross(w, V.linear + cross(w, f.com));  // ω × v of the centre of mass
  for (int i = 0; i < 3; ++i) rho[i] = -along[i];
  Vector3<S> momentum = Vector3<S>::zero();
  for (int r = 3; r < 6; ++r) momentum = momentum + (f.weight[r] * dot(f.column[r].angular, w)) * f.column[r].angular;
  Vector3<S> rest = cross(w, momentum);
  for (int r = 0; r < 3; ++r) {
    const S part = f.weight[3 + r] == S(0) ? S(0) : rest[f.pivot[r]];
    rest = rest - part * f.column[3 + r].angular;
    rho[3 + r] = -ratio_or_zero(part, f.weight[3 + r]);
  }
  return {rest, Vector3<S>::zero()};
}

// In the axes and about the origin of the frame that X takes to.
template <class S>
inline InertiaFactors<S> to_parent(const Pose<S>& X, InertiaFactors<S> f) {
  for (Vector6<S>& u : f.column) u = force_to_parent(X, u);
  return f;
}

}  // namespace pycraft
