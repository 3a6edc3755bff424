// The velocity-dependent terms of the equations of motion, in accelerations of points, base to tip.
//
// The acceleration of the point at a body's origin is α' = α + (0; ω × v), α its spatial acceleration. With M = [[I, h~], [-h~, m]],
// v × mv = 0 and ω×(h×v) + v×(ω×h) = h×(ω×v), Jacobi's identity, the equations of motion become
//
//   f = Mα + V̄MV = Mα' + b',    b' = (ω × Iω; ω × (ω × h))
//   α'(k) = E(p,k)* α'(p) + H(k)* θ̈(k) + a'(k)
//   a' = (Σ W_i × w_i;  Ω × (Ω × l) + Σ (2W_i + w_i) × u_i),    W_i = Ω + Σ_{j before i} w_j
//
// over the hinge's subhinges i, Ω the parent's angular velocity, l from its origin to the body's, (w_i; u_i) the relative twist of subhinge
// i as it stands in the body's frame. No velocity of the base is left in a' or b': what all bodies have in common is not squared, multiplied
// by a mass and taken away again. The bodies' own velocities, and a and b as the book has them, are in recursions/velocities.h.
//
// A hinge that moves its body along any line, by a free subhinge or by three sliders, has u_i of the body's whole velocity. The linear part
// of its own a' is a motion of its coordinates t, (0; a'_linear) = Σ H_t* x_t: the equations of motion hold with that part left out for
// accelerations θ̈ + x, and x is taken from them at the end. So it never meets a mass.
//
// With them go c(v) = v ×* (J v) of the hinges' rotors (model/rotor_forces.h), forces of the hinges' own coordinates: T = H f + J θ̈ + c.
//
// Sources: R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008 (spatial and classical acceleration); A. Jain, Robot and
// Multibody Dynamics, Springer 2011, the equations-of-motion chapter. Cost O(N).
#pragma once

#include <vector>

#include "model/compiled_model.h"
#include "model/rotor_forces.h"
#include "runtime/interrupt.h"
#include "spatial/pose.h"

namespace pycraft {

template <class S>
struct PointAccelerations {
  std::vector<Vector3<S>> angular_velocity;  // per body, in its axes
  std::vector<Vector6<S>> a, b;              // per body
  std::vector<S> absorbed;                   // per coordinate: x
  std::vector<S> rotors;                     // per coordinate: c; empty: there are no rotors
  void resize(const CompiledModel<S>& model) {
    angular_velocity.resize(model.bodies), a.resize(model.bodies), b.resize(model.bodies);
    absorbed.assign(model.nv, S(0));
    rotors.assign(model.has_rotor_inertia ? model.nv : 0, S(0));
  }
  // T - c and T + c of one coordinate.
  S without_rotors(int j, const S& T) const { return rotors.empty() ? T : S(T - rotors[j]); }
  S with_rotors(int j, const S& T) const { return rotors.empty() ? T : S(T + rotors[j]); }
};

// Whether hinges take up the linear part of their own a' where they can: for equations that are solved for θ̈.
enum class OwnTerms { kept, absorbed };

// x of three coordinates with linear parts h(0), h(1), h(2): Σ h(i) x(i) = a. Zero where they are dependent.
template <class S>
inline Vector3<S> components_along(const Vector3<S>* h, const Vector3<S>& a) {
  const Vector3<S> normal[] = {cross(h[1], h[2]), cross(h[2], h[0]), cross(h[0], h[1])};
  const S volume = dot(h[0], normal[0]);
  return {ratio_or_zero(dot(normal[0], a), volume), ratio_or_zero(dot(normal[1], a), volume), ratio_or_zero(dot(normal[2], a), volume)};
}

// b'
template <class S>
inline Vector6<S> gyroscopic_part(const RigidInertia<S>& M, const Vector3<S>& omega) {
  return {cross(omega, M.rotational * omega), cross(omega, cross(omega, M.moment))};
}

// ω, a', b', x and c of body k from the angular velocity of its parent, in the parent's axes; null: the base.
template <class S>
inline void point_acceleration(const CompiledModel<S>& model, int k, const Vector3<S>* parents, const Pose<S>* pose, const Vector6<S>* H, const S* v,
                               OwnTerms own, PointAccelerations<S>& out) {
  const Pose<S>& X = pose[k];
  Vector3<S> omega = Vector3<S>::zero();  // W_i, then the body's
  Vector6<S> a = Vector6<S>::zero();
  if (parents) {
    omega = transpose_times(X.R, *parents);
    a.linear = transpose_times(X.R, cross(*parents, cross(*parents, X.p)));
  }
  int j = model.v_offset[k];
  for (int i = model.first_subhinge[k]; i < model.first_subhinge[k + 1]; ++i) {
    Vector6<S> relative = v[j] * H[j];
    for (const int end = j++ + record_of(model.subhinges[i].kind).nv; j < end; ++j) relative = relative + v[j] * H[j];
    a.angular = a.angular + cross(omega, relative.angular);
    a.linear = a.linear + cross(S(2) * omega + relative.angular, relative.linear);
    omega = omega + relative.angular;
  }
  if (const auto& t = model.translations[k]; own == OwnTerms::absorbed && t[0] >= 0) {
    const Vector3<S> lines[] = {H[t[0]].linear, H[t[1]].linear, H[t[2]].linear}, x = components_along(lines, a.linear);
    for (int i = 0; i < 3; ++i) out.absorbed[t[i]] = x[i];
    a.linear = Vector3<S>::zero();
  }
  out.angular_velocity[k] = omega;
  out.a[k] = a;
  out.b[k] = gyroscopic_part(model.inertia[k], omega);
  if (!out.rotors.empty()) rotor_forces(model, k, model.rotor_inertia.data(), v, out.rotors.data());
}

template <class S>
void point_accelerations_base_to_tip(const CompiledModel<S>& model, const Pose<S>* pose, const Vector6<S>* H, const S* v, OwnTerms own,
                                     PointAccelerations<S>& out) {
  out.resize(model);
  for (int k = 0; k < model.bodies; ++k) {
    check_interrupt_at(k);
    const int p = model.parent[k];
    point_acceleration(model, k, p < 0 ? nullptr : &out.angular_velocity[p], pose, H, v, own, out);
  }
}

}  // namespace pycraft
