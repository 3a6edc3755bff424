// Motions of one frame relative to another, along the way between them.
//
// X is the pose of a frame c in a frame b, V = (X⁻¹Ẋ)^∨ its twist (ω; v) in its own axes about its own origin, A = dV/dt, component by component:
// the spatial acceleration. All three hang on X as a function of time alone, whatever b does in the world. With V_p = φ*(p,c) V(b,p):
//
//   X(b,c) = X(b,p) X(p,c)
//   V(b,c) = V_p + V(p,c)
//   A(b,c) = φ*(p,c) A(b,p) + V_p × V(p,c) + A(p,c)
//   X(c,b) = X(b,c)⁻¹,  V(c,b) = -Ad(X(b,c)) V(b,c),  A(c,b) = -Ad(X(b,c)) A(b,c)       as V × V = 0
//
// of a hinge  V = H*θ̇,  A = H*θ̈ + Ḣ*θ̇. The Jacobian of c against b has, for a coordinate of a hinge with its outer frame k on the way,
//
//   𝒥_i = ±Ad(X(k,c)⁻¹) h_i,   𝒥̇_i = ±Ad(X(k,c)⁻¹) ḣ_i - V(k,c) × 𝒥_i                   + on the way up from c, - down to b
//
// and exact zeros for all others: what moves both frames as one body is never added and taken away. A product of a way's steps costs the steps.
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011 (spatial accelerations; relative velocities); K. Lynch, F. Park, Modern Robotics,
// Cambridge 2017 (body twists and the adjoint).
#pragma once

#include <vector>

#include "model/compiled_model.h"
#include "model/frames.h"
#include "model/hinge_kinematics.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class S>
struct RelativeMotion {
  Pose<S> X = Pose<S>::identity();
  Vector6<S> V = Vector6<S>::zero(), A = Vector6<S>::zero();
};

// What is wanted of a motion; each with all before it.
enum class MotionPart { pose, velocity, acceleration };

// Ad(X) V: a motion in the axes before X, about their origin.
template <class S>
inline Vector6<S> motion_to_parent(const Pose<S>& X, const Vector6<S>& V) {
  const Vector3<S> omega = X.R * V.angular;
  return {omega, X.R * V.linear + cross(X.p, omega)};
}

// Of c in b, from that of p in b and of c in p.
template <class S>
inline RelativeMotion<S> composed(const RelativeMotion<S>& bp, const RelativeMotion<S>& pc, MotionPart part) {
  RelativeMotion<S> bc;
  bc.X = bp.X * pc.X;
  if (part == MotionPart::pose) return bc;
  const Vector6<S> carried = motion_to_child(pc.X, bp.V);
  bc.V = carried + pc.V;
  if (part == MotionPart::acceleration) bc.A = motion_to_child(pc.X, bp.A) + cross_motion(carried, pc.V) + pc.A;
  return bc;
}

template <class S>
inline RelativeMotion<S> inverse(const RelativeMotion<S>& m, MotionPart part) {
  RelativeMotion<S> back;
  back.X = inverse(m.X);
  if (part >= MotionPart::velocity) back.V = S(-1) * motion_to_parent(m.X, m.V);
  if (part == MotionPart::acceleration) back.A = S(-1) * motion_to_parent(m.X, m.A);
  return back;
}

// A hinge's rows of H and Ḣ, one a coordinate.
template <class S>
struct HingeRows {
  std::vector<Vector6<S>> rows, rates;
};

// X(p,k), and the rows of H.
template <class S>
inline void hinge_pose(const CompiledModel<S>& model, int k, const S* q, RelativeMotion<S>& m, HingeRows<S>& hinge) {
  hinge.rows.resize(model.nv_of[k]);
  m.X = hinge_kinematics(model, k, q, hinge.rows.data());
}
// V and Ḣ, after the pose. v: the hinge's own.
template <class S>
inline void hinge_velocity(const CompiledModel<S>& model, int k, const S* v, RelativeMotion<S>& m, HingeRows<S>& hinge) {
  hinge.rates.assign(model.nv_of[k], Vector6<S>::zero());
  if (model.first_subhinge[k + 1] - model.first_subhinge[k] > 1) hinge_map_rate(model, k, hinge.rows.data(), v, hinge.rates.data());
  m.V = Vector6<S>::zero();
  for (size_t j = 0; j < hinge.rows.size(); ++j) m.V = m.V + v[j] * hinge.rows[j];
}
// A, after the velocity.
template <class S>
inline void hinge_acceleration(const S* v, const S* vdot, RelativeMotion<S>& m, const HingeRows<S>& hinge) {
  m.A = Vector6<S>::zero();
  for (size_t j = 0; j < hinge.rows.size(); ++j) m.A = m.A + vdot[j] * hinge.rows[j] + v[j] * hinge.rates[j];
}

// ModelError where a function of time did not say what is wanted of its frame.
inline void require_part(const LooseFrame& frame, const FrameMotion& motion, MotionPart part) {
  if (part >= MotionPart::velocity && !motion.velocity)
    throw ModelError("the motion of frame '" + frame.name + "' gives a pose and no velocity: for velocities and rates let it return (pose, twist), the twist "
                     "(ω; v) in the frame's own axes; no difference is taken in its place");
  if (part == MotionPart::acceleration && !motion.acceleration)
    throw ModelError("the motion of frame '" + frame.name + "' gives no acceleration: for accelerations let it return (pose, twist, acceleration), the last "
                     "the rate of the six numbers of the twist; no difference is taken in its place");
}

