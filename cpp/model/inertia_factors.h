// A rigid body's spatial inertia as a sum of weighted squares, M = Σ w u u*: three columns for the mass at its centre, up to three for
// the inertia about it. Exact where the entries allow: nothing is moved to the frame's origin and back.
//
//   (c × e; e) of weight m,   (l; 0) of weight d,   I_c = Σ d l l*
#pragma once

#include <algorithm>
#include <limits>
#include <type_traits>

#include "numerics/semidefinite_factors.h"
#include "spatial/pose.h"
#include "spatial/symmetric3.h"

namespace pycraft {

template <class S>
struct InertiaFactors {
  Vector6<S> column[6];
  S weight[6];
  Vector3<S> com;
  int pivot[3];        // row of the unit entry of each column of I_c
  S uncertain = S(0);  // moment about the centre that was taken for rounding
};

// Moments about the centre, full and symmetric, as weighted squares: the last three columns. One that may be no more than the rounding of the
// doubles given counts as zero, and as uncertain; so does a negative one that the model let pass.
template <class S, class Exact>
inline void factor_moments(const Exact* I, InertiaFactors<S>& f) {
  Exact U[9], w[3], work[9];
  const Exact rounding = Exact(2) * Exact(std::min(to_double(epsilon<S>()), epsilon<double>()));
  semidefinite_factors(I, 3, rounding, U, w, work);
  Exact left = Exact(0);  // no entry of what is left exceeds its largest diagonal entry by much
  for (const Exact& x : work) left = maximum(left, Exact(x < Exact(0) ? Exact(-x) : x));
  f.uncertain = static_cast<S>(Exact(3) * left);
  for (int r = 0; r < 3; ++r) {
    f.weight[3 + r] = static_cast<S>(w[r]);
    f.column[3 + r] = {{static_cast<S>(U[3 * r]), static_cast<S>(U[3 * r + 1]), static_cast<S>(U[3 * r + 2])}, Vector3<S>::zero()};
    f.pivot[r] = U[3 * r] == Exact(1) ? 0 : U[3 * r + 1] == Exact(1) ? 1 : 2;
  }
}

// The scalar that moments are factored in, so that what is left of a small one is right to the digits of S.
template <class S>
using MomentScalar = std::conditional_t<(std::numeric_limits<S>::digits < std::numeric_limits<Quad>::digits), Quad, S>;

template <class S>
inline InertiaFactors<S> inertia_factors(double mass, const Vector3<double>& com, const Symmetric3<double>& about_com) {
  using Exact = MomentScalar<S>;
  InertiaFactors<S> f;
  f.com = {S(com[0]), S(com[1]), S(com[2])};
  for (int i = 0; i < 3; ++i) {
    Vector3<S> e = Vector3<S>::zero();
    e[i] = S(1);
    f.column[i] = {cross(f.com, e), e};
    f.weight[i] = S(mass);
  }
  Exact I[9];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) I[3 * i + j] = Exact(about_com(i, j));
  factor_moments(I, f);
  return f;
}

// The gyroscopic force b' = (ω × Iω; ω × (ω × h)) as -Σ w u ρ + rest: accelerations ρ of the columns, and what a direction without inertia
// feels.
template <class S>
inline Vector6<S> gyroscopic_bias(const InertiaFactors<S>& f, const Vector3<S>& w, S* rho) {
  const Vector3<S> along = cross(w, cross(w, f.com));  // centripetal, of the centre of mass
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