template <class S>
inline RelativeMotion<S> motion_of(const LooseFrame& frame, const FrameMotion& motion, MotionPart part) {
  require_part(frame, motion, part);
  RelativeMotion<S> m{cast<S>(motion.pose)};
  if (part >= MotionPart::velocity) m.V = cast<S>(*motion.velocity);
  if (part == MotionPart::acceleration) m.A = cast<S>(*motion.acceleration);
  return m;
}

// The motion of a path's first frame in its last. motion(step): that of one step, a RelativeMotion<S>.
template <class S, class F>
RelativeMotion<S> along(const FramePath& path, MotionPart part, F motion) {
  RelativeMotion<S> m;
  int count = 0;
  for (const FrameStep& step : path.up) {
    check_interrupt_at(count++);
    m = composed<S>(motion(step), m, part);
  }
  for (const FrameStep& step : path.down) {
    check_interrupt_at(count++);
    m = composed<S>(inverse<S>(motion(step), part), m, part);
  }
  return m;
}

// Calls column(i, 𝒥_i, 𝒥̇_i) for every coordinate on the way, 𝒥̇_i where rates are wanted, and returns the motion, of its velocity where they are.
// motion(step, rows): that of one step, with the rows of a hinge in `rows`, here `hinge`.
template <class S, class F, class C>
RelativeMotion<S> jacobian_along(const CompiledModel<S>& model, const FramePath& path, bool rates, HingeRows<S>& hinge, F motion, C column) {
  const MotionPart part = rates ? MotionPart::velocity : MotionPart::pose;
  RelativeMotion<S> m;
  const auto columns = [&](int k, const S& sign) {
    for (int j = 0; j < model.nv_of[k]; ++j) {
      const Vector6<S> J = sign * motion_to_child(m.X, hinge.rows[j]);
      column(model.v_offset[k] + j, J, rates ? sign * motion_to_child(m.X, hinge.rates[j]) - cross_motion(m.V, J) : Vector6<S>::zero());
    }
  };
  int count = 0;
  for (const FrameStep& step : path.up) {
    check_interrupt_at(count++);
    const RelativeMotion<S> own = motion(step, hinge);
    if (step.kind == FrameStep::Kind::hinge) columns(step.number, S(1));
    m = composed<S>(own, m, part);
  }
  for (const FrameStep& step : path.down) {
    check_interrupt_at(count++);
    m = composed<S>(inverse<S>(motion(step, hinge), part), m, part);
    if (step.kind == FrameStep::Kind::hinge) columns(step.number, S(-1));
  }
  return m;
}

// ------------------------------------------------------------------ axes

// In which axes, and the velocity of which point.
//   body     the frame's own axes, its origin
//   aligned  the axes of the frame that it is relative to, its own origin
//   world    the axes of that frame, the point of the first one that is at that frame's origin
//   other    the axes of a third frame, its own origin
enum class MotionAxes { body, aligned, world, other };

template <class S>
inline Vector6<S> turned(const Matrix3<S>& R, const Vector6<S>& V) {
  return {R * V.angular, R * V.linear};
}

// V, or a column of a Jacobian. m: of the frame in what it is relative to; R: its axes in the third frame.
template <class S>
inline Vector6<S> in_axes(MotionAxes axes, const RelativeMotion<S>& m, const Matrix3<S>& R, const Vector6<S>& V) {
  switch (axes) {
    case MotionAxes::aligned: return turned(m.X.R, V);
    case MotionAxes::world: return motion_to_parent(m.X, V);
    case MotionAxes::other: return turned(R, V);
    default: return V;
  }
}

// The rate of in_axes(V), component by component, V_dot that of V. omega: the frame's angular velocity in the third, in its own axes.
template <class S>
inline Vector6<S> rate_in_axes(MotionAxes axes, const RelativeMotion<S>& m, const Matrix3<S>& R, const Vector3<S>& omega, const Vector6<S>& V, const Vector6<S>& V_dot) {
  const auto with = [&V_dot, &V](const Vector3<S>& w) { return Vector6<S>{V_dot.angular + cross(w, V.angular), V_dot.linear + cross(w, V.linear)}; };
  switch (axes) {
    case MotionAxes::aligned: return turned(m.X.R, with(m.V.angular));
    case MotionAxes::world: return motion_to_parent(m.X, V_dot + cross_motion(m.V, V));
    case MotionAxes::other: return turned(R, with(omega));
    default: return V_dot;
  }
}

// A in those axes; the classical one is p̈ of the point, v̇ + ω × v.
template <class S>
inline Vector6<S> acceleration_in_axes(MotionAxes axes, const RelativeMotion<S>& m, const Matrix3<S>& R, bool classical) {
  Vector6<S> A = in_axes(axes, m, R, m.A);
  if (classical) {
    const Vector6<S> V = in_axes(axes, m, R, m.V);
    A.linear = A.linear + cross(V.angular, V.linear);
  }
  return A;
}

}  // namespace pycraft
